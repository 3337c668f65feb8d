"""What every sheet carries in paper millimetres: ISO 5457 frame, ISO 7200 title block, scale bar."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Literal

from layoutopt.drawings.dimensions import label_places, letters
from layoutopt.drawings.layers import Layer
from layoutopt.drawings.lettering import LINE_PITCH, fit_lines, fit_text, width_mm
from layoutopt.drawings.sheet import (
    FILING_MARGIN_MM,
    MARGIN_MM,
    PAPERS_MM,
    Anchor,
    Box,
    Circle,
    Entity,
    Line,
    Marks,
    PaperName,
    Polyline,
    Text,
)
from layoutopt.drawings.symbols import Point, SymbolName
from layoutopt.identity import read_only

TITLE_BLOCK_MM = (180.0, 40.0)
_ROW_MM = 10.0
DO_NOT_SCALE = "DO NOT SCALE - use written dimensions"
_BAND_MM = 5.0  # width of the band that carries the grid reference
_FIELD_MM = 50.0
_CENTRING_MM = 10.0  # centring marks reach this far into the drawing space
_CAPTION_MM = 1.8
_CAPTION_ROOM_MM = 3.0


@dataclass(frozen=True, slots=True, kw_only=True)
class TitleBlock:
    """The eight mandatory fields of ISO 7200, then revision, scale, units and projection method."""

    legal_owner: str
    identification_number: str
    date_of_issue: str
    sheet_number: str
    title: str
    approval_person: str
    creator: str
    document_type: str
    revision: str = "-"
    scale: str = "-"
    units: str = "mm"
    projection: Literal["first angle", "third angle", "plan view"] = "plan view"


def frame_box(paper: PaperName) -> Box:
    """Return the drawing space inside the frame, mm."""
    width, height = PAPERS_MM[paper]
    return Box(FILING_MARGIN_MM, MARGIN_MM, width - MARGIN_MM, height - MARGIN_MM)


def frame_entities(paper: PaperName) -> tuple[Entity, ...]:
    """Return the ISO 5457 frame: 20 mm filing margin left, 10 mm else, centring marks and grid reference.

    Fields of 50 mm are counted from the centring marks: digits across, letters down without I and O; what is
    left over goes to the outer fields.
    """
    frame = frame_box(paper)
    width, height = PAPERS_MM[paper]
    band = Box(frame.xmin - _BAND_MM, frame.ymin - _BAND_MM, frame.xmax + _BAND_MM, frame.ymax + _BAND_MM)
    entities: list[Entity] = [_rectangle("A-FRAME", frame), _rectangle("A-TITLE", band)]
    middle_x, middle_y = width / 2, height / 2
    for start, end in (
        ((middle_x, band.ymin), (middle_x, frame.ymin + _CENTRING_MM)),
        ((middle_x, band.ymax), (middle_x, frame.ymax - _CENTRING_MM)),
        ((band.xmin, middle_y), (frame.xmin + _CENTRING_MM, middle_y)),
        ((band.xmax, middle_y), (frame.xmax - _CENTRING_MM, middle_y)),
    ):
        entities.append(_line("A-FRAME", start, end))
    for number, (left, right) in enumerate(_fields(width, frame.xmin, frame.xmax)):
        for inner, outer in ((frame.ymin, band.ymin), (frame.ymax, band.ymax)):
            entities.append(_text(str(number + 1), ((left + right) / 2, (inner + outer) / 2), 3.0, "middle"))
            if number and not math.isclose(left, middle_x):
                entities.append(_line("A-TITLE", (left, inner), (left, outer)))
    for number, (low, high) in enumerate(reversed(_fields(height, frame.ymin, frame.ymax))):
        for inner, outer in ((frame.xmin, band.xmin), (frame.xmax, band.xmax)):
            entities.append(_text(letters(number), ((inner + outer) / 2, (low + high) / 2), 3.0, "middle"))
            if number and not math.isclose(high, middle_y):
                entities.append(_line("A-TITLE", (inner, high), (outer, high)))
    return tuple(entities)


def _fields(length: float, start: float, end: float) -> list[tuple[float, float]]:
    """Return the grid reference fields between the frame lines at ``start`` and ``end``."""
    half = round(length / 2 / _FIELD_MM)
    inner = [length / 2 + step * _FIELD_MM for step in range(1 - half, half)]
    borders = [start, *inner, end]
    return list(pairwise(borders))


def title_block_entities(block: TitleBlock, paper: PaperName) -> tuple[Entity, ...]:
    """Return the title block, 180 x 40 mm in the lower right corner of the frame.

    A text too long for its cell shrinks to 1.8 mm and is then cut with an ellipsis; the title takes several
    lines before that.
    """
    frame = frame_box(paper)
    left, bottom = frame.xmax - TITLE_BLOCK_MM[0], frame.ymin
    # x, y, width, height in the block, mm; caption; value; height of the value, mm
    cells = (
        (0, 30, 70, 10, "Legal owner", block.legal_owner, 3.5),
        (0, 20, 70, 10, "Document type", block.document_type, 3.5),
        (70, 20, 110, 20, "Title", block.title, 5.0),
        (0, 10, 35, 10, "Created by", block.creator, 2.5),
        (35, 10, 35, 10, "Approved by", block.approval_person, 2.5),
        (70, 10, 60, 10, "Identification number", block.identification_number, 3.5),
        (130, 10, 20, 10, "Revision", block.revision, 3.5),
        (150, 10, 30, 10, "Sheet", block.sheet_number, 3.5),
        (0, 0, 25, 10, "Scale", block.scale, 3.5),
        (25, 0, 20, 10, "Units", block.units, 2.5),
        (45, 0, 25, 10, "Projection", block.projection, 2.5),
        (70, 0, 40, 10, "Date of issue", block.date_of_issue, 2.5),
        (110, 0, 70, 10, "Note", DO_NOT_SCALE, 2.5),
    )
    entities: list[Entity] = []
    for x, y, width, height, caption, value, letter in cells:
        cell = Box(left + x, bottom + y, left + x + width, bottom + y + height)
        entities.append(_rectangle("A-TITLE", cell))
        entities.append(_text(caption, (cell.xmin + 1.5, cell.ymax - 1.0), _CAPTION_MM, "top-left"))
        if caption == "Projection" and value != "plan view":
            entities += _projection_symbol((cell.xmin + 11.0, cell.ymin + 3.6), first=value == "first angle")
            continue
        if height == _ROW_MM:
            fitted, fitted_height = fit_text(value, width - 3.0, letter)
            entities.append(_text(fitted, (cell.xmin + 1.5, cell.ymin + 1.6), fitted_height, "left"))
            continue
        # The title stands in the middle of what its caption leaves.
        lines, fitted_height = fit_lines(value, width - 3.0, height - _CAPTION_ROOM_MM, letter)
        pitch = LINE_PITCH * fitted_height
        top = (height - _CAPTION_ROOM_MM + fitted_height + pitch * (len(lines) - 1)) / 2
        entities += [
            _text(line, (cell.xmin + 1.5, cell.ymin + top - fitted_height - pitch * number), fitted_height, "left")
            for number, line in enumerate(lines)
        ]
    outer = Box(left, bottom, frame.xmax, bottom + TITLE_BLOCK_MM[1])
    return (*entities, _rectangle("A-FRAME", outer))


def _projection_symbol(centre: Point, *, first: bool) -> list[Entity]:
    """Return the truncated cone of ISO 5456-2: its end view stands right in first angle, left in third angle."""
    x, y = centre
    cone_x, circles_x = (x - 3.5, x + 4.5) if first else (x + 3.5, x - 4.5)
    cone = [
        (cone_x - 2.5, y - 1.0),
        (cone_x + 2.5, y - 2.0),
        (cone_x + 2.5, y + 2.0),
        (cone_x - 2.5, y + 1.0),
    ]
    return [
        _polygon(cone),
        Circle(layer="A-TITLE", centre_mm=(circles_x, y), radius_mm=1.0),
        Circle(layer="A-TITLE", centre_mm=(circles_x, y), radius_mm=2.0),
    ]


def scale_bar(at_mm: Point, scale: int, longest_mm: float = 80.0) -> tuple[Entity, ...]:
    """Return a graphic scale with round divisions, lower left corner at ``at_mm``, at most ``longest_mm`` long.

    It stays true when the sheet is copied at another size; the written scale does not, and is therefore left
    to the title block.
    """
    decade = 10.0 ** math.floor(math.log10(longest_mm * scale))
    step = next(step for step in (5, 2, 1) if step * decade <= longest_mm * scale * (1 + 1e-9))
    length, parts = step * decade, {5: 5, 2: 4, 1: 5}[step]
    unit, per_unit = ("m", 1000.0) if length >= 1000 else ("mm", 1.0)
    names = [f"{length * part / parts / per_unit:g}" for part in range(parts + 1)]
    names[-1] += f" {unit}"
    x, y = at_mm
    borders = [x + length * part / parts / scale for part in range(parts + 1)]
    entities: list[Entity] = []
    for part, (left, right) in enumerate(pairwise(borders)):
        colour = "#000000" if part % 2 == 0 else "#ffffff"
        entities.append(_rectangle("A-TITLE", Box(left, y, right, y + 2.0), colour))
    gap = max(width_mm(name, 2.5) for name in names) + 1.0
    entities += [_text(names[part], (place, y + 3.2), 2.5, "centre") for part, place in label_places(borders, gap)]
    return tuple(entities)


def notes(at_mm: Point, lines: Sequence[str], width_mm: float, height_mm: float = 2.5) -> tuple[Entity, ...]:
    """Return lines of text below each other, upper left corner at ``at_mm``, each fitted into ``width_mm``."""
    entities = []
    for number, line in enumerate(lines):
        fitted, height = fit_text(line, width_mm, height_mm)
        entities.append(_text(fitted, (at_mm[0], at_mm[1] - 1.6 * height_mm * number), height, "top-left"))
    return tuple(entities)


def legend(
    at_mm: Point, rows: Sequence[tuple[Layer, SymbolName | None, str]], width_mm: float
) -> tuple[Entity, ...]:
    """Return samples of lines or symbols with their meaning, upper left corner at ``at_mm``.

    Each row is a layer, a symbol (or nothing, for a line of the layer) and the text beside it.
    """
    entities: list[Entity] = []
    for number, (layer, symbol, meaning) in enumerate(rows):
        x, y = at_mm[0], at_mm[1] - 2.5 - 5.0 * number
        if symbol is None:
            entities.append(_line(layer, (x, y), (x + 12.0, y)))
        else:
            entities.append(Marks(layer=layer, points_mm=read_only([(x + 6.0, y)]), symbol=symbol, size_mm=3.0))
        fitted, height = fit_text(meaning, width_mm - 15.0, 2.5)
        entities.append(_text(fitted, (x + 15.0, y), height, "middle-left"))
    return tuple(entities)


def _line(layer: Layer, start: Point, end: Point) -> Line:
    return Line(layer=layer, start_mm=start, end_mm=end)


def _polygon(corners: Sequence[Point], fill: str | None = None, layer: Layer = "A-TITLE") -> Polyline:
    return Polyline(layer=layer, points_mm=read_only(corners), closed=True, fill=fill)


def _rectangle(layer: Layer, box: Box, fill: str | None = None) -> Polyline:
    corners = [(box.xmin, box.ymin), (box.xmax, box.ymin), (box.xmax, box.ymax), (box.xmin, box.ymax)]
    return _polygon(corners, fill, layer)


def _text(text: str, place: Point, height_mm: float, anchor: Anchor) -> Text:
    return Text(layer="A-TITLE", text=text, position_mm=place, height_mm=height_mm, anchor=anchor)
