"""Workers: results whoever computes them, and what happens when a call kills, hangs, raises or eats all memory."""

import itertools
import os
import resource
import signal
import threading
import time
from pathlib import Path

import pytest

from layoutopt.errors import FailureKind, NotANumber, WorkerDied
from layoutopt.stopping import StopRequest
from layoutopt.workers import Backend, Lost, Workers


def double(item):
    return 2 * item


def kill_at_three(item):
    if item == 3:
        os.kill(os.getpid(), signal.SIGKILL)
    return 2 * item


def kill_once(item):
    """Kill the worker the first time, told by a file."""
    number, folder = item
    if number == 3 and not (Path(folder) / "killed").exists():
        (Path(folder) / "killed").touch()
        os.kill(os.getpid(), signal.SIGKILL)
    return 2 * number


def hang_at_two(item):
    while item == 2:
        time.sleep(0.01)
    return 2 * item


def spin_at_two(item):
    while item == 2:
        pass
    return 2 * item


def raise_at_one(item):
    if item == 1:
        raise KeyError("no such tag")
    if item == 2:
        raise NotANumber("the pose is none")
    return 2 * item


def eat_memory_at_one(item):
    if item == 1:
        limit = resource.getrlimit(resource.RLIMIT_AS)
        resource.setrlimit(resource.RLIMIT_AS, (512 * 2**20, limit[1]))
        try:
            bytearray(2**30)
        finally:
            resource.setrlimit(resource.RLIMIT_AS, limit)
    return 2 * item


def count_alone(item):
    """Find too little memory as long as another call runs beside this one."""
    number, folder = item
    mark = Path(folder) / f"{number}"
    if number == 1 and not mark.exists():
        mark.touch()
        raise MemoryError
    return 2 * number


def always_killed(item):
    os.kill(os.getpid(), signal.SIGKILL)


def own_process(item):
    time.sleep(0.05)
    return os.getpid()


def time_span(item):
    began = time.monotonic()
    time.sleep(0.02)
    return began, time.monotonic(), os.getpid()


def _loky(**settings):
    return Workers(Backend.LOKY, **{"jobs": 2, **settings})


def _sorted(workers, function, items):
    return [result for _, result in sorted(workers.map(function, items), key=lambda entry: entry[0])]


@pytest.mark.parametrize("jobs", [1, 2])
def test_results_come_with_their_numbers(jobs):
    """Every item has its result once, whoever computed it."""
    assert _sorted(_loky(jobs=jobs), double, range(50)) == [2 * item for item in range(50)]
    assert _sorted(Workers(), double, range(50)) == [2 * item for item in range(50)]


def test_one_job_still_has_a_process_of_its_own():
    """With one job nothing is computed here, and never two things at once."""
    spans = sorted(_sorted(_loky(jobs=1), time_span, range(8)))
    assert os.getpid() not in {process for *_, process in spans}
    assert all(end <= begin for (_, end, _), (begin, *_) in itertools.pairwise(spans))


@pytest.mark.parametrize("jobs", [1, 2])
def test_a_call_that_kills_two_workers_is_lost_and_the_rest_goes_on(jobs):
    """Item 3 kills its worker in the pool and again alone; all others have their results."""
    notes = []
    found = _sorted(_loky(jobs=jobs, note=notes.append), kill_at_three, range(12))
    assert found[3].kind is FailureKind.KILLED
    assert "two workers" in found[3].message
    assert [result for number, result in enumerate(found) if number != 3] == [
        2 * item for item in range(12) if item != 3
    ]
    assert any("a worker process died" in note for note in notes)


def test_a_death_is_told_from_hanging_however_long_new_workers_take():
    """A call that takes more than the longest time to reach its worker, and kills it, counts as one that kills."""
    (found,) = _sorted(_loky(longest_s=0.4), kill_at_three, [SlowToArrive()])
    assert found.kind is FailureKind.KILLED


class SlowToArrive:
    """The number 3, which takes its time to be unpacked."""

    def __reduce__(self):
        return (arrive, ())


def arrive():
    time.sleep(0.5)
    return 3


