"""Floor plans from GeoJSON whose coordinates are lengths on the floor, not degrees on the globe.

References
----------
RFC 7946, *The GeoJSON Format*: geometries and features; its coordinates are degrees, so a plan in metres or
millimetres has to say so in the spec.
"""

import json
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any, Final, NoReturn

import numpy as np
import shapely

from layoutopt.errors import Fault, InvalidInput, did_you_mean
from layoutopt.identity import FloatArray
from layoutopt.plans.floor import (
    Floor,
    check_extents,
    check_region,
    checked_polygon,
    file_bytes,
    mended_polygon,
    within_bounds,
)
from layoutopt.plans.placing import (
    length_unit_m,
    on_floor,
    parts_of,
    region_of,
    shift_of,
    shifted_source,
    zones_of,
)
from layoutopt.protocols import Card

if TYPE_CHECKING:
    from shapely.geometry import Polygon

CARD: Final = Card(
    summary="GeoJSON in metres or another unit of length: polygons of floor, obstacles and zones.",
    reference="RFC 7946, The GeoJSON Format",
)
KINDS: Final = ("floor", "obstacle", "no_tags", "metal")
# Key of the members of a collection, and the word for one of them.
_COLLECTIONS: Final = {
    "FeatureCollection": ("features", "feature"),
    "GeometryCollection": ("geometries", "geometry"),
}
_MOST_CORNERS: Final = 1_000_000
_MOST_FAULTS: Final = 20
_MOST_LEVELS: Final = 20
# Half a degree of latitude are 55 km, which no floor has; a floor of half a metre is refused anyway.
_DEGREES: Final = (180.0, 90.0, 0.5)
_GLOBAL_FRAMES: Final = ("CRS84", "4326", "WGS84", "4979")


@dataclass(slots=True)
class _Shapes:
    """Polygons found so far, by kind, in the units of the file, with what was passed over."""

    rings: list[tuple[str, str, list[FloatArray]]] = field(default_factory=list)
    passed_over: dict[str, int] = field(default_factory=dict)
    faults: list[Fault] = field(default_factory=list)
    corner_count: int = 0


def read_geojson(path: Path, *, place: str, units: str | None = None, repair: bool = False) -> Floor:
    """Return the floor of a GeoJSON file.

    A feature's property ``kind`` says what its polygons are: ``"floor"`` (the default), ``"obstacle"``,
    ``"no_tags"`` or ``"metal"``. Several floor polygons are rooms; where they touch or overlap they are joined.
    Points and lines are passed over, which a note says.

    Parameters
    ----------
    path
        The file, UTF-8.
    place
        Where the path was given, for messages.
    units
        Unit of the coordinates: ``"m"``, ``"mm"``, ``"cm"``, ``"in"`` or ``"ft"``.
    repair
        Whether outlines that cross or touch themselves or are not closed are mended; each is told in a note.

    Raises
    ------
    InvalidInput
        If the file is no GeoJSON, names no unit, is in degrees, or holds an outline that cannot be used.
    """
    document = _document(file_bytes(path, place), path.name, place)
    if units is None:
        raise InvalidInput.at(
            place,
            f"the unit of {path.name} is not stated, and GeoJSON itself means degrees",
            f'Write plan = {{ file = "{path.name}", units = "m" }} if its coordinates are metres.',
        )
    unit_m = length_unit_m(units, place)
    _refuse_global_frame(document, path.name, place)
    shapes = _Shapes()
    for where, kind, geometry in _geometries(document, shapes, f"{place} -> {path.name}"):
        _take(geometry, kind, where, shapes)
        if shapes.corner_count > _MOST_CORNERS or len(shapes.faults) >= _MOST_FAULTS:
            break
    if shapes.corner_count > _MOST_CORNERS:
        raise InvalidInput.at(
            place, f"{path.name} has more than {_MOST_CORNERS:,} corners", "Simplify its outlines."
        )
    if shapes.faults:
        raise InvalidInput(shapes.faults[:_MOST_FAULTS])
    if not any(kind == "floor" for kind, _, _ in shapes.rings):
        raise InvalidInput.at(
            place,
            f"{path.name} holds no polygon of the kind 'floor'",
            "Give the floor as a Polygon or MultiPolygon, with the property kind = 'floor' or none.",
        )
    _refuse_degrees(shapes, units, path.name, place)
    with within_bounds(path.name, place):
        return _floor(shapes, unit_m, path.name, place, repair)


