"""How a study stands, for whoever looks at its folder from outside; read by ``layoutopt status``.

``status.json`` is written by the run, for looking only. Nothing is computed from it, and a folder without it is as
good.
"""

import json
import os
import shlex
import socket
import time
from collections import Counter
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import filelock

from layoutopt.atomic_file import plain_bytes, replacing
from layoutopt.errors import StudyDamaged
from layoutopt.journal import (
    JOURNAL,
    LARGEST_JSON,
    LOCK,
    LONGEST_SHOWN,
    MANIFEST,
    SHARDS,
    read_manifest,
    read_recorded,
    refuse_links,
)
from layoutopt.progress import Tally
from layoutopt.protocols import Evaluation, Failure
from layoutopt.units import format_duration, one_line

try:
    import fcntl
except ImportError:  # Windows
    fcntl = None  # type: ignore[assignment]

STATUS: Final = "status.json"
RUNNING: Final = "running"
FINISHED: Final = "finished"
STOPPED: Final = "stopped"
SILENT: Final = "ended without a word"
SHARDED: Final = "in shards"
_EVERY_S: Final = 1.0
_TEXTS: Final = ("state", "host", "round", "best")
_NUMBERS: Final = (
    "process",
    "began",
    "written",
    "rounds",
    "trials",
    "trials_done",
    "trials_run",
    "trials_per_s",
    "left_s",
)
_LARGEST_NUMBER: Final = 1e15


class StatusFile:
    """Progress that keeps ``status.json`` of a folder up to date, at most once a second.

    Parameters
    ----------
    go_on
        The command that goes on with the study after it ended early.
    """

    def __init__(self, folder: Path, *, go_on: str) -> None:
        self._path = folder / STATUS
        self._go_on = go_on
        self._tally = Tally()
        self._written = -_EVERY_S
        self._began = time.time()

    def round(self, name: str, tasks: int, trials: int) -> None:
        """Write that a round begins."""
        self._tally.round(name, tasks, trials)
        self._write(RUNNING)

    def result(self, evaluation: Evaluation | Failure) -> None:
        """Count a finished task, and write at times."""
        self._tally.result(evaluation)
        if time.monotonic() - self._written >= _EVERY_S:
            self._write(RUNNING)

    def best(self, text: str) -> None:
        """Keep the best answer so far for the next time."""
        self._tally.best(text)

    def note(self, text: str) -> None:
        """Take no note: whoever watches the run is told."""

    def end(self, state: str) -> None:
        """Write how the run ended."""
        self._write(state)

    def _write(self, state: str) -> None:
        self._written = time.monotonic()
        facts = {
            "state": state,
            "host": socket.gethostname(),
            "process": os.getpid(),
            "began": self._began,
            "written": time.time(),
            "go_on": self._go_on,
            **self._tally.snapshot.as_json(),
        }
        # A disk without room stops the journal, which says so; a glance at the study is not worth stopping for.
        try:
            with replacing(self._path) as temporary:
                temporary.write_text(json.dumps(facts, indent=2) + "\n", encoding="utf-8")
        except OSError:
            return


@dataclass(frozen=True, slots=True, kw_only=True)
class FolderStatus:
    """How the study of a folder stands, from its journal and from what its last run said.

    Attributes
    ----------
    state
        ``"running"``, ``"finished"``, ``"stopped"``, ``"ended without a word"`` as after a kill, or, while a round
        is run in shards or waits for a merge, ``"in shards"``.
    tasks, trials, failures
        Finished tasks of the journal, their trials, and tasks that failed by kind.
    last
        What the last run said of itself; empty if it said nothing.
    shards
        The same of each shard, by name.
    """

    folder: Path
    study: str
    seed: int
    state: str
    tasks: int
    trials: int
    failures: Mapping[str, int]
    last: Mapping[str, Any]
    shards: "Mapping[str, FolderStatus]"

    def as_json(self) -> dict[str, object]:
        """Return the status in plain types."""
        return {
            "folder": str(self.folder),
            "study": self.study,
            "seed": self.seed,
            "state": self.state,
            "tasks": self.tasks,
            "trials": self.trials,
            "failures": dict(self.failures),
            "last": dict(self.last),
            "shards": {name: shard.as_json() for name, shard in self.shards.items()},
        }

    def lines(self) -> list[str]:
        """Return the status in words."""
        from studies.page import REPORT

        lines = [
            f"{self.folder}: study {self.study}, seed {self.seed}: {self.state}",
            f"  journal: {self.tasks} tasks, {self.trials} trials{_failed(self.failures)}",
        ]
        if self.last:
            lines += [f"  {line}" for line in _last_lines(self.last, running=self.state == RUNNING)]
        if self.state == FINISHED and (self.folder / REPORT).exists():
            lines.append(f"  report: {self.folder / REPORT}")
        if self.go_on:
            lines.append(f"  go on with: {self.go_on}")
        for name, shard in self.shards.items():
            counts = f"{shard.tasks} tasks, {shard.trials} trials{_failed(shard.failures)}"
            lines.append(f"  shard {name}: {shard.state}, {counts}")
            if shard.go_on:
                lines.append(f"    go on with: {shard.go_on}")
        if self.state == SHARDED:
            lines.append(f"  when no shard is left to run: {merge_command(self.folder)}")
        return lines

    @property
    def go_on(self) -> str:
        """The command that goes on with it; empty where none is needed or known."""
        return str(self.last.get("go_on", "")) if self.state in (STOPPED, SILENT) else ""


def merge_command(folder: Path) -> str:
    """Return the command that merges the shards of a folder."""
    return shlex.join(["layoutopt", "merge", str(folder)])


