"""Reads the log of a drive: every fault of the file at once, each with line and column."""

import math
import os
from collections.abc import Iterable, Mapping, Sequence
from typing import Final

import numpy as np

from layoutopt.commissioning.drive_log import COLUMNS, FOREIGN_TAG, MOTION, POSE, TRUTH, DriveLog, antenna_indices
from layoutopt.commissioning.log_cells import ColumnFaults, header_of, lines_of, number_in, shown, words_in
from layoutopt.identity import FloatArray, IntArray
from layoutopt.layout import Layout, TagMap
from layoutopt.readings import UNKNOWN_TAG
from layoutopt.robot import Robot
from layoutopt.simulation.motion import increments_between, integrate

LARGEST: Final = 1e6
"""Largest way or angle in a log, m or rad."""
LATEST_S: Final = 1e11
"""Latest time stamp, s: seconds since 1970 stay far below it, milliseconds do not."""
_JUMP_FACTOR: Final = 10.0
_JUMP_M: Final = 0.5
_JUMP_RAD: Final = 1.0
_MOST_NAMED: Final = 5


def read_log(path: str | os.PathLike[str], *, layout: Layout, tag_map: TagMap, robot: Robot) -> DriveLog:
    """Return the drive in a log file.

    Parameters
    ----------
    layout, tag_map
        What is installed; reads are looked up in it.
    robot
        Its speeds tell which steps of odometry are jumps, such as a reset of the encoders.

    Raises
    ------
    InvalidInput
        With every fault of the file, each with line and column.
    """
    file = os.fspath(path)
    lines = lines_of(path)
    faults = ColumnFaults(file)
    columns = header_of(next(lines), COLUMNS, faults)
    if not columns:
        faults.raise_any()
    odometry = _check_columns(columns, faults)
    faults.raise_any()
    reader = _RowReader(columns, odometry, antenna_indices(layout), tag_map, faults)
    for number, cells in lines:
        reader.take(number, cells)
    return reader.log(file, robot)


def _check_columns(columns: Mapping[str, int], faults: ColumnFaults) -> Sequence[str]:
    """Return the columns of odometry, after noting what is missing from the header."""
    if "time_s" not in columns:
        faults.add(1, "time_s", "this column is missing", "Every row needs its time in seconds.")
    given = [group for group in (POSE, MOTION) if any(name in columns for name in group)]
    if len(given) == 2:
        faults.add(
            1, "", "there is odometry as poses and as motion", f"Keep {', '.join(POSE)} or {', '.join(MOTION)}."
        )
    elif not given:
        faults.add(1, "", "there is no odometry", f"Add {', '.join(POSE)}, or {', '.join(MOTION)}.")
    groups = [*given, *([TRUTH] if any(name in columns for name in TRUTH) else [])]
    for group in groups:
        for name in group:
            if name not in columns:
                faults.add(1, name, "this column is missing", f"{', '.join(group)} go together.")
    if "reads" not in columns:
        faults.add(1, "reads", "this column is missing", 'Add it with cells such as "3:17 5:102" (antenna:tag).')
    return given[0] if given else ()


