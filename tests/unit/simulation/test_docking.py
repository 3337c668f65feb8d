"""Docking drives: walls and obstacles stop them, noise and rooms are shared, and what cannot be is refused."""

import math
from dataclasses import replace

import numpy as np
import pytest
import shapely

from layoutopt.errors import InvalidInput
from layoutopt.simulation.docking import (
    Guide,
    RangeSource,
    direct_share,
    dock,
    free_way_m,
    random_obstacles,
)
from layoutopt.simulation.kim2009_rooms import docking_room, share_not_nearer

ROOM = docking_room(blocking=True)
DRAWS = np.random.Generator(np.random.Philox(4))


def test_robots_in_an_empty_room_all_dock():
    """Two degrees of noise keep nobody from a transponder 5 m away: nine steps to within half a metre, or ten."""
    empty = np.zeros((40, 0, 2))
    for guide in Guide:
        outcomes = dock(ROOM, empty, guide, seed=1)
        assert outcomes.docked.all()
        assert outcomes.steps.max() <= 11
    plain = dock(replace(ROOM, noise_rad=0.0), empty, Guide.AS_MEASURED, seed=1)
    assert (plain.mean_error_rad < 1e-12).all()
    assert set(plain.steps) <= {9.0, 10.0}


def test_a_robot_that_begins_beside_the_transponder_has_docked():
    """No step is taken."""
    outcomes = dock(replace(ROOM, start_m=(1.7, 1.5)), np.zeros((3, 0, 2)), Guide.AS_MEASURED, seed=1)
    assert outcomes.docked.all()
    assert outcomes.steps.tolist() == [0.0, 0.0, 0.0]


def test_a_free_way_ends_where_walls_and_discs_begin():
    """Against shapely: the longest way up to a step that keeps inside the room and out of all discs."""
    obstacles = DRAWS.uniform(-2.5, 2.5, (300, 9, 2))
    places, headings = DRAWS.uniform(-2.5, 2.5, (300, 2)), DRAWS.uniform(-math.pi, math.pi, 300)
    outside = (np.hypot(*np.moveaxis(obstacles - places[:, None], -1, 0)) > ROOM.obstacle_radius_m + 0.001).all(
        axis=1
    )
    found_m = free_way_m(ROOM, obstacles, places, headings)
    stopped = 0
    for drive in np.flatnonzero(outside):
        end = places[drive] + ROOM.step_m * np.array([math.cos(headings[drive]), math.sin(headings[drive])])
        # Enough corners for a circle that is right to a hundredth of a millimetre.
        discs = shapely.union_all(
            shapely.buffer(shapely.points(obstacles[drive]), ROOM.obstacle_radius_m, quad_segs=99)
        )
        way = shapely.LineString([places[drive], end]).intersection(shapely.box(*ROOM.bounds_m)).difference(discs)
        pieces = [piece for piece in shapely.get_parts(way) if piece.distance(shapely.Point(places[drive])) < 1e-9]
        assert found_m[drive] == pytest.approx(pieces[0].length if pieces else 0.0, abs=2e-3)
        stopped += found_m[drive] < ROOM.step_m - 1e-3
    assert 40 < stopped < outside.sum()


def test_an_obstacle_across_the_line_takes_the_direct_wave():
    """One beside the line, behind the robot or behind the transponder does not."""
    room = replace(ROOM, blocks_wave=True)
    places = np.tile(np.array([0.0, 1.5]), (4, 1))
    obstacles = np.array([[[1.0, 1.55]], [[1.0, 1.65]], [[-1.0, 1.5]], [[2.3, 1.5]]])
    assert direct_share(room, obstacles, places).tolist() == [0.0, 1.0, 1.0, 1.0]
    assert direct_share(ROOM, obstacles, places).tolist() == [1.0] * 4


def test_a_robot_before_an_obstacle_docks_only_with_a_detour():
    """Straight ahead, without noise and reflection, it stands there for ever; the filter does not change that."""
    room = replace(ROOM, reflection=0.0, noise_rad=0.0)
    ahead = np.array([[[0.0, 0.0]]])
    for guide in (Guide.AS_MEASURED, Guide.FILTERED):
        assert dock(room, ahead, guide, seed=1).docked.tolist() == [0.0]
        assert dock(room, ahead, guide, seed=1, detour=True).docked.tolist() == [1.0]


def test_a_detour_leaves_drives_that_nothing_stops_as_they_are():
    """In an empty room the two are the same to the last bit."""
    empty = np.zeros((20, 0, 2))
    assert dock(ROOM, empty, Guide.FILTERED, seed=3) == dock(ROOM, empty, Guide.FILTERED, seed=3, detour=True)


def test_drives_do_not_depend_on_their_number():
    """The first drives of many are those of few, in rooms with few obstacles or many, for every guide."""
    many, few = random_obstacles(ROOM, 5, 12, 0.5, seed=8), random_obstacles(ROOM, 3, 5, 0.5, seed=8)
    assert np.array_equal(many[:5, :3], few)
    for guide in Guide:
        whole, part = dock(ROOM, many, guide, seed=8), dock(ROOM, many[:5], guide, seed=8)
        assert np.array_equal(whole.docked[:5], part.docked)
        assert np.array_equal(whole.steps[:5], part.steps)


def test_a_longer_limit_changes_nothing_before_it():
    """What docks within 12 steps does so in the same steps when 40 are allowed."""
    obstacles = random_obstacles(ROOM, 7, 40, 0.5, seed=9)
    short = dock(replace(ROOM, steps=12), obstacles, Guide.AS_MEASURED, seed=9)
    long = dock(ROOM, obstacles, Guide.AS_MEASURED, seed=9)
    assert np.array_equal(short.docked, (long.docked == 1.0) & (long.steps <= 12.0))


