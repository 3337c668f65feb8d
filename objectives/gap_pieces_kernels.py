"""Compiled search for the gaps between periodic discs; the plain twin and truth is `gap_pieces`.

Discs lie in buckets that cut the cell, so that a ray looks only at the buckets in its way. All lengths are in one
unit, all angles in radians; ``t`` counts along the way and ``s`` to its left.
"""

import math
from typing import Final

import numpy as np
from numba import njit

from layoutopt.identity import FloatArray, IntArray
from objectives.disc_outline_kernels import bucket_counts, outline, placed

COLUMNS: Final = 6
_SLIVER: Final = 1e-14
"""Parts of a disc narrower than this share of the largest radius are rounding."""
_HALF_PI: Final = 0.5 * math.pi
_compiled = njit(cache=True, error_model="numpy")


@_compiled
def find_pieces(
    cell: FloatArray,
    centre: FloatArray,
    lever: FloatArray,
    radius: FloatArray,
    heading: FloatArray,
    direction: FloatArray,
    longest: float,
) -> tuple[IntArray, FloatArray, FloatArray, FloatArray]:
    """Return the pieces of the gap function in each direction, and what the discs leave free.

    Parameters
    ----------
    cell
        Rows are the reduced period vectors, shape (2, 2).
    centre, lever, radius
        Disc k lies at ``centre[k]`` less ``lever[k]`` turned by the heading; shapes (n, 2), (n, 2) and (n,).
    heading, direction
        Heading of the robot and direction of travel, shape (k,).
    longest
        Gaps are followed no farther than this.

    Returns
    -------
    start
        Pieces of direction i are the rows ``start[i]`` to ``start[i + 1]``, shape (k + 1,).
    pieces
        Shape (p, 6), as `gap_pieces.Pieces` tells them.
    free, exposed
        Area of a cell that no disc covers, and width over which discs can be left; shape (k,).
    """
    count = direction.size
    start = np.zeros(count + 1, np.int64)
    pieces = np.empty((64 + 8 * count * radius.size, COLUMNS))
    free, exposed = np.zeros(count), np.zeros(count)
    fixed = not np.any(lever)
    grid = bucket_counts(cell, radius.size)
    place, reach, first = placed(cell, centre, lever, radius, 0.0 if fixed else heading[0], grid)
    arcs, free_area = outline(cell, place, reach, first, grid)
    found = 0
    for number in range(count):
        if number > 0 and not fixed:
            place, reach, first = placed(cell, centre, lever, radius, heading[number], grid)
            arcs, free_area = outline(cell, place, reach, first, grid)
        free[number] = free_area
        pieces, found, exposed[number] = _follow(
            cell, place, reach, first, grid, arcs, direction[number], longest, pieces, found
        )
        start[number + 1] = found
    return start, pieces[:found].copy(), free, exposed


