"""Tag plan of one field of the floor: its tags with labels and dimensions from the datum of the whole site."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np
from shapely.geometry import box

from layoutopt.drawings.arrangement import CENTRING_MM
from layoutopt.drawings.fields import Field, clipped, lines_within, parts_within, tags_within
from layoutopt.drawings.floor_view import (
    NO_TAGS_FILL,
    OBSTACLE_FILL,
    clear_of,
    datum_entities,
    edges_mm,
    floor_identities,
    tag_marks,
    tile_joints,
    told_apart,
)
from layoutopt.drawings.frame import (
    TITLE_BLOCK_MM,
    TitleBlock,
    frame_box,
    frame_entities,
    notes,
    scale_bar,
    title_block_entities,
)
from layoutopt.drawings.sheet import Box, Entity, PaperName, Polyline, Sheet, View, drawing_room
from layoutopt.drawings.symbols import Point
from layoutopt.drawings.tag_grid import LINE_OFFSET_MM, MOST_LINES, TagGroup, grid_and_dimensions
from layoutopt.drawings.zone_names import zone_names
from layoutopt.identity import FloatArray
from layoutopt.layout import Layout, TagMap
from layoutopt.site import Site

if TYPE_CHECKING:
    from shapely.geometry.base import BaseGeometry

    from layoutopt.drawings.layers import Layer

_LINE_MM: Final = 17.0
"""What one line of dimensions takes, with five digits."""
_LABELS_MM: Final = 14.0
"""What the labels of rows and columns take."""
_DATUM_MM: Final = (24.0, 20.0)
"""What the words beside the datum take to the left of the floor and below it."""
_KEY_MM: Final = (36.0, 28.0)
"""Largest width and height of the small key plan, above the centring mark."""
_KEY_CELL_MM: Final = 6.0
_BEYOND_MM: Final = LINE_OFFSET_MM
"""How far the numbers of tags may reach beyond the field: as far as nothing else stands there."""
_NOTES_MM: Final = 41.0
"""From the frame to the top of the notes: all eight lines that there may be end above the scale bar."""


@dataclass(frozen=True, slots=True, kw_only=True)
class FloorTagsView:
    """What all fields of a floor share: layout, site, its tags, and their groups with rows and columns."""

    layout: Layout
    site: Site
    tag_map: TagMap
    groups: tuple[TagGroup, ...]


def field_size_m(paper: PaperName, scale: int, groups: Sequence[TagGroup]) -> tuple[float, float]:
    """Return width and height of the largest field that a sheet holds at 1:``scale``."""
    room = _room(paper, groups)
    return room.width * scale / 1000.0, room.height * scale / 1000.0


def field_sheet(
    floor: FloorTagsView,
    field: Field,
    *,
    paper: PaperName,
    scale: int,
    block: TitleBlock,
    fields: Sequence[Field],
    neighbours: Mapping[str, str],
) -> Sheet:
    """Return the tag plan of a field at 1:``scale``.

    ``fields`` are all fields of the floor, for the small key plan; ``neighbours`` names the sheets to the
    ``"left"``, ``"right"``, ``"above"`` and ``"below"``, as far as there are any. Rows and columns have the
    labels that they have on the whole floor.
    """
    room = _room(paper, floor.groups)
    kept = tags_within(floor.tag_map, field.bounds_m, floor.site)
    tags = floor.tag_map.take(kept)
    groups = [group.within(kept, field.box_mm) for group in floor.groups]
    groups = [group for group in groups if len(group.index)]
    datum_x_m, datum_y_m = floor.site.datum_m
    measured, remarks = grid_and_dimensions(
        groups, floor_mm=field.box_mm, scale=scale, datum_mm=(1000.0 * datum_x_m, 1000.0 * datum_y_m)
    )
    part = clipped(floor.site, field.bounds_m)
    marks = tag_marks(floor.layout, tags, groups, scale)
    identities, unlabelled = floor_identities(
        marks, groups, scale, measured, _beyond(field.box_mm, scale), edges_mm(floor.site)
    )
    names, unnamed = zone_names(part, tags=marks, scale=scale, texts=identities)
    identities = clear_of(identities, names, scale)
    plan = View(
        name="tag plan",
        scale=scale,
        at_mm=(room.xmin, room.ymin),
        origin_mm=(field.box_mm.xmin, field.box_mm.ymin),
        window_mm=drawing_room(paper),
        entities=(
            *_shapes(floor.site, field),
            *tile_joints(part, scale),
            *_lines(floor.site, field),
            *(datum_entities(field.box_mm, scale) if (field.column, field.row) == (0, 0) else ()),
            *measured,
            *told_apart(marks, tags),
            *names,
            *identities,
        ),
    )
    around = ", ".join(f"{side} {number}" for side, number in neighbours.items())
    told = [
        f"{len(tags)} tags. Dimensions in mm, from the datum x {datum_x_m + 0.0:.3f}, y {datum_y_m + 0.0:.3f} m.",
        f"Continued on: {around}. The small key plan has this sheet in black."
        if around
        else "The whole floor is on this sheet.",
        *remarks,
    ]
    if unlabelled or len(identities) < len(tags):
        told.append("Tags without a number here: see the schedule or tags.csv.")
    if unnamed:
        told.append(f"Zones without room for their name: {', '.join(unnamed)}.")
    frame = frame_box(paper)
    entities: tuple[Entity, ...] = (
        *frame_entities(paper),
        *title_block_entities(block, paper),
        *scale_bar((frame.xmin + 4.0, frame.ymin + 4.0), scale),
        *notes(
            (frame.xmin + 4.0, frame.ymin + _NOTES_MM), told, frame.width - TITLE_BLOCK_MM[0] - _KEY_MM[0] - 16.0
        ),
        *_key(field, fields, (frame.xmax - TITLE_BLOCK_MM[0] - 4.0, frame.ymin + 40.0)),
    )
    return Sheet(title=block.title, paper=paper, views=(plan,), entities=entities, number=block.sheet_number)


def _beyond(box_mm: Box, scale: int) -> Box:
    """Return a field and what is free around it."""
    more_mm = _BEYOND_MM * scale
    return Box(box_mm.xmin - more_mm, box_mm.ymin - more_mm, box_mm.xmax + more_mm, box_mm.ymax + more_mm)


def _room(paper: PaperName, groups: Sequence[TagGroup]) -> Box:
    """Return the part of the paper that a field may fill; each group may have dimension lines of its own."""
    inside = drawing_room(paper)
    # Dimensions and labels keep clear of the centring marks; there is none between title strip and drawing.
    around = CENTRING_MM + _LABELS_MM
    columns, rows = (sum(bool(getattr(group, name)) for group in groups) for name in ("columns_mm", "rows_mm"))
    left, below = (
        max(LINE_OFFSET_MM + _LINE_MM * min(lines, MOST_LINES), words_mm)
        for lines, words_mm in zip((rows, columns), _DATUM_MM, strict=True)
    )
    return Box(
        inside.xmin + CENTRING_MM + left, inside.ymin + 4.0 + below, inside.xmax - around, inside.ymax - around
    )


def _shapes(site: Site, field: Field) -> list[Entity]:
    """Return the areas of a field that are no floor, obstacles, and zones without tags."""
    no_floor = box(*field.bounds_m).difference(site.floor)
    barred = [zone.region for zone in site.zones if not zone.taggable]
    fills = [(no_floor, OBSTACLE_FILL), *((region, NO_TAGS_FILL) for region in barred)]
    # Holes in the floor that a zone lies over: they are no floor, and below its fill.
    fills += [(region.difference(site.floor), OBSTACLE_FILL) for region in barred]
    fills += [(obstacle, OBSTACLE_FILL) for obstacle in site.obstacles]
    entities: list[Entity] = []
    for shape, colour in fills:
        for part in parts_within(shape, field.bounds_m):
            # A hole of the shape is filled white again.
            rings = [(part.exterior, colour), *((ring, "#ffffff") for ring in part.interiors)]
            entities += [_area(np.array(ring.coords)[:-1], fill) for ring, fill in rings]
    return entities


def _lines(site: Site, field: Field) -> list[Entity]:
    layers: tuple[tuple[Layer, Sequence[BaseGeometry]], ...] = (
        ("A-NOTAG", [zone.region for zone in site.zones if not zone.taggable]),
        ("A-OBSTACLE", site.obstacles),
        ("A-ZONE", [zone.region for zone in site.zones if zone.taggable]),
        ("A-OUTLINE", [site.floor]),
    )
    return [
        Polyline(layer=layer, points_mm=np.array(line.coords) * 1000.0)
        for layer, shapes in layers
        for shape in shapes
        for line in lines_within(shape, field.bounds_m)
    ]


def _area(corners_m: FloatArray, colour: str) -> Polyline:
    return Polyline(layer="A-FILL", points_mm=corners_m * 1000.0, closed=True, fill=colour)


def _key(field: Field, fields: Sequence[Field], corner_mm: Point) -> list[Entity]:
    """Return where the field lies on the floor: all fields in small, this one black; right upper corner given.

    A floor of one field needs none.
    """
    if len(fields) == 1:
        return []
    columns, rows = (max(getattr(item, name) for item in fields) + 1 for name in ("column", "row"))
    side_mm = min(_KEY_MM[0] / columns, _KEY_MM[1] / rows, _KEY_CELL_MM)
    left, foot = corner_mm[0] - columns * side_mm, corner_mm[1] - rows * side_mm
    entities: list[Entity] = []
    for item in fields:
        x, y = left + item.column * side_mm, foot + item.row * side_mm
        corners = [(x, y), (x + side_mm, y), (x + side_mm, y + side_mm), (x, y + side_mm)]
        fill = "#000000" if item == field else "#ffffff"
        entities.append(Polyline(layer="A-TITLE", points_mm=np.array(corners), closed=True, fill=fill))
    return entities
