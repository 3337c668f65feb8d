"""What an installation can do here: versions, compiled code, processors, memory, solvers, pictures; all tried out.

Nothing is written but a file in the folder for temporary files, and nothing leaves the machine.
"""

import importlib
import os
import platform
import shutil
import sys
import tomllib
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from importlib import metadata, resources
from pathlib import Path
from typing import Any, Final

import layoutopt
from layoutopt import machine
from layoutopt.errors import LayoutoptError
from layoutopt.units import one_line

_PACKAGES: Final = ("layoutopt", "objectives", "solvers", "studies")
_GB: Final = 1e9
_PROCESS_BYTES: Final = 500_000_000
"""A worker with all packages loaded takes 0.25 GB; a floor of ten thousand square metres as much again."""
_LEAST_DISK_BYTES: Final = 1_000_000_000
"""A long study's journal has some hundred megabytes, its drawings and figures fewer."""
_LONGEST_REASON: Final = 200
_THREADS: Final = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "VECLIB_MAXIMUM_THREADS")
_CGROUP: Final = Path("/sys/fs/cgroup")


@dataclass(frozen=True, slots=True, kw_only=True)
class Check:
    """One thing that was looked at: what was found, and what to do; with nothing to do it is fine."""

    name: str
    found: str
    repair: str = ""

    @property
    def fine(self) -> bool:
        """Whether there is nothing to do."""
        return not self.repair

    @property
    def line(self) -> str:
        """The check in one line."""
        mark = "ok       " if self.fine else "look here"
        return f"{mark}  {self.name}: {self.found}" + ("" if self.fine else f". {self.repair}")

    def as_json(self) -> dict[str, object]:
        """Return the check in plain types."""
        return {"name": self.name, "ok": self.fine, "found": self.found, "repair": self.repair}


def checks(jobs: int) -> Iterator[Check]:
    """Yield every check of the installation, for studies of so many worker processes.

    A check that raises is one that says so: the others go on.
    """
    steps: tuple[tuple[str, Callable[[], Iterator[Check]]], ...] = (
        ("layoutopt", _ourselves),
        ("python", _python),
        ("packages", _packages),
        ("compiled code", _compiled),
        ("processors", lambda: _processors(jobs)),
        ("memory", lambda: _memory(jobs)),
        ("linear algebra", _linear_algebra),
        ("integer programs", _integer_programs),
        ("convex programs", _convex_programs),
        ("pictures", _pictures),
        ("files", _files),
    )
    for name, step in steps:
        try:
            yield from step()
        except Exception as error:
            reason = one_line(f"{type(error).__name__}: {error}", _LONGEST_REASON)
            repair = str(error) if isinstance(error, LayoutoptError) else "Install layoutopt anew."
            yield Check(name=name, found=f"cannot be tried ({reason})", repair=repair)


def closing_line(found: Sequence[Check]) -> str:
    """Return in one line what all checks together say, and what to do next."""
    bad = [check.name for check in found if not check.fine]
    if bad:
        return (
            f"{len(bad)} of {len(found)} checks ask for a look: {', '.join(bad)}. What to do stands behind each."
        )
    return f"all {len(found)} checks are fine; begin with: layoutopt new hall.toml --from small_hall"


def _ourselves() -> Iterator[Check]:
    place = Path(str(layoutopt.__file__)).parent
    installed = metadata.version("layoutopt")
    repair = "" if installed == layoutopt.__version__ else f"Its metadata say {installed}: install it anew."
    yield Check(name="layoutopt", found=f"{layoutopt.__version__} in {place}", repair=repair)


def _python() -> Iterator[Check]:
    found = f"{platform.python_version()} in {sys.prefix}"
    yield Check(name="python", found=found)
    yield Check(name="machine", found=f"{machine.processor()}, {platform.system()} {platform.release()}")


