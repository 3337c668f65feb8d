"""A sheet as a matplotlib figure of exactly the paper's size: what `pdf` and `svg` have in common.

Everything is brought to paper millimetres in float64 here; the only transform left to matplotlib is
millimetres to points. Lines of one layer become one path, marks one collection, so that the number of artists
does not grow with the number of tags.
"""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from layoutopt.drawings.layers import PENS, Pen
from layoutopt.drawings.lettering import font_file, points, printable
from layoutopt.drawings.sheet import Box, Circle, Entity, Line, Marks, Polyline, Sheet, Text, View
from layoutopt.drawings.symbols import SYMBOLS
from layoutopt.drawings.text_boxes import base_line
from layoutopt.identity import FloatArray

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.figure import Figure
    from matplotlib.path import Path
    from matplotlib.transforms import Transform

POINTS_PER_MM = 72.0 / 25.4
_ALIGNMENTS: dict[float, Literal["left", "center", "right"]] = {0.0: "left", 0.5: "center", 1.0: "right"}
_SETTINGS: dict[str, Any] = {
    "lines.scale_dashes": False,  # pens give dashes in millimetres, not in line widths
    "path.simplify": False,  # simplification would move points of a drawing
    "pdf.fonttype": 42,  # whole letters, so that text can be searched and copied
    "svg.fonttype": "none",  # text stays text
    "svg.hashsalt": "layoutopt",  # otherwise ids are drawn at random
    "text.usetex": False,
}


@contextmanager
def drawing_settings() -> Iterator[None]:
    """Set matplotlib to what true-scale, repeatable sheets need, whatever the user's matplotlibrc says."""
    import matplotlib

    with matplotlib.rc_context():
        matplotlib.rcdefaults()
        matplotlib.rcParams.update(_SETTINGS)  # type: ignore[arg-type, unused-ignore]
        yield


def figure(sheet: Sheet) -> "Figure":
    """Return the sheet as a figure; to be called and saved inside `drawing_settings`."""
    from matplotlib.figure import Figure

    width_mm, height_mm = sheet.size_mm
    page = Figure(figsize=(width_mm / 25.4, height_mm / 25.4), facecolor="white")
    painter = _Painter(page)
    for number, view in enumerate(sheet.views, start=1):
        painter.paint(f"view{number}", view.entities, view)
    painter.paint("paper", sheet.entities, None)
    return page


