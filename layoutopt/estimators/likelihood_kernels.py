"""Compiled likelihoods of many particles; the plain twin and truth is `likelihood`."""

import math
from typing import Final

import numpy as np
from numba import njit

from layoutopt.estimators.evidence import Floor
from layoutopt.estimators.likelihood import LEAST_WIDTH_M
from layoutopt.estimators.particles_kernels import extremes
from layoutopt.identity import Float32Array, IntArray

_F: Final = np.float32
_MOST_CANDIDATES: Final = 64
_compiled = njit(cache=True, error_model="numpy")


@_compiled
def weigh_by_distance(
    cloud: Float32Array,
    place: Float32Array,
    shape: Float32Array,
    flat: bool,
    log_beta: float,
    log_weight: Float32Array,
) -> None:
    """Add the logarithm of Eq. 6 of mi2016 for every row to the weight of every particle."""
    x, y, cos, sin = cloud[0], cloud[1], cloud[2], cloud[3]
    # d < sigma is d² / (2 sigma²) < 1/2; without a flat top nothing is.
    edge, beyond = (_F(0.5), _F(log_beta)) if flat else (_F(-1.0), _F(0.0))
    for row in range(place.shape[0]):
        forward, left, tag_x, tag_y = place[row, 0], place[row, 1], place[row, 2], place[row, 3]
        precision = shape[row, 0]
        for m in range(log_weight.size):
            away_x = x[m] + cos[m] * forward - sin[m] * left - tag_x
            away_y = y[m] + sin[m] * forward + cos[m] * left - tag_y
            q = (away_x * away_x + away_y * away_y) * precision
            log_weight[m] += _F(0.0) if q < edge else beyond - q


@_compiled
def weigh_by_rings(
    cloud: Float32Array, place: Float32Array, shape: Float32Array, log_weight: Float32Array
) -> None:
    """Add the logarithm of the likelihood of every ring to the weight of every particle."""
    x, y, cos, sin = cloud[0], cloud[1], cloud[2], cloud[3]
    for row in range(place.shape[0]):
        forward, left, tag_x, tag_y = place[row, 0], place[row, 1], place[row, 2], place[row, 3]
        inner, outer, steepness, floor = shape[row, 0], shape[row, 1], shape[row, 2], shape[row, 3]
        for m in range(log_weight.size):
            away_x = x[m] + cos[m] * forward - sin[m] * left - tag_x
            away_y = y[m] + sin[m] * forward + cos[m] * left - tag_y
            distance = math.sqrt(away_x * away_x + away_y * away_y)
            short, long = inner - distance, distance - outer
            beyond = short if short > long else long
            beyond = beyond if beyond > _F(0.0) else _F(0.0)
            beyond *= steepness
            value = _F(-0.5) * beyond * beyond
            log_weight[m] += value if value > floor else floor


@_compiled
def weigh_by_silence(
    cloud: Float32Array,
    floor: Floor,
    step: int,
    read_antenna: IntArray,
    read_tag: IntArray,
    log_weight: Float32Array,
    inside: Float32Array,
    penalty: Float32Array,
) -> None:
    """Add what the antennas of a step did not read to the weight of every particle.

    ``read_antenna`` and ``read_tag`` are what they did read; ``inside`` and ``penalty``, at least as long as the
    weights, are scratch. Tags that no particle's antenna can reach are never looked at; where a cloud is so wide
    that many can be reached, every particle looks up its own.
    """
    particles = log_weight.size
    x_low, x_high = extremes(cloud[0, :particles])
    y_low, y_high = extremes(cloud[1, :particles])
    cos_low, cos_high = extremes(cloud[2, :particles])
    sin_low, sin_high = extremes(cloud[3, :particles])
    candidate = np.empty(_MOST_CANDIDATES, np.int64)
    for antenna in range(floor.active.shape[1]):
        if not floor.active[step, antenna]:
            continue
        forward, left, radius = floor.antenna[antenna, 0], floor.antenna[antenna, 1], floor.antenna[antenna, 2]
        one_tag = floor.antenna[antenna, 3] > _F(0.5)
        silent = True
        for row in range(read_antenna.size):
            silent = silent and read_antenna[row] != antenna
        along_low, along_high = _product_bounds(forward, cos_low, cos_high)
        across_low, across_high = _product_bounds(-left, sin_low, sin_high)
        low_x, high_x = x_low + along_low + across_low - radius, x_high + along_high + across_high + radius
        along_low, along_high = _product_bounds(forward, sin_low, sin_high)
        across_low, across_high = _product_bounds(left, cos_low, cos_high)
        low_y, high_y = y_low + along_low + across_low - radius, y_high + along_high + across_high + radius
        count = _tags_within(floor, low_x, high_x, low_y, high_y, candidate)
        if count > _MOST_CANDIDATES:
            _silence_one_by_one(cloud, floor, antenna, silent, read_antenna, read_tag, log_weight)
        elif one_tag and silent and count > 1:
            _silence_of_collisions(cloud, floor, antenna, candidate[:count], log_weight, inside, penalty)
        else:
            for place in candidate[:count]:
                if not _was_read(antenna, floor.tag[place], read_antenna, read_tag):
                    _silence_of_tag(cloud, floor, antenna, place, log_weight)


@_compiled
def _product_bounds(factor: float, low: float, high: float) -> tuple[float, float]:
    return (factor * low, factor * high) if factor > 0.0 else (factor * high, factor * low)


@_compiled
def _was_read(antenna: int, tag: int, read_antenna: IntArray, read_tag: IntArray) -> bool:
    found = False
    for row in range(read_antenna.size):
        found = found or (read_antenna[row] == antenna and read_tag[row] == tag)
    return found


