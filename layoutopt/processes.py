"""Workers on this machine, through joblib, which take no module from the folder in which they are started."""

import os
from collections.abc import Callable
from typing import Any, Final

import joblib
from joblib._parallel_backends import LokyBackend
from joblib.externals.loky.backend import resource_tracker

_NAME: Final = "layoutopt-loky"
_SAFE_PATH: Final = "PYTHONSAFEPATH"


def settings(jobs: int, *, idle_s: int, initializer: Callable[[int], None]) -> dict[str, Any]:
    """Return the settings of `joblib.parallel_config` for so many processes.

    Parameters
    ----------
    idle_s
        Time after which a process that has nothing to do goes.
    initializer
        Called in each process with the number of this one.
    """
    joblib.register_parallel_backend(_NAME, _Processes)
    _start_tracker()
    return {
        "backend": _NAME,
        "n_jobs": jobs,
        "idle_worker_timeout": idle_s,
        "initializer": initializer,
        "initargs": (os.getpid(),),
    }


class _Processes(LokyBackend):  # type: ignore[misc]
    """joblib's backend with a safe path for the Python that it starts, and for that alone."""

    def _prepare_worker_env(self, n_jobs: int) -> dict[str, str]:
        return {**super()._prepare_worker_env(n_jobs), _SAFE_PATH: "1"}


def _start_tracker() -> None:
    """Start loky's own helper process with a safe path; it has no other way to get one than from this process."""
    before = os.environ.get(_SAFE_PATH)
    os.environ[_SAFE_PATH] = "1"
    try:
        resource_tracker.ensure_running()
    finally:
        if before is None:
            del os.environ[_SAFE_PATH]
        else:
            os.environ[_SAFE_PATH] = before
