"""Who walks where in a trial of tracking, and what stands about: the target, bystanders and clutter.

Nobody gets out of anybody's way: bystanders pass through each other and through the target, but neither through
things nor through the robot.
"""

from functools import lru_cache
from typing import Final

import numpy as np
import shapely
from shapely.geometry import LineString, Point
from shapely.geometry.base import BaseGeometry

from layoutopt.errors import InvalidInput
from layoutopt.geometry import covers
from layoutopt.identity import FloatArray
from layoutopt.scenario import Scenario
from layoutopt.simulation.free_space import random_points, triangles_of
from layoutopt.tracking_world import TrackingWorld
from layoutopt.units import format_length

GAP_M: Final = 0.05
"""Room that things leave to each other, to who walks and to the robot, so that nothing touches."""
SHORTEST_WAY_M: Final = 1.0
"""A bystander walks to and fro over at least a step and a half: who only shifts his weight does not walk."""
_CANDIDATES: Final = 256
_ROUNDS: Final = 16
"""A thing or way for which none of 4,096 random places fits has no room worth the name."""


def tracking_world(scenario: Scenario) -> TrackingWorld:
    """Return the world of tracking of a scenario, once robot and walk have been found to fit the site.

    Raises
    ------
    InvalidInput
        If the scenario has none, robot or walk are not on the floor, or the walk leads through the robot.
    """
    if scenario.tracking is None:
        raise InvalidInput.at(
            f"scenario '{scenario.name}'",
            "there is nobody to track",
            "Give the scenario a TrackingWorld, or the spec a table [tracking].",
        )
    _check_places(scenario)
    return scenario.tracking


@lru_cache(maxsize=64)
def _check_places(scenario: Scenario) -> None:
    world = scenario.tracking
    assert world is not None
    place, room = f"scenario '{scenario.name}', tracking", scenario.site.open_floor
    x_m, y_m, _ = world.robot_pose
    if not covers(room, np.array([(x_m, y_m)]))[0]:
        raise InvalidInput.at(
            place,
            f"the robot at ({x_m:g}, {y_m:g}) m stands off the floor or in an obstacle",
            "Place it on the open floor.",
        )
    walk = _closed(world)
    if not room.covers(walk):
        raise InvalidInput.at(
            place,
            f"{format_length(walk.difference(room).length)} of the walk lead off the floor or through an obstacle",
            "Move its corners, or add some that lead around; the walk closes itself.",
        )
    needed_m, gap_m = scenario.robot.radius_m + world.person_radius_m, walk.distance(Point(x_m, y_m))
    if gap_m < needed_m:
        raise InvalidInput.at(
            place,
            f"the walk comes within {format_length(gap_m)} of the middle of the robot, and robot and person take "
            f"{format_length(needed_m)}",
            "Move the walk or the robot.",
        )


def lap_m(world: TrackingWorld) -> float:
    """Return the length of the target's walk, once round."""
    return float(_closed(world).length)


def target_places(world: TrackingWorld, start_share: float, times_s: FloatArray) -> FloatArray:
    """Return where the target is at given times, shape (..., 2), m: round and round at its speed.

    ``start_share`` says at which share of the walk it is at time 0.
    """
    corners_m = np.concatenate([world.walk_m, world.walk_m[:1]])
    gone_m = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(corners_m, axis=0).T))])
    at_m = (start_share * gone_m[-1] + world.walking_speed_m_s * np.asarray(times_s)) % gone_m[-1]
    return np.stack([np.interp(at_m, gone_m, corners_m[:, axis]) for axis in (0, 1)], axis=-1)


def clutter(scenario: Scenario, draws: np.random.Generator) -> FloatArray:
    """Return the things that stand about in one trial: x, y and radius, shape (clutter_count, 3), m.

    They stand wholly on the open floor, at random places that are even over what is left of it, one after the
    other, `GAP_M` off each other, the robot, and the person who walks. Unless ``clutter_hides``, they also stay
    off the hull of robot and walk, so that none stands between the two.

    Raises
    ------
    InvalidInput
        If there is no room for all of them, with how many found a place.
    """
    world = tracking_world(scenario)
    radius_m, count = world.clutter_radius_m, world.clutter_count
    things_m = np.empty((0, 2))
    triangles_m = _clutter_room(scenario)
    while len(things_m) < count:
        found_m = None
        for _ in range(_ROUNDS if len(triangles_m) else 0):
            places_m, _ = random_points(triangles_m, draws, _CANDIDATES)
            apart_m = np.hypot(*np.moveaxis(places_m[:, None] - things_m, -1, 0)).min(axis=1, initial=np.inf)
            fits = np.flatnonzero(apart_m >= 2.0 * radius_m + GAP_M)
            if len(fits):
                found_m = places_m[fits[0]]
                break
        if found_m is None:
            kept = "the walk" if world.clutter_hides else "the ground between robot and walk"
            raise InvalidInput.at(
                f"scenario '{scenario.name}', tracking",
                f"of {count} things of {format_length(2.0 * radius_m)} only {len(things_m)} find room on the "
                f"floor, off {kept}, the robot and each other",
                "Have fewer or smaller things, or a larger floor.",
            )
        things_m = np.concatenate([things_m, found_m[None]])
    return np.column_stack([things_m, np.full(count, radius_m)])


