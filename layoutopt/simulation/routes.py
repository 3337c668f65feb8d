"""Where a robot drives in one trial: a line through the room that its centre has.

Ways are shortest ways, as planners of real robots make them; what differs from replication to replication is
the start and the way points. Routes depend on site, robot and their own random stream, never on a layout.
"""

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Final

import numpy as np
import shapely
from shapely.geometry import Point, Polygon, box
from shapely.geometry.base import BaseGeometry
from shapely.ops import nearest_points

from layoutopt.errors import Fault, InvalidInput, did_you_mean
from layoutopt.identity import BoolArray, FloatArray
from layoutopt.robot import Robot
from layoutopt.scenario import Routes, Scenario
from layoutopt.simulation.free_space import FreeSpace, mesh, random_points, triangles_of
from layoutopt.site import Site, Zone
from layoutopt.units import format_length

CLEARANCE_M: Final = 0.02
"""Room that a drive keeps between the circle about the robot and anything it could touch."""

KINDS: Final = ("patrol", "point_to_point", "circle", "way_points")

_SIMPLIFIED_WITHIN_M: Final = 0.005
_SMALLEST_ROOM_M: Final = 0.05
_CORNERS_PER_TURN: Final = 720
# A drive starts near the first zone that it has to see, and moves about little within a zone, so that a trial
# of a minute sees the zones at all: shares of the whole way of the drive.
_APPROACH_SHARE: Final = 0.25
_WITHIN_ZONE_SHARE: Final = 0.1
_POINTS_IN_ZONE: Final = 3
_POINTS_BETWEEN: Final = 3
_CANDIDATES: Final = 256


@dataclass(frozen=True, slots=True, kw_only=True)
class Route:
    """One way through the room.

    Attributes
    ----------
    line_m
        Its corners, shape (k, 2), m; no two that follow each other are the same.
    stops
        Which corners are places where the robot may be told to pause, shape (k,).
    """

    line_m: FloatArray
    stops: BoolArray


def route(scenario: Scenario, draws: np.random.Generator) -> Route:
    """Return the route of one drive, at least as long as the robot gets in the trial.

    Parameters
    ----------
    scenario
        Its ``routes.kind`` decides: ``"patrol"`` drives closed tours from a random start through every zone
        with a target and on through random points; ``"point_to_point"`` from a random point to a random one in
        every zone with a target, straight after one another, and then from one random point to the next;
        ``"circle"`` about the middle of the floor's bounds; ``"way_points"`` the given points in their order
        and back to the first, starting at a random one of them unless ``routes.start`` says the first. With
        ``routes.centre_spread_m`` circle and way points are shifted first. Only way points are stops.
    draws
        Random stream of the drive.

    Raises
    ------
    InvalidInput
        If the robot fits nowhere, the circle leaves its room, or a way point or a zone with a target lies out
        of reach, at whatever shift.
    """
    kind = scenario.routes.kind
    length_m = scenario.robot.speed_m_s * scenario.duration_s
    if kind == "way_points":
        return _along_way_points(scenario, length_m, draws)
    if kind == "circle":
        line_m = _circle(scenario, length_m, draws)
    elif kind not in KINDS:
        raise InvalidInput.at("routes", f"{kind!r} is no kind of route", did_you_mean(kind, KINDS))
    else:
        space = free_space(scenario.site, scenario.robot.radius_m)
        zones = tuple(zone for zone in scenario.site.zones if zone.target_error_m is not None)
        regions = [_zone_triangles(scenario.site, zone, scenario.robot.radius_m) for zone in zones]
        plan = _point_to_point if kind == "point_to_point" else _patrol
        line_m = plan(space, regions, length_m, draws)
    return Route(line_m=line_m, stops=np.zeros(len(line_m), dtype=np.bool_))


def reachable_region(site: Site, robot: Robot) -> Polygon:
    """Return where the robot's centre can be driven: the largest part of the room that it has.

    The room keeps `CLEARANCE_M` beyond the circle about the robot's outline.

    Raises
    ------
    InvalidInput
        If the robot fits nowhere, with the width it needs and the width there is.
    """
    return _reachable(site, robot.radius_m)


def unreachable_area_m2(site: Site, robot: Robot) -> float:
    """Return the area that has room for the robot's centre, but no way from the `reachable_region`."""
    parts_m2 = shapely.area(shapely.get_parts(site.robot_region(robot.radius_m + CLEARANCE_M)))
    return float(np.sort(parts_m2)[:-1].sum())


