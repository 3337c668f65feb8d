"""Key plan: the whole floor with the fields of the tag plans, its tiles by column and row, and the datum."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import TYPE_CHECKING, Final

import numpy as np
import shapely

from layoutopt.drawings.dimensions import label_places
from layoutopt.drawings.fields import Field
from layoutopt.drawings.floor_view import datum_entities, site_shapes, tile_joints
from layoutopt.drawings.frame import (
    TITLE_BLOCK_MM,
    TitleBlock,
    frame_box,
    frame_entities,
    notes,
    title_block_entities,
)
from layoutopt.drawings.lettering import width_mm
from layoutopt.drawings.sheet import (
    SCALES,
    Box,
    Entity,
    PaperName,
    Polyline,
    Sheet,
    Text,
    View,
    drawing_room,
    fit_scale,
)
from layoutopt.drawings.text_boxes import text_box
from layoutopt.drawings.text_space import VIEW_TITLE_ROOM_MM, view_title
from layoutopt.site import Site, Tiling

if TYPE_CHECKING:
    from shapely.geometry.base import BaseGeometry

_AXES: Final = ("x", "y", "frame of the tag map", "(map, REP-103)")
_CLEAR_MM: Final = 12.0
"""What keeps clear of the centring marks."""
_LEFT_MM: Final = 14.0
_BELOW_MM: Final = 10.0
"""What the labels of tiles and the words beside the datum take more."""
_PAPERS: Final[tuple[PaperName, ...]] = ("A3", "A2", "A1", "A0")
_NUMBER_MM: Final = (3.5, 2.5, 1.8)
_TILE_MM: Final = 2.5
_TILE_GAP_MM: Final = 5.0
"""From the floor to the names of tiles, so that they keep clear of the cross at the datum."""
_SHARES: Final = (0.5, 0.3, 0.7, 0.15, 0.85)
_STRAIGHT_RAD: Final = 1e-9


def key_plan(site: Site, numbers: Mapping[Field, str], *, plan_scale: int, block: TitleBlock) -> Sheet:
    """Return the whole floor with the fields of the tag plans and the ``numbers`` of their sheets.

    The paper is the smallest on which the fields have room for their numbers. ``plan_scale`` is that of the tag
    plans.
    """
    floor_mm = Box(*(1000.0 * edge for edge in site.bounds_m))
    paper, scale, numbered = _paper(floor_mm, numbers)
    room, inside = drawing_room(paper, _CLEAR_MM), _inside(paper)
    tiles = tile_joints(site, scale)
    view = View(
        name="key plan",
        scale=scale,
        at_mm=inside.centre,
        origin_mm=floor_mm.centre,
        window_mm=drawing_room(paper),
        entities=(
            *site_shapes(site),
            *tiles,
            *(_tile_index(site.tiling, floor_mm, scale) if site.tiling is not None and tiles else ()),
            *datum_entities(floor_mm, scale),
            *_fields(site, numbers, scale),
        ),
    )
    told = [
        f"Numbers of fields are those of the tag plans, 1:{plan_scale}."
        if numbered
        else f"Fields are those of the tag plans, 1:{plan_scale}, numbered row by row from the lower left: "
        f"{next(iter(numbers.values()))} and on."
    ]
    if site.tiling is not None and tiles:
        words = (
            "by column and row, as in tags.csv"
            if _straight(site.tiling)
            else "turned: their names are in tags.csv"
        )
        told.append(f"Floor tiles of {1000.0 * site.tiling.size_m:g} mm, {words}.")
    frame = frame_box(paper)
    around: tuple[Entity, ...] = (
        *frame_entities(paper),
        *title_block_entities(replace(block, title=f"Key plan: {block.title}", scale=f"1:{scale}"), paper),
        *view_title(1, "Key plan", scale, (room.xmin, room.ymax), _AXES, bar_mm=60.0),
        *notes((frame.xmin + 4.0, frame.ymin + 38.0), told, frame.width - TITLE_BLOCK_MM[0] - 8.0),
    )
    return Sheet(
        title=f"Key plan: {block.title}", paper=paper, views=(view,), entities=around, number=block.sheet_number
    )


def _paper(floor_mm: Box, numbers: Mapping[Field, str]) -> tuple[PaperName, int, bool]:
    """Return paper and scale of the plan, and whether numbers have room in their fields there."""
    for paper in _PAPERS:
        inside = _inside(paper)
        too_small = max(floor_mm.width / inside.width, floor_mm.height / inside.height) > SCALES[-1]
        if too_small and paper != _PAPERS[-1]:
            continue
        scale = fit_scale((floor_mm.width, floor_mm.height), (inside.width, inside.height))
        numbered = all(_heights_mm(number, field.box_mm, scale) for field, number in numbers.items())
        if numbered:
            break
    return paper, scale, numbered


def _inside(paper: PaperName) -> Box:
    """Return what the floor may fill of a paper."""
    room = drawing_room(paper, _CLEAR_MM)
    return Box(room.xmin + _LEFT_MM, room.ymin + _BELOW_MM, room.xmax, room.ymax - VIEW_TITLE_ROOM_MM)


def _heights_mm(number: str, here: Box, scale: int) -> list[float]:
    """Return the heights, falling, at which a number has room in its field."""
    return [
        height_mm
        for height_mm in _NUMBER_MM
        if width_mm(number, height_mm) <= 0.9 * here.width / scale and 1.5 * height_mm <= here.height / scale
    ]


def _fields(site: Site, numbers: Mapping[Field, str], scale: int) -> list[Entity]:
    """Return the borders of the fields, and their numbers where these cross no line of the plan if possible."""
    shapes: list[BaseGeometry] = [site.floor, *site.obstacles, *(zone.region for zone in site.zones)]
    lines = shapely.union_all([shape.boundary for shape in shapes])
    shapely.prepare(lines)
    entities: list[Entity] = []
    for field, number in numbers.items():
        here = field.box_mm
        corners = [(here.xmin, here.ymin), (here.xmax, here.ymin), (here.xmax, here.ymax), (here.xmin, here.ymax)]
        entities.append(Polyline(layer="A-DATUM", points_mm=np.array(corners), closed=True))
        places = [
            text
            for height_mm in _heights_mm(number, here, scale)
            for text in _placed(number, height_mm, here, scale)
        ]
        if places:
            entities.append(next((text for text in places if not _crosses(text, scale, lines)), places[0]))
    return entities


def _placed(number: str, height_mm: float, here: Box, scale: int) -> list[Text]:
    """Return the number at several places within a field, from its middle outwards."""
    across_mm = here.width - (width_mm(number, height_mm) + 1.0) * scale
    up_mm = here.height - 1.5 * height_mm * scale
    middle_x, middle_y = here.centre
    shares = sorted(
        ((x, y) for x in _SHARES for y in _SHARES), key=lambda share: abs(share[0] - 0.5) + abs(share[1] - 0.5)
    )
    return [
        Text(
            layer="A-DATUM",
            text=number,
            position_mm=(middle_x + (x - 0.5) * across_mm, middle_y + (y - 0.5) * up_mm),
            height_mm=height_mm,
            anchor="middle",
        )
        for x, y in shares
    ]


def _crosses(text: Text, scale: int, lines: "BaseGeometry") -> bool:
    xmin, ymin, xmax, ymax = (edge * scale / 1000.0 for edge in text_box(text, scale))
    return bool(shapely.intersects(lines, shapely.box(xmin, ymin, xmax, ymax)))


def _tile_index(tiling: Tiling, floor_mm: Box, scale: int) -> list[Entity]:
    """Return numbers of columns below the floor and of rows left of it; none where the tiles are turned."""
    if not _straight(tiling):
        return []
    entities: list[Entity] = []
    for axis, (low, high), sign in (
        (0, (floor_mm.xmin, floor_mm.xmax), "c"),
        (1, (floor_mm.ymin, floor_mm.ymax), "r"),
    ):
        first, middles = _tiles_along(1000.0 * tiling.origin_m[axis], 1000.0 * tiling.size_m, low, high)
        names = [f"{sign}{first + place}" for place in range(len(middles))]
        longest = max((names[0], names[-1]), key=len)
        gap_mm = width_mm(longest, _TILE_MM) + 2.0 if axis == 0 else 2.0 * _TILE_MM
        for place, along in label_places(middles, gap_mm * scale):
            at = (
                (along, floor_mm.ymin - _TILE_GAP_MM * scale)
                if axis == 0
                else (floor_mm.xmin - _TILE_GAP_MM * scale, along)
            )
            entities.append(
                Text(
                    layer="A-DIMS",
                    text=names[place],
                    position_mm=at,
                    height_mm=_TILE_MM,
                    anchor="top" if axis == 0 else "middle-right",
                )
            )
    return entities


def _tiles_along(origin_mm: float, size_mm: float, low_mm: float, high_mm: float) -> tuple[int, Sequence[float]]:
    """Return the number of the first tile on the floor, and the middle of what is on it of each tile."""
    first = math.floor((low_mm - origin_mm) / size_mm + 1e-9)
    last = math.ceil((high_mm - origin_mm) / size_mm - 1e-9)
    edges_mm = np.clip(origin_mm + size_mm * np.arange(first, last + 1), low_mm, high_mm)
    return first, ((edges_mm[1:] + edges_mm[:-1]) / 2.0).tolist()


def _straight(tiling: Tiling) -> bool:
    return abs(tiling.angle_rad) < _STRAIGHT_RAD
