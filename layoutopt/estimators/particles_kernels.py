"""Compiled steps of a particle filter on float32 columns; the plain twin and truth is `particles`.

A particle is (x, y, cos, sin): a heading is turned by a series and never taken apart, so a step has no
trigonometry, and the circular mean comes free. Loops hold products, sums and choices only, which go into vector
registers; places count from an origin near the tags, so that 24 bits resolve micrometres.
"""

import math
from typing import Any, Final

import numpy as np
from numba import njit

from layoutopt.estimators.counter_normals_kernels import float_of, fused
from layoutopt.identity import Float32Array, FloatArray, WordArray

_F: Final = np.float32
_W: Final = np.uint32
_LARGEST_NORMAL: Final = 5.9
# Share of the mean square about a particle that its distance from the mean may make up.
_FAR: Final = 0.999
# No fastmath: code that may reorder sums or fuse products gives other bits in the process that compiled it than in
# one that loads it from the cache. What gains by being fused says so.
_compiled = njit(cache=True, error_model="numpy")


@_compiled
def move(cloud: Float32Array, count: int, increment: FloatArray, sigma: FloatArray, noise: Float32Array) -> None:
    """Move the first ``count`` particles of a cloud, shape (4, n), by odometry and its noise.

    ``noise`` is flat: ``count`` normals for forward, as many for left, as many for the turn.
    """
    x, y, cos, sin = cloud[0], cloud[1], cloud[2], cloud[3]
    forward, left, turn = noise[:count], noise[count : 2 * count], noise[2 * count : 3 * count]
    ahead, ahead_sigma = _F(increment[0]), _F(sigma[0])
    aside, aside_sigma = _F(increment[1]), _F(sigma[1])
    turn_cos, turn_sin, turn_sigma = _F(math.cos(increment[2])), _F(math.sin(increment[2])), _F(sigma[2])
    if sigma[2] * _LARGEST_NORMAL > 1.0:
        # The series below is for angles up to 1; larger ones are made equal to it one by one.
        _move_and_turn_far(cloud, count, increment, sigma, noise)
        return
    for m in range(count):
        far, wide = fused(ahead_sigma, forward[m], ahead), fused(aside_sigma, left[m], aside)
        x[m] += cos[m] * far - sin[m] * wide
        y[m] += sin[m] * far + cos[m] * wide
        a = turn_sigma * turn[m]
        q = a * a
        by_sin = a * (
            _F(1.0)
            - q * _F(1 / 6) * (_F(1.0) - q * _F(1 / 20) * (_F(1.0) - q * _F(1 / 42) * (_F(1.0) - q * _F(1 / 72))))
        )
        by_cos = _F(1.0) - q * _F(1 / 2) * (
            _F(1.0) - q * _F(1 / 12) * (_F(1.0) - q * _F(1 / 30) * (_F(1.0) - q * _F(1 / 56)))
        )
        by_cos, by_sin = turn_cos * by_cos - turn_sin * by_sin, turn_sin * by_cos + turn_cos * by_sin
        new_cos, new_sin = cos[m] * by_cos - sin[m] * by_sin, sin[m] * by_cos + cos[m] * by_sin
        # One Newton step back to the unit circle: a thousand turns would drift off it.
        shrink = _F(1.5) - _F(0.5) * (new_cos * new_cos + new_sin * new_sin)
        cos[m], sin[m] = new_cos * shrink, new_sin * shrink


@_compiled
def _move_and_turn_far(
    cloud: Float32Array, count: int, increment: FloatArray, sigma: FloatArray, noise: Float32Array
) -> None:
    for m in range(count):
        far = increment[0] + sigma[0] * noise[m]
        wide = increment[1] + sigma[1] * noise[count + m]
        cos, sin = np.float64(cloud[2, m]), np.float64(cloud[3, m])
        cloud[0, m] += _F(cos * far - sin * wide)
        cloud[1, m] += _F(sin * far + cos * wide)
        heading = math.atan2(sin, cos) + increment[2] + sigma[2] * noise[2 * count + m]
        cloud[2, m], cloud[3, m] = _F(math.cos(heading)), _F(math.sin(heading))


