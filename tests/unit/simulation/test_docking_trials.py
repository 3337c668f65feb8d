"""Trials of docking on sites: known answers, what candidates share, the same bits in blocks, what is refused."""

import math
from dataclasses import replace

import numpy as np
import pytest
import shapely
from docking_cases import HALL, ROBOT, SCENARIO, layout, scenario
from shapely.geometry import box

from layoutopt import registry
from layoutopt.errors import InvalidInput
from layoutopt.estimators.bearing_filter import FilteredBearing
from layoutopt.estimators.direction_as_measured import DirectionAsMeasured
from layoutopt.scores import DOCKING_UNITS
from layoutopt.simulation.docking_trials import (
    docking_ground,
    docking_setting,
    docking_transponder,
    run_docking_trials,
)
from layoutopt.simulation.trials import run_trials
from layoutopt.site import Site
from layoutopt.streams import Streams

STREAMS = Streams(seed=20)
MEASURED = DirectionAsMeasured()
BEARINGS = [
    name for name in registry.names("estimators") if registry.card("estimators", name).estimates == "bearing"
]


def settings(place_m, world, count=20):
    """What trials draw for a transponder at a place."""
    ground = docking_ground(layout(place_m), world)
    return [docking_setting(ground, world, STREAMS, replication) for replication in range(count)]


@pytest.mark.parametrize("name", BEARINGS)
def test_everybody_docks_on_an_empty_floor(name):
    """From every start, on the straight way: as many steps as the distance takes, and a few for wide bearings."""
    outcomes = run_trials(layout((5.0, 4.0)), scenario(), registry.load("estimators", name)(), STREAMS, 0, 30)
    assert outcomes.columns == tuple(DOCKING_UNITS)
    assert outcomes.column("docking_success").min() == 1.0
    drawn = settings((5.0, 4.0), scenario(), 30)
    least = np.array([math.ceil((math.dist(one.start_m, (5.0, 4.0)) - 0.5) / 0.5) for one in drawn])
    extra = outcomes.column("docking_steps") - least
    assert extra.min() >= 0
    assert np.median(extra) <= 1


def test_without_noise_the_measured_direction_is_the_true_one():
    """Error zero to rounding."""
    quiet = replace(SCENARIO, faults=replace(SCENARIO.faults, direction_noise_rad=0.0))
    outcomes = run_docking_trials(layout((5.0, 4.0)), quiet, MEASURED, STREAMS, 0, 20)
    assert outcomes.column("docking_direction_error_mean").max() < 1e-12


def test_a_robot_behind_a_wall_that_hears_nothing_does_not_dock_straight():
    """A wall across the hall with a gap at its end: who starts behind it and never hears fails or wanders.

    With waves through the wall the same robots stand before it, unless they make a detour.
    """
    walled = Site(name="walled", floor=HALL.floor, obstacles=(box(2.9, 0.0, 3.1, 4.0),))
    from_behind = {"start_m": (1.0, 1.0), "steps": 12}
    hears = scenario(walled, detour=False, **from_behind)
    deaf = scenario(walled, blocks_wave=True, **from_behind)
    standing = run_docking_trials(layout((5.0, 1.0)), hears, MEASURED, STREAMS, 0, 20)
    assert standing.column("docking_success").max() == 0.0
    assert standing.column("docking_direction_error_mean").max() < math.radians(4.0)
    for estimator in (MEASURED, FilteredBearing()):
        lost = run_docking_trials(layout((5.0, 1.0)), deaf, estimator, STREAMS, 0, 20)
        assert np.isfinite(lost.values).all()
        assert lost.column("docking_success").mean() < 0.5
        assert lost.column("docking_direction_error_mean").mean() > math.radians(30.0)


def test_transponders_elsewhere_meet_the_same_trials():
    """Noise and heading always; starts and scatterers wherever both places allow them."""
    world = scenario(random_scatterers=6)
    pairs = list(zip(settings((5.0, 4.0), world, 60), settings((1.0, 2.0), world, 60), strict=True))
    for one, other in pairs:
        np.testing.assert_array_equal(one.noise_rad, other.noise_rad)
        assert one.heading_rad == other.heading_rad
    same_start = [np.array_equal(one.start_m, other.start_m) for one, other in pairs]
    assert 0.6 < np.mean(same_start) < 1.0
    for (one, other), same in zip(pairs, same_start, strict=True):
        least_m = min(
            math.dist(drawn.start_m, place_m) for drawn in (one, other) for place_m in ((5.0, 4.0), (1.0, 2.0))
        )
        assert same == (least_m > 1.0)
    shared = [(one.scatterers_m == other.scatterers_m).all(axis=1).mean() for one, other in pairs]
    assert 0.8 < np.mean(shared) < 1.0


