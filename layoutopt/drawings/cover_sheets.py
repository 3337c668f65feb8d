"""First sheets of a set: cover with index, legend and notes, and the key plan with the fields of the tag plans."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from itertools import groupby
from typing import Final

import numpy as np

from layoutopt.drawings.fields import Field
from layoutopt.drawings.floor_view import site_shapes
from layoutopt.drawings.frame import (
    TitleBlock,
    frame_box,
    frame_entities,
    scale_bar,
    title_block_entities,
)
from layoutopt.drawings.lettering import width_mm
from layoutopt.drawings.sheet import (
    Box,
    Entity,
    PaperName,
    Polyline,
    Sheet,
    Text,
    drawing_room,
    fit_scale,
    place_view,
)
from layoutopt.drawings.sheet_notes import general_notes, legend_rows
from layoutopt.drawings.table_sheet import Column, table_entities
from layoutopt.drawings.text_space import heading, legend_entities, note_entities
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
_NUMBER_MM: Final = (3.5, 2.5, 1.8)


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
    rows = [list(row) for row in index_rows(sheets)]
    entities += table_entities(_INDEX, rows, (left, top - 7.0))
    right = left + index_mm + _GAP_MM + 4.0
    room_mm = frame.xmax - 12.0 - right
    entities += legend_entities(
        legend_rows(layout, site, scale, tiles=site.tiling is not None), (right, top), room_mm, _LEGEND_COLUMNS
    )
    entities += note_entities(
        [*general_notes(layout, site, tag_map, plan="all plans", robot="Sheet R-101"), *notes],
        (right, top - 42.0),
        room_mm,
    )
    foot = frame.ymin + 34.0
    entities.append(heading("Revisions", (left, foot + 5.0)))
    blank = [["" for _ in _REVISIONS] for _ in range(_EMPTY_REVISIONS)]
    entities += table_entities(_REVISIONS, blank, (left, foot - 2.0))
    return Sheet(title=block.title, paper=paper, entities=tuple(entities), number=block.sheet_number)


def index_rows(sheets: Sequence[Sheet]) -> list[tuple[str, str]]:
    """Return numbers and titles of the sheets; those of one title that follow each other share a row."""
    rows = []
    for title, group in groupby(sheets, key=lambda sheet: sheet.title):
        numbers = [sheet.number for sheet in group]
        rows.append((numbers[0] if len(numbers) == 1 else f"{numbers[0]} to {numbers[-1]}", title))
    return rows


def key_plan(
    site: Site, fields: Sequence[Field], numbers: Mapping[Field, str], *, paper: PaperName, block: TitleBlock
) -> Sheet:
    """Return the whole floor with the fields of the tag plans and their numbers."""
    room = drawing_room(paper, 12.0)
    floor_mm = Box(*(1000.0 * edge for edge in site.bounds_m))
    scale = fit_scale((floor_mm.width, floor_mm.height), (room.width, room.height))
    entities: list[Entity] = [*site_shapes(site)]
    for field in fields:
        here = field.box_mm
        corners = [(here.xmin, here.ymin), (here.xmax, here.ymin), (here.xmax, here.ymax), (here.xmin, here.ymax)]
        entities.append(Polyline(layer="A-DATUM", points_mm=np.array(corners), closed=True))
        fitting = [
            size
            for size in _NUMBER_MM
            if width_mm(numbers[field], size) <= 0.9 * here.width / scale and 1.5 * size <= here.height / scale
        ]
        height_mm = fitting[0] if fitting else 0.0
        if height_mm:
            entities.append(
                Text(
                    layer="A-DATUM",
                    text=numbers[field],
                    position_mm=here.centre,
                    height_mm=height_mm,
                    anchor="middle",
                )
            )
    view = place_view("key plan", entities, scale=scale, room_mm=room, extent_mm=floor_mm)
    block = replace(block, title=f"Key plan: {block.title}", scale=f"1:{scale}")
    frame = frame_box(paper)
    around: tuple[Entity, ...] = (
        *frame_entities(paper),
        *title_block_entities(block, paper),
        *scale_bar((frame.xmin + 14.0, frame.ymin + 14.0), scale),
    )
    return Sheet(title=block.title, paper=paper, views=(view,), entities=around, number=block.sheet_number)
