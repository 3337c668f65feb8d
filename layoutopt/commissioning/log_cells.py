"""Lines, headers and cells of a CSV file that people or robots wrote: every fault with its line and column."""

import csv
import difflib
import io
import math
import os
import re
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Final

from layoutopt.errors import Fault, InvalidInput
from layoutopt.spec.findings import MAXIMUM_FAULTS
from layoutopt.units import one_line

MAXIMUM_BYTES: Final = 200_000_000
_NUMBER: Final = re.compile(r"[-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?", re.ASCII)
_SHOWN_CHARACTERS: Final = 40
_LONGEST_NUMBER: Final = 64
_OTHER_FORMATS: Final = {
    b"PK\x03\x04": "a spreadsheet or a zip archive",
    b"\xd0\xcf\x11\xe0": "a spreadsheet of an old kind",
    b"%PDF": "a PDF document",
}


class ColumnFaults:
    """Collects the faults of one file, each with line and column; ``count`` is how many were noted."""

    def __init__(self, file: str) -> None:
        self.file = file
        self.count = 0
        self._faults: list[Fault] = []

    def add(self, line: int | None, column: str, problem: str, repair: str) -> None:
        """Note what is wrong in a line and column, and what would be right."""
        self.count += 1
        # A damaged file can have a fault a line: no one reads them all.
        if self.count <= MAXIMUM_FAULTS:
            place = self.file if line is None else f"{self.file}:{line}"
            self._faults.append(Fault(place=f"{place} {column}".rstrip(), problem=problem, repair=repair))

    def raise_any(self) -> None:
        """Raise what was found.

        Raises
        ------
        InvalidInput
            If there is any fault.
        """
        if self.count > MAXIMUM_FAULTS:
            more = Fault(
                place=self.file,
                problem=f"there are {self.count - MAXIMUM_FAULTS} more faults",
                repair="Mend those above first.",
            )
            raise InvalidInput([*self._faults, more])
        if self._faults:
            raise InvalidInput(self._faults)


def lines_of(path: str | os.PathLike[str]) -> Iterator[tuple[int, list[str]]]:
    """Yield the rows of a CSV file that hold anything, each with the number of its last line; at least two.

    Raises
    ------
    InvalidInput
        If there is no such file, it is too large, no text, no CSV, or has no row behind the header.
    """
    file = os.fspath(path)
    text = _text_of(file)
    reader = csv.reader(io.StringIO(text, newline=""), strict=True)
    rows = 0
    try:
        for cells in reader:
            if any(cell.strip() for cell in cells):
                rows += 1
                yield reader.line_num, cells
    except csv.Error as error:
        raise InvalidInput.at(
            f"{file}:{reader.line_num}", f"this is no CSV: {error}", "Check quotes and line ends."
        ) from None
    if rows < 2:
        problem = "the file is empty" if rows == 0 else "there is no row behind the header"
        raise InvalidInput.at(file, problem, "Needed are a first line with the columns and rows below it.")


def header_of(row: tuple[int, Sequence[str]], known: Sequence[str], faults: ColumnFaults) -> Mapping[str, int]:
    """Return the place of each column, after noting names that are unknown or stand twice."""
    line, cells = row
    if len(cells) == 1 and any(separator in cells[0] for separator in ";\t"):
        faults.add(
            line,
            "",
            "the columns are not separated by commas",
            "Export with commas between columns and decimal points.",
        )
        return {}
    columns: dict[str, int] = {}
    for place, cell in enumerate(cells):
        name = cell.strip()
        if name in columns:
            faults.add(line, shown(name), "this column stands twice", "Remove one of the two.")
        elif name not in known:
            near = difflib.get_close_matches(name, known, n=1)
            meant = f"Did you mean '{near[0]}'?" if near else f"Remove it; known are {', '.join(known)}."
            faults.add(line, shown(name), "unknown column", meant)
        columns[name] = place
    return columns


def number_in(cell: str, line: int, column: str, largest: float, faults: ColumnFaults) -> float | None:
    """Return the number in a cell; ``None`` for an empty one, and, after noting it, for any other text."""
    text = cell.strip()
    if not text:
        return None
    if len(text) > _LONGEST_NUMBER or not _NUMBER.fullmatch(text):
        repair = "Write a number such as 1.25, with a decimal point and without a unit."
        if text.lower().lstrip("+-") in ("nan", "inf", "infinity"):
            repair = "Leave the cell empty where nothing is known."
        faults.add(line, column, f"{shown(text)!r} is no finite number", repair)
        return None
    value = float(text)
    if not (math.isfinite(value) and abs(value) <= largest):
        faults.add(line, column, f"{shown(text)} is out of range", f"Write at most {largest:g}; check the unit.")
        return None
    return value


def words_in(cell: str) -> list[str]:
    """Return the words of a cell, separated by white space."""
    return cell.split()


def shown(text: str) -> str:
    """Return a text as messages show it: printable and short."""
    return one_line(text, _SHOWN_CHARACTERS)


def _text_of(file: str) -> str:
    path = Path(file)
    try:
        if not path.is_file():
            problem = "this is a folder" if path.is_dir() else "there is no such file"
            raise InvalidInput.at(shown_path(file), problem, "Name the CSV file itself.")
        if path.stat().st_size > MAXIMUM_BYTES:
            raise InvalidInput.at(
                file, f"the file has over {MAXIMUM_BYTES // 1_000_000} MB", "Cut the drive into several logs."
            )
        content = path.read_bytes()
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise InvalidInput.at(
            shown_path(file), f"the file cannot be read: {reason}", "Check its name and the right to read it."
        ) from None
    kind = next((kind for start, kind in _OTHER_FORMATS.items() if content.startswith(start)), None)
    if kind is not None:
        raise InvalidInput.at(file, f"this is {kind}", "Export it as CSV text.")
    try:
        text = content.decode("utf-8-sig")
    except UnicodeDecodeError as error:
        line = content.count(b"\n", 0, error.start) + 1
        raise InvalidInput.at(
            f"{file}:{line}", f"byte {error.start} is not UTF-8", "Save it as CSV text in UTF-8."
        ) from None
    nothing = text.find("\0")
    if nothing >= 0:
        line = text.count("\n", 0, nothing) + 1
        raise InvalidInput.at(f"{file}:{line}", "this is a binary file", "Export it as CSV text.")
    return text


def shown_path(file: str) -> str:
    """Return a path as messages show it."""
    return one_line(file, len(file))