@_compiled
def _follow(
    cell: FloatArray,
    place: FloatArray,
    radius: FloatArray,
    first: IntArray,
    grid: tuple[int, int],
    arcs: FloatArray,
    direction: float,
    longest: float,
    pieces: FloatArray,
    found: int,
) -> tuple[FloatArray, int, float]:
    """Add the pieces of one direction; return them, in more room if needed, their number and the exposed width."""
    cos, sin = math.cos(direction), math.sin(direction)
    along, left = np.empty(radius.size), np.empty(radius.size)
    for k in range(radius.size):
        along[k], left[k] = cos * place[k, 0] + sin * place[k, 1], cos * place[k, 1] - sin * place[k, 0]
    period = np.empty((2, 2))
    for axis in range(2):
        period[axis, 0] = cos * cell[axis, 0] + sin * cell[axis, 1]
        period[axis, 1] = cos * cell[axis, 1] - sin * cell[axis, 0]
    least = _SLIVER * radius.max() if radius.size else 0.0
    segment, spare = np.empty((32, 5)), np.empty((32, 5))
    exposed = 0.0
    for arc in range(arcs.shape[0]):
        k = int(arcs[arc, 0])
        begin = arcs[arc, 1] - direction + _HALF_PI
        begin -= 2.0 * math.pi * math.floor(begin / (2.0 * math.pi))
        for turn in range(2):
            # Angles on the forward half, counted from the right side of the disc.
            low = max(begin, 2.0 * math.pi * turn)
            high = min(begin + arcs[arc, 2], math.pi + 2.0 * math.pi * turn)
            if not low < high:
                continue
            if arcs[arc, 2] >= 2.0 * math.pi:
                low, high = 0.0, math.pi
            right, left_end = -radius[k] * math.cos(low), -radius[k] * math.cos(high)
            if left_end - right > least:
                exposed += left_end - right
                segment, spare, count = _march(
                    first, grid, along, left, radius, period, k, right, left_end, longest, least, segment, spare
                )
                if found + count > pieces.shape[0]:
                    larger = np.empty((2 * pieces.shape[0] + count, COLUMNS))
                    larger[:found] = pieces[:found]
                    pieces = larger
                for number in range(count):
                    pieces[found, 0], pieces[found, 1] = segment[number, 0], segment[number, 1]
                    pieces[found, 2], pieces[found, 3] = radius[k], segment[number, 2]
                    pieces[found, 4], pieces[found, 5] = segment[number, 3], segment[number, 4]
                    found += 1
            if arcs[arc, 2] >= 2.0 * math.pi:
                break
    return pieces, found, exposed


@_compiled
def _march(
    first: IntArray,
    grid: tuple[int, int],
    along: FloatArray,
    left: FloatArray,
    radius: FloatArray,
    period: FloatArray,
    k: int,
    right: float,
    left_end: float,
    longest: float,
    least: float,
    segment: FloatArray,
    spare: FloatArray,
) -> tuple[FloatArray, FloatArray, int]:
    """Find what is met first by rays that leave disc k between two offsets, row of buckets by row of buckets.

    Segments are rows of (from, to, t, s, radius): whose disc is met over which offsets; t is infinite where
    nothing is met within the longest gap.
    """
    largest = radius.max()
    segment[0, 0], segment[0, 1], segment[0, 2] = right, left_end, math.inf
    segment[0, 3], segment[0, 4] = 0.0, 0.0
    count = 1
    # Rows run along the bucket side that lies more across the way, so that each crosses it only once.
    row_axis = 0 if abs(period[0, 1]) * grid[1] >= abs(period[1, 1]) * grid[0] else 1
    step_axis = 1 - row_axis
    row_t, row_s = period[row_axis, 0] / grid[row_axis], period[row_axis, 1] / grid[row_axis]
    step_t, step_s = period[step_axis, 0] / grid[step_axis], period[step_axis, 1] / grid[step_axis]
    slope = row_t / row_s
    advance = step_t - step_s * slope
    low, high = right, left_end
    nearest = min(slope * (low - largest + left[k]), slope * (high + largest + left[k])) - along[k]
    farthest = max(slope * (low - largest + left[k]), slope * (high + largest + left[k])) - along[k]
    sense = 1 if advance > 0.0 else -1
    row = math.floor(-farthest / advance) - sense
    while True:
        # No disc of this row or of a later one begins before this.
        earliest = nearest + min(row * advance, (row + 1) * advance) - largest
        low, high, worst = math.inf, -math.inf, -math.inf
        for number in range(count):
            limit = longest + radius[k]
            if segment[number, 2] < math.inf:
                limit = min(limit, max(_entry(segment, number, 0), _entry(segment, number, 1)))
            if limit > earliest:
                low, high = min(low, segment[number, 0]), max(high, segment[number, 1])
                worst = max(worst, limit)
        if not low < high:
            return segment, spare, count
        nearest = min(slope * (low - largest + left[k]), slope * (high + largest + left[k])) - along[k]
        shift = (row * step_s, (row + 1) * step_s)
        ends = (
            (low - largest + left[k] - max(shift)) / row_s,
            (high + largest + left[k] - min(shift)) / row_s,
        )
        step_turn = row // grid[step_axis]
        step_bucket = row - step_turn * grid[step_axis]
        for column in range(math.floor(min(ends)), math.floor(max(ends)) + 1):
            row_turn = column // grid[row_axis]
            row_bucket = column - row_turn * grid[row_axis]
            number = row_bucket + step_bucket * grid[0] if row_axis == 0 else step_bucket + row_bucket * grid[0]
            shift_t = row_turn * period[row_axis, 0] + step_turn * period[step_axis, 0] - along[k]
            shift_s = row_turn * period[row_axis, 1] + step_turn * period[step_axis, 1] - left[k]
            for other in range(first[number], first[number + 1]):
                t, s, r = along[other] + shift_t, left[other] + shift_s, radius[other]
                if t <= 0.0 or t - r >= worst or s + r <= low or s - r >= high:
                    continue
                begin, end = max(right, s - r), min(left_end, s + r)
                middle = 0.5 * (begin + end)
                # Where a disc is left, no other covers it: the one that is met lies ahead as a whole, or behind.
                if not begin < end or t < _half_chord(radius[k], middle):
                    continue
                if 5 * count + 5 > spare.shape[0]:
                    larger = np.empty((2 * (5 * count + 5), 5))
                    larger[:count] = segment[:count]
                    segment, spare = larger, np.empty((2 * (5 * count + 5), 5))
                count = _insert(segment, count, t, s, r, begin, end, least, spare)
                segment, spare = spare, segment
        row += sense


