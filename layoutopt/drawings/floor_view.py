"""The floor plan of an installation drawing: walls, obstacles, zones, floor tiles, tags, grid and dimensions.

All coordinates are those of the floor frame in millimetres, so a place in the drawing is a place in the tag map.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
import shapely
from shapely.geometry import MultiLineString, Polygon
from shapely.geometry.base import BaseGeometry

from layoutopt.drawings.dimensions import mark_labels
from layoutopt.drawings.layers import Layer
from layoutopt.drawings.lettering import width_mm
from layoutopt.drawings.sheet import Box, Entity, Marks, Polyline, Text
from layoutopt.drawings.symbols import SymbolName
from layoutopt.drawings.tag_grid import LINE_OFFSET_MM, TagGroup, grid_and_dimensions
from layoutopt.drawings.text_boxes import full_extent, text_box
from layoutopt.drawings.zone_names import zone_names
from layoutopt.geometry import turned
from layoutopt.identity import FloatArray
from layoutopt.layout import Layout, TagMap
from layoutopt.site import Site

OBSTACLE_FILL: Final = "#dcdcdc"
NO_TAGS_FILL: Final = "#f6eded"
TRANSPONDER_SYMBOL: Final[SymbolName] = "target"
LEAST_TAG_MM: Final = 0.8
"""Tags are printed at least this large, unless neighbours would then run together."""

_TRANSPONDER_MM: Final = 4.0
_WHITE: Final = "#ffffff"
_LARGE_TAG_MM: Final = 2.0
_LEAST_TILE_MM: Final = 2.5
_IDENTITY_MM: Final = 1.8
_LEAST_SHARE_NAMED: Final = 0.9
_MOST_NAMED: Final = 3000


@dataclass(frozen=True, slots=True, kw_only=True)
class FloorFrame:
    """What surrounds the floor at one scale: datum, grid, dimensions; ``box_mm`` is around all of it."""

    entities: tuple[Entity, ...]
    box_mm: Box
    remarks: tuple[str, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class FloorView:
    """What is drawn of a floor at one scale.

    Attributes
    ----------
    remarks
        What the reader of the sheet must know about it, one sentence each.
    tiles
        Whether floor tiles are drawn.
    """

    entities: tuple[Entity, ...]
    remarks: tuple[str, ...]
    tiles: bool


def tag_symbol(size_mm: float, scale: int) -> SymbolName:
    """Return the symbol of a tag of that size: a target where it is large enough for its cross to be seen."""
    return "target" if size_mm / scale >= _LARGE_TAG_MM else "disc"


def floor_frame(*, site: Site, groups: Sequence[TagGroup], scale: int) -> FloorFrame:
    """Return what surrounds the floor for a scale of 1:``scale``; ``groups`` are the tags by pattern."""
    floor_mm = Box(*(1000.0 * edge for edge in site.bounds_m))
    measured, remarks = grid_and_dimensions(groups, floor_mm=floor_mm, scale=scale)
    entities = (*measured, *datum_entities(floor_mm, scale))
    return FloorFrame(entities=entities, box_mm=full_extent([*_walls(site), *entities], scale), remarks=remarks)


def floor_view(
    *, layout: Layout, site: Site, tag_map: TagMap, groups: Sequence[TagGroup], frame: FloorFrame, scale: int
) -> FloorView:
    """Return the floor plan for a scale of 1:``scale``, all of it within the box of its ``frame``."""
    tags = tag_marks(layout, tag_map, groups, scale)
    tiles = tile_joints(site, scale)
    names, unnamed = zone_names(site, tags_mm=tags.points_mm, mark_mm=tags.drawn_size_mm(scale), scale=scale)
    docks = transponder_marks(layout, scale)
    texts = [item for item in (*frame.entities, *names, *docks) if isinstance(item, Text)]
    identities, unlabelled = floor_identities(tags, groups, scale, texts, frame.box_mm)
    remarks = [*frame.remarks, *_tag_remarks(tags, scale, unlabelled)]
    if unnamed:
        remarks.append(f"Zones without room for their name on the plan: {', '.join(unnamed)}.")
    return FloorView(
        entities=(
            *_walls(site),
            *tiles,
            *_obstacles_and_zones(site),
            *frame.entities,
            tags,
            *names,
            *docks,
            *identities,
        ),
        remarks=tuple(remarks),
        tiles=bool(tiles),
    )


def tag_marks(layout: Layout, tag_map: TagMap, groups: Sequence[TagGroup], scale: int) -> Marks:
    """Return the tags as marks, at their true size or as dots that do not run together."""
    size_mm = 1000.0 * max(layout.floor_tags.tag_size_m)
    closest_mm = min((group.spacing_mm / scale for group in groups), default=np.inf)
    printed_mm = min(LEAST_TAG_MM, 0.6 * closest_mm)
    return Marks(
        layer="A-TAGS",
        points_mm=tag_map.xy_m * 1000.0,
        symbol=tag_symbol(size_mm, scale),
        size_mm=size_mm,
        printed_mm=float(printed_mm),
        ids=tuple(str(identity) for identity in tag_map.ids.tolist()),
    )


def transponder_marks(layout: Layout, scale: int) -> tuple[Entity, ...]:
    """Return a mark at each transponder with its name beside it."""
    entities: list[Entity] = []
    for transponder in layout.transponders:
        x_mm, y_mm = (1000.0 * value for value in transponder.position_m[:2])
        entities += [
            Marks(
                layer="A-READERS",
                points_mm=np.array([(x_mm, y_mm)]),
                symbol=TRANSPONDER_SYMBOL,
                size_mm=_TRANSPONDER_MM * scale,
                kind="transponder",
                ids=(transponder.name,),
            ),
            Text(
                layer="A-READERS",
                text=transponder.name,
                position_mm=(x_mm, y_mm + 0.9 * _TRANSPONDER_MM * scale),
                height_mm=2.5,
                anchor="centre",
            ),
        ]
    return tuple(entities)


def _tag_remarks(tags: Marks, scale: int, unlabelled: Sequence[str]) -> list[str]:
    remarks = []
    if len(tags.points_mm) and tags.drawn_size_mm(scale) > tags.size_mm:
        remarks.append(
            f"Tags are drawn as dots of {tags.drawn_size_mm(scale) / scale:.2g} mm, larger than they are at this "
            "scale; the centre counts."
        )
    elif len(tags.points_mm):
        remarks.append("A tag is drawn as a circle as wide as its longer side; the centre counts.")
    if unlabelled:
        remarks.append(f"Identities of tags ({', '.join(unlabelled)}) have no room on the plan: see tags.csv.")
    return remarks


def floor_identities(
    tags: Marks, groups: Sequence[TagGroup], scale: int, taken: Iterable[Text], box_mm: Box
) -> tuple[tuple[Text, ...], list[str]]:
    """Return identities beside tags, and the names of the groups that are too dense for theirs.

    Identities stand above their tags. A group in which less than nine tags of ten have room for that gets none
    at all: what is left would look like a selection with a meaning, and labels in turn above and below their
    tags cannot be told apart.
    """
    roomy = [group for group in groups if _may_be_named(tags, group, scale)]
    dense = [group.name for group in groups if group not in roomy]
    if not roomy or tags.ids is None:
        return (), dense
    labels = mark_labels(tags, scale=scale, height_mm=_IDENTITY_MM, taken=taken)
    kept: list[Text] = []
    for group in roomy:
        own = {tags.ids[index] for index in group.index.tolist()}
        found = [
            label
            for label in labels
            if label.text in own
            and label.anchor == "centre"
            and Box(*(scale * edge for edge in text_box(label, scale))).inside(box_mm)
        ]
        if len(found) >= _LEAST_SHARE_NAMED * len(own):
            kept += found
        else:
            dense.append(group.name)
    return tuple(kept), dense


def _may_be_named(tags: Marks, group: TagGroup, scale: int) -> bool:
    """Tell whether a label and a mark fit into the square between neighbouring tags, before trying it."""
    if tags.ids is None or len(group.index) > _MOST_NAMED:
        return False
    widest_mm = max(width_mm(tags.ids[index], _IDENTITY_MM) for index in (group.index[0], group.index[-1]))
    side_mm = group.spacing_mm / scale
    needed_mm2 = widest_mm * _IDENTITY_MM + (tags.drawn_size_mm(scale) / scale) ** 2
    return side_mm > _IDENTITY_MM and side_mm**2 > needed_mm2


def datum_entities(floor_mm: Box, scale: int) -> tuple[Entity, ...]:
    """Return the datum cross at the lower left corner of the floor's bounds, and its place in the map frame."""
    x_mm, y_mm = floor_mm.xmin, floor_mm.ymin
    lines = ("DATUM", f"x {x_mm / 1000.0 + 0.0:.3f} m", f"y {y_mm / 1000.0 + 0.0:.3f} m")
    texts = [
        Text(
            layer="A-DATUM",
            text=line,
            position_mm=(x_mm - 3.5 * scale, y_mm - (LINE_OFFSET_MM + 2.0 + 4.0 * number) * scale),
            height_mm=2.5,
            anchor="top-right",
        )
        for number, line in enumerate(lines)
    ]
    cross = Marks(
        layer="A-DATUM", points_mm=np.array([(x_mm, y_mm)]), symbol="datum", size_mm=8.0 * scale, kind="datum"
    )
    return (cross, *texts)


