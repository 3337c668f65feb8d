"""The compiled run of Monte Carlo localisation; its plain twin and truth is `mcl.ParticleFilter`.

Same draws in the same order, same results but for rounding. What makes it fast: no memory is asked for in the
loop over steps, a heading is carried as (cos, sin) and turned, one exponential a particle whatever the number
of detections, and inner loops that the compiler can put into vector registers.
"""

import math
from typing import Final

import numpy as np
from numba import njit

from layoutopt.identity import FloatArray, IntArray

_EXPONENT_SHIFT: Final = 14
# Below it the Taylor series of sine and cosine are exact to 1e-15.
_SMALL_ANGLE_RAD: Final = 0.25
# Sums may be reordered and products fused, but a NaN stays a NaN.
_compiled = njit(cache=True, error_model="numpy", fastmath={"reassoc", "contract", "nsz", "arcp"})


@_compiled
def exponentials(exponent: FloatArray, shift: float, out: FloatArray) -> None:
    """Write exp(exponent - shift) for exponents up to about ``shift``; zero below exp(-700).

    A Taylor series of exp(x / 2^14), squared 14 times: only products and sums, hence vector registers, with a
    relative error of about 1e-12.
    """
    scale = 1.0 / (1 << _EXPONENT_SHIFT)
    for m in range(exponent.size):
        x = exponent[m] - shift
        t = max(x, -700.0) * scale
        value = 1.0 + t * (
            1.0 + t / 2.0 * (1.0 + t / 3.0 * (1.0 + t / 4.0 * (1.0 + t / 5.0 * (1.0 + t / 6.0 * (1.0 + t / 7.0)))))
        )
        for _ in range(_EXPONENT_SHIFT):
            value *= value
        out[m] = value if x > -700.0 else 0.0


@_compiled
def _draw_normals(draws: np.random.Generator, first: FloatArray, second: FloatArray, third: FloatArray) -> None:
    for m in range(first.size):
        first[m] = draws.standard_normal()
    for m in range(second.size):
        second[m] = draws.standard_normal()
    for m in range(third.size):
        third[m] = draws.standard_normal()


@_compiled
def _move(
    x: FloatArray,
    y: FloatArray,
    cos: FloatArray,
    sin: FloatArray,
    increment: FloatArray,
    sigma: FloatArray,
    forward: FloatArray,
    left: FloatArray,
    turn: FloatArray,
) -> None:
    """Move every particle; ``forward``, ``left`` and ``turn`` hold its three normals."""
    for m in range(x.size):
        ahead = increment[0] + sigma[0] * forward[m]
        aside = increment[1] + sigma[1] * left[m]
        x[m] += cos[m] * ahead - sin[m] * aside
        y[m] += sin[m] * ahead + cos[m] * aside
    turn_cos, turn_sin = math.cos(increment[2]), math.sin(increment[2])
    large = 0
    for m in range(turn.size):
        turn[m] *= sigma[2]
        large += abs(turn[m]) > _SMALL_ANGLE_RAD
    # What was forward and left becomes cosine and sine of the noise in heading.
    if large > 0:
        for m in range(turn.size):
            forward[m], left[m] = math.cos(turn[m]), math.sin(turn[m])
    else:
        for m in range(turn.size):
            a = turn[m]
            q = a * a
            left[m] = a * (1.0 - q / 6.0 * (1.0 - q / 20.0 * (1.0 - q / 42.0 * (1.0 - q / 72.0))))
            forward[m] = 1.0 - q / 2.0 * (1.0 - q / 12.0 * (1.0 - q / 30.0 * (1.0 - q / 56.0 * (1.0 - q / 90.0))))
    for m in range(x.size):
        by_cos = turn_cos * forward[m] - turn_sin * left[m]
        by_sin = turn_sin * forward[m] + turn_cos * left[m]
        new_cos, new_sin = cos[m] * by_cos - sin[m] * by_sin, sin[m] * by_cos + cos[m] * by_sin
        # One Newton step back to the unit circle: a thousand turns would drift off it.
        shrink = 1.5 - 0.5 * (new_cos * new_cos + new_sin * new_sin)
        cos[m], sin[m] = new_cos * shrink, new_sin * shrink


@_compiled
def _weigh(
    x: FloatArray,
    y: FloatArray,
    cos: FloatArray,
    sin: FloatArray,
    places: FloatArray,
    precision: FloatArray,
    flat: bool,
    log_beta: float,
    log_weight: FloatArray,
) -> bool:
    """Write the log weight of every particle; return whether all of them are zero."""
    log_weight[:] = 0.0
    for row in range(places.shape[0]):
        forward, left, tag_x, tag_y = places[row, 0], places[row, 1], places[row, 2], places[row, 3]
        factor = precision[row]
        # d < sigma is d² / (2 sigma²) < 1/2.
        top = 0.5 if flat else -1.0
        beyond = log_beta if flat else 0.0
        for m in range(x.size):
            away_x = x[m] + cos[m] * forward - sin[m] * left - tag_x
            away_y = y[m] + sin[m] * forward + cos[m] * left - tag_y
            exponent = (away_x * away_x + away_y * away_y) * factor
            log_weight[m] += 0.0 if exponent < top else beyond - exponent
    different = 0
    for m in range(x.size):
        different += log_weight[m] != 0.0
    return different == 0


