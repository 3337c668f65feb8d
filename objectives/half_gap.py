"""The half-gap rule of han2006: the error of one reading of a box that always holds tags, no bound of a disc's."""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np

from layoutopt.identity import FloatArray
from layoutopt.layout import TagPattern
from objectives.box_error import rectangular_cell_m

PUBLISHED_SQUARE: Final = 0.707
"""Eq. 16 of han2006, in pitches."""
PUBLISHED_TRIANGULAR: Final = 0.58
"""Eq. 20 of han2006, in pitches; the arithmetic of its Eq. 19 gives 0.559."""


@dataclass(frozen=True, slots=True, kw_only=True)
class HalfGap:
    """Half-gap error of a pattern, m: the printed one, if the paper prints one, and the derived one."""

    published_m: float | None
    derived_m: float


def half_gap_bound(pattern: TagPattern) -> HalfGap:
    """Return the half-gap error sqrt((g_x/2)^2 + (g_y/2)^2) of a pattern with an axis-parallel cell.

    g_x is the largest gap between neighbouring columns of tags (places that differ in x, whatever their y) and
    g_y between rows, over the whole period. The published numbers hold for the square pattern and for rows one
    pitch apart that are shifted by half a pitch.

    Raises
    ------
    ValueError
        If the rule does not apply; the message says why.

    References
    ----------
    han2006, Eq. 15-16 (0.707 d, square) and Eq. 19-20 (printed 0.58 d, derived 0.559 d, triangular).

    Examples
    --------
    >>> from layoutopt.patterns.square import square
    >>> round(half_gap_bound(square(pitch_m=0.1)).derived_m, 5)
    0.07071
    """
    width_m, height_m = rectangular_cell_m(pattern)
    gap_x_m = _largest_gap(pattern.points_m[:, 0], width_m)
    gap_y_m = _largest_gap(pattern.points_m[:, 1], height_m)
    return HalfGap(published_m=_published(pattern), derived_m=math.hypot(gap_x_m / 2.0, gap_y_m / 2.0))


def _published(pattern: TagPattern) -> float | None:
    pitch_m = float(pattern.parameters.get("pitch_m", math.nan))
    if pattern.name == "square":
        return PUBLISHED_SQUARE * pitch_m
    row_gap_m = float(pattern.parameters.get("row_gap_m", math.nan))
    if pattern.name == "triangular" and math.isclose(row_gap_m, pitch_m):
        return PUBLISHED_TRIANGULAR * pitch_m
    return None


def _largest_gap(places_m: FloatArray, period_m: float) -> float:
    """Return the largest gap between different places on a line that repeats after ``period_m``."""
    places_m = np.sort(np.mod(places_m, period_m))
    gaps_m = np.diff(places_m, append=places_m[0] + period_m)
    return float(gaps_m.max())
