"""Every fault of one file, collected with its line before anything is raised."""

import re
from collections.abc import Mapping

from layoutopt.errors import Fault, InvalidInput
from layoutopt.spec.lines import KeyPath, key_lines, line_of, written

_SHOWN_CHARACTERS = 60
_ELEMENT = re.compile(r"(?:\[\d+\])*")


class Findings:
    """Collects the faults of a file; lines are looked up only once there is a fault.

    ``text`` is the file's text and ``document`` what it says, so that a fault can show the value.
    """

    def __init__(self, file: str, text: str, document: Mapping[str, object]) -> None:
        self.file = file
        self.faults: list[Fault] = []
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
        fault = Fault(place=self.place(path), problem=problem.rstrip("."), repair=repair)
        if fault not in self.faults:
            self.faults.append(fault)

    def take(self, error: InvalidInput, path: KeyPath = ()) -> None:
        """Note the faults that the reader of a value found, who was told no place or `written` of the path.

        Such a reader numbers the elements of a list behind the path; any other place, such as a line of another
        file, is kept and follows the key.
        """
        key = written(path)
        for fault in error.faults:
            number = _ELEMENT.fullmatch(fault.place.removeprefix(key)) if fault.place.startswith(key) else None
            if number is not None:
                own = self.place((*path, *(int(part) for part in number[0].strip("[]").split("][") if part)))
            else:
                own = f"{self.place(path)} -> {fault.place}" if path else fault.place
            placed = Fault(place=own, problem=fault.problem.rstrip("."), repair=fault.repair)
            if placed not in self.faults:
                self.faults.append(placed)

    def raise_any(self) -> None:
        """Raise what was found.

        Raises
        ------
        InvalidInput
            If there is any fault.
        """
        if self.faults:
            raise InvalidInput(self.faults)

    def _value(self, path: KeyPath) -> object:
        value: object = self._document
        for part in path:
            try:
                value = value[part]  # type: ignore[index]
            except (TypeError, KeyError, IndexError):
                return None
        return value


def _shown(value: object) -> str:
    """Return a value as the file has it, shortened; nothing for a missing value, a table or a list of tables."""
    if isinstance(value, str):
        text = '"' + value.replace("\n", "\\n") + '"'
    elif isinstance(value, bool):
        text = str(value).lower()
    elif isinstance(value, int) and abs(value) > 10**30:
        # Python refuses to write out very long whole numbers.
        text = f"a whole number of {value.bit_length()} bits"
    elif value is None or isinstance(value, Mapping):
        return ""
    else:
        text = str(value)
    return text if len(text) <= _SHOWN_CHARACTERS else text[: _SHOWN_CHARACTERS - 3] + "..."