@lru_cache(maxsize=32)
def free_space(site: Site, radius_m: float) -> FreeSpace:
    """Return the mesh on which ways of a robot of that radius are planned.

    Its region is the reachable region with fewer corners, which lies within the room of the robot itself.

    Raises
    ------
    InvalidInput
        If the robot fits nowhere.
    """
    region = _reachable(site, radius_m)
    simple = shapely.simplify(region, _SIMPLIFIED_WITHIN_M)
    if isinstance(simple, Polygon) and simple.is_valid and site.robot_region(radius_m).covers(simple):
        region = simple
    return mesh(region)


@lru_cache(maxsize=32)
def _reachable(site: Site, radius_m: float) -> Polygon:
    parts = _polygons(site.robot_region(radius_m + CLEARANCE_M))
    largest = max(parts, key=lambda part: part.area, default=None)
    if largest is None or math.dist(largest.bounds[:2], largest.bounds[2:]) < _SMALLEST_ROOM_M:
        needed_m = 2.0 * (radius_m + CLEARANCE_M)
        widest_m = max(
            2.0 * shapely.maximum_inscribed_circle(part, tolerance=0.001).length
            for part in _polygons(site.open_floor)
        )
        raise InvalidInput.at(
            f"site '{site.name}'",
            f"the robot needs {format_length(needed_m)} of room to turn, with {format_length(CLEARANCE_M)} to "
            f"spare on each side, and some way to go; the widest place has {format_length(widest_m)}",
            "Give a smaller robot outline, whose point (0, 0) is where it turns, or check the unit of the plan.",
        )
    # Equal sites may list their corners from different starts; the mesh must not depend on that.
    return _polygons(largest.normalize())[0]


@lru_cache(maxsize=64)
def _zone_triangles(site: Site, zone: Zone, radius_m: float) -> FloatArray:
    """Return triangles of the part of a zone that the robot can enter; one point thrice if it is only touched."""
    region = free_space(site, radius_m).region.intersection(zone.region)
    if region.is_empty:
        raise InvalidInput.at(
            f"zone '{zone.name}' of site '{site.name}'",
            "the zone has a target, but the robot cannot bring its centre there: it has a radius of "
            f"{format_length(radius_m)} and keeps {format_length(CLEARANCE_M)} to spare",
            "Make the zone larger, or drop its target.",
        )
    parts = _polygons(region)
    if parts:
        return np.concatenate([triangles_of(part) for part in parts])
    nearest, _ = nearest_points(region, zone.region.centroid)
    return np.broadcast_to(np.array(nearest.coords[0]), (1, 3, 2)).copy()


def _polygons(region: BaseGeometry) -> list[Polygon]:
    return [part for part in shapely.get_parts(region) if isinstance(part, Polygon) and part.area > 1e-9]


def _length_m(line: list[FloatArray]) -> float:
    return sum(float(np.linalg.norm(np.diff(leg, axis=0), axis=1).sum()) for leg in line)


def _joined(legs: list[FloatArray]) -> FloatArray:
    """Return legs, each of which starts where the one before ended, as one line without repeated corners."""
    line = np.concatenate([legs[0][:1], *[leg[1:] for leg in legs]])
    return np.asarray(line[_first_of_repeated(line)])


def _first_of_repeated(line_m: FloatArray) -> BoolArray:
    """Return which corners of a line are not the same as the one before.

    Corners within a nanometre count as repeated: the direction between them would be rounding.
    """
    return np.append(True, np.linalg.norm(np.diff(line_m, axis=0), axis=1) > 1e-9)


def _point_to_point(
    space: FreeSpace, zones: list[FloatArray], length_m: float, draws: np.random.Generator
) -> FloatArray:
    here = space.draw(draws, 1)[0][0]
    errands = [random_points(zone, draws, 1)[0][0] for zone in _in_order(zones, draws)]
    legs: list[FloatArray] = []
    while length_m > 0.0:
        there = errands.pop(0) if errands else space.draw(draws, 1)[0][0]
        legs.append(space.way(here, there))
        length_m -= _length_m(legs[-1:])
        here = there
    return _joined(legs)


def _patrol(space: FreeSpace, zones: list[FloatArray], length_m: float, draws: np.random.Generator) -> FloatArray:
    zones = _in_order(zones, draws)
    within_m = _WITHIN_ZONE_SHARE * length_m
    stops = _stops(zones, within_m, draws)
    start = _start(space, stops, _APPROACH_SHARE * length_m, draws)
    here = start
    legs: list[FloatArray] = []
    while length_m > 0.0:
        for there in [*stops, *space.draw(draws, _POINTS_BETWEEN)[0], start]:
            legs.append(space.way(here, there))
            length_m -= _length_m(legs[-1:])
            here = there
            if length_m <= 0.0:
                break
        stops = _stops(zones, within_m, draws)
    return _joined(legs)


