"""From ``[site]`` and ``[robots]`` to the floor, its zones and the robot, with their fit checked."""

import inspect
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path
from typing import Any, Final

import numpy as np
import shapely
from shapely.geometry import MultiPolygon, Point, Polygon
from shapely.geometry.base import BaseGeometry
from shapely.geometry.polygon import orient

from layoutopt import registry
from layoutopt.errors import Fault, InvalidInput
from layoutopt.layout import PLAIN_TAG
from layoutopt.plans.floor import Floor, check_extents, check_region, checked_polygon
from layoutopt.plans.inline import polygon_from
from layoutopt.plans.placing import Layers, Scale
from layoutopt.robot import Drive, Gyro, Odometry, Robot
from layoutopt.scenario import Role, Routes, Scenario
from layoutopt.site import Site, Tiling, Zone
from layoutopt.spec.findings import Findings
from layoutopt.spec.lines import KeyPath, written
from layoutopt.spec.quantities import in_si
from layoutopt.spec.schema import LayersTable, PlanTable, RobotsTable, ScaleTable, SiteTable, ZoneTable
from layoutopt.units import Dimension, format_length

PLAN_READERS: Final[Mapping[str, str]] = {
    ".yaml": "occupancy_map",
    ".yml": "occupancy_map",
    ".dxf": "dxf",
    ".geojson": "geojson",
    ".json": "geojson",
    ".png": "image",
}
"""Plan reader for each kind of file."""
_PLAN_SETTINGS: Final[Mapping[str, tuple[str, Dimension | None]]] = {
    "units": ("units", None),
    "layers": ("layers", None),
    "gap": ("gap_m", "length"),
    "thickest_wall": ("thickest_wall_m", "length"),
    "line_wall": ("line_wall_m", "length"),
    "smallest_room": ("smallest_room_m2", "area"),
    "tolerance": ("tolerance_m", "length"),
    "scale": ("scale", None),
    "threshold": ("threshold", "share"),
    "border": ("border", None),
    "repair": ("repair", None),
    "accept_recovered": ("accept_recovered", None),
}
"""Key of ``[site.plan]``, with the parameter of plan readers that it sets and its dimension."""
_SITE: Final = ("site",)
_ROBOTS: Final = ("robots",)
_PLAN: Final = "site.plan"
_FLOOR: Final = "site.floor"
_BEYOND_M2: Final = 1e-6
_SLIVER_M: Final = 0.001
"""By so much a zone may stick out of any floor and is cut back: drawings are read within it."""
_SLIVER_PIXELS: Final = 0.5
"""The same for a map of pixels: a wall within a pixel may be anywhere in it."""
_BORDER_POINTS: Final = 4000
_GRID_POINTS: Final = 64
_CUT_OFF_M2: Final = 0.01
_KINDS_OF_PLANS: Final = "a ROS map (.yaml), a drawing (.dxf), GeoJSON (.geojson) or an image (.png)"
_ROBOT_SIDE_M: Final = (0.05, 10.0)


def site_of(
    table: SiteTable, folder: Path, findings: Findings, tag_part: str = PLAIN_TAG
) -> tuple[Site | None, Floor | None]:
    """Return the site and what its plan or its corners gave; each is ``None`` after a fault of its own.

    ``tag_part`` is the tag that is laid, which some rules of zones bar and others do not.
    """
    before = findings.count
    floor = _floor(table, folder, findings)
    obstacles = [
        _polygon(ring, (*_SITE, "obstacles", number), findings) for number, ring in enumerate(table.obstacles)
    ]
    zones = [_zone(zone, tag_part, (*_SITE, "zone", number), findings) for number, zone in enumerate(table.zone)]
    _refuse_equal_names(table.zone, findings)
    if floor is None:
        return None, None
    standing = (*floor.obstacles, *(obstacle for obstacle in obstacles if obstacle is not None))
    for number, obstacle in enumerate(obstacles):
        if obstacle is not None and not obstacle.intersects(floor.polygon):
            findings.add((*_SITE, "obstacles", number), "this obstacle lies outside the floor", "Move or drop it.")
    open_floor = floor.polygon.difference(shapely.union_all(standing)) if standing else floor.polygon
    if open_floor.area < _BEYOND_M2:
        findings.add((*_SITE, "obstacles"), "the obstacles cover the whole floor", "Make them smaller.")
    fitted, notes = [], list(floor.notes)
    for number, zone in enumerate(zones):
        if zone is not None:
            zone, note = _fitted(zone, floor, open_floor, (*_SITE, "zone", number), findings)
            fitted.append(zone)
            notes += [note] if note else []
    floor = replace(floor, notes=tuple(notes))
    own = {zone.name for zone in table.zone}
    if clash := sorted(own & {zone.name for zone in floor.zones}):
        findings.add((*_SITE, "zone"), f"the plan draws a zone '{clash[0]}' too", "Give yours another name.")
    if findings.count > before:
        return None, floor
    site = Site(
        name=table.name,
        floor=floor.polygon,
        obstacles=standing,
        zones=(*floor.zones, *fitted),
        tiling=_tiling(table),
        source=table.source or floor.source,
    )
    return site, floor


