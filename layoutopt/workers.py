"""Processes that compute, here or on a cluster, and what is done when one of them dies.

A call that kills its worker, never ends or wants more memory than there is must not take other results with it.
So whatever was under way when a worker died is called again, one call at a time, and what kills its worker then as
well is `Lost`; the rest goes on. Results depend neither on the number of workers nor on what happened to them.
"""

import contextlib
import faulthandler
import math
import os
import re
import signal
import sys
import threading
import time
import traceback
import warnings
from collections import deque
from collections.abc import Callable, Generator, Iterable, Iterator, Sequence
from concurrent.futures import BrokenExecutor
from dataclasses import dataclass
from enum import StrEnum, unique
from typing import Any, Final, Generic, TypeVar

from layoutopt.errors import FailureKind, LayoutoptError, NotANumber, WorkerDied
from layoutopt.machine import processor

_Item = TypeVar("_Item")
_Result = TypeVar("_Result")

BATCH_S: Final = 0.5
"""Calls go out in batches of about so much work, so that sending them costs next to nothing."""
LONGEST_S: Final = 900.0
"""A call that takes longer is taken for one that never ends."""
_MOST_CALLS_A_BATCH: Final = 256
_IDLE_S: Final = 60
_ORPHAN_CHECK_S: Final = 2.0
_LOST_BEFORE_PROBE: Final = 3
_CLUSTER_WAIT_S: Final = 60
_SIGNALLED: Final = re.compile(r"SIG[A-Z0-9]+\(-[0-9]+\)")
"""What loky says of a worker that a signal ended."""


@unique
class Backend(StrEnum):
    """Who computes: this process, processes on this machine, or a cluster whose scheduler has an address."""

    SERIAL = "serial"
    LOKY = "loky"
    DASK = "dask"


@dataclass(frozen=True, slots=True, kw_only=True)
class Lost:
    """A call without a result, and why there is none."""

    kind: FailureKind
    message: str


def _never() -> bool:
    return False


def _unheard(text: str) -> None:
    """Take a note that nobody reads."""


