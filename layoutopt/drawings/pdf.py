"""Sheets as PDF pages of exact paper size: lines at true scale, searchable text, the same bytes each time."""

import io
import os
from collections.abc import Sequence

from layoutopt.atomic_file import replacing
from layoutopt.drawings.canvas import drawing_settings, figure
from layoutopt.drawings.sheet import Sheet


def render_pdf(sheet: Sheet | Sequence[Sheet], path: str | os.PathLike[str]) -> None:
    """Write one sheet, or a set of sheets as the pages of one document, to ``path``.

    Raises
    ------
    ValueError
        If the set is empty.
    OSError
        If the file cannot be written; what was there before stays.
    """
    from matplotlib.backends.backend_pdf import PdfPages

    sheets = (sheet,) if isinstance(sheet, Sheet) else tuple(sheet)
    if not sheets:
        raise ValueError("a drawing set needs at least one sheet")
    # No date: equal sheets must give equal files.
    metadata = {"Title": sheets[0].title, "Creator": "layoutopt", "CreationDate": None}
    # In memory first: closing a document after a full disk fails in a way that hides the reason.
    document = io.BytesIO()
    with drawing_settings(), PdfPages(document, metadata=metadata) as pages:
        for page in sheets:
            pages.savefig(figure(page))
    with replacing(path) as temporary:
        temporary.write_bytes(document.getvalue())
