"""Rules that several families of patterns share, each with the name under which it is told."""

import math
from typing import Final

import numpy as np

from layoutopt.units import format_length

_RELATIVE: Final = 1e-9
"""Slack of every rule, so that a tile of exactly the size it needs passes whatever the last bit."""


def check_lengths(**lengths_m: float) -> None:
    """Check that lengths are positive and finite.

    Raises
    ------
    ValueError
        With the first that is not, by its name without the unit.
    """
    for name, length_m in lengths_m.items():
        if not (length_m > 0.0 and math.isfinite(length_m)):
            word = name.removesuffix("_m").replace("_", " ")
            raise ValueError(f"{word} must be positive and finite, got {length_m}")


def check_tile(tile_m: float, least_m: float, rule: str) -> None:
    """Check that a tile is as large as a rule asks.

    Raises
    ------
    ValueError
        With the rule and the least tile.
    """
    if tile_m < least_m * (1.0 - _RELATIVE):
        raise ValueError(
            f"a tile of {format_length(tile_m)} is too small: {rule} asks for at least {format_length(least_m)}"
        )


def check_seed(seed: int) -> None:
    """Check that a seed is zero or a positive whole number.

    Raises
    ------
    ValueError
        If it is not.
    """
    if isinstance(seed, bool) or not isinstance(seed, int | np.integer) or seed < 0:
        raise ValueError(f"a seed is zero or a positive whole number, got {seed!r}")
