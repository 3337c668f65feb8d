"""Routes: where they lead and how they are refused."""

from itertools import pairwise

import numpy as np
import pytest
from shapely.geometry import LineString, MultiPolygon, Point, Polygon, box

from layoutopt.errors import InvalidInput
from layoutopt.robot import Robot
from layoutopt.scenario import Role, Routes, Scenario
from layoutopt.simulation.routes import CLEARANCE_M, reachable_region, route, unreachable_area_m2
from layoutopt.site import Site, Zone

ROOM = box(0, 0, 8, 5)


def robot(radius_m=0.3, **fields):
    half = radius_m / np.sqrt(2.0)
    return Robot(outline_m=[(-half, -half), (half, -half), (half, half), (-half, half)], **fields)


def scenario(kind="patrol", *, floor=ROOM, zones=(), obstacles=(), radius_m=0.3, step_count=1200, **routes):
    return Scenario(
        name="test",
        role=Role.DESIGN,
        site=Site(name="hall", floor=floor, zones=zones, obstacles=obstacles),
        robot=robot(radius_m),
        routes=Routes(kind=kind, **routes),
        step_count=step_count,
    )


def rooms(door_m):
    """Return two rooms of 4 x 4 m and 3 x 4 m joined by a door of that width, 0.2 m deep."""
    return Polygon(
        [
            *[(0, 0), (4, 0), (4, 1), (4.2, 1), (4.2, 0), (7.2, 0), (7.2, 4), (4.2, 4)],
            *[(4.2, 1 + door_m), (4, 1 + door_m), (4, 4), (0, 4)],
        ]
    )


def drawn(scenario, seed=0):
    return route(scenario, np.random.default_rng(seed)).line_m


@pytest.mark.parametrize("kind", ["patrol", "point_to_point", "circle", "way_points"])
def test_route_lasts_the_whole_trial(kind):
    """The line is at least as long as the robot gets, also in a trial of ten minutes, and has no empty leg."""
    points = [(1.0, 1.0), (7.0, 1.0), (4.0, 4.0)] if kind == "way_points" else []
    for step_count in (1, 1200, 12_000):
        world = scenario(kind, step_count=step_count, way_points_m=points)
        line = drawn(world)
        legs_m = np.linalg.norm(np.diff(line, axis=0), axis=1)
        assert legs_m.sum() >= world.robot.speed_m_s * world.duration_s * (1 - 1e-12)
        assert legs_m.min() > 1e-9


@pytest.mark.parametrize("kind", ["patrol", "point_to_point", "circle", "way_points"])
def test_route_is_a_function_of_its_draws(kind):
    """The same stream gives the same bits, another stream another route."""
    world = scenario(kind, way_points_m=[(1, 1), (7, 1), (4, 4), (2, 3), (6, 3)] if kind == "way_points" else [])
    assert drawn(world, 1).tobytes() == drawn(world, 1).tobytes()
    assert len({drawn(world, seed).tobytes() for seed in range(12)}) > 1


def test_patrol_is_a_closed_tour():
    """A long patrol comes back to its start again and again."""
    line = drawn(scenario(step_count=24_000))
    assert (np.linalg.norm(line - line[0], axis=1) < 1e-9).sum() >= 5


def test_patrol_sees_its_zone_in_every_minute():
    """A zone of 0.5 m in a hall of 30 x 20 m is entered within 60 s, with a stop inside, in each of 40 trials."""
    dock = Zone(name="dock", region=box(25, 15, 25.5, 15.5), target_error_m=0.005)
    other = Zone(name="shelf", region=box(2, 2, 4, 4))
    world = scenario(floor=box(0, 0, 30, 20), zones=(dock, other))
    starts = set()
    for seed in range(40):
        line = drawn(world, seed)
        travelled_m = np.append(0.0, np.cumsum(np.linalg.norm(np.diff(line, axis=0), axis=1)))
        inside = [dock.region.covers(Point(corner)) for corner in line]
        assert sum(inside) >= 3
        # Half of the 18 m, so that turns do not keep the robot from arriving.
        assert travelled_m[inside.index(True)] < 9.0
        starts.add(line[0].tobytes())
    assert len(starts) == 40


