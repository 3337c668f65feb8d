"""From the lines of a drawing to rooms, walls and the floor that robots have.

Walls may be drawn by two lines or by one. Faces between lines that are nowhere wider than a wall are walls, the
others are rooms. A line with a room on both sides is a wall of its own and gets a thickness; a door opens walls.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
import shapely
from shapely.geometry import MultiPolygon, Polygon
from shapely.geometry.base import BaseGeometry

from layoutopt.errors import InvalidInput
from layoutopt.identity import BoolArray, FloatArray
from layoutopt.plans.floor import check_extents, check_region
from layoutopt.plans.joining import (
    GRID_M,
    Geometries,
    check_crossings,
    closings,
    faces_of,
    lines_of,
    loose_ends,
    noded,
)
from layoutopt.plans.placing import listed, parts_of, region_of
from layoutopt.units import format_length

_MOST_TOLD: Final = 10
_DOOR_M: Final = 1.2
"""Gaps up to the width of a wide door are looked for, to say what a larger ``gap`` would close."""

# A door symbol may stop a little short of the walls that it hangs in.
_DOOR_REACH_M: Final = 0.15
# A line of the outline bends by up to that where the end of another was put on it.
_OFF_OUTLINE_M: Final = 3.0 * GRID_M
# A face is a wall if less than this share of it can be covered by discs as wide as the thickest wall: where walls
# cross, a larger disc fits.
_ROOM_SHARE: Final = 0.5


@dataclass(frozen=True, slots=True, kw_only=True)
class DoorSymbol:
    """The arc of a door: its hinge, and the two ends of the arc, one at the leaf and one at the jamb, m."""

    hinge_m: tuple[float, float]
    ends_m: tuple[tuple[float, float], tuple[float, float]]


@dataclass(frozen=True, slots=True, kw_only=True)
class DrawnFloor:
    """Floor, rooms (largest first) and what has to be said of them."""

    polygon: Polygon | MultiPolygon
    rooms: tuple[Polygon, ...]
    notes: tuple[str, ...]


def drawn_floor(
    segments_m: FloatArray,
    doors: Sequence[DoorSymbol],
    *,
    gap_m: float,
    thickest_wall_m: float,
    line_wall_m: float,
    smallest_room_m2: float,
    place: str,
) -> DrawnFloor:
    """Return the floor within the walls of a drawing.

    Parameters
    ----------
    segments_m
        Lines of the walls, shape (n, 2, 2).
    doors
        Symbols that open walls, or close rooms where walls are interrupted.
    gap_m
        Widest gap between lines that is closed to find rooms; robots may pass a gap all the same.
    thickest_wall_m
        Faces that are nowhere wider are walls.
    line_wall_m
        Thickness of walls that are drawn by a single line.
    smallest_room_m2
        Rooms below it are left out.

    Raises
    ------
    InvalidInput
        If the lines enclose no room, with the loose ends.
    """
    check_crossings(segments_m, place)
    walls_m = noded(segments_m)
    if not len(walls_m):
        raise InvalidInput.at(place, "the layers of the walls hold no lines", "Name other layers as walls.")
    openings, notes = _openings(doors, walls_m, thickest_wall_m)
    closed_m = closings(walls_m, gap_m, thickest_wall_m, place)
    lines_m = noded(np.concatenate([walls_m, closed_m, _prolonged(openings)]))
    faces = faces_of(lines_m)
    is_room = _is_room(faces, thickest_wall_m)
    large = np.asarray(shapely.area(faces) >= smallest_room_m2)
    rooms = sorted(faces[is_room & large], key=lambda room: -room.area)
    remaining = _remaining(noded(np.concatenate([walls_m, closed_m])), openings, gap_m, thickest_wall_m, place)
    if not rooms:
        at = listed([_shown(point) for point in loose_ends(lines_m)])
        raise InvalidInput.at(
            place,
            f"the walls enclose no room of {smallest_room_m2:g} m²"
            + (f"; lines end at {at}" if at else "")
            + (f"; there are gaps: {remaining}" if remaining else ""),
            'Close the walls in the drawing, name the layers of all walls, or allow a gap such as gap = "1 m".',
        )
    enclosed = shapely.union_all(rooms)
    single = _between_rooms(walls_m, enclosed)
    floor: BaseGeometry = enclosed
    if len(single):
        thick = shapely.line_merge(shapely.union_all(lines_of(single)))
        floor = floor.difference(thick.buffer(line_wall_m / 2.0, cap_style="flat", join_style="mitre"))
        length_m = float(np.linalg.norm(single[:, 1] - single[:, 0], axis=1).sum())
        notes.append(
            f"{length_m:.4g} m of walls drawn by a single line are taken as {format_length(line_wall_m)} thick"
        )
    floor = _opened(
        floor, enclosed, openings, faces[~is_room], thickest_wall_m=thickest_wall_m, line_wall_m=line_wall_m
    )
    polygon = region_of(floor)
    check_region(polygon, place)
    check_extents(polygon.bounds, place)
    small = faces[is_room & ~large]
    notes += [f"closed a gap of {_gap(line)}" for line in closed_m[:_MOST_TOLD]]
    if len(closed_m) > _MOST_TOLD:
        notes.append(f"closed {len(closed_m) - _MOST_TOLD} more gaps up to {format_length(gap_m)}")
    if remaining:
        notes.append(f"gaps that were not closed: {remaining}")
    loose_m = loose_ends(walls_m)
    if len(loose_m):
        notes.append(f"{len(loose_m)} dangling end(s) of lines: {listed([_shown(point) for point in loose_m])}")
    if len(small):
        notes.append(
            f"left out {len(small)} room(s) below {smallest_room_m2:g} m², {shapely.area(small).sum():.4g} m²"
        )
    notes.append(
        f"floor {polygon.area:.2f} m² in {len(parts_of(polygon))} part(s), {len(rooms)} room(s), "
        f"{len(openings)} door(s)"
    )
    return DrawnFloor(polygon=polygon, rooms=tuple(rooms), notes=tuple(notes))


def closed_areas(segments_m: FloatArray, what: str, place: str, notes: list[str]) -> list[Polygon]:
    """Return the areas that lines of a layer enclose, joined; ``what`` names them in the notes.

    Raises
    ------
    InvalidInput
        If the layers hold lines but these enclose nothing.
    """
    if not len(segments_m):
        return []
    check_crossings(segments_m, place)
    lines_m = noded(segments_m)
    loose_m = loose_ends(lines_m)
    areas = parts_of(shapely.union_all(faces_of(lines_m)))
    at = listed([_shown(point) for point in loose_m])
    if not areas:
        raise InvalidInput.at(
            place, f"the lines of {what} enclose nothing" + (f"; they end at {at}" if at else ""), "Close them."
        )
    if at:
        notes.append(f"lines of {what} with dangling ends, which enclose nothing there: {at}")
    return areas


def _openings(
    doors: Sequence[DoorSymbol], walls_m: FloatArray, thickest_wall_m: float
) -> tuple[FloatArray, list[str]]:
    """Return the line from hinge to jamb of each door, shape (k, 2, 2), and notes on symbols away from walls."""
    notes: list[str] = []
    if not doors:
        return np.empty((0, 2, 2)), notes
    hinges_m = np.array([door.hinge_m for door in doors])
    ends_m = np.array([door.ends_m for door in doors])
    tree = shapely.STRtree(lines_of(walls_m))
    points = shapely.points(np.concatenate([hinges_m[:, None], ends_m], axis=1).reshape(-1, 2))
    _, nearest_m = tree.query_nearest(points, return_distance=True, all_matches=False)
    distance_m = nearest_m.reshape(-1, 3)
    # Of the two ends of the arc, the one at the jamb lies at a wall and the other where the open leaf ends.
    jamb = np.argmin(distance_m[:, 1:], axis=1)
    at_jamb_m = distance_m[np.arange(len(doors)), 1 + jamb]
    found = (at_jamb_m <= thickest_wall_m) & (distance_m[:, 0] <= thickest_wall_m)
    if not found.all():
        at = listed([_shown(point) for point in hinges_m[~found]])
        notes.append(f"{int((~found).sum())} arc(s) on door layers stand at no wall and open nothing: {at}")
    lines_m = np.stack([hinges_m, ends_m[np.arange(len(doors)), jamb]], axis=1)
    return lines_m[found], notes


def _prolonged(lines_m: FloatArray) -> FloatArray:
    along = lines_m[:, 1] - lines_m[:, 0]
    reach = _DOOR_REACH_M * along / np.maximum(np.linalg.norm(along, axis=1, keepdims=True), GRID_M)
    return np.stack([lines_m[:, 0] - reach, lines_m[:, 1] + reach], axis=1)


def _is_room(faces: Geometries, thickest_wall_m: float) -> BoolArray:
    """Return which faces are wider than a wall."""
    half_m = thickest_wall_m / 2.0
    core = shapely.buffer(faces, -half_m, join_style="mitre")
    opened = shapely.buffer(core, half_m, join_style="mitre")
    return np.asarray(shapely.area(opened) >= _ROOM_SHARE * shapely.area(faces), dtype=np.bool_)


def _between_rooms(walls_m: FloatArray, enclosed: BaseGeometry) -> FloatArray:
    """Return the segments with room on both sides: those within the rooms and not on their outline."""
    shapely.prepare(enclosed)
    middles = shapely.points(walls_m.mean(axis=1))
    corners_m, ring = shapely.get_coordinates(shapely.get_parts(enclosed.boundary), return_index=True)
    follows = ring[1:] == ring[:-1]
    border = lines_of(np.stack([corners_m[:-1][follows], corners_m[1:][follows]], axis=1))
    _, apart_m = shapely.STRtree(border).query_nearest(middles, return_distance=True, all_matches=False)
    within = np.asarray(shapely.intersects(enclosed, middles), dtype=np.bool_)
    return np.asarray(walls_m[within & (apart_m > _OFF_OUTLINE_M)])


def _opened(
    floor: BaseGeometry,
    enclosed: BaseGeometry,
    openings: FloatArray,
    walls: Geometries,
    *,
    thickest_wall_m: float,
    line_wall_m: float,
) -> BaseGeometry:
    """Return the floor with doors cut through the walls that their lines run along."""
    if not len(openings):
        return floor
    doors = lines_of(openings)
    within_rooms = shapely.union_all(shapely.buffer(doors, line_wall_m, cap_style="flat")).intersection(enclosed)
    door, wall = shapely.STRtree(walls).query(doors, predicate="intersects")
    along = shapely.length(shapely.intersection(doors[door], walls[wall])) > GRID_M
    door, wall = door[along], wall[along]
    reach = shapely.buffer(doors[door], thickest_wall_m, cap_style="flat")
    return shapely.union_all([floor, within_rooms, *shapely.intersection(reach, walls[wall])])


def _remaining(lines_m: FloatArray, openings: FloatArray, gap_m: float, thickest_wall_m: float, place: str) -> str:
    """Return in words which gaps up to the width of a door are still there and have no door, widest first."""
    if gap_m >= _DOOR_M:
        return ""
    try:
        gaps_m = closings(lines_m, _DOOR_M, thickest_wall_m, place)
    except InvalidInput as error:
        return error.faults[0].problem
    if len(openings) and len(gaps_m):
        middles = shapely.points(gaps_m.mean(axis=1))
        doors = shapely.STRtree(lines_of(openings))
        at_doors, _ = doors.query(middles, predicate="dwithin", distance=thickest_wall_m)
        gaps_m = np.delete(gaps_m, at_doors, axis=0)
    widest_first = np.argsort(-np.linalg.norm(gaps_m[:, 1] - gaps_m[:, 0], axis=1), kind="stable")
    return listed([_gap(line) for line in gaps_m[widest_first]])


def _gap(line_m: FloatArray) -> str:
    length_m = float(np.hypot(*(line_m[1] - line_m[0])))
    return f"{format_length(length_m)} from {_shown(line_m[0])} to {_shown(line_m[1])}"


def _shown(point_m: FloatArray) -> str:
    return f"({point_m[0]:.3f}, {point_m[1]:.3f})"
