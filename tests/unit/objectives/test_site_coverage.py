"""Coverage and blind runs on finite floors, against the exact measures of the infinite pattern."""

import math

import numpy as np
import pytest
from shapely.geometry import box

from layoutopt.antennas.disc import DiscAntenna
from layoutopt.layout import FloorTags, Layout, ReaderGroup, ZonePattern
from layoutopt.patterns.listed import listed
from layoutopt.patterns.square import square
from layoutopt.readers.profiles import COMMERCIAL
from layoutopt.robot import Robot
from layoutopt.scenario import Role, Routes, Scenario
from layoutopt.site import Site
from objectives.coverage import Coverage, random_runs, share_of, tags_seen
from objectives.invisibility import (
    blind_probability,
    blind_probability_over_directions,
    blind_run_quantile,
    mean_gap,
)
from objectives.site_invisibility import blind_runs_on_site, blind_stretches

PATTERN, RADIUS_M = square(pitch_m=0.35), 0.1
ROBOT = Robot(outline_m=[(-0.2, -0.2), (0.2, -0.2), (0.2, 0.2), (-0.2, 0.2)])


def layout(pattern=PATTERN, places=((0.0, 0.0),)):
    """Return a layout with antennas of the radius above."""
    antenna = DiscAntenna(side_m=0.1, radius_m=RADIUS_M)
    poses = [(x, y, 0.02, 0.0) for x, y in places]
    readers = ReaderGroup(name="group", poses=poses, antenna=antenna, profile=COMMERCIAL, slots=(0,) * len(places))
    return Layout(floor_tags=FloorTags(zones=(ZonePattern(zone="", pattern=pattern),)), readers=(readers,))


def scenario(width_m=40.0, height_m=40.0, **settings):
    """Return a scenario on an empty floor."""
    site = Site(name="floor", floor=box(0.0, 0.0, width_m, height_m))
    return Scenario(name="design", role=Role.DESIGN, site=site, robot=ROBOT, **settings)


def test_coverage_of_a_large_floor_is_that_of_the_pattern():
    """Within 4 standard errors of pi r² n and of one less the blind probability of 1 m."""
    found = Coverage(samples=4000)(layout(), scenario(), None)
    expected = {
        "pose_coverage": PATTERN.density_per_m2 * math.pi * RADIUS_M**2,
        "pose_coverage_two": 0.0,
        "run_coverage": 1.0 - blind_probability_over_directions(PATTERN, RADIUS_M, 1.0).mean,
    }
    for name, value in expected.items():
        assert abs(found[name].value - value) <= 4.0 * found[name].standard_error + 1e-12
        assert found[name].count == 4000


def test_two_tags_count_once_each():
    """Two antennas over one tag see one tag; over two tags they see two."""
    one = layout(pattern=listed(points_m=[(5.0, 5.0)]), places=((0.05, 0.0), (-0.05, 0.0)))
    two = layout(pattern=listed(points_m=[(5.05, 5.0), (4.9, 5.0)]), places=((0.1, 0.0), (-0.1, 0.0)))
    pose, world = np.array([(5.0, 5.0, 0.0)]), scenario(10.0, 10.0)
    assert tags_seen(one, world, pose, 0.0, 3).tolist() == [1]
    assert tags_seen(two, world, pose, 0.0, 3).tolist() == [2]
    assert tags_seen(two, world, pose, 0.0, 1).tolist() == [1]


def test_samples_are_the_same_for_every_layout_and_drive_where_the_robot_can():
    """Runs keep the robot's centre half a robot off the walls, and come again for the same seed."""
    world = scenario(3.0, 2.0)
    runs = random_runs(world.site, ROBOT, 500, 1.0, 3)
    ends = runs[:, :2] + np.stack([np.cos(runs[:, 2]), np.sin(runs[:, 2])], axis=1)
    places = np.concatenate([runs[:, :2], ends])
    assert len(runs) == 500
    assert (places > 0.28).all()
    assert (places < np.array([3.0, 2.0]) - 0.28).all()
    np.testing.assert_array_equal(runs, random_runs(world.site, ROBOT, 500, 1.0, 3))
    assert (runs != random_runs(world.site, ROBOT, 500, 1.0, 4)).any()


