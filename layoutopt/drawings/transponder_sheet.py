"""Where a transponder goes: the floor with its place, dimensioned from a corner that an installer finds."""

from collections.abc import Sequence
from dataclasses import replace
from typing import Final, NamedTuple

import numpy as np
import shapely
from shapely.geometry import LineString, Polygon

from layoutopt.drawings.dimensions import running_dimensions
from layoutopt.drawings.floor_view import datum_entities, site_shapes, transponder_marks
from layoutopt.drawings.frame import (
    TITLE_BLOCK_MM,
    TitleBlock,
    frame_box,
    frame_entities,
    notes,
    title_block_entities,
)
from layoutopt.drawings.sheet import (
    Box,
    Entity,
    Line,
    Marks,
    PaperName,
    Sheet,
    Text,
    View,
    drawing_room,
    fit_scale,
)
from layoutopt.drawings.symbols import Point
from layoutopt.drawings.tag_grid import LINE_OFFSET_MM
from layoutopt.drawings.text_space import VIEW_TITLE_ROOM_MM, view_title
from layoutopt.identity import FloatArray
from layoutopt.layout import Layout, Transponder
from layoutopt.site import Site

CORNER: Final = "CORNER A"
"""What the sheet calls the corner from which it measures."""
_AXES: Final = ("x", "y", "frame of the tag map", "(map, REP-103)")
_CLEAR_MM: Final = 12.0
"""What keeps clear of the centring marks."""
_AROUND_MM: Final = (34.0, 26.0)
"""What dimensions and the words beside the datum take left of the floor and below it."""
_PAPERS: Final[tuple[PaperName, ...]] = ("A3", "A2", "A1", "A0")
_COARSEST: Final = 100
_LEAST_WALL_M: Final = 0.5
"""A corner counts whose two walls are this long: one can lay a rule along them."""
_STRAIGHT: Final = 0.02
"""Sine of the angle by which the walls of a corner may differ from the axes."""
_SIMPLE_M: Final = 0.001
"""Walls straight to a millimetre are one wall."""
_SAME_M: Final = 0.001
_FIRST_NUMBER: Final = 102
"""Sheets follow the key plan, A-101."""


class Corner(NamedTuple):
    """A place to measure from; ``words`` say which."""

    place_m: tuple[float, float]
    words: str
    datum: bool


def measured_from(site: Site, place_m: tuple[float, float]) -> Corner:
    """Return the corner of the floor from which a place is measured.

    It is the nearest corner in sight whose two walls run along x and y for at least half a metre; where there is
    none, the datum of the site, from which all other sheets measure.
    """
    found = _corners_m(site)
    away_m = np.hypot(*(found - place_m).T)
    region = site.open_floor.buffer(_SAME_M, join_style="mitre")
    shapely.prepare(region)
    for number in np.argsort(np.round(away_m, 6), kind="stable"):
        x_m, y_m = found[number].tolist()
        if region.covers(LineString([(x_m, y_m), place_m])):
            if np.hypot(x_m - site.datum_m[0], y_m - site.datum_m[1]) <= _SAME_M:
                break
            return Corner((x_m, y_m), f"{CORNER} at x {x_m:.3f} m, y {y_m:.3f} m of the map frame", datum=False)
    x_m, y_m = site.datum_m
    words = f"the DATUM at x {x_m + 0.0:.3f} m, y {y_m + 0.0:.3f} m of the map frame"
    return Corner((x_m, y_m), words, datum=True)


def _laid_out(site: Site, corner: Corner) -> list[str]:
    """Return what to do first where the sheet measures from no corner of walls."""
    if np.hypot(*(_corners_m(site) - corner.place_m).T).min(initial=np.inf) <= _SAME_M:
        return []
    return ["The DATUM is the lower left corner of the floor's bounds and of no walls: set it out first."]


def transponder_sheets(
    layout: Layout, site: Site, *, block: TitleBlock, remarks: Sequence[str] = ()
) -> tuple[Sheet, ...]:
    """Return for each transponder of a layout the floor with its distances from a corner, and its height.

    Parameters
    ----------
    layout, site
        What is to be installed, and where.
    block
        Title block; number and scale of each sheet are filled in.
    remarks
        Sentences that come first among the notes.
    """
    return tuple(
        _sheet(layout, transponder, site, replace(block, sheet_number=f"A-{_FIRST_NUMBER + place}"), remarks)
        for place, transponder in enumerate(layout.transponders)
    )