def test_patrol_sees_all_zones_when_there_is_time():
    """Five zones are all entered in a trial of three minutes, first one first or another."""
    zones = tuple(
        Zone(name=f"z{x}{y}", region=box(x, y, x + 1, y + 1), target_error_m=0.01)
        for x, y in ((1, 1), (6, 1), (6, 3.5), (1, 3.5), (3, 2))
    )
    world = scenario(zones=zones, step_count=3600)
    firsts = set()
    for seed in range(20):
        line = drawn(world, seed)
        entered = [min(number for number, c in enumerate(line) if z.region.covers(Point(c))) for z in zones]
        firsts.add(int(np.argmin(entered)))
    assert len(firsts) >= 3


def test_zone_at_the_wall_is_entered_as_far_as_the_robot_gets():
    """A dock that the centre can only just enter is visited there."""
    edge_m = 0.3 + CLEARANCE_M
    dock = Zone(name="dock", region=box(0, 2, edge_m + 0.004, 3), target_error_m=0.005)
    line = drawn(scenario(zones=(dock,)))
    assert sum(dock.region.buffer(1e-9).covers(Point(corner)) for corner in line) >= 3


def test_zone_that_is_only_touched_is_visited_at_that_point():
    """A zone that meets the reachable region along a line gives a stop on that line."""
    dock = Zone(name="dock", region=box(0, 2, 0.3 + CLEARANCE_M, 3), target_error_m=0.005)
    line = drawn(scenario(zones=(dock,)))
    assert min(dock.region.distance(Point(corner)) for corner in line) < 1e-9


def test_zone_out_of_reach_is_refused():
    """A zone with a target behind what the robot can pass is named; without a target it does not matter."""
    closet = box(0, 0, 0.2, 0.2)
    with pytest.raises(InvalidInput, match=r"zone 'closet' of site 'hall'.*300 mm"):
        drawn(scenario(zones=(Zone(name="closet", region=closet, target_error_m=0.01),)))
    drawn(scenario(zones=(Zone(name="closet", region=closet),)))


@pytest.mark.parametrize("clockwise", [False, True])
def test_circle_is_about_the_middle(clockwise):
    """All corners lie on the circle about (4, 2.5), in both directions over the seeds."""
    for seed in range(20):
        line = drawn(scenario("circle", circle_radius_m=1.5), seed)
        np.testing.assert_allclose(np.linalg.norm(line - (4.0, 2.5), axis=1), 1.5, rtol=1e-12)
        first, second = line[0] - (4.0, 2.5), line[1] - (4.0, 2.5)
        if (first[0] * second[1] - first[1] * second[0] < 0.0) == clockwise:
            return
    pytest.fail("20 circles all turned the same way")


def test_circle_that_does_not_fit_is_refused_with_the_largest():
    """In a room 5 m wide a robot of 0.3 m gets 2.5 - 0.32 m."""
    with pytest.raises(InvalidInput, match=r"circle_radius: .*Give less than 2\.18 m"):
        drawn(scenario("circle", circle_radius_m=2.2))
    drawn(scenario("circle", circle_radius_m=2.17))
    with pytest.raises(InvalidInput, match="circle_radius"):
        drawn(scenario("circle", circle_radius_m=0.0))


def test_circle_may_go_round_a_pillar():
    """The middle itself need not be free."""
    drawn(scenario("circle", circle_radius_m=1.0, obstacles=(Point(4, 2.5).buffer(0.3),)))
    with pytest.raises(InvalidInput, match="another kind"):
        drawn(scenario("circle", circle_radius_m=0.5, obstacles=(Point(4, 2.5).buffer(0.3),)))


