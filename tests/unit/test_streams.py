"""Random streams: the same for the same key, independent otherwise.

Statistics are computed at fixed seeds; a limit is set so that a sound generator would fail one of all the
comparisons of this file together with a chance below 1 in 1000.
"""

import itertools

import numpy as np
import pytest
from scipy import stats

from layoutopt.streams import Purpose, Streams

FALSE_ALARM = 1e-3 / 4
"""Chance of a false alarm of each of the four statistical tests."""


def first_numbers(count, *, seed=7, scenario="design", replication=0, purpose=Purpose.ROUTE):
    """Return the beginning of a stream."""
    return Streams(seed=seed).generator(scenario, replication, purpose).random(count)


def test_a_stream_begins_anew_each_time():
    """Whoever asks for a stream, and how often, gets the same numbers."""
    assert np.array_equal(first_numbers(100), first_numbers(100))


def test_any_other_key_is_another_stream():
    """Seed, scenario, replication and purpose each change the stream, and no two of many streams are equal."""
    keys = itertools.product((7, 8), ("design", "held-out"), (0, 1, 2, 2**31), Purpose)
    begins = [first_numbers(2, seed=a, scenario=b, replication=c, purpose=d) for a, b, c, d in keys]
    assert len({tuple(begin) for begin in begins}) == len(begins) == 2 * 2 * 4 * len(Purpose)


def test_a_purpose_keeps_its_number():
    """The number of a purpose is part of every stream ever published: it never changes."""
    assert {purpose.name: int(purpose) for purpose in Purpose} == {
        "ROUTE": 1,
        "ODOMETRY": 2,
        "SENSING": 3,
        "TAG_FAULTS": 4,
        "FILTER": 6,
        "START": 7,
        "GYRO": 8,
        "SLIP": 9,
        "ASYNCHRONY": 10,
    }


def test_the_numbers_themselves_do_not_change():
    """The first numbers of one stream, written down: a change would silently change every study."""
    expected = [0.6275703144063138, 0.15863805004909692, 0.6206696530359491]
    assert first_numbers(3).tolist() == expected


def test_a_negative_replication_is_refused():
    """Replications count from zero."""
    with pytest.raises(ValueError, match="negative"):
        first_numbers(1, replication=-1)


def test_first_numbers_of_many_replications_are_uniform():
    """The first number over 5000 replications is uniform (Kolmogorov-Smirnov)."""
    first = [first_numbers(1, replication=number)[0] for number in range(5000)]
    assert stats.kstest(first, "uniform").pvalue > FALSE_ALARM


def test_neighbouring_replications_are_uncorrelated():
    """The first number of a replication says nothing of that of the next (pairs in 10 × 10 cells, chi square)."""
    first = np.array([first_numbers(1, replication=number)[0] for number in range(5001)])
    table, _, _ = np.histogram2d(first[:-1], first[1:], bins=10, range=[[0, 1], [0, 1]])
    assert stats.chisquare(table.ravel()).pvalue > FALSE_ALARM


@pytest.mark.parametrize("what", ["replication", "purpose"])
def test_streams_are_independent(what):
    """Long pieces of up to eight streams that differ in one word of the key are uncorrelated, pair by pair."""
    count = 20000
    if what == "replication":
        pieces = [first_numbers(count, replication=number) for number in range(8)]
    else:
        pieces = [first_numbers(count, purpose=purpose) for purpose in Purpose]
    correlation = np.corrcoef(pieces)[np.triu_indices(len(pieces), 1)]
    limit = stats.norm.isf(FALSE_ALARM / 2 / len(correlation)) / np.sqrt(count)
    assert np.abs(correlation).max() < limit
