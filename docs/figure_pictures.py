"""The pictures of the page on figures, made by the code that stands on it."""

import contextlib
import re
import tempfile
from pathlib import Path
from typing import Final

from PIL import Image

_PAGE: Final = Path(__file__).with_name("figures.md")
_NAME: Final = re.compile(r"\]\(pictures/(\w+)\.png\)")
_WIDTH: Final = 1100
"""Pixels, as wide as the site shows a picture on a screen of high resolution."""
_COLOURS: Final = 128


def draw_figure_page(pictures: Path) -> None:
    """Run the code of the page and put what it saves into the folder of pictures, with fewer dots and colours."""
    page = _PAGE.read_text(encoding="utf-8")
    known: dict[str, object] = {}
    with tempfile.TemporaryDirectory() as place, contextlib.chdir(place):
        for block in re.findall(r"```python\n(.*?)```", page, flags=re.DOTALL):
            exec(block, known)
        for name in _NAME.findall(page):
            with Image.open(f"{name}.png") as picture:
                height = round(picture.height * _WIDTH / picture.width)
                small = picture.convert("RGB").resize((_WIDTH, height), Image.Resampling.LANCZOS)
                # The method that keeps colours of which there is little, such as those of small marks.
                few = small.quantize(_COLOURS, method=Image.Quantize.MAXCOVERAGE, dither=Image.Dither.NONE)
                few.save(pictures / f"{name}.png", optimize=True)
