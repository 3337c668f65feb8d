"""Compiled particle filter on UHF and laser; the plain twin and truth is `uhf_laser_filter`.

Random numbers come from outside, the same as the plain form draws, so both give the same particles up to rounding.
"""

import math
from typing import NamedTuple

import numpy as np
from numba import njit

from layoutopt.estimators.laser_clusters import Clustering
from layoutopt.estimators.laser_clusters_kernels import laser_clusters
from layoutopt.estimators.sensor_model import SensorTables
from layoutopt.estimators.uhf_laser_filter import Motion
from layoutopt.identity import BoolArray, FloatArray, IntArray

# No fastmath, as in all kernels: sums must not be reordered.
_compiled = njit(cache=True, error_model="numpy")


class Weighing(NamedTuple):
    """What a filter makes of what it is told.

    ``aliases`` is the place of a name in `phase_velocity.ALIASES`; the other names are those of `UhfLaser`.
    """

    uses_strength: bool
    uses_velocity: bool
    steps_unread: bool
    matches: int
    rho_m2: float
    seeded_share: float
    aliases: int
    phase_steps: int


class Place(NamedTuple):
    """What stays as it is.

    Attributes
    ----------
    robot
        x, y, cosine and sine, shape (4,).
    antennas
        The same for each antenna, shape (antennas, 4).
    beam, step_rad
        Cosine and sine of each beam in the robot's frame, shape (2, beams), and the angle between two.
    edges_m
        Edges of the floor, rows of x, y, x, y.
    """

    robot: FloatArray
    antennas: FloatArray
    beam: FloatArray
    step_rad: float
    edges_m: FloatArray


class Told(NamedTuple):
    """Columns of `TargetObservations`, with the wavelength, shape (n, antennas), for the frequency."""

    read_time_s: FloatArray
    strength_dbm: FloatArray
    phase_word: IntArray
    wavelength_m: FloatArray
    ranges_m: FloatArray


class State(NamedTuple):
    """What goes from one instant to the next, in arrays that are written to.

    Attributes
    ----------
    cloud
        Particles, shape (4, n): x, y, direction, speed.
    place_m
        The latest estimate, shape (2,).
    clusters_m, counts
        Clusters of the scan before, rows of x, y and radius, in the first rows; their number, shape (1,).
    """

    cloud: FloatArray
    place_m: FloatArray
    clusters_m: FloatArray
    counts: IntArray


@_compiled
def track(
    weighing: Weighing,
    motion: Motion,
    clustering: Clustering,
    tables: SensorTables,
    place: Place,
    told: Told,
    state: State,
    first: int,
    normal: FloatArray,
    uniform: FloatArray,
    mark: FloatArray,
    places_m: FloatArray,
    blind: BoolArray,
    by_laser: BoolArray,
) -> None:
    """Write places, health and whether a cluster counted, from instant ``first`` on, as many as ``mark`` has."""
    beams, size = place.beam.shape[1], state.cloud.shape[1]
    points_m, parts = np.empty((4, beams)), np.empty((beams + 1, 2), np.int64)
    clusters_m, similarities = np.empty((beams, 3)), np.empty(beams)
    best, taken = np.empty(weighing.matches, np.int64), np.empty(beams, np.bool_)
    nearest = np.empty(beams, np.int64)
    log_weight, parents = np.empty(size), np.empty(size, np.int64)
    scratch, terms = np.empty((4, size)), np.empty(weighing.matches)
    for k in range(mark.size):
        row = first + k
        count, matched = 0, 0
        if weighing.uses_velocity:
            count = laser_clusters(
                told.ranges_m[row], place.beam, place.step_rad, clustering, points_m, parts, clusters_m
            )
            _to_floor(place.robot, clusters_m, count)
            if row > 0 and count > 0 and state.counts[0] > 0:
                _find_nearest(clusters_m[:count], state.clusters_m[: state.counts[0]], nearest)
                _compare(
                    weighing, motion.interval_s, place, told, row, state, clusters_m[:count], nearest, similarities
                )
                matched = _best(similarities[:count], taken, best)
        heard = False
        for a in range(place.antennas.shape[0]):
            heard = heard or not math.isnan(told.strength_dbm[row, a])
        informed = (weighing.uses_strength and heard) or matched > 0
        if informed or weighing.steps_unread:
            _move(state.cloud, motion, place.edges_m, normal[k], uniform[k])
            for m in range(size):
                log_weight[m] = 0.0
            if matched > 0 and weighing.seeded_share > 0.0:
                _seed(
                    weighing,
                    motion,
                    place,
                    state,
                    clusters_m,
                    nearest,
                    similarities,
                    best[:matched],
                    normal[k],
                    uniform[k],
                )
            if weighing.uses_strength:
                _weigh_strength(state.cloud, tables, place.antennas, told.strength_dbm[row], log_weight)
            if matched > 0:
                _weigh_velocity(
                    state.cloud, clusters_m, similarities, best[:matched], weighing.rho_m2, terms, log_weight
                )
            _estimate(state, log_weight)
            _resample(log_weight, mark[k], parents)
            _gather(state.cloud, parents, scratch)
        for c in range(count):
            state.clusters_m[c, 0], state.clusters_m[c, 1] = clusters_m[c, 0], clusters_m[c, 1]
        state.counts[0] = count
        places_m[row, 0], places_m[row, 1] = state.place_m[0], state.place_m[1]
        blind[row] = not informed
        by_laser[row] = matched > 0


