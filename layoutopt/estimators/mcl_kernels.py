"""The compiled run of particle filters on tag reads; plain twins and truth are `mcl` and `disc_filter`.

Every draw is a Philox number of (seed, step, purpose, index), so a run has no generator to carry. The twins draw
from a stream of their own: the same distributions, other numbers.
"""

import math
from typing import Final

import numpy as np
from numba import njit

from layoutopt.estimators.counter_normals_kernels import normals, philox_words
from layoutopt.estimators.evidence import Constraints, Floor
from layoutopt.estimators.likelihood_kernels import weigh_by_distance, weigh_by_rings, weigh_by_silence
from layoutopt.estimators.particles import Settings
from layoutopt.estimators.particles_kernels import (
    estimate,
    exponentials,
    extremes,
    gather,
    move,
    systematic_parents,
)
from layoutopt.identity import BoolArray, Float32Array, FloatArray, IntArray, WordArray

_F: Final = np.float32
_TURN_OF_WORD: Final = 2.0 * math.pi * 2.0**-32
_UNIT_OF_WORD: Final = 2.0**-32
# Values of `particles.Likelihood` and `counter_normals.Draw`.
_GAUSSIAN: Final = 0
_RINGS: Final = 2
_RESAMPLING: Final = 1
_RESTART: Final = 2
_RESTART_PARTNER: Final = 3
_REMEMBERED: Final = 8
_NORMAL_99: Final = 2.3263478740408408
_compiled = njit(cache=True, error_model="numpy")


