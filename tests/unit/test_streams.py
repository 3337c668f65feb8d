"""Random streams: the same for the same key, whoever asks; statistics are in `test_stream_independence`."""

import itertools
import os
import subprocess
import sys
from concurrent.futures import ThreadPoolExecutor

import numpy as np
import pytest

from layoutopt.streams import Purpose, Streams


def first_numbers(count, *, seed=7, scenario="design", replication=0, purpose=Purpose.ROUTE):
    """Return the beginning of a stream."""
    return Streams(seed=seed).generator(scenario, replication, purpose).random(count)


def test_a_stream_begins_anew_each_time():
    """Whoever asks for a stream, and how often, gets the same numbers."""
    assert np.array_equal(first_numbers(100), first_numbers(100))


def test_neither_order_nor_other_streams_matter():
    """Streams asked for in any order, drawn from in turn or by several threads, give what each gives alone."""
    keys = list(itertools.product(("design", "held-out"), range(6), Purpose))
    alone = {key: Streams(seed=7).generator(*key).random(6) for key in keys}
    order = np.random.Generator(np.random.Philox(3)).permutation(len(keys))
    streams = Streams(seed=7)
    opened = {keys[place]: streams.generator(*keys[place]) for place in order}
    in_turn = {key: [] for key in keys}
    for _ in range(3):
        for place in order[::-1]:
            in_turn[keys[place]] += opened[keys[place]].random(2).tolist()
    with ThreadPoolExecutor(4) as threads:
        of_threads = dict(zip(keys, threads.map(lambda key: streams.generator(*key).random(6), keys), strict=True))
    for key in keys:
        assert in_turn[key] == alone[key].tolist() == of_threads[key].tolist()


def test_another_process_gets_the_same_stream():
    """A worker with its own hash seed and a used-up global generator draws the same numbers."""
    program = (
        "import numpy as np\n"
        "from layoutopt.streams import Purpose, Streams\n"
        "np.random.seed(1)\n"
        "np.random.random(100)\n"
        "print(Streams(seed=7).generator('design', 3, Purpose.GYRO).random(4).tolist())"
    )
    told = {
        subprocess.run(
            [sys.executable, "-c", program],
            env={**os.environ, "PYTHONHASHSEED": seed},
            capture_output=True,
            text=True,
            check=True,
        ).stdout.strip()
        for seed in ("1", "2")
    }
    assert told == {str(first_numbers(4, replication=3, purpose=Purpose.GYRO).tolist())}


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
        "TARGET": 11,
        "SIGNAL": 12,
        "LASER": 13,
        "CLUTTER": 14,
        "DOCKING": 15,
        "SCATTERERS": 16,
    }


def test_the_numbers_themselves_do_not_change():
    """The first numbers of one stream, written down: a change would silently change every study."""
    expected = [0.6275703144063138, 0.15863805004909692, 0.6206696530359491]
    assert first_numbers(3).tolist() == expected


def test_a_negative_replication_is_refused():
    """Replications count from zero."""
    with pytest.raises(ValueError, match="negative"):
        first_numbers(1, replication=-1)
