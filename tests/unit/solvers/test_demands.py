"""Demands: which runs they speak of, and what a robot sees on them."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from placement_cases import antennas_at, hall, plate, scenario_of
from scipy.stats import beta
from shapely.geometry import LineString, Point, box

from layoutopt.site import Site, Zone
from solvers.demands import Demand, Runs, random_runs_of, runs_of, share_by_draw, visible
from solvers.placement_check import Missed, missed_share, tags_in_view

SITE = Site(
    name="hall",
    floor=box(0.0, 0.0, 3.0, 2.0),
    obstacles=(box(1.4, 0.0, 1.6, 1.2),),
    zones=(Zone(name="dock", region=box(0.0, 0.0, 1.0, 1.0)), plate(2.0, 1.0, 2.6, 1.6)),
)
SCENARIO = scenario_of(SITE)


def _all(demand):
    return (
        runs_of(demand, SCENARIO, step_m=0.15, headings=8, routes=3),
        random_runs_of(demand, SCENARIO, 300, 5, routes=3),
    )


@settings(max_examples=15)
@given(st.integers(0, 10_000))
def test_what_a_run_sees_agrees_with_walking_along_it(seed):
    """Brute force: the run walked in small steps sees the same tags, save those that it only just touches."""
    draws = np.random.Generator(np.random.Philox(seed))
    antennas = antennas_at(draws.uniform(-0.3, 0.3, (3, 2)), 0.12)
    length_m = float(draws.choice([0.0, 0.4]))
    heading_rad = draws.uniform(-math.pi, math.pi, 6)
    poses = np.column_stack([draws.uniform(0.0, 2.0, (6, 2)), heading_rad])
    runs = Runs(poses=poses, way_m=length_m * np.column_stack([np.cos(heading_rad), np.sin(heading_rad)]))
    xy_m = draws.uniform(-0.3, 2.3, (60, 2))
    nearest_m = np.full((6, 60), np.inf)
    for share in np.linspace(0.0, 1.0, 201):
        for x_m, y_m in antennas.xy_m:
            cos, sin = np.cos(heading_rad), np.sin(heading_rad)
            at_m = (
                poses[:, :2] + share * runs.way_m + np.column_stack([cos * x_m - sin * y_m, sin * x_m + cos * y_m])
            )
            nearest_m = np.minimum(nearest_m, np.linalg.norm(at_m[:, None] - xy_m[None], axis=2))
    table = visible(runs, antennas, xy_m)
    seen = np.zeros((6, 60), dtype=bool)
    seen[table.row, table.slot] = True
    clear = np.abs(nearest_m - 0.12) > 1e-3
    assert (seen == (nearest_m < 0.12))[clear].all()
    assert (tags_in_view(runs, antennas, xy_m) == np.diff(table.start)).all()


@pytest.mark.parametrize("along_routes", [False, True])
def test_runs_keep_the_robot_on_the_floor_and_begin_in_their_zone(along_routes):
    """Every run has room for the robot, its length, its zone, and touches no zone that is left out."""
    demand = Demand(length_m=0.4, zone="dock", along_routes=along_routes)
    room = SITE.robot_region(SCENARIO.robot.radius_m).buffer(1e-6)
    for runs in _all(demand):
        assert len(runs)
        assert np.allclose(np.hypot(*runs.way_m.T), 0.4)
        ahead_m = 0.4 * np.column_stack([np.cos(runs.poses[:, 2]), np.sin(runs.poses[:, 2])])
        assert np.allclose(runs.way_m, ahead_m)
        for pose, way_m in zip(runs.poses, runs.way_m, strict=True):
            assert SITE.zone("dock").region.covers(Point(pose[:2]))
            assert room.covers(LineString([pose[:2], pose[:2] + way_m]))


@pytest.mark.parametrize(("along_routes", "length_m"), [(False, 0.4), (True, 0.4), (False, 0.0)])
def test_runs_that_touch_a_zone_left_out_are_not_asked_for(along_routes, length_m):
    """Without the zone there are such runs, with it none."""
    region = SITE.zone("plate").region

    def touching(runs):
        return sum(
            (LineString([pose[:2], pose[:2] + way_m]) if length_m else Point(pose[:2])).intersects(region)
            for pose, way_m in zip(runs.poses, runs.way_m, strict=True)
        )

    free = Demand(length_m=length_m, along_routes=along_routes)
    kept = Demand(length_m=length_m, along_routes=along_routes, without=("plate",))
    assert touching(_all(free)[1]) > 0
    for runs in _all(kept):
        assert len(runs)
        assert touching(runs) == 0


def test_runs_along_routes_go_straight_on_a_leg():
    """On a square of way points every run lies on one of its sides."""
    from layoutopt.scenario import Routes

    corners_m = np.array([(0.4, 0.4), (1.0, 0.4), (1.0, 1.6), (0.4, 1.6)])
    scenario = scenario_of(SITE, Routes(kind="way_points", way_points_m=corners_m))
    runs = runs_of(Demand(length_m=0.3, along_routes=True), scenario, step_m=0.05, headings=1, routes=1)
    ring = LineString([*corners_m, corners_m[0]])
    assert len(runs)
    for pose, way_m in zip(runs.poses, runs.way_m, strict=True):
        assert ring.buffer(1e-9).covers(LineString([pose[:2], pose[:2] + way_m]))
    assert set(np.round(np.degrees(runs.poses[:, 2])) % 360) <= {0.0, 90.0, 180.0, 270.0}


def test_a_demand_for_nothing_is_refused():
    """No tag, a negative length and no number are no demand."""
    for values in ({"tags": 0}, {"length_m": -1.0}, {"length_m": math.nan}):
        with pytest.raises(ValueError, match=r"at least one tag|length of a run"):
            Demand(**values)


def test_random_runs_are_a_function_of_their_seed():
    """The same seed gives the same runs, another one others."""
    for demand in (Demand(), Demand(along_routes=True)):
        one, same, other = (random_runs_of(demand, SCENARIO, 50, seed, routes=2) for seed in (3, 3, 4))
        assert np.array_equal(one.poses, same.poses)
        assert not np.array_equal(one.poses, other.poses)


def test_every_run_of_as_many_routes_as_asked_for_is_taken_once_and_numbered_by_its_route():
    """On a straight corridor driven once a route has one leg: starts lie a step apart, from a random one on."""
    from layoutopt.scenario import Routes

    line = Routes(kind="way_points", way_points_m=np.array([(0.4, 1.6), (2.4, 1.6)]), start="first")
    scenario = replace(scenario_of(SITE, line), step_count=130)
    demand = Demand(length_m=0.5, along_routes=True)
    runs = random_runs_of(demand, scenario, 10_000, 2, routes=40)
    assert runs.draws == 40
    there = runs.some(np.abs(runs.poses[:, 2]) < 1e-9)
    for number in range(40):
        x_m = np.sort(there.some(there.draw == number).poses[:, 0])
        assert len(x_m) == 15
        assert np.allclose(np.diff(x_m), 0.1)
        assert 0.4 <= x_m[0] < 0.5
        assert x_m[-1] <= 1.9 + 1e-9
    some = random_runs_of(demand, scenario, 100, 2, routes=40)
    assert len(some) == 100
    every = {(number, *pose) for number, pose in zip(runs.draw.tolist(), runs.poses.tolist(), strict=True)}
    assert {(number, *pose) for number, pose in zip(some.draw.tolist(), some.poses.tolist(), strict=True)} <= every


def test_routes_without_a_run_are_no_draws():
    """Few routes have a straight run in the dock; nobody counts the others."""
    demand = Demand(length_m=0.5, zone="dock", along_routes=True)
    runs = random_runs_of(demand, SCENARIO, 10_000, 3, routes=40)
    assert 0 < runs.draws < 40
    assert runs.draw.max() < 40
    assert share_by_draw(runs, runs).count == runs.draws
    assert not len(random_runs_of(replace(demand, length_m=9.0), SCENARIO, 100, 3, routes=5))


def test_runs_of_one_route_make_no_bound_narrower():
    """Ten routes of a hundred runs are bounded as ten runs are, and a mean of shares is a mean over routes."""
    poses = np.zeros((1000, 3))
    alike = Runs(poses=poses, way_m=poses[:, :2], draw=np.repeat(np.arange(10), 100))
    none, whole_route = alike.some(np.arange(0)), alike.some(alike.draw == 3)
    assert share_by_draw(none, alike).upper() == pytest.approx(1.0 - 0.05**0.1)
    lost = share_by_draw(whole_route, alike)
    assert (lost.value, lost.count) == (0.1, 10)
    assert lost.upper() == pytest.approx(float(beta.ppf(0.95, 2, 9)))
    apart = Runs(poses=poses, way_m=poses[:, :2])
    assert share_by_draw(apart.some(np.arange(100)), apart).upper() == pytest.approx(
        float(beta.ppf(0.95, 101, 900))
    )
    uneven = Runs(poses=poses[:4], way_m=poses[:4, :2], draw=np.array([5, 7, 7, 7]))
    assert share_by_draw(uneven.some([0]), uneven).value == pytest.approx(0.5)
    with pytest.raises(ValueError, match="needs runs"):
        share_by_draw(none, none)
    with pytest.raises(ValueError, match="3 numbers of draws for 4 runs"):
        Runs(poses=poses[:4], way_m=poses[:4, :2], draw=np.arange(3))


def test_the_bound_of_a_share_by_routes_holds_in_simulations():
    """Routes that are lost all together or in part: the 95 % bound lies below the truth in 5 % of 200 at most.

    With five standard deviations to spare a false alarm has a chance of 4e-6 for each of the three; by runs as if
    they were independent the bound fails far more often.
    """
    draws = np.random.Generator(np.random.Philox(8))
    number = np.repeat(np.arange(50), 20)
    poses = np.zeros((1000, 3))
    alike = Runs(poses=poses, way_m=poses[:, :2], draw=number)
    apart = Runs(poses=poses, way_m=poses[:, :2])
    for chance, part in ((0.04, 1.0), (0.1, 0.5), (0.3, 0.05)):
        failures = np.zeros(2)
        for _ in range(200):
            lost = (draws.random(50) < chance)[number] & (draws.random(1000) < part)
            bounds = [share_by_draw(runs.some(lost), runs).upper() for runs in (alike, apart)]
            failures += np.array(bounds) < chance * part
        assert failures[0] <= 200 * 0.05 + 5.0 * math.sqrt(200 * 0.05 * 0.95)
        if part == 1.0:
            assert failures[1] > failures[0]


def test_the_check_counts_what_a_bare_floor_misses():
    """Without tags every run is missed, with a tag everywhere none; the bound is Clopper and Pearson's."""
    question = hall()
    demand = question.demands[0]
    runs = random_runs_of(demand, question.scenario, 80, 1, routes=1)
    bare = missed_share(demand, runs, question.antennas, np.empty((0, 2)))
    full = missed_share(demand, runs, question.antennas, question.slots.xy_m)
    assert (bare.count, bare.runs, bare.share, bare.upper) == (80, 80, 1.0, 1.0)
    assert full.count == 0
    assert full.upper == pytest.approx(1.0 - 0.05 ** (1.0 / 80.0))
    assert math.isnan(Missed(demand=demand, count=0, runs=0).share)
