"""Portable grey maps (PGM), binary (P5) and plain (P2), read without an image library.

References
----------
Netpbm, *PGM Format Specification*: header of magic number, width, height and largest value, with comments from
``#`` to the end of the line; two bytes a pixel, high byte first, if the largest value is above 255.
"""

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Final

import numpy as np
from numpy.typing import NDArray

from layoutopt.errors import InvalidInput
from layoutopt.plans.floor import file_bytes

LARGEST_PIXEL_COUNT: Final = 40_000_000

# Blanks and comments, then digits: one number of the header.
_NUMBER: Final = re.compile(rb"(?:\s|#[^\n\r]*[\n\r])+(\d{1,9})(?=\s|#)")
_COMMENT: Final = re.compile(rb"#[^\n\r]*")
_OTHER_FORMATS: Final = {
    b"\x89PNG": "a PNG image",
    b"\xff\xd8\xff": "a JPEG image",
    b"BM": "a BMP image",
    b"GIF8": "a GIF image",
    b"%PDF": "a PDF document",
    b"P1": "a bitmap (PBM)",
    b"P4": "a bitmap (PBM)",
    b"P3": "a colour image (PPM)",
    b"P6": "a colour image (PPM)",
    b"P7": "a PAM image",
}
_CONVERT: Final = "Convert it to a grey PGM, for example with 'convert map.png map.pgm'."
_AGAIN: Final = "Copy or save the map again; width and height stand in its first lines."


@dataclass(frozen=True, slots=True, kw_only=True)
class GreyMap:
    """A grey image: ``values``, shape (height, width), top row first, from 0 to ``largest``."""

    name: str
    values: NDArray[np.unsignedinteger[Any]]
    largest: int

    @property
    def width(self) -> int:
        """Number of columns."""
        return int(self.values.shape[1])

    @property
    def height(self) -> int:
        """Number of rows."""
        return int(self.values.shape[0])


def read_grey_map(path: Path, *, place: str) -> GreyMap:
    """Return the image of a PGM file.

    Raises
    ------
    InvalidInput
        If the file cannot be read, is of another format, holds more or fewer pixels than it says or more than
        `LARGEST_PIXEL_COUNT`, or a pixel beyond its own largest value.
    """
    content = file_bytes(path, place)
    name = path.name
    magic = content[:2]
    if magic not in (b"P2", b"P5"):
        kind = next((kind for start, kind in _OTHER_FORMATS.items() if content.startswith(start)), "no PGM image")
        raise InvalidInput.at(place, f"{name} is {kind}", _CONVERT)
    position = 2
    header: list[int] = []
    for what in ("width", "height", "largest value"):
        match = _NUMBER.match(content, position)
        if match is None:
            raise InvalidInput.at(place, f"the header of {name} has no usable {what}", _CONVERT)
        header.append(int(match[1]))
        position = match.end()
    width, height, largest = header
    if min(width, height) < 1 or width * height > LARGEST_PIXEL_COUNT:
        raise InvalidInput.at(
            place,
            f"{name} has {width} x {height} pixels",
            f"At least 1, at most {LARGEST_PIXEL_COUNT:,} are read.",
        )
    if not 1 <= largest <= 65535:
        raise InvalidInput.at(place, f"the largest value of {name} is {largest}", "It must lie in 1..65535.")
    read = _plain_pixels if magic == b"P2" else _binary_pixels
    values = read(content[position:], width * height, largest, f"{name} ({width} x {height} pixels)", place)
    if int(values.max()) > largest:
        row, column = divmod(int(np.argmax(values > largest)), width)
        raise InvalidInput.at(
            place,
            f"{name} holds {values[row * width + column]} in row {row}, column {column}, beyond {largest}",
            _CONVERT,
        )
    return GreyMap(name=name, values=values.reshape(height, width), largest=largest)


def _binary_pixels(
    content: bytes, count: int, largest: int, name: str, place: str
) -> NDArray[np.unsignedinteger[Any]]:
    # Exactly one blank ends the header; the next byte is a pixel even if it looks like a blank.
    kind = np.dtype(np.uint8) if largest < 256 else np.dtype(">u2")
    needed, have = count * kind.itemsize, len(content) - 1
    if have < needed:
        raise InvalidInput.at(
            place, f"{name} is cut off: {have} bytes of pixels where {needed} are needed", _AGAIN
        )
    if content[1 + needed :].strip():
        raise InvalidInput.at(
            place, f"{name} goes on for {have - needed} bytes after its last pixel", "Check width and height."
        )
    return np.frombuffer(content, dtype=kind, count=count, offset=1)


def _plain_pixels(
    content: bytes, count: int, largest: int, name: str, place: str
) -> NDArray[np.unsignedinteger[Any]]:
    text = _COMMENT.sub(b" ", content)
    foreign = re.search(rb"[^\d\s]", text)
    if foreign is not None:
        raise InvalidInput.at(place, f"{name} holds {foreign[0]!r} among its numbers", _CONVERT)
    numbers = np.fromstring(text.decode("ascii"), dtype=np.float64, sep=" ") if text.strip() else np.empty(0)
    if len(numbers) != count:
        raise InvalidInput.at(place, f"{name} holds {len(numbers)} numbers where {count} are needed", _AGAIN)
    if numbers.max() > largest:
        raise InvalidInput.at(
            place, f"{name} holds {numbers.max():g}, beyond its largest value {largest}", _CONVERT
        )
    return numbers.astype(np.uint16)
