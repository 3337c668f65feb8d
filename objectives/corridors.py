"""Corridors: strips of the plane that no disc enters, along which a robot drives blind for ever.

Only lines along a period of the pattern can pass all discs: those in any other direction come as near as one
likes to every centre. Lines along a primitive period vector v repeat after w = A / |v| across the way, and discs
of radius r leave something of that free only if w > 2 r. So there are finitely many corridors, and they are found
exactly, as the complement of a union of intervals on a circle. The share of blind lines is not continuous in the
direction: sampling directions would miss nearly all corridors.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Final

import numpy as np

from layoutopt.geometry import reduced_cell
from layoutopt.identity import FloatArray, IntArray
from objectives.periodic_discs import PeriodicDiscs, Sight, columns

_LEAST: Final = 1e-12
"""Strips narrower than this, relative to the side of a square cell, are rounding."""
_SAME_DIRECTION_RAD: Final = 1e-12
_BLOCK: Final = 1 << 20
"""Intervals that are sorted at once."""
_TRIED: Final = (16, 128)
"""Many discs seldom leave a corridor that a few of them do not close: these many are tried first."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Corridor:
    """A strip without discs.

    Attributes
    ----------
    direction_rad
        Direction along it: in [0, pi) for discs that stay as they are, whose corridors run both ways, and in
        [0, 2 pi) for a group of antennas.
    width_m
        Its width.
    blind_fraction
        Share of all lines in its direction that are blind, those of other corridors in that direction included.
    vector_m
        Primitive period vector along it; across the way all repeats after the cell's area over its length.
    """

    direction_rad: float
    width_m: float
    blind_fraction: float
    vector_m: tuple[float, float]

    @property
    def weight_m3(self) -> float:
        """Width squared times the length of the period: its part in the tail of blind runs."""
        return self.width_m**2 * math.hypot(*self.vector_m)


def corridors_of(sight: Sight) -> tuple[Corridor, ...]:
    """Return all corridors of a sight, sorted by direction; none if every straight way meets a disc in the end."""
    longest_m = sight.cell_area_m2 / (2.0 * float(sight.radius_m.max()))
    found = []
    for vector_m in primitive_vectors(sight.cell_m, longest_m):
        if not isinstance(sight, PeriodicDiscs):
            vector_m = np.concatenate([vector_m, -vector_m])
        found += _corridors_along(sight, vector_m)
    return tuple(sorted(found, key=lambda corridor: corridor.direction_rad))


def corridors_in(sight: Sight, direction_rad: float) -> tuple[Corridor, ...]:
    """Return the corridors in a direction of travel; one within 1e-12 rad of a period's is its own."""
    longest_m = sight.cell_area_m2 / (2.0 * float(sight.radius_m.max()))
    way = np.array([math.cos(direction_rad), math.sin(direction_rad)])
    found: list[Corridor] = []
    for vector_m in primitive_vectors(sight.cell_m, longest_m):
        across_m = vector_m[:, 1] * way[0] - vector_m[:, 0] * way[1]
        same = np.abs(across_m) <= _SAME_DIRECTION_RAD * np.hypot(*vector_m.T)
        vector_m = vector_m[same] * np.sign(vector_m[same] @ way)[:, None]
        found += _corridors_along(sight, vector_m)
    return tuple(found)


