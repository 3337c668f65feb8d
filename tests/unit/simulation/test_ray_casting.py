"""Rays against walls and discs: known answers, the plain twin, and shapely as a third opinion."""

import math

import numpy as np
import pytest
import shapely
from shapely.geometry import LineString, MultiPolygon, Point, box

from layoutopt.simulation.ray_casting import cast, plain_cast, plain_visible, visible, walls_of
from layoutopt.site import Site

NOTHING = np.empty((0, 3))
ROOM = Site(name="room", floor=box(-2, -1, 2, 1))
CROWDED = Site(
    name="crowded",
    floor=MultiPolygon([box(0, 0, 8, 6).difference(box(3, 2, 4, 4)), box(9, 0, 12, 3)]),
    obstacles=(box(6, 0, 6.5, 2), Point(1.5, 4.5).buffer(0.5, quad_segs=4)),
)


def world(count, seed):
    """Return places of the crowded site, and discs, drawn evenly."""
    draws = np.random.default_rng(seed)
    places_m = draws.uniform((0, 0), (12, 6), (count, 2))
    discs = np.column_stack([draws.uniform((0, 0), (12, 6), (15, 2)), draws.uniform(0.0, 0.5, 15)])
    return draws, places_m, discs


def test_walls_are_all_borders_of_the_floor_less_its_obstacles():
    """Their length is that of the borders, they close, and one site has one array."""
    walls_m = walls_of(CROWDED)
    assert walls_of(CROWDED) is walls_m
    assert not walls_m.flags.writeable
    length_m = np.hypot(walls_m[:, 2] - walls_m[:, 0], walls_m[:, 3] - walls_m[:, 1]).sum()
    assert length_m == pytest.approx(CROWDED.open_floor.length, rel=1e-12)
    starts, ends = {tuple(wall[:2]) for wall in walls_m}, {tuple(wall[2:]) for wall in walls_m}
    assert starts == ends


def test_a_ray_in_a_square_room_meets_the_wall_that_it_looks_at():
    """Straight ahead, into a corner (which lets no ray through), and out of range."""
    angles = np.array([0.0, math.pi / 2, math.pi, -math.pi / 2, math.atan2(1, 2), math.radians(10)])
    origins = np.zeros((len(angles), 2))
    found = cast(origins, angles, walls_of(ROOM), NOTHING, 20.0)
    assert found == pytest.approx([2, 1, 2, 1, math.sqrt(5), 2 / math.cos(math.radians(10))], rel=1e-12)
    assert np.isinf(cast(origins, angles, walls_of(ROOM), NOTHING, 1.5)).tolist() == [True, False] * 2 + [True] * 2


def test_corners_let_no_ray_through():
    """Rays to every corner of a round room with 64 corners, from 50 places inside."""
    site = Site(name="round", floor=Point(0.3, -0.2).buffer(3.0, quad_segs=16))
    walls_m = walls_of(site)
    origins = np.random.default_rng(3).uniform(-1.5, 1.5, (50, 2)).repeat(len(walls_m), axis=0)
    to_corner = np.tile(walls_m[:, :2], (50, 1)) - origins
    found = cast(origins, np.arctan2(to_corner[:, 1], to_corner[:, 0]), walls_m, NOTHING, 20.0)
    assert found == pytest.approx(np.hypot(*to_corner.T), abs=1e-7)


def test_a_ray_meets_a_disc_where_the_circle_is():
    """Through its middle, aside by half its radius, past it, behind the ray, and from within."""
    disc = np.array([[3.0, 0.0, 0.5]])
    origins = np.array([(0, 0), (0, 0.25), (0, 0.5), (5, 0), (3.1, 0.1)], dtype=float)
    found = cast(origins, np.zeros(5), np.empty((0, 4)), disc, 20.0)
    assert found == pytest.approx([2.5, 3 - math.sqrt(0.25 - 0.0625), math.inf, math.inf, 0.0], rel=1e-12)


