"""One sheet of a drawing set: views at exact scale and paper entities, in millimetres, free of any file format.

A `View` holds entities in real-world millimetres and says where and at which ISO 5455 scale they land on the
paper; the sheet's own entities (frame, title block, notes) are in paper millimetres, origin at the lower left
corner of the trimmed sheet, x to the right, y up. Text heights are always paper millimetres, whatever the scale.
"""

import math
import re
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from typing import Literal, NamedTuple, get_args

import numpy as np

from layoutopt.drawings.layers import Layer, known_layer
from layoutopt.drawings.lettering import single_line
from layoutopt.drawings.symbols import SYMBOLS, Point, SymbolName
from layoutopt.identity import FloatArray, by_content, read_only

PaperName = Literal["A4", "A3", "A2", "A1", "A0"]
PAPERS_MM: dict[PaperName, tuple[float, float]] = {
    "A4": (297.0, 210.0),
    "A3": (420.0, 297.0),
    "A2": (594.0, 420.0),
    "A1": (841.0, 594.0),
    "A0": (1189.0, 841.0),
}
SCALES = (1, 2, 5, 10, 20, 50, 100, 200, 500, 1000, 2000, 5000, 10000)
"""Denominators of the reducing scales of ISO 5455: 50 stands for 1:50."""

FILING_MARGIN_MM = 20.0
MARGIN_MM = 10.0
TITLE_STRIP_MM = 44.0
"""Height above the frame's lower edge that is kept for title block, scale bar, legend and notes."""

Anchor = Literal[
    "left", "centre", "right", "middle-left", "middle", "middle-right", "top-left", "top", "top-right"
]
"""Which point of a text lies at its position; the first three are on the base line."""
ANCHORS: tuple[str, ...] = get_args(Anchor)


_COLOUR = re.compile(r"#[0-9a-f]{6}")


class Box(NamedTuple):
    """An upright rectangle, millimetres."""

    xmin: float
    ymin: float
    xmax: float
    ymax: float

    @property
    def width(self) -> float:
        """Extent along x, mm."""
        return self.xmax - self.xmin

    @property
    def height(self) -> float:
        """Extent along y, mm."""
        return self.ymax - self.ymin

    @property
    def centre(self) -> Point:
        """Middle of the box, mm."""
        return (self.xmin + self.xmax) / 2, (self.ymin + self.ymax) / 2

    def overlaps(self, other: "Box") -> bool:
        """Tell whether the interiors of the two boxes meet."""
        return (
            self.xmin < other.xmax and other.xmin < self.xmax and self.ymin < other.ymax and other.ymin < self.ymax
        )

    def inside(self, other: "Box", tolerance_mm: float = 1e-6) -> bool:
        """Tell whether this box lies in the other one, its border included."""
        return (
            self.xmin >= other.xmin - tolerance_mm
            and self.ymin >= other.ymin - tolerance_mm
            and self.xmax <= other.xmax + tolerance_mm
            and self.ymax <= other.ymax + tolerance_mm
        )


def _finite(*numbers: float) -> None:
    if not all(math.isfinite(number) for number in numbers):
        raise ValueError(f"numbers of a drawing must be finite, not {numbers}")


def _colour(fill: str | None) -> None:
    if fill is not None and not _COLOUR.fullmatch(fill):
        raise ValueError(f"fill {fill!r} is not of the form #rrggbb")


def _positive(name: str, number: float) -> None:
    if not (math.isfinite(number) and number > 0):
        raise ValueError(f"{name} must be positive, not {number}")


@dataclass(frozen=True, slots=True, kw_only=True)
class Line:
    """A straight line between two points."""

    layer: Layer
    start_mm: Point
    end_mm: Point

    def __post_init__(self) -> None:
        known_layer(self.layer)
        _finite(*self.start_mm, *self.end_mm)


@by_content
@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Polyline:
    """A chain of straight lines through ``points_mm`` (n, 2), n >= 2.

    ``fill`` is ``#rrggbb`` and needs a closed chain; fills lie below all lines of their view.
    """

    layer: Layer
    points_mm: FloatArray
    closed: bool = False
    fill: str | None = None
    key: str = field(init=False, repr=False, default="")

    def __post_init__(self) -> None:
        known_layer(self.layer)
        object.__setattr__(self, "points_mm", read_only(self.points_mm, (-1, 2)))
        if len(self.points_mm) < 2:
            raise ValueError("a polyline needs at least two points")
        if self.fill is not None and not self.closed:
            raise ValueError("only a closed polyline can be filled")
        _colour(self.fill)


@dataclass(frozen=True, slots=True, kw_only=True)
class Circle:
    """A circle, optionally filled with ``#rrggbb``."""

    layer: Layer
    centre_mm: Point
    radius_mm: float
    fill: str | None = None

    def __post_init__(self) -> None:
        known_layer(self.layer)
        _finite(*self.centre_mm)
        _positive("radius_mm", self.radius_mm)
        _colour(self.fill)


