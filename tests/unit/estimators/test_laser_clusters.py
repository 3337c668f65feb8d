"""Clusters of laser scans: known shapes, what hides them, Eq. 6 and 7, and the compiled twin."""

import math

import numpy as np
import pytest

from layoutopt.estimators.laser_clusters import (
    PEOPLE,
    Clustering,
    laser_clusters,
    nearest_before,
    radial_velocities,
)
from layoutopt.estimators.laser_clusters_kernels import laser_clusters as compiled_clusters
from layoutopt.tracking_world import LaserScanner

LASER = LaserScanner()
BEAMS = len(LASER.beam_rad)


def scan(discs, wall_m=math.inf):
    """Return exact ranges to discs (x, y, radius) before a wall across the way ahead, at x = ``wall_m``."""
    cos, sin = np.cos(LASER.beam_rad), np.sin(LASER.beam_rad)
    ranges_m = np.where(cos > 0.05, wall_m / np.maximum(cos, 0.05), np.inf)
    for x_m, y_m, radius_m in discs:
        along_m = x_m * cos + y_m * sin
        under = radius_m**2 - (x_m**2 + y_m**2 - along_m**2)
        hit = (under >= 0.0) & (along_m > 0.0)
        ranges_m = np.where(hit, np.minimum(ranges_m, along_m - np.sqrt(np.maximum(under, 0.0))), ranges_m)
    return np.where(ranges_m <= LASER.range_m, ranges_m, np.inf)


def compiled(ranges_m, clustering=PEOPLE):
    """Return what the compiled twin finds."""
    beam = np.stack([np.cos(LASER.beam_rad), np.sin(LASER.beam_rad)])
    scratch, parts, out = np.empty((4, BEAMS)), np.empty((BEAMS + 1, 2), np.int64), np.empty((BEAMS, 3))
    count = compiled_clusters(ranges_m, beam, LASER.step_rad, clustering, scratch, parts, out)
    return out[:count]


def test_a_person_is_one_cluster_a_little_before_the_middle():
    """From 1 to 6 m; the guide line of a half circle lies before its middle, by less than its radius."""
    for distance_m in (1.0, 2.0, 4.0, 6.0):
        for angle_rad in (-1.2, 0.0, 0.7):
            place_m = distance_m * np.array([math.cos(angle_rad), math.sin(angle_rad)])
            (found,) = laser_clusters(scan([(*place_m, 0.22)]), LASER)
            assert np.hypot(*(found[:2] - place_m)) < 0.22 * 0.9
            assert np.hypot(*found[:2]) < distance_m
            assert 0.15 < found[2] <= 0.22


def test_two_people_are_two_clusters_in_the_order_of_the_beams():
    """The beams go from right to left; people side by side with a gap are not joined."""
    found = laser_clusters(scan([(2.0, 0.5, 0.22), (2.0, -0.5, 0.22)]), LASER)
    np.testing.assert_allclose(found[:, 1], [-0.5, 0.5], atol=0.05)


def test_a_wall_behind_a_person_is_no_cluster():
    """Neither whole nor in the parts that are seen beside and between people."""
    people = [(2.0, 0.0, 0.22), (2.0, 0.75, 0.22), (2.0, -0.8, 0.22)]
    found = laser_clusters(scan(people, wall_m=3.0), LASER)
    np.testing.assert_allclose(found[:, 1], [-0.8, 0.0, 0.75], atol=0.1)


def test_a_person_half_behind_another_is_still_seen():
    """One end is free, so there is a cluster, of what is seen of it; between two others there is none."""
    near, far = (1.5, 0.0, 0.22), (3.0, 0.35, 0.22)
    found = laser_clusters(scan([near, far]), LASER)
    assert len(found) == 2
    assert found[1, 2] < 0.2
    assert len(laser_clusters(scan([near, (1.5, 0.45, 0.22), (3.0, 0.45, 0.22)]), LASER)) == 2


def test_what_is_too_large_or_too_thin_is_no_person():
    """By R_max, and by the least number of returns."""
    column = scan([(2.0, 0.0, 0.5)])
    assert len(laser_clusters(column, LASER, Clustering(split_m=9.0))) == 0
    assert len(laser_clusters(column, LASER, Clustering(split_m=9.0, largest_radius_m=0.5))) == 1
    assert len(laser_clusters(scan([(6.0, 0.0, 0.05)]), LASER)) == 0