class Workers:
    """Computes calls of a function, whatever happens to the processes that do it.

    Parameters
    ----------
    jobs
        Processes of `Backend.LOKY`. With one there is still a process beside this one, so that it may die.
    scheduler
        Address of the cluster's scheduler, for `Backend.DASK`.
    longest_s
        Time after which a call counts as hung. `Backend.SERIAL` has nobody who could watch.
    stop
        Asked before every batch: once it says yes, those under way are finished and no other is begun.
    note
        Takes what a user should know: a worker died, processors differ.
    """

    def __init__(
        self,
        backend: Backend = Backend.SERIAL,
        *,
        jobs: int = 1,
        scheduler: str = "",
        longest_s: float = LONGEST_S,
        stop: Callable[[], bool] = _never,
        note: Callable[[str], None] = _unheard,
    ) -> None:
        self.backend = backend
        self.jobs = 1 if backend is Backend.SERIAL else jobs
        self.stop = stop
        self._scheduler = scheduler
        self._longest_s = longest_s
        self._note = note
        self._seconds, self._calls = 0.0, 0
        self._processors: set[str] = set()

    def map(
        self, function: Callable[[_Item], _Result], items: Sequence[_Item]
    ) -> Generator[tuple[int, _Result | Lost], None, None]:
        """Yield the number and the result of each item, as they come; what a stop leaves out is not yielded.

        ``function`` belongs to a module, or is a partial of such a one, so that it can be sent to a process.

        Raises
        ------
        WorkerDied
            If not even a call that does nothing gets an answer.
        """
        if self.backend is Backend.SERIAL:
            for number, item in enumerate(items):
                if self.stop():
                    return
                yield number, _called(function, item)
            return
        waiting = deque(enumerate(items))
        while waiting and not self.stop():
            flight = _Flight(waiting, self._batch_size, self.stop)
            try:
                for results in self._parallel(function, flight.batches(), ahead=2):
                    yield from flight.landed(results)
            except LayoutoptError:  # there is no cluster to be had
                raise
            except Exception as error:  # a death, joblib and a cluster's network have no error in common
                self._note(f"{_said(error)}: what was under way is run again, one task at a time")
            yield from self._one_by_one(function, flight.close())

    def _one_by_one(
        self, function: Callable[[_Item], _Result], calls: Iterable[tuple[int, _Item]]
    ) -> Iterator[tuple[int, _Result | Lost]]:
        """Yield the results of calls of which one may have killed a worker, each alone in the pool."""
        lost_in_a_row = 0
        for number, item in calls:
            if self.stop():
                return
            result = self._alone(function, number, item)
            lost_in_a_row = lost_in_a_row + 1 if isinstance(result, Lost) else 0
            if lost_in_a_row and lost_in_a_row % _LOST_BEFORE_PROBE == 0:
                self._probe()
            yield number, result

    def _alone(self, function: Callable[[_Item], _Result], number: int, item: _Item) -> _Result | Lost:
        call = ((number, item),)
        began = time.monotonic()
        try:
            ((_, result),) = [one for results in self._parallel(function, [call], ahead=0) for one in results]
        except LayoutoptError:
            raise
        except Exception as error:  # as in `map`: now it is known which call it was
            # The time holds that of starting new workers; one that a signal ended did not end itself as hung.
            if time.monotonic() - began >= self._longest_s and not _SIGNALLED.search(str(error)):
                return Lost(kind=FailureKind.HUNG, message=f"took longer than {self._longest_s:g} s, twice")
            if _is_death(error):
                return Lost(kind=FailureKind.KILLED, message=f"killed two workers ({_said(error)})")
            return Lost(kind=FailureKind.NOT_SENT, message=f"{type(error).__name__}: {error}")
        return result

    def _probe(self) -> None:
        """Find out whether it is the calls that fail, or whether there are no workers to be had."""
        try:
            list(self._parallel(_nothing, [((0, 0),)], ahead=0))
        except LayoutoptError:
            raise
        except Exception as error:
            raise WorkerDied(f"no worker can be kept alive ({_said(error)}); what was finished is kept") from error

    def _parallel(
        self,
        function: Callable[[_Item], _Result],
        batches: Iterable[Sequence[tuple[int, _Item]]],
        *,
        ahead: int,
    ) -> Iterator[list[tuple[int, _Result | Lost]]]:
        """Yield the results of each batch as it comes; ``ahead`` of them a worker are out, 0 is one in all."""
        import joblib

        with joblib.parallel_config(**self._settings()):
            alone = ahead == 0 or (self.backend is Backend.LOKY and self.jobs == 1)
            parallel = joblib.Parallel(
                return_as="generator_unordered",
                batch_size=1,
                pre_dispatch=1 if alone else f"{ahead} * n_jobs",
                # Large arrays would otherwise go through files, outside of the study folder.
                max_nbytes=None,
            )
            if self.backend is Backend.DASK:
                self.jobs = joblib.effective_n_jobs()
        call = joblib.delayed(_batch_called)
        answers = parallel(call(function, batch, self._longest_s) for batch in batches)
        try:
            for answer in answers:
                self._learn(answer)
                yield answer.results
        finally:
            with warnings.catch_warnings():
                # Who leaves early, with a full disk or a second Ctrl-C, knows what is lost.
                warnings.simplefilter("ignore", UserWarning)
                answers.close()

    def _settings(self) -> dict[str, Any]:
        if self.backend is Backend.DASK:
            from layoutopt import cluster

            return cluster.settings(self._scheduler, wait_s=_CLUSTER_WAIT_S)
        from layoutopt import processes

        # With one process joblib would compute in this one; of two, one waits while the other works.
        return processes.settings(max(2, self.jobs), idle_s=_IDLE_S, initializer=_settle)

    def _batch_size(self, waiting: int) -> int:
        """Return how many calls go out together: half a second of work, less when few are left to share."""
        if not self._calls:
            return 1
        by_time = math.ceil(BATCH_S / max(self._seconds / self._calls, 1e-6))
        return max(1, min(by_time, _MOST_CALLS_A_BATCH, waiting // (2 * self.jobs)))

    def _learn(self, answer: "_Answer") -> None:
        self._seconds += answer.seconds
        self._calls += len(answer.results)
        if answer.processor not in self._processors:
            self._processors.add(answer.processor)
            if len(self._processors) > 1:
                names = ", ".join(sorted(self._processors))
                self._note(f"workers have different processors ({names}): the last bits of results may differ")


class _Flight(Generic[_Item]):
    """The calls that are out with workers. Batches are taken by joblib's threads, hence the lock."""

    def __init__(
        self, waiting: deque[tuple[int, _Item]], size: Callable[[int], int], stop: Callable[[], bool]
    ) -> None:
        self._waiting = waiting
        self._size = size
        self._stop = stop
        self._out: dict[int, _Item] = {}
        self._open = True
        self._lock = threading.Lock()

    def batches(self) -> Iterator[tuple[tuple[int, _Item], ...]]:
        """Yield batch by batch of what waits, until it is empty, a stop is asked for, or the flight is closed."""
        while not self._stop():
            with self._lock:
                if not self._waiting or not self._open:
                    return
                size = self._size(len(self._waiting))
                batch = tuple(self._waiting.popleft() for _ in range(min(size, len(self._waiting))))
                self._out.update(batch)
            yield batch

    def landed(self, results: Iterable[tuple[int, _Result | Lost]]) -> Iterator[tuple[int, _Result | Lost]]:
        """Yield the results that count; a call that found too little memory stays out, to be tried alone."""
        for number, result in results:
            if isinstance(result, Lost) and result.kind is FailureKind.MEMORY:
                continue
            with self._lock:
                del self._out[number]
            yield number, result

    def close(self) -> tuple[tuple[int, _Item], ...]:
        """Let no further batch out, and return the calls that have no result."""
        with self._lock:
            self._open = False
            return tuple(self._out.items())


@dataclass(frozen=True, slots=True, kw_only=True)
class _Answer:
    """What a worker sends back for a batch."""

    results: list[tuple[int, Any]]
    seconds: float
    processor: str


def _batch_called(
    function: Callable[[_Item], _Result], batch: Sequence[tuple[int, _Item]], longest_s: float
) -> _Answer:
    """Call a function for each item of a batch: this runs in the worker."""
    began = time.perf_counter()
    results = []
    for number, item in batch:
        with _watched(longest_s):
            results.append((number, _called(function, item)))
    return _Answer(results=results, seconds=time.perf_counter() - began, processor=processor())


def _called(function: Callable[[_Item], _Result], item: _Item) -> _Result | Lost:
    """Return the result, or what the function raised as a value, so that one bad call stops nothing else."""
    try:
        return function(item)
    except MemoryError as error:
        return Lost(kind=FailureKind.MEMORY, message=f"MemoryError: {error}".rstrip(": "))
    except Exception as error:
        if isinstance(error.__cause__, KeyboardInterrupt):
            raise error.__cause__ from error  # compiled code hides the key that was pressed meanwhile
        where = traceback.extract_tb(error.__traceback__)[-1]
        kind = FailureKind.NOT_A_NUMBER if isinstance(error, NotANumber) else FailureKind.RAISED
        text = f"{type(error).__name__}: {error} (in {where.name}, line {where.lineno})"
        return Lost(kind=kind, message=text)


def _nothing(item: int) -> int:
    return item


def _settle(parent: int) -> None:
    """Make a worker leave the keyboard to its parent, and go when the parent is gone."""
    signal.signal(signal.SIGINT, signal.SIG_IGN)
    signal.signal(signal.SIGTERM, signal.SIG_IGN)
    threading.Thread(target=_go_with, args=(parent,), daemon=True).start()


def _go_with(parent: int) -> None:
    while os.getppid() == parent:
        time.sleep(_ORPHAN_CHECK_S)
    os._exit(1)


_deadlines: dict[int, float] = {}
_deadlines_lock = threading.Lock()


@contextlib.contextmanager
def _watched(longest_s: float) -> Iterator[None]:
    """End this process, with a note of where it was, if what runs within takes too long.

    The watch is a thread of faulthandler's that needs no interpreter, so it also ends what hangs in compiled code.
    There is one for the process, and a cluster's worker may run several calls: the earliest deadline counts.
    """
    token = threading.get_ident()
    with _deadlines_lock:
        _deadlines[token] = time.monotonic() + longest_s
        _watch()
    try:
        yield
    finally:
        with _deadlines_lock:
            del _deadlines[token]
            _watch()


def _watch() -> None:
    if not _deadlines:
        faulthandler.cancel_dump_traceback_later()
    elif sys.__stderr__ is not None:
        left_s = max(min(_deadlines.values()) - time.monotonic(), 1e-3)
        faulthandler.dump_traceback_later(left_s, exit=True, file=sys.__stderr__)


def _is_death(error: Exception) -> bool:
    """Whether an error says that a worker process ended; a cluster's own kind is known by its name only."""
    return isinstance(error, BrokenExecutor) or type(error).__name__ == "KilledWorker"


def _said(error: Exception) -> str:
    """Return an error in few words; what loky says of a death takes a paragraph."""
    if _is_death(error):
        return "a worker process died"
    first = str(error).strip().partition("\n")[0]
    return f"{type(error).__name__}: {first}" if first else type(error).__name__
