"""Running dimensions from one datum, grid lines with labels, labels of marks: texts thinned until none overlap.

All positions are real-world millimetres of a view, all sizes millimetres on paper; functions therefore take the
scale of the view. Dimensions run parallel from one datum (ISO 129), never in chains, so that errors made while
measuring do not add up.
"""

import math
from collections.abc import Iterable, Sequence
from itertools import pairwise
from typing import TYPE_CHECKING, Literal

from layoutopt.drawings.layers import Layer
from layoutopt.drawings.lettering import SMALLEST_MM, fit_text, width_mm
from layoutopt.drawings.sheet import Anchor, Box, Circle, Entity, Line, Marks, Polyline, Text
from layoutopt.drawings.symbols import Point
from layoutopt.drawings.text_boxes import text_box
from layoutopt.identity import read_only

if TYPE_CHECKING:
    from shapely.geometry.base import BaseGeometry

_LINE_PITCH = 1.4  # distance of neighbouring labels in heights of a capital
_STROKE_MM = 1.0  # half length of the oblique stroke that ends a dimension
_STUB_MM = 2.0  # from the dimension line to its label
_ORIGIN_MM = 1.2  # radius of the origin circle of running dimensions
_BUBBLE_MM = 3.5
_SAME_MM = 1e-6
_OFF_COLUMN_MM = 0.5
_LABEL_AIR = 0.4  # between neighbouring labels, in heights of a capital, so that numbers do not run together
BY_MARK: tuple[Anchor, ...] = ("left", "top-left", "right")
"""Anchors of labels above their mark, below it, and above to its left: it is plain to which mark they belong."""


def label_places(
    positions_mm: Sequence[float], gap_mm: float, wanted: Iterable[int] = ()
) -> list[tuple[int, float]]:
    """Choose which of the ascending positions get a label and where, so that labels keep ``gap_mm``.

    The first and the last are always labelled; if they are too close to each other their labels, and only
    these, move apart. Then come those ``wanted``, then the others in order, each only where there is room.

    Returns
    -------
        Index and place of each label, ascending.

    Examples
    --------
    >>> label_places([0.0, 2.0, 4.0, 6.0, 9.0], 3.5)
    [(0, 0.0), (2, 4.0), (4, 9.0)]
    >>> label_places([0.0, 1.0], 3.0)
    [(0, -1.0), (1, 2.0)]
    """
    count = len(positions_mm)
    if count < 2:
        return list(enumerate(positions_mm))
    first, last = positions_mm[0], positions_mm[-1]
    slack = gap_mm * (1 - 1e-9)  # labels exactly one gap apart stay, whatever the rounding
    if last - first < slack:
        middle = (first + last) / 2
        return [(0, middle - gap_mm / 2), (count - 1, middle + gap_mm / 2)]
    kept = [0, count - 1]
    for index in wanted:
        if all(abs(positions_mm[index] - positions_mm[other]) >= slack for other in kept):
            kept.append(index)
    kept.sort()
    chosen = [0]
    for index in range(1, count):
        ahead = next(other for other in kept if other >= index)
        room_behind = positions_mm[index] - positions_mm[chosen[-1]] >= slack
        room_ahead = index == ahead or positions_mm[ahead] - positions_mm[index] >= slack
        if room_behind and room_ahead:
            chosen.append(index)
    return [(index, positions_mm[index]) for index in chosen]


