"""Compiled outline of the union of periodic discs; the plain twin and truth is `disc_outline`.

Discs lie in buckets that cut the cell, so that a search looks only at those near by. All lengths are in one unit.
"""

import math
from typing import Final

import numpy as np
from numba import njit

from layoutopt.identity import BoolArray, FloatArray, IntArray

_SAME: Final = 1e-12
"""Discs that differ by less, relative to the largest radius, are one disc, and shorter arcs none: rounding."""
_compiled = njit(cache=True, error_model="numpy")


@_compiled
def bucket_counts(cell: FloatArray, count: int) -> tuple[int, int]:
    """Return into how many buckets to cut each period, so that a bucket holds about two discs and is no sliver."""
    long, short = math.hypot(cell[0, 0], cell[0, 1]), math.hypot(cell[1, 0], cell[1, 1])
    share = math.sqrt(max(1.0, 0.5 * count) / (long * short))
    return max(1, round(share * long)), max(1, round(share * short))


@_compiled
def placed(
    cell: FloatArray,
    centre: FloatArray,
    lever: FloatArray,
    radius: FloatArray,
    heading: float,
    grid: tuple[int, int],
) -> tuple[FloatArray, FloatArray, IntArray]:
    """Return places and radii of the discs sorted by bucket, without those that lie within another, and starts."""
    cos, sin = math.cos(heading), math.sin(heading)
    determinant = cell[0, 0] * cell[1, 1] - cell[0, 1] * cell[1, 0]
    place = np.empty((radius.size, 2))
    bucket = np.empty(radius.size, np.int64)
    for k in range(radius.size):
        x = centre[k, 0] - cos * lever[k, 0] + sin * lever[k, 1]
        y = centre[k, 1] - sin * lever[k, 0] - cos * lever[k, 1]
        u = (x * cell[1, 1] - y * cell[1, 0]) / determinant
        v = (y * cell[0, 0] - x * cell[0, 1]) / determinant
        u, v = u - math.floor(u), v - math.floor(v)
        # A share just below zero becomes one by rounding.
        u, v = (u if u < 1.0 else 0.0), (v if v < 1.0 else 0.0)
        place[k, 0] = u * cell[0, 0] + v * cell[1, 0]
        place[k, 1] = u * cell[0, 1] + v * cell[1, 1]
        bucket[k] = min(int(u * grid[0]), grid[0] - 1) + min(int(v * grid[1]), grid[1] - 1) * grid[0]
    place, reach, first = _sorted(place, radius, bucket, np.ones(radius.size, np.bool_), grid)
    kept = np.ones(radius.size, np.bool_)
    largest = radius.max()
    for k in range(radius.size):
        kept[k] = not _within_another(cell, place, reach, first, grid, k, largest)
    if not kept.all():
        for number in range(first.size - 1):
            bucket[first[number] : first[number + 1]] = number
        place, reach, first = _sorted(place, reach, bucket, kept, grid)
    return place, reach, first


@_compiled
def _sorted(
    place: FloatArray, radius: FloatArray, bucket: IntArray, kept: BoolArray, grid: tuple[int, int]
) -> tuple[FloatArray, FloatArray, IntArray]:
    """Return the kept discs by bucket, in the order in which they came, and where each bucket starts."""
    first = np.zeros(grid[0] * grid[1] + 2, np.int64)
    for k in range(radius.size):
        if kept[k]:
            first[bucket[k] + 2] += 1
    for number in range(2, first.size):
        first[number] += first[number - 1]
    new_place, new_radius = np.empty((first[-1], 2)), np.empty(first[-1])
    for k in range(radius.size):
        if kept[k]:
            # While it is filled, a bucket's end is the next one's start.
            at = first[bucket[k] + 1]
            new_place[at, 0], new_place[at, 1], new_radius[at] = place[k, 0], place[k, 1], radius[k]
            first[bucket[k] + 1] += 1
    return new_place, new_radius, first[:-1]


@_compiled
def _within_another(
    cell: FloatArray,
    place: FloatArray,
    radius: FloatArray,
    first: IntArray,
    grid: tuple[int, int],
    k: int,
    largest: float,
) -> bool:
    """Return whether disc k lies within another; of equal ones on one spot the first in bucket order does not."""
    low_u, high_u, low_v, high_v = _buckets_near(cell, place, grid, k, largest - radius[k] + _SAME * largest)
    for row in range(low_v, high_v + 1):
        turn_v = row // grid[1]
        for column in range(low_u, high_u + 1):
            turn_u = column // grid[0]
            number = column - turn_u * grid[0] + (row - turn_v * grid[1]) * grid[0]
            for other in range(first[number], first[number + 1]):
                if radius[other] > radius[k] or (radius[other] == radius[k] and other < k):
                    x = place[other, 0] + turn_u * cell[0, 0] + turn_v * cell[1, 0] - place[k, 0]
                    y = place[other, 1] + turn_u * cell[0, 1] + turn_v * cell[1, 1] - place[k, 1]
                    if math.hypot(x, y) <= radius[other] - radius[k] + _SAME * largest:
                        return True
    return False