def read_status(folder: Path) -> FolderStatus:
    """Return how the study of a folder stands. Nothing is written, and a running study is not disturbed.

    Raises
    ------
    StudyDamaged
        If there is neither a manifest nor a shard, or one of them or a journal is broken.
    """
    refuse_links(folder)
    return _status_of(
        folder, {one_line(path.name, LONGEST_SHOWN): _status_of(path, {}) for path in shard_folders(folder)}
    )


def _status_of(folder: Path, shards: Mapping[str, FolderStatus]) -> FolderStatus:
    # Before the first merge, only the shards know what the study is.
    facts = read_manifest(next(iter(shards.values())).folder if shards and not _begun(folder) else folder)
    seed = facts.get("seed")
    if not isinstance(seed, int):
        raise StudyDamaged(f"{folder / MANIFEST}: the seed is {seed!r}; give or choose another folder")
    recorded = read_recorded(folder) if (folder / JOURNAL).exists() else {}
    last = _read_last(folder)
    state = str(last.get("state", ""))
    if _in_use(folder):
        state = RUNNING
    elif shards and state in (RUNNING, ""):
        state = SHARDED
    elif state in (RUNNING, ""):
        state = SILENT
    failures = Counter(item.kind.value for item in recorded.values() if isinstance(item, Failure))
    return FolderStatus(
        folder=folder,
        study=str(facts.get("study")),
        seed=seed,
        state=state,
        tasks=sum(isinstance(item, Evaluation) for item in recorded.values()),
        trials=sum(len(item.outcomes) for item in recorded.values() if isinstance(item, Evaluation)),
        failures=dict(sorted(failures.items())),
        last=last,
        shards=shards,
    )


def shard_folders(folder: Path) -> list[Path]:
    """Return the folders of a study's shards that have begun, by name."""
    return sorted(path for path in (folder / SHARDS).glob("*") if _begun(path))


def _begun(folder: Path) -> bool:
    return (folder / MANIFEST).exists()


def _read_last(folder: Path) -> Mapping[str, Any]:
    """Return what the last run said of itself, as far as it is of the kind that a run says."""
    try:
        found = json.loads(plain_bytes(folder / STATUS, largest=LARGEST_JSON))
    except (OSError, ValueError, RecursionError):
        return {}
    if not isinstance(found, dict):
        return {}
    kept: dict[str, Any] = {
        name: one_line(found[name], LONGEST_SHOWN) for name in _TEXTS if isinstance(found.get(name), str)
    }
    kept |= {name: found[name] for name in _NUMBERS if name in found and _is_number(found[name])}
    if kept.get("state") not in (RUNNING, FINISHED, STOPPED):
        kept.pop("state", None)
    go_on, failures = found.get("go_on"), found.get("failures")
    if isinstance(go_on, str) and _is_command(go_on):
        kept["go_on"] = go_on
    if isinstance(failures, dict):
        kept["failures"] = {
            one_line(kind, LONGEST_SHOWN): count for kind, count in failures.items() if _is_number(count)
        }
    return kept


def _is_number(value: object) -> bool:
    """Whether a value is a number that a run may have written; null says that it is not known."""
    if value is None:
        return True
    return isinstance(value, (int, float)) and not isinstance(value, bool) and abs(value) <= _LARGEST_NUMBER


def _is_command(text: str) -> bool:
    """Whether a text is one call of layoutopt that no shell takes for anything more: people copy it."""
    try:
        words = shlex.split(text)
    except ValueError:
        return False
    return words[:1] == ["layoutopt"] and shlex.join(words) == text and text.isprintable()


def _in_use(folder: Path) -> bool:
    """Whether a run holds the folder. The lock is tried for an instant, which needs no right to write."""
    if fcntl is None:
        return _in_use_without_flock(folder)
    try:
        # Of a pipe in its place nothing is waited for.
        lock = os.open(folder / LOCK, os.O_RDONLY | os.O_NOFOLLOW | os.O_NONBLOCK)
    except OSError:
        return False
    try:
        # Shared: several may look at once, and over a network it may be had of a file that is open for reading.
        fcntl.flock(lock, fcntl.LOCK_SH | fcntl.LOCK_NB)
    except BlockingIOError:
        return True
    except OSError:
        return False
    finally:
        os.close(lock)
    return False


def _in_use_without_flock(folder: Path) -> bool:
    if not (folder / LOCK).exists():
        return False
    lock = filelock.FileLock(folder / LOCK)
    try:
        lock.acquire(timeout=0)
    except filelock.Timeout:
        return True
    except OSError:
        return False
    lock.release()
    return False


def _last_lines(last: Mapping[str, Any], *, running: bool) -> list[str]:
    """Return what the last run said of itself; anything may stand in a file from elsewhere."""
    lines = []
    if last.get("round"):
        done, trials = last.get("trials_done"), last.get("trials")
        lines.append(f"round {last.get('rounds')}, {last['round']}: {done} of {trials} trials of this run")
    rate, left_s = last.get("trials_per_s"), last.get("left_s")
    if running and isinstance(rate, float) and isinstance(left_s, float):
        lines.append(f"{rate:.3g} trials/s, {format_duration(left_s)} left in this round")
    if last.get("best"):
        lines.append(f"best so far: {last['best']}")
    written = last.get("written")
    if isinstance(written, (int, float)):
        # Clocks jump; nothing was written in the future.
        lines.append(f"last sign of life {format_duration(max(0.0, time.time() - written))} ago")
    return lines


def _failed(failures: Mapping[str, int]) -> str:
    kinds = ", ".join(f"{count} {kind}" for kind, count in failures.items())
    return f"; failed tasks: {kinds}" if kinds else ""
