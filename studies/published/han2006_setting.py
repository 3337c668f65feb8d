"""The experiments of han2006: floors, reader and paths as far as the paper states them, and what is chosen.

Stated: a square antenna of 0.1 m, tags of 30 mm every 0.1 m in a row, 0.25 m/s, a sample every 40 ms, tags read
one after another, a circle for the compensation. Not stated: how far from its middle the antenna reads, the shape
of Path-1 and Path-2, how tags are read within a sample, the gain of the compensation, the quality of the wheels.
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

PITCH_M: Final = 0.1
STEP_S: Final = 0.04
SPEED_M_S: Final = 0.25
SIDE_M: Final = PITCH_M * math.sqrt(2.0 / math.sqrt(3.0))
"""Side of the equilateral lattice that has as many tags as the square of the pitch."""
CIRCLE_M: Final = 1.0
LINE_M: Final = ((0.8, 0.9), (4.9, 2.6))
_FLOOR_M: Final = (6.0, 4.0)
_SPREAD_M: Final = 0.2
_SETTLE_S: Final = 3.0
_LINE_S: Final = 17.5
_CIRCLE_S: Final = 25.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Choice:
    """What the paper leaves open: read radius, and error of the wheels' scale after 1 m."""

    radius_m: float = 0.125
    wheels: float = 0.02


@lru_cache(maxsize=1)
def patterns() -> Mapping[str, TagPattern]:
    """Return the square floor and the two triangular floors that the paper may mean, all of one density."""

    def made(family: str, **parameters: object) -> TagPattern:
        pattern: TagPattern = registry.load("patterns", family)(**parameters)
        return pattern

    return {
        "square": made("square", pitch_m=PITCH_M),
        "isosceles": made("triangular", pitch_m=PITCH_M, row_gap_m=PITCH_M),
        "equilateral": made("equilateral", side_m=SIDE_M),
    }


def layout(pattern: TagPattern, choice: Choice) -> Layout:
    """Return one antenna in the middle of the robot over a pattern."""
    antenna = registry.load("antennas", "disc")(side_m=0.1, radius_m=choice.radius_m)
    profile = ReaderProfile(name="han2006", scan_period_s=STEP_S, tags_per_scan="several")
    readers = mounted(
        "listed", np.zeros((1, 2)), Mount(antenna=antenna, height_m=0.02, profile=profile), {"count": 1}
    )
    return Layout(
        floor_tags=FloorTags(zones=(ZonePattern(zone=WHOLE_FLOOR, pattern=pattern),)), readers=(readers,)
    )


def scenario(path: str, choice: Choice) -> Scenario:
    """Return drives on ``"line"`` or ``"circle"``, each in another place against the tags."""
    half_m = 0.15
    robot = Robot(
        outline_m=np.array([(-half_m, -half_m), (half_m, -half_m), (half_m, half_m), (-half_m, half_m)]),
        odometry=Odometry(
            translation_share=choice.wheels, rotation_rad_per_m=choice.wheels, lateral_share=choice.wheels / 4.0
        ),
        speed_m_s=SPEED_M_S,
    )
    line = path == "line"
    routes = (
        Routes(kind="way_points", way_points_m=np.array(LINE_M), centre_spread_m=_SPREAD_M)
        if line
        else Routes(kind="circle", circle_radius_m=CIRCLE_M, centre_spread_m=_SPREAD_M)
    )
    return Scenario(
        name=f"han2006, {path}, {choice.wheels:g}",
        role=Role.HELD_OUT,
        site=Site(name="floor", floor=box(0.0, 0.0, *_FLOOR_M)),
        robot=robot,
        routes=routes,
        judgement=Judgement(settle_s=_SETTLE_S),
        step_s=STEP_S,
        step_count=round((_LINE_S if line else _CIRCLE_S) / STEP_S),
        start_sigma_m=0.005,
        start_sigma_rad=math.radians(0.5),
    )
