"""Cover of a set of sheets: index, revisions, legend, notes with tolerances."""

from collections.abc import Sequence
from itertools import groupby
from typing import Final

from layoutopt.drawings.frame import TITLE_BLOCK_MM, TitleBlock, frame_box, frame_entities, title_block_entities
from layoutopt.drawings.lettering import ELLIPSIS
from layoutopt.drawings.sheet import Entity, PaperName, Sheet
from layoutopt.drawings.sheet_notes import general_notes, legend_rows
from layoutopt.drawings.table_sheet import ROW_MM, Column, table_entities
from layoutopt.drawings.text_space import heading, legend_entities, note_entities, notes_height_mm
from layoutopt.layout import Layout, TagMap
from layoutopt.site import Site

_INDEX: Final = (Column(head="sheet", width_mm=36.0), Column(head="what it shows", width_mm=110.0))
_REVISIONS: Final = (
    Column(head="revision", width_mm=18.0),
    Column(head="date", width_mm=26.0),
    Column(head="by", width_mm=30.0),
    Column(head="what changed", width_mm=72.0),
)
_EMPTY_REVISIONS: Final = 4
_LEGEND_COLUMNS: Final = 3
_GAP_MM: Final = 8.0
_LONGEST_NOTE: Final = 500
"""Letters of a note; what a layout of many zones is called may have thousands."""
_MORE_NOTES: Final = "There are more notes than have room here: see sheet.pdf, tags.csv and readers.yaml."


def cover_sheet(
    layout: Layout,
    site: Site,
    tag_map: TagMap,
    notes: Sequence[str],
    sheets: Sequence[Sheet],
    *,
    scale: int,
    paper: PaperName,
    block: TitleBlock,
) -> Sheet:
    """Return the cover: index of ``sheets``, revisions, legend, notes with tolerances.

    ``scale`` is that of the tag plans, on which the symbol of a tag depends.
    """
    frame = frame_box(paper)
    left, top = frame.xmin + 12.0, frame.ymax - 14.0
    index_mm = sum(column.width_mm for column in _INDEX)
    entities: list[Entity] = [
        *frame_entities(paper),
        *title_block_entities(block, paper),
        heading("Sheets", (left, top)),
    ]
    foot = frame.ymin + 34.0
    most = int((top - foot - 24.0) // ROW_MM)
    rows = [list(row) for row in index_rows(sheets, most)]
    entities += table_entities(_INDEX, rows, (left, top - 7.0))
    right = left + index_mm + _GAP_MM + 4.0
    room_mm = frame.xmax - 12.0 - right
    entities += legend_entities(
        legend_rows(layout, site, scale, tiles=site.tiling is not None, top="A-READERS"),
        (right, top),
        room_mm,
        _LEGEND_COLUMNS,
    )
    robots = [f"Sheet {sheet.number}" for sheet in sheets if sheet.number.startswith("R-")]
    told = [*notes, *general_notes(layout, site, tag_map, plan="all plans", robots=robots)]
    notes_top = top - 42.0
    entities += note_entities(
        _fitting(told, room_mm, notes_top - frame.ymin - TITLE_BLOCK_MM[1]), (right, notes_top), room_mm
    )
    entities.append(heading("Revisions", (left, foot + 5.0)))
    blank = [["" for _ in _REVISIONS] for _ in range(_EMPTY_REVISIONS)]
    entities += table_entities(_REVISIONS, blank, (left, foot - 2.0))
    return Sheet(title=block.title, paper=paper, entities=tuple(entities), number=block.sheet_number)


def _fitting(notes: Sequence[str], width_mm: float, height_mm: float) -> list[str]:
    """Return the notes, long ones cut and the last ones left out where they would run into the title block."""
    kept = [note if len(note) <= _LONGEST_NOTE else f"{note[:_LONGEST_NOTE].rstrip()}{ELLIPSIS}" for note in notes]
    while notes_height_mm(kept, width_mm) > height_mm:
        kept = [*kept[:-2], _MORE_NOTES]
    return kept


def index_rows(sheets: Sequence[Sheet], most: int) -> list[tuple[str, str]]:
    """Return numbers and titles of the sheets; those of one title that follow each other share a row.

    What is more than ``most`` rows shares the last one.
    """
    rows = [
        ([sheet.number for sheet in group], title)
        for title, group in groupby(sheets, key=lambda sheet: sheet.title)
    ]
    if len(rows) > most:
        rest = rows[most - 1 :]
        numbers = [number for here, _ in rest for number in here]
        rows = [*rows[: most - 1], (numbers, f"{rest[0][1]}, and {len(rest) - 1} more")]
    return [(here[0] if len(here) == 1 else f"{here[0]} to {here[-1]}", title) for here, title in rows]