def test_the_compiled_rays_agree_with_the_plain_ones_and_with_shapely():
    """1,500 rays through a crowded site with discs; shapely cuts the rays with the borders of everything."""
    draws, places_m, discs = world(1500, seed=11)
    angles = draws.uniform(-math.pi, math.pi, len(places_m))
    found = cast(places_m, angles, walls_of(CROWDED), discs, 7.0)
    assert found == pytest.approx(plain_cast(places_m, angles, walls_of(CROWDED), discs, 7.0), rel=1e-12)
    walls = shapely.union_all([LineString(wall.reshape(2, 2)) for wall in walls_of(CROWDED)])
    for place, angle, distance_m in zip(places_m[:80], angles[:80], found[:80], strict=True):
        ray = LineString([place, place + 7.0 * np.array([math.cos(angle), math.sin(angle)])])
        away_m = shapely.distance(Point(place), ray.intersection(walls)) if ray.intersects(walls) else math.inf
        for x, y, radius in discs:
            circle = Point(x, y).buffer(radius, quad_segs=200)
            if ray.intersects(circle):
                away_m = min(away_m, shapely.distance(Point(place), ray.intersection(circle)))
        assert distance_m == pytest.approx(away_m, abs=2e-3) or min(distance_m, away_m) > 6.99
    assert np.isinf(found).sum() > 50
    assert np.isfinite(found).sum() > 500


def test_two_places_see_each_other_unless_something_stands_between():
    """A wall, a disc, a disc aside, an end on the wall, an end within a disc, and a place and itself."""
    walls = np.array([(1.0, -1.0, 1.0, 1.0)])
    discs = np.array([(-2.0, 0.0, 0.3)])
    ways = np.array(
        [
            [(0, 0), (2, 0)],
            [(0, 0), (-3, 0)],
            [(0, 0.5), (-3, 0.5)],
            [(0, 0), (1, 0)],
            [(0, 0), (-2, 0.1)],
            [(0, 0), (0, 0)],
            [(0, 2), (2, 2)],
        ],
        dtype=float,
    )
    assert visible(ways[:, 0], ways[:, 1], walls, discs).tolist() == [False, False, True, True, False, True, True]


def test_compiled_sight_agrees_with_plain_sight_and_with_shapely():
    """1,500 straight ways; shapely says how far each is from walls and middles."""
    draws, places_m, discs = world(1500, seed=12)
    goals_m = places_m + draws.normal(0.0, 1.5, places_m.shape)
    seen = visible(places_m, goals_m, walls_of(CROWDED), discs)
    assert (seen == plain_visible(places_m, goals_m, walls_of(CROWDED), discs)).all()
    ways = shapely.linestrings(np.stack([places_m, goals_m], axis=1))
    walls = shapely.union_all([LineString(wall.reshape(2, 2)) for wall in walls_of(CROWDED)])
    expected = ~shapely.intersects(ways, walls)
    for x, y, radius in discs:
        expected &= shapely.distance(ways, Point(x, y)) >= radius
    assert (seen == expected).all()
    assert 200 < seen.sum() < 1300


@pytest.mark.parametrize("name", ["origins_m", "angles_rad", "segments_m", "discs"])
def test_what_is_no_number_is_refused_by_name_and_row(name):
    """Each argument in turn holds a NaN in its second row."""
    given = {
        "origins_m": np.zeros((3, 2)),
        "angles_rad": np.zeros(3),
        "segments_m": np.ones((3, 4)),
        "discs": np.ones((3, 3)),
    }
    given[name][1] = math.nan
    with pytest.raises(ValueError, match=f"row 1 of {name} holds no finite number"):
        cast(**given, range_m=20.0)


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"discs": np.array([(0.0, 0.0, -0.1)])}, "radius of disc 0 is negative"),
        ({"range_m": math.nan}, "range_m must be positive"),
        ({"segments_m": np.zeros((2, 3))}, "segments_m has shape"),
        ({"angles_rad": np.zeros(2)}, "2 directions of rays but 1 places"),
    ],
)
def test_arguments_that_do_not_fit_are_refused(changed, message):
    """Each message names what is wrong."""
    given = {"origins_m": np.zeros((1, 2)), "angles_rad": np.zeros(1), "segments_m": np.ones((1, 4))}
    given |= {"discs": NOTHING, "range_m": 20.0}
    with pytest.raises(ValueError, match=message):
        cast(**(given | changed))