@by_content
@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Marks:
    """Many copies of one symbol, for example all tags of a floor, held as one array.

    Attributes
    ----------
    points_mm
        Centres (n, 2), in the millimetres of the view.
    size_mm
        True size of the marked thing, in the millimetres of the view.
    printed_mm
        The symbol is printed at its true size, but never smaller than this on paper.
    kind
        What is marked; names the DXF block and its first attribute (``tag`` gives ``TAG_ID``).
    ids
        One identity per point, or none. They become block attributes in DXF and are not printed: see
        `layoutopt.drawings.dimensions.mark_labels`.
    """

    layer: Layer
    points_mm: FloatArray
    symbol: SymbolName
    size_mm: float
    printed_mm: float = 0.0
    kind: str = "tag"
    ids: tuple[str, ...] | None = None
    key: str = field(init=False, repr=False, default="")

    def __post_init__(self) -> None:
        known_layer(self.layer)
        object.__setattr__(self, "points_mm", read_only(self.points_mm, (-1, 2)))
        _positive("size_mm", self.size_mm)
        _finite(self.printed_mm)
        if self.symbol not in SYMBOLS:
            raise ValueError(f"no symbol {self.symbol!r}; the symbols are {', '.join(SYMBOLS)}")
        if not self.kind.isidentifier():
            raise ValueError(f"kind {self.kind!r} must be a plain word: it names a DXF block")
        if self.ids is not None:
            object.__setattr__(self, "ids", tuple(single_line(identity) for identity in self.ids))
            if len(self.ids) != len(self.points_mm):
                raise ValueError(f"{len(self.ids)} ids for {len(self.points_mm)} points")

    def drawn_size_mm(self, scale: int) -> float:
        """Return the size of the symbol in the millimetres of the view at 1:``scale``."""
        return max(self.size_mm, self.printed_mm * scale)


@dataclass(frozen=True, slots=True, kw_only=True)
class Text:
    """One line of text; control characters become spaces, so that no file format can be broken by it.

    ``height_mm`` is the height of capitals on paper (ISO 3098), ``angle_deg`` turns counter-clockwise about
    ``position_mm``.
    """

    layer: Layer
    text: str
    position_mm: Point
    height_mm: float
    anchor: Anchor = "left"
    angle_deg: float = 0.0

    def __post_init__(self) -> None:
        known_layer(self.layer)
        _finite(*self.position_mm, self.angle_deg)
        _positive("height_mm", self.height_mm)
        if self.anchor not in ANCHORS:
            raise ValueError(f"no anchor {self.anchor!r}; the anchors are {', '.join(ANCHORS)}")
        object.__setattr__(self, "text", single_line(self.text))


Entity = Line | Polyline | Circle | Marks | Text