@_compiled
def extremes(values: Float32Array) -> tuple[Any, Any]:
    """Return the smallest and the largest of values that hold no NaN; of none, infinity and minus infinity.

    Four pairs run side by side, because a single one would wait for itself.
    """
    least, best = _F(np.inf), _F(-np.inf)
    low_0, low_1, low_2, low_3 = least, least, least, least
    high_0, high_1, high_2, high_3 = best, best, best, best
    for m in range(0, values.size - 3, 4):
        one, two, three, four = values[m], values[m + 1], values[m + 2], values[m + 3]
        low_0, high_0 = (one if one < low_0 else low_0), (one if one > high_0 else high_0)
        low_1, high_1 = (two if two < low_1 else low_1), (two if two > high_1 else high_1)
        low_2, high_2 = (three if three < low_2 else low_2), (three if three > high_2 else high_2)
        low_3, high_3 = (four if four < low_3 else low_3), (four if four > high_3 else high_3)
    for m in range(values.size - values.size % 4, values.size):
        low_0, high_0 = min(low_0, values[m]), max(high_0, values[m])
    return min(min(low_0, low_1), min(low_2, low_3)), max(max(high_0, high_1), max(high_2, high_3))


@_compiled
def exponentials(exponent: Float32Array, shift: float, out: Float32Array) -> None:
    """Write exp(exponent - shift) where that is at most 1; zero below exp(-87).

    2^n by the bits of a float32 times a polynomial of the rest (Cephes' expf), with a relative error of 2e-7.
    """
    for m in range(exponent.size):
        x = exponent[m] - _F(shift)
        x = _F(-87.0) if x < _F(-87.0) else x
        # Rounded to the nearest by cutting off: x is not positive.
        power = np.int32(x * _F(1.44269504) - _F(0.5))
        rest = fused(-_F(power), _F(-2.12194440e-4), fused(-_F(power), _F(0.693359375), x))
        series = _F(1.9875691500e-4)
        series = fused(series, rest, _F(1.3981999507e-3))
        series = fused(series, rest, _F(8.3334519073e-3))
        series = fused(series, rest, _F(4.1665795894e-2))
        series = fused(series, rest, _F(1.6666665459e-1))
        series = fused(series, rest, _F(5.0000001201e-1))
        value = fused(series, rest * rest, rest) + _F(1.0)
        value *= float_of(_W((power + np.int32(127)) << np.int32(23)))
        out[m] = value if x > _F(-87.0) else _F(0.0)