class _Painter:
    """Adds artists to one figure, later ones above earlier ones."""

    def __init__(self, page: "Figure") -> None:
        from matplotlib.transforms import Affine2D

        self._page = page
        self._to_page: Transform = Affine2D().scale(1 / 25.4) + page.dpi_scale_trans
        self._count = 0

    def paint(self, name: str, entities: Sequence[Entity], view: View | None) -> None:
        """Draw fills first, then lines layer by layer, marks and texts."""
        window = None if view is None else view.window_mm
        for entity in entities:
            if isinstance(entity, Polyline | Circle) and entity.fill is not None:
                self._fill(f"{name}-{entity.layer}-fill", _outline(entity, view), entity.fill, window)
        for layer, pen in PENS.items():
            here = [entity for entity in entities if entity.layer == layer]
            outlines = [_outline(entity, view) for entity in here if isinstance(entity, Line | Polyline | Circle)]
            if outlines:
                self._lines(f"{name}-{layer}", outlines, pen, window)
            for entity in here:
                if isinstance(entity, Marks) and len(entity.points_mm):
                    self._marks(f"{name}-{layer}", entity, view)
        for entity in entities:
            if isinstance(entity, Text) and entity.text.strip():
                self._text(f"{name}-{entity.layer}-text", entity, view)

    def _add(self, name: str, artist: "Artist", window: Box | None) -> None:
        from matplotlib.transforms import Bbox, TransformedBbox

        self._count += 1
        artist.set_gid(f"{name}-{self._count}")
        artist.set_zorder(self._count)
        self._page.add_artist(artist)
        if window is not None:
            corners = Bbox.from_extents(*window)
            artist.set_clip_box(TransformedBbox(corners, self._to_page))
            artist.set_clip_on(True)

    def _lines(self, name: str, outlines: "Sequence[Path]", pen: Pen, window: Box | None) -> None:
        from matplotlib.patches import PathPatch
        from matplotlib.path import Path

        path = Path.make_compound_path(*outlines)
        self._add(name, PathPatch(path, fill=False, transform=self._to_page, **_stroke(pen)), window)

    def _fill(self, name: str, outline: "Path", colour: str, window: Box | None) -> None:
        from matplotlib.patches import PathPatch

        patch = PathPatch(outline, facecolor=colour, edgecolor="none", linewidth=0, transform=self._to_page)
        self._add(name, patch, window)

    def _marks(self, name: str, marks: Marks, view: View | None) -> None:
        from matplotlib.collections import PathCollection
        from matplotlib.path import Path

        scale = 1 if view is None else view.scale
        centres = marks.points_mm if view is None else view.on_paper(marks.points_mm)
        size = marks.drawn_size_mm(scale) / scale
        symbol, pen = SYMBOLS[marks.symbol], PENS[marks.layer]
        drawn = [_chain(np.array(line) * size, closed=False) for line in symbol.lines]
        drawn += [_chain(np.array(outline) * size, closed=True) for outline in symbol.outlines]
        drawn += [_circle(np.array(centre) * size, radius * size) for centre, radius in symbol.circles]
        filled = [_chain(np.array(polygon) * size, closed=True) for polygon in symbol.polygons]
        filled += [_circle(np.array(centre) * size, radius * size) for centre, radius in symbol.discs]
        looks: list[tuple[list[Path], dict[str, Any]]] = [
            (filled, {"facecolors": pen.colour, "edgecolors": "none", "linewidths": 0.0}),
            (
                drawn,
                {"facecolors": "none", "edgecolors": pen.colour, "linewidths": pen.width_mm * POINTS_PER_MM},
            ),
        ]
        for paths, look in looks:
            if paths:
                # The sheet-wide dash pattern of a layer is for its lines; a symbol is too small to be dashed.
                collection = PathCollection(
                    [Path.make_compound_path(*paths)], offsets=centres, offset_transform=self._to_page, **look
                )
                collection.set_transform(self._to_page)
                self._add(name, collection, None if view is None else view.window_mm)

    def _text(self, name: str, text: Text, view: View | None) -> None:
        from matplotlib.font_manager import FontProperties
        from matplotlib.text import Text as TextArtist

        start, share = base_line(text, 1 if view is None else view.scale)
        foot = np.array([start]) if view is None else view.on_paper(np.array([start]))
        artist = TextArtist(
            float(foot[0, 0]),
            float(foot[0, 1]),
            printable(text.text),
            transform=self._to_page,
            color=PENS[text.layer].colour,
            fontproperties=FontProperties(
                family="DejaVu Sans", fname=str(font_file()), size=points(text.height_mm)
            ),
            horizontalalignment=_ALIGNMENTS[share],
            verticalalignment="baseline",
            rotation=text.angle_deg,
            rotation_mode="anchor",
            parse_math=False,  # a dollar sign in a title is a dollar sign
        )
        self._add(name, artist, None if view is None else view.window_mm)


def _stroke(pen: Pen) -> dict[str, Any]:
    """Return the matplotlib keywords of a pen, lengths in points."""
    dashes = tuple(length * POINTS_PER_MM for length in pen.dash_mm)
    return {
        "edgecolor": pen.colour,
        "linewidth": pen.width_mm * POINTS_PER_MM,
        "linestyle": (0.0, dashes) if dashes else "solid",
        "capstyle": "butt",
        "joinstyle": "miter",
    }


def _outline(entity: Line | Polyline | Circle, view: View | None) -> "Path":
    """Return the path of an entity, in paper millimetres."""
    if isinstance(entity, Circle):
        centre = np.array([entity.centre_mm])
        if view is None:
            return _circle(centre[0], entity.radius_mm)
        return _circle(view.on_paper(centre)[0], entity.radius_mm / view.scale)
    corners = np.array([entity.start_mm, entity.end_mm]) if isinstance(entity, Line) else entity.points_mm
    on_paper = corners if view is None else view.on_paper(corners)
    return _chain(on_paper, closed=isinstance(entity, Polyline) and entity.closed)


def _chain(corners: FloatArray, *, closed: bool) -> "Path":
    from matplotlib.path import Path

    codes = [Path.MOVETO] + [Path.LINETO] * (len(corners) - 1)
    if not closed:
        return Path(corners, codes)
    return Path(np.vstack([corners, corners[:1]]), [*codes, Path.CLOSEPOLY])


def _circle(centre: FloatArray, radius_mm: float) -> "Path":
    from matplotlib.path import Path
    from matplotlib.transforms import Affine2D

    return Path.unit_circle().transformed(Affine2D().scale(radius_mm).translate(centre[0], centre[1]))