def running_dimensions(
    values_mm: Iterable[float],
    *,
    datum_mm: float,
    axis: Literal["x", "y"],
    line_mm: float,
    scale: int,
    side: Literal[-1, 1] = -1,
    witness_mm: float | None = None,
    height_mm: float = 2.5,
    cut_mm: float | None = None,
) -> tuple[Entity, ...]:
    """Return parallel running dimensions on layer A-DIMS: one line, origin circle at the datum, values from it.

    Parameters
    ----------
    values_mm
        Coordinates to dimension, in any order; each label is the distance from the datum, negative before it.
    datum_mm
        Coordinate that is called 0.
    axis
        Axis that the values lie on.
    line_mm
        Coordinate of the dimension line on the other axis.
    side
        -1 puts labels below (x) or left (y) of the line, 1 above or right.
    witness_mm
        Where witness lines of the labelled values begin on the other axis; none are drawn without it.
    height_mm
        Height of the labels on paper.
    cut_mm
        Coordinate at which the line ends in an arrow towards a datum that lies off the sheet.
    """
    values = _distinct(values_mm)
    if not values:
        return ()

    def at(along: float, across: float) -> Point:
        return (along, across) if axis == "x" else (across, along)

    def line(start: Point, end: Point) -> Line:
        return Line(layer="A-DIMS", start_mm=start, end_mm=end)

    # The datum's own label gives way to the first and last value where it would touch them: the circle says 0.
    outside = not values[0] - _SAME_MM <= datum_mm <= values[-1] + _SAME_MM
    marked = values if outside or cut_mm is not None else _distinct([*values, datum_mm])
    origin = [index for index, value in enumerate(marked) if abs(value - datum_mm) <= _SAME_MM]
    gap = _LINE_PITCH * height_mm * scale
    places = label_places(marked, gap, origin)
    start_mm = datum_mm if cut_mm is None else cut_mm
    ends = min(*values, start_mm), max(*values, start_mm)
    entities: list[Entity] = [line(at(ends[0], line_mm), at(ends[1], line_mm))]
    if cut_mm is None:
        entities.append(Circle(layer="A-DIMS", centre_mm=at(datum_mm, line_mm), radius_mm=_ORIGIN_MM * scale))
    else:
        back = math.copysign(_ORIGIN_MM * scale * 2.0, values[0] - datum_mm)
        head = [
            at(cut_mm, line_mm),
            at(cut_mm + back, line_mm + 0.25 * abs(back)),
            at(cut_mm + back, line_mm - 0.25 * abs(back)),
        ]
        entities.append(Polyline(layer="A-DIMS", points_mm=read_only(head), closed=True, fill="#000000"))
    stroke, stub = _STROKE_MM * scale, side * _STUB_MM * scale
    closest = min((after - before for before, after in pairwise(marked)), default=math.inf)
    stroked = range(len(marked)) if closest >= stroke else [index for index, _ in places]
    entities += [
        line(at(marked[index] - stroke, line_mm - stroke), at(marked[index] + stroke, line_mm + stroke))
        for index in stroked
    ]
    labels = [(marked[index], place) for index, place in places]
    if outside and cut_mm is None and all(abs(datum_mm - place) >= gap for _, place in labels):
        labels.append((datum_mm, datum_mm))
    anchor: Anchor = "middle-right" if side < 0 else "middle-left"
    for value, place in labels:
        if witness_mm is not None:
            entities.append(line(at(value, witness_mm), at(value, line_mm)))
        entities.append(line(at(value, line_mm), at(place, line_mm + stub)))
        label = Text(
            layer="A-DIMS",
            text=_number(value - datum_mm),
            position_mm=at(place, line_mm + 1.3 * stub),
            height_mm=height_mm,
            anchor=anchor,
            angle_deg=90.0 if axis == "x" else 0.0,
        )
        entities.append(label)
    return tuple(entities)


def grid_lines(
    columns_mm: Iterable[float],
    rows_mm: Iterable[float],
    *,
    extent_mm: Box,
    scale: int,
    overhang_mm: float = 6.0,
    height_mm: float = 2.5,
    closest_mm: float = 0.0,
    first_column: int = 0,
    first_row: int = 0,
) -> tuple[Entity, ...]:
    """Return grid lines on layer A-GRID: columns 1, 2, ... labelled above, rows A, B, ... labelled on the right.

    A line is drawn across ``extent_mm`` (world) and ``overhang_mm`` (paper) beyond it; labels are thinned, but
    keep the number or letter of their line. Where neighbouring lines would be closer than ``closest_mm`` on
    paper, only those with a label are drawn. The names count on from ``first_column`` and ``first_row``.
    """
    over = overhang_mm * scale
    columns, rows = _distinct(columns_mm), _distinct(rows_mm)
    # The last name is the longest; a bubble must hold it whole, or two lines would share a name.
    longest = (
        "0" * len(str(first_column + len(columns))),
        "W" * len(letters(max(first_row + len(rows) - 1, 0))),
    )
    bubble_mm = max(_BUBBLE_MM, max(width_mm(name, SMALLEST_MM) for name in longest) / 1.7)
    radius, entities = bubble_mm * scale, list[Entity]()
    gap = 2.2 * radius

    def bubble(name: str, centre: Point) -> tuple[Entity, Entity]:
        fitted, height = fit_text(name, 1.7 * bubble_mm, height_mm)
        return (
            Circle(layer="A-DIMS", centre_mm=centre, radius_mm=radius),
            Text(layer="A-DIMS", text=fitted, position_mm=centre, height_mm=height, anchor="middle"),
        )

    for lines, names, edges, at in (
        (
            columns,
            [str(first_column + number + 1) for number in range(len(columns))],
            (extent_mm.ymin, extent_mm.ymax),
            _upright,
        ),
        (
            rows,
            [letters(first_row + number) for number in range(len(rows))],
            (extent_mm.xmin, extent_mm.xmax),
            _level,
        ),
    ):
        moved = dict(label_places(lines, gap))
        closest = min((after - before for before, after in pairwise(lines)), default=math.inf)
        for index, value in enumerate(lines):
            if closest < closest_mm * scale and index not in moved:
                continue
            start, end = at(value, edges[0] - over / 2), at(value, edges[1] + over)
            entities.append(Line(layer="A-GRID", start_mm=start, end_mm=end))
            if index in moved:
                foot = at(moved[index], edges[1] + over + radius)
                if abs(moved[index] - value) > _SAME_MM:
                    foot = at(moved[index], edges[1] + over + 2 * radius)
                    knee = at(moved[index], edges[1] + over + radius)
                    entities.append(Line(layer="A-DIMS", start_mm=end, end_mm=knee))
                entities.extend(bubble(names[index], foot))
    return tuple(entities)