@_compiled
def localise(
    key: tuple[int, int],
    settings: Settings,
    prior: FloatArray,
    bounds_m: FloatArray,
    origin_m: FloatArray,
    increments: FloatArray,
    sigma: FloatArray,
    constraints: Constraints,
    floor: Floor,
    poses: FloatArray,
    covariance: FloatArray,
    lost: BoolArray,
    log_evidence: FloatArray,
) -> None:
    """Run a particle filter over a drive; write pose, covariance, health and evidence of each step.

    Parameters
    ----------
    key
        Two 32-bit words.
    prior
        x, y, heading, and their standard deviations (position, heading), shape (5,); infinite for unknown.
    bounds_m
        Low and high corner of the box for an unknown place, shape (2, 2).
    origin_m
        From where the places of constraints and floor count, shape (2,).
    increments, sigma
        Odometry of each step and the standard deviations of its noise, shape (steps, 3).
    """
    most = settings.particles
    width = -(-3 * most // 32) * 8
    words, noise = np.empty(4 * width, np.uint32), np.empty(4 * width, np.float32)
    cloud, drawn = np.empty((4, most), np.float32), np.empty((4, most), np.float32)
    log_weight, weight = np.empty(most, np.float32), np.empty(most, np.float32)
    inside, penalty = np.empty(most, np.float32), np.empty(most, np.float32)
    parent = np.empty(most, np.uint32)
    reached, begin = np.empty(most), np.empty(most + 1, np.uint32)
    bins = np.zeros((4 * most, 3), np.int64)
    stamp = np.zeros(4 * most, np.int64)
    remembered = np.zeros((_REMEMBERED, 5))
    kept = 0
    count = wanted = most
    # A filter that knows nothing of its place is lost until the first read.
    unplaced = np.isinf(prior[3])
    streak = 0
    rings = settings.likelihood == _RINGS

    _normals(key, 0, count, words, noise)
    _start(key, prior, bounds_m, origin_m, count, noise, cloud)
    for step in range(increments.shape[0]):
        _normals(key, step + 1, count, words, noise)
        move(cloud, count, increments[step], sigma[step], noise)
        first, middle, last = constraints.start[step], constraints.read_end[step], constraints.start[step + 1]
        reads = middle - first
        limit = reads * settings.log_alpha
        w, lw = weight[:count], log_weight[:count]
        lw[:] = _F(0.0)
        least = best = 0.0
        if settings.paired:
            _carry(remembered, kept, increments[step])
        if reads > 0:
            place, shape = constraints.place[first:middle], constraints.shape[first:middle]
            if rings:
                weigh_by_rings(cloud, place, shape, lw)
            else:
                weigh_by_distance(cloud, place, shape, settings.likelihood != _GAUSSIAN, settings.log_beta, lw)
            least, best = extremes(lw)
            streak = streak + 1 if best < limit else 0
        lost[step] = unplaced or (reads > 0 and streak >= settings.patience)
        unexplained = reads > 0 and streak > 0 and not lost[step]
        if unexplained:
            # Nothing explains the reads: one wrong identity is likelier than a robot that was moved.
            log_evidence[step] = best
            least = best = 0.0
        elif last > middle or settings.ask_silence:
            if last > middle:
                weigh_by_rings(cloud, constraints.place[middle:last], constraints.shape[middle:last], lw)
            if settings.ask_silence:
                read_antenna, read_tag = constraints.antenna[first:middle], constraints.tag[first:middle]
                weigh_by_silence(cloud, floor, step, read_antenna, read_tag, lw, inside, penalty)
            least, best = extremes(lw)
        replaces = settings.reinitialise and not rings and reads > 0 and least < limit
        if best > least:
            exponentials(lw, best, w)
            total = estimate(cloud, w, origin_m, poses[step], covariance[step])
            log_evidence[step] = math.log(total / count) + best
        else:
            w[:] = _F(1.0)
            estimate(cloud, w, origin_m, poses[step], covariance[step])
            if not unexplained:
                log_evidence[step] = best
        if rings and reads > 0 and lost[step]:
            count = wanted = most
            _start_anew(key, step + 1, constraints, first, middle, remembered, kept, settings.paired, cloud)
            streak = 0
        elif best > least or replaces:
            _draw(key, step + 1, w, reached, begin, parent[:wanted])
            gather(cloud, parent[:wanted], drawn)
            cloud, drawn = drawn, cloud
            count = wanted
            if replaces:
                _replace_below(key, step + 1, constraints, first, last, lw, limit, parent[:count], cloud)
            if settings.least_particles < most:
                wanted = _wanted(cloud, count, settings, bins, stamp, step + 1)
        unplaced = unplaced and reads == 0
        if settings.paired:
            kept = _remember(remembered, kept, constraints, first, middle)


@_compiled
def _normals(key: tuple[int, int], step: int, count: int, words: WordArray, noise: Float32Array) -> None:
    """Write three normals a particle to the beginning of ``noise``."""
    width = -(-3 * count // 32) * 8
    normals(key[0], key[1], step, words[: 4 * width].reshape(4, width), noise[: 4 * width].reshape(4, width))


@_compiled
def _start(
    key: tuple[int, int],
    prior: FloatArray,
    bounds_m: FloatArray,
    origin_m: FloatArray,
    count: int,
    noise: Float32Array,
    cloud: Float32Array,
) -> None:
    words = np.empty((4, count), np.uint32)
    philox_words(key[0], key[1], 0, _RESTART, 0, words)
    for m in range(count):
        for axis in range(2):
            if np.isinf(prior[3]):
                place = bounds_m[0, axis] + words[axis, m] * _UNIT_OF_WORD * (
                    bounds_m[1, axis] - bounds_m[0, axis]
                )
            else:
                place = prior[axis] + prior[3] * noise[axis * count + m]
            cloud[axis, m] = _F(place - origin_m[axis])
        heading = words[2, m] * _TURN_OF_WORD
        if not np.isinf(prior[4]):
            heading = prior[2] + prior[4] * noise[2 * count + m]
        cloud[2, m], cloud[3, m] = _F(math.cos(heading)), _F(math.sin(heading))


@_compiled
def _draw(
    key: tuple[int, int],
    step: int,
    weight: Float32Array,
    reached: FloatArray,
    begin: WordArray,
    parent: WordArray,
) -> None:
    words = np.empty((4, 1), np.uint32)
    philox_words(key[0], key[1], step, _RESAMPLING, 0, words)
    # Never zero: the mark at the very beginning would fall to a first particle without weight.
    systematic_parents((words[0, 0] + 0.5) * _UNIT_OF_WORD, weight, reached, begin, parent)


@_compiled
def _replace_below(
    key: tuple[int, int],
    step: int,
    constraints: Constraints,
    first: int,
    last: int,
    log_weight: Float32Array,
    limit: float,
    parent: WordArray,
    cloud: Float32Array,
) -> None:
    """Put each particle whose parent is below the limit where one of the reads would put it (mi2016, Eq. 4)."""
    words = np.empty((4, 1), np.uint32)
    for m in range(parent.size):
        if log_weight[parent[m]] < limit:
            philox_words(key[0], key[1], step, _RESTART, m, words)
            row = first + int(words[0, 0] * _UNIT_OF_WORD * (last - first))
            _put(constraints.place[row], words[1, 0] * _TURN_OF_WORD, 0.0, 0.0, m, cloud)


@_compiled
def _start_anew(
    key: tuple[int, int],
    step: int,
    constraints: Constraints,
    first: int,
    middle: int,
    remembered: FloatArray,
    kept: int,
    paired: bool,
    cloud: Float32Array,
) -> None:
    """Put every particle where one of the reads could have put it: its tag anywhere in the antenna's disc.

    The heading is any; or, for half of the particles, that at which the antenna of a read before was over its tag
    too, if the two lie farther apart than their discs are wide.
    """
    count = cloud.shape[1]
    words, partner = np.empty((4, count), np.uint32), np.empty((4, count), np.uint32)
    philox_words(key[0], key[1], step, _RESTART, 0, words)
    philox_words(key[0], key[1], step, _RESTART_PARTNER, 0, partner)
    for m in range(count):
        row = first + int(words[0, m] * _UNIT_OF_WORD * (middle - first))
        place, radius = constraints.place[row], constraints.shape[row, 1]
        away_x, away_y = _in_disc(words[2, m], words[3, m], radius)
        heading = words[1, m] * _TURN_OF_WORD
        if paired and kept > 0 and m % 2 == 0:
            before = remembered[int(partner[0, m] * _UNIT_OF_WORD * kept)]
            before_x, before_y = _in_disc(partner[1, m], partner[2, m], before[4])
            ahead, aside = place[0] - before[0], place[1] - before[1]
            if math.hypot(ahead, aside) > radius + before[4]:
                across_x, across_y = (
                    place[2] + away_x - before[2] - before_x,
                    place[3] + away_y - before[3] - before_y,
                )
                heading = math.atan2(across_y, across_x) - math.atan2(aside, ahead)
        _put(place, heading, away_x, away_y, m, cloud)


@_compiled
def _in_disc(for_radius: int, for_angle: int, radius: float) -> tuple[float, float]:
    """Return a place evenly within a disc."""
    away, angle = radius * math.sqrt(for_radius * _UNIT_OF_WORD), for_angle * _TURN_OF_WORD
    return away * math.cos(angle), away * math.sin(angle)


@_compiled
def _put(place: Float32Array, heading: float, away_x: float, away_y: float, m: int, cloud: Float32Array) -> None:
    """Put a particle so that the antenna of a read is ``away`` from the tag."""
    cos, sin = math.cos(heading), math.sin(heading)
    cloud[0, m] = _F(place[2] + away_x - (cos * place[0] - sin * place[1]))
    cloud[1, m] = _F(place[3] + away_y - (sin * place[0] + cos * place[1]))
    cloud[2, m], cloud[3, m] = _F(cos), _F(sin)


@_compiled
def _carry(remembered: FloatArray, kept: int, increment: FloatArray) -> None:
    """Tell from where the robot is after a step where the antennas of remembered reads were."""
    cos, sin = math.cos(increment[2]), math.sin(increment[2])
    for row in range(kept):
        ahead, aside = remembered[row, 0] - increment[0], remembered[row, 1] - increment[1]
        remembered[row, 0], remembered[row, 1] = cos * ahead + sin * aside, cos * aside - sin * ahead


@_compiled
def _remember(remembered: FloatArray, kept: int, constraints: Constraints, first: int, middle: int) -> int:
    """Keep the newest reads: antenna seen from the robot, tag, and radius of the disc."""
    for row in range(first, middle):
        kept = min(kept + 1, _REMEMBERED)
        for other in range(kept - 1, 0, -1):
            remembered[other] = remembered[other - 1]
        for axis in range(4):
            remembered[0, axis] = constraints.place[row, axis]
        remembered[0, 4] = constraints.shape[row, 1]
    return kept


@_compiled
def _wanted(
    cloud: Float32Array, count: int, settings: Settings, bins: IntArray, stamp: IntArray, mark: int
) -> int:
    """Return how many particles the spread of a cloud takes (Fox, 2003), counted in bins by hashing."""
    found = 0
    for m in range(count):
        x, y = math.floor(cloud[0, m] / settings.bin_m), math.floor(cloud[1, m] / settings.bin_m)
        turned = math.floor(cloud[2, m] / settings.bin_share) * 4096
        turned += math.floor(cloud[3, m] / settings.bin_share)
        slot = ((x * 73856093) ^ (y * 19349663) ^ (turned * 83492791)) % stamp.size
        while stamp[slot] == mark and not (bins[slot, 0] == x and bins[slot, 1] == y and bins[slot, 2] == turned):
            slot = (slot + 1) % stamp.size
        if stamp[slot] != mark:
            stamp[slot] = mark
            bins[slot, 0], bins[slot, 1], bins[slot, 2] = x, y, turned
            found += 1
    if found < 2:
        return settings.least_particles
    share = 2.0 / (9.0 * (found - 1))
    needed = (found - 1) / (2.0 * settings.kld_error) * (1.0 - share + math.sqrt(share) * _NORMAL_99) ** 3
    return int(min(max(needed, settings.least_particles), settings.particles))
