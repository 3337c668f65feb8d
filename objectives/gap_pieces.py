"""How far a robot drives blind after it leaves a disc: the gap function of each direction, in closed pieces.

A ray along the way leaves disc i at an offset s to the left of its centre, at t = sqrt(r_i² - s²), and meets next
disc j, at t_j - sqrt(r_j² - (s - s_j)²). Over a range of offsets i and j stay the same, and the gap
g(s) = t_j - sqrt(r_j² - (s - s_j)²) - sqrt(r_i² - s²) is convex and has an integral in closed form. Pieces hold
over all offsets at which a disc can be left, that is, at which no other covers its edge. Summed over the discs of
a cell they are all that blind runs of any length ask for.

The plain functions here are the truth for `gap_pieces_kernels`.
"""

import math
from dataclasses import dataclass
from itertools import pairwise
from typing import Final

import numpy as np

from layoutopt.identity import FloatArray, IntArray
from objectives.disc_outline import crossing_offsets, distinct, free_area_m2, half_chord, images, under_circle
from objectives.periodic_discs import PeriodicDiscs, Sight, columns

_ROOT: Final = 1e-15


@dataclass(frozen=True, slots=True, kw_only=True)
class GapPieces:
    """The gap function of a sight in some directions.

    Attributes
    ----------
    direction_rad
        Directions of travel, shape (k,).
    start
        Pieces of direction i are the rows ``start[i]`` to ``start[i + 1]``, shape (k + 1,).
    rows
        Columns, m: the offsets from and to which a piece holds, the radius of the disc that is left, and t, s and
        radius of the disc that is met; t is infinite where none is met within ``longest_m``. Shape (p, 6).
    extents
        Least gap, largest gap, m, and integral of the gap, m², of each piece, shape (p, 3).
    free_m2, exposed_m
        Area of a cell that no disc covers, and total width over which its discs can be left, shape (k,).
    cell_area_m2
        Area of a cell.
    longest_m
        How far gaps were followed.
    """

    direction_rad: FloatArray
    start: IntArray
    rows: FloatArray
    extents: FloatArray
    free_m2: FloatArray
    exposed_m: FloatArray
    cell_area_m2: float
    longest_m: float

    def within(self, length_m: float) -> tuple[FloatArray, FloatArray]:
        """Return the sum over all exits of the shorter of gap and length, m², and the width of longer gaps, m.

        Both have shape (k,); the length is no more than ``longest_m``.
        """
        from objectives.gap_pieces_kernels import within

        area_m2, width_m = np.empty(len(self.direction_rad)), np.empty(len(self.direction_rad))
        within(self.rows, self.extents, self.start, self._followed(length_m), area_m2, width_m)
        return area_m2, width_m

    def within_plain(self, length_m: float) -> tuple[FloatArray, FloatArray]:
        """Return what `within` returns, by plain numpy."""
        length_m = self._followed(length_m)
        found = [
            _within(self.rows[begin:end], length_m) for begin, end in pairwise(int(place) for place in self.start)
        ]
        area_m2, width_m = np.array(found).reshape(-1, 2).T
        return area_m2, width_m

    def _followed(self, length_m: float) -> float:
        if not 0.0 <= length_m <= self.longest_m:
            raise ValueError(
                f"gaps were followed over 0 to {self.longest_m} m, and {length_m} m is not among them"
            )
        return float(length_m)


def gap_pieces(sight: Sight, direction_rad: FloatArray, longest_m: float) -> GapPieces:
    """Return the gap function of a sight in directions, shape (k,), up to a longest gap, by compiled code.

    The longest gap may be infinite where every gap ends.
    """
    from objectives.gap_pieces_kernels import extents, find_pieces

    given = columns(sight)
    direction_rad = np.array(direction_rad, dtype=np.float64)
    start, rows, free_m2, exposed_m = find_pieces(
        given.cell,
        given.centre,
        given.lever,
        given.radius,
        direction_rad + given.ahead_rad,
        direction_rad,
        float(longest_m),
    )
    return GapPieces(
        direction_rad=direction_rad,
        start=start,
        rows=rows,
        extents=extents(rows),
        free_m2=free_m2,
        exposed_m=exposed_m,
        cell_area_m2=sight.cell_area_m2,
        longest_m=float(longest_m),
    )


def gap_pieces_plain(sight: Sight, direction_rad: FloatArray, longest_m: float) -> GapPieces:
    """Return what `gap_pieces` returns, by brute force in plain numpy; the longest gap is finite."""
    direction_rad = np.array(direction_rad, dtype=np.float64)
    rows, free_m2, exposed_m = [], [], []
    for direction in direction_rad:
        discs = distinct(sight.at(float(direction)))
        rows.append(_pieces(discs, float(direction), longest_m))
        free_m2.append(free_area_m2(discs))
        exposed_m.append(float((rows[-1][:, 1] - rows[-1][:, 0]).sum()))
    joined = np.concatenate([np.empty((0, 6)), *rows])
    return GapPieces(
        direction_rad=direction_rad,
        start=np.cumsum([0, *(len(found) for found in rows)]),
        rows=joined,
        extents=_extents(joined),
        free_m2=np.array(free_m2),
        exposed_m=np.array(exposed_m),
        cell_area_m2=sight.cell_area_m2,
        longest_m=float(longest_m),
    )


