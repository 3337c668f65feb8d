"""Walls and waves where robots dock: a rectangular site is a room, and mirror images are what light would do."""

import math
from dataclasses import replace

import numpy as np
import pytest
import shapely
from docking_cases import HALL, ROBOT, layout, scenario
from shapely.geometry import box

from layoutopt.estimators.direction_of_arrival import direction_error
from layoutopt.simulation.docking_ground import RectangleWalls, SiteWalls
from layoutopt.simulation.docking_trials import docking_ground
from layoutopt.site import Site

DRAWS = np.random.Generator(np.random.Philox(77))
BOUNDS_M = (0.0, 0.0, 6.0, 5.0)
CORNER = Site(name="corner", floor=box(0.0, 0.0, 6.0, 5.0).difference(box(3.0, 2.0, 6.0, 5.0)))
"""A hall bent round a corner at (3, 2)."""


def places(count, site=HALL, margin_m=0.3):
    """Random places on a floor, off its walls."""
    drawn = DRAWS.uniform((0.0, 0.0), (6.0, 5.0), (10 * count, 2))
    inside = shapely.intersects_xy(site.open_floor.buffer(-margin_m), drawn[:, 0], drawn[:, 1])
    return drawn[inside][:count]


def test_a_rectangular_site_is_a_room():
    """Ways, sight and mirror images by ray casting are those in closed form."""
    room = RectangleWalls(bounds_m=BOUNDS_M)
    borders = docking_ground(layout((5.0, 4.0)), scenario()).walls.walls_m
    site = SiteWalls(room=HALL.floor, room_walls_m=borders, walls_m=borders)
    from_m, headings = places(200), DRAWS.uniform(-math.pi, math.pi, 200)
    ways_m = site.free_m(from_m, headings, 4.0)
    np.testing.assert_allclose(ways_m, room.free_m(from_m, headings, 4.0), atol=1e-9)
    assert 50 < (ways_m < 3.9).sum() < 200
    assert site.seen(from_m, places(200)).all()
    for blocked in (False, True):
        found, expected = (walls.images(np.array([5.0, 4.0]), from_m, blocked=blocked) for walls in (site, room))
        np.testing.assert_allclose(sorted(found[0].tolist()), sorted(expected[0].tolist()), atol=1e-12)
        assert (found[1] == 1.0).all()


def test_an_image_is_seen_where_light_would_come_from_a_mirror():
    """Along a wall of every site: the shortest way over a point of it is straight to the image."""
    source = np.array([5.0, 1.0])
    ground = docking_ground(layout(tuple(source)), scenario(CORNER))
    from_m = places(60, CORNER)
    images_m, seen = ground.walls.images(source, from_m, blocked=False)
    walls_m = ground.walls.walls_m
    assert len(images_m) == len(walls_m)
    shares = np.linspace(0.0, 1.0, 4001)[:, None]
    for wall, image_m, column in zip(walls_m, images_m, seen.T, strict=True):
        points = wall[:2] + shares * (wall[2:] - wall[:2])
        lengths = (
            np.hypot(*(points[:, None] - from_m).transpose(2, 0, 1)) + np.hypot(*(points - source).T)[:, None]
        )
        touched, straight_m = lengths.argmin(axis=0), np.hypot(*(from_m - image_m).T)
        within = (touched > 1) & (touched < 3999)
        mirrored = within & (np.abs(lengths.min(axis=0) - straight_m) < 1e-5)
        sure = within | (touched == 0) | (touched == 4000)
        # Behind its wall a place has the image at the source's own distance, and no reflection.
        assert (column[sure] <= mirrored[sure]).all()
        normal = np.array([wall[1] - wall[3], wall[2] - wall[0]])
        front = ((from_m - wall[:2]) @ normal) * ((source - wall[:2]) @ normal) > 0.0
        assert (column[sure & front] == mirrored[sure & front]).all()
    assert 0.2 < seen.mean() < 0.8


def test_walls_that_block_hide_images_behind_a_corner():
    """Only fewer images are seen, and some are not."""
    source, from_m = np.array([5.0, 1.0]), places(200, CORNER)
    walls = docking_ground(layout(tuple(source)), scenario(CORNER)).walls
    through, stopped = (walls.images(source, from_m, blocked=blocked)[1] for blocked in (False, True))
    assert (stopped <= through).all()
    assert stopped.sum() < 0.9 * through.sum()


