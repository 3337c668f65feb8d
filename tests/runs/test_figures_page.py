"""The code on the page about figures runs as it stands, and its pictures are there and small."""

import contextlib
import re
from pathlib import Path

import pytest

DOCS = Path(__file__).parents[2] / "docs"
PAGE = (DOCS / "figures.md").read_text(encoding="utf-8")
NAMES = ("figure_layout", "figure_rose", "figure_local_error", "figure_replay")
MOST_BYTES = 150_000


def test_every_picture_of_the_page_is_there_and_small():
    for name in NAMES:
        assert f"(pictures/{name}.png)" in PAGE
        assert 10_000 < (DOCS / "pictures" / f"{name}.png").stat().st_size < MOST_BYTES, name


@pytest.mark.long
def test_the_code_of_the_page_makes_its_figures(tmp_path):
    """All blocks one after the other, as a reader would run them; what they save has the names of the pictures."""
    blocks = re.findall(r"```python\n(.*?)```", PAGE, flags=re.DOTALL)
    assert len(blocks) == 6
    known = {}
    with contextlib.chdir(tmp_path):
        for block in blocks:
            exec(block, known)
    written = {path.name for path in tmp_path.iterdir()}
    assert written == {"both.png", *(f"{name}.{kind}" for name in NAMES for kind in ("svg", "png"))}
