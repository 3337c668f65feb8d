"""Docking: a robot drives towards a transponder by direction of arrival, in a room whose things scatter waves.

Many drives run at once, step by step: take a bearing, choose a heading, go one step or as far as nothing is in the
way. What is compared on one set of drives differs only in how the heading is chosen; rooms, noise and rules are
the same.
"""

import math
from dataclasses import dataclass, field
from enum import Enum, unique
from typing import Final

import numpy as np

from layoutopt.errors import InvalidInput
from layoutopt.estimators.bearing_filter import BearingBelief, BearingFilter
from layoutopt.estimators.direction_of_arrival import correct_direction, direction_error
from layoutopt.geometry import Bounds, wrapped
from layoutopt.identity import FloatArray, IntArray, by_content, read_only

_CLEAR_M: Final = 1e-6
"""What a stopped robot keeps from what stopped it, so that rounding does not put it inside."""
_DRAWS: Final = 1000
"""Draws of a place for one obstacle after which a room counts as full."""
_CANDIDATE_PITCH_M: Final = 0.2
"""Pitch of the filter's candidates: small against the distance at which docking ends."""
_DETOUR_RAD: Final = math.radians(100.0)
"""Turn of a robot that goes aside: more than a right angle, so that a round thing met head-on lets it pass."""


@unique
class Guide(Enum):
    """How a robot chooses its heading."""

    AS_MEASURED = "follow every direction as it is measured"
    CORRECTED = "correct it from three positions, as published (kim2009, Algorithm 1)"
    FILTERED = "follow the bearing filter over all positions"


@unique
class RangeSource(Enum):
    """Where the ranges of the published correction come from."""

    STRENGTH = "signal strength, which scattered waves change with the direction"
    TRUE = "the true distance, as good as odometry or sonar may get"


@dataclass(frozen=True, slots=True, kw_only=True)
class DockingRoom:
    """A room, a start, a transponder, and how waves and robots meet what stands there.

    Attributes
    ----------
    bounds_m
        The room: x and y of its lower left and upper right corner, m. Walls stop the robot.
    start_m, transponder_m
        Where the robot starts, and what it drives to, m.
    wavelength_m
        Wavelength, m.
    reflection, wall_reflection
        Shares of the amplitude that obstacles scatter and walls reflect, 0 to 1. Walls reflect once each, as
        mirror images.
    obstacle_radius_m
        Radius about an obstacle's middle that the robot cannot enter, m; zero for obstacles that only scatter.
    blocks_wave
        Whether an obstacle of that radius across the straight line takes the direct wave away.
    step_m, stop_m
        Way between two readings, and distance to the transponder at which the robot has docked, m.
    steps
        Steps after which a robot that has not docked has failed.
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
    wavelength_m: float
    reflection: float
    wall_reflection: float = 0.0
    obstacle_radius_m: float = 0.0
    blocks_wave: bool = False
    step_m: float = 0.5
    stop_m: float = 0.5
    steps: int = 50
    noise_rad: float = math.radians(2.0)

    def __post_init__(self) -> None:
        for name in ("wavelength_m", "step_m", "stop_m"):
            _check(
                name, getattr(self, name), 0.0 < getattr(self, name) < math.inf, "It must be positive and finite"
            )
        for name in ("reflection", "wall_reflection"):
            _check(name, getattr(self, name), 0.0 <= getattr(self, name) <= 1.0, "It is a share between 0 and 1")
        for name in ("obstacle_radius_m", "noise_rad"):
            _check(name, getattr(self, name), 0.0 <= getattr(self, name) < math.inf, "It is zero or positive")
        blind = self.blocks_wave and self.obstacle_radius_m == 0.0
        _check("blocks_wave", self.blocks_wave, not blind, "Obstacles without a radius block nothing: give one")
        _check("steps", self.steps, self.steps >= 1, "A drive has at least one step")
        left, low, right, high = self.bounds_m
        _check(
            "bounds_m",
            self.bounds_m,
            -math.inf < left < right < math.inf,
            "They are x, y, x, y, rising and finite",
        )
        _check(
            "bounds_m", self.bounds_m, -math.inf < low < high < math.inf, "They are x, y, x, y, rising and finite"
        )
        for name in ("start_m", "transponder_m"):
            x, y = getattr(self, name)
            _check(name, (x, y), left < x < right and low < y < high, "It must lie inside the room")

    def images_m(self) -> FloatArray:
        """Return the transponder's mirror images in the four walls, shape (4, 2), m."""
        x, y = self.transponder_m
        left, low, right, high = self.bounds_m
        return np.array([[2 * left - x, y], [2 * right - x, y], [x, 2 * low - y], [x, 2 * high - y]])