def site_shapes(site: Site) -> list[Entity]:
    """Return walls, obstacles and zones of a site."""
    return [*_walls(site), *_obstacles_and_zones(site)]


def _walls(site: Site) -> list[Entity]:
    """Return the floor's outlines, what is no floor within them filled like an obstacle."""
    entities: list[Entity] = []
    for part in sorted(_polygons(site.floor), key=lambda polygon: -Polygon(polygon.exterior).area):
        # A part that lies in the hole of a larger one must not be hidden by that hole's fill.
        island = any(hole.contains(part) for other in _polygons(site.floor) for hole in _holes(other))
        entities += _rings("A-OUTLINE", part, _WHITE if island else None, OBSTACLE_FILL)
    return entities


def _obstacles_and_zones(site: Site) -> list[Entity]:
    entities: list[Entity] = []
    for zone in site.zones:
        if not zone.taggable:
            entities += _rings("A-NOTAG", zone.region, NO_TAGS_FILL, _WHITE)
    for obstacle in sorted(site.obstacles, key=lambda polygon: -Polygon(polygon.exterior).area):
        entities += _rings("A-OBSTACLE", obstacle, OBSTACLE_FILL, _WHITE)
    for zone in site.zones:
        if zone.taggable:
            entities += _rings("A-ZONE", zone.region, None, None)
    return entities


