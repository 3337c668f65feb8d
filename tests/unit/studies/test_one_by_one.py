"""A reader that tells one tag a scan (han2006, Fig. 3): what the estimator within is told, and when."""

import numpy as np
import pytest
from filter_worlds import antennas, by_steps, knowledge, observations

from layoutopt.estimators.one_reader import OneReader
from layoutopt.readings import UNKNOWN_TAG, Prior, Trajectory
from studies.published.one_by_one import OneByOne

PLACES_M = [(0.0, 0.0), (0.05, 0.0), (0.0, 0.05), (9.0, 9.0)]
START = Prior(pose=(0.0, 0.0, 0.0), sigma_m=0.02, sigma_rad=0.02)


class Listener:
    """An estimator that only notes what it is told."""

    name = "listener"
    key = "listener"

    def __init__(self):
        self.told = []

    def applies(self, layout):
        return "because it says so"

    def start(self, prior, known, draws):
        return self

    def step(self, motion, readings):
        self.told.append([reading.tag for reading in readings])

    def run(self, prior, known, told, draws):
        self.told = [[reading.tag for reading in readings] for _, readings in told.steps()]
        return Trajectory(poses=np.zeros((len(told), 3)))


def world(fields, period=1):
    """Return floor and antenna, and a robot at rest whose scans find these tags."""
    known = knowledge(PLACES_M, antennas(np.zeros((1, 2)), 0.1, period))
    reads = [(scan * period, 0, tag) for scan, field in enumerate(fields) for tag in field]
    still = np.zeros((len(fields) * period, 3))
    active = np.arange(len(still))[:, None] % period == 0
    return known, observations(still, still, active, reads)


def told(fields, period=1):
    """Return what the estimator within is told in each scan, the same in a run and step by step."""
    known, seen = world(fields, period)
    in_a_run, by_step = Listener(), Listener()
    OneByOne(inner=in_a_run).run(START, known, seen, None)
    by_steps(OneByOne(inner=by_step), START, known, seen, 0)
    assert in_a_run.told == by_step.told
    assert all(not tags for step, tags in enumerate(in_a_run.told) if step % period)
    return in_a_run.told[::period]


@pytest.mark.parametrize("period", [1, 2, 5])
def test_a_field_is_told_tag_by_tag_and_then_anew(period):
    """However many steps lie between two scans; a scan without a new tag ends the round."""
    assert told([(0, 1, 2)] * 9, period) == [[0], [1], [2], [], [0], [1], [2], [], [0]]


def test_tags_that_come_into_view_are_told_in_the_same_round():
    """And those that left it no more."""
    assert told([(0, 1), (1, 2), (2,), (2,), (2,)]) == [[0], [1], [2], [], [2]]


@pytest.mark.parametrize("period", [1, 3])
def test_no_scan_is_spent_on_an_unknown_identity(period):
    """A tag that is not on the map is not told, and a field that holds no other is read empty."""
    fields = [(UNKNOWN_TAG, 1), (UNKNOWN_TAG, 1), (UNKNOWN_TAG, 1), (UNKNOWN_TAG,), (1,)]
    assert told(fields, period) == [[1], [], [1], [], [1]]


@pytest.mark.parametrize("period", [1, 4])
def test_the_place_follows_when_the_round_ends(period):
    """Midrange of all tags of the field, as if they had been read at once."""
    known, seen = world([(0, 1, 2)] * 8, period)
    single = OneByOne(inner=OneReader(gathering="one_by_one", compensation="none"))
    poses = single.run(Prior(pose=(0.3, 0.3, 0.0), sigma_m=0.1, sigma_rad=0.1), known, seen, None).poses
    assert [tuple(pose) for pose in poses[: 3 * period, :2]] == [(0.3, 0.3)] * (3 * period)
    np.testing.assert_allclose(poses[3 * period :, :2], np.tile((0.025, 0.025), (5 * period, 1)))


def test_it_passes_for_the_estimator_within():
    """In name, and in which layouts it works with; equal ones have one key."""
    outer = OneByOne(inner=Listener())
    assert outer.name == "listener"
    assert outer.applies(None) == "because it says so"
    single = OneReader(gathering="one_by_one")
    assert OneByOne(inner=single) == OneByOne(inner=single)
    assert OneByOne(inner=single) != OneByOne(inner=OneReader())
