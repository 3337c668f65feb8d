"""Docking drives: walls and obstacles stop them, noise and rooms are shared, and what cannot be is refused."""

import math
from dataclasses import replace

import numpy as np
import pytest
import shapely
from docking_cases import random_obstacles

from layoutopt.docking_world import DockingWorld
from layoutopt.errors import InvalidInput
from layoutopt.estimators.bearing_filter import BearingBelief, FilteredBearing
from layoutopt.estimators.direction_as_measured import DirectionAsMeasured
from layoutopt.estimators.direction_corrected import DirectionCorrected
from layoutopt.simulation.docking import dock
from layoutopt.simulation.kim2009_rooms import docking_room, share_not_nearer

ROOM = docking_room(blocking=True)
MEASURED, CORRECTED, FILTERED = DirectionAsMeasured(), DirectionCorrected(), FilteredBearing()
FIRST_FILTER = FilteredBearing(belief=BearingBelief(spread_rad=math.radians(15.0), wrong_share=0.2))
ESTIMATORS = (MEASURED, CORRECTED, FILTERED)
DRAWS = np.random.Generator(np.random.Philox(4))


def other(room=ROOM, **changes):
    """The room in another world."""
    return replace(room, world=replace(room.world, **changes))


def test_robots_in_an_empty_room_all_dock():
    """Two degrees of noise keep nobody from a transponder 5 m away: nine steps to within half a metre, or ten."""
    empty = np.zeros((40, 0, 2))
    for estimator in ESTIMATORS:
        outcomes = dock(ROOM, empty, estimator, seed=1)
        assert outcomes.docked.all()
        assert outcomes.steps.max() <= 11
    plain = dock(replace(ROOM, noise_rad=0.0), empty, MEASURED, seed=1)
    assert (plain.mean_error_rad < 1e-12).all()
    assert set(plain.steps) <= {9.0, 10.0}


def test_a_robot_that_begins_beside_the_transponder_has_docked():
    """No step is taken."""
    outcomes = dock(replace(ROOM, start_m=(1.7, 1.5)), np.zeros((3, 0, 2)), MEASURED, seed=1)
    assert outcomes.docked.all()
    assert outcomes.steps.tolist() == [0.0, 0.0, 0.0]


def test_a_free_way_ends_where_walls_and_discs_begin():
    """Against shapely: the longest way up to a step that keeps inside the room and out of all discs."""
    obstacles = DRAWS.uniform(-2.5, 2.5, (300, 9, 2))
    places, headings = DRAWS.uniform(-2.5, 2.5, (300, 2)), DRAWS.uniform(-math.pi, math.pi, 300)
    outside = (
        np.hypot(*np.moveaxis(obstacles - places[:, None], -1, 0)) > ROOM.world.scatterer_radius_m + 0.001
    ).all(axis=1)
    found_m = ROOM.ground.free_way_m(obstacles, places, headings)
    stopped = 0
    for drive in np.flatnonzero(outside):
        end = places[drive] + ROOM.world.step_m * np.array([math.cos(headings[drive]), math.sin(headings[drive])])
        # Enough corners for a circle that is right to a hundredth of a millimetre.
        discs = shapely.union_all(
            shapely.buffer(shapely.points(obstacles[drive]), ROOM.world.scatterer_radius_m, quad_segs=99)
        )
        way = shapely.LineString([places[drive], end]).intersection(shapely.box(*ROOM.bounds_m)).difference(discs)
        pieces = [piece for piece in shapely.get_parts(way) if piece.distance(shapely.Point(places[drive])) < 1e-9]
        assert found_m[drive] == pytest.approx(pieces[0].length if pieces else 0.0, abs=2e-3)
        stopped += found_m[drive] < ROOM.world.step_m - 1e-3
    assert 40 < stopped < outside.sum()


def test_an_obstacle_across_the_line_takes_the_direct_wave():
    """One beside the line, behind the robot or behind the transponder does not."""
    room = other(blocks_wave=True)
    places = np.tile(np.array([0.0, 1.5]), (4, 1))
    obstacles = np.array([[[1.0, 1.55]], [[1.0, 1.65]], [[-1.0, 1.5]], [[2.3, 1.5]]])
    assert room.ground.direct_share(obstacles, places).tolist() == [0.0, 1.0, 1.0, 1.0]
    assert ROOM.ground.direct_share(obstacles, places).tolist() == [1.0] * 4


def test_a_robot_before_an_obstacle_docks_only_with_a_detour():
    """Straight ahead, without noise and reflection, it stands there for ever; the filter does not change that."""
    room = replace(other(reflection=0.0, detour=False), noise_rad=0.0)
    ahead = np.array([[[0.0, 0.0]]])
    for estimator in (MEASURED, FILTERED):
        assert dock(room, ahead, estimator, seed=1).docked.tolist() == [0.0]
        assert dock(other(room, detour=True), ahead, estimator, seed=1).docked.tolist() == [1.0]


def test_a_detour_leaves_drives_that_nothing_stops_as_they_are():
    """In an empty room the two are the same to the last bit."""
    empty = np.zeros((20, 0, 2))
    assert dock(ROOM, empty, FILTERED, seed=3) == dock(other(detour=True), empty, FILTERED, seed=3)


def test_drives_do_not_depend_on_their_number():
    """The first drives of many are those of few, in rooms with few obstacles or many, for every guide."""
    many, few = random_obstacles(ROOM, 5, 12, 0.5, seed=8), random_obstacles(ROOM, 3, 5, 0.5, seed=8)
    assert np.array_equal(many[:5, :3], few)
    for estimator in ESTIMATORS:
        whole, part = dock(ROOM, many, estimator, seed=8), dock(ROOM, many[:5], estimator, seed=8)
        assert np.array_equal(whole.docked[:5], part.docked)
        assert np.array_equal(whole.steps[:5], part.steps)


