"""Docking: a robot drives towards a transponder by direction of arrival, among things that scatter waves.

Many drives run at once, step by step: take a bearing, choose a heading, go one step or as far as nothing is in
the way. What is compared on one set of drives differs only in the estimator that chooses the bearing; places,
noise and rules are the same. `follow` does so on any ground, `dock` in a rectangular room such as the paper's.
"""

import math
from dataclasses import dataclass, field
from typing import Final

import numpy as np
from shapely.geometry import box

from layoutopt.docking_world import DockingWorld
from layoutopt.errors import InvalidInput
from layoutopt.estimators.bearings import BearingEstimator, BearingKnowledge, BearingReadings
from layoutopt.geometry import Bounds, wrapped
from layoutopt.identity import FloatArray, by_content, read_only
from layoutopt.simulation.docking_ground import DockingGround, RectangleWalls

_DETOUR_RAD: Final = math.radians(100.0)
"""Turn of a robot that goes aside: more than a right angle, so that a round thing met head-on lets it pass."""


@dataclass(frozen=True, slots=True, kw_only=True)
class DockingRoom:
    """A rectangular room, a start, a transponder, and how waves and robots meet what stands there.

    Attributes
    ----------
    bounds_m
        The room: x and y of its lower left and upper right corner, m. Walls stop the robot.
    start_m, transponder_m
        Where the robot starts, and what it drives to, m.
    world
        Waves, scatterers (called obstacles here) and rules; what it says of random scatterers and of starts does
        not count in a room.
    noise_rad
        Standard deviation of a direction beside what scattering does, rad.

    Raises
    ------
    InvalidInput
        If a number is not finite or outside its range, or start or transponder lie outside the room.
    """

    bounds_m: Bounds
    start_m: tuple[float, float]
    transponder_m: tuple[float, float]
    world: DockingWorld
    noise_rad: float = math.radians(2.0)

    def __post_init__(self) -> None:
        _check("noise_rad", self.noise_rad, 0.0 <= self.noise_rad < math.inf, "It is zero or positive")
        blind = self.world.blocks_wave and self.world.scatterer_radius_m == 0.0
        _check("blocks_wave", True, not blind, "Obstacles without a radius block nothing: give one")
        left, low, right, high = self.bounds_m
        rising = -math.inf < left < right < math.inf and -math.inf < low < high < math.inf
        _check("bounds_m", self.bounds_m, rising, "They are x, y, x, y, rising and finite")
        for name in ("start_m", "transponder_m"):
            x, y = getattr(self, name)
            _check(name, (x, y), left < x < right and low < y < high, "It must lie inside the room")

    @property
    def ground(self) -> DockingGround:
        """The room as drives meet it."""
        return DockingGround(
            walls=RectangleWalls(bounds_m=self.bounds_m),
            floor=box(*self.bounds_m),
            transponder_m=self.transponder_m,
            world=self.world,
        )


@by_content
@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class DockingOutcomes:
    """What became of each drive.

    Attributes
    ----------
    docked
        One for drives that came within `DockingWorld.stop_m`, else zero, shape (drives,).
    steps
        Steps that each drive took, shape (drives,).
    mean_error_rad
        Mean size of the angle between the direction that was found and the true one, without detours, shape
        (drives,), rad; zero for drives that began docked.
    paths_m
        Where each drive was before its first step and after every step, shape (drives, steps + 1, 2), m; a drive
        that has docked stays where it is.
    """

    docked: FloatArray
    steps: FloatArray
    mean_error_rad: FloatArray
    paths_m: FloatArray
    key: str = field(init=False, repr=False, default="")

    def __post_init__(self) -> None:
        for name in ("docked", "steps", "mean_error_rad"):
            object.__setattr__(self, name, read_only(getattr(self, name), (-1,)))
        object.__setattr__(self, "paths_m", read_only(self.paths_m))


def dock(room: DockingRoom, obstacles_m: FloatArray, estimator: BearingEstimator, seed: int) -> DockingOutcomes:
    """Drive each robot from the room's start to its transponder and tell what became of it.

    The noise of a drive's steps follows from seed and drive alone, so all estimators meet the same.

    Parameters
    ----------
    room
        The room and its rules.
    obstacles_m
        Middles of the obstacles of each drive, shape (drives, k, 2), m.
    estimator
        What chooses the bearing.
    seed
        Seed of the noise.

    Raises
    ------
    InvalidInput
        If start or transponder lie inside an obstacle, or a place is not finite.
    ValueError
        If the obstacles have another shape.

    References
    ----------
    kim2009, Section V-A and Fig. 12.
    """
    obstacles = _checked(room, obstacles_m)
    drives = len(obstacles)
    return follow(
        room.ground,
        np.tile(np.array(room.start_m), (drives, 1)),
        np.zeros(drives),
        obstacles,
        _noise_rad(room, drives, seed),
        estimator,
    )


