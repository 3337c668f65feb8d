"""Straight legs: where they end, and when the discs crossed on them were entered and left."""

import math

import numpy as np
import pytest
from reader_worlds import AHEAD, BACK, LEFT, RIGHT, driven, one_antenna

from layoutopt.estimators.straight_legs import LegWatch
from layoutopt.robot import Odometry

RADIUS_M = 0.1


def legs_of(known, told):
    """Return the legs of a drive with the numbers of the steps in which they begin."""
    watch = LegWatch(known, by_way=True)
    legs = [(0, watch.leg)]
    for step, (motion, reads) in enumerate(told.steps()):
        if watch.step(motion, reads):
            legs.append((step, watch.leg))
    return legs


def noisy(increments, seed, odometry=None):
    """Return what the wheels say of steps, and its deviations."""
    increments = np.array(increments, dtype=np.float64)
    sigma = (odometry or Odometry()).sigma(increments, 0.05)
    return increments + sigma * np.random.default_rng(seed).standard_normal(increments.shape), sigma


@pytest.mark.parametrize("period", [1, 4])
def test_edges_lie_half_a_scan_before_the_reads_that_show_them(period):
    """Over drives that begin anywhere between two scans, entering and leaving are late by nothing on average."""
    known = one_antenna([(0.5, 0.0)], RADIUS_M, period=period)
    scan_m, count = 0.01 * period, 40
    off_m = []
    for shift in range(count):
        start_m = -scan_m * (shift + 0.5) / count
        _, told = driven(known, (start_m, 0.04, 0.0), [AHEAD] * 80)
        ((_, leg),) = legs_of(known, told)
        (crossing,) = leg.crossings
        half_m = math.sqrt(RADIUS_M**2 - 0.04**2)
        off_m.append((crossing.entered - (0.5 - half_m - start_m), crossing.left - (0.5 + half_m - start_m)))
    assert np.abs(np.mean(off_m, axis=0)).max() < 0.05 * scan_m
    # No single edge is off by more than half a scan, and the deviation that is stated is that of all of them.
    assert np.abs(off_m).max() < crossing.most_off * 1.05
    assert np.std(off_m) == pytest.approx(crossing.sigma, rel=0.1)


@pytest.mark.parametrize("kept", [(AHEAD, LEFT, BACK, RIGHT), (LEFT, BACK, RIGHT, AHEAD), (AHEAD, BACK)])
def test_a_leg_ends_where_the_direction_of_travel_changes(kept):
    """With exact wheels at once: round a square with the heading kept, and on the way back."""
    known = one_antenna([(9.0, 9.0)])
    _, told = driven(known, (0.0, 0.0, 0.3), [step for step in kept for _ in range(50)])
    assert [begun for begun, _ in legs_of(known, told)] == [50 * side for side in range(len(kept))]


@pytest.mark.parametrize("way_m", [0.001, 0.004, 0.0125])
@pytest.mark.parametrize("seed", range(4))
def test_noisy_wheels_end_legs_soon_after_the_corner(way_m, seed):
    """However long the steps are: within 3 cm of a corner, and nowhere else."""
    known = one_antenna([(9.0, 9.0)])
    side = round(1.0 / way_m)
    true = np.repeat([(way_m, 0.0, 0.0), (0.0, way_m, 0.0), (-way_m, 0.0, 0.0)], side, axis=0)
    told, sigma = noisy(true, seed)
    _, seen = driven(known, (0.0, 0.0, 0.0), true, sigma, told)
    begun = np.array([step for step, _ in legs_of(known, seen)[1:]])
    after_m = way_m * (begun % side)
    assert after_m.max() < 0.03
    assert set(begun // side) == {1, 2}


@pytest.mark.parametrize("seed", range(4))
def test_noise_alone_ends_no_leg(seed):
    """On 20 m straight ahead."""
    known = one_antenna([(99.0, 99.0)])
    true = np.tile((0.01, 0.0, 0.0), (2000, 1))
    told, sigma = noisy(true, seed)
    _, seen = driven(known, (0.0, 0.0, 0.0), true, sigma, told)
    # A curve is one by the turn of all steps together, to three deviations.
    assert len(legs_of(known, seen)) <= 2


def test_a_curve_with_the_heading_kept_is_no_leg():
    """On a circle of 1 m a leg ends before it strays 1 cm from a line."""
    known = one_antenna([(9.0, 9.0)])
    angle = np.arange(628) * 0.01
    true = np.stack([0.01 * np.cos(angle), 0.01 * np.sin(angle), np.zeros(628)], axis=1)
    _, told = driven(known, (0.0, 0.0, 0.0), true)
    begun = [step for step, _ in legs_of(known, told)]
    assert max(np.diff(begun)) * 0.01 < math.sqrt(8.0 * 0.01)


def test_a_leg_that_leads_nowhere():
    """Steps to and fro that noise hides come back to the begin."""
    known = one_antenna([(9.0, 9.0)])
    _, told = driven(known, (0.0, 0.0, 0.0), [AHEAD, BACK] * 5, sigma=0.1)
    ((_, leg),) = legs_of(known, told)
    assert leg.leads_nowhere
    _, told = driven(known, (0.0, 0.0, 0.0), [AHEAD] * 5, sigma=0.1)
    ((_, leg),) = legs_of(known, told)
    assert not leg.leads_nowhere