@pytest.mark.parametrize(
    ("estimator", "changes", "docked", "steps", "error_rad"),
    [
        (MEASURED, {}, 33, 1430, 0.2773606760364216),
        (MEASURED, {"detour": True}, 60, 692, 0.2770068589055941),
        (CORRECTED, {}, 36, 1448, 0.5153070040510219),
        (DirectionCorrected(range_source="true"), {"detour": True}, 56, 859, 0.274518710618494),
        (FIRST_FILTER, {"detour": True}, 59, 692, 0.19948635372848392),
        (MEASURED, {"detour": True, "blocks_wave": True, "reflection": 0.65}, 58, 807, 0.4308694340166291),
        (MEASURED, {"detour": True, "wall_reflection": 0.5}, 59, 789, 0.36005450147275003),
    ],
)
def test_drives_of_the_room_stay_what_they_were(estimator, changes, docked, steps, error_rad):
    """Sixty drives among nine obstacles, by figures from before estimators and sites."""
    outcomes = dock(other(**changes), random_obstacles(ROOM, 9, 60, 0.5, seed=77), estimator, seed=77)
    assert (outcomes.docked.sum(), outcomes.steps.sum()) == (docked, steps)
    assert outcomes.mean_error_rad.mean() == pytest.approx(error_rad, rel=1e-9)


def test_a_longer_limit_changes_nothing_before_it():
    """What docks within 12 steps does so in the same steps when 40 are allowed."""
    obstacles = random_obstacles(ROOM, 7, 40, 0.5, seed=9)
    short = dock(other(steps=12), obstacles, MEASURED, seed=9)
    long = dock(ROOM, obstacles, MEASURED, seed=9)
    assert np.array_equal(short.docked, (long.docked == 1.0) & (long.steps <= 12.0))


def test_another_seed_is_another_noise():
    """The noise really follows the seed."""
    empty = np.zeros((3, 0, 2))
    assert dock(ROOM, empty, MEASURED, seed=1) != dock(ROOM, empty, MEASURED, seed=2)


def test_walls_reflect():
    """Waves from walls turn directions in a room without obstacles."""
    room = replace(other(wall_reflection=0.5), noise_rad=0.0)
    outcomes = dock(room, np.zeros((1, 0, 2)), MEASURED, seed=1)
    assert outcomes.mean_error_rad[0] > math.radians(3.0)
    images_m, seen = room.ground.walls.images(np.array(room.transponder_m), np.zeros((2, 2)), blocked=False)
    assert images_m.tolist() == [[-7.0, 1.5], [3.0, 1.5], [2.0, -6.5], [2.0, 3.5]]
    assert (seen == 1.0).all()


def test_true_ranges_help_the_correction_and_strength_does_not():
    """Mean error at seven scatterers: 12 degrees against 33; the standard error of 60 drives is below 3."""
    room = docking_room(blocking=False)
    obstacles = random_obstacles(room, 7, 60, 0.5, seed=10)
    by_strength = dock(room, obstacles, CORRECTED, seed=10)
    by_truth = dock(room, obstacles, DirectionCorrected(range_source="true"), seed=10)
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
        ({"noise_rad": -0.1}, "noise_rad: it is -0.1. It is zero or positive."),
        ({"noise_rad": math.nan}, "noise_rad"),
        ({"world": DockingWorld(scatterer_radius_m=0.0, blocks_wave=True)}, "block nothing"),
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


@pytest.mark.parametrize(
    ("change", "sentence"),
    [
        ({"frequency_hz": math.inf}, "frequency_hz must be positive and finite, got inf"),
        ({"frequency_hz": math.nan}, "frequency_hz"),
        ({"reflection": 1.5}, "share between 0 and 1"),
        ({"wall_reflection": math.nan}, "share between 0 and 1"),
        ({"scatterer_radius_m": math.nan}, "scatterer_radius_m"),
        ({"steps": 0}, "at least one step"),
        ({"random_scatterers": 3, "clearance_m": 0.05}, "clearance beyond their radius"),
    ],
)
def test_a_world_that_cannot_be_is_refused(change, sentence):
    """An infinite frequency would be a wave without length."""
    with pytest.raises(ValueError, match=sentence):
        DockingWorld(**change)


def test_transponder_and_start_must_not_lie_inside_an_obstacle():
    """The message says which obstacle; one that only scatters may not lie on the transponder either."""
    obstacles = np.array([[[0.0, 0.0], [0.1, 0.1]], [[0.0, 0.0], [2.05, 1.5]]])
    with pytest.raises(InvalidInput, match=r"transponder_m: it lies inside obstacle 1 of drive 1, 0\.05 m"):
        dock(ROOM, obstacles, MEASURED, seed=1)
    with pytest.raises(InvalidInput, match="start_m: it lies inside obstacle 0 of drive 0"):
        dock(ROOM, np.array([[[-2.0, -1.5]]]), MEASURED, seed=1)
    with pytest.raises(InvalidInput, match="transponder_m"):
        dock(docking_room(blocking=False), np.array([[[2.0, 1.5]]]), MEASURED, seed=1)
    with pytest.raises(InvalidInput, match="not finite"):
        dock(ROOM, np.array([[[math.nan, 0.0]]]), MEASURED, seed=1)
    with pytest.raises(ValueError, match="shape \\(drives, k, 2\\)"):
        dock(ROOM, np.zeros((3, 2)), MEASURED, seed=1)


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