def follow(
    ground: DockingGround,
    starts_m: FloatArray,
    headings_rad: FloatArray,
    scatterers_m: FloatArray,
    noise_rad: FloatArray,
    estimator: BearingEstimator,
) -> DockingOutcomes:
    """Drive robots to the transponder of a ground and tell what became of each.

    Directions are known over the full circle. A robot that is stopped takes its next reading where it stands; with
    a detour it then turns aside from the bearing that it would take, left and right by turns, for one step. One
    that hears nothing keeps its heading, or follows what its estimator remembers.

    Parameters
    ----------
    ground
        Walls, transponder and rules.
    starts_m, headings_rad
        Where the robots start, shape (drives, 2), m, and face, shape (drives,), rad.
    scatterers_m
        Middles of the scatterers of each drive, shape (drives, k, 2), m.
    noise_rad
        What is added to the direction of every step, shape (drives, steps), rad.
    estimator
        What chooses the bearing.
    """
    world, transponder = ground.world, np.array(ground.transponder_m)
    places, headings = starts_m.copy(), headings_rad.copy()
    drives = len(places)
    running = estimator.start(BearingKnowledge(floor=ground.floor), drives)
    stopped, stops, moved_m = np.zeros(drives, dtype=np.bool_), np.zeros(drives), np.zeros(drives)
    docked = np.hypot(*(places - transponder).T) <= world.stop_m
    steps, errors = np.zeros(drives), np.zeros(drives)
    paths_m = np.repeat(places[:, None], noise_rad.shape[1] + 1, axis=1)
    for step in range(noise_rad.shape[1]):
        on = np.flatnonzero(~docked)
        if not len(on):
            break
        away = transponder - places[on]
        true_rad, distance_m = np.arctan2(away[:, 1], away[:, 0]), np.hypot(away[:, 0], away[:, 1])
        found = ground.arrivals(scatterers_m[on], places[on])
        chosen = running.step(
            BearingReadings(
                drives=on,
                places_m=places[on],
                headings_rad=headings[on],
                moved_m=moved_m[on],
                stopped=stopped[on],
                heard=found.heard,
                bearings_rad=np.where(found.heard, true_rad + found.error_rad + noise_rad[on, step], 0.0),
                strength_range_m=np.where(found.heard, distance_m / found.amplitude_ratio, 1.0),
                true_range_m=np.where(found.heard, distance_m, 1.0),
            )
        )
        errors[on] += np.abs(wrapped(chosen - true_rad))
        if world.detour:
            aside = np.where(stops[on] % 2 == 1, _DETOUR_RAD, -_DETOUR_RAD)
            chosen = chosen + np.where(stopped[on], aside, 0.0)
        way_m = ground.free_way_m(scatterers_m[on], places[on], chosen)
        stopped[on] = way_m < world.step_m
        stops[on] += stopped[on]
        moved_m[on], headings[on] = way_m, chosen
        places[on] += way_m[:, None] * np.stack([np.cos(chosen), np.sin(chosen)], axis=1)
        paths_m[on, step + 1 :] = places[on, None]
        steps[on] += 1.0
        docked[on] = np.hypot(*(places[on] - transponder).T) <= world.stop_m
    return DockingOutcomes(
        docked=docked, steps=steps, mean_error_rad=errors / np.maximum(steps, 1.0), paths_m=paths_m
    )


def _noise_rad(room: DockingRoom, drives: int, seed: int) -> FloatArray:
    """Return the noise of every reading, shape (drives, steps), rad; a longer drive begins like a shorter one."""
    rows = [
        np.random.Generator(np.random.Philox(np.random.SeedSequence(seed, spawn_key=(1, drive)))).standard_normal(
            room.world.steps
        )
        for drive in range(drives)
    ]
    return room.noise_rad * np.array(rows).reshape(drives, room.world.steps)


def _checked(room: DockingRoom, obstacles_m: FloatArray) -> FloatArray:
    """Return the obstacles if robots can drive among them."""
    obstacles = np.asarray(obstacles_m, dtype=np.float64)
    if obstacles.ndim != 3 or obstacles.shape[2] != 2:
        raise ValueError(f"obstacles_m needs shape (drives, k, 2), got {obstacles.shape}")
    if not np.isfinite(obstacles).all():
        raise InvalidInput.at("obstacles_m", "a place is not finite", "Give x and y of every obstacle in metres.")
    for name in ("start_m", "transponder_m"):
        away_m = np.hypot(*np.moveaxis(obstacles - np.array(getattr(room, name)), -1, 0))
        inside = np.argwhere(away_m <= room.world.scatterer_radius_m)
        if len(inside):
            drive, number = inside[0]
            raise InvalidInput.at(
                name,
                f"it lies inside obstacle {number} of drive {drive}, {away_m[drive, number]:.3g} m off its middle",
                f"Keep it more than {room.world.scatterer_radius_m:g} m away.",
            )
    return obstacles


def _check(name: str, value: object, right: bool, rule: str) -> None:
    if not right:
        raise InvalidInput.at(name, f"it is {value!r}", f"{rule}.")
