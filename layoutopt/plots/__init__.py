"""Figures: one a file, each a function that draws into ``ax`` or makes its own."""
