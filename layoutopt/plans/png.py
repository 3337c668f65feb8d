"""Grey values of a PNG image; the one place that knows the image library.

References
----------
W3C, *Portable Network Graphics (PNG) Specification*: chunks, lengths of rows, interlacing (Adam7).
"""

import struct
import zlib
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from layoutopt.errors import InvalidInput
from layoutopt.identity import BoolArray
from layoutopt.plans.floor import file_bytes, reason_of
from layoutopt.plans.grey_map import LARGEST_PIXEL_COUNT

MAGIC: Final = b"\x89PNG\r\n\x1a\n"
_CHANNELS: Final = {0: 1, 2: 3, 3: 1, 4: 2, 6: 4}
# First column and row of each pass of an interlaced image, and the steps from there.
_PASSES: Final = ((0, 0, 8, 8), (4, 0, 8, 8), (0, 4, 4, 8), (2, 0, 4, 4), (0, 2, 2, 4), (1, 0, 2, 2), (0, 1, 1, 2))
_PIECE_BYTES: Final = 1 << 20
_OPAQUE: Final = 128  # alpha from which a pixel counts as painted


@dataclass(frozen=True, slots=True, kw_only=True)
class Picture:
    """``lightness``, 0 to 255, and ``painted``, false where transparent; shape (height, width), top row first."""

    name: str
    lightness: NDArray[np.uint8]
    painted: BoolArray


def read_png(path: Path, *, place: str) -> Picture:
    """Return the grey values of a PNG file; colours become their luminance (ITU-R 601).

    Raises
    ------
    InvalidInput
        If the file cannot be read, is no PNG, is damaged, or holds more than `LARGEST_PIXEL_COUNT` pixels.
    """
    content = file_bytes(path, place)
    if not content.startswith(MAGIC) or len(content) < 33:
        raise InvalidInput.at(place, f"{path.name} is no PNG image", "Save the plan as PNG.")
    # The header is read before the library unpacks anything, so that a small file cannot ask for much memory.
    width, height = struct.unpack(">II", content[16:24])
    if not 1 <= width * height <= LARGEST_PIXEL_COUNT:
        raise InvalidInput.at(
            place,
            f"{path.name} has {width} x {height} pixels",
            f"At least 1, at most {LARGEST_PIXEL_COUNT:,} are read.",
        )
    try:
        _refuse_missing_rows(content, width, height)
        lightness, painted = _unpacked(content)
    except Exception as error:
        # The library raises whatever a damaged chunk leads it to: OSError, SyntaxError, ValueError, struct.error.
        raise InvalidInput.at(
            place, f"{path.name} is damaged: {reason_of(error)}", "Save it as PNG once more."
        ) from error
    if lightness.shape != (height, width):
        raise InvalidInput.at(place, f"{path.name} says two sizes of itself", "Save it as PNG once more.")
    return Picture(name=path.name, lightness=lightness, painted=painted)


def _unpacked(content: bytes) -> tuple[NDArray[np.uint8], BoolArray]:
    from PIL import Image

    with Image.open(BytesIO(content), formats=("PNG",)) as image:
        image.load()
        if image.mode.startswith("I"):
            values = np.asarray(image, dtype=np.int64)
            return (values >> 8).astype(np.uint8), np.ones(values.shape, dtype=np.bool_)
        pixels = np.asarray(image.convert("RGBA").convert("LA"))
    return np.ascontiguousarray(pixels[:, :, 0]), np.asarray(pixels[:, :, 1] >= _OPAQUE, dtype=np.bool_)


def _refuse_missing_rows(content: bytes, width: int, height: int) -> None:
    """Raise ValueError if the image holds less or more than it says; the library would fill up with black."""
    depth, colour, _, _, interlaced = content[24:29]
    bits = depth * _CHANNELS[colour]
    passes = _PASSES if interlaced else ((0, 0, 1, 1),)
    sizes = [(-(-(width - x) // dx), -(-(height - y) // dy)) for x, y, dx, dy in passes]
    needed = sum(rows * (1 + -(-columns * bits // 8)) for columns, rows in sizes if columns > 0 and rows > 0)
    unpacker, have, at = zlib.decompressobj(), 0, len(MAGIC)
    while at + 12 <= len(content) and have <= needed:
        length = int.from_bytes(content[at : at + 4], "big")
        if content[at + 4 : at + 8] == b"IDAT":
            packed = content[at + 8 : at + 8 + length]
            while packed and have <= needed:
                have += len(unpacker.decompress(packed, _PIECE_BYTES))
                packed = unpacker.unconsumed_tail
        at += 12 + length
    have += len(unpacker.flush(_PIECE_BYTES)) if have < needed else 0
    if have != needed:
        raise ValueError(f"it holds {have} bytes of pixels where {needed} are needed")