def primitive_vectors(cell_m: FloatArray, longest_m: float) -> Iterator[FloatArray]:
    """Yield, in blocks of shape (k, 2), the primitive period vectors shorter than a length, one of each v and -v.

    Their angles lie in [0, pi).
    """
    cell_m = reduced_cell(cell_m)
    area_m2 = abs(float(np.linalg.det(cell_m)))
    reach = [int(longest_m * side_m / area_m2) for side_m in np.hypot(*cell_m[::-1].T)]
    rows = max(1, _BLOCK // (2 * reach[1] + 1))
    for first in range(0, reach[0] + 1, rows):
        steps = np.meshgrid(
            np.arange(first, min(first + rows, reach[0] + 1)), np.arange(-reach[1], reach[1] + 1), indexing="ij"
        )
        i, j = (axis.ravel() for axis in steps)
        once = (np.gcd(i, j) == 1) & ((i > 0) | (j > 0))
        vector_m = np.stack([i[once], j[once]], axis=1) @ cell_m
        vector_m = vector_m[np.hypot(*vector_m.T) < longest_m]
        angle_rad = np.arctan2(vector_m[:, 1], vector_m[:, 0])
        below = (angle_rad < -_SAME_DIRECTION_RAD) | (angle_rad > math.pi - _SAME_DIRECTION_RAD)
        yield np.where(below[:, None], -vector_m, vector_m)


def _corridors_along(sight: Sight, vector_m: FloatArray) -> list[Corridor]:
    """Return the corridors along period vectors, shape (k, 2)."""
    given = columns(sight)
    cos, sin = math.cos(given.ahead_rad), math.sin(given.ahead_rad)
    # How far to the left of its way the robot carries each antenna.
    aside_m = sin * given.lever[:, 0] + cos * given.lever[:, 1]
    least_m = _LEAST * math.sqrt(sight.cell_area_m2)
    found = []
    for begin in range(0, len(vector_m), max(1, _BLOCK // len(given.radius))):
        block_m = vector_m[begin : begin + max(1, _BLOCK // len(given.radius))]
        for count in (*(tried for tried in _TRIED if 4 * tried < len(given.radius)), len(given.radius)):
            length_m = np.hypot(*block_m.T)[:, None]
            width_m = sight.cell_area_m2 / length_m
            # Not the first ones, which may be neighbours: spread over the cell.
            chosen: IntArray = np.arange(count) * len(given.radius) // count
            across_m = block_m[:, :1] * given.centre[chosen, 1] - block_m[:, 1:] * given.centre[chosen, 0]
            gap_m = _open_strips(across_m / length_m - aside_m[chosen], given.radius[chosen], width_m)
            block_m, gap_m, width_m = (
                values[(gap_m > least_m).any(axis=1)] for values in (block_m, gap_m, width_m)
            )
        for vector, gaps, period_m in zip(block_m, gap_m, width_m[:, 0], strict=True):
            open_m = gaps[gaps > least_m]
            found += [
                Corridor(
                    direction_rad=_direction_of(vector, both_ways=isinstance(sight, PeriodicDiscs)),
                    width_m=float(wide_m),
                    blind_fraction=float(open_m.sum() / period_m),
                    vector_m=(float(vector[0]), float(vector[1])),
                )
                for wide_m in open_m
            ]
    return found


def _open_strips(place_m: FloatArray, radius_m: FloatArray, period_m: FloatArray) -> FloatArray:
    """Return the widths that intervals about places, shape (k, n), leave of circles, shape (k, 1); open if > 0."""
    begin_m = np.mod(place_m - radius_m, period_m)
    order = np.argsort(begin_m, axis=1, kind="stable")
    begin_m = np.take_along_axis(begin_m, order, axis=1)
    end_m = begin_m + 2.0 * radius_m[order]
    # What passes the end of the circle hides its begin.
    wrapped_m = end_m.max(axis=1, keepdims=True) - period_m
    reach_m = np.maximum.accumulate(np.concatenate([wrapped_m, end_m], axis=1), axis=1)[:, 1:]
    return np.asarray(np.concatenate([begin_m[:, 1:], begin_m[:, :1] + period_m], axis=1) - reach_m)


def _direction_of(vector: FloatArray, *, both_ways: bool) -> float:
    turn_rad = math.pi if both_ways else 2.0 * math.pi
    angle_rad = math.atan2(vector[1], vector[0]) % turn_rad
    # A vector that rounding put just below the x axis points along it.
    return angle_rad if turn_rad - angle_rad > _SAME_DIRECTION_RAD else 0.0
