"""Compiled queries of places and straight ways against the bucket grid; the plain twins are in `sightings`.

Both find the same tags and the same ways to the last bit: they do the same sums in the same order, so these
kernels are compiled without any licence to reorder them. A kernel looks only at the buckets near a way: row after
row of buckets, in each of them those within reach of the piece of the way that this row can see.
"""

import math

import numpy as np
from numba import njit

from layoutopt.identity import FloatArray, IntArray
from layoutopt.sightings import POINT_M

# Buckets are taken generously, by this share of their side, so that no rounding hides a tag at their borders.
_GENEROUS = 1e-6
# A point farther beside the line than the radius by this share of it is not seen, however the sums are rounded.
_BESIDE = 1.0 + 1e-9


@njit(cache=True, error_model="numpy")
def segment_sightings(
    segment_m: FloatArray,
    radius_m: FloatArray,
    origin_m: tuple[float, float],
    cell_m: float,
    columns: int,
    rows: int,
    start: IntArray,
    order: IntArray,
    xy_m: FloatArray,
) -> tuple[IntArray, IntArray, FloatArray, FloatArray]:
    """Return segment, tag, and the ways of entering and leaving of each sighting, by segment, then in grid order.

    Parameters
    ----------
    segment_m
        x, y of start and end of each segment, shape (n, 4).
    radius_m
        How far is seen from each segment, shape (n,).
    origin_m, cell_m, columns, rows, start, order, xy_m
        The fields of a `layoutopt.detection.BucketGrid`.
    """
    most = 0
    for number in range(len(segment_m)):
        x, y = segment_m[number, 0], segment_m[number, 1]
        dx, dy, radius = segment_m[number, 2] - x, segment_m[number, 3] - y, radius_m[number]
        first_row, last_row = _rows(y, dy, radius, origin_m[1], cell_m, rows)
        for row in range(first_row, last_row + 1):
            begin, end = _places(x, y, dx, dy, radius, row, origin_m, cell_m, columns, start)
            most += end - begin
    # Room for every point in the buckets; memory that is not written to costs nothing, copies would.
    way, tag = np.empty(most, np.int64), np.empty(most, np.int64)
    enter_m, leave_m = np.empty(most, np.float64), np.empty(most, np.float64)
    count = 0
    for number in range(len(segment_m)):
        x, y, end_x, end_y = segment_m[number]
        dx, dy, radius = end_x - x, end_y - y, radius_m[number]
        ahead_x, ahead_y, length = _direction(dx, dy)
        first_row, last_row = _rows(y, dy, radius, origin_m[1], cell_m, rows)
        for row in range(first_row, last_row + 1):
            begin, end = _places(x, y, dx, dy, radius, row, origin_m, cell_m, columns, start)
            for place in range(begin, end):
                tag_x, tag_y = xy_m[place, 0], xy_m[place, 1]
                beside = (x - tag_x) * ahead_y - (y - tag_y) * ahead_x
                if beside * beside > radius * radius * _BESIDE:
                    continue
                enter, leave = _in_view(
                    x - tag_x, y - tag_y, end_x - tag_x, end_y - tag_y, ahead_x, ahead_y, length, radius
                )
                if enter <= leave:
                    way[count], tag[count] = number, order[place]
                    enter_m[count], leave_m[count] = enter, leave
                    count += 1
    return way[:count], tag[:count], enter_m[:count], leave_m[:count]


@njit(cache=True, error_model="numpy")
def tags_on_runs(
    poses: FloatArray,
    way_m: FloatArray,
    antenna_m: FloatArray,
    radius_m: FloatArray,
    most: int,
    origin_m: tuple[float, float],
    cell_m: float,
    columns: int,
    rows: int,
    start: IntArray,
    order: IntArray,
    xy_m: FloatArray,
) -> IntArray:
    """Return how many different tags a group of antennas sees on each straight run, shape (n,), up to ``most``.

    Parameters
    ----------
    poses
        Where the runs start: x, y, cosine and sine of the heading, shape (n, 4).
    way_m
        How far each run goes in x and y, shape (n, 2); zero for a robot that stands.
    antenna_m, radius_m
        Places of the antennas on the robot, shape (a, 2), and how far each sees, shape (a,).
    origin_m, cell_m, columns, rows, start, order, xy_m
        The fields of a `layoutopt.detection.BucketGrid`.
    """
    found = np.zeros(len(poses), np.int64)
    seen = np.empty(most, np.int64)
    for number in range(len(poses)):
        cos, sin = poses[number, 2], poses[number, 3]
        for antenna in range(len(antenna_m)):
            forward, left = antenna_m[antenna, 0], antenna_m[antenna, 1]
            x = poses[number, 0] + cos * forward - sin * left
            y = poses[number, 1] + sin * forward + cos * left
            end_x, end_y = x + way_m[number, 0], y + way_m[number, 1]
            dx, dy, radius = end_x - x, end_y - y, radius_m[antenna]
            ahead_x, ahead_y, length = _direction(dx, dy)
            first_row, last_row = _rows(y, dy, radius, origin_m[1], cell_m, rows)
            for row in range(first_row, last_row + 1):
                begin, end = _places(x, y, dx, dy, radius, row, origin_m, cell_m, columns, start)
                for place in range(begin, end):
                    tag_x, tag_y = xy_m[place, 0], xy_m[place, 1]
                    enter, leave = _in_view(
                        x - tag_x, y - tag_y, end_x - tag_x, end_y - tag_y, ahead_x, ahead_y, length, radius
                    )
                    if enter <= leave and found[number] < most:
                        found[number] = _with(seen, found[number], order[place])
                if found[number] == most:
                    break
            if found[number] == most:
                break
    return found


