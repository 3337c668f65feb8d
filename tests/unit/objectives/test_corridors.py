"""Corridors of antenna groups and the tail they make, against projections and survival curves by brute force."""

import math

import numpy as np
import pytest

from layoutopt.layout import TagPattern
from layoutopt.patterns.listed import listed
from layoutopt.patterns.square import square
from objectives import blind_runs
from objectives.corridors import corridors_in, corridors_of
from objectives.periodic_discs import antenna_group, one_antenna

SHEARS = ([[1, 0], [0, 1]], [[1, 2], [0, 1]], [[2, 1], [1, 1]], [[0, 1], [-1, 3]])
FOUR = listed(points_m=[(0.1, 0.15), (0.45, 0.2), (0.2, 0.5), (0.55, 0.62)], cell_m=[0.7, 0.7], shift_m=0.2)
PAIRS = {
    "in line": (square(pitch_m=0.35), [(0.2, 0.0), (-0.2, 0.0)], [0.05, 0.05], 0.0),
    "abreast": (square(pitch_m=0.35), [(0.0, 0.1), (0.0, -0.13)], [0.04, 0.03], 1.0),
    "aslant": (square(pitch_m=0.35), [(0.2, 0.05), (-0.13, -0.1)], [0.06, 0.05], 0.4),
    "four tags": (FOUR, [(0.2, 0.0), (-0.2, 0.1)], [0.07, 0.05], 0.3),
}


def group_of(name):
    """Return two antennas over a pattern."""
    pattern, antenna_m, radius_m, heading_rad = PAIRS[name]
    return antenna_group(pattern, np.array(antenna_m), np.array(radius_m), heading_rad=heading_rad)


def free_strips(tag_m, cell_m, antenna_m, radius_m, ahead_rad, vector_m):
    """Return what the discs' shadows on the normal of a period vector leave free, and after what that repeats."""
    way = vector_m / np.hypot(*vector_m)
    normal = np.array([-way[1], way[0]])
    period_m = abs(np.linalg.det(cell_m)) / np.hypot(*vector_m)
    cos, sin = (
        way[0] * math.cos(ahead_rad) - way[1] * math.sin(ahead_rad),
        way[1] * math.cos(ahead_rad) + way[0] * math.sin(ahead_rad),
    )
    lever_m = antenna_m @ np.array([[cos, sin], [-sin, cos]])
    shadow_m = ((tag_m[:, None] - lever_m) @ normal).ravel() % period_m
    half_m = np.tile(radius_m, len(tag_m))
    copies = np.arange(-2, 4) * period_m
    begin_m = (shadow_m - half_m + copies[:, None]).ravel()
    end_m = (shadow_m + half_m + copies[:, None]).ravel()
    order = np.argsort(begin_m)
    reach_m = np.maximum.accumulate(end_m[order])
    open_m = begin_m[order][1:] - reach_m[:-1]
    # Each strip of the plane is counted at the place within one period where it begins.
    counted = (open_m > 1e-10) & (reach_m[:-1] >= 0.0) & (reach_m[:-1] < period_m)
    return open_m[counted], period_m


def by_projection(tag_m, cell_m, antenna_m, radius_m, ahead_rad):
    """Return direction, width, blind share and period of the strips along all period vectors, there and back."""
    longest_m = abs(np.linalg.det(cell_m)) / (2.0 * max(radius_m))
    most = math.ceil(longest_m * np.linalg.norm(np.linalg.inv(cell_m), axis=0).max())
    rows = []
    for i in range(-most, most + 1):
        for j in range(-most, most + 1):
            vector_m = np.array([i, j]) @ cell_m
            if math.gcd(i, j) == 1 and np.hypot(*vector_m) < longest_m:
                open_m, period_m = free_strips(tag_m, cell_m, antenna_m, radius_m, ahead_rad, vector_m)
                direction_rad = math.atan2(vector_m[1], vector_m[0]) % (2.0 * math.pi)
                share, way_m = open_m.sum() / period_m, np.hypot(*vector_m)
                rows += [(direction_rad, width_m, share, way_m) for width_m in open_m]
    return np.array(sorted(np.round(rows, 8).tolist())).reshape(-1, 4)


def as_rows(found):
    """Return direction, width, blind share and period of corridors, sorted."""
    rows = [(item.direction_rad, item.width_m, item.blind_fraction, math.hypot(*item.vector_m)) for item in found]
    return np.array(sorted(np.round(rows, 8).tolist())).reshape(-1, 4)


