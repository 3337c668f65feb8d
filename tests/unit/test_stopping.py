"""Requests to end: by whom, by when, and what signals make of themselves."""

import os
import signal

import pytest

from layoutopt import stopping
from layoutopt.stopping import StopReason, StopRequest, asked_by_signals

SIGNALS = (signal.SIGINT, signal.SIGTERM)


class Clock:
    """Both clocks of the system, each to be set."""

    def __init__(self):
        self.steady = 100.0

    def monotonic(self):
        return self.steady

    def time(self):
        raise AssertionError("a clock that can be set decides nothing")


@pytest.fixture
def clock(monkeypatch):
    """A clock in place of the system's."""
    clock = Clock()
    monkeypatch.setattr(stopping, "time", clock)
    return clock


def test_without_a_request_work_goes_on(clock):
    """Nobody asked and no time was set: there is no reason, ever."""
    stop = StopRequest()
    clock.steady += 1e12
    assert not stop()
    assert stop.reason is StopReason.NONE
    assert not stop.reason


def test_who_asks_is_heard():
    """After the request there is a reason, and asking again changes nothing."""
    stop = StopRequest()
    for _ in range(2):
        stop.ask()
        assert stop()
        assert stop.reason is StopReason.ASKED


def test_the_time_limit_counts_from_the_beginning(clock):
    """At the limit work still goes on, beyond it no more."""
    stop = StopRequest(time_limit_s=60.0)
    clock.steady += 60.0
    assert not stop()
    clock.steady += 0.001
    assert stop()
    assert stop.reason is StopReason.TIME


def test_a_request_counts_more_than_the_time(clock):
    """Who asked after the time was over gets the exit code of a request."""
    stop = StopRequest(time_limit_s=1.0)
    clock.steady += 2.0
    stop.ask()
    assert stop.reason is StopReason.ASKED


def test_the_limit_has_words():
    """The limit is told as people read times."""
    assert StopRequest(time_limit_s=5400.0).limit_text == "90 min"


@pytest.mark.parametrize("first", SIGNALS)
@pytest.mark.parametrize("second", SIGNALS)
def test_the_first_signal_asks_and_the_second_ends(first, second):
    """One message for the first signal, KeyboardInterrupt for the second, whichever they are."""
    stop, said = StopRequest(), []
    with asked_by_signals(stop, said.append):
        os.kill(os.getpid(), first)
        assert stop.reason is StopReason.ASKED
        with pytest.raises(KeyboardInterrupt):
            os.kill(os.getpid(), second)
    assert len(said) == 1
    assert "once more stops at once" in said[0]


def test_the_first_signal_after_the_time_limit_only_asks(clock):
    """A study that is ending by its limit is not torn away by the first Ctrl-C."""
    stop, said = StopRequest(time_limit_s=1.0), []
    clock.steady += 2.0
    with asked_by_signals(stop, said.append):
        os.kill(os.getpid(), signal.SIGINT)
    assert stop.reason is StopReason.ASKED
    assert len(said) == 1


def test_signals_are_given_back():
    """Afterwards, error or not, signals do what they did before."""
    before = [signal.getsignal(number) for number in SIGNALS]
    with asked_by_signals(StopRequest(), print):
        assert [signal.getsignal(number) for number in SIGNALS] != before
    assert [signal.getsignal(number) for number in SIGNALS] == before
    with pytest.raises(ZeroDivisionError), asked_by_signals(StopRequest(), print):
        raise ZeroDivisionError
    assert [signal.getsignal(number) for number in SIGNALS] == before


def test_a_signal_amid_a_line_still_asks():
    """Where nothing can be said, because a line is being written, the request counts all the same."""

    def amid_a_line(text):
        raise RuntimeError("reentrant call inside <_io.BufferedWriter name='<stderr>'>")

    stop = StopRequest()
    with asked_by_signals(stop, amid_a_line):
        os.kill(os.getpid(), signal.SIGTERM)
        assert stop()
