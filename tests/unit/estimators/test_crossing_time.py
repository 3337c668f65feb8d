"""Crossing-time localisation on drives: legs, crossings, starts, and what the improved form gains."""

import math
from dataclasses import replace

import numpy as np
import pytest
from filter_worlds import by_steps
from reader_worlds import AHEAD, driven, grid_m, one_antenna
from shapely.geometry import box

from layoutopt.antennas.disc import DiscAntenna
from layoutopt.estimators.crossing_time import MIRRORED, SEARCHING, CrossingTime, RunningCrossingTime
from layoutopt.estimators.crossing_time_branches import CrossingTimeBranches
from layoutopt.estimators.odometry import OdometryAlone
from layoutopt.estimators.straight_legs import LegWatch
from layoutopt.layout import FloorTags, Layout, ReaderGroup, ZonePattern
from layoutopt.patterns.tilted import tilted
from layoutopt.readers.profiles import MI2016
from layoutopt.readings import Prior
from layoutopt.robot import Drive, Odometry, Robot
from layoutopt.scenario import Role, Routes, Scenario
from layoutopt.simulation.trials import knowledge_of, record_trial, run_trials
from layoutopt.site import Site
from layoutopt.streams import Streams

STREAMS = Streams(seed=5)
PATTERN = tilted(tile_m=0.7, angle_rad=0.22)
EXACT = Odometry(translation_share=1e-6, rotation_rad_per_m=1e-6, lateral_share=1e-6)
UNKNOWN = Prior(pose=(3.0, 3.0, 0.0), sigma_m=math.inf, sigma_rad=math.inf)


def layout(places=((0.0, 0.0),)):
    """Return a layout with antennas of a disc of 0.1 m over tilted tiles."""
    poses = [(x, y, 0.015, 0.0) for x, y in places]
    group = ReaderGroup(
        name="one",
        poses=poses,
        antenna=DiscAntenna(side_m=0.15, radius_m=0.1),
        profile=MI2016,
        slots=(0,) * len(poses),
    )
    return Layout(floor_tags=FloorTags(zones=(ZonePattern(zone="", pattern=PATTERN),)), readers=(group,))


def scenario(odometry=None, routes=None, **changes):
    """Return errands, or other routes, through an empty hall at 0.2 m/s and 20 ms a step."""
    robot = Robot(outline_m=[(-0.2, -0.2), (0.2, -0.2), (0.2, 0.2), (-0.2, 0.2)], speed_m_s=0.2)
    if odometry is not None:
        robot = replace(robot, odometry=odometry)
    return Scenario(
        name="hall",
        role=Role.HELD_OUT,
        site=Site(name="hall", floor=box(0.0, 0.0, 6.0, 6.0)),
        robot=robot,
        routes=routes or Routes(kind="point_to_point"),
        step_s=0.05,
        step_count=800,
        start_sigma_m=0.01,
        start_sigma_rad=0.01,
        **changes,
    )


def test_legs_end_at_corners_and_crossings_are_true():
    """Each crossing's edges lie a disc's radius from the tag on the true way, within a step and a half."""
    world = scenario(odometry=EXACT)
    record = record_trial(layout(), world, CrossingTime(), STREAMS, 0)
    watch = LegWatch(knowledge_of(layout(), world, CrossingTime()), by_way=True)
    legs, begun = {id(watch.leg): watch.leg}, {id(watch.leg): 0}
    for step, (motion, reads) in enumerate(record.observations.steps()):
        if watch.step(motion, reads):
            begun[id(watch.leg)] = step + 1
            legs[id(watch.leg)] = watch.leg
    found = 0
    for key, leg in legs.items():
        start = record.drive.poses[begun[key]]
        for crossing in leg.crossings:
            for clock in (crossing.entered, crossing.left):
                place_m = start[:2] + clock * np.array([math.cos(start[2]), math.sin(start[2])])
                assert math.dist(place_m, crossing.tag_m) == pytest.approx(0.1, abs=0.015)
                found += 1
    assert found > 10
    # A corner takes several steps, each of which is a leg of its own until the robot goes straight again.
    assert 1 < sum(leg.clock > 0.3 for leg in legs.values()) < 10


def test_the_improved_form_beats_the_papers_and_both_beat_the_wheels():
    """On 12 common drives with wheels that drift: its worst drive is far better, and its mean."""
    world = scenario(odometry=Odometry(translation_share=0.05, rotation_rad_per_m=math.radians(2.0)))
    wheels, paper, branches, by_time = (
        run_trials(layout(), world, estimator, STREAMS, 0, 12).values[:, 0]
        for estimator in (
            OdometryAlone(),
            CrossingTime(),
            CrossingTimeBranches(),
            CrossingTimeBranches(clock="time"),
        )
    )
    assert paper.mean() < 0.8 * wheels.mean()
    assert branches.mean() < 0.4 * wheels.mean()
    assert branches.max() < 0.4 * paper.max()
    assert by_time.mean() < 0.7 * branches.mean()


