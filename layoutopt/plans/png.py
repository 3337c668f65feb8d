"""Grey values of a PNG image; the one place that knows the image library."""

import struct
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from typing import Final

import numpy as np
from numpy.typing import NDArray

from layoutopt.errors import InvalidInput
from layoutopt.identity import BoolArray
from layoutopt.plans.floor import file_bytes
from layoutopt.plans.grey_map import LARGEST_PIXEL_COUNT

MAGIC: Final = b"\x89PNG\r\n\x1a\n"
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
        lightness, painted = _unpacked(content)
    except Exception as error:
        # The library raises whatever a damaged chunk leads it to: OSError, SyntaxError, ValueError, struct.error.
        reason = str(error).splitlines()[0][:200] if str(error) else type(error).__name__
        raise InvalidInput.at(place, f"{path.name} is damaged: {reason}", "Save it as PNG once more.") from error
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
