"""Simulated drives: motion along routes, sensing with faults, and trials scored per replication."""