def test_a_site_too_narrow_for_a_run_has_no_run_coverage():
    """Rather than a number from other runs."""
    found = Coverage()(layout(), scenario(1.2, 1.2), None)
    assert set(found) == {"pose_coverage", "pose_coverage_two"}


@pytest.mark.parametrize("direction_rad", [None, 0.0, 0.3])
def test_blind_runs_on_a_large_floor_are_those_of_the_pattern(direction_rad):
    """The curve within 4.5 standard errors of B_L at 0.2, 0.5 and 1 m: a false alarm in 16,000 for all nine."""
    curve = blind_runs_on_site(layout(), scenario(), direction_rad=direction_rad, runs=6000)
    for length_m in (0.0, 0.2, 0.5, 1.0):
        if direction_rad is None:
            expected = blind_probability_over_directions(PATTERN, RADIUS_M, length_m).mean
        else:
            expected = blind_probability(PATTERN, RADIUS_M, length_m, direction_rad)
        found = curve.at(length_m)
        assert abs(found.value - expected) <= 4.5 * max(found.standard_error, 1e-3)
    if direction_rad is None:
        assert curve.quantile_m(0.9) == pytest.approx(blind_run_quantile(PATTERN, RADIUS_M, 0.9), rel=0.15)


def test_walls_are_no_sightings():
    """On a floor of which one end only has tags runs end blind at the walls, and the curve stays above zero."""
    one_tag = layout(pattern=listed(points_m=[(0.5, 0.5)]))
    curve = blind_runs_on_site(one_tag, scenario(4.0, 4.0), runs=500)
    assert curve.blind[-1] > 0.5
    assert math.isnan(curve.quantile_m(0.99))
    with pytest.raises(ValueError, match="runs on this site are 0 to"):
        curve.at(50.0)


def test_gaps_along_drives_are_santalos():
    """Mean of 3,000 gaps within 5 % of 45.5 cm, about three standard errors; blind share near 1 - n pi r²."""
    world = scenario(20.0, 20.0, routes=Routes(kind="point_to_point"), step_count=1200)
    found = blind_stretches(layout(), world, drives=120, seed=3)
    assert len(found.gaps_m) > 3000
    assert found.mean_gap_m == pytest.approx(mean_gap(PATTERN, RADIUS_M, 0.3), rel=0.05)
    share = found.blind_share
    expected = 1.0 - PATTERN.density_per_m2 * math.pi * RADIUS_M**2
    assert abs(share.value - expected) < 4.5 * share.standard_error
    assert found.gap_quantile_m(0.5) < found.gap_quantile_m(0.95) <= found.longest_m.max()
    np.testing.assert_array_equal(found.gaps_m, blind_stretches(layout(), world, drives=120, seed=3).gaps_m)


def test_a_share_of_nothing_or_all_keeps_its_doubt():
    """Its bounds do not collapse."""
    assert share_of(0, 100).upper() == pytest.approx(0.0295, abs=1e-4)
    assert share_of(100, 100).lower() == pytest.approx(0.9705, abs=1e-4)


def test_wrong_input_is_named():
    """Each with what would be right."""
    with pytest.raises(ValueError, match="at least two samples"):
        Coverage(samples=1)
    with pytest.raises(ValueError, match="at least one run"):
        blind_runs_on_site(layout(), scenario(), runs=0)
    with pytest.raises(ValueError, match="at least one drive"):
        blind_stretches(layout(), scenario(), drives=0, seed=1)
    with pytest.raises(ValueError, match="at least 0 and below 1"):
        blind_runs_on_site(layout(), scenario(4.0, 4.0), runs=10).quantile_m(1.0)
