"""The experiment of kim2010: floor, robot and tour as far as the paper states them, and what is chosen.

Stated: discs of 100 mm, an antenna 15 mm above the floor, four tags on each tile of 70 cm, sixteen tiles of a
Sudoku floor, a triangular tour from (30, 30) over (250, 250) and (250, 30) cm at 10 cm/s. Not stated: which
Sudoku, how often the reader scans, how true the robot keeps heading and speed.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Final

import numpy as np
from shapely.geometry import box

from layoutopt import registry
from layoutopt.layout import WHOLE_FLOOR, FloorTags, Layout, ReaderProfile, TagPattern, ZonePattern
from layoutopt.protocols import Mount
from layoutopt.readers.mounting import mounted
from layoutopt.robot import Odometry, Robot
from layoutopt.scenario import Judgement, Role, Routes, Scenario
from layoutopt.site import Site

TILE_M: Final = 0.7
RADIUS_M: Final = 0.1
SPEED_M_S: Final = 0.1
WAY_POINTS_M: Final = ((0.3, 0.3), (2.5, 2.5), (2.5, 0.3))
SUDOKU_SEED: Final = 1
TILT_RAD: Final = math.radians(13.0)
_FLOOR_M: Final = 4 * TILE_M
_HALF_TRACK_M: Final = 0.2
_FIRST_TURN_RAD: Final = math.radians(135.0)
_TURN_RATE_RAD_S: Final = math.radians(45.0)
_SPEED_ERROR: Final = 0.01
_START_SIGMA_M: Final = 0.001


@dataclass(frozen=True, slots=True, kw_only=True)
class Choice:
    """What the paper leaves open.

    Attributes
    ----------
    heading_deg
        Heading error of the turn of 135° and of the start (standard deviation).
    scan_s
        Time between scans.
    grid
        Seed of the Sudoku.
    radius_m
        Radius of the read discs, which the paper has as about 100 mm.
    """

    heading_deg: float = 0.5
    scan_s: float = 0.05
    grid: int = SUDOKU_SEED
    radius_m: float = RADIUS_M

    @property
    def leg_heading_deg(self) -> float:
        """How far the heading wanders on a leg along an axis (standard deviation), by the same wheels."""
        leg_m = WAY_POINTS_M[1][0] - WAY_POINTS_M[0][0]
        return self.heading_deg * math.sqrt(leg_m / (_HALF_TRACK_M * _FIRST_TURN_RAD))


@lru_cache(maxsize=8)
def patterns(grid: int = SUDOKU_SEED) -> Mapping[str, TagPattern]:
    """Return the floors that are compared, all with four tags a tile; ``grid`` is the seed of the Sudoku."""

    def made(family: str, **parameters: object) -> TagPattern:
        pattern: TagPattern = registry.load("patterns", family)(**parameters)
        return pattern

    return {
        "Sudoku": made("sudoku", tile_m=TILE_M, seed=grid, radius_m=RADIUS_M, rule="diagonals"),
        "tilted": made("tilted", tile_m=TILE_M, angle_rad=TILT_RAD, radius_m=RADIUS_M),
        "square": made("square", pitch_m=TILE_M / 2.0),
    }


def layout(floor: str, choice: Choice) -> Layout:
    """Return one antenna in the middle of the robot over a floor."""
    pattern = patterns(choice.grid)[floor]
    antenna = registry.load("antennas", "disc")(side_m=0.15, radius_m=choice.radius_m)
    profile = ReaderProfile(name="kim2010", scan_period_s=choice.scan_s, tags_per_scan="several")
    readers = mounted(
        "listed", np.zeros((1, 2)), Mount(antenna=antenna, height_m=0.015, profile=profile), {"count": 1}
    )
    # The lattice of the square floor begins at a tag; half a pitch puts it on tiles as Fig. 5a has it.
    place_m = (TILE_M / 4.0, TILE_M / 4.0) if pattern.name == "square" else (0.0, 0.0)
    zone = ZonePattern(zone=WHOLE_FLOOR, pattern=pattern, origin_m=place_m)
    return Layout(floor_tags=FloorTags(zones=(zone,)), readers=(readers,))


def scenario(choice: Choice) -> Scenario:
    """Return one tour, judged at its end alone: the position error there is the homing error.

    The paper steers by the estimate and measures where the robot comes to stand; here the robot follows the tour
    and the estimate is off at its end. To first order the two are the same.
    """
    half_m = 0.15
    turn_error_rad = math.radians(choice.heading_deg)
    robot = Robot(
        outline_m=np.array([(-half_m, -half_m), (half_m, -half_m), (half_m, half_m), (-half_m, half_m)]),
        odometry=Odometry(
            translation_share=_SPEED_ERROR,
            # The wheels travel this far in the first turn, after which the heading is to be off by so much.
            rotation_rad_per_m=turn_error_rad / math.sqrt(_HALF_TRACK_M * _FIRST_TURN_RAD),
            lateral_share=0.001,
            half_track_m=_HALF_TRACK_M,
        ),
        speed_m_s=SPEED_M_S,
        turn_rate_rad_s=_TURN_RATE_RAD_S,
    )
    points = np.array(WAY_POINTS_M)
    way_m = float(np.hypot(*np.diff(points, axis=0, append=points[:1]).T).sum())
    turns_rad = math.radians(135.0 + 90.0)
    duration_s = way_m / SPEED_M_S + turns_rad / _TURN_RATE_RAD_S
    steps = math.floor(duration_s / choice.scan_s)
    return Scenario(
        name=f"kim2010, {choice.heading_deg:g} deg, {choice.scan_s:g} s",
        role=Role.HELD_OUT,
        site=Site(name="floor", floor=box(0.0, 0.0, _FLOOR_M, _FLOOR_M)),
        robot=robot,
        routes=Routes(kind="way_points", way_points_m=points, start="first"),
        judgement=Judgement(settle_s=(steps - 1.5) * choice.scan_s),
        step_s=choice.scan_s,
        step_count=steps,
        start_sigma_m=_START_SIGMA_M,
        start_sigma_rad=turn_error_rad,
    )