def letters(number: int) -> str:
    """Return A, B, ... for 0, 1, ...; I and O are left out as ISO 5457 does, AA follows Z.

    Examples
    --------
    >>> [letters(number) for number in (0, 7, 8, 23, 24)]
    ['A', 'H', 'J', 'Z', 'AA']
    """
    alphabet = "ABCDEFGHJKLMNPQRSTUVWXYZ"
    name = ""
    number += 1
    while number:
        number, place = divmod(number - 1, len(alphabet))
        name = alphabet[place] + name
    return name


def mark_labels(
    marks: Marks,
    *,
    scale: int,
    height_mm: float = 1.8,
    layer: Layer = "A-TAGS-ID",
    taken: Iterable[Text] = (),
    barred: Iterable[Box] = (),
    edges_mm: "BaseGeometry | None" = None,
) -> tuple[Text, ...]:
    """Return the identities of ``marks`` as texts, as many as fit without touching a mark or another text.

    Labels stand above their mark and right of its column, which would strike them through. One that one of
    ``edges_mm`` would strike through stands below, or left of the column. Those three places have the anchors
    `BY_MARK`; where none is free, the middle below the mark and its sides are tried. Labels are in the order of
    the marks. ``taken`` are texts of the same view that keep their place, ``barred`` boxes in paper millimetres
    from its origin. Where marks are too dense nothing is written.
    """
    import shapely

    if marks.ids is None:
        return ()
    if edges_mm is not None:
        shapely.prepare(edges_mm)

    def struck(box: Box) -> bool:
        xmin, ymin, xmax, ymax = (scale * edge for edge in box)
        return edges_mm is not None and bool(shapely.intersects(edges_mm, shapely.box(xmin, ymin, xmax, ymax)))

    half = marks.drawn_size_mm(scale) / 2
    away = half + 0.5 * scale
    occupied = _Occupied(cell_mm=max(2 * half / scale, 3 * height_mm))
    for x, y in marks.points_mm.tolist():
        occupied.add(Box((x - half) / scale, (y - half) / scale, (x + half) / scale, (y + half) / scale))
    for box in (*(text_box(text, scale) for text in taken), *barred):
        occupied.add(box)
    off = _OFF_COLUMN_MM * scale
    air = _LABEL_AIR * height_mm
    first, *instead = zip(BY_MARK, (off, off, -off), (away, -away, away), strict=True)
    others: tuple[tuple[Anchor, float, float], ...] = (
        ("top", 0.0, -away),
        ("middle-left", away, 0.0),
        ("middle-right", -away, 0.0),
    )

    def at(x: float, y: float, identity: str, anchor: Anchor) -> Text:
        return Text(layer=layer, text=identity, position_mm=(x, y), height_mm=height_mm, anchor=anchor)

    labels = []
    for (x, y), identity in zip(marks.points_mm.tolist(), marks.ids, strict=True):
        above = text_box(at(x + first[1], y + first[2], identity, first[0]), scale)
        clear = [
            place
            for place in (instead if struck(above) else ())
            if not struck(text_box(at(x + place[1], y + place[2], identity, place[0]), scale))
        ]
        for anchor, dx, dy in (*clear, first, *others):
            label = at(x + dx, y + dy, identity, anchor)
            xmin, ymin, xmax, ymax = text_box(label, scale)
            if occupied.free(Box(xmin - air, ymin, xmax + air, ymax)):
                occupied.add(Box(xmin, ymin, xmax, ymax))
                labels.append(label)
                break
    return tuple(labels)


class _Occupied:
    """Boxes on paper, found again by square cells."""

    def __init__(self, cell_mm: float) -> None:
        self._cell_mm = cell_mm
        self._boxes: dict[tuple[int, int], list[Box]] = {}

    def _cells(self, box: Box) -> list[tuple[int, int]]:
        left, right = (math.floor(value / self._cell_mm) for value in (box.xmin, box.xmax))
        bottom, top = (math.floor(value / self._cell_mm) for value in (box.ymin, box.ymax))
        return [(column, row) for column in range(left, right + 1) for row in range(bottom, top + 1)]

    def add(self, box: Box) -> None:
        for cell in self._cells(box):
            self._boxes.setdefault(cell, []).append(box)

    def free(self, box: Box) -> bool:
        return not any(box.overlaps(other) for cell in self._cells(box) for other in self._boxes.get(cell, ()))


def _upright(along: float, across: float) -> Point:
    return along, across


def _level(along: float, across: float) -> Point:
    return across, along


def _distinct(values_mm: Iterable[float]) -> list[float]:
    """Return the values in ascending order, equal ones (to a nanometre) once."""
    distinct: list[float] = []
    for value in sorted(float(value) for value in values_mm):
        if not distinct or value - distinct[-1] > _SAME_MM:
            distinct.append(value)
    return distinct


def _number(distance_mm: float) -> str:
    """Return a distance to a tenth of a millimetre, without trailing zeros and without minus zero."""
    return f"{round(distance_mm, 1) + 0.0:.1f}".removesuffix(".0")
