"""Patterns at equal density, and the robots and floors on which they are compared."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import lru_cache
from typing import Final

import numpy as np
from shapely.geometry import box

from layoutopt import registry
from layoutopt.layout import WHOLE_FLOOR, FloorTags, Layout, ReaderGroup, TagPattern, ZonePattern
from layoutopt.protocols import Mount
from layoutopt.readers.mounting import mounted
from layoutopt.readers.profiles import MI2016
from layoutopt.robot import Robot
from layoutopt.scenario import Judgement, Role, Routes, Scenario
from layoutopt.site import Site

TILT_RAD: Final = math.radians(13.0)
"""Tilt of the tiles of the tilted pattern: in the middle of the range that leaves the fewest blind runs."""
SEED: Final = 1
"""Of the Sudoku grids and of the random places."""
_FLOOR_M: Final = (6.3, 6.3)
_STEP_S: Final = 0.05
_DURATION_S: Final = 60.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Setting:
    """One robot over floors of one density.

    Attributes
    ----------
    name, words
        Label, and what it stands for in a sentence.
    pitch_m
        Pitch of the square lattice of the density: every pattern has one tag per square of this side.
    radius_m
        Radius of the read disc of one antenna.
    readers
        The antennas under the robot.
    inside_tiles
        Whether discs are to lie inside their tiles without overlap, as kim2010 wants it.
    """

    name: str
    words: str
    pitch_m: float
    radius_m: float
    readers: ReaderGroup
    inside_tiles: bool

    def layout(self, pattern: TagPattern, angle_rad: float = 0.0) -> Layout:
        """Return the readers over a pattern on the whole floor, laid at an angle."""
        zone = ZonePattern(zone=WHOLE_FLOOR, pattern=pattern, angle_rad=angle_rad)
        return Layout(floor_tags=FloorTags(zones=(zone,)), readers=(self.readers,))


@lru_cache(maxsize=1)
def settings() -> tuple[Setting, ...]:
    """Return the three robots: of kim2010, of han2006, and with the eight readers of mi2016."""
    sphere = registry.load("antennas", "sphere")(side_m=0.06)
    eight = Mount(antenna=sphere, height_m=0.024, profile=MI2016)
    return (
        Setting(
            name="sparse",
            words="one antenna with a disc of 100 mm, 4 tags per tile of 0.7 m (kim2010): discs never overlap",
            pitch_m=0.35,
            radius_m=0.1,
            readers=one_antenna(side_m=0.15, radius_m=0.1),
            inside_tiles=True,
        ),
        Setting(
            name="dense",
            words="one antenna with a disc of 125 mm, 100 tags/m² (han2006): tags nearly always in view",
            pitch_m=0.1,
            radius_m=0.125,
            readers=one_antenna(side_m=0.1, radius_m=0.125),
            inside_tiles=False,
        ),
        Setting(
            name="eight readers",
            words="the eight readers of mi2016 with discs of 30 mm, 16 tags/m²",
            pitch_m=0.25,
            radius_m=0.03,
            readers=registry.load("readers", "mi2016_8")(mount=eight),
            inside_tiles=True,
        ),
    )


def patterns(setting: Setting) -> Mapping[str, TagPattern]:
    """Return every pattern at the density of a setting, by label."""
    pitch_m = setting.pitch_m
    tile_m = 2.0 * pitch_m
    side_m = pitch_m * math.sqrt(2.0 / math.sqrt(3.0))
    radius_m = setting.radius_m if setting.inside_tiles else None

    def made(family: str, **parameters: object) -> TagPattern:
        pattern: TagPattern = registry.load("patterns", family)(**parameters)
        return pattern

    return {
        "square": made("square", pitch_m=pitch_m),
        "isosceles": made("triangular", pitch_m=pitch_m, row_gap_m=pitch_m),
        "equilateral": made("equilateral", side_m=side_m),
        "zigzag": made("parallelogram", tile_m=tile_m, shift_m=pitch_m / 8.0),
        "sheared": made("parallelogram", tile_m=tile_m, shift_m=pitch_m / 8.0, form="sheared"),
        "tilted": made("tilted", tile_m=tile_m, angle_rad=TILT_RAD, radius_m=radius_m),
        "Sudoku": made("sudoku", tile_m=tile_m, seed=SEED, radius_m=radius_m),
        "diagonal Sudoku": made("sudoku", tile_m=tile_m, seed=SEED, radius_m=radius_m, rule="diagonals"),
        "Sudoku in bond": made("sudoku", tile_m=tile_m, seed=SEED, radius_m=radius_m, bond="running"),
        "random": made(
            "random", tile_m=tile_m, radius_m=setting.radius_m if setting.inside_tiles else 0.015, seed=SEED
        ),
    }


def world() -> Scenario:
    """Return the drives that every cell meets: patrols of a small robot through an empty hall."""
    half_m = 0.15
    outline_m = np.array([(-half_m, -half_m), (half_m, -half_m), (half_m, half_m), (-half_m, half_m)])
    return Scenario(
        name="pattern_comparison",
        role=Role.HELD_OUT,
        site=Site(name="hall", floor=box(0.0, 0.0, *_FLOOR_M)),
        robot=Robot(outline_m=outline_m, speed_m_s=0.25),
        routes=Routes(kind="point_to_point"),
        judgement=Judgement(),
        step_s=_STEP_S,
        step_count=round(_DURATION_S / _STEP_S),
        start_sigma_m=0.02,
        start_sigma_rad=math.radians(2.0),
    )


def one_antenna(*, side_m: float, radius_m: float) -> ReaderGroup:
    """Return one antenna in the middle of the robot of which only the disc is known."""
    antenna = registry.load("antennas", "disc")(side_m=side_m, radius_m=radius_m)
    mount = Mount(antenna=antenna, height_m=0.015, profile=MI2016)
    return mounted("listed", np.zeros((1, 2)), mount, {"count": 1})