def _in_order(zones: list[FloatArray], draws: np.random.Generator) -> list[FloatArray]:
    """Return zones from a random one always on to the nearest that is left."""
    left = list(zones)
    ordered: list[FloatArray] = []
    while left:
        middles = np.array([zone.mean(axis=(0, 1)) for zone in left])
        if ordered:
            following = int(np.argmin(np.linalg.norm(middles - ordered[-1].mean(axis=(0, 1)), axis=1)))
        else:
            following = int(draws.integers(len(left)))
        ordered.append(left.pop(following))
    return ordered


def _stops(zones: list[FloatArray], within_m: float, draws: np.random.Generator) -> list[FloatArray]:
    """Return some random points in each zone, each within a distance of the one before if the zone allows."""
    stops: list[FloatArray] = []
    for zone in zones:
        points_m, _ = random_points(zone, draws, _CANDIDATES)
        stops.append(points_m[0])
        for batch in np.array_split(points_m[1:], _POINTS_IN_ZONE - 1):
            stops.append(batch[_first_within(np.linalg.norm(batch - stops[-1], axis=1), within_m)])
    return stops


def _start(space: FreeSpace, stops: list[FloatArray], within_m: float, draws: np.random.Generator) -> FloatArray:
    """Return a random point with a way of limited length to the first stop, if there is one."""
    points_m, triangles = space.draw(draws, _CANDIDATES)
    if not stops:
        return np.asarray(points_m[0])
    return np.asarray(points_m[_first_within(space.ways_from(stops[0]).lengths_m(points_m, triangles), within_m)])


def _first_within(lengths_m: FloatArray, within_m: float) -> int:
    near = np.flatnonzero(lengths_m <= within_m)
    return int(near[0]) if len(near) else int(np.argmin(lengths_m))


def _circle(scenario: Scenario, length_m: float, draws: np.random.Generator) -> FloatArray:
    radius_m, spread_m = scenario.routes.circle_radius_m, scenario.routes.centre_spread_m
    _circle_fits(scenario.site, scenario.robot.radius_m, radius_m, spread_m)
    turns = np.linspace(0.0, 2.0 * math.pi, _CORNERS_PER_TURN, endpoint=False)
    start_rad, direction = draws.uniform(0.0, 2.0 * math.pi), draws.choice([-1.0, 1.0])
    angles = start_rad + direction * turns
    centre_m = _middle_m(scenario.site) + _shift_m(scenario.routes, draws)
    ring = centre_m + radius_m * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    lap_m = 2.0 * _CORNERS_PER_TURN * radius_m * math.sin(math.pi / _CORNERS_PER_TURN)
    laps = math.ceil(length_m / lap_m)
    return np.concatenate([np.tile(ring, (laps, 1)), ring[:1]])


def _middle_m(site: Site) -> FloatArray:
    xmin, ymin, xmax, ymax = site.bounds_m
    return np.array([(xmin + xmax) / 2.0, (ymin + ymax) / 2.0])


def _shift_m(routes: Routes, draws: np.random.Generator) -> FloatArray:
    """Return how far the routes of this trial are shifted in x and y; without a spread nothing is drawn."""
    if routes.centre_spread_m == 0.0:
        return np.zeros(2)
    return np.asarray(draws.uniform(-routes.centre_spread_m, routes.centre_spread_m, size=2))


@lru_cache(maxsize=64)
def _circle_fits(site: Site, robot_radius_m: float, radius_m: float, spread_m: float) -> None:
    """Refuse a circle about the middle that some shift would bring too close to something.

    What all shifts sweep is the circle's chords, each grown by the square of the shifts.
    """
    room = site.robot_region(robot_radius_m + CLEARANCE_M)
    middle = Point(_middle_m(site))
    angles = np.linspace(0.0, 2.0 * math.pi, _CORNERS_PER_TURN + 1)
    ring = _middle_m(site) + radius_m * np.stack([np.cos(angles), np.sin(angles)], axis=1)
    corners = spread_m * np.array([(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)])
    ends = np.concatenate([ring[:-1, None] + corners, ring[1:, None] + corners], axis=1)
    shapely.prepare(room)
    if radius_m > 0.0 and shapely.covers(room, shapely.convex_hull(shapely.multipoints(ends))).all():
        return
    largest_m = room.boundary.distance(middle) - spread_m * math.sqrt(2.0) if room.covers(middle) else 0.0
    shifted = f", shifted by up to {format_length(spread_m)}," if spread_m > 0.0 else ""
    raise InvalidInput.at(
        "routes.circle_radius",
        f"a circle of {format_length(radius_m)} about the floor's middle ({middle.x:.4g}, {middle.y:.4g}) m"
        f"{shifted} does not fit a robot with a radius of {format_length(robot_radius_m)}",
        f"Give less than {format_length(largest_m)}." if largest_m > 0.0 else "Give another kind of route.",
    )