class _RowReader:
    """Takes row after row; rows with a fault only add to the faults."""

    def __init__(
        self,
        columns: Mapping[str, int],
        odometry: Sequence[str],
        antennas: Mapping[int, int],
        tag_map: TagMap,
        faults: ColumnFaults,
    ) -> None:
        self._columns = columns
        self._odometry = odometry
        self._antennas = antennas
        self._tags = {int(tag): row for row, tag in enumerate(tag_map.ids)}
        self._faults = faults
        self._last_s = -math.inf
        self._last_line = 1
        self._moved: list[tuple[float, ...]] = []
        self._line: list[int] = []
        self._gyro: list[float] = []
        self._truth: list[tuple[float, ...]] = []
        self._reads: list[tuple[float, int, int]] = []
        self._scans: list[tuple[float, int]] = []

    def take(self, line: int, cells: Sequence[str]) -> None:
        """Take one row."""
        faults, columns = self._faults, self._columns
        if len(cells) != len(columns):
            faults.add(
                line,
                "",
                f"this row has {len(cells)} cells",
                f"The first line has {len(columns)}; check the commas.",
            )
            return
        time_s = number_in(cells[columns["time_s"]], line, "time_s", LATEST_S, faults)
        if time_s is None:
            if not cells[columns["time_s"]].strip():
                faults.add(line, "time_s", "this cell is empty", "Every row needs its time in seconds.")
            return
        if time_s < self._last_s:
            faults.add(
                line,
                "time_s",
                f"{time_s:.12g} is before the {self._last_s:.12g} of line {self._last_line}",
                "Sort the rows by time; a clock that was set back needs two logs.",
            )
            return
        odometry = self._numbers(self._odometry, line, cells)
        if odometry is not None:
            if self._moved and time_s == self._moved[-1][0]:
                faults.add(
                    line,
                    "time_s",
                    f"{time_s:.12g} is also the time of the odometry in line {self._line[-1]}",
                    "Keep one of the two rows.",
                )
                return
            self._moved.append((time_s, *odometry))
            self._line.append(line)
        self._last_s, self._last_line = time_s, line
        truth = self._numbers(TRUTH, line, cells) if TRUTH[0] in columns else None
        if truth is not None:
            if self._truth and time_s == self._truth[-1][0]:
                faults.add(line, "time_s", f"there is a truth at {time_s:.12g} already", "Keep one of the two.")
            self._truth.append((time_s, *truth))
        if "gyro_turn_rad" in columns:
            turn = number_in(cells[columns["gyro_turn_rad"]], line, "gyro_turn_rad", LARGEST, faults)
            if odometry is not None and turn is None and not cells[columns["gyro_turn_rad"]].strip():
                faults.add(line, "gyro_turn_rad", "this cell is empty", "Rows of odometry need it.")
            if odometry is None and turn is not None:
                faults.add(line, "gyro_turn_rad", "this row has no odometry", "Give both in the same rows.")
            if odometry is not None:
                self._gyro.append(turn or 0.0)
        self._take_reads(time_s, line, cells[columns["reads"]])
        if "scans" in columns:
            for word in words_in(cells[columns["scans"]]):
                antenna = self._antenna(word, line, "scans")
                if antenna is not None:
                    self._scans.append((time_s, antenna))

    def log(self, file: str, robot: Robot) -> DriveLog:
        """Return what the rows said.

        Raises
        ------
        InvalidInput
            If there was any fault, or fewer than two rows of odometry.
        """
        faults = self._faults
        if len(self._moved) < 2 and not faults.count:
            faults.add(
                None,
                self._odometry[0],
                f"there is odometry in {len(self._moved)} rows" if self._moved else "there is no row of odometry",
                "A drive needs at least two.",
            )
        faults.raise_any()
        table = np.array(self._moved)
        poses, jumps, notes = self._poses(table, robot)
        reads = np.array(self._reads, dtype=np.float64).reshape(-1, 3)
        scans = np.array(self._scans, dtype=np.float64).reshape(-1, 2)
        truth = np.array(self._truth, dtype=np.float64).reshape(-1, 4)
        truth[:, 3] = np.unwrap(truth[:, 3])
        with_scans = "scans" in self._columns
        return DriveLog(
            file=file,
            time_s=table[:, 0],
            poses=poses,
            jumps=jumps,
            gyro_rad=np.cumsum([0.0, *self._gyro[1:]]) if "gyro_turn_rad" in self._columns else None,
            read_time_s=reads[:, 0],
            read_antenna=reads[:, 1].astype(np.int64),
            read_tag=reads[:, 2].astype(np.int64),
            scan_time_s=scans[:, 0] if with_scans else None,
            scan_antenna=scans[:, 1].astype(np.int64) if with_scans else None,
            truth_time_s=truth[:, 0],
            truth=truth[:, 1:],
            notes=notes,
        )

    def _numbers(self, names: Sequence[str], line: int, cells: Sequence[str]) -> tuple[float, ...] | None:
        """Return the numbers of columns that go together, ``None`` if all are empty or one is no number."""
        texts = [cells[self._columns[name]] for name in names]
        if not any(text.strip() for text in texts):
            return None
        values = [
            number_in(text, line, name, LARGEST, self._faults) for name, text in zip(names, texts, strict=True)
        ]
        for name, text in zip(names, texts, strict=True):
            if not text.strip():
                self._faults.add(line, name, "this cell is empty", f"{', '.join(names)} go together.")
        return None if None in values else tuple(value for value in values if value is not None)

    def _take_reads(self, time_s: float, line: int, cell: str) -> None:
        for word in words_in(cell):
            first, colon, second = word.partition(":")
            if not colon:
                self._faults.add(
                    line, "reads", f"{shown(word)!r} is no read", 'Write antenna:tag, such as "3:17".'
                )
                continue
            antenna = self._antenna(first, line, "reads")
            if second == FOREIGN_TAG:
                tag: int | None = UNKNOWN_TAG
            else:
                tag = self._tags.get(int(second)) if _is_whole(second) else None
                if tag is None:
                    self._faults.add(
                        line,
                        "reads",
                        f"no tag {shown(second)!r} in the layout's tag map",
                        f'Its tags are {_range(self._tags)}; "{shown(first)}:?" is for a tag that is not in it.',
                    )
            if antenna is not None and tag is not None:
                self._reads.append((time_s, antenna, tag))

    def _antenna(self, word: str, line: int, column: str) -> int | None:
        index = self._antennas.get(int(word)) if _is_whole(word) else None
        if index is None:
            self._faults.add(
                line,
                column,
                f"no antenna {shown(word)!r} that reads tags in the layout",
                f"Its numbers are {_range(self._antennas)}, as in readers.yaml.",
            )
        return index

    def _poses(self, table: FloatArray, robot: Robot) -> tuple[FloatArray, IntArray, tuple[str, ...]]:
        """Return the poses by odometry without jumps, the rows before which one was, and notes on them."""
        if self._odometry == POSE:
            given = table[:, 1:].copy()
            given[:, 2] = np.unwrap(given[:, 2])
            increments = increments_between(given)
        else:
            increments = table[1:, 1:]
        spans_s = np.diff(table[:, 0])
        way_m = np.hypot(increments[:, 0], increments[:, 1])
        jumped = (way_m > _JUMP_M + _JUMP_FACTOR * robot.speed_m_s * spans_s) | (
            np.abs(increments[:, 2]) > _JUMP_RAD + _JUMP_FACTOR * robot.turn_rate_rad_s * spans_s
        )
        jumps = np.flatnonzero(jumped) + 1
        notes = [
            f"{self._faults.file}:{self._line[row]}: the odometry jumps by {way_m[row - 1]:.3g} m and "
            f"{math.degrees(increments[row - 1, 2]):.3g} deg within {spans_s[row - 1]:.3g} s, like encoders that "
            "were reset; this step is taken as standing still and left out of the fit of odometry"
            for row in jumps[:_MOST_NAMED]
        ]
        if len(jumps) > _MOST_NAMED:
            notes.append(f"{self._faults.file}: {len(jumps) - _MOST_NAMED} more jumps of the odometry")
        return integrate((0.0, 0.0, 0.0), np.where(jumped[:, None], 0.0, increments)), jumps, tuple(notes)


def _is_whole(word: str) -> bool:
    return word.isascii() and word.isdigit() and len(word) < 10


def _range(numbers: Iterable[int]) -> str:
    known = sorted(numbers)
    if not known:
        return "none"
    gaps = known[-1] - known[0] + 1 != len(known)
    return f"{known[0]} to {known[-1]}" + (" with gaps" if gaps else "")