def tile_joints(site: Site, scale: int) -> list[Entity]:
    """Return the joints between floor tiles on the open floor; none where they would lie too close."""
    tiling = site.tiling
    if tiling is None or 1000.0 * tiling.size_m < _LEAST_TILE_MM * scale:
        return []
    xmin, ymin, xmax, ymax = site.bounds_m
    corners_m = np.array([(xmin, ymin), (xmax, ymin), (xmax, ymax), (xmin, ymax)]) - tiling.origin_m
    local_m = turned(corners_m, -tiling.angle_rad)
    low, high = local_m.min(axis=0), local_m.max(axis=0)
    first, last = np.floor(low / tiling.size_m), np.ceil(high / tiling.size_m)
    joints = [((x, low[1]), (x, high[1])) for x in np.arange(first[0], last[0] + 1.0) * tiling.size_m]
    joints += [((low[0], y), (high[0], y)) for y in np.arange(first[1], last[1] + 1.0) * tiling.size_m]
    lines_m = turned(np.array(joints), tiling.angle_rad) + np.array(tiling.origin_m)
    visible = shapely.intersection(site.open_floor, MultiLineString(list(lines_m)))
    return [
        Polyline(layer="A-TILES", points_mm=shapely.get_coordinates(line) * 1000.0)
        for line in shapely.get_parts(visible)
        if line.geom_type == "LineString"
    ]


def _polygons(shape: BaseGeometry) -> list[Polygon]:
    return [part for part in shapely.get_parts(shape) if isinstance(part, Polygon)]


def _holes(polygon: Polygon) -> list[Polygon]:
    return [Polygon(ring) for ring in polygon.interiors]


def _rings(layer: Layer, polygon: Polygon, fill: str | None, hole_fill: str | None) -> list[Entity]:
    """Return outline and holes of a polygon, each with its fill."""
    return [
        Polyline(layer=layer, points_mm=_corners_mm(ring.coords), closed=True, fill=colour)
        for ring, colour in ((polygon.exterior, fill), *((ring, hole_fill) for ring in polygon.interiors))
    ]


def _corners_mm(coordinates: Iterable[Sequence[float]]) -> FloatArray:
    """Return the corners of a closed ring in millimetres, the first one once."""
    return np.array([(point[0], point[1]) for point in coordinates][:-1]) * 1000.0
