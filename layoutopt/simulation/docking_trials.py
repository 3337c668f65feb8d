"""Trials of docking on a site: one replication is one drive from a random start to the transponder.

Layouts that differ in the place of the transponder meet the same trials as far as the rules allow. A start is the
first of a fixed list of places that is far enough from the transponder, a scatterer the first of a list of its own
that is clear of start and transponder; so a place that one candidate forbids changes that start or scatterer for
it, and nothing else. First heading and noise are the same for all.
"""

from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Final, cast

import numpy as np
import shapely

from layoutopt.docking_world import DockingWorld
from layoutopt.errors import InvalidInput
from layoutopt.geometry import covers
from layoutopt.identity import BoolArray, FloatArray
from layoutopt.layout import Layout, Transponder
from layoutopt.protocols import AnyEstimator
from layoutopt.scenario import Scenario
from layoutopt.scores import DOCKING_UNITS, TrialOutcomes
from layoutopt.simulation.docking import follow
from layoutopt.simulation.docking_ground import DockingGround, SiteWalls, site_walls
from layoutopt.simulation.free_space import random_points, triangles_of
from layoutopt.simulation.routes import free_space
from layoutopt.site import Site
from layoutopt.streams import Purpose, Streams
from layoutopt.units import format_length

if TYPE_CHECKING:
    from layoutopt.estimators.bearings import BearingEstimator

DOCK: Final = "dock"
"""Name of the transponder that robots dock at where a layout has several."""
_STARTS: Final = 512
"""Places in the list of a trial from which its start is taken."""
_PLACES: Final = 64
"""Places in the list of each random scatterer."""


@dataclass(frozen=True, slots=True, kw_only=True)
class DockingSetting:
    """What a trial draws.

    Attributes
    ----------
    start_m, heading_rad
        Where the robot starts, shape (2,), m, and faces, rad.
    scatterers_m
        Those of the scenario, then the random ones, shape (k, 2), m.
    noise_rad
        Error of each direction beside what scattering does, shape (steps,), rad.
    """

    start_m: FloatArray
    heading_rad: float
    scatterers_m: FloatArray
    noise_rad: FloatArray


def run_docking_trials(
    layout: Layout, scenario: Scenario, estimator: AnyEstimator, streams: Streams, first: int, count: int
) -> TrialOutcomes:
    """Return the outcomes of replications ``first`` to ``first + count - 1``.

    Columns are those of `DOCKING_UNITS`: whether the robot docked, the steps it took, also where it failed, and
    the mean size of the angle between the bearing that the estimator gave and the true one.

    Raises
    ------
    InvalidInput
        If the estimator cannot work with the layout, the scenario has no docking, or the ground is refused as
        `docking_ground` and `docking_setting` tell.
    ValueError
        If ``count`` is not positive.
    """
    if count < 1:
        raise ValueError(f"trials are counted from 1, got {count}")
    reason = estimator.applies(layout)
    if reason:
        repair = "Choose another estimator, or a layout that it can work with."
        raise InvalidInput.at(f"estimator '{estimator.name}'", f"does not apply, because {reason}", repair)
    ground = docking_ground(layout, scenario)
    settings = [
        docking_setting(ground, scenario, streams, replication) for replication in range(first, first + count)
    ]
    outcomes = follow(
        ground,
        np.array([setting.start_m for setting in settings]),
        np.array([setting.heading_rad for setting in settings]),
        np.array([setting.scatterers_m for setting in settings]),
        np.array([setting.noise_rad for setting in settings]),
        cast("BearingEstimator", estimator),
    )
    return TrialOutcomes(
        replications=np.arange(first, first + count),
        columns=tuple(DOCKING_UNITS),
        values=np.column_stack([outcomes.docked, outcomes.steps, outcomes.mean_error_rad]),
    )


