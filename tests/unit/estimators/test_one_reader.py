"""One reader (han2006): places from sets of tags, orientation from arcs, gathering, compensation."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from reader_worlds import AHEAD, driven, grid_m, one_antenna

from layoutopt.estimators.instant_centre import initial_orientation, instant_centre, travelling_orientation
from layoutopt.estimators.one_reader import OneReader, RunningOneReader
from layoutopt.estimators.one_reader_centroid import OneReaderCentroid
from layoutopt.estimators.one_reader_minimax import OneReaderMinimax
from layoutopt.estimators.reader_place import ReaderPlace, centroid_m, midrange_m
from layoutopt.geometry import wrapped
from layoutopt.readings import Motion, Prior, TagRead

RADIUS_M = 0.125
STILL = Motion(forward_m=0.0, left_m=0.0, turn_rad=0.0, sigma=(1e-6, 1e-6, 1e-6))


def knowledge(pitch_m=0.1, count=21):
    """Return a floor of tags on a square about the origin, and one antenna in the robot's middle."""
    return one_antenna(grid_m(pitch_m, (count - 1) / 2.0 * pitch_m), RADIUS_M)


def reads_at(floor, place_m):
    """Return what the antenna reads at a place."""
    near = np.flatnonzero(np.hypot(*(floor.tags.xy_m - place_m).T) < RADIUS_M)
    return tuple(TagRead(time_s=0.0, antenna=0, tag=int(tag)) for tag in near)


def test_midrange_and_centroid():
    """Eq. 9 and 10 look at the extremes alone."""
    tags_m = np.array([(0.0, 0.0), (0.1, 0.0), (0.2, 0.0), (0.1, 0.1)])
    np.testing.assert_allclose(midrange_m(tags_m), (0.1, 0.05))
    np.testing.assert_allclose(centroid_m(tags_m), (0.1, 0.025))


@given(st.integers(0, 2**32))
def test_no_place_is_farther_from_the_minimax_than_its_circle(seed):
    """And its variance covers the true error of every estimator on average."""
    floor = knowledge()
    place_m = np.random.Generator(np.random.Philox(seed)).uniform(-0.3, 0.3, 2)
    tags = frozenset(read.tag for read in reads_at(floor, place_m))
    estimate_m, variance_m2 = ReaderPlace(floor, "minimax").of(tags)
    assert math.dist(estimate_m, place_m) <= 2.0 * math.sqrt(variance_m2) * (1.0 + 1e-9)
    for kind in ("midrange", "centroid"):
        assert ReaderPlace(floor, kind).of(tags)[1] >= variance_m2 * (1.0 - 1e-12)


def test_reads_that_contradict_the_map_leave_the_whole_disc_open():
    """Silent tags that should have been read do not count; tags too far apart give their middle."""
    floor = knowledge()
    row = [int(np.flatnonzero((floor.tags.xy_m == (x, 0.0)).all(axis=1))[0]) for x in (-0.1, 0.1)]
    place_m, variance_m2 = ReaderPlace(floor, "minimax").of(frozenset(row))
    assert place_m == pytest.approx((0.0, 0.0), abs=1e-9)
    far = frozenset({0, len(floor.tags) - 1})
    place_m, variance_m2 = ReaderPlace(floor, "minimax").of(far)
    assert place_m == pytest.approx((0.0, 0.0), abs=1e-9)
    assert variance_m2 == RADIUS_M**2 / 4.0


@given(st.floats(-3.0, 3.0), st.floats(0.2, 3.0), st.floats(-3.0, 3.0).filter(lambda angle: abs(angle) > 0.01))
def test_orientation_on_an_arc(heading_rad, radius_m, rotation_rad):
    """Eq. 4-8: the centre, and the heading at the end, of an arc to either side; twice the angle of the chord."""
    side = math.copysign(1.0, rotation_rad)
    normal = side * np.array([-math.sin(heading_rad), math.cos(heading_rad)])
    centre_m = np.array([0.3, -0.2]) + radius_m * normal
    turn = np.array(
        [[math.cos(rotation_rad), -math.sin(rotation_rad)], [math.sin(rotation_rad), math.cos(rotation_rad)]]
    )
    end_m = centre_m + turn @ (np.array([0.3, -0.2]) - centre_m)
    start = (0.3, -0.2, heading_rad)
    np.testing.assert_allclose(instant_centre(start, end_m), centre_m, atol=1e-6 * (1.0 + radius_m))
    found_rad = travelling_orientation(start, end_m)
    assert float(wrapped(found_rad - heading_rad - rotation_rad)) == pytest.approx(0.0, abs=1e-6)
    chord_rad = initial_orientation(np.array(start[:2]), end_m)
    assert float(wrapped(2.0 * chord_rad - heading_rad - found_rad)) == pytest.approx(0.0, abs=1e-6)