def _packages() -> Iterator[Check]:
    """Yield one check for all packages that are as tested, and one for each that is not."""
    from packaging.requirements import Requirement
    from packaging.utils import canonicalize_name

    tested = _tested_versions()
    wanted = [Requirement(text) for text in metadata.requires("layoutopt") or ()]
    needed = [item for item in wanted if item.marker is None or item.marker.evaluate({"extra": ""})]
    # Metadata of a checkout are as old as its installation.
    named = {canonicalize_name(item.name) for item in needed}
    needed += [Requirement(name) for name in tested if name not in named]
    same = 0
    for item in needed:
        name = canonicalize_name(item.name)
        known = tested.get(name, "")
        pinned = f"pip install '{item.name}=={known}'" if known else f"pip install '{item}'"
        try:
            version = metadata.version(name)
        except metadata.PackageNotFoundError:
            yield Check(name=name, found="is not installed", repair=f"Install it: {pinned}")
            continue
        if not item.specifier.contains(version, prereleases=True):
            yield Check(
                name=name, found=f"{version}, but {item.specifier} is needed", repair=f"Install it: {pinned}"
            )
        elif known and version != known:
            # Within what we ask for: other last digits are possible, wrong answers are not known.
            yield Check(name=name, found=f"{version}; the tests ran with {known}")
        else:
            same += 1
    yield Check(name="packages", found=f"{same} of {len(needed)} in the versions that the tests ran with")


def _tested_versions() -> dict[str, str]:
    text = (resources.files("layoutopt") / "tested_versions.toml").read_text(encoding="utf-8")
    return {str(name): str(version) for name, version in tomllib.loads(text)["packages"].items()}


def _compiled() -> Iterator[Check]:
    """Yield whether the kernels can be kept compiled, and whether they are."""
    waiting, places = [], set()
    names = list(_kernel_modules())
    for name in names:
        kernel = importlib.import_module(name)
        source = Path(str(kernel.__file__))
        stem = name.rpartition(".")[2]
        found = {
            Path(member.stats.cache_path)
            for member in vars(kernel).values()
            if isinstance(getattr(getattr(member, "stats", None), "cache_path", None), str)
        }
        places |= found
        newest = max(
            (path.stat().st_mtime for place in found for path in place.glob(f"{stem}.*.nbi")), default=0.0
        )
        if newest < source.stat().st_mtime:
            waiting.append(stem)
    barred = sorted(str(place) for place in places if place.exists() and not os.access(place, os.W_OK))
    if barred:
        repair = "Set NUMBA_CACHE_DIR to a folder of your own, or every start compiles anew."
        yield Check(name="cache of compiled code", found=f"{barred[0]} cannot be written", repair=repair)
    else:
        yield Check(name="cache of compiled code", found=f"can be written, in {len(places)} folder(s)")
    done = f"{len(names) - len(waiting)} of {len(names)} files are compiled"
    if waiting:
        done += (
            "; the first study does the rest, or now: python -c 'import studies.compiled as c; c.compile_all()'"
        )
    yield Check(name="compiled code", found=done)


def _kernel_modules() -> Iterator[str]:
    for package in _PACKAGES:
        root = Path(str(importlib.import_module(package).__file__)).parent
        for path in sorted(root.rglob("*_kernels.py")):
            yield ".".join((package, *path.relative_to(root).with_suffix("").parts))


def _processors(jobs: int) -> Iterator[Check]:
    ours, quota = machine.usable_processors(), _quota()
    found = f"{os.cpu_count()} in the machine, {ours} of them may be used"
    most = ours if quota is None else max(1, min(ours, int(quota)))
    if quota is not None and quota < ours:
        found += f", but the container gets the time of {quota:g}"
    repair = f"Give --jobs {most}: more processes only wait for each other." if jobs > most else ""
    yield Check(name="processors", found=found, repair=repair)


def _quota() -> float | None:
    """Return how many processors the container may use, ``None`` if no limit is known."""
    try:
        most, period = (_CGROUP / "cpu.max").read_text(encoding="ascii").split()
        return None if most == "max" else int(most) / int(period)
    except (OSError, ValueError):
        return None


def _memory(jobs: int) -> Iterator[Check]:
    free = _free_bytes()
    if free is None:
        yield Check(name="memory", found="how much is free is not known here")
        return
    found = f"{free / _GB:.1f} GB free"
    fitting = int(free / _PROCESS_BYTES)
    if fitting < jobs:
        repair = f"Close other programs, or give --jobs {max(1, fitting)}."
        yield Check(name="memory", found=f"{found} for {jobs} processes of up to 0.5 GB", repair=repair)
    else:
        yield Check(name="memory", found=found)


