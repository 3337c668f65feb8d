"""Routes with pauses, with a heading that is kept, and in another place in every trial."""

import dataclasses

import numpy as np
import pytest
from shapely.geometry import LineString, Point, box

from layoutopt.errors import InvalidInput
from layoutopt.robot import Drive as DriveKind
from layoutopt.robot import Odometry, Robot
from layoutopt.scenario import Role, Routes, Scenario
from layoutopt.simulation.motion import drive, increments_between
from layoutopt.simulation.outcomes import standing_steps
from layoutopt.simulation.routes import CLEARANCE_M, route
from layoutopt.site import Site
from layoutopt.streams import Streams

STREAMS = Streams(seed=4)
CORNERS_M = [(2.0, 1.0), (6.0, 1.0), (4.0, 4.0)]


def scenario(kind="way_points", drive_kind=DriveKind.OMNIDIRECTIONAL, *, obstacles=(), step_count=1200, **routes):
    if kind == "way_points":
        routes = {"way_points_m": CORNERS_M, **routes}
    return Scenario(
        name="test",
        role=Role.DESIGN,
        site=Site(name="hall", floor=box(0, 0, 8, 5), obstacles=obstacles),
        robot=Robot(outline_m=[(-0.2, -0.2), (0.2, -0.2), (0.2, 0.2), (-0.2, 0.2)], drive=drive_kind),
        routes=Routes(kind=kind, **routes),
        step_count=step_count,
    )


@pytest.mark.parametrize("drive_kind", list(DriveKind))
def test_the_robot_stands_at_every_way_point(drive_kind):
    """Each way point, the first included, is held for the pause to within a step; nothing else is."""
    driven = drive(scenario(drive_kind=drive_kind, pause_s=5.0, step_count=3000), STREAMS, 0)
    still = standing_steps(driven.poses)
    edges = np.flatnonzero(np.diff(np.concatenate([[0], still.astype(int), [0]])))
    starts, ends = edges[0::2], edges[1::2]
    assert len(starts) >= 5
    for start, end in zip(starts[:-1], ends[:-1], strict=True):
        assert np.linalg.norm(CORNERS_M - driven.poses[start, :2], axis=1).min() < 1e-9
        assert end - start in (99, 100)
    assert starts[0] == 0


def test_differential_drive_with_pauses_by_hand():
    """Pause of 2 s, 2 m at 0.5 m/s, pause, half a turn at 45 degrees a second, and back: every pose is known."""
    world = scenario(drive_kind=DriveKind.DIFFERENTIAL, way_points_m=[(2.0, 2.0), (4.0, 2.0)], pause_s=2.0)
    world = dataclasses.replace(
        world, robot=dataclasses.replace(world.robot, speed_m_s=0.5), step_s=0.3, step_count=52
    )
    driven = drive(world, STREAMS, 0)
    times_s = 0.3 * np.arange(53)
    ahead_m = np.interp(times_s, [2.0, 6.0, 12.0, 16.0], [0.0, 2.0, 2.0, 0.0])
    turned_rad = np.interp(times_s, [8.0, 12.0], [0.0, np.pi])
    sign = 1.0 if driven.poses[0, 0] == 2.0 else -1.0
    np.testing.assert_allclose(driven.poses[:, 0], driven.poses[0, 0] + sign * ahead_m, atol=1e-12)
    np.testing.assert_allclose(np.abs(driven.poses[:, 2] - driven.poses[0, 2]), turned_rad, atol=1e-12)


@pytest.mark.parametrize("drive_kind", list(DriveKind))
def test_pauses_only_take_time(drive_kind):
    """The drive with pauses stays within a step of the line of the drive without."""
    plain = drive(scenario(drive_kind=drive_kind), STREAMS, 1)
    paused = drive(scenario(drive_kind=drive_kind, pause_s=2.0), STREAMS, 1)
    line = LineString(plain.poses[:, :2]).buffer(0.3 * 0.05)
    assert all(line.covers(Point(pose)) for pose in paused.poses[:, :2])
    np.testing.assert_array_equal(plain.poses[0], paused.poses[0])


def test_stops_are_the_way_points_and_not_the_corners_between():
    """A way round a pillar has corners at which the robot does not stop."""
    world = scenario(obstacles=(box(3.5, 0.0, 4.5, 2.0),))
    way = route(world, np.random.default_rng(0))
    assert len(way.stops) == len(way.line_m)
    stops = way.line_m[way.stops]
    assert all(np.linalg.norm(CORNERS_M - stop, axis=1).min() < 1e-9 for stop in stops)
    between = way.line_m[~way.stops]
    assert len(between) > 0
    assert all(np.linalg.norm(CORNERS_M - corner, axis=1).min() > 1e-3 for corner in between)
    assert not route(scenario("patrol"), np.random.default_rng(0)).stops.any()


