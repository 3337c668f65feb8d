"""What docking robots follow: the row of three of the correction, candidates of the filter, a bumper's memory."""

import itertools
import math
from dataclasses import replace

import numpy as np
import pytest
import shapely
from docking_cases import HALL, KNOWLEDGE, readings, scenario
from docking_cases import layout as docking_layout
from shapely.geometry import box

from layoutopt.estimators.bearing_bumper import BearingAroundStops
from layoutopt.estimators.bearing_filter import FilteredBearing, candidates_on
from layoutopt.estimators.bearings import BearingKnowledge
from layoutopt.estimators.direction_corrected import DirectionCorrected
from layoutopt.estimators.direction_of_arrival import correct_direction
from layoutopt.simulation.docking_trials import run_docking_trials
from layoutopt.site import Site
from layoutopt.streams import Streams

DRAWS = np.random.Generator(np.random.Philox(31))


def disturbed(steps):
    """Readings with wrong bearings and strengths, and turns between them."""
    told = []
    for one in readings(steps=steps, drives=4):
        told.append(
            replace(
                one,
                headings_rad=one.headings_rad + DRAWS.uniform(-0.5, 0.5, 4),
                bearings_rad=one.bearings_rad + DRAWS.uniform(-0.5, 0.5, 4),
                strength_range_m=one.true_range_m * DRAWS.uniform(0.8, 1.25, 4),
            )
        )
    return told


@pytest.mark.parametrize("source", ["strength", "true"])
def test_the_correction_is_that_of_the_last_three_readings(source):
    """The published function, called with what the drive was told."""
    told = disturbed(6)
    running = DirectionCorrected(range_source=source).start(KNOWLEDGE, 4)
    found = [running.step(one) for one in told]
    for step in (0, 1):
        np.testing.assert_array_equal(found[step], told[step].bearings_rad)
    for step in range(2, 6):
        three = told[step - 2 : step + 1]
        ranges_m = [getattr(one, f"{source}_range_m") for one in three]
        turns_rad = [later.headings_rad - one.headings_rad for one, later in itertools.pairwise(three)]
        expected = correct_direction(
            np.stack([one.bearings_rad - one.headings_rad for one in three], axis=1),
            np.stack(ranges_m, axis=1),
            np.stack([one.moved_m for one in three[1:]], axis=1),
            np.stack(turns_rad, axis=1),
        )
        np.testing.assert_array_equal(found[step], told[step].bearings_rad + expected.error_rad)


def test_a_silent_step_begins_the_three_anew():
    """The robot keeps its heading there, and two readings after it are not corrected."""
    told = disturbed(9)
    told[3] = replace(told[3], heard=np.array([False, True, True, True]))
    running, undisturbed = (DirectionCorrected().start(KNOWLEDGE, 4) for _ in range(2))
    plain = [replace(one, heard=np.ones(4, dtype=np.bool_)) for one in told]
    found = [running.step(one) for one in told]
    whole = [undisturbed.step(one) for one in plain]
    assert found[3][0] == told[3].headings_rad[0]
    assert found[4][0] == told[4].bearings_rad[0]
    assert found[5][0] == told[5].bearings_rad[0]
    assert found[6][0] == whole[6][0]
    for one, other in zip(found, whole, strict=True):
        np.testing.assert_array_equal(one[1:], other[1:])


def test_an_unknown_source_of_ranges_is_refused():
    """With those that there are."""
    with pytest.raises(ValueError, match="one of strength, true, not 'sonar'"):
        DirectionCorrected(range_source="sonar")


def test_candidates_lie_on_the_floor_and_not_on_its_bounds():
    """Of a hall bent round a corner none lies in the corner; of a rectangle the border counts."""
    bent = HALL.floor.difference(box(3.0, 2.0, 6.0, 5.0))
    places_m = candidates_on(bent)
    assert shapely.intersects_xy(bent, places_m[:, 0], places_m[:, 1]).all()
    assert len(places_m) == pytest.approx(bent.area / 0.04, rel=0.15)
    assert candidates_on(HALL.floor).min(axis=0).tolist() == [0.0, 0.0]
    assert candidates_on(HALL.floor).max(axis=0).tolist() == [6.0, 5.0]


def test_a_large_floor_has_wider_candidates():
    """As many on a hall of 100 m as memory and time allow."""
    assert 3500 < len(candidates_on(box(0.0, 0.0, 100.0, 60.0))) < 4500


def test_a_filter_that_hears_no_more_follows_what_it_heard():
    """Its answer turns with the place, not with the heading."""
    running = FilteredBearing().start(KNOWLEDGE, 4)
    told = readings(steps=14, drives=4)
    for step, one in enumerate(told):
        found = running.step(one if step < 10 else replace(one, heard=np.zeros(4, dtype=np.bool_)))
    # The last reading was not given: its bearing is the true one.
    assert np.abs(found - told[-1].bearings_rad).max() < math.radians(15.0)


def test_a_stop_bars_the_way_and_nothing_else():
    """Stopped on its bearing a robot is sent aside by as little as passes the disc, and on when it has passed."""
    settings = BearingAroundStops(thing_radius_m=0.15, ahead_m=1.0)
    running, plain = settings.start(KNOWLEDGE, 4), FilteredBearing().start(KNOWLEDGE, 4)
    told = readings(steps=2, drives=4)
    first = running.step(told[0])
    np.testing.assert_array_equal(first, plain.step(told[0]))
    met = replace(told[0], headings_rad=first, moved_m=np.zeros(4), stopped=np.array([True, True, False, False]))
    aside, straight = running.step(met), plain.step(met)
    np.testing.assert_array_equal(aside[2:], straight[2:])
    # From the edge of a disc, only headings a right angle or more off its middle are free.
    turn = np.abs(aside[:2] - straight[:2])
    assert (turn >= math.pi / 2.0 - 1e-9).all()
    assert (turn <= math.pi / 2.0 + math.radians(10.0)).all()
    beyond = replace(met, places_m=met.places_m + 0.5 * np.stack([np.cos(first), np.sin(first)], axis=1))
    beyond = replace(beyond, stopped=np.zeros(4, dtype=np.bool_))
    np.testing.assert_array_equal(running.step(beyond), plain.step(beyond))


def test_a_bumper_leads_round_a_wall():
    """A wall of 3.5 m that leaves one end free, no rule of detours: only the memory of stops gets round it."""
    walled = Site(name="walled", floor=HALL.floor, obstacles=(box(2.9, 0.0, 3.1, 3.5),))
    world = scenario(walled, detour=False, start_m=(1.0, 2.0), steps=60)
    shares = [
        run_docking_trials(docking_layout((5.0, 2.0)), world, estimator, Streams(seed=3), 0, 20)
        .column("docking_success")
        .mean()
        for estimator in (FilteredBearing(), BearingAroundStops())
    ]
    assert shares[0] == 0.0
    assert shares[1] > 0.4


@pytest.mark.parametrize("settings", [{"thing_radius_m": 0.0}, {"ahead_m": math.inf}, {"ahead_m": math.nan}])
def test_a_memory_of_no_size_is_refused(settings):
    """By name."""
    with pytest.raises(ValueError, match=next(iter(settings))):
        BearingAroundStops(**settings)


def test_a_floor_without_room_for_candidates_is_refused():
    """The filter would have nothing to believe in."""
    diamond = shapely.Polygon([(0.05, 0.0), (0.0, 0.05), (-0.05, 0.0), (0.0, -0.05)])
    assert len(candidates_on(diamond)) == 0
    with pytest.raises(ValueError, match="rows of x and y"):
        FilteredBearing().start(BearingKnowledge(floor=diamond), 1)
