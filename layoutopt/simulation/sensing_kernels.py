"""Compiled search for the tags below every antenna in every step; its plain twins are in `sensing`.

Both find exactly the same detections: they share the antenna centres and do the same sums in the same order,
so this kernel is compiled without any licence to reorder them.
"""

import numpy as np
from numba import njit

from layoutopt.identity import BoolArray, FloatArray, IntArray


@njit(cache=True, error_model="numpy")
def centres(poses: FloatArray, cos: FloatArray, sin: FloatArray, antenna_m: FloatArray, out: FloatArray) -> None:
    """Write the centres of antennas, shape (steps, antennas, 2), of a robot at poses.

    ``poses``, shape (steps, k, 3), with the cosines and sines of their headings, shape (steps, k), are one for all
    antennas (k is 1) or one for each.
    """
    shared = poses.shape[1] == 1
    for step in range(out.shape[0]):
        for antenna in range(out.shape[1]):
            at = 0 if shared else antenna
            forward, left = antenna_m[antenna, 0], antenna_m[antenna, 1]
            out[step, antenna, 0] = poses[step, at, 0] + cos[step, at] * forward - sin[step, at] * left
            out[step, antenna, 1] = poses[step, at, 1] + sin[step, at] * forward + cos[step, at] * left


@njit(cache=True, error_model="numpy")
def detections(
    centre_m: FloatArray,
    active: BoolArray,
    radius_m: FloatArray,
    radius_squared_m2: FloatArray,
    origin_m: tuple[float, float],
    cell_m: float,
    columns: int,
    rows: int,
    start: IntArray,
    order: IntArray,
    xy_m: FloatArray,
) -> tuple[IntArray, IntArray, IntArray]:
    """Return step, antenna and point of every detection, sorted by all three in this order.

    Parameters
    ----------
    centre_m
        Antenna centres in the floor frame in every step, shape (steps, antennas, 2).
    active
        Whether each antenna scans in each step, shape (steps, antennas).
    radius_m, radius_squared_m2
        How far each antenna sees, shape (antennas,).
    origin_m, cell_m, columns, rows, start, order, xy_m
        The fields of a `layoutopt.detection.BucketGrid`.
    """
    steps, antennas = centre_m.shape[0], centre_m.shape[1]
    found = np.empty((3, 64 + steps * antennas // 2), np.int64)
    count = 0
    for step in range(steps):
        for antenna in range(antennas):
            if not active[step, antenna]:
                continue
            x, y, radius = centre_m[step, antenna, 0], centre_m[step, antenna, 1], radius_m[antenna]
            # As floats until they are known to lie within the grid: a place may be anywhere.
            first_column = max(np.floor((x - radius - origin_m[0]) / cell_m), 0.0)
            last_column = min(np.floor((x + radius - origin_m[0]) / cell_m), columns - 1.0)
            first_row = max(np.floor((y - radius - origin_m[1]) / cell_m), 0.0)
            last_row = min(np.floor((y + radius - origin_m[1]) / cell_m), rows - 1.0)
            if not (first_column <= last_column and first_row <= last_row):
                continue
            group = count
            for row in range(int(first_row), int(last_row) + 1):
                begin = start[int(first_column) + row * columns]
                end = start[int(last_column) + row * columns + 1]
                for place in range(begin, end):
                    away_x, away_y = xy_m[place, 0] - x, xy_m[place, 1] - y
                    if away_x * away_x + away_y * away_y < radius_squared_m2[antenna]:
                        if count == found.shape[1]:
                            larger = np.empty((3, 2 * count), np.int64)
                            larger[:, :count] = found
                            found = larger
                        point = order[place]
                        at = count
                        while at > group and found[2, at - 1] > point:
                            found[2, at] = found[2, at - 1]
                            at -= 1
                        found[0, count], found[1, count], found[2, at] = step, antenna, point
                        count += 1
    return found[0, :count].copy(), found[1, :count].copy(), found[2, :count].copy()
