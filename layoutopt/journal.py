"""The study folder: frozen spec, manifest, and an append-only journal with one writer.

``results.jsonl`` holds a line for each finished task and is written by the parent process alone, under a lock.
A torn last line, which a kill can leave, is dropped when the folder is opened again. Nothing is pickled.
"""

import json
import math
import os
import platform
from collections.abc import Mapping
from importlib import metadata
from pathlib import Path
from typing import IO, Any, Final, Self

import filelock
import numpy as np

import layoutopt
from layoutopt.atomic_file import replacing
from layoutopt.errors import StudyDamaged
from layoutopt.identity import content_key
from layoutopt.protocols import Evaluation, Failure, Group, Task
from layoutopt.scores import TrialOutcomes
from layoutopt.simulation.trials import MODEL_VERSION
from layoutopt.streams import Streams

JOURNAL: Final = "results.jsonl"
MANIFEST: Final = "manifest.json"
LOCK: Final = ".lock"
SCHEMA: Final = 2
_PACKAGES: Final = ("numpy", "scipy", "numba", "shapely", "joblib")


def task_key(task: Task, streams: Streams) -> str:
    """Return the journal key of a task: everything that its outcomes depend on, and no price."""
    return content_key(
        task.layout.key, task.scenario.key, task.estimator.key, task.first, task.count, streams.seed, MODEL_VERSION
    )


def manifest(streams: Streams, spec_key: str) -> dict[str, object]:
    """Return what a later reader needs to judge the folder: versions, processor, seed and spec."""
    return {
        "schema": SCHEMA,
        "layoutopt": layoutopt.__version__,
        "model": MODEL_VERSION,
        "seed": streams.seed,
        "spec": spec_key,
        "python": platform.python_version(),
        "processor": _processor(),
        "system": platform.system(),
        "packages": {name: metadata.version(name) for name in _PACKAGES},
    }


class Journal:
    """The open journal of one folder, which it keeps locked until it is closed.

    Raises
    ------
    StudyDamaged
        If another run holds the folder, it belongs to another spec or seed, or a line within it is broken.
    """

    def __init__(self, folder: Path, *, facts: Mapping[str, object]) -> None:
        folder.mkdir(parents=True, exist_ok=True)
        self.folder = folder
        self.dropped_torn_line = False
        self._known: dict[str, Evaluation | Failure] = {}
        self._column_sets: dict[tuple[str, ...], int] = {}
        self._lock = filelock.FileLock(folder / LOCK)
        try:
            self._lock.acquire(timeout=0)
        except filelock.Timeout:
            raise StudyDamaged(f"{folder}: another run is writing to this folder; choose another --out") from None
        try:
            self._agree_on_manifest(facts)
            self._read()
            self._file: IO[str] = (folder / JOURNAL).open("a", encoding="utf-8", newline="\n")
        except BaseException:
            self._lock.release()
            raise

    def __enter__(self) -> Self:
        """Return the journal itself."""
        return self

    def __exit__(self, *_: object) -> None:
        """Write what is left, and free the folder."""
        self.close()

    def close(self) -> None:
        """Flush to disk and free the folder."""
        try:
            self._file.flush()
            os.fsync(self._file.fileno())
            self._file.close()
        finally:
            self._lock.release()

    def __len__(self) -> int:
        """Return the number of finished tasks."""
        return len(self._known)

    def get(self, key: str) -> Evaluation | Failure | None:
        """Return what is known of a task, or ``None``."""
        return self._known.get(key)

    def append(self, key: str, evaluation: Evaluation | Failure) -> None:
        """Write one finished task; the line reaches the system at once and the disk when the file is closed."""
        record: dict[str, object] = {
            "key": key,
            "group": list(evaluation.group),
            "first": evaluation.first,
        }
        if isinstance(evaluation, Failure):
            record["failure"] = evaluation.message
        else:
            outcomes = evaluation.outcomes
            record["columns"] = self._column_set(outcomes.columns)
            record["values"] = [[None if math.isnan(v) else v for v in row] for row in outcomes.values.tolist()]
            record["seconds"] = round(evaluation.seconds, 4)
        self._write(record)
        self._known[key] = evaluation

    def _column_set(self, columns: tuple[str, ...]) -> int:
        """Return the number under which a set of column names stands in the file, writing it once."""
        if columns not in self._column_sets:
            self._column_sets[columns] = len(self._column_sets)
            self._write({"column_set": self._column_sets[columns], "names": list(columns)})
        return self._column_sets[columns]

    def _write(self, record: Mapping[str, object]) -> None:
        self._file.write(json.dumps(record, separators=(",", ":"), allow_nan=False) + "\n")
        self._file.flush()

    def _agree_on_manifest(self, facts: Mapping[str, object]) -> None:
        path = self.folder / MANIFEST
        if not path.exists():
            with replacing(path) as temporary:
                temporary.write_text(json.dumps(facts, indent=2, sort_keys=True) + "\n", encoding="utf-8")
            return
        found = read_manifest(self.folder)
        for name in ("schema", "study", "seed", "spec", "model", "quick"):
            if found.get(name) != facts[name]:
                raise StudyDamaged(
                    f"{path}: the folder belongs to another study ({name} is {found.get(name)!r}, "
                    f"now {facts[name]!r}); choose another --out"
                )

    def _read(self) -> None:
        path = self.folder / JOURNAL
        if not path.exists():
            return
        content = path.read_bytes()
        whole = _whole_lines(content)
        if len(whole) < len(content):
            self.dropped_torn_line = True
            with path.open("r+b") as file:
                file.truncate(len(whole))
        known, self._column_sets = _parsed(whole, path)
        # What failed is tried again: memory or a disk may have been short.
        self._known = {key: item for key, item in known.items() if isinstance(item, Evaluation)}