@by_content
@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class DockingOutcomes:
    """What became of each drive.

    Attributes
    ----------
    docked
        One for drives that came within `DockingRoom.stop_m`, else zero, shape (drives,).
    steps
        Steps that each drive took, shape (drives,).
    mean_error_rad
        Mean size of the angle between the direction that was found and the true one, without detours, shape
        (drives,), rad; zero for drives that began docked.
    """

    docked: FloatArray
    steps: FloatArray
    mean_error_rad: FloatArray
    key: str = field(init=False, repr=False, default="")

    def __post_init__(self) -> None:
        for name in ("docked", "steps", "mean_error_rad"):
            object.__setattr__(self, name, read_only(getattr(self, name), (-1,)))


def random_obstacles(room: DockingRoom, count: int, drives: int, clearance_m: float, seed: int) -> FloatArray:
    """Return obstacles at random places of the room, shape (drives, count, 2), m, clear of start and transponder.

    The first obstacles of a drive are the same whatever ``count`` is, so rooms with few and many are paired.

    Raises
    ------
    InvalidInput
        If the room has no place that far from start and transponder, or the clearance is not beyond the obstacles.
    """
    least_m = room.obstacle_radius_m
    _check(
        "clearance_m", clearance_m, least_m < clearance_m < math.inf, f"It must exceed the radius, {least_m:g} m"
    )
    keep_off = np.array([room.start_m, room.transponder_m])
    low, high = np.array(room.bounds_m[:2]), np.array(room.bounds_m[2:])
    obstacles = np.empty((drives, count, 2))
    for drive in range(drives):
        draws = np.random.Generator(np.random.Philox(np.random.SeedSequence(seed, spawn_key=(0, drive))))
        for number in range(count):
            for _ in range(_DRAWS):
                place = low + (high - low) * draws.random(2)
                if (np.hypot(*(keep_off - place).T) >= clearance_m).all():
                    break
            else:
                raise InvalidInput.at(
                    "clearance_m",
                    f"no place of the room is {clearance_m:g} m from start and transponder",
                    "Lower it.",
                )
            obstacles[drive, number] = place
    return obstacles