def robot_of(table: RobotsTable, findings: Findings) -> Robot | None:
    """Return the robot, ``None`` after a fault."""
    path = (*_ROBOTS, "outline")
    outline = _polygon(table.outline, path, findings)
    if outline is None:
        return None
    sides_m = (outline.bounds[2] - outline.bounds[0], outline.bounds[3] - outline.bounds[1])
    if not all(_ROBOT_SIDE_M[0] <= side_m <= _ROBOT_SIDE_M[1] for side_m in sides_m):
        findings.add(
            path,
            f"the robot measures {format_length(sides_m[0])} by {format_length(sides_m[1])}",
            f"Give sides from {_ROBOT_SIDE_M[0]:g} to {_ROBOT_SIDE_M[1]:g} m; check the unit.",
        )
        return None
    if not outline.covers(shapely.Point(0.0, 0.0)):
        findings.add(path, "base_link, the point (0, 0), lies outside the outline", "Give corners around (0, 0).")
        return None
    odometry = table.odometry
    return Robot(
        outline_m=np.array(outline.exterior.coords)[:-1],
        drive=Drive(table.drive),
        odometry=Odometry(
            translation_share=in_si(odometry.translation, "share"),
            rotation_rad_per_m=in_si(odometry.rotation, "angle_per_length"),
            lateral_share=in_si(odometry.lateral, "share"),
            half_track_m=in_si(odometry.half_track, "length"),
            translation_m_per_sqrt_s=in_si(odometry.translation_after_1s, "length"),
            rotation_rad_per_sqrt_s=in_si(odometry.rotation_after_1s, "angle"),
        ),
        gyro=Gyro(
            random_walk_rad_per_sqrt_s=in_si(table.gyro.random_walk_after_1s, "angle"),
            bias_sigma_rad_s=in_si(table.gyro.bias, "angular_speed"),
        ),
        gyro_fitted=table.gyro.fitted,
        speed_m_s=in_si(table.speed, "speed"),
        turn_rate_rad_s=in_si(table.turn_rate, "angular_speed"),
    )


def routes_of(table: RobotsTable, findings: Findings) -> Routes | None:
    """Return where the robots drive in the search, ``None`` after a fault."""
    before = findings.count
    pause_s = in_si(table.pause, "time")
    if pause_s > 0.0 and isinstance(table.routes, str):
        findings.add(
            (*_ROBOTS, "pause"),
            f"pauses are made at way points, and the routes are '{table.routes}'",
            "Give robots.routes as a list of way points, or leave the pause out.",
        )
    if table.heading is not None and table.drive != Drive.OMNIDIRECTIONAL.value:
        findings.add(
            (*_ROBOTS, "heading"),
            f"a {table.drive} drive looks where it goes and cannot keep a heading",
            'Write drive = "omnidirectional", or leave the heading out.',
        )
    if findings.count > before:
        return None
    heading_rad = None if table.heading is None else in_si(table.heading, "angle")
    if isinstance(table.routes, str):
        return Routes(kind=table.routes, heading_rad=heading_rad)
    points_m = [[in_si(value, "length") for value in point] for point in table.routes]
    return Routes(kind="way_points", way_points_m=np.array(points_m), pause_s=pause_s, heading_rad=heading_rad)


def robot_fits(site: Site, robot: Robot, routes: Routes, findings: Findings) -> tuple[str, ...]:
    """Note a robot that fits nowhere, and zones with a target or way points that it cannot reach.

    What cannot be reached is found by planning one drive. Return a note if part of the floor is cut off.
    """
    from layoutopt.simulation.routes import reachable_region, route, unreachable_area_m2

    scenario = Scenario(name="check", role=Role.DESIGN, site=site, robot=robot, routes=routes, step_count=1)
    try:
        region = reachable_region(site, robot)
        route(scenario, np.random.Generator(np.random.Philox(0)))
    except InvalidInput as error:
        for fault in error.faults:
            number = fault.place.removeprefix("routes.way_points")
            of_routes = number != fault.place
            own = Fault(
                place=f"robots.routes{number}" if of_routes else fault.place,
                problem=fault.problem,
                repair=fault.repair,
            )
            findings.take(InvalidInput(own), (*_ROBOTS, "routes") if of_routes else _ROBOTS)
        return ()
    cut_off_m2 = unreachable_area_m2(site, robot)
    if cut_off_m2 < _CUT_OFF_M2:
        return ()
    return (
        f"the robot's centre has {region.area:.2f} m² to drive in; {cut_off_m2:.2f} m² more have room for it "
        "but no way leads there",
    )


