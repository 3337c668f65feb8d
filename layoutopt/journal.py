"""The study folder: frozen spec, manifest, and an append-only journal with one writer.

``results.jsonl`` holds a line for each finished task and is written by the parent process alone, under a lock.
A torn last line, which a kill can leave, and zeros, which a power failure can, are dropped when the folder is
opened again. Nothing is pickled.
"""

import contextlib
import json
import math
import os
import sys
import time
from collections.abc import Mapping
from pathlib import Path
from typing import Any, Final, Self

import filelock
import numpy as np
import orjson

from layoutopt import machine
from layoutopt.atomic_file import not_plain, plain_bytes, plain_file, replacing
from layoutopt.errors import FailureKind, JournalNotWritten, StudyDamaged
from layoutopt.identity import content_key
from layoutopt.protocols import Evaluation, Failure, Group, Task
from layoutopt.scores import TRIAL_UNITS, TrialOutcomes
from layoutopt.simulation.trials import MODEL_VERSION
from layoutopt.streams import Streams
from layoutopt.units import one_line

JOURNAL: Final = "results.jsonl"
MANIFEST: Final = "manifest.json"
LOCK: Final = ".lock"
FROZEN_SPEC: Final = "spec.toml"
SHARDS: Final = "shards"
SCHEMA: Final = 3
BOUND: Final = ("schema", "study", "seed", "spec", "model", "quick")
"""What of the manifest must agree for a folder to be continued."""
LARGEST_JSON: Final = 5_000_000
"""Bytes of a manifest or a status; those of a long study have some thousand."""
LONGEST_LINE: Final = 256_000_000
"""Bytes of a journal line; one of a hundred thousand trials has some ten million. A journal has any size."""
LONGEST_SHOWN: Final = 300
"""Characters of a text from a study folder that a message quotes: a path or the text of an error, not a novel."""
_WRITTEN_IN_PLACE: Final = (LOCK, JOURNAL)
_FOLDERS: Final = (SHARDS, "layouts", "recommended", "figures", "tables")
_LONGEST_TEXT: Final = 5_000
_MOST_LEVELS: Final = 8
_LARGEST_WHOLE: Final = 10**15
_SYNC_EVERY_S: Final = 5.0
# Whoever asks whether a folder is in use holds the lock for an instant.
_LOCK_WAIT_S: Final = 0.5


def task_key(task: Task, streams: Streams) -> str:
    """Return the journal key of a task: everything that its outcomes depend on, and no price."""
    return content_key(
        task.layout.key, task.scenario.key, task.estimator.key, task.first, task.count, streams.seed, MODEL_VERSION
    )


def manifest(streams: Streams, spec_key: str) -> dict[str, object]:
    """Return what a later reader needs to judge the folder: seed, spec, model, and where it was written."""
    return {
        "schema": SCHEMA,
        "model": MODEL_VERSION,
        "seed": streams.seed,
        "spec": spec_key,
        "environments": [machine.environment()],
    }