def test_way_points_follow_each_other():
    """The given points are met in order and round again, from any of them."""
    points = [(1.0, 1.0), (7.0, 1.0), (4.0, 4.0)]
    firsts = set()
    for seed in range(20):
        line = drawn(scenario("way_points", way_points_m=points), seed)
        order = [points.index(tuple(corner)) for corner in line.tolist()]
        firsts.add(order[0])
        assert all((later - earlier) % 3 == 1 for earlier, later in pairwise(order))
    assert firsts == {0, 1, 2}


@pytest.mark.parametrize(
    ("point", "reason"),
    [
        ((9.0, 1.0), "outside the floor"),
        ((4.0, 2.0), "in an obstacle"),
        ((0.1, 2.0), "100 mm away, 320 mm are needed"),
    ],
)
def test_way_point_without_room_is_named(point, reason):
    """The message gives the number of the point, the reason and the nearest place."""
    world = scenario("way_points", way_points_m=[(1, 1), point], obstacles=(box(3, 1, 5, 3),))
    with pytest.raises(InvalidInput, match=rf"routes\.way_points\[1\].*{reason}.*nearest place") as caught:
        drawn(world)
    assert len(caught.value.faults) == 1


def test_way_point_behind_a_narrow_door_is_named():
    """A point in the smaller room is refused if the door is too narrow, and reached if it is not."""
    points = [(1, 1), (6, 3)]
    with pytest.raises(InvalidInput, match=r"way_points\[1\].*no way leads there"):
        drawn(scenario("way_points", floor=rooms(0.63), way_points_m=points))
    line = drawn(scenario("way_points", floor=rooms(0.65), way_points_m=points))
    assert len(line) >= 4


def test_way_points_need_two_places():
    """One point, or the same twice, is no route."""
    for points in ([(1, 1)], [(1, 1), (1, 1)]):
        with pytest.raises(InvalidInput, match="at least two"):
            drawn(scenario("way_points", way_points_m=points))


def test_smaller_room_behind_a_narrow_door_is_unreachable():
    """Only the larger room counts, and the report knows the area of the other."""
    narrow, wide = Site(name="a", floor=rooms(0.63)), Site(name="b", floor=rooms(0.65))
    room_m2 = (4 - 0.64) * (4 - 0.64)
    # From both sides the regions reach a little into the door: at most 0.64 m x 0.3 m, halved and more.
    assert reachable_region(narrow, robot()).area == pytest.approx(room_m2, abs=0.06)
    assert unreachable_area_m2(narrow, robot()) == pytest.approx((3 - 0.64) * (4 - 0.64), abs=0.06)
    assert unreachable_area_m2(wide, robot()) == 0.0


def test_parts_of_a_floor_are_not_jumped():
    """On a floor in two parts all drives stay in the larger one."""
    world = scenario("point_to_point", floor=MultiPolygon([box(0, 0, 3, 3), box(3.1, 0, 9, 3)]))
    for seed in range(10):
        assert box(3.1, 0, 9, 3).covers(LineString(drawn(world, seed)))


@pytest.mark.parametrize("kind", ["patrol", "point_to_point", "way_points"])
def test_robot_that_fits_nowhere_is_told_how_much_is_missing(kind):
    """The message gives the width that is needed and the one there is."""
    world = scenario(kind, floor=box(0, 0, 9, 0.6), way_points_m=[(1, 0.3), (8, 0.3)])
    with pytest.raises(InvalidInput, match=r"site 'hall': the robot needs 640 mm .*widest place has 600 mm"):
        drawn(world)


def test_robot_that_can_only_turn_on_the_spot_is_refused():
    """Room for a millimetre is no route."""
    with pytest.raises(InvalidInput, match="some way to go"):
        drawn(scenario(floor=box(0, 0, 0.641, 0.641)))


def test_unknown_kind_is_refused_with_a_guess():
    """A typo in the kind of route is answered."""
    with pytest.raises(InvalidInput, match="Did you mean 'patrol'"):
        drawn(scenario("patroll"))
