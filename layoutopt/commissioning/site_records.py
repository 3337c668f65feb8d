"""What comes back from the floor: scans of tags and their surveyed places, read from CSV.

A file of scans has the columns ``tag_id`` and ``uid``; one of a survey has ``tag_id``, ``x_m`` and ``y_m``, in the
frame of the tag map or in one of the surveyor's own. Every fault comes at once, each with line and column.
"""

import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Final

from layoutopt.commissioning.log_cells import ColumnFaults, header_of, lines_of, number_in, shown
from layoutopt.commissioning.tag_identity import TagIdentity, tag_identity
from layoutopt.identity import FloatArray, IntArray, read_only

SCAN_COLUMNS: Final = ("tag_id", "uid")
SURVEY_COLUMNS: Final = ("tag_id", "x_m", "y_m")
LARGEST_M: Final = 1e6
"""Surveyors' coordinates may be those of a country, not of a building."""
_LARGEST_NUMBER: Final = 1_000_000_000


@dataclass(frozen=True, slots=True, kw_only=True)
class Scan:
    """One scan: at which tag of the plan the installer stood, and which identity answered."""

    line: int
    tag_id: int
    identity: TagIdentity


@dataclass(frozen=True, slots=True, kw_only=True)
class Survey:
    """Measured places of tags: their numbers, shape (n,), and centres, shape (n, 2), m."""

    tag_id: IntArray
    xy_m: FloatArray


def read_scans(path: str | os.PathLike[str]) -> tuple[Scan, ...]:
    """Return the scans of a file in their order; a tag may be scanned more than once.

    Raises
    ------
    InvalidInput
        With every fault of the file.
    """
    scans = []
    faults = ColumnFaults(os.fspath(path))
    for line, cells in _rows(path, SCAN_COLUMNS, faults):
        tag_id = _tag_number(cells["tag_id"], line, faults)
        try:
            identity = tag_identity(cells["uid"])
        except ValueError as error:
            repair = "Scan the tag again, and leave out rows of tags that do not answer."
            faults.add(line, "uid", f"{shown(cells['uid'])!r} is no identity: {error}", repair)
            continue
        if tag_id is not None:
            scans.append(Scan(line=line, tag_id=tag_id, identity=identity))
    faults.raise_any()
    return tuple(scans)


def read_survey(path: str | os.PathLike[str]) -> Survey:
    """Return the surveyed places of a file.

    Raises
    ------
    InvalidInput
        With every fault of the file; a tag that was measured twice is one.
    """
    faults = ColumnFaults(os.fspath(path))
    measured: dict[int, tuple[float, float]] = {}
    lines: dict[int, int] = {}
    for line, cells in _rows(path, SURVEY_COLUMNS, faults):
        tag_id = _tag_number(cells["tag_id"], line, faults)
        x_m, y_m = (number_in(cells[name], line, name, LARGEST_M, faults) for name in ("x_m", "y_m"))
        for name, value in (("x_m", x_m), ("y_m", y_m)):
            if value is None and not cells[name].strip():
                faults.add(line, name, "this cell is empty", "Leave out the rows of tags that were not measured.")
        if tag_id in measured:
            problem = f"tag {tag_id} was measured in line {lines[tag_id]} already"
            faults.add(line, "tag_id", problem, "Keep one of the two rows.")
        elif tag_id is not None and x_m is not None and y_m is not None:
            measured[tag_id], lines[tag_id] = (x_m, y_m), line
    faults.raise_any()
    return Survey(
        tag_id=read_only(list(measured), (-1,)).astype("int64"), xy_m=read_only(list(measured.values()), (-1, 2))
    )


def _rows(
    path: str | os.PathLike[str], needed: Sequence[str], faults: ColumnFaults
) -> Iterator[tuple[int, Mapping[str, str]]]:
    lines = lines_of(path)
    columns = header_of(next(lines), needed, faults)
    for name in needed:
        if columns and name not in columns:
            faults.add(1, name, "this column is missing", f"The columns are {', '.join(needed)}.")
    faults.raise_any()
    for line, cells in lines:
        if len(cells) != len(columns):
            repair = f"The first line has {len(columns)}; check the commas."
            faults.add(line, "", f"this row has {len(cells)} cells", repair)
            continue
        yield line, {name: cells[place] for name, place in columns.items()}


def _tag_number(cell: str, line: int, faults: ColumnFaults) -> int | None:
    text = cell.strip()
    if not (text.isascii() and text.isdigit() and int(text[:10]) < _LARGEST_NUMBER and len(text) < 10):
        faults.add(line, "tag_id", f"{shown(text)!r} is no number of a tag", "Write its tag_id, as in tags.csv.")
        return None
    return int(text)
