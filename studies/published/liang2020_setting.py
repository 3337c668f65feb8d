"""The experiment of liang2020: robot, antennas, walk and scanner as far as it states them, and what is chosen.

Stated: two antennas 0.8 m high at 45 degrees to either side, a sample every 0.4 s, a scanner of half a degree over
270 degrees and 20 m, a range of up to 7 m, a robot that stands, five rounds on a rectangle of 4 m by 2 m at
0.4 m/s, N = 100, K = 9, σ = 1.0, ρ = 0.05. Not stated: where the rectangle lies, the room and what stands in it,
noise of strengths, phases and ranges, sizes of people, cells of the sensor model, what the filter does without a
reading.
"""

import math
from dataclasses import dataclass
from functools import lru_cache
from typing import Final

import numpy as np
from shapely.geometry import box

from layoutopt import registry
from layoutopt.estimators.uhf_laser import UhfLaser
from layoutopt.layout import FloorTags, Layout
from layoutopt.readers.finders import yawed_antennas
from layoutopt.robot import Robot
from layoutopt.scenario import Judgement, Role, Scenario
from layoutopt.site import Site
from layoutopt.tracking_world import LaserScanner, SignalWorld, TrackingWorld
from studies.cells import Cell
from studies.published.liang2020_printed import APPROACHES, SQUIGGLE

INTERVAL_S: Final = 0.4
SPEED_M_S: Final = 0.4
YAW_RAD: Final = math.radians(45.0)
ROUNDS: Final = 5
SLOW_M_S: Final = 0.1
"""Below this speed one round is simulated: five at 0.02 m/s take 50 minutes."""
WALK_M: Final = ((1.0, -2.0), (3.0, -2.0), (3.0, 2.0), (1.0, 2.0))
"""The rectangle of 4 m by 2 m, its long side across; the place is chosen."""
WAY_M: Final = 12.0
"""Length of one round."""
ROOM_M: Final = (-2.0, -3.5, 5.0, 3.5)
"""Walls of the room, chosen."""
_SETTLE_S: Final = 3.0
_HALF_M: Final = 0.3
"""Half the side of the robot, about that of a SCITOS G5."""
MODES: Final = dict(zip(APPROACHES, ("strength", "velocity", "fused"), strict=True))
"""Modes of the tracker by the paper's approaches."""
TAG_OFFSETS_DB: Final = {"MiniWeb": -3.25, "Frog 3D": -3.0, "AD-680r6-P": -4.5, SQUIGGLE: 0.0, "DogBone": -2.75}
"""How much stronger than the tag of the sensor model each tag answers; fitted in steps of 0.25 dB to the ratios
of Table 1 between the tags' errors by signal strength alone and that of Squiggle."""
ANTENNAS: Final = ("left", "right", "both")
PHASES: Final = ("two hypotheses", "signed", "three aliases", "literal")
"""How radial speeds are taken from phases, as the tracker names it."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Choice:
    """What is varied, at the values of the paper and those chosen for it.

    Attributes
    ----------
    approach
        One of `APPROACHES`.
    particles, matches
        N and K.
    sigma_m, sigma_per
        σ of Eq. 12 for each ``"step"`` or for each ``"second"``.
    rho_m2
        ρ of Eq. 14.
    phase, motion
        How phases become speeds (`PHASES`), and how particles move.
    antennas, beam_deg
        Which antennas are on, and the width of their beam at half power.
    speed_m_s
        Walking speed.
    tag_offset_db
        How much stronger the tag answers than that of the sensor model.
    range_sigma_m, clutter, clutter_hides
        Noise of the scanner, number of round things that stand about, and whether they may hide the person.
    bounded, unread
        Whether particles stay in the room, and whether they move and are weighed at an instant without a reading.
    nearest_m
        How far ahead of the robot the rectangle begins.
    clockwise
        Which way round the person walks, seen from above.
    seeded_share
        Share of particles that are put to the matched clusters.
    """

    approach: str = "fused"
    particles: int = 100
    matches: int = 9
    sigma_m: float = 1.0
    sigma_per: str = "step"
    rho_m2: float = 0.05
    phase: str = "two hypotheses"
    motion: str = "random walk"
    antennas: str = "both"
    beam_deg: float = 70.0
    speed_m_s: float = SPEED_M_S
    tag_offset_db: float = 0.0
    range_sigma_m: float = 0.01
    clutter: int = 12
    clutter_hides: bool = False
    bounded: bool = True
    unread: bool = False
    nearest_m: float = WALK_M[0][0]
    clockwise: bool = False
    seeded_share: float = 0.0

    @property
    def step_count(self) -> int:
        """Samples of a trial: five rounds, or one at a speed below `SLOW_M_S`."""
        rounds = 1 if self.speed_m_s < SLOW_M_S else ROUNDS
        return round(rounds * WAY_M / self.speed_m_s / INTERVAL_S)


BASE: Final = Choice()
"""The paper's values and ours."""


@lru_cache(maxsize=64)
def layout(choice: Choice) -> Layout:
    """Return the antennas that are on, over a floor without tags."""
    yaw_rad = -YAW_RAD if choice.antennas == "right" else YAW_RAD
    antennas = yawed_antennas(
        antenna=registry.load("antennas", "uhf_patch")(beam_rad=math.radians(choice.beam_deg)),
        count=2 if choice.antennas == "both" else 1,
        yaw_rad=yaw_rad,
        interval_s=INTERVAL_S,
    )
    return Layout(floor_tags=FloorTags(zones=()), readers=(antennas,), target_tags=1)


@lru_cache(maxsize=64)
def scenario(choice: Choice) -> Scenario:
    """Return the walk; all have one name, so that all trials of a number meet the same random streams."""
    walk_m = np.array([(x_m + choice.nearest_m - WALK_M[0][0], y_m) for x_m, y_m in WALK_M])
    return Scenario(
        name="liang2020",
        role=Role.HELD_OUT,
        site=Site(name="room", floor=box(*ROOM_M)),
        robot=Robot(
            outline_m=np.array(
                [(-_HALF_M, -_HALF_M), (_HALF_M, -_HALF_M), (_HALF_M, _HALF_M), (-_HALF_M, _HALF_M)]
            )
        ),
        judgement=Judgement(settle_s=_SETTLE_S),
        step_s=INTERVAL_S,
        step_count=choice.step_count,
        tracking=TrackingWorld(
            robot_pose=(0.0, 0.0, 0.0),
            walk_m=walk_m[::-1] if choice.clockwise else walk_m,
            walking_speed_m_s=choice.speed_m_s,
            clutter_count=choice.clutter,
            clutter_hides=choice.clutter_hides,
            signal=SignalWorld(tag_offset_db=choice.tag_offset_db),
            laser=LaserScanner(range_sigma_m=choice.range_sigma_m),
        ),
    )


@lru_cache(maxsize=64)
def tracker(choice: Choice) -> UhfLaser:
    """Return the estimator."""
    return UhfLaser(
        mode=MODES[choice.approach],
        particles=choice.particles,
        matches=choice.matches,
        sigma_m=choice.sigma_m,
        sigma_per=choice.sigma_per,
        rho_m2=choice.rho_m2,
        aliases=choice.phase,
        motion=choice.motion,
        on_floor=choice.bounded,
        steps_unread=choice.unread,
        seeded_share=choice.seeded_share,
    )


def cell(choice: Choice, trials: int) -> Cell:
    """Return the cell of a choice."""
    return Cell(layout=layout(choice), scenario=scenario(choice), estimator=tracker(choice), trials=trials)