def _floor(table: SiteTable, folder: Path, findings: Findings) -> Floor | None:
    if (table.plan is None) == (table.floor is None):
        problem = "a site needs a floor" if table.plan is None else "a site has either a plan or a floor"
        findings.add(_SITE, problem, 'Write plan = "ward.yaml", or floor = [[0, 0], [12, 0], [12, 8], [0, 8]].')
        return None
    try:
        return _plan(table.plan, folder) if table.plan is not None else _inline(table.floor)
    except InvalidInput as error:
        findings.take(error, (*_SITE, "floor" if table.plan is None else "plan"))
        return None


def _plan(plan: PlanTable, folder: Path) -> Floor:
    suffix = Path(plan.file).suffix.lower()
    if suffix not in PLAN_READERS:
        raise InvalidInput.at(
            _PLAN,
            f"no plan reader takes {suffix or 'files without an ending'}",
            f"Give {_KINDS_OF_PLANS}, or write the corners as floor = [...].",
        )
    name = PLAN_READERS[suffix]
    reader = registry.load("plans", name, place=_PLAN)
    floor: Floor = reader(folder / plan.file, place=_PLAN, **_plan_settings(plan, reader, name))
    return floor


def _plan_settings(plan: PlanTable, reader: Callable[..., Floor], name: str) -> dict[str, Any]:
    """Return the parameters of a plan reader that the spec sets."""
    known = inspect.signature(reader).parameters
    given = {key: value for key, value in plan if key != "file" and value is not None}
    useless = [key for key in given if _PLAN_SETTINGS[key][0] not in known]
    if useless:
        of_use = [key for key, (parameter, _) in _PLAN_SETTINGS.items() if parameter in known]
        raise InvalidInput.at(
            _PLAN, f"the reader '{name}' has no use for {', '.join(useless)}", f"It takes {', '.join(of_use)}."
        )
    settings: dict[str, Any] = {}
    for key, value in given.items():
        parameter, dimension = _PLAN_SETTINGS[key]
        if isinstance(value, LayersTable):
            value = Layers(**{kind: tuple(names) for kind, names in value})
        elif isinstance(value, ScaleTable):
            value = Scale(
                first_px=(float(value.first[0]), float(value.first[1])),
                second_px=(float(value.second[0]), float(value.second[1])),
                distance_m=in_si(value.distance, "length"),
            )
        settings[parameter] = value if dimension is None else in_si(value, dimension)
    return settings


def _inline(shape: Any) -> Floor:
    """Return the floor of a ring, of rings (holes after the outline), or of a list of polygons."""
    depth, inner = 0, shape
    while isinstance(inner, list):
        depth, inner = depth + 1, inner[0]
    polygon: Polygon | MultiPolygon
    if depth == 2:
        polygon = polygon_from(shape, _FLOOR)
    else:
        polygons = []
        for number, rings in enumerate([shape] if depth == 3 else shape):
            shell, *holes = ([[in_si(value, "length") for value in point] for point in ring] for ring in rings)
            polygons.append(checked_polygon(shell, f"{_FLOOR}[{number}]" if depth == 4 else _FLOOR, holes))
        polygon = polygons[0] if len(polygons) == 1 else MultiPolygon(polygons)
        check_region(polygon, _FLOOR)
    check_extents(polygon.bounds, _FLOOR)
    return Floor(polygon=polygon)


def _polygon(ring: Any, path: KeyPath, findings: Findings) -> Polygon | None:
    try:
        return polygon_from(ring, written(path))
    except InvalidInput as error:
        findings.take(error, path)
        return None


def _zone(table: ZoneTable, tag_part: str, path: KeyPath, findings: Findings) -> Zone | None:
    region = _polygon(table.region, (*path, "region"), findings)
    if region is None:
        return None
    zone = Zone(
        name=table.name,
        region=region,
        tags=table.tags,
        metal=table.metal,
        drill=table.drill,
        target_error_m=None if table.target_error is None else in_si(table.target_error, "length"),
    )
    rule = zone.rule_against(tag_part)
    if rule and zone.target_error_m is not None:
        findings.add(
            (*path, "target_error"),
            f"a target in a zone without tags of the part '{tag_part}' ({rule}) cannot be met there",
            "Drop the target, or the rule that bars tags, or lay another part (parts.tag).",
        )
    return zone