def _free_bytes() -> int | None:
    """Return what the system says is free, or what is left to the container if that is less."""
    known = []
    try:
        lines = Path("/proc/meminfo").read_text(encoding="ascii").splitlines()
        known += [int(line.split()[1]) * 1024 for line in lines if line.startswith("MemAvailable:")]
        limit = (_CGROUP / "memory.max").read_text(encoding="ascii").strip()
        used = (_CGROUP / "memory.current").read_text(encoding="ascii").strip()
        known += [] if limit == "max" else [int(limit) - int(used)]
    except (OSError, ValueError, IndexError):
        pass
    return min(known) if known else None


def _linear_algebra() -> Iterator[Check]:
    import numpy as np

    config: Any = np.show_config(mode="dicts")
    blas = config["Build Dependencies"]["blas"]
    set_here = [f"{name}={os.environ[name]}" for name in _THREADS if name in os.environ]
    threads = ", ".join(set_here) or "no limit on threads is set, and none is needed: workers limit their own"
    yield Check(name="linear algebra", found=f"{blas['name']} {blas.get('version', '')}".strip() + f"; {threads}")


def _integer_programs() -> Iterator[Check]:
    import numpy as np

    from solvers.covering.integer import cheapest_cover, missing_solver
    from solvers.covering.problem import CoverProblem, incidence

    # Three rows, each seen by two of three slots: no single slot will do, two do.
    rows = [np.array(pair) for pair in ((0, 1), (1, 2), (0, 2))]
    ones = np.ones(3, dtype=np.int64)
    missing = missing_solver()
    answer = cheapest_cover(CoverProblem(sees=incidence(rows, 3), demand=ones, cost=ones))
    right = answer.proven and answer.chosen is not None and int(answer.chosen.sum()) == 2
    if missing or not right:
        found = missing or f"a cover of three rows came out wrong ({answer.message or 'another choice'})"
        yield Check(name="integer programs", found=found, repair="Install it: pip install cvxpy highspy")
    else:
        yield Check(name="integer programs", found=f"HiGHS {metadata.version('highspy')} solved a small one")


def _convex_programs() -> Iterator[Check]:
    import numpy as np

    from layoutopt.robot import Odometry
    from solvers.antenna_slots import ReaderSlots
    from solvers.information import Merit, drift_of
    from solvers.relaxation import choose_group

    turns = np.arange(6) * np.pi / 3.0
    places = ReaderSlots(
        xy_m=0.2 * np.column_stack([np.cos(turns), np.sin(turns)]),
        side_m=0.06,
        radius_m=0.03,
        spacing_m=0.08,
        simultaneous_spacing_m=0.08,
    )
    choice = choose_group(places, 3, 25.0, Merit(criterion="D", drift=drift_of(Odometry(), 0.1, 0.3), lever_m=0.2))
    if choice.message:
        repair = "Install it: pip install cvxpy clarabel"
        yield Check(name="convex programs", found=choice.message, repair=repair)
    else:
        yield Check(name="convex programs", found=f"Clarabel {metadata.version('clarabel')} solved a small one")


def _pictures() -> Iterator[Check]:
    from layoutopt.plots.figures import as_svg, new_axes

    drawn = as_svg(new_axes(20.0, 20.0))
    backend = os.environ.get("MPLBACKEND", "")
    note = f" (MPLBACKEND={backend} is not needed)" if backend else ""
    yield Check(name="pictures", found=f"one was drawn ({len(drawn)} bytes of SVG); no display is needed{note}")


def _files() -> Iterator[Check]:
    here = Path.cwd()
    if not os.access(here, os.W_OK):
        repair = "Start from another folder, or give --out."
        yield Check(name="files", found=f"{here} cannot be written", repair=repair)
        return
    free = shutil.disk_usage(here).free
    found = f"{here} can be written, {free / _GB:.1f} GB free"
    repair = "Make room, or give an --out elsewhere." if free < _LEAST_DISK_BYTES else ""
    yield Check(name="files", found=found, repair=repair)