def test_a_straight_way_has_no_centre():
    """And keeps its heading."""
    assert instant_centre((0.0, 0.0, 0.5), np.array([math.cos(0.5), math.sin(0.5)])) is None
    assert travelling_orientation((0.0, 0.0, 0.0), np.array([2.0, 0.0])) == 0.0
    with pytest.raises(ValueError, match="no direction"):
        initial_orientation(np.zeros(2), np.zeros(2))


def running(settings, floor, sigma_m=0.02):
    """Return an estimator that stands at the origin."""
    return RunningOneReader(settings, Prior(pose=(0.0, 0.0, 0.0), sigma_m=sigma_m, sigma_rad=0.02), floor)


def test_tags_read_one_by_one_are_gathered_first():
    """Fig. 3: the place follows when a scan brings nothing new."""
    floor, place_m = knowledge(), np.array([0.03, 0.01])
    reads = reads_at(floor, place_m)
    estimator = running(OneReader(gathering="one_by_one", compensation="none"), floor)
    for read in reads:
        assert estimator.step(STILL, (read,)).values[:2] == (0.0, 0.0)
    tags_m = floor.tags.xy_m[[read.tag for read in reads]]
    assert estimator.step(STILL, ()).values[:2] == pytest.approx(tuple(midrange_m(tags_m)))


def test_a_gain_moves_by_its_part():
    """Eq. 24 and Fig. 11: predicted place and a fixed part of the way to the measured one."""
    floor, place_m = knowledge(), np.array([0.06, 0.02])
    reads = reads_at(floor, place_m)
    measured_m = midrange_m(floor.tags.xy_m[[read.tag for read in reads]])
    estimator = running(OneReader(gain=0.25), floor)
    assert estimator.step(STILL, reads).values[:2] == pytest.approx(tuple(0.25 * measured_m))
    assert estimator.step(STILL, reads).values[:2] == pytest.approx(tuple((1.0 - 0.75**2) * measured_m))


def test_by_variances_a_set_counts_once():
    """What is read again at rest brings nothing new."""
    floor, place_m = knowledge(), np.array([0.06, 0.02])
    reads = reads_at(floor, place_m)
    estimator = running(OneReaderMinimax(), floor)
    first = estimator.step(STILL, reads).values
    assert first[:2] != (0.0, 0.0)
    assert estimator.step(STILL, reads).values == pytest.approx(first)


@pytest.mark.parametrize("settings", [OneReader(), OneReaderCentroid(), OneReaderMinimax()])
def test_an_unknown_heading_is_found_on_the_first_chord(settings):
    """Initial orientation, Eq. 1-3: within some degrees after a metre straight ahead at 30 degrees."""
    floor = knowledge(count=41)
    angle = math.radians(30.0)
    way = np.array([math.cos(angle), math.sin(angle)])
    prior = Prior(pose=(0.0, 0.0, 0.0), sigma_m=math.inf, sigma_rad=math.inf)
    estimator = RunningOneReader(settings, prior, floor)
    ahead = Motion(forward_m=0.01, left_m=0.0, turn_rad=0.0, sigma=(1e-4, 1e-4, 1e-4))
    for step in range(120):
        answer = estimator.step(ahead, reads_at(floor, 0.01 * (step + 1) * way))
    assert abs(math.degrees(answer.values[2]) - 30.0) < 6.0
    assert math.dist(answer.values[:2], 1.2 * way) < 0.05


