"""Dead reckoning with a gyro, against drives whose answer is known."""

import dataclasses
import math

import numpy as np
import pytest
from shapely.geometry import box

from layoutopt.errors import InvalidInput
from layoutopt.estimators.odometry import OdometryAlone
from layoutopt.estimators.odometry_gyro import OdometryWithGyro
from layoutopt.geometry import wrapped
from layoutopt.readings import Motion, Observations, Prior
from layoutopt.robot import Gyro, Odometry, Robot
from layoutopt.scenario import Role, Routes, Scenario
from layoutopt.simulation.motion import drive
from layoutopt.site import Site
from layoutopt.streams import Streams

START = Prior(pose=(1.0, 2.0, 0.5), sigma_m=0.0, sigma_rad=0.0)
DRAWS = np.random.default_rng(0)


def observed(increments, **gyro):
    steps = len(increments)
    return Observations(
        step_s=0.05,
        increments=np.array(increments),
        sigma=np.zeros((steps, 3)),
        read_start=np.zeros(steps + 1, dtype=np.int64),
        read_antenna=np.empty(0, dtype=np.int64),
        read_tag=np.empty(0, dtype=np.int64),
        active=np.ones((steps, 0), dtype=bool),
        **gyro,
    )


def test_the_way_is_that_of_the_wheels_and_the_turn_that_of_the_gyro():
    """1 m ahead, a quarter turn by the gyro, 1 m ahead: north-east, whatever turn the wheels say."""
    seen = observed(
        [(1.0, 0.0, 9.0), (1.0, 0.0, -9.0)], gyro_turn_rad=np.array([np.pi / 2, 0.0]), gyro_sigma_rad=np.ones(2)
    )
    start = dataclasses.replace(START, pose=(0.0, 0.0, 0.0))
    poses = OdometryWithGyro().run(start, None, seen, DRAWS).poses
    np.testing.assert_allclose(poses, [[1.0, 0.0, np.pi / 2], [1.0, 1.0, np.pi / 2]], atol=1e-12)


def test_step_by_step_is_the_whole_drive():
    """The plain form gives the same poses, headings wrapped."""
    draws = np.random.default_rng(3)
    seen = observed(
        draws.normal(size=(200, 3)), gyro_turn_rad=draws.normal(size=200), gyro_sigma_rad=np.full(200, 0.1)
    )
    whole = OdometryWithGyro().run(START, None, seen, DRAWS).poses
    running = OdometryWithGyro().start(START, None, DRAWS)
    steps = np.array([running.step(*step).values for step in seen.steps()])
    np.testing.assert_allclose(steps, whole, atol=1e-9)
    assert np.abs(whole[:, 2]).max() <= np.pi


def test_a_drive_without_a_gyro_is_refused():
    """Observations without a gyro have an infinite deviation; both forms say so instead of going straight on."""
    seen = observed([(1.0, 0.0, 0.1)])
    assert seen.gyro_turn_rad.tolist() == [0.0]
    assert seen.gyro_sigma_rad.tolist() == [math.inf]
    with pytest.raises(InvalidInput, match=r"'odometry_gyro': the drive has no gyro.*Use 'odometry'"):
        OdometryWithGyro().run(START, None, seen, DRAWS)
    running = OdometryWithGyro().start(START, None, DRAWS)
    with pytest.raises(InvalidInput, match="has no gyro"):
        running.step(Motion(forward_m=1.0, left_m=0.0, turn_rad=0.0, sigma=(0.0, 0.0, 0.0)), ())


@pytest.mark.parametrize("columns", [{"gyro_turn_rad": 2}, {"gyro_turn_rad": 1, "gyro_sigma_rad": 2}])
def test_half_a_gyro_is_refused(columns):
    """Turn and deviation go together, with a row for each step."""
    with pytest.raises(ValueError, match="a turn and a deviation for each of 2 steps"):
        observed([(1.0, 0.0, 0.0)] * 2, **{name: np.zeros(size) for name, size in columns.items()})


@pytest.mark.parametrize("estimator", [OdometryAlone(), OdometryWithGyro()], ids=lambda one: one.name)
def test_from_an_unknown_start_it_simply_starts_at_the_mean(estimator):
    """Infinite deviations of the start change nothing for dead reckoning, and nothing becomes NaN."""
    gyro = {"gyro_turn_rad": np.full(50, 0.01), "gyro_sigma_rad": np.ones(50)}
    seen = observed([(0.01, 0.0, 0.01)] * 50, **gyro)
    unknown = dataclasses.replace(START, sigma_m=math.inf, sigma_rad=math.inf)
    known, blind = (estimator.run(prior, None, seen, DRAWS).poses for prior in (START, unknown))
    np.testing.assert_array_equal(known, blind)
    assert np.isfinite(blind).all()


def test_the_better_of_two_headings_wins():
    """With a gyro that does not err the place is exact where wheels alone are off, and the other way round."""
    room = Site(name="hall", floor=box(0, 0, 8, 5))
    outline_m = [(-0.2, -0.2), (0.2, -0.2), (0.2, 0.2), (-0.2, 0.2)]
    good_gyro = Gyro(random_walk_rad_per_sqrt_s=0.0, bias_sigma_rad_s=0.0)
    good_wheels = Odometry(translation_share=0.0, lateral_share=0.0, rotation_rad_per_m=0.0)
    bad_turns = dataclasses.replace(good_wheels, rotation_rad_per_m=0.1)
    for odometry, gyro, best in ((bad_turns, good_gyro, 1), (good_wheels, Gyro(), 0)):
        world = Scenario(
            name="two",
            role=Role.DESIGN,
            site=room,
            robot=Robot(outline_m=outline_m, odometry=odometry, gyro=gyro),
            routes=Routes(kind="patrol"),
        )
        driven = drive(world, Streams(seed=1), 0)
        seen = observed(
            driven.increments, gyro_turn_rad=driven.gyro_turn_rad, gyro_sigma_rad=driven.gyro_sigma_rad
        )
        start = dataclasses.replace(START, pose=tuple(driven.poses[0].tolist()))
        off = [
            estimator.run(start, None, seen, DRAWS).poses - driven.poses[1:]
            for estimator in (OdometryAlone(), OdometryWithGyro())
        ]
        error_m = [float(np.hypot(one[:, 0], one[:, 1]).max()) for one in off]
        assert error_m[best] < 1e-9
        assert error_m[1 - best] > 0.01
        assert np.abs(wrapped(off[best][:, 2])).max() < 1e-9