@_compiled
def _half_chord(radius: float, offset: float) -> float:
    return math.sqrt(max(0.0, (radius - offset) * (radius + offset)))


@_compiled
def _entry(segment: FloatArray, number: int, end: int) -> float:
    """Return where the disc of a segment begins on the ray at one of its ends."""
    return float(segment[number, 2] - _half_chord(segment[number, 4], segment[number, end] - segment[number, 3]))


@_compiled
def _insert(
    segment: FloatArray,
    count: int,
    t: float,
    s: float,
    r: float,
    begin: float,
    end: float,
    least: float,
    out: FloatArray,
) -> int:
    """Write the segments with one more disc, which may be met between two offsets; return how many there are."""
    made = 0
    for number in range(count):
        low, high = max(segment[number, 0], begin), min(segment[number, 1], end)
        old_t, old_s, old_r = segment[number, 2], segment[number, 3], segment[number, 4]
        if not high - low > least:
            made = _append(out, made, segment[number, 0], segment[number, 1], old_t, old_s, old_r, least)
            continue
        made = _append(out, made, segment[number, 0], low, old_t, old_s, old_r, least)
        if old_t == math.inf:
            made = _append(out, made, low, high, t, s, r, least)
        else:
            first_cut, second_cut = low, high
            away_t, away_s = t - old_t, s - old_s
            away = math.hypot(away_t, away_s)
            if away > 0.0:
                share = 0.5 * (away + (old_r - r) * (old_r + r) / away)
                if abs(share) < old_r:
                    half = _half_chord(old_r, share)
                    middle, spread = old_s + share * away_s / away, half * abs(away_t) / away
                    first_cut, second_cut = max(middle - spread, low), min(middle + spread, high)
            first_cut, second_cut = min(first_cut, high), max(second_cut, low)
            cut = (low, first_cut, second_cut, high)
            for part in range(3):
                middle = 0.5 * (cut[part] + cut[part + 1])
                if t - _half_chord(r, middle - s) < old_t - _half_chord(old_r, middle - old_s):
                    made = _append(out, made, cut[part], cut[part + 1], t, s, r, least)
                else:
                    made = _append(out, made, cut[part], cut[part + 1], old_t, old_s, old_r, least)
        made = _append(out, made, high, segment[number, 1], old_t, old_s, old_r, least)
    return made


@_compiled
def _append(
    out: FloatArray, made: int, low: float, high: float, t: float, s: float, r: float, least: float
) -> int:
    """Add a segment; it joins the last one if it is of the same disc, or no wider than rounding."""
    if not high > low:
        return made
    if made > 0 and (high - low <= least or (out[made - 1, 2] == t and out[made - 1, 3] == s)):
        out[made - 1, 1] = high
        return made
    out[made, 0], out[made, 1], out[made, 2], out[made, 3], out[made, 4] = low, high, t, s, r
    return made + 1