@_compiled
def _buckets_near(
    cell: FloatArray, place: FloatArray, grid: tuple[int, int], k: int, reach: float
) -> tuple[int, int, int, int]:
    """Return the first and last column, and the first and last row, of the buckets within a reach of disc k."""
    determinant = cell[0, 0] * cell[1, 1] - cell[0, 1] * cell[1, 0]
    u = (place[k, 0] * cell[1, 1] - place[k, 1] * cell[1, 0]) / determinant
    v = (place[k, 1] * cell[0, 0] - place[k, 0] * cell[0, 1]) / determinant
    across_u = reach * math.hypot(cell[1, 0], cell[1, 1]) / abs(determinant)
    across_v = reach * math.hypot(cell[0, 0], cell[0, 1]) / abs(determinant)
    return (
        math.floor((u - across_u) * grid[0]),
        math.floor((u + across_u) * grid[0]),
        math.floor((v - across_v) * grid[1]),
        math.floor((v + across_v) * grid[1]),
    )


@_compiled
def _neighbours(
    cell: FloatArray,
    place: FloatArray,
    radius: FloatArray,
    first: IntArray,
    grid: tuple[int, int],
    k: int,
    reach: float,
    near: FloatArray,
) -> tuple[FloatArray, int]:
    """Write offset and index of every disc that overlaps disc k; return them, with more room if needed."""
    low_u, high_u, low_v, high_v = _buckets_near(cell, place, grid, k, reach)
    count = 0
    for row in range(low_v, high_v + 1):
        turn_v = row // grid[1]
        for column in range(low_u, high_u + 1):
            turn_u = column // grid[0]
            number = column - turn_u * grid[0] + (row - turn_v * grid[1]) * grid[0]
            for other in range(first[number], first[number + 1]):
                if other == k and turn_u == 0 and turn_v == 0:
                    continue
                x = place[other, 0] + turn_u * cell[0, 0] + turn_v * cell[1, 0] - place[k, 0]
                y = place[other, 1] + turn_u * cell[0, 1] + turn_v * cell[1, 1] - place[k, 1]
                together = radius[k] + radius[other]
                if x * x + y * y < together * together:
                    if count == near.shape[0]:
                        larger = np.empty((2 * count, 3))
                        larger[:count] = near
                        near = larger
                    near[count, 0], near[count, 1], near[count, 2] = x, y, other
                    count += 1
    return near, count


@_compiled
def outline(
    cell: FloatArray, place: FloatArray, radius: FloatArray, first: IntArray, grid: tuple[int, int]
) -> tuple[FloatArray, float]:
    """Return the arcs that no other disc covers, rows of (disc, begin, length), and the area that none covers.

    The union of discs is the sum of their parts within their own power cells (Aurenhammer, SIAM J. Comput. 16,
    1987). Such a part is bounded by the uncovered arcs and by chords on radical lines; its area is half the sum of
    radius times arc and of distance times chord, by Green's theorem.
    """
    arcs = np.empty((2 * radius.size + 16, 3))
    count, covered = 0, 0.0
    largest = radius.max()
    near = np.empty((32, 3))
    corner, line, spare_corner, spare_line = (
        np.empty((40, 2)),
        np.empty((40, 3)),
        np.empty((40, 2)),
        np.empty((40, 3)),
    )
    hidden = np.empty((40, 2))
    for k in range(radius.size):
        near, neighbours = _neighbours(cell, place, radius, first, grid, k, radius[k] + largest, near)
        if neighbours + 8 > hidden.shape[0]:
            size = 2 * neighbours + 8
            corner, line, spare_corner, spare_line = (
                np.empty((size, 2)),
                np.empty((size, 3)),
                np.empty((size, 2)),
                np.empty((size, 3)),
            )
            hidden = np.empty((size, 2))
        corner, line, spare_corner, spare_line, corners = _power_cell(
            radius, near, neighbours, k, corner, line, spare_corner, spare_line
        )
        hides, chords = 0, 0.0
        for edge in range(corners):
            normal_x, normal_y, distance = line[edge, 0], line[edge, 1], line[edge, 2]
            if distance >= radius[k]:
                continue
            half = math.sqrt(radius[k] * radius[k] - distance * distance)
            after = edge + 1 if edge + 1 < corners else 0
            begin = normal_x * corner[edge, 1] - normal_y * corner[edge, 0]
            end = normal_x * corner[after, 1] - normal_y * corner[after, 0]
            begin, end = max(min(begin, end), -half), min(max(begin, end), half)
            if begin < end:
                chords += distance * (end - begin)
            wide = math.acos(max(-1.0, distance / radius[k]))
            hidden[hides, 0], hidden[hides, 1] = math.atan2(normal_y, normal_x) - wide, 2.0 * wide
            hides += 1
        before = count
        if corners > 0 and hides == 0:
            arcs, count = _add_arc(arcs, count, k, 0.0, 2.0 * math.pi)
        elif corners > 0:
            arcs, count = _add_free_arcs(arcs, count, k, hidden[:hides])
        covered += 0.5 * chords
        for arc in range(before, count):
            covered += 0.5 * radius[k] * radius[k] * arcs[arc, 2]
    area = abs(cell[0, 0] * cell[1, 1] - cell[0, 1] * cell[1, 0])
    # Without any boundary the discs cover the plane; else rounding alone could make the rest negative.
    return arcs[:count].copy(), (max(0.0, area - covered) if count > 0 else 0.0)


