"""What depends on the floor alone is the same wherever its origin lies, whichever basis and unit it is told in."""

import math

import numpy as np
import pytest

from layoutopt.geometry import turned
from layoutopt.layout import TagPattern
from objectives.invisibility import (
    blind_probability,
    blind_probability_over_directions,
    blind_run_quantile,
    corridors,
    gap_exceedance,
    mean_gap,
    tail_constant,
)
from objectives.position_bound import ESTIMATORS, covering_radius, static_error

RADII = (0.37, 0.8, 1.31)
ANGLE_RAD = np.array([0.0, 0.4, 1.1, 2.7])
MOVES = ((1000.0, -1000.0), (0.3, -0.7), (-77.7, 12.3))
BASES = (
    [[1, 3], [0, 1]],
    [[2, 1], [1, 1]],
    [[0, 1], [1, 0]],
    [[-1, 0], [0, 1]],
    [[7, 4], [5, 3]],
    [[1, -40], [0, 1]],
)
SCALES = (1e-3, 1e3, 0.35)
TURNS_RAD = (0.3, math.pi / 2.0, 2.0, -1.234)
FLOORS = range(4)
"""Seeds: as many tags as the seed and one."""


def floor(seed, *, move=(0.0, 0.0), basis=((1, 0), (0, 1)), scale=1.0, turn_rad=0.0):
    """Return a random floor of one tag on a unit of area, moved, in another basis or unit, or turned."""
    draws = np.random.Generator(np.random.Philox(seed))
    count = seed + 1
    cell = np.eye(2) + draws.uniform(-0.35, 0.35, (2, 2))
    cell *= math.sqrt(count / abs(np.linalg.det(cell)))
    points = turned(draws.random((count, 2)) @ cell, turn_rad) + move
    return TagPattern(
        name="any", points_m=scale * points, cell_m=scale * (np.array(basis) @ turned(cell, turn_rad))
    )


def static(pattern, scale=1.0, estimators=ESTIMATORS):
    """Return worst and mean errors, the covering radius and shares, for all radii and estimators, unit lengths."""
    found = [static_error(pattern, scale * radius, estimator) for radius in RADII for estimator in estimators]
    lengths = [length_m / scale for error in found for length_m in (error.worst_m, error.mean_m)]
    return [*lengths, covering_radius(pattern) / scale, *(error.detection_probability for error in found)]


def blind(pattern, scale=1.0, turn_rad=0.0):
    """Return what there is of blind runs, for a small radius and one with overlaps, unit lengths."""
    found = []
    for radius in (0.13, 0.31):
        radius_m, direction_rad = scale * radius, ANGLE_RAD + turn_rad
        for length in (0.0, 0.6, 1.9):
            found += blind_probability(pattern, radius_m, scale * length, direction_rad).tolist()
            found += gap_exceedance(pattern, radius_m, scale * length, direction_rad).tolist()
        found += [mean_gap(pattern, radius_m, float(angle)) / scale for angle in direction_rad + 0.05]
    return found


def strips(pattern, scale=1.0, turn_rad=0.0):
    """Return direction, width and blind share of all corridors, sorted, unit lengths."""
    rows = [
        ((item.direction_rad - turn_rad) % math.pi, item.width_m / scale, item.blind_fraction)
        for item in corridors(pattern, 0.13 * scale)
    ]
    # A direction of zero may come back as one just below pi.
    rows = [(angle if angle < math.pi - 1e-9 else angle - math.pi, *rest) for angle, *rest in rows]
    return np.array(sorted(np.round(rows, 9).tolist()))


def same(found, wanted, tolerance=1e-9):
    """Check numbers to nine digits."""
    np.testing.assert_allclose(found, wanted, rtol=tolerance, atol=tolerance)


@pytest.mark.parametrize("move", MOVES)
@pytest.mark.parametrize("seed", FLOORS)
def test_moved(seed, move):
    """Numbers far from the origin keep fewer digits, and lose no more."""
    here, there = floor(seed), floor(seed, move=move)
    tolerance = 1e-9 * (1.0 + max(np.abs(move)) / 10.0)
    same(static(there), static(here), tolerance)
    same(blind(there), blind(here), tolerance)
    same(strips(there), strips(here), tolerance)


@pytest.mark.parametrize("basis", BASES, ids=str)
@pytest.mark.parametrize("seed", FLOORS)
def test_in_another_basis(seed, basis):
    """Skewed and unreduced cells, exchanged and reversed periods."""
    here, there = floor(seed), floor(seed, basis=basis)
    same(static(there), static(here))
    same(blind(there), blind(here))
    same(strips(there), strips(here))


@pytest.mark.parametrize("scale", SCALES)
@pytest.mark.parametrize("seed", FLOORS)
def test_in_another_unit(seed, scale):
    """A floor of millimetres and one of kilometres have the errors of one of metres, in their unit."""
    here, there = floor(seed), floor(seed, scale=scale)
    same(static(there, scale), static(here))
    same(blind(there, scale), blind(here))
    same(strips(there, scale), strips(here))


@pytest.mark.parametrize("turn_rad", TURNS_RAD)
@pytest.mark.parametrize("seed", FLOORS)
def test_turned(seed, turn_rad):
    """Centroid, minimax, and blind runs in a direction that turns along; the midrange goes by the axes."""
    here, there = floor(seed), floor(seed, turn_rad=turn_rad)
    same(static(there, estimators=ESTIMATORS[1:]), static(here, estimators=ESTIMATORS[1:]))
    same(blind(there, turn_rad=turn_rad), blind(here))
    same(strips(there, turn_rad=turn_rad), strips(here))


@pytest.mark.parametrize("seed", FLOORS)
def test_a_quarter_turn_leaves_the_midrange(seed):
    """It exchanges the axes."""
    here, there = floor(seed), floor(seed, turn_rad=math.pi / 2.0)
    same(static(there), static(here))


@pytest.mark.parametrize("seed", FLOORS)
def test_sums_over_directions(seed):
    """Mean, worst, quantile and tail, moved, in a skewed basis and another unit at once."""
    scale = 1e-3
    found = []
    for pattern, unit in (
        (floor(seed), 1.0),
        (floor(seed, move=(5.5, -3.25), basis=[[2, 1], [1, 1]], scale=scale), scale),
    ):
        radius_m = 0.13 * unit
        over = blind_probability_over_directions(pattern, radius_m, 1.3 * unit, 90)
        tail_m, quantile_m = tail_constant(pattern, radius_m), blind_run_quantile(pattern, radius_m, 0.95, 90)
        found.append((over.mean, over.worst, tail_m / unit, quantile_m / unit))
    same(found[1], found[0], 1e-8)