@pytest.mark.parametrize("seed", range(30))
def test_corridors_are_what_shadows_leave_free(seed):
    """One to three tags and antennas anywhere, any heading and basis of the cell; every period vector is tried."""
    draws = np.random.Generator(np.random.Philox(seed))
    cell_m = np.eye(2) + draws.uniform(-0.4, 0.4, (2, 2))
    tag_m = draws.random((seed % 3 + 1, 2)) @ cell_m
    antenna_m, radius_m = (
        draws.uniform(-0.5, 0.5, (seed // 3 % 3 + 1, 2)),
        draws.uniform(0.02, 0.15, seed // 3 % 3 + 1),
    )
    ahead_rad = float(draws.uniform(-math.pi, math.pi))
    pattern = TagPattern(name="any", points_m=tag_m, cell_m=np.array(SHEARS[seed % 4]) @ cell_m)
    group = antenna_group(pattern, antenna_m, radius_m, heading_rad=ahead_rad)
    truth = by_projection(tag_m, cell_m, antenna_m, radius_m, ahead_rad)
    found = corridors_of(group)
    assert len(found) == len(truth)
    np.testing.assert_allclose(as_rows(found), truth, atol=2e-8)
    for item in found:
        there = corridors_in(group, item.direction_rad)
        assert [other.width_m for other in there] == pytest.approx(
            [other.width_m for other in found if abs(other.direction_rad - item.direction_rad) < 1e-9]
        )


@pytest.mark.parametrize("seed", range(8))
def test_corridors_of_one_antenna_run_both_ways(seed):
    """Each strip is found once, in [0, pi), with the width of its shadow either way."""
    draws = np.random.Generator(np.random.Philox(seed))
    cell_m = np.eye(2) + draws.uniform(-0.4, 0.4, (2, 2))
    tag_m = draws.random((seed % 4 + 1, 2)) @ cell_m
    pattern = TagPattern(name="any", points_m=tag_m, cell_m=np.array(SHEARS[seed % 4]) @ cell_m)
    both = by_projection(tag_m, cell_m, np.zeros((1, 2)), np.array([0.06]), 0.0)
    found = as_rows(corridors_of(one_antenna(pattern, 0.06)))
    assert 2 * len(found) == len(both) > 0
    np.testing.assert_allclose(found, both[both[:, 0] < math.pi - 1e-7], atol=2e-8)


@pytest.mark.parametrize("name", PAIRS)
def test_the_tail_constant_is_the_sum_over_corridors(name):
    """Half the sum of w² |v| / pi over the mean free area, with the corridors of all period vectors both ways."""
    pattern, antenna_m, radius_m, ahead_rad = PAIRS[name]
    group = group_of(name)
    truth = by_projection(pattern.points_m, pattern.cell_m, np.array(antenna_m), np.array(radius_m), ahead_rad)
    weight_m3 = float((truth[:, 1] ** 2 * truth[:, 3]).sum())
    angle = np.arange(720) * math.pi / 360.0
    free_m2 = float(blind_runs.blind_probabilities(group, 0.0, angle).mean()) * pattern.cell_area_m2
    assert blind_runs.tail_constant_of(group) == pytest.approx(weight_m3 / (2.0 * math.pi * free_m2), rel=1e-4)


@pytest.mark.parametrize("name", PAIRS)
def test_long_blind_runs_fall_as_the_tail_constant_says(name):
    """P(tau > T) T over even directions at 20 and 40 m, continued to 1 / T = 0: to 0.2 %; so the mean of 720."""
    group, count = group_of(name), 40_000
    angle = (np.arange(count) + 0.5) * 2.0 * math.pi / count
    free = float(blind_runs.blind_probabilities(group, 0.0, angle[::50]).mean())
    half, whole = (
        length_m * float(blind_runs.blind_probabilities(group, length_m, angle).mean()) / free
        for length_m in (20.0, 40.0)
    )
    constant_m = blind_runs.tail_constant_of(group)
    assert whole == pytest.approx(constant_m, rel=0.02)
    assert 2.0 * whole - half == pytest.approx(constant_m, rel=2e-3)
    survival = blind_runs.survival(group, np.array([40.0]), 720)[0]
    assert 40.0 * survival / free == pytest.approx(whole, rel=5e-3)


def test_antennas_abreast_close_what_one_leaves_open():
    """Two abreast, half a pitch apart, close along the rows what one leaves open, and not one behind another."""
    pattern, radius_m = square(pitch_m=0.35), np.full(2, 0.1)
    abreast = antenna_group(pattern, np.array([(0.0, 0.0875), (0.0, -0.0875)]), radius_m)
    behind = antenna_group(pattern, np.array([(0.0875, 0.0), (-0.0875, 0.0)]), radius_m)
    assert corridors_in(abreast, 0.0) == ()
    assert [item.width_m for item in corridors_in(behind, 0.0)] == pytest.approx([0.15])
    assert [item.width_m for item in corridors_in(behind, math.pi / 2.0)] == pytest.approx([0.15])
    sideways = antenna_group(pattern, behind.antenna_m, radius_m, heading_rad=math.pi / 2.0)
    assert corridors_in(sideways, 0.0) == ()