class Journal:
    """The open journal of one folder, which it keeps locked until it is closed.

    Raises
    ------
    StudyDamaged
        If another run holds the folder, it belongs to another spec or seed, or a line within it is broken; or if
        writing to it would write elsewhere, by a link.

    Attributes
    ----------
    notes
        What whoever opened it should know: a torn line was dropped, versions or processor are not those of before.
    """

    def __init__(self, folder: Path, *, facts: Mapping[str, object]) -> None:
        _refuse_ways_out(folder)
        folder.mkdir(parents=True, exist_ok=True)
        self.folder = folder
        self.notes: list[str] = []
        self._known: dict[str, Evaluation | Failure] = {}
        self._column_sets: dict[tuple[str, ...], int] = {}
        self._lock = filelock.FileLock(folder / LOCK)
        try:
            self._lock.acquire(timeout=_LOCK_WAIT_S)
        except filelock.Timeout:
            raise StudyDamaged(f"{folder}: another run is writing to this folder; choose another --out") from None
        try:
            self._agree_on_manifest(facts)
            self._size = self._read()
            self._synced = time.monotonic()
            flags = os.O_WRONLY | os.O_APPEND | os.O_CREAT | getattr(os, "O_BINARY", 0)
            flags |= getattr(os, "O_NOFOLLOW", 0)
            self._file = os.open(folder / JOURNAL, flags, 0o666)
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
            # On a full disk this fails as the writing did, which has been said.
            with contextlib.suppress(OSError):
                os.fsync(self._file)
            os.close(self._file)
        finally:
            self._lock.release()

    def __len__(self) -> int:
        """Return the number of finished tasks."""
        return len(self._known)

    def get(self, key: str) -> Evaluation | Failure | None:
        """Return what is known of a task, or ``None``."""
        return self._known.get(key)

    def append(self, key: str, evaluation: Evaluation | Failure) -> None:
        """Write one finished task; the line reaches the system at once and the disk within seconds.

        Raises
        ------
        JournalNotWritten
            If there is no room or no right to write; the file then ends with the last whole line.
        """
        record: dict[str, object] = {
            "key": key,
            "group": list(evaluation.group),
            "first": evaluation.first,
        }
        if isinstance(evaluation, Failure):
            record["failure"] = evaluation.message
            record["kind"] = evaluation.kind.value
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
            number = 1 + max(self._column_sets.values(), default=-1)
            self._write({"column_set": number, "names": list(columns)})
            self._column_sets[columns] = number
        return self._column_sets[columns]

    def _write(self, record: Mapping[str, object]) -> None:
        line = memoryview((json.dumps(record, separators=(",", ":"), allow_nan=False) + "\n").encode())
        try:
            written = 0
            while written < len(line):
                written += os.write(self._file, line[written:])
            if time.monotonic() - self._synced > _SYNC_EVERY_S:
                os.fsync(self._file)
                self._synced = time.monotonic()
        except OSError as error:
            with contextlib.suppress(OSError):
                os.ftruncate(self._file, self._size)
            raise JournalNotWritten(
                f"{self.folder / JOURNAL}: cannot be written ({error.strerror}); what it holds is whole"
            ) from error
        self._size += len(line)

    def _agree_on_manifest(self, facts: Mapping[str, object]) -> None:
        path = self.folder / MANIFEST
        if not path.exists():
            _write_manifest(path, facts)
            return
        found = read_manifest(self.folder)
        for name in BOUND:
            if found.get(name) != facts.get(name):
                raise StudyDamaged(
                    f"{path}: the folder belongs to another study ({name} is {found.get(name)!r}, "
                    f"now {facts.get(name)!r}); choose another --out"
                )
        self.notes += _took_note_of_environment(path, found, facts)

    def _read(self) -> int:
        """Take over what the file holds, and return its size without a torn last line."""
        path = self.folder / JOURNAL
        if not path.exists():
            return 0
        content = _content(path)
        whole, sound = _whole_lines(content), _sound_lines(content)
        known, self._column_sets = _parsed(sound, path)
        if len(whole) < len(content):
            self.notes.append("the last line of the journal was torn, as a kill leaves it; it is run again")
            with path.open("r+b") as file:
                file.truncate(len(whole))
        if len(sound) < len(whole):
            self.notes.append("the journal has gaps, as a power failure leaves them; what they held is run again")
            with replacing(path) as temporary:
                _write_durably(temporary, sound)
        # What failed is tried again: memory or a disk may have been short.
        self._known = {key: item for key, item in known.items() if isinstance(item, Evaluation)}
        return len(sound)


def read_manifest(folder: Path) -> dict[str, Any]:
    """Return the manifest of a study folder.

    Raises
    ------
    StudyDamaged
        If there is none, or it is no table.
    """
    path = folder / MANIFEST
    refuse_links(folder)
    if not path.exists():
        raise StudyDamaged(f"{folder}: holds no study; give the --out folder of one")
    try:
        found = json.loads(plain_bytes(path, largest=LARGEST_JSON).decode("utf-8"))
        _check_manifest(found)
    except (OSError, ValueError, RecursionError) as error:
        reason = one_line(str(error), LONGEST_SHOWN)
        raise StudyDamaged(f"{path}: not a manifest ({reason}); give or choose another folder") from error
    return dict(found)


