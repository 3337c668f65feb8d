"""Compiled rays against walls and discs; the plain twins are in `ray_casting`.

Both do the same sums in the same order and are compiled without any licence to reorder them.
"""

import math

import numpy as np
from numba import njit

from layoutopt.identity import BoolArray, FloatArray
from layoutopt.simulation.ray_casting import CORNER_SHARE, TOUCH_M


@njit(cache=True, error_model="numpy")
def distances(
    origins_m: FloatArray, angles_rad: FloatArray, segments_m: FloatArray, discs: FloatArray, range_m: float
) -> FloatArray:
    """Return how far each ray gets; see `layoutopt.simulation.ray_casting.cast`."""
    found = np.empty(len(angles_rad))
    for ray in range(len(angles_rad)):
        x, y = origins_m[ray]
        ahead_x, ahead_y = math.cos(angles_rad[ray]), math.sin(angles_rad[ray])
        nearest = math.inf
        for wall in range(len(segments_m)):
            start_x, start_y = segments_m[wall, 0] - x, segments_m[wall, 1] - y
            along_x, along_y = segments_m[wall, 2] - segments_m[wall, 0], segments_m[wall, 3] - segments_m[wall, 1]
            turn = ahead_x * along_y - ahead_y * along_x
            if turn == 0.0:
                continue
            share = (start_x * ahead_y - start_y * ahead_x) / turn
            if share < -CORNER_SHARE or share > 1.0 + CORNER_SHARE:
                continue
            away = (start_x * along_y - start_y * along_x) / turn
            if 0.0 <= away < nearest:
                nearest = away
        for disc in range(len(discs)):
            middle_x, middle_y, radius = discs[disc, 0] - x, discs[disc, 1] - y, discs[disc, 2]
            before = middle_x * ahead_x + middle_y * ahead_y
            beside = middle_x * ahead_y - middle_y * ahead_x
            if middle_x * middle_x + middle_y * middle_y < radius * radius:
                nearest = 0.0
            elif before > 0.0 and beside * beside < radius * radius:
                away = max(before - math.sqrt(radius * radius - beside * beside), 0.0)
                if away < nearest:
                    nearest = away
        found[ray] = nearest if nearest <= range_m else math.inf
    return found


@njit(cache=True, error_model="numpy")
def sights(from_m: FloatArray, to_m: FloatArray, segments_m: FloatArray, discs: FloatArray) -> BoolArray:
    """Return which straight ways nothing crosses; see `layoutopt.simulation.ray_casting.visible`."""
    free = np.ones(len(from_m), np.bool_)
    for way in range(len(from_m)):
        x, y = from_m[way]
        way_x, way_y = to_m[way, 0] - x, to_m[way, 1] - y
        length = math.sqrt(way_x * way_x + way_y * way_y)
        if length <= TOUCH_M:
            way_x, way_y, length = 0.0, 0.0, 0.0
        ahead_x, ahead_y = (way_x / length, way_y / length) if length > 0.0 else (0.0, 0.0)
        for wall in range(len(segments_m)):
            start_x, start_y = segments_m[wall, 0] - x, segments_m[wall, 1] - y
            along_x, along_y = segments_m[wall, 2] - segments_m[wall, 0], segments_m[wall, 3] - segments_m[wall, 1]
            turn = ahead_x * along_y - ahead_y * along_x
            if turn == 0.0:
                continue
            share = (start_x * ahead_y - start_y * ahead_x) / turn
            away = (start_x * along_y - start_y * along_x) / turn
            if -CORNER_SHARE <= share <= 1.0 + CORNER_SHARE and TOUCH_M < away < length - TOUCH_M:
                free[way] = False
                break
        if not free[way]:
            continue
        for disc in range(len(discs)):
            middle_x, middle_y, radius = discs[disc, 0] - x, discs[disc, 1] - y, discs[disc, 2]
            before = min(max(middle_x * ahead_x + middle_y * ahead_y, 0.0), length)
            off_x, off_y = middle_x - before * ahead_x, middle_y - before * ahead_y
            if math.sqrt(off_x * off_x + off_y * off_y) < radius - TOUCH_M:
                free[way] = False
                break
    return free
