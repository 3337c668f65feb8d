"""Chords of one reader's robot: what wheels say of the way along them, and how surely."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from layoutopt.estimators.reader_chord import Chord
from layoutopt.geometry import wrapped
from layoutopt.readings import Motion
from layoutopt.simulation.motion import integrate


def chord_of(increments, sigma=(0.0, 0.0, 0.0)):
    """Return the chord of a way from the origin with heading zero."""
    chord = Chord(place_m=np.zeros(2), place_m2=0.0, heading_rad=0.0, heading_rad2=0.0)
    for forward_m, left_m, turn_rad in increments:
        chord.add(Motion(forward_m=forward_m, left_m=left_m, turn_rad=turn_rad, sigma=tuple(sigma)))
    return chord


@given(st.integers(0, 2**32), st.floats(-3.0, 3.0))
def test_the_heading_at_its_end_comes_from_any_way(seed, heading_rad):
    """The chord's direction on the floor, and what wheels say of it, give the heading, however it was gone."""
    increments = np.random.default_rng(seed).normal(0.0, (0.1, 0.1, 0.5), (12, 3))
    poses = integrate((0.0, 0.0, heading_rad), increments)
    away_m = poses[-1, :2]
    chord = chord_of(increments)
    assert chord.way_m == pytest.approx(math.hypot(*away_m))
    if not chord.is_arc():
        found_rad = math.atan2(away_m[1], away_m[0]) + chord.onward_rad
        assert float(wrapped(found_rad - poses[-1, 2])) == pytest.approx(0.0, abs=1e-9)


@pytest.mark.parametrize("way_m", [0.01, -0.01])
@pytest.mark.parametrize("turn_rad", [0.004, -0.012, 0.0])
@pytest.mark.parametrize("steps", [100, 700])
def test_arcs_ahead_and_back(way_m, turn_rad, steps):
    """Of less than a whole turn and of more: half the turn leads from chord to heading, or from its back."""
    poses = integrate((0.0, 0.0, 0.2), np.tile((way_m, 0.0, turn_rad), (steps, 1)))
    chord = chord_of(np.tile((way_m, 0.0, turn_rad), (steps, 1)))
    assert chord.is_arc()
    found_rad = math.atan2(poses[-1, 1], poses[-1, 0]) + chord.onward_rad
    # A step goes straight and then turns: the chord lies half a step's turn beside that of the arc.
    assert abs(float(wrapped(found_rad - poses[-1, 2]))) <= abs(turn_rad) / 2.0 + 1e-9


@pytest.mark.parametrize(
    "way",
    [
        [(0.0, 0.01, 0.0)] * 50,
        [(0.01, 0.0, 0.0)] * 50 + [(0.0, 0.01, 0.0)] * 50,
        [(0.01, 0.0, 0.0)] * 70 + [(0.0, 0.0, 0.1)] * 8 + [(0.01, 0.0, 0.0)] * 30,
        [(0.01, 0.0, 0.01)] * 70 + [(0.01, 0.0, 0.0)] * 70,
    ],
)
def test_ways_that_are_no_arcs(way):
    """Sideways, round a corner with the heading kept, over a turn on the spot, out of a curve."""
    assert not chord_of(way).is_arc()
    assert not chord_of(way, (1e-4, 1e-4, 1e-4)).is_arc()
    # Wheels that know nothing of the turn cannot tell.
    assert chord_of(way, (1e-4, 1e-4, 1.0)).is_arc()


def test_variances_are_those_of_noisy_wheels():
    """Against 2000 noisy ways, to 15 %: sideways round a corner, and on an arc, where half the turn counts."""
    generator = np.random.default_rng(1)
    for way in (
        np.array([(0.0, 0.1, 0.05)] * 10 + [(0.1, 0.0, 0.0)] * 10),
        np.array([(0.1, 0.0, 0.05)] * 20),
    ):
        sigma = np.array((0.004, 0.002, 0.01))
        found = [
            chord_of(way + sigma * generator.standard_normal(way.shape), sigma).onward_rad for _ in range(2000)
        ]
        assert chord_of(way, sigma).onward_rad2 == pytest.approx(np.var(found), rel=0.15)


def test_lengths_by_tags_and_by_wheels_have_to_agree():
    """To half of the longer one, and what the wheels are unsure of."""
    exact, unsure = chord_of([(0.1, 0.0, 0.0)] * 10), chord_of([(0.1, 0.0, 0.0)] * 10, (0.05, 0.0, 0.0))
    assert [exact.agrees(length_m) for length_m in (0.45, 0.55, 1.95, 2.05)] == [False, True, True, False]
    assert unsure.agrees(2.05)
    assert not unsure.agrees(4.0)
    assert not chord_of([]).agrees(1.0)