@pytest.mark.parametrize("estimator", [CrossingTime(), CrossingTimeBranches()])
def test_an_antenna_off_the_middle_is_allowed(estimator):
    """The lever arm enters both forms: errors stay below a third of it."""
    off = layout(places=((0.15, 0.05),))
    error = run_trials(off, scenario(), estimator, STREAMS, 0, 8).score("position_error_mean").value
    assert error < 0.05


@pytest.mark.parametrize("estimator", [CrossingTime(), CrossingTimeBranches()])
def test_from_an_unknown_start_two_discs_give_the_way_and_a_third_its_side(estimator):
    """The health says what is not known yet; in the end half of the drives are within 4 cm, and all within 15."""
    world = scenario(start_known=False)
    off_m, seen = [], set()
    for replication in range(8):
        record = record_trial(layout(), world, estimator, STREAMS, replication)
        answers = by_steps(estimator, UNKNOWN, knowledge_of(layout(), world, estimator), record.observations, 0)
        seen |= {answer.health for answer in answers}
        off_m.append(math.dist(answers[-1].values[:2], record.drive.poses[-1, :2]))
    assert seen == {SEARCHING, MIRRORED, ""}
    assert np.median(off_m) < 0.04
    assert max(off_m) < 0.15


ROW_M = np.stack([np.arange(12) * 0.35, np.zeros(12)], axis=1)
"""Tags in a row, which leave it open on which side of the row the robot drives."""


@pytest.mark.parametrize("estimator", [CrossingTime(), CrossingTimeBranches()])
@pytest.mark.parametrize("side", [1.0, -1.0])
def test_tags_in_a_row_do_not_tell_mirror_images_apart(estimator, side):
    """However many; one beside the row does, on either side."""
    start, steps = (0.1, side * 0.05, 0.0), [AHEAD] * 300
    _, told = driven(one_antenna(ROW_M), start, steps)
    row = by_steps(estimator, UNKNOWN, one_antenna(ROW_M), told, 0)
    assert {answer.health for answer in row} == {SEARCHING, MIRRORED}
    assert abs(row[-1].values[1]) == pytest.approx(0.05, abs=0.01)
    beside = one_antenna([*ROW_M, (2.6, 0.04)])
    poses, told = driven(beside, start, steps)
    found = by_steps(estimator, UNKNOWN, beside, told, 0)
    assert found[-1].health == ""
    assert found[-1].values == pytest.approx(poses[-1], abs=0.02)


@pytest.mark.parametrize("estimator", [CrossingTime(), CrossingTimeBranches()])
@pytest.mark.parametrize("side", [1.0, -1.0])
def test_mirror_images_stay_open_on_later_legs(estimator, side):
    """Both go on by the wheels until a tag off the line is crossed; then the true one is taken."""
    known = one_antenna([*ROW_M[:3], (0.97, 0.8 * side), (0.95, 1.4 * side)])
    turn = (0.0, 0.0, side * math.pi / 40.0)
    poses, told = driven(known, (0.1, side * 0.05, 0.0), [AHEAD] * 85 + [turn] * 20 + [AHEAD] * 150)
    answers = by_steps(estimator, UNKNOWN, known, told, 0)
    health = [answer.health for answer in answers]
    crossed = int(np.flatnonzero(poses[:, 1] * side > 0.8)[0])
    assert health[85:crossed] == [MIRRORED] * (crossed - 85)
    assert health[-1] == ""
    assert answers[-1].values == pytest.approx(poses[-1], abs=0.03)


def test_of_a_place_that_may_be_another_no_direction_is_the_surer_one():
    """Which way it is sure of would be mirrored with it."""
    known = one_antenna(ROW_M)
    _, told = driven(known, (0.1, 0.05, 0.0), [AHEAD] * 85 + [(0.0, 0.0, 0.05)] * 2)
    running = CrossingTimeBranches().start(UNKNOWN, known, np.random.default_rng(0))
    assert [running.step(*step).health for step in told.steps()][-1] == MIRRORED
    np.testing.assert_array_equal(running._place_m2, running._place_m2[0, 0] * np.eye(2))


