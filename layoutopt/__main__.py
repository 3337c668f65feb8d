"""``python -m layoutopt`` is the same as ``layoutopt``."""

from layoutopt.cli import main

main()
