"""What a running study tells: the tally, its snapshot in words and in JSON, and those who listen."""

import json
import math

import numpy as np
import pytest

from layoutopt import progress
from layoutopt.errors import FailureKind
from layoutopt.progress import Silent, Tally, Together
from layoutopt.protocols import Evaluation, Failure, Group
from layoutopt.scores import TrialOutcomes

GROUP = Group("layout", "scenario", "estimator", "settings")


class Clock:
    """A clock that cannot be set, for a test to advance."""

    def __init__(self):
        self.now = 1000.0

    def monotonic(self):
        return self.now


@pytest.fixture
def clock(monkeypatch):
    """A clock in place of the system's."""
    clock = Clock()
    monkeypatch.setattr(progress, "time", clock)
    return clock


def _done(trials):
    outcomes = TrialOutcomes(replications=np.arange(trials), columns=("nees",), values=np.zeros((trials, 1)))
    return Evaluation(group=GROUP, first=0, outcomes=outcomes, seconds=0.1)


def _failed(kind=FailureKind.RAISED):
    return Failure(group=GROUP, first=0, message="no", kind=kind)


def test_before_anything_is_done_nothing_is_predicted(clock):
    """A new tally and a new round know neither rate nor time left, and say so by null."""
    tally = Tally()
    for _ in range(2):
        snapshot = tally.snapshot
        assert math.isnan(snapshot.trials_per_s)
        assert math.isnan(snapshot.left_s)
        assert snapshot.as_json()["trials_per_s"] is None
        assert snapshot.as_json()["left_s"] is None
        assert snapshot.rate_text == snapshot.failures_text == snapshot.best == ""
        tally.round("search", 4, 40)
    assert tally.snapshot.text == "search: 0 of 40 trials"


def test_rate_and_time_left_are_those_of_the_round(clock):
    """Ten trials in five seconds leave thirty for fifteen; a new round counts anew, but not the trials of all."""
    tally = Tally()
    tally.round("search", 4, 40)
    clock.now += 5.0
    tally.result(_done(10))
    snapshot = tally.snapshot
    assert (snapshot.trials_per_s, snapshot.left_s) == (2.0, 15.0)
    assert snapshot.text == "search: 10 of 40 trials, 2 trials/s, 15 s left in this round"
    tally.round("held-out", 1, 20)
    clock.now += 1.0
    tally.result(_done(20))
    snapshot = tally.snapshot
    assert (snapshot.round, snapshot.rounds) == ("held-out", 2)
    assert (snapshot.trials, snapshot.trials_done, snapshot.trials_run) == (20, 20, 30)
    assert (snapshot.trials_per_s, snapshot.left_s) == (20.0, 0.0)


def test_failed_tasks_count_as_done_but_not_as_run(clock):
    """A failed task counts with the mean of its round, and the last task completes it."""
    tally = Tally()
    tally.round("search", 3, 20)
    tally.result(_failed())
    assert tally.snapshot.trials_done == 7
    tally.result(_done(2))
    tally.result(_failed())
    snapshot = tally.snapshot
    assert snapshot.trials_done == 20
    assert snapshot.trials_run == 2


def test_trials_done_never_exceed_those_of_the_round(clock):
    """Whatever the tasks turn out to hold, no more than all is done."""
    tally = Tally()
    tally.round("search", 3, 4)
    tally.result(_done(9))
    assert tally.snapshot.trials_done == 4
    assert Tally().snapshot.trials_done == 0


def test_failures_are_told_by_kind(clock):
    """Kinds are counted over all rounds and told in a fixed order."""
    tally = Tally()
    tally.round("search", 9, 9)
    for kind in (FailureKind.HUNG, FailureKind.MEMORY, FailureKind.HUNG):
        tally.result(_failed(kind))
    tally.round("held-out", 9, 9)
    tally.result(_failed(FailureKind.KILLED))
    snapshot = tally.snapshot
    assert snapshot.failures == {"killed its worker": 1, "never ended": 2, "out of memory": 1}
    assert snapshot.failures_text == "failed tasks: 1 killed its worker, 2 never ended, 1 out of memory"
    assert snapshot.failures_text in snapshot.text


def test_the_best_answer_stays_until_there_is_a_better_one(clock):
    """A round without an answer does not take the last one away."""
    tally = Tally()
    tally.best("")
    assert tally.snapshot.best == ""
    tally.best("598.25 EUR")
    tally.best("")
    assert tally.snapshot.best == "598.25 EUR"
    assert tally.snapshot.text.endswith("598.25 EUR")


def test_a_snapshot_is_strict_json(clock):
    """Every field is there by name, without a number that JSON does not know."""
    tally = Tally()
    tally.round("search", 2, 2)
    tally.result(_failed())
    tally.note("heard by nobody")
    text = json.dumps(tally.snapshot.as_json(), allow_nan=False)
    assert json.loads(text) == {
        "round": "search",
        "rounds": 1,
        "trials": 2,
        "trials_done": 1,
        "trials_run": 0,
        "trials_per_s": None,
        "left_s": None,
        "failures": {"raised an error": 1},
        "best": "",
    }


def test_all_who_listen_hear_everything_in_order():
    """What is told to all together reaches each of them, in the order in which it was told."""

    class Listener:
        def __init__(self):
            self.heard = []

        def __getattr__(self, name):
            return lambda *told: self.heard.append((name, *told))

    listeners = [Listener(), Listener()]
    done = _done(1)
    for watched in (Together(*listeners), Silent(), Together()):
        watched.round("search", 1, 2)
        watched.result(done)
        watched.best("cheap")
        watched.note("a worker died")
    expected = [("round", "search", 1, 2), ("result", done), ("best", "cheap"), ("note", "a worker died")]
    assert [listener.heard for listener in listeners] == [expected, expected]