def _document(content: bytes, name: str, place: str) -> dict[str, Any]:
    try:
        document = json.loads(
            content.decode("utf-8-sig"), parse_constant=_refuse_constant, object_pairs_hook=_once
        )
    except RecursionError:
        raise InvalidInput.at(
            place, f"brackets of {name} are nested too deeply", "Save it as plain features."
        ) from None
    except ValueError as error:
        # Decoding, syntax, NaN and whole numbers of thousands of digits all end here.
        reason = "a number has thousands of digits" if "max_str_digits" in str(error) else str(error)[:200]
        raise InvalidInput.at(place, f"{name} is no GeoJSON: {reason}", "Save it as UTF-8 JSON.") from None
    if not isinstance(document, dict) or not isinstance(document.get("type"), str):
        raise InvalidInput.at(
            place, f"{name} is no GeoJSON", 'Its outermost object has a "type", such as "FeatureCollection".'
        )
    return document


def _refuse_constant(name: str) -> NoReturn:
    raise ValueError(f"it holds {name}, which is no number")


def _once(pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    found = dict(pairs)
    if len(found) < len(pairs):
        keys = [key for key, _ in pairs]
        twice = next(key for number, key in enumerate(keys) if key in keys[:number])
        raise ValueError(f"an object holds the key '{twice[:40]}' twice")
    return found


def _refuse_global_frame(document: dict[str, Any], name: str, place: str) -> None:
    frame = json.dumps(document.get("crs", ""))[:300]
    if any(code in frame for code in _GLOBAL_FRAMES):
        raise InvalidInput.at(
            place,
            f"the crs of {name} says that its coordinates are degrees",
            "Export the plan in a projected frame or a frame of the building, in metres.",
        )


def _geometries(document: dict[str, Any], shapes: _Shapes, file: str) -> Iterator[tuple[str, str, dict[str, Any]]]:
    """Return place, kind and object of every geometry, collections taken apart."""
    waiting: list[tuple[str, str, object, int]] = [(file, "floor", document, 0)]
    while waiting:
        shown, kind, item, level = waiting.pop()
        if not isinstance(item, dict) or level > _MOST_LEVELS:
            problem = "collections are nested too deeply" if level > _MOST_LEVELS else "this is no object"
            shapes.faults.append(Fault(place=shown, problem=problem, repair="Compare with RFC 7946."))
            continue
        what = item.get("type")
        if isinstance(what, str) and what in _COLLECTIONS:
            key, member_name = _COLLECTIONS[what]
            members = item.get(key)
            if not isinstance(members, list):
                shapes.faults.append(Fault(place=shown, problem=f"there is no list of {key}", repair="Add one."))
                continue
            numbered = [
                (f"{shown} {member_name}[{number}]", kind, member, level + 1)
                for number, member in enumerate(members)
            ]
            waiting += reversed(numbered)
        elif what == "Feature":
            known = _kind(item, shown, shapes)
            geometry = item.get("geometry")
            if known is not None and geometry is None:
                shapes.passed_over["null"] = shapes.passed_over.get("null", 0) + 1
            elif known is not None:
                waiting.append((shown, known, geometry, level + 1))
        else:
            yield shown, kind, item


def _kind(feature: dict[str, Any], where: str, shapes: _Shapes) -> str | None:
    properties = feature.get("properties") or {}
    if not isinstance(properties, dict):
        repair = 'Write "properties": { "kind": "floor" }, or null.'
        shapes.faults.append(Fault(place=where, problem="its properties are no object", repair=repair))
        return None
    kind = properties.get("kind", "floor")
    if kind in KINDS:
        return str(kind)
    shown = str(kind)[:60]
    shapes.faults.append(
        Fault(place=where, problem=f"'{shown}' is no kind of area", repair=did_you_mean(shown, KINDS))
    )
    return None


def _take(geometry: dict[str, Any], kind: str, where: str, shapes: _Shapes) -> None:
    """Note the rings of one geometry, or what is wrong with it."""
    what, polygons = geometry.get("type"), geometry.get("coordinates")
    if what not in ("Polygon", "MultiPolygon"):
        shown = str(what)[:40]
        shapes.passed_over[shown] = shapes.passed_over.get(shown, 0) + 1
        return
    for number, rings in enumerate([polygons] if what == "Polygon" else _listed(polygons)):
        part = where if what == "Polygon" else f"{where} part[{number}]"
        arrays = [_ring(ring) for ring in _listed(rings)]
        if not arrays or any(array is None for array in arrays):
            shapes.faults.append(
                Fault(
                    place=part,
                    problem="the coordinates are no rings of at least three corners",
                    repair="Write [[[0, 0], [12, 0], [12, 8], [0, 0]]].",
                )
            )
            continue
        usable = [array for array in arrays if array is not None]
        shapes.corner_count += sum(len(array) for array in usable)
        shapes.rings.append((kind, part, usable))


def _listed(value: object) -> list[Any]:
    return value if isinstance(value, list) else [None]


def _ring(ring: object) -> FloatArray | None:
    """Return the corners of a ring, shape (n, 2); heights are dropped. ``None`` if these are no corners."""
    if not isinstance(ring, list) or len(ring) < 3:
        return None
    try:
        corners = np.asarray(ring)
        truths = any(isinstance(value, bool) for corner in ring for value in corner)
    except (TypeError, ValueError):
        return None
    if truths:
        return None
    if corners.ndim != 2 or corners.shape[1] not in (2, 3) or corners.dtype.kind not in "iuf":
        return None
    return np.asarray(corners[:, :2], dtype=np.float64)


def _refuse_degrees(shapes: _Shapes, units: str, name: str, place: str) -> None:
    corners = np.concatenate([ring for _, _, rings in shapes.rings for ring in rings])
    longitude, latitude, extent = _DEGREES
    if units != "m" or not (np.abs(corners) <= (longitude, latitude)).all():
        return
    sides = np.ptp(corners, axis=0)
    if 0.0 < sides.max() < extent:
        raise InvalidInput.at(
            place,
            f"{name} measures {sides[0]:.3g} x {sides[1]:.3g} about ({corners[0, 0]:.6g}, {corners[0, 1]:.6g}), "
            "which looks like degrees",
            "Export the plan in metres, or state its true unit.",
        )


def _floor(shapes: _Shapes, unit_m: float, name: str, place: str, repair: bool) -> Floor:
    corners_m = np.concatenate([ring for _, _, rings in shapes.rings for ring in rings]) * unit_m
    shift_m = shift_of(corners_m)
    polygons: dict[str, list[Polygon]] = {kind: [] for kind in KINDS}
    notes: list[str] = []
    faults: list[Fault] = []
    for kind, where, rings in shapes.rings:
        shell, *holes = (ring * unit_m - shift_m for ring in rings)
        closed = all((ring[0] == ring[-1]).all() for ring in rings)
        if not closed and not repair:
            faults.append(
                Fault(
                    place=where,
                    problem=f"the ring that begins at ({shell[0, 0]:.4g}, {shell[0, 1]:.4g}) m is not closed",
                    repair="Repeat its first corner at its end, or write repair = true.",
                )
            )
            continue
        if not closed:
            notes.append(
                f"repaired {where}: closed a ring that begins at ({shell[0, 0]:.4g}, {shell[0, 1]:.4g}) m"
            )
        try:
            if repair:
                parts, said = mended_polygon(shell, where, holes)
                notes += [said] if said else []
            else:
                parts = (checked_polygon(shell, where, holes),)
        except InvalidInput as error:
            faults += error.faults
            continue
        polygons[kind] += parts
    if faults:
        raise InvalidInput(faults[:_MOST_FAULTS])
    rooms = polygons["floor"]
    floor = region_of(shapely.union_all(rooms))
    check_region(floor, place)
    check_extents(floor.bounds, place)
    overlap_m2 = sum(room.area for room in rooms) - floor.area
    if len(rooms) > 1:
        notes.append(f"{len(rooms)} floor polygons joined into {len(parts_of(floor))} part(s)")
    if overlap_m2 > 1e-6:
        notes.append(f"floor polygons overlap by {overlap_m2:.4g} m², which counts once")
    for what, count in sorted(shapes.passed_over.items()):
        notes.append(f"passed over {count} geometries of type {what}; only polygons are read")
    zones = zones_of({kind: polygons[kind] for kind in ("no_tags", "metal")}, floor, notes)
    obstacles = on_floor(polygons["obstacle"], floor, notes)
    source = shifted_source(name, shift_m, notes)
    return Floor(
        polygon=floor,
        obstacles=obstacles,
        zones=zones,
        rooms=tuple(rooms) if len(rooms) > 1 else (),
        notes=tuple(notes),
        source=source,
    )
