"""The docking of kim2009: layout, scenarios and estimators as far as the paper states them, and what is chosen.

Stated: 303.2 MHz, a room of 5 m by 5 m, 5 m to dock, an end within 0.5 m, R = 0.5, 4 degrees of noise. Not stated:
where start and transponder are, what obstacles do to a robot, the limit of steps, how noise is meant.
`layoutopt.simulation.kim2009_rooms` holds the room; here it becomes cells of trials.
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Final

import numpy as np
from shapely.geometry import box

from layoutopt.antennas.crossed_loops import CrossedLoops
from layoutopt.estimators.bearing_bumper import BearingAroundStops
from layoutopt.estimators.bearing_filter import FilteredBearing
from layoutopt.estimators.bearings import BearingEstimator
from layoutopt.estimators.direction_as_measured import DirectionAsMeasured
from layoutopt.estimators.direction_corrected import DirectionCorrected
from layoutopt.layout import FloorTags, Layout, Transponder
from layoutopt.readers.finders import docking_antennas
from layoutopt.robot import Robot
from layoutopt.scenario import Faults, Role, Scenario
from layoutopt.simulation.kim2009_rooms import ROOM_M, docking_room
from layoutopt.site import Site

MEASURED: Final = "as measured"
CORRECTED: Final = "corrected"
TRUE_RANGES: Final = "corrected, true ranges"
FILTERED: Final = "bearing filter"
BUMPER: Final = "filter and bumper"
CHAIR_ROOM_M: Final = (-3.0, -2.0, 3.0, 5.0)
"""The room of the experiment, 6 m by 7 m, about its start at (0, 0); the paper drove near its middle."""
CHAIR_TARGET_M: Final = (0.0, 3.0)
"""Section V-B."""
_NAME: Final = "kim2009, docking"
"""One name for all scenarios, so that the same drives meet the same noise and the same first obstacles."""
_ROBOT_M: Final = 0.01
"""Half the side of the robot, a point to the walls; the radius of the world keeps it from obstacles."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Choice:
    """What one cell is of.

    Attributes
    ----------
    obstacles
        Their number.
    blocking
        Whether they stop the robot, or only scatter.
    detour
        Whether a robot that was stopped goes aside for one step.
    experiment
        Whether the room is that of Table III.
    noise_deg, reflection, wall_reflection, radius_m, steps, blocks_wave
        Choices that the paper leaves open, by default those of `docking_room`; a radius is for blocking obstacles.
    """

    obstacles: int
    blocking: bool = True
    detour: bool = False
    experiment: bool = False
    noise_deg: float = 2.0
    reflection: float = 0.5
    wall_reflection: float = 0.0
    radius_m: float = 0.1
    steps: int = 40
    blocks_wave: bool = False

    def with_obstacles(self, count: int) -> "Choice":
        """Return the same choices for another number of obstacles."""
        return replace(self, obstacles=count)


GROUPS: Final[Mapping[str, Choice]] = {
    "scattering only": Choice(obstacles=0, blocking=False),
    "blocking": Choice(obstacles=0),
    "blocking, detour": Choice(obstacles=0, detour=True),
}
"""Rules under which Table II is run, by their names on the page."""
CHANGED: Final[Mapping[str, Choice]] = {
    "noise of 4°": Choice(obstacles=0, noise_deg=4.0),
    "walls reflect half": Choice(obstacles=0, wall_reflection=0.5),
    "R = 0.8": Choice(obstacles=0, reflection=0.8),
    "obstacles of 0.2 m": Choice(obstacles=0, radius_m=0.2),
    "direct wave blocked": Choice(obstacles=0, blocks_wave=True),
    "15 steps at most": Choice(obstacles=0, steps=15),
    "R = 0.8, scattering only": Choice(obstacles=0, reflection=0.8, blocking=False),
}
"""Open choices, one at a time but for the last, by their names on the page."""
CHANGED_OBSTACLES: Final = (1, 5, 9)


@lru_cache(maxsize=1)
def estimators() -> Mapping[str, BearingEstimator]:
    """Return what chooses headings, by the names of the page."""
    return {
        MEASURED: DirectionAsMeasured(),
        CORRECTED: DirectionCorrected(),
        TRUE_RANGES: DirectionCorrected(range_source="true"),
        FILTERED: FilteredBearing(),
        BUMPER: BearingAroundStops(),
    }


def driven(group: str) -> tuple[str, ...]:
    """Return the names of what is driven under the rules of a group; who remembers stops makes no detour."""
    return tuple(name for name in estimators() if not (name == BUMPER and GROUPS[group].detour))


@lru_cache(maxsize=2)
def layout(*, experiment: bool) -> Layout:
    """Return crossed antennas on a robot and the transponder that it docks at; no tags on the floor."""
    antennas = docking_antennas(antenna=CrossedLoops())
    place_m = CHAIR_TARGET_M if experiment else docking_room(blocking=True).transponder_m
    height_m = float(antennas.poses[0, 2])
    return Layout(
        floor_tags=FloorTags(zones=()),
        readers=(antennas,),
        transponders=(Transponder(name="dock", position_m=(*place_m, height_m)),),
    )


@lru_cache(maxsize=256)
def scenario(choice: Choice) -> Scenario:
    """Return drives to the transponder among obstacles at random places, other ones in every drive."""
    room = docking_room(blocking=choice.blocking, detour=choice.detour)
    half = _ROBOT_M
    return Scenario(
        name=_NAME,
        role=Role.HELD_OUT,
        site=Site(name="room", floor=box(*(CHAIR_ROOM_M if choice.experiment else ROOM_M))),
        robot=Robot(outline_m=np.array([(-half, -half), (half, -half), (half, half), (-half, half)])),
        faults=Faults(direction_noise_rad=math.radians(choice.noise_deg)),
        docking=replace(
            room.world,
            reflection=choice.reflection,
            wall_reflection=choice.wall_reflection,
            scatterer_radius_m=choice.radius_m if choice.blocking else 0.0,
            blocks_wave=choice.blocks_wave,
            random_scatterers=choice.obstacles,
            start_m=(0.0, 0.0) if choice.experiment else room.start_m,
            steps=choice.steps,
        ),
    )