def test_another_seed_is_another_noise():
    """The noise really follows the seed."""
    empty = np.zeros((3, 0, 2))
    assert dock(ROOM, empty, Guide.AS_MEASURED, seed=1) != dock(ROOM, empty, Guide.AS_MEASURED, seed=2)


def test_walls_reflect():
    """Waves from walls turn directions in a room without obstacles."""
    room = replace(ROOM, wall_reflection=0.5, noise_rad=0.0)
    outcomes = dock(room, np.zeros((1, 0, 2)), Guide.AS_MEASURED, seed=1)
    assert outcomes.mean_error_rad[0] > math.radians(3.0)
    assert room.images_m().tolist() == [[-7.0, 1.5], [3.0, 1.5], [2.0, -6.5], [2.0, 3.5]]


def test_true_ranges_help_the_correction_and_strength_does_not():
    """Mean error at seven scatterers: 12 degrees against 33; the standard error of 60 drives is below 3."""
    room = docking_room(blocking=False)
    obstacles = random_obstacles(room, 7, 60, 0.5, seed=10)
    by_strength = dock(room, obstacles, Guide.CORRECTED, seed=10)
    by_truth = dock(room, obstacles, Guide.CORRECTED, seed=10, range_source=RangeSource.TRUE)
    assert by_strength.mean_error_rad.mean() > 1.3 * by_truth.mean_error_rad.mean()


def test_obstacles_keep_their_clearance_and_lie_in_the_room():
    """Every draw, and over the whole room: the mean of 2000 is within five standard errors of the middle."""
    obstacles = random_obstacles(ROOM, 10, 200, 0.5, seed=11)
    for place in (ROOM.start_m, ROOM.transponder_m):
        assert np.hypot(*np.moveaxis(obstacles - np.array(place), -1, 0)).min() >= 0.5
    assert np.abs(obstacles).max() <= 2.5
    assert np.abs(obstacles.mean(axis=(0, 1))).max() < 5.0 * 5.0 / math.sqrt(12.0 * 2000.0)


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        ({"wavelength_m": 0.0}, "wavelength_m: it is 0.0. It must be positive and finite."),
        ({"wavelength_m": math.nan}, "wavelength_m: it is nan"),
        ({"reflection": 1.5}, "share between 0 and 1"),
        ({"reflection": math.nan}, "share between 0 and 1"),
        ({"noise_rad": -0.1}, "noise_rad"),
        ({"obstacle_radius_m": math.nan}, "obstacle_radius_m"),
        ({"obstacle_radius_m": 0.0, "blocks_wave": True}, "block nothing"),
        ({"steps": 0}, "at least one step"),
        ({"bounds_m": (0.0, 0.0, 0.0, 1.0)}, "rising and finite"),
        ({"bounds_m": (-9.0, -9.0, math.nan, 9.0)}, "rising and finite"),
        ({"transponder_m": (3.0, 0.0)}, "transponder_m: it is \\(3.0, 0.0\\). It must lie inside the room."),
        ({"start_m": (math.nan, 0.0)}, "inside the room"),
    ],
)
def test_a_room_that_cannot_be_is_refused(change, sentence):
    """By name, value and what would be right."""
    with pytest.raises(InvalidInput, match=sentence):
        replace(ROOM, **change)


def test_transponder_and_start_must_not_lie_inside_an_obstacle():
    """The message says which obstacle; one that only scatters may not lie on the transponder either."""
    obstacles = np.array([[[0.0, 0.0], [0.1, 0.1]], [[0.0, 0.0], [2.05, 1.5]]])
    with pytest.raises(InvalidInput, match=r"transponder_m: it lies inside obstacle 1 of drive 1, 0\.05 m"):
        dock(ROOM, obstacles, Guide.AS_MEASURED, seed=1)
    with pytest.raises(InvalidInput, match="start_m: it lies inside obstacle 0 of drive 0"):
        dock(ROOM, np.array([[[-2.0, -1.5]]]), Guide.AS_MEASURED, seed=1)
    with pytest.raises(InvalidInput, match="transponder_m"):
        dock(docking_room(blocking=False), np.array([[[2.0, 1.5]]]), Guide.AS_MEASURED, seed=1)
    with pytest.raises(InvalidInput, match="not finite"):
        dock(ROOM, np.array([[[math.nan, 0.0]]]), Guide.AS_MEASURED, seed=1)
    with pytest.raises(ValueError, match="shape \\(drives, k, 2\\)"):
        dock(ROOM, np.zeros((3, 2)), Guide.AS_MEASURED, seed=1)


def test_obstacles_that_find_no_place_are_refused():
    """A clearance wider than the room, or one that lets obstacles cover the transponder."""
    with pytest.raises(InvalidInput, match="no place of the room is 9 m from start and transponder"):
        random_obstacles(ROOM, 1, 1, 9.0, seed=1)
    with pytest.raises(InvalidInput, match=r"must exceed the radius, 0\.1 m"):
        random_obstacles(ROOM, 1, 1, 0.1, seed=1)


def test_the_share_that_comes_no_nearer_is_counted_by_moving():
    """A step of a fifth of the distance, really made, against the closed form."""
    errors = DRAWS.uniform(-math.pi, math.pi, 5000)
    after = np.hypot(1.0 - 0.2 * np.cos(errors), 0.2 * np.sin(errors))
    assert share_not_nearer(errors) == (after >= 1.0).mean()
    with pytest.raises(InvalidInput, match="no direction"):
        share_not_nearer(np.array([]))
    with pytest.raises(InvalidInput, match="not finite"):
        share_not_nearer(np.array([math.nan]))
    with pytest.raises(InvalidInput, match="share of the distance"):
        share_not_nearer(errors, 0.0)