@_compiled
def extents(pieces: FloatArray) -> FloatArray:
    """Return the least gap, the largest gap and the integral of the gap for each piece, shape (p, 3)."""
    found = np.empty((pieces.shape[0], 3))
    for row in range(pieces.shape[0]):
        low, high, own, t, s, r = pieces[row]
        if t == math.inf:
            found[row, 0], found[row, 1], found[row, 2] = math.inf, math.inf, math.inf
            continue
        # The gap is convex in the offset, and least where both circles have the same slope.
        flat = min(max(s * own / (own + r), low), high)
        found[row, 0] = t - _half_chord(r, flat - s) - _half_chord(own, flat)
        at_low = t - _half_chord(r, low - s) - _half_chord(own, low)
        found[row, 1] = max(at_low, t - _half_chord(r, high - s) - _half_chord(own, high))
        found[row, 2] = t * (high - low) - _under_circle(r, low - s, high - s) - _under_circle(own, low, high)
    return found


@_compiled
def within(
    pieces: FloatArray, extent: FloatArray, start: IntArray, length: float, area: FloatArray, width: FloatArray
) -> None:
    """Write, for each direction, the integral of the shorter of gap and length, and the width of longer gaps."""
    for number in range(start.size - 1):
        total, beyond = 0.0, 0.0
        for row in range(start[number], start[number + 1]):
            if extent[row, 1] <= length:
                total += extent[row, 2]
                continue
            low, high = pieces[row, 0], pieces[row, 1]
            if extent[row, 0] >= length:
                total += length * (high - low)
                beyond += high - low
                continue
            own, t, s, r = pieces[row, 2], pieces[row, 3], pieces[row, 4], pieces[row, 5]
            # The gap is convex: it is no longer than the length between two offsets, or from an end of the piece.
            least = min(max(s * own / (own + r), low), high)
            begin, end = low, high
            if _gap(own, t, s, r, low) > length:
                begin = _where_equal(own, t, s, r, length, low, least)
            if _gap(own, t, s, r, high) > length:
                end = _where_equal(own, t, s, r, length, high, least)
            total += t * (end - begin) - _under_circle(r, begin - s, end - s) - _under_circle(own, begin, end)
            longer = (begin - low) + (high - end)
            total += length * longer
            beyond += longer
        area[number], width[number] = total, beyond


@_compiled
def _gap(own: float, t: float, s: float, r: float, offset: float) -> float:
    return float(t - _half_chord(r, offset - s) - _half_chord(own, offset))


@_compiled
def _where_equal(own: float, t: float, s: float, r: float, length: float, end: float, least: float) -> float:
    """Return where the gap equals a length, between an end at which it is longer and its least place.

    There the disc that is met, drawn back by the length, cuts the one that is left: one of two crossings. If there
    is none, the two touch but for rounding, at the least place.
    """
    away = math.hypot(t - length, s)
    share = 0.5 * (away + (own - r) * (own + r) / away) if away > 0.0 else math.inf
    if not abs(share) < own:
        return least
    middle, spread = share * s / away, _half_chord(own, share) * abs(t - length) / away
    low, high = min(end, least), max(end, least)
    first, second = min(max(middle - spread, low), high), min(max(middle + spread, low), high)
    off = abs(_gap(own, t, s, r, first) - length), abs(_gap(own, t, s, r, second) - length)
    return first if off[0] <= off[1] else second


@_compiled
def _under_circle(radius: float, low: float, high: float) -> float:
    """Return the integral of half a chord between two offsets from the centre."""
    at_low, at_high = _half_chord(radius, low), _half_chord(radius, high)
    # By arctan and not by arcsin, which loses half of the digits near the edge of the disc.
    turn = math.atan2(high, at_high) - math.atan2(low, at_low)
    return 0.5 * (high * at_high - low * at_low + radius * radius * turn)