def _sheet(
    layout: Layout, transponder: Transponder, site: Site, block: TitleBlock, remarks: Sequence[str]
) -> Sheet:
    floor_mm = Box(*(1000.0 * edge for edge in site.bounds_m))
    x_m, y_m, height_m = transponder.position_m
    corner = measured_from(site, (x_m, y_m))
    paper, scale = _paper(floor_mm)
    room, inside = drawing_room(paper, _CLEAR_MM), _inside(paper)
    view = View(
        name="transponder plan",
        scale=scale,
        at_mm=inside.centre,
        origin_mm=floor_mm.centre,
        window_mm=drawing_room(paper),
        entities=(
            *site_shapes(site),
            *datum_entities(floor_mm, scale),
            *_corner_mark(corner, scale),
            *_dimensions((1000.0 * x_m, 1000.0 * y_m), corner, floor_mm, scale),
            *transponder_marks(layout, scale),
        ),
    )
    dx_mm, dy_mm = (1000.0 * (value - start) for value, start in zip((x_m, y_m), corner.place_m, strict=True))
    told = (
        *remarks,
        f"Transponder '{transponder.name}': {abs(dx_mm):.0f} mm {'right' if dx_mm >= 0.0 else 'left'} and "
        f"{abs(dy_mm):.0f} mm {'up' if dy_mm >= 0.0 else 'down'} from {corner.words}.",
        *_laid_out(site, corner),
        f"Its middle is {1000.0 * height_m:.0f} mm above the floor. Dimensions in mm.",
        f"In the map frame it is at x {x_m + 0.0:.3f} m, y {y_m + 0.0:.3f} m.",
    )
    frame = frame_box(paper)
    around: tuple[Entity, ...] = (
        *frame_entities(paper),
        *title_block_entities(replace(block, scale=f"1:{scale}"), paper),
        *view_title(1, "Transponder plan", scale, (room.xmin, room.ymax), _AXES, bar_mm=60.0),
        *notes((frame.xmin + 4.0, frame.ymin + 38.0), told, frame.width - TITLE_BLOCK_MM[0] - 8.0),
    )
    return Sheet(title=block.title, paper=paper, views=(view,), entities=around, number=block.sheet_number)


def _paper(floor_mm: Box) -> tuple[PaperName, int]:
    """Return the smallest paper on which the floor has a scale of 1:100 or larger, and that scale; else A0."""
    for paper in _PAPERS:
        room = _inside(paper)
        if max(floor_mm.width / room.width, floor_mm.height / room.height) <= _COARSEST:
            break
    return paper, fit_scale((floor_mm.width, floor_mm.height), (room.width, room.height))


def _inside(paper: PaperName) -> Box:
    """Return what the floor may fill of a paper."""
    room = drawing_room(paper, _CLEAR_MM)
    return Box(room.xmin + _AROUND_MM[0], room.ymin + _AROUND_MM[1], room.xmax, room.ymax - VIEW_TITLE_ROOM_MM)


def _corners_m(site: Site) -> FloatArray:
    """Return the corners of rooms whose walls run along x and y and are long enough, shape (n, 2), m."""
    found: list[FloatArray] = []
    for part in shapely.get_parts(site.floor):
        simple = shapely.normalize(shapely.simplify(part, _SIMPLE_M))
        if not isinstance(simple, Polygon):
            continue
        here = np.array(simple.exterior.coords)[:-1]
        back, ahead = np.roll(here, 1, axis=0) - here, np.roll(here, -1, axis=0) - here
        lengths = [np.hypot(*side.T) for side in (back, ahead)]
        straight = [
            np.abs(side).min(axis=1) <= _STRAIGHT * length
            for side, length in zip((back, ahead), lengths, strict=True)
        ]
        # In a ring that runs clockwise, as shapely normalises them, a corner of the room turns to the right.
        inner = back[:, 0] * ahead[:, 1] - back[:, 1] * ahead[:, 0] > 0.0
        square = np.abs((back * ahead).sum(axis=1)) <= 2.0 * _STRAIGHT * lengths[0] * lengths[1]
        long = np.minimum(*lengths) >= _LEAST_WALL_M
        found.append(here[inner & square & long & straight[0] & straight[1]])
    return np.concatenate(found) if found else np.zeros((0, 2))


def _corner_mark(corner: Corner, scale: int) -> list[Entity]:
    """Return a cross and the name at the corner; nothing at the datum, which has its own."""
    if corner.datum:
        return []
    x_mm, y_mm = (1000.0 * value for value in corner.place_m)
    cross = Marks(
        layer="A-DATUM", points_mm=np.array([(x_mm, y_mm)]), symbol="datum", size_mm=8.0 * scale, kind="corner"
    )
    name = Text(
        layer="A-DATUM",
        text=CORNER,
        position_mm=(x_mm + 5.0 * scale, y_mm + 3.0 * scale),
        height_mm=2.5,
        anchor="left",
    )
    return [cross, name]


def _dimensions(place_mm: Point, corner: Corner, floor_mm: Box, scale: int) -> list[Entity]:
    """Return the distances in x, below the floor, and in y, left of it, with lines from transponder and corner."""
    start_mm = (1000.0 * corner.place_m[0], 1000.0 * corner.place_m[1])
    below, left = floor_mm.ymin - LINE_OFFSET_MM * scale, floor_mm.xmin - LINE_OFFSET_MM * scale
    entities: list[Entity] = [
        *running_dimensions([place_mm[0]], datum_mm=start_mm[0], axis="x", line_mm=below, scale=scale),
        *running_dimensions([place_mm[1]], datum_mm=start_mm[1], axis="y", line_mm=left, scale=scale),
    ]
    for x_mm, y_mm in (place_mm, start_mm):
        entities.append(Line(layer="A-GRID", start_mm=(x_mm, y_mm), end_mm=(x_mm, below)))
        entities.append(Line(layer="A-GRID", start_mm=(x_mm, y_mm), end_mm=(left, y_mm)))
    return entities
