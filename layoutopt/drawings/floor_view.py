"""The floor plan of an installation drawing: walls, obstacles, zones, floor tiles, tags, grid and dimensions.

All coordinates are those of the floor frame in millimetres, so a place in the drawing is a place in the tag map.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
import shapely
from shapely.geometry import MultiLineString, Polygon
from shapely.geometry.base import BaseGeometry

from layoutopt.drawings.dimensions import BY_MARK, mark_labels
from layoutopt.drawings.fields import parts_within
from layoutopt.drawings.layers import Layer
from layoutopt.drawings.lettering import width_mm
from layoutopt.drawings.sheet import Anchor, Box, Entity, Marks, Polyline, Text
from layoutopt.drawings.symbols import SymbolName
from layoutopt.drawings.tag_grid import LINE_OFFSET_MM, TagGroup, grid_and_dimensions
from layoutopt.drawings.text_boxes import full_extent, text_box
from layoutopt.drawings.zone_names import zone_names
from layoutopt.geometry import turned
from layoutopt.identity import FloatArray
from layoutopt.layout import INSTALLED, Layout, TagMap
from layoutopt.site import Site

OBSTACLE_FILL: Final = "#dcdcdc"
NO_TAGS_FILL: Final = "#f6eded"
TRANSPONDER_SYMBOL: Final[SymbolName] = "target"
INSTALLED_SYMBOL: Final[SymbolName] = "ring"
LEAST_TAG_MM: Final = 0.8
"""Tags are printed at least this large, unless neighbours would then run together."""

_TRANSPONDER_MM: Final = 4.0
_WHITE: Final = "#ffffff"
_LARGE_TAG_MM: Final = 2.0
_LEAST_TILE_MM: Final = 2.5
_IDENTITY_MM: Final = (2.5, 1.8)
"""Heights of identities; the smaller one where the larger has no room."""
_TRANSPONDER_TEXT_MM: Final = 2.5
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
    docks = transponder_marks(layout, scale, tags)
    identities, unlabelled = floor_identities(
        tags, groups, scale, (*frame.entities, *docks), frame.box_mm, edges_mm(site)
    )
    names, unnamed = zone_names(site, tags=tags, scale=scale, texts=identities)
    identities = clear_of(identities, names, scale)
    remarks = [*frame.remarks, *_tag_remarks(tags, scale, unlabelled)]
    if unnamed:
        remarks.append(f"Zones without room for their name on the plan: {', '.join(unnamed)}.")
    return FloorView(
        entities=(
            *_walls(site),
            *tiles,
            *_obstacles_and_zones(site),
            *frame.entities,
            *told_apart(tags, tag_map),
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


def told_apart(tags: Marks, tag_map: TagMap) -> tuple[Marks, ...]:
    """Return the tags that are to be laid, and as rings those that lie there already."""
    lying = np.array([status == INSTALLED for status in tag_map.status], dtype=np.bool_)
    if not lying.any():
        return (tags,)
    ids = np.array(tags.ids or ())
    return tuple(
        replace(tags, points_mm=tags.points_mm[rows], ids=tuple(ids[rows].tolist()), symbol=symbol)
        for rows, symbol in ((~lying, tags.symbol), (lying, INSTALLED_SYMBOL))
        if rows.any()
    )


def transponder_marks(layout: Layout, scale: int, tags: Marks | None = None) -> tuple[Entity, ...]:
    """Return a mark at each transponder with its name beside it, clear of ``tags`` where there is room."""
    marks = tuple(
        Marks(
            layer="A-READERS",
            points_mm=1000.0 * np.array([transponder.position_m[:2]]),
            symbol=TRANSPONDER_SYMBOL,
            size_mm=_TRANSPONDER_MM * scale,
            kind="transponder",
            ids=(transponder.name,),
        )
        for transponder in layout.transponders
    )
    entities: list[Entity] = []
    barred = [box for mark in marks for box in mark_boxes(mark, scale)]
    dots = [] if tags is None else mark_boxes(tags, scale)
    for transponder, mark in zip(layout.transponders, marks, strict=True):
        texts = _texts_around(transponder.name, mark, scale)
        free = [text for text in texts if not _meets(text, barred, scale)]
        clear = (text for text in free if not _meets(text, dots, scale))
        text = next(clear, (free or texts)[0])
        barred.append(text_box(text, scale))
        entities += [mark, text]
    return tuple(entities)


def _texts_around(name: str, mark: Marks, scale: int) -> list[Text]:
    """Return the name of a mark at places above, below and beside it, nearer ones first."""
    x_mm, y_mm = mark.points_mm[0].tolist()
    sides: tuple[tuple[Anchor, float, float], ...] = (
        ("centre", 0.0, 1.0),
        ("top", 0.0, -1.0),
        ("middle-left", 1.0, 0.0),
        ("middle-right", -1.0, 0.0),
    )
    return [
        Text(
            layer="A-READERS",
            text=name,
            position_mm=(x_mm + dx * away_mm * scale, y_mm + dy * away_mm * scale),
            height_mm=_TRANSPONDER_TEXT_MM,
            anchor=anchor,
        )
        for away_mm in np.arange(0.6, 1.6, 0.1) * _TRANSPONDER_MM
        for anchor, dx, dy in sides
    ]


def mark_boxes(marks: Marks, scale: int) -> list[Box]:
    """Return the boxes around marks, in paper millimetres from the origin of their view."""
    half = marks.drawn_size_mm(scale) / 2.0
    return [
        Box((x - half) / scale, (y - half) / scale, (x + half) / scale, (y + half) / scale)
        for x, y in marks.points_mm.tolist()
    ]


def _meets(text: Text, boxes: Iterable[Box], scale: int) -> bool:
    here = text_box(text, scale)
    return any(here.overlaps(other) for other in boxes)


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
    tags: Marks,
    groups: Sequence[TagGroup],
    scale: int,
    around: Iterable[Entity],
    box_mm: Box,
    lines_mm: BaseGeometry,
) -> tuple[tuple[Text, ...], list[str]]:
    """Return identities beside tags, and the names of the groups that are too dense for theirs.

    Identities stand above their tags, below where one of ``lines_mm`` would strike them through, off the texts and
    marks of ``around``, in letters as large as they have room for, within ``box_mm``. A group in which less than
    nine tags of ten have room for that gets none at all: what is left would look like a selection with a meaning,
    and labels in turn above and below their tags cannot be told apart.
    """
    ids = tags.ids or ()
    kept: list[Text] = []
    others = list(around)
    barred = [place for item in others if isinstance(item, Marks) for place in mark_boxes(item, scale)]
    taken = [item for item in others if isinstance(item, Text)]
    dense = list(groups)
    for height_mm in _IDENTITY_MM:
        roomy = [group for group in dense if _may_be_named(tags, group, scale, height_mm)]
        labels = (
            mark_labels(
                tags, scale=scale, height_mm=height_mm, taken=(*taken, *kept), barred=barred, edges_mm=lines_mm
            )
            if roomy
            else ()
        )
        for group in roomy:
            own = {ids[index] for index in group.index.tolist()}
            found = [
                label
                for label in labels
                if label.text in own
                and label.anchor in BY_MARK
                and Box(*(scale * edge for edge in text_box(label, scale))).inside(box_mm)
            ]
            if len(found) >= _LEAST_SHARE_NAMED * len(own):
                kept += found
                dense.remove(group)
    return tuple(kept), [group.name for group in dense]


def edges_mm(site: Site) -> BaseGeometry:
    """Return the edges of floor and obstacles in millimetres."""
    edges = shapely.union_all([shape.boundary for shape in (site.floor, *site.obstacles)])
    return shapely.transform(edges, lambda places_m: 1000.0 * places_m)


def clear_of(identities: Sequence[Text], others: Iterable[Entity], scale: int) -> tuple[Text, ...]:
    """Return the identities that touch no text of ``others``."""
    boxes = [text_box(item, scale) for item in others if isinstance(item, Text)]
    return tuple(label for label in identities if not _meets(label, boxes, scale))


def _may_be_named(tags: Marks, group: TagGroup, scale: int, height_mm: float) -> bool:
    """Tell whether a label and a mark fit into the square between neighbouring tags, before trying it."""
    if tags.ids is None or len(group.index) > _MOST_NAMED:
        return False
    widest_mm = max(width_mm(tags.ids[index], height_mm) for index in (group.index[0], group.index[-1]))
    side_mm = group.spacing_mm / scale
    needed_mm2 = widest_mm * height_mm + (tags.drawn_size_mm(scale) / scale) ** 2
    return side_mm > height_mm and side_mm**2 > needed_mm2


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
    """Return the floor's outlines, what is no floor within their bounds filled like an obstacle."""
    bounds = shapely.box(*site.bounds_m)
    entities = [
        entity
        for part in _polygons(bounds.difference(site.floor))
        # Holes of the floor are filled with its outlines.
        if part.intersects(bounds.boundary)
        for entity in _rings("A-FILL", part, OBSTACLE_FILL, _WHITE)
    ]
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
            # Holes in the floor that the zone lies over: they are no floor, and below its fill.
            for hole in parts_within(zone.region.difference(site.floor), site.bounds_m):
                entities += _rings("A-FILL", hole, OBSTACLE_FILL, _WHITE)
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