def test_a_corner_is_cut_where_it_bends():
    """Two legs of 0.6 m that meet at a right angle towards the scanner are two clusters that share the corner."""
    cos, sin = np.cos(LASER.beam_rad), np.sin(LASER.beam_rad)
    reach_m = 2.0 / np.maximum(cos + np.abs(sin), 0.05) * np.where(cos > 0.0, 1.0, np.nan)
    seen = (np.abs(reach_m * sin) < 0.0) | (np.abs(2.0 / (cos - np.abs(sin)) * sin) < 0.42)
    ranges_m = np.where(seen & (cos > 0.5), 2.0 / (cos - np.abs(sin)), np.inf)
    found = laser_clusters(ranges_m, LASER)
    assert len(found) == 2
    np.testing.assert_allclose(found[:, 2], 0.3, atol=0.04)
    np.testing.assert_allclose(found[0, :2], found[1, :2] * [1.0, -1.0], atol=1e-9)


def test_the_circle_has_the_fitted_line_as_diameter():
    """A board of 0.6 m seen with noise: middle and half length come out far better than one range is."""
    draws = np.random.Generator(np.random.Philox(6))
    cos, sin = np.cos(LASER.beam_rad), np.sin(LASER.beam_rad)
    exact_m = np.where((cos > 0.5) & (np.abs(sin / cos) < 0.15), 2.0 / np.maximum(cos, 0.5), np.inf)
    found = np.array([laser_clusters(exact_m + 0.02 * draws.standard_normal(BEAMS), LASER)[0] for _ in range(200)])
    half_m = 2.0 * math.tan(math.radians(8.5))
    count = int(np.isfinite(exact_m).sum())
    # Distances are means of all returns; 5.5 standard errors of 200 such means, and a spread near theory.
    assert abs(found[:, 0].mean() - 2.0) < 5.5 * 0.02 / math.sqrt(200 * count) + 0.001
    assert found[:, 0].std() < 1.5 * 0.02 / math.sqrt(count)
    np.testing.assert_allclose(found[:, 2].mean(), half_m, atol=0.005)


def test_an_empty_scan_has_no_clusters():
    """Nothing within range."""
    assert laser_clusters(np.full(BEAMS, np.inf), LASER).shape == (0, 3)
    assert len(compiled(np.full(BEAMS, np.inf))) == 0


@pytest.mark.parametrize("split_m", [0.05, 0.2])
def test_compiled_clusters_are_those_of_the_plain_form(split_m):
    """On many noisy scenes with walls, and beams without a return, but for the order of sums."""
    draws = np.random.Generator(np.random.Philox(5))
    clustering, found = PEOPLE._replace(split_m=split_m), 0
    for _ in range(200):
        discs = np.column_stack(
            [draws.uniform(0.5, 5.0, 8), draws.uniform(-4.0, 4.0, 8), draws.uniform(0.1, 0.5, 8)]
        )
        ranges_m = scan(discs, wall_m=draws.uniform(2.0, 8.0))
        ranges_m = np.maximum(ranges_m + 0.01 * draws.standard_normal(BEAMS), 0.0)
        ranges_m[draws.random(BEAMS) < 0.05] = np.inf
        plain = laser_clusters(ranges_m, LASER, clustering)
        np.testing.assert_allclose(compiled(ranges_m, clustering), plain, atol=1e-12)
        found += len(plain)
    assert found > 400


def test_radial_velocity_is_that_of_the_nearest_cluster_before():
    """Eq. 6 and 7, counted from the robot and from elsewhere."""
    before_m, now_m = np.array([[2.0, 0.0], [0.0, 2.0]]), np.array([[0.3, 2.0], [2.2, 0.0], [1.0, 0.0]])
    assert nearest_before(now_m, before_m).tolist() == [1, 0, 0]
    found = radial_velocities(now_m, before_m, 0.4)
    np.testing.assert_allclose(found, [(math.hypot(0.3, 2.0) - 2.0) / 0.4, 0.5, -2.5])
    np.testing.assert_allclose(
        radial_velocities(now_m, before_m, 0.4, (2.0, 1.0))[1], (math.sqrt(1.04) - 1.0) / 0.4
    )
    with pytest.raises(ValueError, match="none before"):
        nearest_before(now_m, before_m[:0])


@pytest.mark.parametrize(("value", "message"), [(math.nan, "beam 3:"), (-0.1, "beam 3:"), (None, "541 beams")])
def test_a_scan_with_nan_or_of_another_length_is_refused(value, message):
    """With the beam, and what to write instead."""
    ranges_m = np.full(BEAMS if value is not None else 5, 2.0)
    if value is not None:
        ranges_m[3] = value
    with pytest.raises(ValueError, match=message):
        laser_clusters(ranges_m, LASER)