def dock(
    room: DockingRoom,
    obstacles_m: FloatArray,
    guide: Guide,
    seed: int,
    *,
    detour: bool = False,
    range_source: RangeSource = RangeSource.STRENGTH,
    belief: BearingBelief | None = None,
) -> DockingOutcomes:
    """Drive each robot to the transponder and tell what became of it.

    Directions are known over the full circle. A robot that is stopped takes its next reading where it stands; with
    a detour it then turns aside from the direction that it would take, left and right by turns, for one step. The
    noise of a drive's steps follows from seed and drive alone, so all guides meet the same.

    Parameters
    ----------
    room
        The room and its rules.
    obstacles_m
        Middles of the obstacles of each drive, shape (drives, k, 2), m.
    guide
        How headings are chosen.
    seed
        Seed of the noise.
    detour
        Whether robots that something stopped go aside, which the paper's do not.
    range_source
        Ranges that `Guide.CORRECTED` gets.
    belief
        Settings of `Guide.FILTERED`, which also knows the room's bounds; ``None`` for the defaults.

    Raises
    ------
    InvalidInput
        If start or transponder lie inside an obstacle, or a place is not finite.
    ValueError
        If the obstacles have another shape, or a robot is where no wave arrives.

    References
    ----------
    kim2009, Section V-A and Fig. 12.
    """
    obstacles = _checked(room, obstacles_m)
    drives = len(obstacles)
    noise = _noise_rad(room, drives, seed)
    transponder = np.array(room.transponder_m)
    places = np.tile(np.array(room.start_m), (drives, 1))
    headings = np.zeros(drives)
    past = _Past(drives)
    stopped, stops = np.zeros(drives, dtype=np.bool_), np.zeros(drives)
    bearing_filter = BearingFilter(_candidates_m(room), drives, belief) if guide is Guide.FILTERED else None
    docked = np.hypot(*(places - transponder).T) <= room.stop_m
    steps, errors = np.zeros(drives), np.zeros(drives)
    for step in range(room.steps):
        on = np.flatnonzero(~docked)
        if not len(on):
            break
        away = transponder - places[on]
        true_rad, distance_m = np.arctan2(away[:, 1], away[:, 0]), np.hypot(away[:, 0], away[:, 1])
        found = direction_error(
            places[on],
            transponder,
            obstacles[on],
            room.reflection,
            room.wavelength_m,
            images_m=room.images_m(),
            image_reflection=room.wall_reflection,
            direct=direct_share(room, obstacles[on], places[on]),
        )
        bearings = true_rad + found.error_rad + noise[on, step]
        chosen = bearings
        if bearing_filter is not None:
            chosen = bearing_filter.step(on, places[on], bearings)
        elif guide is Guide.CORRECTED:
            by_strength = range_source is RangeSource.STRENGTH
            ranges_m = distance_m / found.amplitude_ratio if by_strength else distance_m
            chosen = bearings + past.correction(on, step, bearings - headings[on], ranges_m)
        errors[on] += np.abs(wrapped(chosen - true_rad))
        if detour:
            aside = np.where(stops[on] % 2 == 1, _DETOUR_RAD, -_DETOUR_RAD)
            chosen = chosen + np.where(stopped[on], aside, 0.0)
        way_m = free_way_m(room, obstacles[on], places[on], chosen)
        stopped[on] = way_m < room.step_m
        stops[on] += stopped[on]
        past.moved(on, way_m, chosen - headings[on])
        headings[on] = chosen
        places[on] += way_m[:, None] * np.stack([np.cos(chosen), np.sin(chosen)], axis=1)
        steps[on] += 1.0
        docked[on] = np.hypot(*(places[on] - transponder).T) <= room.stop_m
    return DockingOutcomes(docked=docked, steps=steps, mean_error_rad=errors / np.maximum(steps, 1.0))


class _Past:
    """The last readings and moves of every drive, as the published correction wants them, oldest first."""

    def __init__(self, drives: int) -> None:
        self._directions_rad, self._ranges_m = np.zeros((drives, 3)), np.ones((drives, 3))
        self._moves_m, self._turns_rad = np.zeros((drives, 2)), np.zeros((drives, 2))

    def correction(self, on: IntArray, step: int, direction_rad: FloatArray, range_m: FloatArray) -> FloatArray:
        """Note a reading and return the correction of its direction; zero until there are three."""
        for rows, latest in ((self._directions_rad, direction_rad), (self._ranges_m, range_m)):
            rows[on] = np.column_stack([rows[on, 1:], latest])
        if step < 2:
            return np.zeros(len(on))
        return correct_direction(
            self._directions_rad[on], self._ranges_m[on], self._moves_m[on], self._turns_rad[on]
        ).error_rad

    def moved(self, on: IntArray, way_m: FloatArray, turn_rad: FloatArray) -> None:
        """Note a turn and the move after it."""
        for rows, latest in ((self._moves_m, way_m), (self._turns_rad, turn_rad)):
            rows[on] = np.column_stack([rows[on, 1:], latest])


