"""The target on its walk, clutter and bystanders: geometry by brute force, and what does not fit is refused."""

import math
from dataclasses import replace

import numpy as np
import pytest
import shapely
from shapely.geometry import LinearRing, LineString, MultiPoint, Point, box
from tracking_cases import ROBOT, SCENARIO, SITE, WALK_M, WORLD, world

from layoutopt.errors import InvalidInput
from layoutopt.simulation.walking import bystander_places, clutter, lap_m, target_places, tracking_world
from layoutopt.site import Site
from layoutopt.streams import Purpose, Streams

TIMES_S = 0.4 * (np.arange(375) + 1.0)


def stream(purpose, replication=0, seed=3):
    """Return a stream of one trial."""
    return Streams(seed=seed).generator("tracking", replication, purpose)


def test_the_target_goes_round_and_round_at_its_speed():
    """Always on the ring, as far along it as speed and time say, in the order of its corners; back after a lap."""
    ring = LinearRing(WALK_M)
    assert lap_m(WORLD) == ring.length == 12.0
    places_m = target_places(WORLD, 0.25, TIMES_S)
    assert shapely.distance(ring, shapely.points(places_m)).max() < 1e-12
    along_m = shapely.line_locate_point(ring, shapely.points(places_m))
    expected_m = (3.0 + 0.4 * TIMES_S) % 12.0
    assert np.abs(np.mod(along_m - expected_m + 6.0, 12.0) - 6.0).max() < 1e-9
    assert target_places(WORLD, 0.25, TIMES_S + 30.0) == pytest.approx(places_m, abs=1e-9)


def test_times_of_any_shape_have_places():
    """A table of reading times gives a table of places, each as alone."""
    table_s = TIMES_S[:6].reshape(3, 2)
    places_m = target_places(WORLD, 0.9, table_s)
    assert places_m.shape == (3, 2, 2)
    assert (places_m[2, 1] == target_places(WORLD, 0.9, table_s[2, 1])).all()


@pytest.mark.parametrize("hides", [False, True])
def test_clutter_stands_on_the_floor_off_the_walk_the_robot_and_itself(hides):
    """In 40 trials, each different; one thing more leaves the others where they are. Some hide, if they may."""
    scenario = replace(world(clutter_hides=hides), site=replace(SITE, obstacles=(box(3.5, -1.0, 4.0, 1.0),)))
    walk = LinearRing(WALK_M)
    sights = shapely.linestrings([[(0.0, 0.0), place] for place in target_places(WORLD, 0.0, 0.25 * TIMES_S)])
    seen, hiding = set(), 0
    for replication in range(40):
        things = clutter(scenario, stream(Purpose.CLUTTER, replication))
        assert things.shape == (12, 3)
        assert (things[:, 2] == WORLD.clutter_radius_m).all()
        middles = shapely.points(things[:, :2])
        assert shapely.covers(scenario.site.open_floor, shapely.buffer(middles, 0.15)).all()
        assert shapely.distance(walk, middles).min() >= 0.22 + 0.15
        assert shapely.distance(Point(0.0, 0.0), middles).min() >= ROBOT.radius_m + 0.15
        apart_m = shapely.distance(middles[:, None], middles[None, :]) + 9.0 * np.eye(12)
        assert apart_m.min() >= 2.0 * 0.15
        hiding += (shapely.distance(sights[:, None], middles[None, :]) < 0.22 + 0.15).any()
        more = replace(scenario, tracking=replace(scenario.tracking, clutter_count=13))
        assert (clutter(more, stream(Purpose.CLUTTER, replication))[:12] == things).all()
        seen.add(things.tobytes())
    assert len(seen) == 40
    assert hiding > 20 if hides else hiding == 0


@pytest.mark.parametrize("hides", [False, True])
def test_the_first_thing_is_even_over_its_room(hides):
    """Of 1,000, as many as the area says are in the part beyond the walk, within five deviations (6e-7)."""
    scenario = world(clutter_count=1, clutter_hides=hides)
    first_m = np.array([clutter(scenario, stream(Purpose.CLUTTER, number))[0, :2] for number in range(1000)])
    kept = LinearRing(WALK_M) if hides else MultiPoint([(0, 0), *WALK_M]).convex_hull
    room = SITE.floor.buffer(-0.15).difference(kept.buffer(0.42, quad_segs=64))
    room = room.difference(Point(0, 0).buffer(ROBOT.radius_m + 0.2, quad_segs=64))
    share = room.intersection(box(3.0, -3.0, 5.0, 3.0)).area / room.area
    assert abs((first_m[:, 0] > 3.0).mean() - share) < 5.0 * math.sqrt(share * (1.0 - share) / 1000)