def test_noise_of_time_goes_on_in_a_pause():
    """A robot at rest with a random walk in time errs; one with noise of the way alone does not."""
    world = scenario(pause_s=60.0)
    for odometry, errs in (
        (Odometry(translation_m_per_sqrt_s=0.01, rotation_rad_per_sqrt_s=0.01), True),
        (Odometry(), False),
    ):
        driven = drive(
            dataclasses.replace(world, robot=dataclasses.replace(world.robot, odometry=odometry)), STREAMS, 0
        )
        assert standing_steps(driven.poses).all()
        assert (driven.sigma > 0.0).all() == errs
        assert (driven.increments != 0.0).all() == errs


@pytest.mark.parametrize("kind", ["circle", "way_points", "patrol", "point_to_point"])
def test_a_kept_heading_is_constant(kind):
    """On every kind of route the heading stays, and the way is that of the robot that looks ahead."""
    kept = drive(scenario(kind, heading_rad=0.7), STREAMS, 2)
    free = drive(scenario(kind), STREAMS, 2)
    assert set(kept.poses[:, 2].tolist()) == {0.7}
    np.testing.assert_array_equal(kept.poses[:, :2], free.poses[:, :2])
    true = increments_between(kept.poses)
    step_m = np.hypot(true[:, 0], true[:, 1])
    assert np.abs(true[:, 1]).max() > 0.5 * step_m.max()


@pytest.mark.parametrize("kind", ["circle", "way_points"])
def test_a_spread_shifts_the_whole_route(kind):
    """The route of a trial is that without spread, shifted by a draw of its own within the spread."""
    shifts = []
    for replication in range(60):
        fixed = drive(scenario(kind), STREAMS, replication).poses[0, :2]
        moved = drive(scenario(kind, centre_spread_m=0.2), STREAMS, replication).poses[0, :2]
        shifts.append(moved - fixed)
    shifts = np.array(shifts)
    assert np.abs(shifts).max() <= 0.2
    # 60 uniform draws all within 80 % of the spread: 0.8^60 = 1.5e-6, for each of four sides far less likely.
    assert (shifts.max(axis=0) > 0.1).all()
    assert (shifts.min(axis=0) < -0.1).all()
    assert abs(np.corrcoef(shifts.T)[0, 1]) < 0.65


def test_a_spread_keeps_the_shape():
    """On a clear floor all corners move by the same vector."""
    fixed = route(scenario(), np.random.default_rng(5)).line_m
    moved = route(scenario(centre_spread_m=0.3), np.random.default_rng(5)).line_m
    np.testing.assert_allclose(moved - fixed, np.broadcast_to(moved[0] - fixed[0], fixed.shape), atol=1e-12)


@pytest.mark.parametrize(
    ("radius_m", "fits"), [(2.0, True), (2.093, True), (2.1, False), (2.2, False), (0.0, False)]
)
def test_a_circle_has_to_fit_wherever_it_is_shifted(radius_m, fits):
    """In a hall 5 m wide a robot of 0.283 m with 20 mm to spare and a spread of 0.1 m gets 2.097 m."""
    world = scenario("circle", circle_radius_m=radius_m, centre_spread_m=0.1)
    assert 2.5 - world.robot.radius_m - CLEARANCE_M - 0.1 == pytest.approx(2.097, abs=1e-3)
    if fits:
        room = world.site.robot_region(world.robot.radius_m)
        for seed in range(20):
            assert room.covers(LineString(route(world, np.random.default_rng(seed)).line_m))
    else:
        with pytest.raises(InvalidInput, match=r"circle_radius: .*shifted by up to 100 mm.*Give less than"):
            route(world, np.random.default_rng(0))


def test_a_shifted_circle_must_clear_a_pillar_at_its_edge():
    """A pillar that the circle alone passes is hit by some shift."""
    pillar = (Point(4.0 + 1.0 + 0.55, 2.5).buffer(0.1),)
    route(scenario("circle", circle_radius_m=1.0, obstacles=pillar), np.random.default_rng(0))
    with pytest.raises(InvalidInput, match="circle_radius"):
        route(
            scenario("circle", circle_radius_m=1.0, centre_spread_m=0.2, obstacles=pillar),
            np.random.default_rng(0),
        )


def test_way_points_have_to_be_reached_wherever_they_are_shifted():
    """A way point near the wall is named before any trial runs into it."""
    points = [(0.5, 2.0), (4.0, 2.0), (4.0, 3.0)]
    route(scenario(way_points_m=points), np.random.default_rng(0))
    with pytest.raises(InvalidInput, match=r"way_points\[0\]: shifted by up to 300 mm") as caught:
        route(scenario(way_points_m=points, centre_spread_m=0.3), np.random.default_rng(0))
    assert len(caught.value.faults) == 1


def test_the_room_of_a_circle_is_checked_once(monkeypatch):
    """Drives of one scenario after the first ask no question of geometry."""
    world = scenario("circle", circle_radius_m=1.234)
    route(world, np.random.default_rng(0))
    monkeypatch.setattr(Site, "robot_region", lambda *_: pytest.fail("the room was asked for again"))
    route(world, np.random.default_rng(1))
