"""Sheets as SVG of exact paper size: lines of a layer are one path, text is text, same bytes each time."""

import os

from layoutopt.atomic_file import replacing
from layoutopt.drawings.canvas import drawing_settings, figure
from layoutopt.drawings.sheet import Sheet


def render_svg(sheet: Sheet, path: str | os.PathLike[str]) -> None:
    """Write the sheet to ``path``; groups are named by view and layer, for example ``view1-A-TAGS-7``.

    Raises
    ------
    OSError
        If the file cannot be written; what was there before stays.
    """
    # No date: equal sheets must give equal files.
    metadata = {"Title": sheet.title, "Creator": "layoutopt", "Date": None}
    with replacing(path) as temporary, drawing_settings():
        figure(sheet).savefig(temporary, format="svg", metadata=metadata)
