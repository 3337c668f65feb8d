"""Scenarios that a tolerance spans: same drives, other faults."""

import pytest
from shapely.geometry import box

from layoutopt.robot import Robot
from layoutopt.scenario import Faults, Role, Scenario
from layoutopt.site import Site
from layoutopt.tolerance import (
    Tolerance,
    corner_scenarios,
    drawn_scenarios,
    scenario_at,
    tolerance_scenarios,
)

WORLD = Scenario(
    name="world",
    role=Role.HELD_OUT,
    site=Site(name="hall", floor=box(0.0, 0.0, 5.0, 5.0)),
    robot=Robot(outline_m=[(-0.2, -0.2), (0.2, -0.2), (0.2, 0.2), (-0.2, 0.2)]),
    faults=Faults(missed_read_share=0.02, clock_error_s=0.01),
)


def test_three_ranges_have_eight_corners_that_share_their_drives():
    """The name keys the streams and stays; the first corner is the best, the last the worst one."""
    found = corner_scenarios(WORLD, Tolerance())
    assert len({scenario.key for scenario in found}) == 8
    assert {scenario.name for scenario in found} == {"world"}
    assert found[0].faults == WORLD.faults
    assert (found[-1].faults.tag_placement_sigma_m, found[-1].faults.dead_tag_share) == (0.005, 0.05)
    assert found[-1].faults.missed_read_share == 0.10


def test_a_range_without_width_adds_no_corner():
    """With nothing but placement there are two."""
    only = Tolerance(dead_tags=(0.01, 0.01), missed_reads=(0.02, 0.02))
    assert len(corner_scenarios(WORLD, only)) == 2
    assert all(scenario.faults.dead_tag_share == 0.01 for scenario in corner_scenarios(WORLD, only))


def test_other_faults_stay():
    """What the tolerance does not name is as in the scenario."""
    for scenario in (*corner_scenarios(WORLD, Tolerance()), *drawn_scenarios(WORLD, Tolerance(), count=3, seed=1)):
        assert scenario.faults.clock_error_s == 0.01


def test_draws_lie_in_their_ranges_and_depend_on_the_seed_alone():
    """The same seed gives the same scenarios; more of them begin alike."""
    tolerance = Tolerance(antenna_height_m=(-0.001, 0.002))
    found = drawn_scenarios(WORLD, tolerance, count=40, seed=7)
    assert [scenario.key for scenario in drawn_scenarios(WORLD, tolerance, count=10, seed=7)] == [
        scenario.key for scenario in found[:10]
    ]
    assert found[0].key != drawn_scenarios(WORLD, tolerance, count=1, seed=8)[0].key
    heights_m = [scenario.faults.antenna_height_error_m for scenario in found]
    assert -0.001 <= min(heights_m) < -0.0005 < 0.0015 < max(heights_m) <= 0.002
    assert all(0.02 <= scenario.faults.missed_read_share <= 0.10 for scenario in found)


def test_halfway_is_the_middle_of_every_range():
    """At a share of one half all faults are at half of their way."""
    faults = scenario_at(WORLD, Tolerance(antenna_height_m=(-0.002, 0.002)), 0.5).faults
    assert (faults.tag_placement_sigma_m, faults.dead_tag_share) == pytest.approx((0.0025, 0.025))
    assert (faults.missed_read_share, faults.antenna_height_error_m) == pytest.approx((0.06, 0.0))


def test_a_sweep_goes_from_the_low_ends_to_the_high_ones():
    """Its ends are the first and the last corner."""
    tolerance = Tolerance(antenna_height_m=(-0.001, 0.002))
    corners = corner_scenarios(WORLD, tolerance)
    assert scenario_at(WORLD, tolerance, 0.0) == corners[0]
    assert scenario_at(WORLD, tolerance, 1.0) == corners[-1]


def test_the_way_to_combine_chooses_the_scenarios():
    """Corners for the worst case, draws for a quantile."""
    assert len(tolerance_scenarios(WORLD, Tolerance(), count=5, seed=1)) == 8
    assert len(tolerance_scenarios(WORLD, Tolerance(combine="quantile"), count=5, seed=1)) == 5


@pytest.mark.parametrize(
    ("settings", "words"),
    [
        ({"placement_m": (0.005, 0.0)}, "from low to high"),
        ({"combine": "best"}, "worst, quantile"),
        ({"quantile": 1.0}, "between 0 and 1"),
        ({"dead_tags": (0.0, float("nan"))}, "from low to high"),
    ],
)
def test_what_is_no_tolerance_is_refused(settings, words):
    """The message says what would be right."""
    with pytest.raises(ValueError, match=words):
        Tolerance(**settings)