def test_fewer_random_scatterers_are_the_first_of_many():
    """Worlds with few and many are paired."""
    few, many = (settings((5.0, 4.0), scenario(random_scatterers=count), 5) for count in (2, 7))
    for one, other in zip(few, many, strict=True):
        np.testing.assert_array_equal(one.scatterers_m, other.scatterers_m[:2])


def test_starts_and_scatterers_keep_their_distances():
    """Starts off walls and transponder, scatterers off both; those of the scenario come first."""
    fixed_m = [(3.0, 2.5), (2.0, 1.0)]
    for drawn in settings((5.0, 4.0), scenario(scatterers_m=fixed_m, random_scatterers=5, least_start_m=2.0), 40):
        assert math.dist(drawn.start_m, (5.0, 4.0)) > 2.0
        assert HALL.floor.boundary.distance(shapely.Point(drawn.start_m)) > ROBOT.radius_m
        np.testing.assert_array_equal(drawn.scatterers_m[:2], fixed_m)
        for scatterer_m in drawn.scatterers_m[2:]:
            assert math.dist(scatterer_m, drawn.start_m) > 0.5
            assert math.dist(scatterer_m, (5.0, 4.0)) > 0.5
        assert min(math.dist(drawn.start_m, place_m) for place_m in fixed_m) > 0.1


@pytest.mark.parametrize("name", BEARINGS)
def test_trials_of_docking_are_the_same_bits_in_blocks(name):
    """On a second run, alone or among others."""
    world = scenario(random_scatterers=5, blocks_wave=True, wall_reflection=0.3)
    estimator = registry.load("estimators", name)()
    whole = run_trials(layout((5.0, 4.0)), world, estimator, STREAMS, 0, 12)
    parts = [run_trials(layout((5.0, 4.0)), world, estimator, STREAMS, first, 4) for first in (0, 4, 8)]
    alone = run_trials(layout((5.0, 4.0)), world, estimator, STREAMS, 7, 1)
    assert whole == run_trials(layout((5.0, 4.0)), world, estimator, STREAMS, 0, 12)
    np.testing.assert_array_equal(whole.values, np.concatenate([part.values for part in parts]))
    np.testing.assert_array_equal(whole.values[7], alone.values[0])


def test_which_transponder_is_meant():
    """The only one, whatever its name, or the one of several that is named so."""
    assert docking_transponder(layout((1.0, 2.0), names=("charger",))).name == "charger"
    both = layout((1.0, 2.0), (5.0, 4.0), names=("charger", "dock"))
    assert docking_transponder(both).position_m[:2] == (5.0, 4.0)
    with pytest.raises(InvalidInput, match=r"the layout has 'east', 'west'\. Name just one of them 'dock'\."):
        docking_transponder(layout((1.0, 2.0), (5.0, 4.0), names=("east", "west")))


PILLAR = Site(name="pillar", floor=HALL.floor, obstacles=(box(2.5, 2.0, 3.5, 3.0),))


@pytest.mark.parametrize(
    ("place_m", "world", "sentence"),
    [
        ((3.0, 2.5), scenario(PILLAR), r"transponder 'dock' at \(3 m, 2.5 m\): it lies inside obstacle 1"),
        ((9.0, 2.5), scenario(), "it lies off the floor. Move it onto the floor"),
        ((3.0, 2.5), scenario(scatterers_m=[(3.05, 2.5)]), "inside scatterer 1, 50 mm off its middle"),
        ((0.1, 2.5), scenario(stop_m=0.1), "the robot's middle gets no nearer than"),
        ((3.0, 2.5), scenario(least_start_m=9.0), "no start is 9 m away"),
        ((3.0, 2.5), replace(SCENARIO, docking=None), "it says nothing of docking"),
        ((3.0, 2.5), scenario(random_scatterers=1, clearance_m=6.0), "no room for a scatterer 6 m from"),
        (
            (5.6, 4.6),
            scenario(scatterers_m=[(0.0, 0.0)], scatterer_radius_m=7.2),
            "no room for a start",
        ),
    ],
)
def test_what_no_drive_can_be_made_of_is_refused(place_m, world, sentence):
    """With the place, what is wrong and what would be right."""
    with pytest.raises(InvalidInput, match=sentence):
        run_docking_trials(layout(place_m), world, MEASURED, STREAMS, 0, 2)


def test_layouts_without_antennas_or_transponder_are_refused():
    """By the estimator, with the reason."""
    good = layout((5.0, 4.0))
    for bad, reason in (
        (good.replace(transponders=()), "it needs a transponder, and the layout has none"),
        (good.replace(readers=(replace(good.readers[0], kind="tag_read"),)), "it needs crossed antennas"),
    ):
        with pytest.raises(InvalidInput, match=reason):
            run_docking_trials(bad, SCENARIO, MEASURED, STREAMS, 0, 2)
    with pytest.raises(ValueError, match="counted from 1"):
        run_docking_trials(good, SCENARIO, MEASURED, STREAMS, 0, 0)