def _fitted(
    zone: Zone, floor: Floor, open_floor: BaseGeometry, path: KeyPath, findings: Findings
) -> tuple[Zone, str]:
    """Return a zone, cut back with a note if it hardly sticks out of the floor; refuse one that lies farther out.

    A pillar of a map is a hole in the floor; a zone may lie over it as over an obstacle.
    """
    filled = shapely.union_all([Polygon(part.exterior) for part in shapely.get_parts(floor.polygon)])
    beyond = zone.region.difference(filled.buffer(1e-6))
    if not zone.region.intersects(filled):
        findings.add((*path, "region"), f"zone '{zone.name}' lies outside the floor", "Draw it on the floor.")
        return zone, ""
    if zone.region.intersection(filled).area >= _BEYOND_M2 > zone.region.intersection(open_floor).area:
        findings.add((*path, "region"), f"obstacles cover the whole of zone '{zone.name}'", "Move the zone.")
        return zone, ""
    if beyond.area <= _BEYOND_M2:
        return zone, ""
    depth_m, place = _sticks_out(beyond, filled)
    x_m, y_m = (round(value_m, 2) + 0.0 for value_m in (place.x, place.y))  # -0.0 becomes 0.0
    told = f"up to {format_length(depth_m)}, near ({x_m:.2f}, {y_m:.2f}) m"
    within = [part for part in shapely.get_parts(zone.region.intersection(filled)) if part.area > _BEYOND_M2]
    one = len(within) == 1 and isinstance(within[0], Polygon) and not within[0].interiors
    if one and depth_m <= max(_SLIVER_M, _SLIVER_PIXELS * floor.pixel_m):
        note = f"zone '{zone.name}' stuck out of the floor by {told}: {beyond.area:.3g} m² were cut off"
        return replace(zone, region=orient(within[0])), note
    findings.add(
        (*path, "region"),
        f"{beyond.area:.3g} m² of zone '{zone.name}' lie outside the floor, {told}",
        "Draw the zone within the outer edge of the floor.",
    )
    return zone, ""


def _sticks_out(beyond: BaseGeometry, filled: BaseGeometry) -> tuple[float, Point]:
    """Return how far the farthest point of what lies beyond the floor is from it, and that point.

    Looked at are its corners and points of its border and inside, since a zone may reach over the wall between two
    rooms, whose corners are on the floor. So it may be too little by half the distance of two such points.
    """
    border = beyond.boundary
    corners_m = shapely.get_coordinates(shapely.segmentize(border, border.length / _BORDER_POINTS))
    west_m, south_m, east_m, north_m = beyond.bounds
    across = np.linspace(west_m, east_m, _GRID_POINTS), np.linspace(south_m, north_m, _GRID_POINTS)
    grid_m = np.stack(np.meshgrid(*across), axis=-1).reshape(-1, 2)
    grid_m = grid_m[shapely.contains_xy(beyond, grid_m[:, 0], grid_m[:, 1])]
    places_m = np.concatenate([corners_m, grid_m])
    edge_m, ring = shapely.get_coordinates(shapely.get_rings(shapely.get_parts(filled)), return_index=True)
    sides = shapely.linestrings(np.stack([edge_m[:-1], edge_m[1:]], axis=1)[ring[:-1] == ring[1:]])
    # One nearest side for each place, in their order.
    _, distances_m = shapely.STRtree(sides).query_nearest(
        shapely.points(places_m), return_distance=True, all_matches=False
    )
    farthest = int(distances_m.argmax())
    return float(distances_m[farthest]), Point(places_m[farthest])


def _refuse_equal_names(zones: list[ZoneTable], findings: Findings) -> None:
    known: set[str] = set()
    for number, name in enumerate(zone.name for zone in zones):
        known_before = len(known)
        known.add(name)
        if len(known) == known_before:
            findings.add((*_SITE, "zone", number, "name"), "two zones have this name", "Give each its own.")


def _tiling(table: SiteTable) -> Tiling | None:
    tiling = table.tiling
    if tiling is None:
        return None
    x_m, y_m = (in_si(value, "length") for value in tiling.origin)
    return Tiling(size_m=in_si(tiling.size, "length"), origin_m=(x_m, y_m), angle_rad=in_si(tiling.angle, "angle"))
