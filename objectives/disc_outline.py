"""What periodic discs cover: the arcs of their outline and the area that they leave free.

Brute force in plain numpy, the truth for `disc_outline_kernels`.
"""

import math
from itertools import pairwise
from typing import Final

import numpy as np

from layoutopt.geometry import reduced_cell
from layoutopt.identity import FloatArray, IntArray
from objectives.periodic_discs import PeriodicDiscs

_SAME: Final = 1e-12
"""Discs that differ by less, relative to the largest radius, are one disc, and shorter arcs none: rounding."""


def images(discs: PeriodicDiscs, place_m: FloatArray, reach_m: float) -> tuple[IntArray, FloatArray]:
    """Return the discs centred within a reach of a place: index, shape (k,), and offset from it, shape (k, 2)."""
    cell_m = reduced_cell(discs.cell_m)
    steps = (discs.centre_m - place_m) @ np.linalg.inv(cell_m)
    nearest_m = (steps - np.round(steps)) @ cell_m
    # Rows of places along one period lie the cell's height over it apart.
    rows = [math.ceil(reach_m * side_m / discs.cell_area_m2) + 1 for side_m in np.hypot(*cell_m[::-1].T)]
    i, j = np.meshgrid(*(np.arange(-count, count + 1) for count in rows), indexing="ij")
    shift_m = np.stack([i.ravel(), j.ravel()], axis=1) @ cell_m
    offset_m = (nearest_m[:, None, :] + shift_m[None, :, :]).reshape(-1, 2)
    index = np.repeat(np.arange(len(discs.centre_m)), len(shift_m))
    close = np.hypot(*offset_m.T) <= reach_m
    return index[close], offset_m[close]


def distinct(discs: PeriodicDiscs) -> PeriodicDiscs:
    """Return the discs without those that lie within another, such as one place under two antennas."""
    largest_m = float(discs.radius_m.max())
    kept = []
    for number, (centre_m, radius_m) in enumerate(zip(discs.centre_m, discs.radius_m, strict=True)):
        other, offset_m = images(discs, centre_m, largest_m)
        theirs_m = discs.radius_m[other]
        inside = np.hypot(*offset_m.T) <= theirs_m - radius_m + _SAME * largest_m
        larger = (theirs_m > radius_m) | ((theirs_m == radius_m) & (other < number))
        if not (inside & larger).any():
            kept.append(number)
    return PeriodicDiscs(cell_m=discs.cell_m, centre_m=discs.centre_m[kept], radius_m=discs.radius_m[kept])


def shown_arcs(discs: PeriodicDiscs) -> FloatArray:
    """Return the arcs that no other disc covers: rows of (disc, begin, length), rad, shape (k, 3).

    ``discs`` are `distinct`.
    """
    arcs = []
    largest_m = float(discs.radius_m.max())
    for number, (centre_m, radius_m) in enumerate(zip(discs.centre_m, discs.radius_m, strict=True)):
        other, offset_m = images(discs, centre_m, radius_m + largest_m)
        away_m, theirs_m = np.hypot(*offset_m.T), discs.radius_m[other]
        # By the law of cosines; a smaller disc inside this one hides nothing of its edge.
        hides = (away_m > 0.0) & (away_m < radius_m + theirs_m) & (away_m > radius_m - theirs_m)
        away_m, offset_m, theirs_m = away_m[hides], offset_m[hides], theirs_m[hides]
        cosine = (away_m**2 + radius_m**2 - theirs_m**2) / (2.0 * away_m * radius_m)
        half_rad = np.arccos(np.clip(cosine, -1.0, 1.0))
        begin_rad = np.arctan2(offset_m[:, 1], offset_m[:, 0]) - half_rad
        arcs += [(number, *arc) for arc in _left_of_circle(begin_rad, 2.0 * half_rad)]
    return np.array(arcs, dtype=np.float64).reshape(-1, 3)


def _left_of_circle(begin_rad: FloatArray, length_rad: FloatArray) -> list[tuple[float, float]]:
    """Return begin and length of what arcs leave of a circle."""
    if len(begin_rad) == 0:
        return [(0.0, 2.0 * math.pi)]
    begin_rad = np.mod(begin_rad, 2.0 * math.pi)
    order = np.argsort(begin_rad, kind="stable")
    begins, ends = begin_rad[order], (begin_rad + length_rad)[order]
    # What passes the angle zero hides the begin of the next turn.
    hidden_to = np.maximum.accumulate(np.append(ends.max() - 2.0 * math.pi, ends))[1:]
    following = np.append(begins[1:], begins[0] + 2.0 * math.pi)
    return [
        (float(end), float(gap)) for end, gap in zip(hidden_to, following - hidden_to, strict=True) if gap > _SAME
    ]