def test_robots_never_leave_their_room():
    """Random steps of many robots, glides along walls among them, end where their middle has room."""
    walls = docking_ground(layout((5.0, 1.0)), scenario(CORNER)).walls
    at_m = places(200, CORNER)
    for turn in range(60):
        headings = DRAWS.uniform(-math.pi, math.pi, len(at_m))
        headings[::2] = DRAWS.choice([0.0, 0.5, 1.0, 1.5], len(at_m[::2])) * math.pi + 1e-9 * (turn % 3 - 1)
        way_m = walls.free_m(at_m, headings, 1.0)
        assert (way_m >= 0.0).all()
        at_m = at_m + way_m[:, None] * np.stack([np.cos(headings), np.sin(headings)], axis=1)
        assert shapely.intersects_xy(walls.room, at_m[:, 0], at_m[:, 1]).all()
    assert walls.room.boundary.distance(shapely.points(at_m)).min() < 1e-3


def test_waves_on_an_open_floor_are_those_of_the_formula():
    """Nothing hides anything: all scatterers, all of the direct wave."""
    scatterers, at_m = places(4), places(30)
    ground = docking_ground(layout((5.0, 4.0)), scenario())
    found = ground.arrivals(scatterers, at_m)
    expected = direction_error(at_m, (5.0, 4.0), scatterers, 0.5, ground.world.wavelength_m)
    assert found.heard.all()
    np.testing.assert_array_equal(found.error_rad, expected.error_rad)
    np.testing.assert_array_equal(found.amplitude_ratio, expected.amplitude_ratio)


def test_what_walls_hide_is_not_heard():
    """Round the corner of a hall: no direct wave, a scatterer only if both see it, and silence without any."""
    hidden = np.array([[1.0, 4.5]])
    ground = docking_ground(layout((5.5, 0.5)), scenario(CORNER, blocks_wave=True))
    open_ground = replace(ground, world=replace(ground.world, blocks_wave=False))
    for scatterers in (np.zeros((0, 2)), np.array([[1.0, 4.0]]), np.array([[5.0, 1.0]])):
        assert not ground.arrivals(scatterers, hidden).heard.any()
        assert open_ground.arrivals(scatterers, hidden).heard.all()
    bend = np.array([[2.0, 1.0]])
    found = ground.arrivals(bend, hidden)
    true_rad = math.atan2(0.5 - 4.5, 5.5 - 1.0)
    # One wave alone comes from its scatterer, or from the other side where its phase is turned over.
    bearing = true_rad + float(found.error_rad[0])
    from_scatterer = math.atan2(1.0 - 4.5, 2.0 - 1.0)
    assert found.heard.all()
    assert math.sin(bearing - from_scatterer) == pytest.approx(0.0, abs=1e-12)


def test_reflecting_walls_bring_waves_to_where_nothing_else_comes():
    """The image in a wall that both ends see is heard behind the corner."""
    hidden = np.array([[1.0, 4.0]])
    world = {"blocks_wave": True, "reflection": 0.0}
    silent = docking_ground(layout((5.5, 0.5)), scenario(CORNER, **world))
    mirrored = docking_ground(layout((5.5, 0.5)), scenario(CORNER, wall_reflection=0.5, **world))
    places_m = np.concatenate([hidden, places(300, CORNER)])
    quiet = ~silent.arrivals(np.zeros((0, 2)), places_m).heard
    again = mirrored.arrivals(np.zeros((0, 2)), places_m).heard
    assert quiet.sum() > 30
    assert again[~quiet].all()
    assert again[quiet].sum() > 5


def test_walls_of_a_site_are_those_of_its_obstacles_too():
    """An obstacle stops robots and hides the transponder."""
    site = Site(name="pillar", floor=HALL.floor, obstacles=(box(2.5, 2.0, 3.5, 3.0),))
    walls = docking_ground(layout((5.0, 2.5)), scenario(site)).walls
    at_m = np.array([[1.0, 2.5], [1.0, 4.5]])
    assert walls.seen(at_m, np.array([[5.0, 2.5]] * 2)).tolist() == [False, True]
    free_m = walls.free_m(at_m, np.zeros(2), 2.0)
    assert free_m[0] == pytest.approx(1.5 - ROBOT.radius_m, abs=0.05)
    assert free_m[1] == 2.0