def docking_transponder(layout: Layout) -> Transponder:
    """Return the transponder that robots dock at: the only one, or that of the name `DOCK`.

    Raises
    ------
    InvalidInput
        If there is none, or which one is meant does not show.
    """
    if len(layout.transponders) == 1:
        return layout.transponders[0]
    named = [transponder for transponder in layout.transponders if transponder.name == DOCK]
    if len(named) != 1:
        names = ", ".join(f"'{transponder.name}'" for transponder in layout.transponders) or "none"
        raise InvalidInput.at(
            "transponders", f"robots dock at one, and the layout has {names}", f"Name just one of them '{DOCK}'."
        )
    return named[0]


def docking_ground(layout: Layout, scenario: Scenario) -> DockingGround:
    """Return the site of a scenario as robots find it that dock at the transponder of a layout.

    Raises
    ------
    InvalidInput
        If the scenario has no docking, the robot fits nowhere, or the transponder lies off the floor, inside an
        obstacle or a scatterer of the scenario, where no robot gets near enough, or within reach of all starts.
    """
    transponder, world, site = docking_transponder(layout), scenario.docking, scenario.site
    if world is None:
        raise InvalidInput.at(
            f"scenario '{scenario.name}'", "it says nothing of docking", "Give it a DockingWorld."
        )
    place_m = np.array(transponder.position_m[:2])
    place = f"transponder '{transponder.name}' at {format_place(place_m)}"
    for number, obstacle in enumerate(site.obstacles, start=1):
        if obstacle.contains(shapely.Point(place_m)):
            raise InvalidInput.at(
                place, f"it lies inside obstacle {number} of the site", "Move it onto the floor."
            )
    if not covers(site.floor, place_m[None])[0]:
        raise InvalidInput.at(place, "it lies off the floor", "Move it onto the floor.")
    away_m = np.hypot(*(scenario.scatterers_m - place_m).T)
    if (away_m <= world.scatterer_radius_m).any():
        nearest = int(away_m.argmin())
        raise InvalidInput.at(
            place,
            f"it lies inside scatterer {nearest + 1}, {format_length(float(away_m[nearest]))} off its middle",
            f"Keep it more than {format_length(world.scatterer_radius_m)} away.",
        )
    walls = site_walls(site, scenario.robot)
    nearest_m = float(walls.room.distance(shapely.Point(place_m)))
    if nearest_m > world.stop_m:
        raise InvalidInput.at(
            place,
            f"the robot's middle gets no nearer than {format_length(nearest_m)}, and has docked within "
            f"{format_length(world.stop_m)}",
            "Move the transponder, or raise stop in [docking].",
        )
    farthest_m = float(np.hypot(*(shapely.get_coordinates(walls.room) - place_m).T).max())
    if farthest_m <= _least_start_m(world):
        raise InvalidInput.at(
            place,
            f"no start is {format_length(_least_start_m(world))} away: the robot has room for its middle up to "
            f"{format_length(farthest_m)}",
            "Lower least_start in [docking], or stop where that is larger.",
        )
    return DockingGround(
        walls=walls,
        floor=site.open_floor,
        transponder_m=(float(place_m[0]), float(place_m[1])),
        world=world,
    )