@_compiled
def _estimate(
    x: FloatArray,
    y: FloatArray,
    cos: FloatArray,
    sin: FloatArray,
    weight: FloatArray,
    pose: FloatArray,
    covariance: FloatArray,
) -> None:
    """Write the weighted mean (Eq. 3) and the covariance of x and y."""
    # Sums about one of the particles: squares of coordinates would cost half the digits.
    centre_x, centre_y = x[0], y[0]
    total = sum_x = sum_y = sum_cos = sum_sin = sum_xx = sum_xy = sum_yy = 0.0
    for m in range(x.size):
        w, away_x, away_y = weight[m], x[m] - centre_x, y[m] - centre_y
        total += w
        sum_x += w * away_x
        sum_y += w * away_y
        sum_cos += w * cos[m]
        sum_sin += w * sin[m]
        sum_xx += w * away_x * away_x
        sum_xy += w * away_x * away_y
        sum_yy += w * away_y * away_y
    mean_x, mean_y = sum_x / total, sum_y / total
    pose[0], pose[1], pose[2] = centre_x + mean_x, centre_y + mean_y, math.atan2(sum_sin, sum_cos)
    covariance[0, 0] = max(sum_xx / total - mean_x * mean_x, 0.0)
    covariance[1, 1] = max(sum_yy / total - mean_y * mean_y, 0.0)
    covariance[0, 1] = covariance[1, 0] = sum_xy / total - mean_x * mean_y


@_compiled
def _draw_parents(uniform: float, weight: FloatArray, parent: IntArray) -> None:
    """Systematic resampling: mark i lies at (uniform + i) / n of the summed weights."""
    count = weight.size
    total = 0.0
    for m in range(count):
        total += weight[m]
    spacing = total / count
    reached = 0.0
    filled = 0
    for m in range(count):
        reached += weight[m]
        while filled < count and (uniform + filled) * spacing < reached:
            parent[filled] = m
            filled += 1
    parent[filled:] = count - 1


@_compiled
def _restart(
    draws: np.random.Generator,
    log_weight: FloatArray,
    limit: float,
    parent: IntArray,
    places: FloatArray,
    x: FloatArray,
    y: FloatArray,
    cos: FloatArray,
    sin: FloatArray,
) -> None:
    """Put each particle whose parent is below the limit where one of the detections would put it (Eq. 4)."""
    for m in range(x.size):
        if log_weight[parent[m]] < limit:
            row = int(draws.random() * places.shape[0])
            heading = -math.pi + 2.0 * math.pi * draws.random()
            cos[m], sin[m] = math.cos(heading), math.sin(heading)
            x[m] = places[row, 2] - (cos[m] * places[row, 0] - sin[m] * places[row, 1])
            y[m] = places[row, 3] - (sin[m] * places[row, 0] + cos[m] * places[row, 1])


@_compiled
def localise(
    draws: np.random.Generator,
    count: int,
    prior: FloatArray,
    increments: FloatArray,
    sigma: FloatArray,
    start: IntArray,
    places: FloatArray,
    precision: FloatArray,
    flat: bool,
    log_beta: float,
    reinitialise: bool,
    log_alpha: float,
    poses: FloatArray,
    covariance: FloatArray,
) -> None:
    """Run Algorithm 1 of mi2016 over a drive; write the estimates to ``poses`` and ``covariance``.

    Parameters
    ----------
    prior
        x, y, heading, and their standard deviations (position, heading), shape (5,).
    increments, sigma
        Odometry of each step and the standard deviations of its noise, shape (steps, 3).
    start
        Detections of step i are rows ``start[i]`` to ``start[i + 1]`` of ``places`` and ``precision``.
    places
        Antenna (forward, left) in ``base_link`` and tag (x, y) on the floor, shape (detections, 4), m.
    precision
        1 / (2 sigma²) of each detection, shape (detections,).
    flat, log_beta
        Whether the likelihood has the flat top of Eq. 6, and the logarithm of its beta.
    """
    x, y = np.empty(count), np.empty(count)
    cos, sin = np.empty(count), np.empty(count)
    drawn_x, drawn_y = np.empty(count), np.empty(count)
    drawn_cos, drawn_sin = np.empty(count), np.empty(count)
    log_weight, weight = np.empty(count), np.empty(count)
    parent = np.empty(count, np.int64)
    forward, left, turn = np.empty(count), np.empty(count), np.empty(count)

    _draw_normals(draws, forward, left, turn)
    for m in range(count):
        x[m] = prior[0] + prior[3] * forward[m]
        y[m] = prior[1] + prior[3] * left[m]
        heading = prior[2] + prior[4] * turn[m]
        cos[m] = math.cos(heading)
        sin[m] = math.sin(heading)

    for step in range(increments.shape[0]):
        _draw_normals(draws, forward, left, turn)
        _move(x, y, cos, sin, increments[step], sigma[step], forward, left, turn)
        first, last = start[step], start[step + 1]
        detections = last - first
        level = True
        if detections > 0:
            level = _weigh(x, y, cos, sin, places[first:last], precision[first:last], flat, log_beta, log_weight)
        if level:
            weight[:] = 1.0
            _estimate(x, y, cos, sin, weight, poses[step], covariance[step])
            if detections > 0:
                # Particles all on the flat top: systematic resampling keeps each, but takes its draw.
                draws.random()
            continue
        exponentials(log_weight, 0.0, weight)
        if not weight.sum() > 1e-100:
            exponentials(log_weight, log_weight.max(), weight)
        _estimate(x, y, cos, sin, weight, poses[step], covariance[step])
        _draw_parents(draws.random(), weight, parent)
        limit = detections * log_alpha
        below = 0
        for m in range(count):
            one = parent[m]
            drawn_x[m], drawn_y[m] = x[one], y[one]
            drawn_cos[m], drawn_sin[m] = cos[one], sin[one]
            below += log_weight[one] < limit
        x, drawn_x = drawn_x, x
        y, drawn_y = drawn_y, y
        cos, drawn_cos = drawn_cos, cos
        sin, drawn_sin = drawn_sin, sin
        if reinitialise and below > 0:
            _restart(draws, log_weight, limit, parent, places[first:last], x, y, cos, sin)
