"""Every fault of one file, collected with its line before anything is raised."""

import re
from collections.abc import Mapping
from typing import Final

from layoutopt.errors import Fault, InvalidInput
from layoutopt.spec.lines import KeyPath, key_lines, line_of, written

MAXIMUM_FAULTS: Final = 100
_SHOWN_CHARACTERS: Final = 60
_SHOWN_ELEMENTS: Final = 6
_ELEMENT = re.compile(r"(?:\[\d+\])*")


class Findings:
    """Collects the faults of a file; lines are looked up only once there is a fault.

    ``text`` is the file's text and ``document`` what it says, so that a fault can show the value; ``count`` is
    how many faults were noted.
    """

    def __init__(self, file: str, text: str, document: Mapping[str, object]) -> None:
        self.file = file
        self.count = 0
        self._faults: dict[Fault, None] = {}
        self._text = text
        self._document = document
        self._lines: Mapping[KeyPath, int] | None = None

    def place(self, path: KeyPath = ()) -> str:
        """Return file, line, key and value as one text: ``ward.toml:14 space.antenna_side[2] = "6 cm2"``."""
        if self._lines is None:
            self._lines = key_lines(self._text)
        line = line_of(path, self._lines)
        place = self.file if line is None else f"{self.file}:{line}"
        if path:
            shown = _shown(self._value(path))
            place += f" {written(path)}" + (f" = {shown}" if shown else "")
        return place

    def add(self, path: KeyPath, problem: str, repair: str) -> None:
        """Note what is wrong with the value of a key, and what would be right."""
        self._keep(path, "", problem, repair)

    def take(self, error: InvalidInput, path: KeyPath = ()) -> None:
        """Note the faults that the reader of a value found, who was told no place or `written` of the path.

        Such a reader numbers the elements of a list behind the path; any other place, such as a line of another
        file, is kept and follows the key.
        """
        key = written(path)
        for fault in error.faults:
            number = _ELEMENT.fullmatch(fault.place.removeprefix(key)) if fault.place.startswith(key) else None
            if number is not None:
                element = tuple(int(part) for part in number[0].strip("[]").split("][") if part)
                self._keep((*path, *element), "", fault.problem, fault.repair)
            else:
                self._keep(path, f" -> {fault.place.removeprefix(f'{key} -> ')}", fault.problem, fault.repair)

    def raise_any(self) -> None:
        """Raise what was found.

        Raises
        ------
        InvalidInput
            If there is any fault.
        """
        faults = list(self._faults)
        if self.count > MAXIMUM_FAULTS:
            more = Fault(
                place=self.file,
                problem=f"there are {self.count - MAXIMUM_FAULTS} more faults",
                repair="Mend those above first.",
            )
            faults.append(more)
        if faults:
            raise InvalidInput(faults)

    def _keep(self, path: KeyPath, behind: str, problem: str, repair: str) -> None:
        self.count += 1
        # A damaged file of megabytes can have a fault a line: no one reads them all.
        if self.count <= MAXIMUM_FAULTS:
            self._faults[Fault(place=self.place(path) + behind, problem=problem.rstrip("."), repair=repair)] = None

    def _value(self, path: KeyPath) -> object:
        value: object = self._document
        for part in path:
            try:
                value = value[part]  # type: ignore[index]
            except (TypeError, KeyError, IndexError):
                return None
        return value


def _shown(value: object) -> str:
    """Return a value as the file has it, shortened; nothing for a missing value or a table."""
    if isinstance(value, str):
        text = '"' + value[:_SHOWN_CHARACTERS].replace("\n", "\\n") + '"'
    elif isinstance(value, bool):
        text = str(value).lower()
    elif isinstance(value, int) and abs(value) > 10**30:
        # Python refuses to write out very long whole numbers.
        text = f"a whole number of {value.bit_length()} bits"
    elif isinstance(value, list):
        shown = [_shown(item) or "..." for item in value[:_SHOWN_ELEMENTS]] + ["..."] * (
            len(value) > _SHOWN_ELEMENTS
        )
        text = f"[{', '.join(shown)}]"
    elif value is None or isinstance(value, Mapping):
        return ""
    else:
        text = str(value)
    return text if len(text) <= _SHOWN_CHARACTERS else text[: _SHOWN_CHARACTERS - 3] + "..."
