"""Crossing-time localisation on drives: legs, crossings, starts, and what the improved form gains."""

import math
from dataclasses import replace

import numpy as np
import pytest
from shapely.geometry import box

from layoutopt.antennas.disc import DiscAntenna
from layoutopt.estimators.crossing_time import MIRRORED, SEARCHING, CrossingTime
from layoutopt.estimators.crossing_time_branches import CrossingTimeBranches
from layoutopt.estimators.odometry import OdometryAlone
from layoutopt.estimators.straight_legs import LegWatch
from layoutopt.layout import FloorTags, Layout, ReaderGroup, ZonePattern
from layoutopt.patterns.tilted import tilted
from layoutopt.readers.profiles import MI2016
from layoutopt.readings import Prior
from layoutopt.robot import Odometry, Robot
from layoutopt.scenario import Role, Routes, Scenario
from layoutopt.simulation.trials import knowledge_of, record_trial, run_trials
from layoutopt.site import Site
from layoutopt.streams import Streams

STREAMS = Streams(seed=5)
PATTERN = tilted(tile_m=0.7, angle_rad=0.22)
EXACT = Odometry(translation_share=1e-6, rotation_rad_per_m=1e-6, lateral_share=1e-6)


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


def test_an_antenna_off_the_middle_is_allowed():
    """The lever arm enters both forms."""
    world = scenario()
    off = layout(places=((0.15, 0.05),))
    error = run_trials(off, world, CrossingTimeBranches(), STREAMS, 0, 4).score("position_error_mean").value
    assert error < 0.05


@pytest.mark.parametrize("estimator", [CrossingTime(), CrossingTimeBranches()])
def test_from_an_unknown_start_two_discs_give_the_way_and_a_third_its_side(estimator):
    """The health says what is not known yet; most drives are found within centimetres in the end."""
    world = scenario(start_known=False)
    prior = Prior(pose=(3.0, 3.0, 0.0), sigma_m=math.inf, sigma_rad=math.inf)
    off_m, seen = [], set()
    for replication in range(8):
        record = record_trial(layout(), world, estimator, STREAMS, replication)
        work = estimator.start(prior, knowledge_of(layout(), world, estimator), np.random.default_rng(0))
        answers = [work.step(motion, reads) for motion, reads in record.observations.steps()]
        seen |= {answer.health for answer in answers}
        off_m.append(math.dist(answers[-1].values[:2], record.drive.poses[-1, :2]))
    assert seen == {SEARCHING, MIRRORED, ""}
    assert np.median(off_m) < 0.3


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