def read_recorded(folder: Path) -> dict[str, Evaluation | Failure]:
    """Return all finished tasks of a folder by key, without writing to it or locking it.

    Raises
    ------
    StudyDamaged
        If there is no journal, or a line within it is broken.
    """
    path = folder / JOURNAL
    refuse_links(folder)
    if not path.exists():
        raise StudyDamaged(f"{path}: no such journal; give the --out folder of a study")
    known, _ = _parsed(_sound_lines(_content(path)), path)
    return known


def refuse_links(folder: Path) -> None:
    """Refuse a study folder whose own files are no plain files, so that nothing outside it is opened for its sake.

    Raises
    ------
    StudyDamaged
        If lock, manifest, journal or spec is a link, a pipe or anything else but a file.
    """
    for name in (LOCK, MANIFEST, JOURNAL, FROZEN_SPEC):
        _refuse(folder / name, not_plain(folder / name))


def _refuse_ways_out(folder: Path) -> None:
    """Refuse a folder that is to be written to if a link of its own would lead the writing elsewhere."""
    refuse_links(folder)
    inside = [folder / name for name in _FOLDERS]
    for path in [*inside, folder, folder.parent] if folder.parent.name == SHARDS else inside:
        _refuse(path, "a symbolic link" if path.is_symlink() else "")
    for name in _WRITTEN_IN_PLACE:
        with contextlib.suppress(FileNotFoundError):
            if (folder / name).stat().st_nlink > 1:
                _refuse(folder / name, "a file that has a second name elsewhere")


def _refuse(path: Path, kind: str) -> None:
    if kind:
        raise StudyDamaged(
            f"{path}: is {kind}, and what a study reads and writes stays in its folder; remove it, or choose "
            "another folder"
        )


def _check_manifest(found: object) -> None:
    """Check that a manifest is a table that could be ours, and that it can be written again.

    Raises
    ------
    ValueError
        If it is not.
    """
    if not isinstance(found, dict):
        raise ValueError("it is no table")
    _check_plain(found, levels=_MOST_LEVELS)
    for name in BOUND:
        value = found.get(name)
        if isinstance(value, (dict, list, float)) or (
            isinstance(value, str) and one_line(value, LONGEST_SHOWN) != value
        ):
            raise ValueError(f"{name} is no short text or whole number")
    environments = found.get("environments", [])
    if not isinstance(environments, list) or not all(isinstance(item, dict) for item in environments):
        raise ValueError("environments is no list of tables")


def _check_plain(value: object, *, levels: int) -> None:
    if isinstance(value, str):
        value.encode()
        if len(value) > _LONGEST_TEXT:
            raise ValueError("a text is too long")
    elif isinstance(value, (dict, list)):
        if not levels:
            raise ValueError("it is nested too deeply")
        for item in [*value, *value.values()] if isinstance(value, dict) else value:
            _check_plain(item, levels=levels - 1)
    elif isinstance(value, (int, float)) and not abs(value) < 1e19:
        raise ValueError("a number is out of range")


def _content(path: Path) -> bytes:
    """Return what a journal holds.

    Raises
    ------
    StudyDamaged
        If it is no plain file, cannot be read, or a line is absurdly long.
    """
    try:
        with plain_file(path) as file:
            lines: list[bytes] = []
            while line := file.readline(LONGEST_LINE + 1):
                if len(line) > LONGEST_LINE:
                    raise StudyDamaged(
                        f"{path}:{len(lines) + 1}: the line has more than {LONGEST_LINE / 1e6:g} MB; restore or "
                        "remove it"
                    )
                lines.append(line)
    except OSError as error:
        raise StudyDamaged(f"{path}: cannot be read ({error.strerror})") from error
    return b"".join(lines)


def _whole_lines(content: bytes) -> bytes:
    return content[: content.rfind(b"\n") + 1]