def free_area_m2(discs: PeriodicDiscs) -> float:
    """Return the area of one cell that no disc covers, m².

    Lines along the shorter period close after its length. Between the offsets at which a disc begins or ends or
    two circles cross, the same arcs bound the gaps on all lines, so that these integrate in closed form.
    """
    cell_m = reduced_cell(discs.cell_m)
    length_m = float(np.hypot(*cell_m[0]))
    frame = np.array([[cell_m[0, 0], -cell_m[0, 1]], [cell_m[0, 1], cell_m[0, 0]]]) / length_m
    period = cell_m[1] @ frame
    period = period if period[1] > 0.0 else -period
    # Every disc that meets the strip of one period across the lines; along them places count modulo the period.
    centre = discs.centre_m @ frame
    centre = centre - np.floor(centre[:, 1:] / period[1]) * period
    largest_m = float(discs.radius_m.max())
    rows, turns = math.ceil(largest_m / period[1]), math.ceil(2.0 * largest_m / length_m) + 1
    row = np.arange(-rows, rows + 1)
    t, s = (centre[:, None, :] + row[None, :, None] * period).reshape(-1, 2).T
    t, r = np.mod(t, length_m), np.repeat(discs.radius_m, len(row))
    turn_m = np.arange(-turns, turns + 1) * length_m
    ends = [s - r, s + r]
    for own_t, own_s, own_r in zip(t, s, r, strict=True):
        along = np.add.outer(turn_m, t - own_t).ravel()
        across, other = np.tile(s - own_s, len(turn_m)), np.tile(r, len(turn_m))
        ends.append(own_s + crossing_offsets(own_r, along, across, other))
    cuts = np.unique(np.clip(np.concatenate([[0.0, period[1]], *ends]), 0.0, period[1]))
    return math.fsum(_free_strip(t, s, r, length_m, low, high) for low, high in pairwise(cuts))


def crossing_offsets(radius: float, along: FloatArray, across: FloatArray, other: FloatArray) -> FloatArray:
    """Return the offsets at which a circle about the origin crosses circles of other radii, all in one array."""
    away = np.hypot(along, across)
    # Those that touch count: on the line through the spot they leave nothing free, beside it they do.
    meets = (away > np.abs(radius - other)) & (away < (radius + other) * (1.0 + _SAME))
    along, across, other, away = along[meets], across[meets], other[meets], away[meets]
    share = (away**2 + radius**2 - other**2) / (2.0 * away)
    half = np.sqrt(np.maximum(radius**2 - share**2, 0.0))
    return np.concatenate([(share * across + sign * half * along) / away for sign in (-1.0, 1.0)])


def half_chord(radius: FloatArray, offset: FloatArray) -> FloatArray:
    """Return half the chord of a circle at an offset from its centre, any shape; zero beyond it."""
    return np.asarray(np.sqrt(np.maximum((radius - offset) * (radius + offset), 0.0)))


def under_circle(radius: FloatArray, low: FloatArray, high: FloatArray) -> FloatArray:
    """Return the integral of half a chord between two offsets from the centre, any shape."""
    at_low, at_high = half_chord(radius, low), half_chord(radius, high)
    # By arctan and not by arcsin, which loses half of the digits near the edge of the disc.
    turn_rad = np.arctan2(high, at_high) - np.arctan2(low, at_low)
    return np.asarray(0.5 * (high * at_high - low * at_low + radius**2 * turn_rad))


def _free_strip(t: FloatArray, s: FloatArray, r: FloatArray, length: float, low: float, high: float) -> float:
    """Return the free area between two offsets between which no arc begins, ends or crosses another."""
    middle, width = 0.5 * (low + high), high - low
    hit = np.abs(middle - s) < r
    if not hit.any():
        return length * width
    half = half_chord(r[hit], middle - s[hit])
    turn = np.floor((t[hit] - half) / length)
    order = np.argsort(t[hit] - half - turn * length, kind="stable")
    half, centre = half[order], (t[hit] - turn * length)[order]
    under = under_circle(r[hit], low - s[hit], high - s[hit])[order]
    # Gaps of a second turn: in the first, a disc that began before its first one would be missed.
    half, under, centre = np.tile(half, 2), np.tile(under, 2), np.concatenate([centre, centre + length])
    count = len(order)
    following = np.arange(count, 2 * count)
    last = np.array([np.argmax(centre[:k] + half[:k]) for k in following])
    free = centre[following] - half[following] > centre[last] + half[last]
    gaps = (centre[following] - centre[last]) * width - under[following] - under[last]
    return float(gaps[free].sum())
