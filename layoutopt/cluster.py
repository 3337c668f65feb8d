"""Workers of a dask cluster, reached through joblib; the only code that knows of it."""

from collections.abc import Callable
from concurrent.futures import Future
from typing import Any

import joblib
from joblib import _dask

from layoutopt.errors import NotInstalled

_NAME = "layoutopt-dask"


def settings(scheduler: str, *, wait_s: float) -> dict[str, Any]:
    """Return the settings of `joblib.parallel_config` for the cluster whose scheduler has that address.

    Raises
    ------
    NotInstalled
        If dask is missing.
    """
    if _dask.distributed is None:
        raise NotInstalled("--backend dask needs dask.distributed; install it with: pip install 'layoutopt[dask]'")
    joblib.register_parallel_backend(_NAME, _Cluster)
    return {"backend": _NAME, "n_jobs": -1, "scheduler_host": scheduler, "wait_for_workers_timeout": wait_s}


class _Cluster(_dask.DaskDistributedBackend):  # type: ignore[misc]
    """joblib's backend, with two gaps of joblib 1.6 closed: lost calls, and clusters of one worker."""

    def submit(self, func: Any, callback: Callable[[Any], None] | None = None) -> "Future[Any]":
        """Send a call out, and tell of its failure too: joblib tells of results only, and would wait for ever."""
        future: Future[Any] = super().submit(func, callback)
        if callback is not None:
            future.add_done_callback(lambda done: callback(done) if done.exception() else None)
        return future

    def retrieve_result_callback(self, out: Any) -> Any:
        """Return a result, or raise what the cluster says of a lost call."""
        return out.result() if isinstance(out, Future) else super().retrieve_result_callback(out)

    def effective_n_jobs(self, n_jobs: int) -> int:
        """Return the number of cores, but at least 2: with 1 joblib would compute in this process."""
        return max(2, int(super().effective_n_jobs(n_jobs)))