def docking_setting(
    ground: DockingGround, scenario: Scenario, streams: Streams, replication: int
) -> DockingSetting:
    """Return what a trial draws on a ground; see the head of this module for what candidates share.

    Starts are drawn evenly over where the robot's middle can be and keep out of the scatterers of the scenario, if
    the world gives none; random scatterers are drawn evenly over the open floor.

    Raises
    ------
    InvalidInput
        If there is no room for a start or a scatterer, or no drive can start where the world says.
    """
    world = ground.world
    transponder = np.array(ground.transponder_m)
    draws = streams.generator(scenario.name, replication, Purpose.START)
    heading_rad = float(draws.uniform(-np.pi, np.pi))
    start_m = (
        _drawn_start_m(ground, scenario, draws) if world.start_m is None else _given_start_m(ground, scenario)
    )
    places_m = np.zeros((0, 2))
    if world.random_scatterers:
        drawn_m, _ = random_points(
            _floor_triangles(scenario.site),
            streams.generator(scenario.name, replication, Purpose.SCATTERERS),
            world.random_scatterers * _PLACES,
        )
        clear = _apart(drawn_m, np.array([start_m, transponder]), world.clearance_m)
        what = f"scatterer {format_length(world.clearance_m)} from start and transponder"
        places_m = np.array(
            [
                _first(rows_m, fits, what, "Lower clearance in [docking], or random_scatterers.")
                for rows_m, fits in zip(drawn_m.reshape(-1, _PLACES, 2), clear.reshape(-1, _PLACES), strict=True)
            ]
        )
    noise = streams.generator(scenario.name, replication, Purpose.DOCKING).standard_normal(world.steps)
    return DockingSetting(
        start_m=start_m,
        heading_rad=heading_rad,
        scatterers_m=np.concatenate([scenario.scatterers_m, places_m]),
        noise_rad=scenario.faults.direction_noise_rad * noise,
    )


def _drawn_start_m(ground: DockingGround, scenario: Scenario, draws: np.random.Generator) -> FloatArray:
    """Return the first place of a trial's list where a drive can start, shape (2,), m."""
    world = ground.world
    starts_m, _ = free_space(scenario.site, scenario.robot.radius_m).draw(draws, _STARTS)
    far = np.hypot(*(starts_m - np.array(ground.transponder_m)).T) > _least_start_m(world)
    outside = _apart(starts_m, scenario.scatterers_m, world.scatterer_radius_m)
    return _first(
        starts_m,
        far & outside,
        f"start {format_length(_least_start_m(world))} from the transponder",
        "Lower least_start in [docking], or move the transponder.",
    )


def _given_start_m(ground: DockingGround, scenario: Scenario) -> FloatArray:
    """Return the start that the world gives, shape (2,), m, if a drive can start there."""
    world, room = ground.world, cast("SiteWalls", ground.walls).room
    start_m = np.array(world.start_m)
    place = f"start at {format_place(start_m)}"
    if not covers(room, start_m[None])[0]:
        raise InvalidInput.at(place, "the robot has no room there for its middle", "Move it onto the open floor.")
    if not _apart(start_m[None], scenario.scatterers_m, world.scatterer_radius_m)[0]:
        raise InvalidInput.at(place, "it lies inside a scatterer of the scenario", "Move it out of there.")
    away_m = float(np.hypot(*(start_m - np.array(ground.transponder_m))))
    if away_m <= _least_start_m(world):
        raise InvalidInput.at(
            place,
            f"it lies {format_length(away_m)} from the transponder, and drives start farther away than "
            f"{format_length(_least_start_m(world))}",
            "Move it away, or lower least_start in [docking].",
        )
    return start_m


def format_place(place_m: FloatArray) -> str:
    """Return x and y for a message."""
    return f"({format_length(float(place_m[0]))}, {format_length(float(place_m[1]))})"


@lru_cache(maxsize=32)
def _floor_triangles(site: Site) -> FloatArray:
    """Return triangles that together are the open floor."""
    return triangles_of(site.open_floor)


def _least_start_m(world: DockingWorld) -> float:
    """Return beyond which distance from the transponder drives start: none begins docked."""
    return max(world.least_start_m, world.stop_m)


def _apart(places_m: FloatArray, others_m: FloatArray, least_m: float) -> BoolArray:
    """Return which places, shape (n, 2), are farther than that from all others, shape (n,)."""
    off = places_m[:, None] - others_m
    return np.asarray((np.hypot(off[..., 0], off[..., 1]) > least_m).all(axis=1))


def _first(places_m: FloatArray, fits: BoolArray, what: str, repair: str) -> FloatArray:
    """Return the first place that fits."""
    if not fits.any():
        raise InvalidInput.at(
            "docking", f"the site has no room for a {what}: {len(fits)} draws found none", repair
        )
    return np.asarray(places_m[int(fits.argmax())])