@pytest.mark.parametrize("settings", [OneReader(), OneReaderCentroid(), OneReaderMinimax()])
def test_a_place_is_unsure_while_the_heading_is(settings):
    """After 1.5 m in an unknown direction the first tags decide where the robot is, and way back home few."""
    known = one_antenna([(0.0, 1.5)], RADIUS_M)
    steps = [AHEAD] * 150
    lost = Prior(pose=(0.0, 0.0, 0.0), sigma_m=0.02, sigma_rad=math.inf)
    _, seen = driven(known, (0.0, 0.0, math.pi / 2.0), steps)
    running = RunningOneReader(replace(settings, compensation="variance"), lost, known)
    answers = [running.step(motion, reads) for motion, reads in seen.steps()]
    assert answers[136].values[:2] == pytest.approx((1.37, 0.0))
    assert answers[-1].values[:2] == pytest.approx((0.0, 1.5), abs=0.15)
    there = RunningOneReader(settings, lost, knowledge())
    for forward_m in (0.01, -0.01):
        for _ in range(100):
            there.step(Motion(forward_m=forward_m, left_m=0.0, turn_rad=0.0, sigma=(0.0, 0.0, 0.0)), ())
        expected_m2 = 0.02**2 + (1.0 if forward_m > 0.0 else 0.0)
        assert there._place_m2 == pytest.approx(expected_m2)


def test_by_variances_a_set_counts_again_after_a_gap():
    """A tag comes back into view after a blind stretch, on which the wheels went wrong."""
    floor = one_antenna([(0.0, 0.0), (50.0, 50.0)])
    prior = Prior(pose=(0.0, 0.0, 0.0), sigma_m=0.02, sigma_rad=0.02)
    estimator = RunningOneReader(OneReaderMinimax(), prior, floor)
    tag = (TagRead(time_s=0.0, antenna=0, tag=0),)

    def step(forward_m, reads=()):
        return estimator.step(Motion(forward_m=forward_m, left_m=0.0, turn_rad=0.0, sigma=(0.01,) * 3), reads)

    step(0.0, tag)
    for forward_m in (0.1, -0.11):
        for _ in range(40):
            step(forward_m)
    lost_m = step(0.0).values[0]
    assert lost_m == pytest.approx(-0.4, abs=0.05)
    found_m = step(0.0, tag).values[0]
    assert abs(found_m) < 0.2 * abs(lost_m)
    assert step(0.0, tag).values[0] == found_m


def test_steps_between_scans_say_nothing():
    """An antenna that scans in every third step: in between its silence ends neither a set of tags nor a stay."""
    floor, place_m = one_antenna(grid_m(0.1, 1.0), RADIUS_M, period=3), np.array([0.03, 0.01])
    reads = reads_at(floor, place_m)
    single = running(OneReader(gathering="one_by_one", compensation="none"), floor)
    tags_m = floor.tags.xy_m[[read.tag for read in reads]]
    for told in (*((read,) for read in reads), ()):
        before = [single.step(STILL, told), single.step(STILL, ()), single.step(STILL, ())]
        assert len({answer.values for answer in before}) == 1
        assert before[0].values[:2] == (pytest.approx(tuple(midrange_m(tags_m))) if not told else (0.0, 0.0))
    at_once = running(OneReaderMinimax(), floor)
    first = at_once.step(STILL, reads).values
    for _ in range(2):
        at_once.step(STILL, ())
    assert at_once.step(STILL, reads).values == pytest.approx(first)


def test_what_is_known_exactly_does_not_move(monkeypatch):
    """A start without any doubt, beside tags that leave one place alone, which is another."""
    monkeypatch.setattr(ReaderPlace, "of", lambda self, tags: (np.array([0.1, 0.0]), 0.0))
    exact = Prior(pose=(0.0, 0.0, 0.0), sigma_m=0.0, sigma_rad=0.0)
    still = Motion(forward_m=0.0, left_m=0.0, turn_rad=0.0, sigma=(0.0, 0.0, 0.0))
    reads = (TagRead(time_s=0.0, antenna=0, tag=0),)
    assert RunningOneReader(OneReaderMinimax(), exact, knowledge()).step(still, reads).values == (0.0, 0.0, 0.0)


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"gathering": "later"}, "gathering is one of at_once, one_by_one"),
        ({"compensation": "all"}, "compensation is one of"),
        ({"orientation": "compass"}, "orientation is one of"),
        ({"gain": 0.0}, "a gain must be above 0"),
        ({"baseline_m": -1.0}, "a baseline must be positive"),
    ],
)
def test_wrong_settings_are_named(settings, message):
    """Each with what would be right."""
    with pytest.raises(ValueError, match=message):
        OneReader(**settings)