def _sound_lines(content: bytes) -> bytes:
    """Return the whole lines but for those with zeros, which are never written, but left by a power failure."""
    whole = _whole_lines(content)
    if b"\0" not in whole:
        return whole
    return b"".join(line for line in whole.splitlines(keepends=True) if b"\0" not in line)


def _write_durably(path: Path, content: bytes) -> None:
    with path.open("wb") as file:
        file.write(content)
        file.flush()
        os.fsync(file.fileno())


def _parsed(content: bytes, path: Path) -> tuple[dict[str, Evaluation | Failure], dict[tuple[str, ...], int]]:
    """Return finished tasks by key, and the numbers of the column sets."""
    known: dict[str, Evaluation | Failure] = {}
    names: dict[int, tuple[str, ...]] = {}
    for number, line in enumerate(content.splitlines(), start=1):
        try:
            record = orjson.loads(line)
            if "column_set" in record:
                _add_columns(record, names)
            else:
                known[_text(record["key"])] = _from_record(record, names)
        except (ValueError, KeyError, TypeError, AttributeError, OverflowError, RecursionError) as error:
            reason = one_line(str(error), LONGEST_SHOWN)
            raise StudyDamaged(f"{path}:{number}: not a journal line ({reason}); restore or remove it") from error
    return known, {columns: number for number, columns in names.items()}


def _add_columns(record: Mapping[str, Any], names: dict[int, tuple[str, ...]]) -> None:
    number, columns = _whole(record["column_set"]), tuple(map(_text, record["names"]))
    unknown = [name for name in columns if name.rpartition(".")[2] not in TRIAL_UNITS]
    if unknown or len(set(columns)) < len(columns) or names.setdefault(number, columns) != columns:
        raise ValueError(f"columns {unknown}" if unknown else "columns that stand twice")


def _from_record(record: Mapping[str, Any], names: Mapping[int, tuple[str, ...]]) -> Evaluation | Failure:
    group, first = Group(*map(sys.intern, map(_text, record["group"]))), _whole(record["first"])
    if "failure" in record:
        # Half a character, as a file name in an error may hold, could stand in no report.
        message = record["failure"].encode("utf-8", "replace").decode()
        return Failure(group=group, first=first, message=message, kind=FailureKind(record["kind"]))
    values = np.array(record["values"], dtype=np.float64)
    if np.isinf(values).any():
        raise ValueError("a value is not finite")
    outcomes = TrialOutcomes(
        replications=np.arange(first, first + len(values)), columns=names[record["columns"]], values=values
    )
    return Evaluation(group=group, first=first, outcomes=outcomes, seconds=float(record["seconds"]))


def _text(value: object) -> str:
    if not isinstance(value, str):
        raise TypeError(f"{type(value).__name__} in place of a text")
    value.encode()  # raises for half a character
    return value


def _whole(value: object) -> int:
    if not isinstance(value, int) or isinstance(value, bool) or not 0 <= value < _LARGEST_WHOLE:
        raise TypeError("a number that is not whole, or out of range")
    return value


def _write_manifest(path: Path, facts: Mapping[str, object]) -> None:
    with replacing(path) as temporary:
        _write_durably(temporary, (json.dumps(facts, indent=2, sort_keys=True) + "\n").encode())


def _took_note_of_environment(path: Path, found: dict[str, Any], facts: Mapping[str, Any]) -> list[str]:
    """Add versions and processor to a manifest that does not know them, and return what differs, in words."""
    known = found.get("environments")
    if known is None:
        raise StudyDamaged(f"{path}: holds no list of environments; give or choose another folder")
    added = [item for item in facts["environments"] if item not in known]
    if not added:
        return []
    _write_manifest(path, {**found, "environments": [*known, *added]})
    changes = "; ".join(machine.changes(known[-1], added[-1])) if known else "none was recorded"
    differences = one_line(changes, LONGEST_SHOWN)
    return [f"versions or processor are not those of before ({differences}): the last bits of results may differ"]