@_compiled
def _power_cell(
    radius: FloatArray,
    near: FloatArray,
    neighbours: int,
    k: int,
    corner: FloatArray,
    line: FloatArray,
    other_corner: FloatArray,
    other_line: FloatArray,
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray, int]:
    """Write corners of the power cell of disc k about its centre, and the line after each; count them.

    A line is a unit normal and its distance from the centre; those of the box round the disc, where the clipping
    starts, are as far away as the radius. The last two arrays are scratch; arrays come back in another order.
    """
    r = radius[k]
    box = ((r, -r, 1.0, 0.0), (r, r, 0.0, 1.0), (-r, r, -1.0, 0.0), (-r, -r, 0.0, -1.0))
    for number in range(4):
        corner[number, 0], corner[number, 1] = box[number][0], box[number][1]
        line[number, 0], line[number, 1], line[number, 2] = box[number][2], box[number][3], r
    corners = 4
    for number in range(neighbours):
        away = math.hypot(near[number, 0], near[number, 1])
        normal_x, normal_y = near[number, 0] / away, near[number, 1] / away
        theirs = radius[int(near[number, 2])]
        distance = 0.5 * (away + (r - theirs) * (r + theirs) / away)
        kept = 0
        for edge in range(corners):
            after = edge + 1 if edge + 1 < corners else 0
            here = normal_x * corner[edge, 0] + normal_y * corner[edge, 1] - distance
            there = normal_x * corner[after, 0] + normal_y * corner[after, 1] - distance
            if here <= 0.0:
                other_corner[kept, 0], other_corner[kept, 1] = corner[edge, 0], corner[edge, 1]
                other_line[kept] = line[edge]
                kept += 1
            if (here <= 0.0) != (there <= 0.0):
                share = here / (here - there)
                other_corner[kept, 0] = corner[edge, 0] + share * (corner[after, 0] - corner[edge, 0])
                other_corner[kept, 1] = corner[edge, 1] + share * (corner[after, 1] - corner[edge, 1])
                if here <= 0.0:
                    # The cell is left here: its border goes on along the new line.
                    other_line[kept, 0], other_line[kept, 1], other_line[kept, 2] = normal_x, normal_y, distance
                else:
                    other_line[kept] = line[edge]
                kept += 1
        corner, other_corner = other_corner, corner
        line, other_line = other_line, line
        corners = kept
        if corners == 0:
            break
    return corner, line, other_corner, other_line, corners


@_compiled
def _add_arc(arcs: FloatArray, count: int, k: int, begin: float, length: float) -> tuple[FloatArray, int]:
    if count == arcs.shape[0]:
        larger = np.empty((2 * count, 3))
        larger[:count] = arcs
        arcs = larger
    arcs[count, 0], arcs[count, 1], arcs[count, 2] = k, begin, length
    return arcs, count + 1


@_compiled
def _add_free_arcs(arcs: FloatArray, count: int, k: int, hidden: FloatArray) -> tuple[FloatArray, int]:
    """Add what hidden arcs, rows of (begin, length), leave of a circle."""
    full = 2.0 * math.pi
    for number in range(hidden.shape[0]):
        hidden[number, 0] -= full * math.floor(hidden[number, 0] / full)
    # Few arcs: sorted by insertion.
    for number in range(1, hidden.shape[0]):
        begin, length, at = hidden[number, 0], hidden[number, 1], number
        while at > 0 and hidden[at - 1, 0] > begin:
            hidden[at, 0], hidden[at, 1] = hidden[at - 1, 0], hidden[at - 1, 1]
            at -= 1
        hidden[at, 0], hidden[at, 1] = begin, length
    # What passes the angle zero hides the begin of the next turn.
    end = (hidden[:, 0] + hidden[:, 1]).max() - full
    for number in range(hidden.shape[0]):
        end = max(end, hidden[number, 0] + hidden[number, 1])
        following = hidden[number + 1, 0] if number + 1 < hidden.shape[0] else hidden[0, 0] + full
        if following - end > _SAME:
            arcs, count = _add_arc(arcs, count, k, end, following - end)
    return arcs, count
