"""Covering: the fewest, or cheapest, slots such that every row sees as many chosen ones as it demands."""