def test_a_worker_killed_once_costs_nothing(tmp_path):
    """A call whose worker was killed from outside is called again and has its result."""
    found = _sorted(_loky(), kill_once, [(number, str(tmp_path)) for number in range(12)])
    assert found == [2 * item for item in range(12)]
    assert (tmp_path / "killed").exists()


@pytest.mark.parametrize("function", [hang_at_two, spin_at_two])
def test_a_call_that_never_ends_is_lost_and_the_rest_goes_on(function, capfd):
    """The worker ends itself after the longest time, twice; the call counts as hung."""
    found = _sorted(_loky(longest_s=1.0), function, range(8))
    assert found[2].kind is FailureKind.HUNG
    assert [result for number, result in enumerate(found) if number != 2] == [
        2 * item for item in range(8) if item != 2
    ]
    assert "Timeout" in capfd.readouterr().err


def test_what_raises_is_a_value_with_its_kind():
    """An error comes back with its message and place, and stops nothing else; so it is in this process."""
    for workers in (_loky(), Workers()):
        found = _sorted(workers, raise_at_one, range(4))
        assert (found[0], found[3]) == (0, 6)
        assert found[1].kind is FailureKind.RAISED
        assert found[1].message.startswith("KeyError: 'no such tag' (in raise_at_one, line ")
        assert found[2].kind is FailureKind.NOT_A_NUMBER


def test_a_call_without_memory_is_tried_alone_and_then_lost():
    """Too little memory even alone is a failure of that kind."""
    found = _sorted(_loky(), eat_memory_at_one, range(6))
    assert found[1].kind is FailureKind.MEMORY
    assert [result for number, result in enumerate(found) if number != 1] == [0, 4, 6, 8, 10]


def test_a_call_that_finds_memory_alone_has_its_result(tmp_path):
    """Too little memory beside others is no failure if there is enough alone."""
    found = _sorted(_loky(), count_alone, [(number, str(tmp_path)) for number in range(6)])
    assert found == [2 * item for item in range(6)]


def test_calls_that_all_kill_are_all_lost():
    """Where every call kills its worker but workers can be had, each is told of and the map ends."""
    found = _sorted(_loky(), always_killed, range(5))
    assert [result.kind for result in found] == [FailureKind.KILLED] * 5


def test_without_any_worker_the_map_ends_with_an_error(monkeypatch):
    """If not even a call that does nothing gets an answer, it is not the calls that are at fault."""
    monkeypatch.setattr("layoutopt.workers._nothing", always_killed)
    with pytest.raises(WorkerDied, match="no worker can be kept alive"):
        _sorted(_loky(), always_killed, range(5))


def test_what_cannot_be_sent_is_lost():
    """An item that cannot be pickled is told of; the others have their results."""
    found = _sorted(_loky(), str, [1, threading.Lock(), 2])
    assert found[0] == "1"
    assert found[2] == "2"
    assert isinstance(found[1], Lost)
    assert found[1].kind is FailureKind.NOT_SENT


@pytest.mark.parametrize("backend", [Backend.SERIAL, Backend.LOKY])
def test_a_stop_finishes_what_is_under_way_and_begins_nothing(backend):
    """After the request no further batch goes out, and what came until then is whole."""
    stop = StopRequest()
    found = []
    for number, _ in Workers(backend, jobs=2, stop=stop).map(own_process, range(400)):
        found.append(number)
        if len(found) == 5:
            stop.ask()
    assert 5 <= len(found) < 100
    assert len(set(found)) == len(found)


def test_workers_leave_the_keyboard_alone():
    """A Ctrl-C reaches the whole group of a terminal, but only the parent decides."""
    assert _sorted(_loky(), interrupt_oneself, range(4)) == [0, 1, 2, 3]


def interrupt_oneself(item):
    os.kill(os.getpid(), signal.SIGINT)
    os.kill(os.getpid(), signal.SIGTERM)
    time.sleep(0.01)
    return item


def test_who_leaves_early_leaves_no_warning(recwarn):
    """Whoever closes the map early, as a full disk does, gets no warning of joblib's, and the pool works again."""
    results = _loky().map(own_process, range(100))
    next(results)
    results.close()
    assert not list(recwarn)
    assert _sorted(_loky(), double, range(4)) == [0, 2, 4, 6]