@pytest.mark.parametrize("estimator", [CrossingTime(), CrossingTimeBranches(), CrossingTimeBranches(clock="time")])
@pytest.mark.parametrize(("sigma_m", "sigma_rad"), [(0.0, 0.0), (0.0, 0.01), (0.01, 0.0), (0.0, math.inf)])
def test_a_start_may_be_known_exactly_or_in_part(estimator, sigma_m, sigma_rad):
    """Deviations of zero are allowed, and a heading alone may be unknown: then it is found by two discs."""
    known = one_antenna(grid_m(0.25, 1.75))
    start = (0.1, 0.05, 0.3)
    poses, told = driven(known, start, [AHEAD] * 90 + [(0.0, 0.0, 0.05)] * 20 + [AHEAD] * 90)
    told_rad = 0.3 if math.isfinite(sigma_rad) else 2.5
    prior = Prior(pose=(*start[:2], told_rad), sigma_m=sigma_m, sigma_rad=sigma_rad)
    answers = by_steps(estimator, prior, known, told, 0)
    assert answers[0].health == ("" if math.isfinite(sigma_rad) else SEARCHING)
    assert answers[-1].health == ""
    assert answers[-1].values == pytest.approx(poses[-1], abs=0.03)


def test_a_reversal_within_a_disc():
    """Whatever wheels say, and though the way adds up to nothing."""
    known = one_antenna([(0.2, 0.0)])
    for start_m in (0.09, 0.095):
        for count in range(8, 24):
            steps = [(1.0 / 128.0, 0.0, 0.0)] * count + [(-1.0 / 128.0, 0.0, 0.0)] * (count + 10)
            for sigma in (0.0, 1e-4, 0.01):
                poses, told = driven(known, (start_m, 0.02, 0.0), steps, sigma)
                prior = Prior(pose=(start_m, 0.02, 0.0), sigma_m=0.01, sigma_rad=0.01)
                for estimator in (CrossingTime(), CrossingTimeBranches(), CrossingTimeBranches(clock="time")):
                    found = np.array([item.values for item in by_steps(estimator, prior, known, told, 0)])
                    assert np.abs(found - poses).max() < 0.05


def test_impossible_crossings_are_left_out():
    """A robot that slows down in a disc stays in it for longer than any chord takes at the speed from before."""
    known = one_antenna([(0.5, 0.01)])
    steady, slowing = [AHEAD] * 75, [AHEAD] * 42 + [(0.007, 0.0, 0.0)] * 30 + [AHEAD] * 20
    start = (0.0, 0.0, 0.0)
    for steps, used in ((steady, True), (slowing, False)):
        _, told = driven(known, start, steps)
        running = RunningCrossingTime(Prior(pose=start, sigma_m=0.01, sigma_rad=0.01), known)
        for motion, reads in told.steps():
            running.step(motion, reads)
        assert (running.fit is not None) is used


@pytest.mark.parametrize("heading_rad", [0.0, None])
@pytest.mark.parametrize("estimator", [CrossingTime(), CrossingTimeBranches()])
def test_an_omnidirectional_robot_rounds_corners(estimator, heading_rad):
    """With its heading kept, or turned under way: places are far better than by the wheels, which end no leg."""
    points_m = np.array([(1.0, 1.0), (5.0, 1.0), (5.0, 5.0), (1.0, 5.0)])
    routes = Routes(kind="way_points", way_points_m=points_m, start="first", heading_rad=heading_rad)
    robot = replace(scenario().robot, drive=Drive.OMNIDIRECTIONAL)
    world = replace(scenario(), robot=robot, routes=routes)
    wheels, found = (
        run_trials(layout(), world, kind, STREAMS, 0, 6).score("position_error_mean").value
        for kind in (OdometryAlone(), estimator)
    )
    assert found < 0.5 * wheels


def test_curves_are_dead_reckoning():
    """On a circle no leg is straight, and no crossing is used."""
    world = scenario(routes=Routes(kind="circle", circle_radius_m=1.0), odometry=EXACT)
    record = record_trial(layout(), world, CrossingTime(), STREAMS, 1)
    off_m = np.hypot(*(record.trajectory.poses - record.drive.poses[1:])[:, :2].T)
    assert off_m.max() < 0.06


def test_one_antenna_only():
    """With the number that there are."""
    assert "the layout has 2" in CrossingTime().applies(layout(places=((0.1, 0.0), (-0.1, 0.0))))
    assert CrossingTimeBranches().applies(layout()) == ""


@pytest.mark.parametrize("name", ["scale_sigma", "edge_sigma_m"])
def test_wrong_settings_are_named(name):
    """With what would be right."""
    with pytest.raises(ValueError, match=f"{name} must be positive and finite"):
        CrossingTimeBranches(**{name: 0.0})