def _along_way_points(scenario: Scenario, length_m: float, draws: np.random.Generator) -> Route:
    site, radius_m, routes = scenario.site, scenario.robot.radius_m, scenario.routes
    legs = _tour(site, radius_m, routes)
    first = 0 if routes.start == "first" else int(draws.integers(len(legs)))
    if routes.centre_spread_m > 0.0:
        legs = _ways_round(free_space(site, radius_m), routes.way_points_m + _shift_m(routes, draws))
    laps = math.ceil(length_m / _length_m(list(legs)))
    ordered = [*legs[first:], *legs[:first]] * laps
    line_m = np.concatenate([ordered[0][:1], *[leg[1:] for leg in ordered]])
    stops = np.zeros(len(line_m), dtype=np.bool_)
    stops[np.cumsum([0, *[len(leg) - 1 for leg in ordered]])] = True
    kept = _first_of_repeated(line_m)
    # A way point that is the same place as the corner before passes its stop on to that one.
    stops = np.logical_or.reduceat(stops, np.flatnonzero(kept))
    return Route(line_m=line_m[kept], stops=stops)


@lru_cache(maxsize=64)
def _tour(site: Site, radius_m: float, routes: Routes) -> tuple[FloatArray, ...]:
    """Return the ways from each way point to the next and from the last back to the first, none of them shifted.

    Way points are refused that the robot cannot reach at every shift.
    """
    points_m, spread_m = routes.way_points_m, routes.centre_spread_m
    space = free_space(site, radius_m)
    faults = [
        Fault(
            place=f"routes.way_points[{number}]",
            problem=(
                f"the robot cannot bring its centre to ({point[0]:.4g}, {point[1]:.4g}) m: "
                f"{_reason(site, radius_m, point)}"
            ),
            repair=_nearest(space, point),
        )
        for number, point in enumerate(points_m)
        if not space.region.covers(Point(point))
    ]
    faults += [
        Fault(
            place=f"routes.way_points[{number}]",
            problem=(
                f"shifted by up to {format_length(spread_m)}, ({point[0]:.4g}, {point[1]:.4g}) m comes to places "
                "that the robot cannot bring its centre to"
            ),
            repair="Move it away from walls and obstacles, or shift by less.",
        )
        for number, point in enumerate(points_m)
        if not faults and spread_m > 0.0 and not space.region.covers(box(*(point - spread_m), *(point + spread_m)))
    ]
    if faults:
        raise InvalidInput(faults)
    legs = _ways_round(space, points_m)
    if _length_m(list(legs)) < _SMALLEST_ROOM_M:
        raise InvalidInput.at("routes.way_points", "the way points are all the same", "Give at least two places.")
    return legs


def _ways_round(space: FreeSpace, points_m: FloatArray) -> tuple[FloatArray, ...]:
    following = np.roll(points_m, -1, axis=0)
    return tuple(space.way(here, there) for here, there in zip(points_m, following, strict=True))


def _reason(site: Site, radius_m: float, point: FloatArray) -> str:
    place = Point(point)
    if not site.floor.covers(place):
        return "it lies outside the floor"
    if not site.open_floor.covers(place):
        return "it lies in an obstacle"
    if not site.robot_region(radius_m + CLEARANCE_M).covers(place):
        room_m = format_length(site.open_floor.boundary.distance(place))
        return f"the nearest wall or obstacle is {room_m} away, {format_length(radius_m + CLEARANCE_M)} are needed"
    return "no way leads there from the largest part of the floor"


def _nearest(space: FreeSpace, point: FloatArray) -> str:
    nearest, _ = nearest_points(space.region, Point(point))
    return f"The nearest place that it can reach is about ({nearest.x:.3f}, {nearest.y:.3f}) m."
