"""What the numbers of a run may depend on besides its spec: versions, processor, system."""

import os
import platform
from collections.abc import Mapping
from functools import lru_cache
from importlib import metadata
from pathlib import Path
from typing import Final

import layoutopt

_PACKAGES: Final = ("numpy", "scipy", "numba", "llvmlite", "shapely", "joblib")


@lru_cache(maxsize=1)
def processor() -> str:
    """Return the name of the processor, as exactly as the system tells it."""
    cpuinfo = Path("/proc/cpuinfo")
    if cpuinfo.exists():
        for line in cpuinfo.read_text(encoding="utf-8", errors="replace").splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    return platform.processor() or platform.machine()


def usable_processors() -> int:
    """Return how many processors are ours: those that the system lets this process use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def environment() -> dict[str, object]:
    """Return versions, processor and system: where two runs agree in these, their tables agree to the last bit."""
    return {
        "layoutopt": layoutopt.__version__,
        "python": platform.python_version(),
        "processor": processor(),
        "system": platform.system(),
        "packages": {name: metadata.version(name) for name in _PACKAGES},
    }


def versions_text() -> str:
    """Return the versions of layoutopt, Python and the packages that numbers depend on, in words."""
    told = environment()
    packages = told["packages"]
    assert isinstance(packages, Mapping)
    parts = {"layoutopt": told["layoutopt"], "Python": told["python"], **packages}
    return ", ".join(f"{name} {version}" for name, version in parts.items())


def changes(before: Mapping[str, object], now: Mapping[str, object]) -> list[str]:
    """Return in words what differs between two environments.

    >>> changes({"python": "3.11", "packages": {"numpy": "2.4"}}, {"python": "3.11", "packages": {"numpy": "2.5"}})
    ['numpy 2.4, now 2.5']
    """
    found = []
    for name, value in now.items():
        old = before.get(name)
        if isinstance(value, Mapping):
            found += changes(old if isinstance(old, Mapping) else {}, value)
        elif old != value:
            found.append(f"{name} {old or 'not recorded'}, now {value}")
    return found