def _pieces(discs: PeriodicDiscs, direction_rad: float, longest_m: float) -> FloatArray:
    """Return the pieces of all discs of a cell, cut wherever any two circles in reach cross or one begins."""
    ahead = np.array([math.cos(direction_rad), math.sin(direction_rad)])
    aside = np.array([-ahead[1], ahead[0]])
    largest_m = float(discs.radius_m.max())
    rows = []
    for centre_m, own in zip(discs.centre_m, discs.radius_m, strict=True):
        other, offset_m = images(discs, centre_m, longest_m + own + 2.0 * largest_m)
        t, s, r = offset_m @ ahead, offset_m @ aside, discs.radius_m[other]
        near = (np.abs(s) < own + r) & (t > -own - r) & (np.hypot(t, s) > 0.0)
        t, s, r = t[near], s[near], r[near]
        crossings = [crossing_offsets(own, t, s, r)]
        for k in range(len(t)):
            crossings.append(s[k] + crossing_offsets(r[k], t - t[k], s - s[k], r))
        cuts = np.unique(np.clip(np.concatenate([[-own, own], s - r, s + r, *crossings]), -own, own))
        low, high = cuts[:-1], cuts[1:]
        middle = 0.5 * (low + high)
        leaves = half_chord(own, middle)[:, None]
        hit = np.abs(middle[:, None] - s) < r
        half = half_chord(r, middle[:, None] - s)
        covered = (hit & (t - half < leaves) & (t + half > leaves)).any(axis=1)
        entry = np.where(hit & (t > leaves), t - half, math.inf)
        for k in np.flatnonzero(~covered).tolist():
            first = int(np.argmin(entry[k])) if len(t) else -1
            met = (t[first], s[first], r[first]) if len(t) and entry[k, first] < math.inf else (math.inf, 0.0, 0.0)
            rows.append((low[k], high[k], own, *met))
    return np.array(rows, dtype=np.float64).reshape(-1, 6)


def _within(rows: FloatArray, length_m: float) -> tuple[float, float]:
    """Return the integral of the shorter of gap and length over pieces, and the width of longer gaps."""
    met = np.isfinite(rows[:, 3])
    width_m = float((rows[~met, 1] - rows[~met, 0]).sum())
    area_m2 = length_m * width_m
    for row in rows[met]:
        begin, end, own_m, t_m, s_m, r_m = (float(value) for value in row)
        low_m, high_m = _shorter(row, length_m)
        longer_m = (low_m - begin) + (end - high_m)
        width_m += longer_m
        area_m2 += length_m * longer_m + t_m * (high_m - low_m)
        shift_m = np.array([s_m, 0.0])
        area_m2 -= float(under_circle(np.array([r_m, own_m]), low_m - shift_m, high_m - shift_m).sum())
    return area_m2, width_m


def _shorter(row: FloatArray, length_m: float) -> tuple[float, float]:
    """Return the offsets between which the gap of a piece is no longer than a length; the same twice if nowhere.

    The gap is convex, and least where both circles have the same slope: there is a root on either side at most.
    """
    from scipy.optimize import brentq

    begin, end, own_m, t_m, s_m, r_m = (float(value) for value in row)

    def beyond_m(offset: float) -> float:
        chords = half_chord(np.array([r_m, own_m]), np.array([offset - s_m, offset]))
        return t_m - float(chords.sum()) - length_m

    least_m = min(max(s_m * own_m / (own_m + r_m), begin), end)
    if beyond_m(least_m) >= 0.0:
        return least_m, least_m
    return (
        brentq(beyond_m, begin, least_m, xtol=_ROOT) if beyond_m(begin) > 0.0 else begin,
        brentq(beyond_m, least_m, end, xtol=_ROOT) if beyond_m(end) > 0.0 else end,
    )


def _extents(rows: FloatArray) -> FloatArray:
    """Return what `GapPieces.extents` says; infinite where no disc is met."""
    low, high, own, t, s, r = rows.T
    found = np.full((len(rows), 3), math.inf)
    met = np.isfinite(t)

    def gap(offset: FloatArray) -> FloatArray:
        return np.asarray((t - half_chord(r, offset - s) - half_chord(own, offset))[met])

    # The gap is convex in the offset, and least where both circles have the same slope.
    found[met, 0] = gap(np.clip(s * own / (own + r), low, high))
    found[met, 1] = np.maximum(gap(low), gap(high))
    whole = t[met] * (high - low)[met] - under_circle(own[met], low[met], high[met])
    found[met, 2] = whole - under_circle(r[met], (low - s)[met], (high - s)[met])
    return found
