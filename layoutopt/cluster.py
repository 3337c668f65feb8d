"""Workers of a dask cluster, reached through joblib; the only code that knows of it.

joblib's own backend tells of results only, and takes the number of workers once. This one tells of every end of a
call (its worker died, the scheduler is gone, it cannot be sent), and gives work to workers that come later.
"""

import asyncio
import atexit
import contextlib
import logging
import random
import threading
import time
import uuid
from collections.abc import Callable
from concurrent.futures import BrokenExecutor, CancelledError, Future
from dataclasses import dataclass
from typing import Any, Final

from joblib import _dask

from layoutopt.errors import InvalidInput, NotInstalled, WorkerDied

_LOOK_EVERY_S: Final = 1.0
_DEATHS: Final = 2
"""Workers that may die of a call before it is taken back; dask alone would let it kill four."""
_LOGGERS: Final = (
    "distributed",
    "distributed.client",
    "distributed.core",
    "distributed.batched",
    "distributed.comm",
)

_clients: dict[str, Any] = {}


class _WorkerLost(BrokenExecutor):
    """Workers ended while they had a call, which may be why."""


def settings(scheduler: str, *, wait_s: float) -> dict[str, Any]:
    """Return the settings of `joblib.parallel_config` for the cluster whose scheduler has that address.

    Parameters
    ----------
    wait_s
        Time after which a cluster without workers is given up.

    Raises
    ------
    NotInstalled
        If dask is missing.
    InvalidInput
        If no scheduler answers at that address.
    WorkerDied
        If the scheduler answered before and does so no more.
    """
    if _dask.distributed is None:
        raise NotInstalled("--backend dask needs dask.distributed; install it with: pip install 'layoutopt[dask]'")
    return {"backend": _Cluster(scheduler, _connected(scheduler), wait_s), "n_jobs": -1}


def _connected(scheduler: str) -> Any:
    """Return the client of a scheduler, which all calls to it share, once a lost connection is made again."""
    client = _clients.get(scheduler)
    if client is None:
        client = _clients[scheduler] = _client(scheduler)
    while client.status == "connecting":  # it gives up by itself
        time.sleep(_LOOK_EVERY_S / 10)
    if client.status == "running":
        return client
    del _clients[scheduler]
    raise _gone(scheduler)


def _client(scheduler: str) -> Any:
    # What happens to the cluster is told here, once and in words; dask's lines would stand among lines of JSON.
    for name in _LOGGERS:
        logging.getLogger(name).setLevel(logging.CRITICAL)
    made: Future[Any] = Future()
    # In a thread of its own: a client that is given up while it looks for its scheduler takes a minute to close.
    threading.Thread(target=_make_client, args=(scheduler, made), daemon=True).start()
    try:
        client = made.result()
    except (OSError, ValueError) as error:
        reason = str(error).strip().partition("\n")[0]
        raise InvalidInput.at(
            f"--scheduler {scheduler}", f"no scheduler answers ({reason})", "Start one: dask scheduler."
        ) from error
    # So would what it says of its own coroutines when a connection ends under them.
    client.loop.add_callback(lambda: asyncio.get_running_loop().set_exception_handler(lambda *_: None))
    atexit.register(_close, client)
    return client


def _make_client(scheduler: str, made: "Future[Any]") -> None:
    try:
        made.set_result(_dask.Client(scheduler, set_as_default=False))
    except Exception as error:
        made.set_exception(error)


def _close(client: Any) -> None:
    with contextlib.suppress(Exception):  # it goes either way
        client.close(timeout=1)


def _gone(scheduler: str) -> WorkerDied:
    return WorkerDied(f"the scheduler {scheduler} does not answer any more; what was finished is kept")


def _reason(error: Exception) -> BaseException:
    """Return the cause where dask says at length that something cannot be pickled, or not be read over there."""
    return (type(error) in (TypeError, RuntimeError) and error.__cause__) or error


@dataclass(slots=True, kw_only=True)
class _Call:
    """A call that is out.

    Attributes
    ----------
    waiting
        The coroutine that waits for its result.
    worker
        The only worker that may have it; empty if any may.
    lives
        How many workers may still die of it.
    future
        What dask gave for it; dask tries the call again for as long as somebody holds it.
    error
        Why nobody waits for it any longer.
    """

    waiting: "asyncio.Task[None]"
    lives: int
    worker: str = ""
    future: Any = None
    error: Exception | None = None

    def lose(self) -> None:
        """Take note that a worker died while it had the call."""
        self.lives -= 1
        if not self.lives:
            self.end(_WorkerLost("a worker process died"))

    def end(self, error: Exception) -> None:
        """Wait no longer."""
        self.error = error
        self.release()
        self.waiting.cancel()

    def release(self) -> None:
        """Let dask forget it."""
        if self.future is not None:
            self.future.release()