@njit(cache=True, error_model="numpy")
def _rows(y: float, dy: float, radius: float, origin: float, cell_m: float, rows: int) -> tuple[int, int]:
    """Return the first and the last row of buckets within reach of a segment; none if the first is the greater."""
    low, high = min(y, y + dy) - radius - origin, max(y, y + dy) + radius - origin
    # As floats until they are known to lie within the grid: a segment may be anywhere.
    first = max(math.floor(low / cell_m - _GENEROUS), 0.0)
    last = min(math.floor(high / cell_m + _GENEROUS), rows - 1.0)
    return (int(first), int(last)) if first <= last else (0, -1)


@njit(cache=True, error_model="numpy")
def _places(
    x: float,
    y: float,
    dx: float,
    dy: float,
    radius: float,
    row: int,
    origin_m: tuple[float, float],
    cell_m: float,
    columns: int,
    start: IntArray,
) -> tuple[int, int]:
    """Return where in the grid the tags begin and end that a row of buckets has within reach of a segment."""
    first, last = 0.0, 1.0
    if dy != 0.0:
        # The piece of the segment that lies no farther than the radius from this row.
        below = (origin_m[1] + (row - _GENEROUS) * cell_m - radius - y) / dy
        above = (origin_m[1] + (row + 1.0 + _GENEROUS) * cell_m + radius - y) / dy
        first, last = max(min(below, above), 0.0), min(max(below, above), 1.0)
    low = min(x + first * dx, x + last * dx) - radius - origin_m[0]
    high = max(x + first * dx, x + last * dx) + radius - origin_m[0]
    first_column = max(math.floor(low / cell_m - _GENEROUS), 0.0)
    last_column = min(math.floor(high / cell_m + _GENEROUS), columns - 1.0)
    if not first_column <= last_column:
        return 0, 0
    return start[int(first_column) + row * columns], start[int(last_column) + row * columns + 1]


@njit(cache=True, error_model="numpy")
def _direction(dx: float, dy: float) -> tuple[float, float, float]:
    """Return the unit vector along a segment and its length; all zero for one that is a point."""
    length = math.sqrt(dx * dx + dy * dy)
    return (dx / length, dy / length, length) if length > POINT_M else (0.0, 0.0, 0.0)


@njit(cache=True, error_model="numpy")
def _in_view(
    from_x: float,
    from_y: float,
    to_x: float,
    to_y: float,
    ahead_x: float,
    ahead_y: float,
    length: float,
    radius: float,
) -> tuple[float, float]:
    """Return the ways along a segment at which a tag is entered and left; the first is greater if it is not seen.

    ``from_x`` to ``to_y`` are start and end of the segment as seen from the tag. At both ends the distance itself
    decides, so that a query of a segment and those of its ends agree.
    """
    squared = radius * radius
    at_start = from_x * from_x + from_y * from_y < squared
    at_end = to_x * to_x + to_y * to_y < squared
    foot = -(from_x * ahead_x + from_y * ahead_y)
    beside = from_x * ahead_y - from_y * ahead_x
    between = 0.0 < foot < length and beside * beside < squared
    if not (at_start or at_end or between):
        return 1.0, 0.0
    half = math.sqrt(max(squared - beside * beside, 0.0))
    enter = 0.0 if at_start else min(max(foot - half, 0.0), length)
    leave = length if at_end else max(min(foot + half, length), enter)
    return enter, leave


@njit(cache=True, error_model="numpy")
def _with(seen: IntArray, count: int, tag: int) -> int:
    """Note a tag among those seen, unless it is there already, and return how many there are now."""
    for other in range(count):
        if seen[other] == tag:
            return count
    seen[count] = tag
    return count + 1