@_compiled
def estimate(
    cloud: Float32Array,
    weight: Float32Array,
    origin_m: FloatArray,
    pose: FloatArray,
    covariance: FloatArray,
) -> float:
    """Write the weighted mean of the first particles, as many as there are weights, and the covariance of x and y.

    Return the sum of the weights.
    """
    x, y, cos, sin = cloud[0], cloud[1], cloud[2], cloud[3]
    # Sums about one of the particles: squares of coordinates would cost half the digits.
    centre_x, centre_y = x[0], y[0]
    total, sum_cos, sum_sin = _F(0.0), _F(0.0), _F(0.0)
    mean_x, mean_y, mean_xx, mean_xy, mean_yy = 0.0, 0.0, 0.0, 0.0, 0.0
    for _ in range(2):
        total, sum_x, sum_y, sum_cos, sum_sin = _F(0.0), _F(0.0), _F(0.0), _F(0.0), _F(0.0)
        sum_xx, sum_xy, sum_yy = _F(0.0), _F(0.0), _F(0.0)
        for m in range(weight.size):
            w, away_x, away_y = weight[m], x[m] - centre_x, y[m] - centre_y
            total += w
            sum_x = fused(w, away_x, sum_x)
            sum_y = fused(w, away_y, sum_y)
            sum_cos = fused(w, cos[m], sum_cos)
            sum_sin = fused(w, sin[m], sum_sin)
            sum_xx += w * away_x * away_x
            sum_xy += w * away_x * away_y
            sum_yy += w * away_y * away_y
        mean_x, mean_y = np.float64(sum_x / total), np.float64(sum_y / total)
        mean_xx, mean_xy, mean_yy = (
            np.float64(sum_xx / total),
            np.float64(sum_xy / total),
            np.float64(sum_yy / total),
        )
        if mean_x * mean_x + mean_y * mean_y <= _FAR * (mean_xx + mean_yy):
            break
        # That particle is an outlier, and the squares have no digits left: once more, about the mean.
        centre_x, centre_y = centre_x + _F(mean_x), centre_y + _F(mean_y)
    pose[0] = origin_m[0] + np.float64(centre_x) + mean_x
    pose[1] = origin_m[1] + np.float64(centre_y) + mean_y
    pose[2] = math.atan2(np.float64(sum_sin), np.float64(sum_cos))
    variance_x = max(mean_xx - mean_x * mean_x, 0.0)
    variance_y = max(mean_yy - mean_y * mean_y, 0.0)
    # Rounding must not leave a covariance that no cloud has.
    most = math.sqrt(variance_x * variance_y)
    shared = min(max(mean_xy - mean_x * mean_y, -most), most)
    covariance[0, 0], covariance[1, 1] = variance_x, variance_y
    covariance[0, 1] = covariance[1, 0] = shared
    return np.float64(total)


@_compiled
def systematic_parents(
    uniform: float, weight: Float32Array, reached: FloatArray, begin: WordArray, parent: WordArray
) -> None:
    """Write the parents of systematic resampling; there may be more or fewer of them than weights.

    ``reached`` and ``begin``, with room for one number more than weights, are scratch. Four sums run side by side,
    because one would wait for itself; where the children of a particle begin is written down for every particle,
    children or not, and what the last one wrote counts.
    """
    size, count = weight.size, parent.size
    quarter = size // 4
    first, second, third, fourth = 0.0, 0.0, 0.0, 0.0
    for m in range(quarter):
        first += weight[m]
        second += weight[quarter + m]
        third += weight[2 * quarter + m]
        fourth += weight[3 * quarter + m]
        reached[m] = first
        reached[quarter + m] = second
        reached[2 * quarter + m] = third
        reached[3 * quarter + m] = fourth
    ends = first, first + second, first + second + third
    for m in range(quarter):
        reached[quarter + m] += ends[0]
        reached[2 * quarter + m] += ends[1]
        reached[3 * quarter + m] += ends[2]
    total = ends[2] + fourth
    for m in range(4 * quarter, size):
        total += weight[m]
        reached[m] = total
    scale = count / total
    # Marks uniform + i below ``reached``, in units of the spacing: the children up to and with this particle.
    begin[0] = 0
    for m in range(size):
        up_to = np.int32(reached[m] * scale + (1.0 - uniform))
        begin[m + 1] = _W(up_to if up_to < count else count)
    parent[:] = 0
    for m in range(size):
        if begin[m] < count:
            parent[begin[m]] = m
    latest = _W(0)
    for i in range(count):
        latest = parent[i] if parent[i] > latest else latest
        parent[i] = latest


@_compiled
def gather(cloud: Float32Array, parent: WordArray, out: Float32Array) -> None:
    """Write the particles that the parents name to ``out``, shape (4, n)."""
    x, y, cos, sin = cloud[0], cloud[1], cloud[2], cloud[3]
    new_x, new_y, new_cos, new_sin = out[0], out[1], out[2], out[3]
    for m in range(parent.size):
        one = parent[m]
        new_x[m], new_y[m], new_cos[m], new_sin[m] = x[one], y[one], cos[one], sin[one]
