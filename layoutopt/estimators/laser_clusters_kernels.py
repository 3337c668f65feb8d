"""Compiled clusters of laser scans; the plain twin and truth is `laser_clusters`."""

import math

import numpy as np
from numba import njit

from layoutopt.estimators.laser_clusters import Clustering
from layoutopt.identity import FloatArray, IntArray

# No fastmath, as in all kernels: sums must not be reordered.
_compiled = njit(cache=True, error_model="numpy")


@_compiled
def laser_clusters(
    ranges_m: FloatArray,
    beam: FloatArray,
    step_rad: float,
    clustering: Clustering,
    points_m: FloatArray,
    parts: IntArray,
    out: FloatArray,
) -> int:
    """Write the clusters of a scan to ``out``, rows of x, y and radius; return their number.

    ``beam``, shape (2, beams), holds cosines and sines; ``points_m``, shape (4, beams), and ``parts``, shape
    (beams + 1, 2), are scratch. A cluster needs two returns, of which it shares one with its neighbour at most, so
    there are fewer clusters than beams.
    """
    x, y, allowance, number = points_m[0], points_m[1], points_m[2], points_m[3]
    count = 0
    for b in range(ranges_m.size):
        if ranges_m[b] < np.inf:
            x[count], y[count] = ranges_m[b] * beam[0, b], ranges_m[b] * beam[1, b]
            allowance[count], number[count] = ranges_m[b] * step_rad, b
            count += 1
    found, first, first_hidden = 0, 0, False
    for last in range(count):
        last_hidden, next_hidden = False, False
        if last + 1 < count:
            dx, dy = x[last + 1] - x[last], y[last + 1] - y[last]
            if math.sqrt(dx * dx + dy * dy) < clustering.group_m + allowance[last + 1]:
                continue
            if number[last + 1] == number[last] + 1.0:
                last_hidden = allowance[last + 1] < allowance[last]
                next_hidden = allowance[last + 1] > allowance[last]
        if not (first_hidden and last_hidden):
            found = _cut(x, y, allowance, first, last, first_hidden, last_hidden, clustering, parts, out, found)
        first, first_hidden = last + 1, next_hidden
    return found


@_compiled
def _cut(
    x: FloatArray,
    y: FloatArray,
    allowance: FloatArray,
    first: int,
    last: int,
    first_hidden: bool,
    last_hidden: bool,
    clustering: Clustering,
    parts: IntArray,
    out: FloatArray,
    found: int,
) -> int:
    """Cut a group where it bends and write a cluster for each part; return how many there are now."""
    parts[0, 0], parts[0, 1] = first, last
    waiting = 1
    while waiting > 0:
        waiting -= 1
        begin, end = parts[waiting, 0], parts[waiting, 1]
        if end - begin + 1 < clustering.least_returns:
            continue
        line_x, line_y = x[end] - x[begin], y[end] - y[begin]
        length = math.sqrt(line_x * line_x + line_y * line_y)
        cut, most = begin, -1.0
        for p in range(begin, end + 1):
            away_x, away_y = x[p] - x[begin], y[p] - y[begin]
            if length > 0.0:
                bow = abs(line_x * away_y - line_y * away_x) / length
            else:
                bow = math.sqrt(away_x * away_x + away_y * away_y)
            if bow > most:
                cut, most = p, bow
        shorter = min(cut - begin, end - cut) + 1
        if most > clustering.split_m + allowance[cut] and shorter >= clustering.least_returns:
            # The first part is taken next, so that clusters come in the order of the beams.
            parts[waiting, 0], parts[waiting, 1] = cut, end
            parts[waiting + 1, 0], parts[waiting + 1, 1] = begin, cut
            waiting += 2
            continue
        free = (begin == first and not first_hidden) or (end == last and not last_hidden)
        if free:
            _circle(x[begin : end + 1], y[begin : end + 1], out[found])
            if 0.0 < out[found, 2] <= clustering.largest_radius_m:
                found += 1
    return found


@_compiled
def _circle(x: FloatArray, y: FloatArray, out: FloatArray) -> None:
    """Write x, y and radius of the circle whose diameter is the guide line of returns."""
    middle_x, middle_y = 0.0, 0.0
    for p in range(x.size):
        middle_x += x[p]
        middle_y += y[p]
    middle_x, middle_y = middle_x / x.size, middle_y / x.size
    xx, xy, yy = 0.0, 0.0, 0.0
    for p in range(x.size):
        away_x, away_y = x[p] - middle_x, y[p] - middle_y
        xx += away_x * away_x
        xy += away_x * away_y
        yy += away_y * away_y
    angle = 0.5 * math.atan2(2.0 * xy, xx - yy)
    cos, sin = math.cos(angle), math.sin(angle)
    begin = cos * (x[0] - middle_x) + sin * (y[0] - middle_y)
    end = cos * (x[-1] - middle_x) + sin * (y[-1] - middle_y)
    along = 0.5 * (begin + end)
    out[0], out[1], out[2] = middle_x + along * cos, middle_y + along * sin, 0.5 * abs(end - begin)