class _Cluster(_dask.DaskDistributedBackend):  # type: ignore[misc]
    """Sends joblib's calls to the cluster. What is asynchronous runs in the thread of the client."""

    def __init__(self, scheduler: str, client: Any, wait_s: float) -> None:
        super().__init__(client=client)
        self._scheduler = scheduler
        self._wait_s = wait_s
        self._out: dict[str, _Call] = {}
        self._open = False

    def effective_n_jobs(self, n_jobs: int) -> int:
        """Return the number of threads of all workers, but at least 2: with 1 joblib would compute here.

        Raises
        ------
        WorkerDied
            If no worker comes, or the scheduler is gone.
        """
        try:
            if not self.client.ncores():
                self.client.wait_for_workers(1, timeout=self._wait_s)
            return int(max(2, sum(self.client.ncores().values())))
        except TimeoutError as error:
            raise self._without_workers() from error
        except (OSError, RuntimeError) as error:
            raise _gone(self._scheduler) from error

    def get_nested_backend(self) -> tuple[Any, int | None]:
        """Return what parallel code inside of a call would use: nothing that connects a worker to its cluster."""
        nested: tuple[Any, int | None] = super(_dask.DaskDistributedBackend, self).get_nested_backend()
        return nested

    def start_call(self) -> None:
        """Begin to watch the cluster."""
        self._out, self._open = {}, True
        self.client.subscribe_topic("all", self._hear)
        self.client.loop.add_callback(self._watch)

    def stop_call(self) -> None:
        """Watch no more."""
        self._open = False

    def abort_everything(self, ensure_ready: bool = True) -> None:
        """Take back the calls that are out."""
        self._open = False
        self.client.loop.add_callback(self._end_all, CancelledError())

    def submit(self, func: Any, callback: Callable[[Any], None] | None = None) -> "Future[Any]":
        """Send a call out; the callback gets its result, or what became of it."""
        self.client.loop.add_callback(self._call, func, callback)
        return Future()  # for joblib to keep: whatever it hears comes through the callback

    def retrieve_result_callback(self, out: Any) -> Any:
        """Return a result, or raise what became of a call."""
        if isinstance(out, BaseException):
            raise out
        return out

    async def _call(self, func: Any, callback: Callable[[Any], None]) -> None:
        try:
            alone = self.parallel.pre_dispatch == 1
            out = await (self._run_alone(func) if alone else self._run(func, lives=_DEATHS))
        except Exception as error:
            out = _reason(error)
        if self._open:
            callback(out)

    async def _run(self, func: Any, *, lives: int, pinned: bool = False) -> Any:
        """Return the result of a call; dask gives it to another worker when one ends, unless it is pinned to one.

        Raises
        ------
        _WorkerLost
            If as many workers ended as it had lives.
        ConnectionError
            If the scheduler is gone.
        """
        waiting = asyncio.current_task()
        assert waiting is not None
        key = f"layoutopt-{uuid.uuid4().hex}"
        call = self._out[key] = _Call(waiting=waiting, lives=lives)
        try:
            if pinned:
                call.worker = await self._some_worker()
            place = {"workers": [call.worker]} if call.worker else {}
            call.future = self.client.submit(func, key=key, pure=False, **place)
            return await call.future
        except asyncio.CancelledError:
            if call.error is None:
                raise
            waiting.uncancel()
            raise call.error from None
        except CancelledError:
            raise ConnectionError(f"the scheduler {self._scheduler} is gone") from None
        finally:
            del self._out[key]
            call.release()

    async def _run_alone(self, func: Any) -> Any:
        """Return the result of a call that has the cluster for itself; two workers may die of it, and no more.

        It is pinned, because dask would have sent it to the next worker before it can be taken back. The first
        death may be that of another call, which was taken back too late.
        """
        deaths = 0
        while True:
            try:
                return await self._run(func, lives=1, pinned=True)
            except _WorkerLost:
                deaths += 1
                if deaths == _DEATHS:
                    raise
            except ConnectionError:
                while self.client.status == "connecting":
                    await asyncio.sleep(_LOOK_EVERY_S)
                if self.client.status != "running":
                    raise _gone(self._scheduler) from None

    async def _workers(self) -> dict[str, int]:
        """Return the threads of each worker by its address."""
        try:
            found: dict[str, int] = await self.client.scheduler.ncores(workers=None)
        except (OSError, AttributeError) as error:  # the scheduler is None while it is looked for
            raise ConnectionError(f"the scheduler {self._scheduler} is gone") from error
        return found

    async def _some_worker(self) -> str:
        while not (workers := await self._workers()):
            await asyncio.sleep(_LOOK_EVERY_S)
        return random.choice(sorted(workers))

    async def _watch(self) -> None:
        """Give work to workers that came, and end all calls once there has been no worker for too long."""
        seen = time.monotonic()
        while True:
            await asyncio.sleep(_LOOK_EVERY_S)
            if not self._open:
                return
            try:
                workers = await self._workers()
            except ConnectionError:  # which ends the calls by itself
                continue
            if workers:
                seen = time.monotonic()
            elif time.monotonic() - seen > self._wait_s:
                self._end_all(self._without_workers())
            for call in list(self._out.values()):
                if call.worker and call.worker not in workers and call.error is None:
                    call.lose()
            for _ in range(2 * sum(workers.values()) - len(self._out)):
                if self._open and self.parallel._original_iterator is not None:  # noqa: SLF001 - nobody else knows
                    self.parallel.dispatch_next()

    def _hear(self, event: tuple[float, Any]) -> None:
        """Count the workers that ended while they had a call."""
        news = event[1]
        if isinstance(news, dict) and news.get("action") == "remove-worker" and not news.get("expected"):
            for key in news.get("processing-tasks", ()):
                if (call := self._out.get(key)) is not None and call.error is None:
                    call.lose()

    def _end_all(self, error: Exception) -> None:
        for call in list(self._out.values()):
            call.end(error)

    def _without_workers(self) -> WorkerDied:
        return WorkerDied(
            f"the scheduler {self._scheduler} has had no worker for {self._wait_s:g} s; what was finished is kept"
        )