def test_bystanders_walk_to_and_fro_and_touch_nothing():
    """At the target's speed, straight, from one end to the other and back, clear of walls, things and robot."""
    scenario = world(bystanders=4, walking_speed_m_s=0.8)
    turned_back = 0
    for replication in range(10):
        things = clutter(scenario, stream(Purpose.CLUTTER, replication))
        times_s = 0.05 * np.arange(1200)
        places_m = bystander_places(scenario, things, stream(Purpose.TARGET, replication), times_s)
        assert places_m.shape == (1200, 4, 2)
        for person_m in np.moveaxis(places_m, 1, 0):
            points = shapely.points(person_m)
            assert shapely.distance(SITE.floor.exterior, points).min() >= 0.22 - 1e-9
            assert shapely.covers(SITE.floor, points).all()
            for x_m, y_m, radius_m in things:
                assert np.hypot(*(person_m - (x_m, y_m)).T).min() >= radius_m + 0.22 - 1e-9
            assert np.hypot(*person_m.T).min() >= ROBOT.radius_m + 0.22
            steps_m = np.hypot(*np.diff(person_m, axis=0).T)
            assert np.quantile(steps_m, 0.9) == pytest.approx(0.04, rel=1e-9)
            assert steps_m.max() <= 0.04 + 1e-9
            ends_m = person_m[[np.argmax(person_m @ (1.0, 0.1)), np.argmin(person_m @ (1.0, 0.1))]]
            assert shapely.distance(LineString(ends_m), points).max() < 1e-9
            assert np.hypot(*(ends_m[1] - ends_m[0])) >= 1.0 - 0.08
            turned_back += (np.diff(np.sign(np.diff(person_m[:, 0]))) != 0).sum() >= 2
    assert turned_back == 40


def test_one_bystander_more_changes_nothing_for_the_others():
    """The first two of three walk as two do."""
    things = clutter(SCENARIO, stream(Purpose.CLUTTER))
    two = bystander_places(world(bystanders=2), things, stream(Purpose.TARGET), TIMES_S)
    three = bystander_places(world(bystanders=3), things, stream(Purpose.TARGET), TIMES_S)
    assert (three[:, :2] == two).all()
    assert bystander_places(SCENARIO, things, stream(Purpose.TARGET), TIMES_S).shape == (375, 0, 2)


def test_clutter_without_room_is_refused_with_how_much_there_was():
    """Too many things, and a floor on which not one has room."""
    with pytest.raises(
        InvalidInput, match=r"of 400 things of .* only \d\d+ find room .* Have fewer or smaller things"
    ):
        clutter(world(clutter_count=400), stream(Purpose.CLUTTER))
    narrow = Site(name="narrow", floor=box(-0.3, -0.3, 3.3, 0.3))
    scenario = replace(world(walk_m=np.array([(0.8, 0), (3, 0)]), clutter_count=1), site=narrow)
    with pytest.raises(InvalidInput, match="only 0 find room"):
        clutter(scenario, stream(Purpose.CLUTTER))


def test_bystanders_without_a_way_are_refused():
    """Clutter as wide as the room."""
    things = np.array([(2.0, 0.0, 3.5)])
    with pytest.raises(InvalidInput, match=r"no straight way of .* is free"):
        bystander_places(world(bystanders=1), things, stream(Purpose.TARGET), TIMES_S)


@pytest.mark.parametrize(
    ("scenario", "message"),
    [
        (replace(SCENARIO, tracking=None), "there is nobody to track"),
        (world(robot_pose=(-1.5, 0.0, 0.0)), r"the robot at \(-1.5, 0\) m stands off the floor"),
        (world(walk_m=np.array([(1, -2), (5.5, -2), (3, 2)])), "of the walk lead off the floor"),
        (replace(SCENARIO, site=replace(SITE, obstacles=(box(2.8, -1, 3.2, 1),))), "through an obstacle"),
        (world(robot_pose=(1.1, 0.0, 0.0)), "the walk comes within"),
    ],
)
def test_robots_and_walks_that_do_not_fit_are_refused(scenario, message):
    """Each message says what is where, and what to do."""
    with pytest.raises(InvalidInput, match=message) as raised:
        tracking_world(scenario)
    assert raised.value.faults[0].repair


def test_a_walk_of_two_corners_goes_to_and_fro():
    """Its ring is the way there and back."""
    line = replace(WORLD, walk_m=np.array([(1, 0), (3, 0)]))
    assert lap_m(line) == 4.0
    assert target_places(line, 0.0, np.array([2.5, 5.0, 7.5])) == pytest.approx(np.array([(2, 0), (3, 0), (2, 0)]))