def read_manifest(folder: Path) -> dict[str, Any]:
    """Return the manifest of a study folder.

    Raises
    ------
    StudyDamaged
        If there is none, or it is no table.
    """
    path = folder / MANIFEST
    try:
        found = json.loads(path.read_text(encoding="utf-8"))
    except (OSError, ValueError) as error:
        raise StudyDamaged(f"{path}: not a manifest ({error}); give or choose another folder") from error
    if not isinstance(found, dict):
        raise StudyDamaged(f"{path}: not a manifest; give or choose another folder")
    return found


def read_recorded(folder: Path) -> dict[str, Evaluation | Failure]:
    """Return all finished tasks of a folder by key, without writing to it or locking it.

    Raises
    ------
    StudyDamaged
        If there is no journal, or a line within it is broken.
    """
    path = folder / JOURNAL
    if not path.exists():
        raise StudyDamaged(f"{path}: no such journal; give the --out folder of a study")
    known, _ = _parsed(_whole_lines(path.read_bytes()), path)
    return known


def _whole_lines(content: bytes) -> bytes:
    return content[: content.rfind(b"\n") + 1]


def _parsed(content: bytes, path: Path) -> tuple[dict[str, Evaluation | Failure], dict[tuple[str, ...], int]]:
    """Return finished tasks by key, and the numbers of the column sets."""
    known: dict[str, Evaluation | Failure] = {}
    names: dict[int, tuple[str, ...]] = {}
    for number, line in enumerate(content.splitlines(), start=1):
        try:
            record = json.loads(line)
            if "column_set" in record:
                names[record["column_set"]] = tuple(record["names"])
            else:
                known[record["key"]] = _from_record(record, names)
        except (ValueError, KeyError, TypeError) as error:
            raise StudyDamaged(f"{path}:{number}: not a journal line ({error}); restore or remove it") from error
    return known, {columns: number for number, columns in names.items()}


def _from_record(record: Mapping[str, Any], names: Mapping[int, tuple[str, ...]]) -> Evaluation | Failure:
    group, first = Group(*record["group"]), record["first"]
    if "failure" in record:
        return Failure(group=group, first=first, message=record["failure"])
    values = np.array(record["values"], dtype=np.float64)
    outcomes = TrialOutcomes(
        replications=np.arange(first, first + len(values)), columns=names[record["columns"]], values=values
    )
    return Evaluation(group=group, first=first, outcomes=outcomes, seconds=record["seconds"])


def _processor() -> str:
    cpuinfo = Path("/proc/cpuinfo")
    if cpuinfo.exists():
        for line in cpuinfo.read_text(encoding="utf-8").splitlines():
            if line.startswith("model name"):
                return line.partition(":")[2].strip()
    return platform.processor() or platform.machine()