@dataclass(frozen=True, slots=True, kw_only=True)
class View:
    """A drawing at exact scale: ``paper = at_mm + (world - origin_mm) / scale``, cut off at ``window_mm``.

    Attributes
    ----------
    scale
        ISO 5455 denominator, 50 for 1:50.
    at_mm
        Point on paper where the world point ``origin_mm`` lands.
    window_mm
        Part of the paper that the view may cover.
    """

    name: str
    scale: int
    at_mm: Point
    window_mm: Box
    entities: tuple[Entity, ...]
    origin_mm: Point = (0.0, 0.0)

    def __post_init__(self) -> None:
        _finite(*self.at_mm, *self.window_mm, *self.origin_mm)
        object.__setattr__(self, "name", single_line(self.name))
        object.__setattr__(self, "entities", tuple(self.entities))
        if self.scale not in SCALES:
            raise ValueError(f"1:{self.scale} is no scale of ISO 5455")
        if self.window_mm.width <= 0 or self.window_mm.height <= 0:
            raise ValueError(f"view {self.name!r} has an empty window {self.window_mm}")

    def on_paper(self, points_mm: FloatArray) -> FloatArray:
        """Return world points (n, 2) as paper points (n, 2), mm."""
        placed: FloatArray = (points_mm - np.asarray(self.origin_mm)) / self.scale + np.asarray(self.at_mm)
        return placed

    def in_world(self, point_mm: Point) -> Point:
        """Return the world point that lands at a paper point, mm."""
        return (
            (point_mm[0] - self.at_mm[0]) * self.scale + self.origin_mm[0],
            (point_mm[1] - self.at_mm[1]) * self.scale + self.origin_mm[1],
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class Sheet:
    """One sheet of ISO paper, landscape: ``views`` to scale below ``entities`` in paper millimetres.

    ``number`` is its number in a set of sheets, such as ``A-201``.
    """

    title: str
    paper: PaperName
    views: tuple[View, ...] = ()
    entities: tuple[Entity, ...] = ()
    number: str = ""

    def __post_init__(self) -> None:
        if self.paper not in PAPERS_MM:
            raise ValueError(f"no paper {self.paper!r}; the papers are {', '.join(PAPERS_MM)}")
        object.__setattr__(self, "title", single_line(self.title))
        object.__setattr__(self, "views", tuple(self.views))
        object.__setattr__(self, "entities", tuple(self.entities))
        for view in self.views:
            if not view.window_mm.inside(self.box_mm):
                raise ValueError(f"window {view.window_mm} of view {view.name!r} leaves the {self.paper} paper")

    @property
    def size_mm(self) -> tuple[float, float]:
        """Width and height of the trimmed paper, mm."""
        return PAPERS_MM[self.paper]

    @property
    def box_mm(self) -> Box:
        """The trimmed paper as a box, mm."""
        return Box(0.0, 0.0, *self.size_mm)


def extent(entities: Iterable[Entity], scale: int = 1) -> Box:
    """Return the box around the geometry of ``entities``, texts left out, in their own millimetres.

    Raises
    ------
    ValueError
        If there is no geometry.
    """
    corners: list[FloatArray] = []
    for entity in entities:
        if isinstance(entity, Line):
            corners.append(np.array([entity.start_mm, entity.end_mm]))
        elif isinstance(entity, Circle):
            centre = np.asarray(entity.centre_mm)
            corners.append(np.array([centre - entity.radius_mm, centre + entity.radius_mm]))
        elif isinstance(entity, Polyline):
            corners.append(entity.points_mm)
        elif isinstance(entity, Marks) and len(entity.points_mm):
            half = entity.drawn_size_mm(scale) / 2
            corners.extend([entity.points_mm - half, entity.points_mm + half])
    if not corners:
        raise ValueError("nothing to draw: no entity has an extent")
    points = np.concatenate(corners)
    low, high = points.min(axis=0), points.max(axis=0)
    return Box(float(low[0]), float(low[1]), float(high[0]), float(high[1]))


def place_view(
    name: str, entities: Sequence[Entity], *, scale: int, room_mm: Box, extent_mm: Box | None = None
) -> View:
    """Return the view that centres ``extent_mm`` (by default all geometry) in ``room_mm`` on the paper.

    The room is also the window: what does not fit into it at this scale is cut off.
    """
    shown = extent(entities, scale) if extent_mm is None else extent_mm
    return View(
        name=name,
        scale=scale,
        at_mm=room_mm.centre,
        origin_mm=shown.centre,
        window_mm=room_mm,
        entities=tuple(entities),
    )


def fit_scale(extent_mm: tuple[float, float], room_mm: tuple[float, float]) -> int:
    """Return the denominator of the largest ISO 5455 scale at which ``extent_mm`` fits into ``room_mm``.

    Both are width and height in millimetres, of the thing and on the paper.

    Raises
    ------
    ValueError
        If it does not fit even at 1:10000.

    Examples
    --------
    >>> fit_scale((12000.0, 8000.0), (360.0, 200.0))
    50
    """
    for scale in SCALES:
        if all(size <= room * scale * (1 + 1e-9) for size, room in zip(extent_mm, room_mm, strict=True)):
            return scale
    raise ValueError(
        f"{extent_mm[0] / 1000:g} x {extent_mm[1] / 1000:g} m fits no sheet at 1:{SCALES[-1]}; "
        "is the plan in the right unit?"
    )


def drawing_room(paper: PaperName, clearance_mm: float = 0.0) -> Box:
    """Return the part of the paper inside the frame and above the title strip, ``clearance_mm`` kept free."""
    width_mm, height_mm = PAPERS_MM[paper]
    return Box(
        FILING_MARGIN_MM + clearance_mm,
        MARGIN_MM + TITLE_STRIP_MM + clearance_mm,
        width_mm - MARGIN_MM - clearance_mm,
        height_mm - MARGIN_MM - clearance_mm,
    )


def choose_paper(
    extent_mm: tuple[float, float],
    *,
    clearance_mm: float = 25.0,
    smallest: PaperName = "A3",
    coarsest: int = 100,
) -> tuple[PaperName, int]:
    """Return the smallest paper on which ``extent_mm`` fits legibly, and the scale there.

    ``clearance_mm`` is kept free on each side for dimensions. A scale is legible down to 1:``coarsest``; when
    even A0 needs a coarser one, A0 and that scale are returned.

    Examples
    --------
    >>> choose_paper((12000.0, 8000.0))
    ('A3', 50)
    >>> choose_paper((12000.0, 8000.0), coarsest=20)
    ('A1', 20)
    """
    papers = list(PAPERS_MM)
    for paper in papers[papers.index(smallest) :]:
        room = drawing_room(paper, clearance_mm)
        if extent_mm[0] <= room.width * coarsest and extent_mm[1] <= room.height * coarsest:
            return paper, fit_scale(extent_mm, (room.width, room.height))
    return "A0", fit_scale(extent_mm, (room.width, room.height))
