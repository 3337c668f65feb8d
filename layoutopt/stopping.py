"""Asking long work to end early, by key, by clock or from elsewhere; whoever works asks whether it should."""

import math
import signal
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from enum import StrEnum, unique
from types import FrameType

from layoutopt.units import format_duration


@unique
class StopReason(StrEnum):
    """Why work ended early."""

    NONE = ""
    ASKED = "asked"
    TIME = "time limit"
    TRIALS = "trial limit"


class StopRequest:
    """Whether to begin no more work: true once somebody asked for it, or the time is over.

    The time is that of a clock that nobody can set, so that a clock that jumps ends nothing.
    """

    def __init__(self, *, time_limit_s: float = math.inf) -> None:
        self.time_limit_s = time_limit_s
        self._began = time.monotonic()
        self._asked = False

    def ask(self) -> None:
        """Ask for the end."""
        self._asked = True

    def __call__(self) -> bool:
        """Return whether to begin no more work."""
        return self.reason is not StopReason.NONE

    @property
    def reason(self) -> StopReason:
        """Why to stop."""
        if self._asked:
            return StopReason.ASKED
        return StopReason.TIME if time.monotonic() - self._began > self.time_limit_s else StopReason.NONE

    @property
    def limit_text(self) -> str:
        """The time limit in words."""
        return format_duration(self.time_limit_s)


@contextmanager
def asked_by_signals(stop: StopRequest, say: Callable[[str], None]) -> Iterator[None]:
    """Turn the first Ctrl-C, or a request of the system to end, into a request to stop; the next one ends at once.

    For the command line only: a library leaves signals to the program that it is part of.
    """

    def handle(number: int, frame: FrameType | None) -> None:
        if stop.reason is StopReason.ASKED:
            raise KeyboardInterrupt
        stop.ask()
        # The signal may have come amid a line that is being written, which no other line may interrupt.
        with suppress(RuntimeError):
            say("stopping: what is under way is finished and written; once more stops at once")

    numbers = (signal.SIGINT, signal.SIGTERM)
    before = [signal.signal(number, handle) for number in numbers]
    try:
        yield
    finally:
        for number, handler in zip(numbers, before, strict=True):
            signal.signal(number, handler)
