"""Specs: TOML files that say what is asked, read with all faults at once."""
