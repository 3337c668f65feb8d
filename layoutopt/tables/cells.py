"""Cells of tables as text: CSV that no spreadsheet takes for a formula, numbers of six decimals, and back.

Spreadsheets take a text that begins like a formula for one; such a text gets an apostrophe in front, which
`plain_cell` takes away again.
"""

import csv
import io
import re
import reprlib
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Final

from layoutopt.atomic_file import replacing
from layoutopt.errors import InvalidInput

_FORMULA: Final = re.compile(r"'*[\t\r\n]|[\s'\u200b\ufeff]*[=+\-@＝＋－＠]")


def write_csv(path: Path | str, header: Sequence[str], rows: Iterable[Sequence[str]]) -> None:
    """Write a table of finished cells as CSV, all at once; texts of the user's go through `text_cell` first.

    The header is guarded here: a zone's name may stand in it.
    """
    with replacing(path) as temporary, temporary.open("w", encoding="utf-8", newline="") as stream:
        for cells in ([text_cell(name) for name in header], *rows):
            stream.write(",".join(quoted(cell) for cell in cells) + "\n")


def quoted(cell: str) -> str:
    """Return a cell in quotes if CSV needs them."""
    # The csv module leaves a carriage return bare where lines end in a line feed alone.
    return '"' + cell.replace('"', '""') + '"' if re.search(r'[,"\r\n]', cell) else cell


def text_cell(text: str) -> str:
    """Return a text cell that no spreadsheet takes for a formula."""
    return f"'{text}" if _FORMULA.match(text) else text


def plain_cell(cell: str) -> str:
    """Return the text that `text_cell` made a cell of."""
    return cell[1:] if cell.startswith("'") and _FORMULA.match(cell[1:]) else cell


KINDS: Final[Mapping[object, str]] = {str: "text", int: "whole number", float: "finite number"}
"""What values of a column are called in messages."""


def shown(value: object) -> str:
    """Return a value as JSON and YAML have it, as far as messages quote it."""
    if value is None:
        return "null"
    return str(value).lower() if isinstance(value, bool) else reprlib.repr(value)


def rounded(value: float | int | str) -> float | int | str:
    """Return a number with six decimals and without a negative zero, anything else as it is."""
    # Adding zero turns -0.0 into 0.0.
    return round(value, 6) + 0.0 if isinstance(value, float) else value


def csv_lines(path: Path | str, largest: int) -> list[tuple[int, list[str]]]:
    """Return the rows of a CSV file of up to so many bytes, each with the number of its last line.

    Raises
    ------
    InvalidInput
        If it is no such file.
    """
    reader = csv.reader(io.StringIO(text_of(path, largest), newline=""), strict=True)
    try:
        return [(reader.line_num, cells) for cells in reader if cells]
    except csv.Error as error:
        raise InvalidInput.at(
            f"{path}:{reader.line_num}", f"this is no CSV: {error}", "Check quotes and line ends."
        ) from error


def text_of(path: Path | str, largest: int, otherwise: str = "") -> str:
    """Return the text of a file of up to so many bytes; ``otherwise`` is what to do with a larger one.

    Raises
    ------
    InvalidInput
        If it is no such file, or no text in UTF-8.
    """
    path = Path(path)
    try:
        if not path.is_file():
            raise InvalidInput.at(str(path), "there is no such file", "Check its name and folder.")
        if path.stat().st_size > largest:
            raise InvalidInput.at(str(path), f"the file has over {largest} bytes", otherwise)
        return path.read_bytes().decode("utf-8-sig")
    except UnicodeDecodeError as error:
        raise InvalidInput.at(str(path), f"byte {error.start} is not UTF-8", "Save it as UTF-8 text.") from error
    except (OSError, ValueError) as error:
        raise InvalidInput.at(str(path), f"cannot be read ({error})", "Check the right to read it.") from error