def free_way_m(room: DockingRoom, obstacles: FloatArray, places: FloatArray, headings: FloatArray) -> FloatArray:
    """Return how far each robot gets on its heading in one step, shape (n,), m.

    Parameters
    ----------
    room
        Its walls stop robots, and obstacles that have a radius.
    obstacles
        Middles of each robot's obstacles, shape (n, k, 2), m.
    places, headings
        Where the robots stand, shape (n, 2), m, and face, shape (n,), rad.
    """
    unit = np.stack([np.cos(headings), np.sin(headings)], axis=1)
    free_m = np.full(len(places), room.step_m)
    low, high = np.array(room.bounds_m[:2]), np.array(room.bounds_m[2:])
    wall = np.where(unit > 0.0, high, low)
    to_wall = np.divide(wall - places, unit, out=np.full_like(unit, np.inf), where=np.abs(unit) > _CLEAR_M)
    free_m = np.minimum(free_m, to_wall.min(axis=1) - _CLEAR_M)
    if room.obstacle_radius_m > 0.0 and obstacles.shape[1]:
        to_middle = obstacles - places[:, None, :]
        ahead_m = (to_middle * unit[:, None, :]).sum(axis=2)
        aside_m2 = (to_middle**2).sum(axis=2) - ahead_m**2
        within_m2 = room.obstacle_radius_m**2 - aside_m2
        meets = (ahead_m > 0.0) & (within_m2 > 0.0)
        contact_m = np.where(meets, ahead_m - np.sqrt(np.maximum(within_m2, 0.0)) - _CLEAR_M, np.inf)
        free_m = np.minimum(free_m, contact_m.min(axis=1))
    # A robot that touches something stands; what rounding leaves of its way is no move.
    return np.asarray(np.where(free_m < _CLEAR_M, 0.0, free_m))


def direct_share(room: DockingRoom, obstacles: FloatArray, places: FloatArray) -> FloatArray:
    """Return the share of the direct wave that arrives, shape (n,): none through what blocks it, else all.

    Obstacles and places are those of `free_way_m`.
    """
    if not room.blocks_wave or not obstacles.shape[1]:
        return np.ones(len(places))
    line = np.array(room.transponder_m) - places
    to_middle = obstacles - places[:, None, :]
    share = np.clip((to_middle * line[:, None, :]).sum(axis=2) / (line**2).sum(axis=1)[:, None], 0.0, 1.0)
    aside = to_middle - share[:, :, None] * line[:, None, :]
    return np.where((np.hypot(aside[..., 0], aside[..., 1]) < room.obstacle_radius_m).any(axis=1), 0.0, 1.0)


def _candidates_m(room: DockingRoom) -> FloatArray:
    """Return the places where the filter thinks that the transponder may be: the room, evenly."""
    axes = [
        np.linspace(low, high, max(2, math.ceil((high - low) / _CANDIDATE_PITCH_M) + 1))
        for low, high in zip(room.bounds_m[:2], room.bounds_m[2:], strict=True)
    ]
    return np.stack(np.meshgrid(*axes), axis=-1).reshape(-1, 2)


def _noise_rad(room: DockingRoom, drives: int, seed: int) -> FloatArray:
    """Return the noise of every reading, shape (drives, steps), rad; a longer drive begins like a shorter one."""
    rows = [
        np.random.Generator(np.random.Philox(np.random.SeedSequence(seed, spawn_key=(1, drive)))).standard_normal(
            room.steps
        )
        for drive in range(drives)
    ]
    return room.noise_rad * np.array(rows).reshape(drives, room.steps)


def _checked(room: DockingRoom, obstacles_m: FloatArray) -> FloatArray:
    """Return the obstacles if robots can drive among them."""
    obstacles = np.asarray(obstacles_m, dtype=np.float64)
    if obstacles.ndim != 3 or obstacles.shape[2] != 2:
        raise ValueError(f"obstacles_m needs shape (drives, k, 2), got {obstacles.shape}")
    if not np.isfinite(obstacles).all():
        raise InvalidInput.at("obstacles_m", "a place is not finite", "Give x and y of every obstacle in metres.")
    for name in ("start_m", "transponder_m"):
        away_m = np.hypot(*np.moveaxis(obstacles - np.array(getattr(room, name)), -1, 0))
        inside = np.argwhere(away_m <= room.obstacle_radius_m)
        if len(inside):
            drive, number = inside[0]
            raise InvalidInput.at(
                name,
                f"it lies inside obstacle {number} of drive {drive}, {away_m[drive, number]:.3g} m off its middle",
                f"Keep it more than {room.obstacle_radius_m:g} m away.",
            )
    return obstacles


def _check(name: str, value: object, right: bool, rule: str) -> None:
    if not right:
        raise InvalidInput.at(name, f"it is {value!r}", f"{rule}.")