def bystander_places(
    scenario: Scenario, things: FloatArray, draws: np.random.Generator, times_s: FloatArray
) -> FloatArray:
    """Return where bystanders are at given times, shape (n, bystanders, 2), m.

    Each walks straight to and fro between two random places of the site, at the target's speed and from a random
    place of that way on; no wall, thing or robot is in the way. One bystander more changes nothing for the others.

    Raises
    ------
    InvalidInput
        If no such way of `SHORTEST_WAY_M` or more is found.
    """
    world = tracking_world(scenario)
    places_m = np.empty((len(times_s), world.bystanders, 2))
    for number in range(world.bystanders):
        start_m, end_m = _way(scenario, things, draws)
        length_m = float(np.hypot(*(end_m - start_m)))
        gone_m = 2.0 * length_m * draws.random() + world.walking_speed_m_s * times_s
        # To and fro: a triangle wave of one way and back.
        share = 1.0 - np.abs(gone_m / length_m % 2.0 - 1.0)
        places_m[:, number] = start_m + share[:, None] * (end_m - start_m)
    return places_m


def _way(scenario: Scenario, things: FloatArray, draws: np.random.Generator) -> tuple[FloatArray, FloatArray]:
    """Return the ends of a random straight way on which a person touches nothing."""
    world = tracking_world(scenario)
    room, triangles_m = _bystander_room(scenario)
    for _ in range(_ROUNDS if len(triangles_m) else 0):
        ends_m = random_points(triangles_m, draws, 2 * _CANDIDATES)[0].reshape(_CANDIDATES, 2, 2)
        ways = shapely.linestrings(ends_m)
        free = (shapely.length(ways) >= SHORTEST_WAY_M) & shapely.covers(room, ways)
        for x_m, y_m, radius_m in things:
            free &= shapely.distance(ways, Point(x_m, y_m)) >= radius_m + world.person_radius_m
        fits = np.flatnonzero(free)
        if len(fits):
            return ends_m[fits[0], 0], ends_m[fits[0], 1]
    raise InvalidInput.at(
        f"scenario '{scenario.name}', tracking",
        f"no straight way of {format_length(SHORTEST_WAY_M)} is free on which a bystander could walk",
        "Leave out bystanders, or some of the clutter.",
    )


def _closed(world: TrackingWorld) -> LineString:
    return LineString(np.concatenate([world.walk_m, world.walk_m[:1]]))


@lru_cache(maxsize=32)
def _clutter_room(scenario: Scenario) -> FloatArray:
    """Return where middles of things may be before any stands, as triangles; none where they may nowhere."""
    world = tracking_world(scenario)
    room = scenario.site.robot_region(world.clutter_radius_m)
    kept: BaseGeometry = _closed(world)
    if not world.clutter_hides:
        kept = kept.union(Point(world.robot_pose[:2])).convex_hull
    room = room.difference(kept.buffer(world.person_radius_m + world.clutter_radius_m + GAP_M))
    return _triangles(room.difference(_robot(scenario, world.clutter_radius_m + GAP_M)))


@lru_cache(maxsize=32)
def _bystander_room(scenario: Scenario) -> tuple[BaseGeometry, FloatArray]:
    """Return where middles of people may be, whatever stands about, and its triangles."""
    world = tracking_world(scenario)
    room = scenario.site.robot_region(world.person_radius_m)
    room = room.difference(_robot(scenario, world.person_radius_m + GAP_M))
    shapely.prepare(room)
    return room, _triangles(room)


def _robot(scenario: Scenario, margin_m: float) -> BaseGeometry:
    world = tracking_world(scenario)
    return Point(world.robot_pose[:2]).buffer(scenario.robot.radius_m + margin_m)


def _triangles(room: BaseGeometry) -> FloatArray:
    return triangles_of(room) if room.area > 0.0 else np.empty((0, 3, 2))
