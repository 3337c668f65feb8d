"""Drives: poses, increments and odometry noise."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.stats import chi2, kstest
from shapely.geometry import box

from layoutopt.geometry import wrapped
from layoutopt.robot import Drive as DriveKind
from layoutopt.robot import Odometry, Robot
from layoutopt.scenario import Role, Routes, Scenario
from layoutopt.simulation.motion import compose, drive, increments_between, integrate
from layoutopt.site import Site
from layoutopt.streams import Streams

STREAMS = Streams(seed=4)
KINDS = ("patrol", "point_to_point", "circle", "way_points")


def scenario(kind="point_to_point", *, points=(), name="test", step_s=0.05, step_count=1200, **robot):
    outline_m = [(-0.2, -0.2), (0.2, -0.2), (0.2, 0.2), (-0.2, 0.2)]
    return Scenario(
        name=name,
        role=Role.DESIGN,
        site=Site(name="hall", floor=box(0, 0, 8, 5)),
        robot=Robot(outline_m=outline_m, **robot),
        routes=Routes(kind=kind, way_points_m=points, circle_radius_m=1.0),
        step_s=step_s,
        step_count=step_count,
    )


def triangle(kind):
    return [(1.0, 1.0), (7.0, 1.0), (4.0, 4.0)] if kind == "way_points" else ()


def test_translation_is_taken_before_the_turn():
    """A robot that looks up goes up, its left is to the west, and only then it turns."""
    np.testing.assert_allclose(compose([1.0, 2.0, np.pi / 2], [0.5, 0.25, 0.3]), [0.75, 2.5, np.pi / 2 + 0.3])


def test_compose_broadcasts_over_poses():
    """One increment moves many poses, as particles need."""
    poses = np.zeros((7, 3))
    poses[:, 2] = np.arange(7)
    moved = compose(poses, np.array([1.0, 0.0, 0.0]))
    np.testing.assert_allclose(np.hypot(moved[:, 0], moved[:, 1]), 1.0)


def test_integrating_is_composing_step_by_step():
    """The vectorised sum equals the loop, for random increments."""
    draws = np.random.default_rng(2)
    increments = draws.normal(size=(300, 3))
    pose = np.array([3.0, -2.0, 1.0])
    poses = integrate(pose, increments)
    for step in range(300):
        np.testing.assert_allclose(poses[step], pose, atol=1e-12)
        pose = compose(pose, increments[step])
    np.testing.assert_allclose(increments_between(poses), increments, atol=1e-12)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("drive_kind", list(DriveKind))
def test_true_increments_give_back_the_true_poses(kind, drive_kind):
    """Composing them from the first pose is exact to 1e-12."""
    driven = drive(scenario(kind, points=triangle(kind), drive=drive_kind), STREAMS, 0)
    assert driven.poses.shape == (1201, 3)
    assert driven.increments.shape == driven.sigma.shape == (1200, 3)
    np.testing.assert_allclose(
        integrate(driven.poses[0], increments_between(driven.poses)), driven.poses, rtol=0.0, atol=1e-12
    )


def test_differential_drive_by_hand():
    """2 m at 0.5 m/s, half a turn at 45 degrees a second, and back: every pose is known."""
    world = scenario("way_points", points=[(2.0, 2.0), (4.0, 2.0)], speed_m_s=0.5, step_s=0.3, step_count=39)
    driven = drive(world, STREAMS, 0)
    times_s = 0.3 * np.arange(40)
    turn_s = np.pi / np.deg2rad(45.0)
    ahead_m = np.interp(times_s, [0.0, 4.0, 4.0 + turn_s, 8.0 + turn_s], [0.0, 2.0, 2.0, 0.0])
    turned_rad = np.interp(times_s, [4.0, 4.0 + turn_s], [0.0, np.pi])
    first = driven.poses[0]
    sign = 1.0 if first[0] == 2.0 else -1.0
    np.testing.assert_allclose(driven.poses[:, 0], first[0] + sign * ahead_m, atol=1e-12)
    np.testing.assert_allclose(driven.poses[:, 1], 2.0, atol=1e-12)
    np.testing.assert_allclose(np.abs(driven.poses[:, 2] - first[2]), turned_rad, atol=1e-12)


@pytest.mark.parametrize("kind", ["patrol", "point_to_point", "way_points"])
def test_differential_drive_uses_all_its_time(kind):
    """In each step, way by speed and turn by turn rate add up to the step, and nothing goes sideways.

    A step that goes round a whole small corner is shorter as a chord than on the ground, by a share of less
    than 1e-3.
    """
    driven = drive(scenario(kind, points=triangle(kind)), STREAMS, 1)
    true = increments_between(driven.poses)
    used_s = np.hypot(true[:, 0], true[:, 1]) / 0.3 + np.abs(true[:, 2]) / np.deg2rad(45.0)
    np.testing.assert_allclose(used_s, 0.05, rtol=1e-3)
    assert (np.abs(used_s - 0.05) < 1e-12).mean() > 0.9
    assert np.abs(true[:, 1]).max() < 0.3 * 0.05 * 0.05
    assert true[:, 0].min() > -1e-12


def test_omnidirectional_drive_never_stops():
    """It goes at its speed along every leg, turns no faster than it can, and ends up looking ahead."""
    world = scenario("way_points", points=triangle("way_points"), drive=DriveKind.OMNIDIRECTIONAL)
    driven = drive(world, STREAMS, 0)
    true = increments_between(driven.poses)
    step_m = np.hypot(true[:, 0], true[:, 1])
    assert step_m.max() <= 0.3 * 0.05 * (1 + 1e-9)
    assert (step_m > 0.3 * 0.05 * (1 - 1e-9)).sum() >= 1197
    assert np.abs(true[:, 2]).max() <= np.deg2rad(45.0) * 0.05 * (1 + 1e-9)
    # A quarter of a leg takes longer than any turn, so the robot mostly looks along its way.
    assert (np.abs(true[:, 1]) < 1e-9).mean() > 0.5
    assert np.abs(true[:, 1]).max() > 1e-3


def test_omnidirectional_drive_turns_the_shorter_way():
    """The heading never leaves the direction of travel by more than half a turn."""
    driven = drive(scenario(drive=DriveKind.OMNIDIRECTIONAL), STREAMS, 3)
    travel = np.arctan2(*np.diff(driven.poses[:, :2], axis=0).T[::-1])
    off_rad = wrapped(travel - driven.poses[:-1, 2])
    turn_rad = np.diff(driven.poses[:, 2])
    # Steps within a leg, clear of corners: the turn has the sign of what is missing.
    clear = np.append(False, np.abs(wrapped(np.diff(travel))) < 1e-9) & (np.abs(off_rad) > 0.05)
    assert clear.sum() > 20
    assert (np.sign(turn_rad[clear]) == np.sign(off_rad[clear])).all()


@pytest.mark.parametrize("drive_kind", list(DriveKind))
def test_heading_on_a_circle_is_the_tangent(drive_kind):
    """The robot keeps its radius to 0.01 mm and looks along the tangent to 1e-5 rad, in both directions."""
    turns = set()
    for replication in range(8):
        driven = drive(scenario("circle", drive=drive_kind), STREAMS, replication)
        outwards = driven.poses[:, :2] - (4.0, 2.5)
        np.testing.assert_allclose(np.linalg.norm(outwards, axis=1), 1.0, atol=1e-5)
        off_rad = wrapped(driven.poses[:, 2] - np.arctan2(outwards[:, 1], outwards[:, 0]))
        sign = np.sign(off_rad[0])
        np.testing.assert_allclose(off_rad, sign * np.pi / 2, atol=1e-5)
        way_m = np.linalg.norm(np.diff(driven.poses[:, :2], axis=0), axis=1).sum()
        assert way_m == pytest.approx(18.0, rel=1e-4)
        assert abs(driven.poses[-1, 2] - driven.poses[0, 2]) == pytest.approx(18.0, rel=1e-3)
        turns.add(sign)
    assert turns == {-1.0, 1.0}


@pytest.mark.parametrize("step_s", [0.02, 0.05, 0.25])
def test_variance_of_the_noise_grows_with_the_way_whatever_the_step(step_s):
    """After 4 m straight on the deviations are twice those of 1 m; a turn counts with the way of a wheel."""
    count = round(4.0 / 0.3 / step_s)
    world = scenario("way_points", points=[(1.0, 1.0), (7.0, 1.0)], step_s=step_s, step_count=count)
    driven = drive(world, STREAMS, 0)
    way_m = 0.3 * step_s * count
    total = np.sqrt((driven.sigma**2).sum(axis=0))
    np.testing.assert_allclose(total, np.sqrt(way_m) * np.array([0.02, 0.005, np.deg2rad(1.0)]), rtol=1e-9)


def test_turn_on_the_spot_counts_with_the_way_of_a_wheel():
    """Half a turn with a half track of 0.2 m is 0.63 m of wheel way."""
    sigma = Odometry().sigma(np.array([[0.0, 0.0, np.pi]]), step_s=0.05)
    assert sigma[0, 2] == pytest.approx(np.deg2rad(1.0) * np.sqrt(0.2 * np.pi))


def test_noise_is_standard_normal_over_sigma():
    """Over 40 drives: mean square by chi-squared, shape by Kolmogorov-Smirnov, false alarms 1e-6 each."""
    world = scenario()
    drives = [drive(world, STREAMS, replication) for replication in range(40)]
    scaled = np.concatenate([((d.increments - increments_between(d.poses)) / d.sigma).ravel() for d in drives])
    total = (scaled**2).sum()
    assert chi2.isf(1 - 5e-7, len(scaled)) < total < chi2.isf(5e-7, len(scaled))
    assert kstest(scaled, "norm").pvalue > 1e-6


def test_perfect_odometry_is_the_truth():
    """Without noise the increments are the true ones."""
    silent = Odometry(translation_share=0.0, rotation_rad_per_m=0.0, lateral_share=0.0)
    driven = drive(scenario(odometry=silent), STREAMS, 0)
    np.testing.assert_array_equal(driven.increments, increments_between(driven.poses))


def test_drive_depends_on_its_streams_alone():
    """The same streams give the same bits from a cold cache; seed, replication and name change them."""
    first = drive(scenario(), STREAMS, 5)
    drive.cache_clear()
    again = drive(scenario(), STREAMS, 5)
    assert first is not again
    assert (first.poses.tobytes(), first.increments.tobytes()) == (
        again.poses.tobytes(),
        again.increments.tobytes(),
    )
    others = [
        drive(scenario(), STREAMS, 6),
        drive(scenario(), Streams(seed=5), 5),
        drive(scenario(name="other"), STREAMS, 5),
    ]
    assert all(other.poses.tobytes() != first.poses.tobytes() for other in others)


def test_route_does_not_depend_on_the_odometry():
    """A worse odometry changes the increments and not the way: the two have streams of their own."""
    better = drive(scenario(), STREAMS, 0)
    worse = drive(scenario(odometry=Odometry(translation_share=0.2)), STREAMS, 0)
    assert better.poses.tobytes() == worse.poses.tobytes()
    assert better.increments.tobytes() != worse.increments.tobytes()


def test_drive_cannot_be_changed():
    """Drives are shared through a cache, so their arrays are read-only."""
    driven = drive(scenario(), STREAMS, 0)
    for array in (driven.poses, driven.increments, driven.sigma):
        with pytest.raises(ValueError, match="read-only"):
            array[0, 0] = 1.0


def test_a_kidnapped_robot_goes_on_elsewhere_without_its_odometry_knowing():
    """Up to the instant the drive is that of a free robot; then it jumps, and the odometry shows no jump."""
    free = scenario("patrol")
    taken = replace(free, faults=replace(free.faults, kidnapped_at_s=20.0))
    before, after = drive(free, STREAMS, 2), drive(taken, STREAMS, 2)
    np.testing.assert_array_equal(before.poses[:401], after.poses[:401])
    jump_m = np.linalg.norm(np.diff(after.poses[:, :2], axis=0), axis=1)
    assert jump_m.argmax() == 400
    assert jump_m[400] > 0.5
    assert np.abs(after.increments[:, :2]).max() < 0.1