@_compiled
def _tags_within(
    floor: Floor, low_x: float, high_x: float, low_y: float, high_y: float, candidate: IntArray
) -> int:
    """Write the places of the tags within a box; return their number, or more than there is room for."""
    # As floats until they are known to lie within the grid: a cloud may be anywhere.
    first_column = max(np.floor((low_x - floor.low_m[0]) / floor.cell_m), 0.0)
    last_column = min(np.floor((high_x - floor.low_m[0]) / floor.cell_m), floor.columns - 1.0)
    first_row = max(np.floor((low_y - floor.low_m[1]) / floor.cell_m), 0.0)
    last_row = min(np.floor((high_y - floor.low_m[1]) / floor.cell_m), floor.rows - 1.0)
    if not (first_column <= last_column and first_row <= last_row):
        return 0
    count = 0
    for row in range(int(first_row), int(last_row) + 1):
        begin = floor.start[int(first_column) + row * floor.columns]
        end = floor.start[int(last_column) + row * floor.columns + 1]
        for place in range(begin, end):
            x, y = floor.tag_m[place, 0], floor.tag_m[place, 1]
            if low_x <= x <= high_x and low_y <= y <= high_y:
                if count == candidate.size:
                    return count + 1
                candidate[count] = place
                count += 1
    return count


@_compiled
def _steepness(floor: Floor, radius: float, place: int) -> float:
    """Return 1 / width of the soft edge between reading and not reading a tag."""
    return 1.0 / max(math.hypot(floor.edge_share * radius, floor.tag_sigma_m[place]), LEAST_WIDTH_M)


@_compiled
def _silence_of_tag(cloud: Float32Array, floor: Floor, antenna: int, place: int, log_weight: Float32Array) -> None:
    x, y, cos, sin = cloud[0], cloud[1], cloud[2], cloud[3]
    forward, left, radius = floor.antenna[antenna, 0], floor.antenna[antenna, 1], floor.antenna[antenna, 2]
    tag_x, tag_y = floor.tag_m[place, 0], floor.tag_m[place, 1]
    steepness, least = _F(_steepness(floor, radius, place)), _F(floor.log_miss)
    for m in range(log_weight.size):
        away_x = x[m] + cos[m] * forward - sin[m] * left - tag_x
        away_y = y[m] + sin[m] * forward + cos[m] * left - tag_y
        within = (radius - math.sqrt(away_x * away_x + away_y * away_y)) * steepness
        within = within if within > _F(0.0) else _F(0.0)
        value = _F(-0.5) * within * within
        log_weight[m] += value if value > least else least


@_compiled
def _silence_of_collisions(
    cloud: Float32Array,
    floor: Floor,
    antenna: int,
    candidate: IntArray,
    log_weight: Float32Array,
    inside: Float32Array,
    penalty: Float32Array,
) -> None:
    """Add the silence of an antenna that reads none where two tags answer: it speaks only against one alone."""
    x, y, cos, sin = cloud[0], cloud[1], cloud[2], cloud[3]
    forward, left, radius = floor.antenna[antenna, 0], floor.antenna[antenna, 1], floor.antenna[antenna, 2]
    least = _F(floor.log_miss)
    inside[: log_weight.size] = _F(0.0)
    penalty[: log_weight.size] = _F(0.0)
    for place in candidate:
        tag_x, tag_y = floor.tag_m[place, 0], floor.tag_m[place, 1]
        steepness = _F(_steepness(floor, radius, place))
        for m in range(log_weight.size):
            away_x = x[m] + cos[m] * forward - sin[m] * left - tag_x
            away_y = y[m] + sin[m] * forward + cos[m] * left - tag_y
            within = (radius - math.sqrt(away_x * away_x + away_y * away_y)) * steepness
            inside[m] += _F(1.0) if within > _F(0.0) else _F(0.0)
            value = _F(-0.5) * within * within
            value = value if value > least else least
            penalty[m] += value if within > _F(0.0) else _F(0.0)
    for m in range(log_weight.size):
        log_weight[m] += penalty[m] if inside[m] == _F(1.0) else _F(0.0)


@_compiled
def _silence_one_by_one(
    cloud: Float32Array,
    floor: Floor,
    antenna: int,
    silent: bool,
    read_antenna: IntArray,
    read_tag: IntArray,
    log_weight: Float32Array,
) -> None:
    """Add the silence of an antenna particle by particle, each from the tags that its own antenna reaches."""
    forward, left, radius = floor.antenna[antenna, 0], floor.antenna[antenna, 1], floor.antenna[antenna, 2]
    alone = silent and floor.antenna[antenna, 3] > _F(0.5)
    candidate = np.empty(_MOST_CANDIDATES, np.int64)
    for m in range(log_weight.size):
        x = cloud[0, m] + cloud[2, m] * forward - cloud[3, m] * left
        y = cloud[1, m] + cloud[3, m] * forward + cloud[2, m] * left
        count = _tags_within(floor, x - radius, x + radius, y - radius, y + radius, candidate)
        while count > candidate.size:
            candidate = np.empty(2 * candidate.size, np.int64)
            count = _tags_within(floor, x - radius, x + radius, y - radius, y + radius, candidate)
        inside, penalty = 0, _F(0.0)
        for place in candidate[:count]:
            away_x, away_y = x - floor.tag_m[place, 0], y - floor.tag_m[place, 1]
            within = radius - math.sqrt(away_x * away_x + away_y * away_y)
            if within > _F(0.0) and not _was_read(antenna, floor.tag[place], read_antenna, read_tag):
                inside += 1
                within *= _F(_steepness(floor, radius, place))
                penalty += max(_F(-0.5) * within * within, _F(floor.log_miss))
        if inside == 1 or not alone:
            log_weight[m] += penalty
