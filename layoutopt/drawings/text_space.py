"""The text space of a sheet (ISO 9431): headings, wrapped notes, legend and axes, in paper millimetres."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from layoutopt.drawings.frame import legend, scale_bar
from layoutopt.drawings.layers import Layer
from layoutopt.drawings.lettering import LINE_PITCH, width_mm, wrapped
from layoutopt.drawings.sheet import Anchor, Entity, Line, Polyline, Text
from layoutopt.drawings.symbols import Point, SymbolName
from layoutopt.identity import read_only

NOTE_MM: Final = 2.5
HEADING_MM: Final = 3.5
HEADING_ROOM_MM: Final = 7.0
"""Height that a heading takes, with the gap below it."""
VIEW_TITLE_ROOM_MM: Final = 14.0
"""Height of the band above a view with its title, scale bar and axes."""

_INDENT_MM: Final = 7.0
_LEGEND_ROW_MM: Final = 5.0
_AXIS_MM: Final = 7.0


@dataclass(frozen=True, slots=True, kw_only=True)
class LegendRow:
    """A sample and its meaning: a line of the layer, a symbol on it, or an area with ``fill``."""

    layer: Layer
    meaning: str
    symbol: SymbolName | None = None
    fill: str | None = None


def heading(text: str, at_mm: Point) -> Text:
    """Return a heading, upper left corner at ``at_mm``."""
    return Text(layer="A-TITLE", text=text, position_mm=at_mm, height_mm=HEADING_MM, anchor="top-left")


def notes_height_mm(notes: Sequence[str], width_mm: float) -> float:
    """Return the height of `note_entities` for the same notes and width."""
    lines = sum(len(wrapped(note, width_mm - _INDENT_MM, NOTE_MM)) for note in notes)
    return HEADING_ROOM_MM + lines * LINE_PITCH * NOTE_MM + NOTE_MM


def note_entities(notes: Sequence[str], at_mm: Point, width_mm: float) -> tuple[Entity, ...]:
    """Return numbered notes under the heading ``Notes``, wrapped, from the upper left corner ``at_mm``."""
    entities: list[Entity] = [heading("Notes", at_mm)]
    x, y = at_mm[0], at_mm[1] - HEADING_ROOM_MM
    for number, note in enumerate(notes, start=1):
        entities.append(_small(f"{number}.", (x, y), "top-left"))
        for line in wrapped(note, width_mm - _INDENT_MM, NOTE_MM):
            entities.append(_small(line, (x + _INDENT_MM, y), "top-left"))
            y -= LINE_PITCH * NOTE_MM
    return tuple(entities)


def legend_height_mm(rows: Sequence[LegendRow], columns: int) -> float:
    """Return the height of `legend_entities` for the same rows and columns."""
    return HEADING_ROOM_MM + _LEGEND_ROW_MM * -(-len(rows) // columns)


def legend_entities(rows: Sequence[LegendRow], at_mm: Point, width_mm: float, columns: int) -> tuple[Entity, ...]:
    """Return samples with their meaning under the heading ``Legend``, filled column by column."""
    entities: list[Entity] = [heading("Legend", at_mm)]
    deep = -(-len(rows) // columns)
    column_mm = width_mm / columns
    for column in range(columns):
        x, y = at_mm[0] + column * column_mm, at_mm[1] - HEADING_ROOM_MM
        here = rows[column * deep : (column + 1) * deep]
        lines = [(row.layer, row.symbol, row.meaning) for row in here]
        for number, row in enumerate(here):
            if row.fill is not None:
                # On the line that `legend` draws, which becomes the middle of the area.
                middle = y - 2.5 - _LEGEND_ROW_MM * number
                corners = [(x, middle - 1.6), (x + 12, middle - 1.6), (x + 12, middle + 1.6), (x, middle + 1.6)]
                area = Polyline(layer=row.layer, points_mm=read_only(corners), closed=True, fill=row.fill)
                entities.append(area)
        drawn = legend((x, y), lines, column_mm - 2.0)
        # An area shows its border as the sample of the line.
        filled = {y - 2.5 - _LEGEND_ROW_MM * number for number, row in enumerate(here) if row.fill is not None}
        entities += [item for item in drawn if not (isinstance(item, Line) and item.start_mm[1] in filled)]
    return tuple(entities)


def view_title(
    number: int, name: str, scale: int, corner_mm: Point, axes: tuple[str, str, str, str], *, bar_mm: float
) -> tuple[Entity, ...]:
    """Return title, scale bar and axes of a view in a band of `VIEW_TITLE_ROOM_MM` below ``corner_mm``.

    ``corner_mm`` is the upper left one. ``axes`` are the names of the axis to the right and of that upwards,
    and two lines that say of which frame; ``bar_mm`` is the greatest length of the scale bar.
    """
    left, foot = corner_mm[0], corner_mm[1] - VIEW_TITLE_ROOM_MM + 3.0
    words = f"{number}  {name}  1:{scale}"
    title = Text(layer="A-TITLE", text=words, position_mm=(left, foot), height_mm=HEADING_MM, anchor="left")
    bar_x = left + width_mm(words, HEADING_MM) + 8.0
    bar = scale_bar((bar_x, foot), scale, bar_mm)
    return (title, *bar, *_axes((bar_x + bar_mm + 11.0, foot - 1.0), axes))


def _axes(at_mm: Point, axes: tuple[str, str, str, str]) -> list[Entity]:
    """Return two arrows at right angles with their names; the first points right, the second up."""
    x, y = at_mm
    right, up, *captions = axes
    entities: list[Entity] = []
    for dx, dy in ((1.0, 0.0), (0.0, 1.0)):
        tip = (x + _AXIS_MM * dx, y + _AXIS_MM * dy)
        entities.append(Line(layer="A-DATUM", start_mm=(x, y), end_mm=tip))
        neck = (tip[0] - 2.0 * dx, tip[1] - 2.0 * dy)
        head = [(neck[0] - 0.8 * dy, neck[1] + 0.8 * dx), tip, (neck[0] + 0.8 * dy, neck[1] - 0.8 * dx)]
        entities.append(Polyline(layer="A-DATUM", points_mm=read_only(head), closed=True, fill="#a02020"))
    entities.append(_small(right, (x + _AXIS_MM + 1.0, y), "middle-left"))
    entities.append(_small(up, (x + 2.0, y + _AXIS_MM), "middle-left"))
    text_x = x + _AXIS_MM + 3.0 + max(width_mm(right, NOTE_MM), width_mm(up, NOTE_MM) - _AXIS_MM)
    entities += [
        _small(line, (text_x, y + 4.5 - 4.0 * number), "middle-left") for number, line in enumerate(captions)
    ]
    return entities


def _small(text: str, place: Point, anchor: Anchor) -> Text:
    return Text(layer="A-TITLE", text=text, position_mm=place, height_mm=NOTE_MM, anchor=anchor)
