"""What comes back from an installed floor: replay of a logged drive, and noise and read rates fitted from it."""
