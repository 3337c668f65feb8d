"""Tables on sheets: schedules of tags, wiring, index; as many pages as the rows take."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

from layoutopt.drawings.frame import TitleBlock, frame_entities, notes, title_block_entities
from layoutopt.drawings.lettering import fit_text
from layoutopt.drawings.sheet import Box, Entity, Line, PaperName, Sheet, Text, drawing_room

ROW_MM: Final = 5.0
_HEAD_MM: Final = 2.5
_CELL_MM: Final = 2.5
_GAP_MM: Final = 5.0
_CLEAR_MM: Final = 10.0
"""What keeps clear of the centring marks at the sides, which reach so far into the frame."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Column:
    """Head and width, on paper, of one column; numbers stand at its right edge."""

    head: str
    width_mm: float
    number: bool = False


def table_height_mm(rows: int) -> float:
    """Return the height of a table with a head and so many rows."""
    return (rows + 1) * ROW_MM


def table_entities(
    columns: Sequence[Column], rows: Sequence[Sequence[str]], corner_mm: tuple[float, float]
) -> list[Entity]:
    """Return a table with lines between its rows, upper left corner at ``corner_mm``; texts shrink into cells."""
    left, top = corner_mm
    right = left + sum(column.width_mm for column in columns)
    entities: list[Entity] = []
    for number in range(len(rows) + 2):
        y = top - ROW_MM * number
        entities.append(Line(layer="A-TITLE", start_mm=(left, y), end_mm=(right, y)))
    foot = top - table_height_mm(len(rows))
    x = left
    for place, column in enumerate(columns):
        entities.append(Line(layer="A-TITLE", start_mm=(x, top), end_mm=(x, foot)))
        cells = [(column.head, _HEAD_MM), *((row[place], _CELL_MM) for row in rows)]
        for number, (text, height_mm) in enumerate(cells):
            fitted, fitted_mm = fit_text(text, column.width_mm - 2.0, height_mm)
            if fitted:
                at = x + column.width_mm - 1.0 if column.number else x + 1.0
                entities.append(
                    Text(
                        layer="A-TITLE",
                        text=fitted,
                        position_mm=(at, top - ROW_MM * (number + 0.5)),
                        height_mm=fitted_mm,
                        anchor="middle-right" if column.number else "middle-left",
                    )
                )
        x += column.width_mm
    entities.append(Line(layer="A-TITLE", start_mm=(right, top), end_mm=(right, foot)))
    return entities


def rows_on_sheet(columns: Sequence[Column], paper: PaperName) -> int:
    """Return how many rows one sheet holds, in blocks side by side."""
    blocks, deep = _blocks(columns, _room(paper))
    return blocks * deep


def table_sheets(
    columns: Sequence[Column],
    rows: Sequence[Sequence[str]],
    *,
    paper: PaperName,
    block: TitleBlock,
    numbers: Sequence[str],
    remarks: Sequence[str] = (),
) -> tuple[Sheet, ...]:
    """Return a table on as many sheets as it takes, in blocks side by side.

    ``numbers`` are those of the sheets; there must be one for each, see `rows_on_sheet`.
    """
    room = _room(paper)
    blocks, deep = _blocks(columns, room)
    width_mm = sum(column.width_mm for column in columns) + _GAP_MM
    sheets = []
    for page, number in enumerate(numbers):
        here = rows[page * blocks * deep : (page + 1) * blocks * deep]
        entities: list[Entity] = [
            *frame_entities(paper),
            *title_block_entities(replace(block, sheet_number=number), paper),
            *notes((room.xmin, room.ymin - 8.0), remarks, room.width - 190.0),
        ]
        for place in range(-(-len(here) // deep)):
            part = here[place * deep : (place + 1) * deep]
            entities += table_entities(columns, part, (room.xmin + place * width_mm, room.ymax - 10.0))
        sheets.append(Sheet(title=block.title, paper=paper, entities=tuple(entities), number=number))
    return tuple(sheets)


def _room(paper: PaperName) -> Box:
    xmin, ymin, xmax, ymax = drawing_room(paper)
    return Box(xmin + _CLEAR_MM, ymin + 4.0, xmax - _CLEAR_MM, ymax - 4.0)


def _blocks(columns: Sequence[Column], room: Box) -> tuple[int, int]:
    """Return how many blocks stand side by side, and how many rows one holds."""
    width_mm = sum(column.width_mm for column in columns)
    # The centring marks reach 10 mm into the frame: tables keep below the upper one.
    return max(1, int((room.width + _GAP_MM) // (width_mm + _GAP_MM))), int((room.height - 10.0) // ROW_MM) - 1