@_compiled
def _to_floor(robot: FloatArray, clusters_m: FloatArray, count: int) -> None:
    for c in range(count):
        x, y = clusters_m[c, 0], clusters_m[c, 1]
        clusters_m[c, 0] = robot[0] + robot[2] * x - robot[3] * y
        clusters_m[c, 1] = robot[1] + robot[3] * x + robot[2] * y


@_compiled
def _find_nearest(clusters_m: FloatArray, before_m: FloatArray, nearest: IntArray) -> None:
    for c in range(clusters_m.shape[0]):
        least = np.inf
        for b in range(before_m.shape[0]):
            away_x, away_y = clusters_m[c, 0] - before_m[b, 0], clusters_m[c, 1] - before_m[b, 1]
            away = away_x * away_x + away_y * away_y
            if away < least:
                nearest[c], least = b, away


@_compiled
def _compare(
    weighing: Weighing,
    interval_s: float,
    place: Place,
    told: Told,
    row: int,
    state: State,
    clusters_m: FloatArray,
    nearest: IntArray,
    similarities: FloatArray,
) -> None:
    """Write how well each cluster's radial velocity fits the phases, mean over the antennas that have a pair."""
    count, pairs = clusters_m.shape[0], 0
    for c in range(count):
        similarities[c] = 0.0
    for a in range(place.antennas.shape[0]):
        word, word_before = told.phase_word[row, a], told.phase_word[row - 1, a]
        if word_before < 0 or word < 0 or told.wavelength_m[row - 1, a] != told.wavelength_m[row, a]:
            continue
        pairs += 1
        steps, half_m = weighing.phase_steps, told.wavelength_m[row, a] / 2.0
        turn = word - word_before
        if weighing.aliases != 3:
            turn = (turn + steps // 2) % steps - steps // 2
        displacement_m = turn / steps * half_m
        apart_s = told.read_time_s[row, a] - told.read_time_s[row - 1, a]
        near, far, farther = displacement_m, displacement_m, displacement_m
        if weighing.aliases == 1:
            far = displacement_m - math.copysign(half_m, displacement_m)
        elif weighing.aliases == 2:
            far, farther = displacement_m - half_m, displacement_m + half_m
        antenna_x, antenna_y = place.antennas[a, 0], place.antennas[a, 1]
        for c in range(count):
            then = nearest[c]
            then_x, then_y = state.clusters_m[then, 0] - antenna_x, state.clusters_m[then, 1] - antenna_y
            now_x, now_y = clusters_m[c, 0] - antenna_x, clusters_m[c, 1] - antenna_y
            speed = (
                math.sqrt(now_x * now_x + now_y * now_y) - math.sqrt(then_x * then_x + then_y * then_y)
            ) / interval_s
            similarities[c] += max(
                _similarity(speed, near / apart_s),
                _similarity(speed, far / apart_s),
                _similarity(speed, farther / apart_s),
            )
    for c in range(count):
        similarities[c] /= max(pairs, 1)


@_compiled
def _similarity(one: float, other: float) -> float:
    total = abs(one) + abs(other)
    return 1.0 - abs(one - other) / total if total > 0.0 else 1.0


@_compiled
def _best(similarities: FloatArray, taken: BoolArray, best: IntArray) -> int:
    """Write the clusters that fit best, best first; return how many there are, none that does not fit at all."""
    for c in range(similarities.size):
        taken[c] = False
    for k in range(best.size):
        one, most = -1, 0.0
        for c in range(similarities.size):
            if not taken[c] and similarities[c] > most:
                one, most = c, similarities[c]
        if one < 0:
            return k
        taken[one] = True
        best[k] = one
    return best.size


@_compiled
def _on_floor(edges_m: FloatArray, x: float, y: float) -> bool:
    """Return whether a place lies on the floor: a ray from it crosses the edges an odd number of times."""
    inside = False
    for e in range(edges_m.shape[0]):
        x0, y0, x1, y1 = edges_m[e, 0], edges_m[e, 1], edges_m[e, 2], edges_m[e, 3]
        if (y0 > y) != (y1 > y) and x < x0 + (y - y0) / (y1 - y0) * (x1 - x0):
            inside = not inside
    return inside


@_compiled
def _move(cloud: FloatArray, motion: Motion, edges_m: FloatArray, normal: FloatArray, uniform: FloatArray) -> None:
    for m in range(cloud.shape[1]):
        step_x, step_y = motion.sigma_m * normal[0, m], motion.sigma_m * normal[1, m]
        if motion.heading:
            if uniform[0, m] < motion.fresh_share:
                cloud[2, m], cloud[3, m] = 2.0 * math.pi * uniform[1, m], motion.fastest_m_s * uniform[2, m]
            else:
                cloud[2, m] += motion.turn_sigma_rad * normal[2, m]
                speed = abs(cloud[3, m] + motion.speed_sigma_m_s * normal[3, m])
                cloud[3, m] = min(speed, motion.fastest_m_s)
            way = cloud[3, m] * motion.interval_s
            step_x, step_y = step_x + way * math.cos(cloud[2, m]), step_y + way * math.sin(cloud[2, m])
        x, y = cloud[0, m], cloud[1, m]
        if not motion.on_floor or _on_floor(edges_m, x + step_x, y + step_y):
            cloud[0, m], cloud[1, m] = x + step_x, y + step_y
            continue
        cloud[2, m] += math.pi
        if _on_floor(edges_m, x - step_x, y - step_y):
            cloud[0, m], cloud[1, m] = x - step_x, y - step_y


@_compiled
def _seed(
    weighing: Weighing,
    motion: Motion,
    place: Place,
    state: State,
    clusters_m: FloatArray,
    nearest: IntArray,
    similarities: FloatArray,
    best: IntArray,
    normal: FloatArray,
    uniform: FloatArray,
) -> None:
    """Put a share of the particles to matched clusters, with their velocities."""
    total = 0.0
    for k in range(best.size):
        total += similarities[best[k]]
    sigma_m = math.sqrt(weighing.rho_m2)
    for m in range(state.cloud.shape[1]):
        if uniform[3, m] >= weighing.seeded_share:
            continue
        mark, k, reached = uniform[3, m] / weighing.seeded_share * total, 0, similarities[best[0]]
        while reached <= mark and k < best.size - 1:
            k += 1
            reached += similarities[best[k]]
        one = best[k]
        x, y = clusters_m[one, 0] + sigma_m * normal[0, m], clusters_m[one, 1] + sigma_m * normal[1, m]
        if motion.on_floor and not _on_floor(place.edges_m, x, y):
            continue
        speed_x = (clusters_m[one, 0] - state.clusters_m[nearest[one], 0]) / motion.interval_s
        speed_y = (clusters_m[one, 1] - state.clusters_m[nearest[one], 1]) / motion.interval_s
        state.cloud[0, m], state.cloud[1, m], state.cloud[2, m] = x, y, math.atan2(speed_y, speed_x)
        state.cloud[3, m] = min(math.sqrt(speed_x * speed_x + speed_y * speed_y), motion.fastest_m_s)


@_compiled
def _weigh_strength(
    cloud: FloatArray,
    tables: SensorTables,
    antennas: FloatArray,
    strength_dbm: FloatArray,
    log_weight: FloatArray,
) -> None:
    columns, rows = tables.log_missed.shape
    for a in range(antennas.shape[0]):
        cos, sin, strength = antennas[a, 2], antennas[a, 3], strength_dbm[a]
        missed = math.isnan(strength)
        for m in range(cloud.shape[1]):
            away_x, away_y = cloud[0, m] - antennas[a, 0], cloud[1, m] - antennas[a, 1]
            ahead, aside = cos * away_x + sin * away_y, cos * away_y - sin * away_x
            column = math.floor((ahead - tables.origin_m[0]) / tables.cell_m)
            row = math.floor((aside - tables.origin_m[1]) / tables.cell_m)
            column, row = min(max(column, 0), columns - 1), min(max(row, 0), rows - 1)
            if missed:
                log_weight[m] += tables.log_missed[column, row]
            else:
                off = (strength - tables.mean_dbm[column, row]) * tables.per_sigma[column, row]
                log_weight[m] += tables.log_heard[column, row] - 0.5 * off * off


@_compiled
def _weigh_velocity(
    cloud: FloatArray,
    clusters_m: FloatArray,
    similarities: FloatArray,
    best: IntArray,
    rho_m2: float,
    terms: FloatArray,
    log_weight: FloatArray,
) -> None:
    for m in range(cloud.shape[1]):
        largest = -np.inf
        for k in range(best.size):
            away_x, away_y = cloud[0, m] - clusters_m[best[k], 0], cloud[1, m] - clusters_m[best[k], 1]
            terms[k] = math.log(similarities[best[k]]) - 0.5 * (away_x * away_x + away_y * away_y) / rho_m2
            largest = max(largest, terms[k])
        total = 0.0
        for k in range(best.size):
            total += math.exp(terms[k] - largest)
        log_weight[m] += largest + math.log(total)


@_compiled
def _gather(cloud: FloatArray, parents: IntArray, scratch: FloatArray) -> None:
    """Put the particles that the parents name in the place of all."""
    for row in range(cloud.shape[0]):
        for m in range(cloud.shape[1]):
            scratch[row, m] = cloud[row, m]
        for m in range(cloud.shape[1]):
            cloud[row, m] = scratch[row, parents[m]]


@_compiled
def _estimate(state: State, log_weight: FloatArray) -> None:
    """Write the weighted mean place, and weights in place of their logarithms."""
    largest, total, x, y = -np.inf, 0.0, 0.0, 0.0
    for m in range(log_weight.size):
        largest = max(largest, log_weight[m])
    for m in range(log_weight.size):
        weight = math.exp(log_weight[m] - largest)
        log_weight[m] = weight
        total += weight
        x += weight * state.cloud[0, m]
        y += weight * state.cloud[1, m]
    state.place_m[0], state.place_m[1] = x / total, y / total


@_compiled
def _resample(weight: FloatArray, uniform: float, parents: IntArray) -> None:
    """Write the parents of systematic resampling; the plain twin is `particles.systematic_parents`."""
    total, parent, reached = 0.0, 0, weight[0]
    for m in range(weight.size):
        total += weight[m]
    for m in range(parents.size):
        mark = (uniform + m) * (total / parents.size)
        while reached <= mark and parent < weight.size - 1:
            parent += 1
            reached += weight[parent]
        parents[m] = parent
