"""The tour of mi2016's real robot: eight points, 20 s at each, on carpets of which little is known."""

from dataclasses import dataclass
from typing import Final

import numpy as np

from layoutopt.scenario import Faults, Judgement, Routes, Scenario
from studies.cells import Cell
from studies.published import mi2016_setting as setting
from studies.published.mi2016_printed import Row
from studies.published.timed_noise import TimedNoise

HEIGHT_M: Final = {8: 0.015, 96: 0.020}
"""Antenna height: that of the eight was 15 mm (Section 6); that of the 96 is not stated, so as simulated."""
PAUSE_S: Final = 20.0
STOPS: Final = 8
PLACES: Final = ("anywhere", "over tags")
"""Where the eight points lie against the lattice: at random phases, or each over the true place of a tag."""


@dataclass(frozen=True, slots=True, kw_only=True, order=True)
class Carpet:
    """What is particular to one carpet: where the points lie on it, and how far all its tags are off."""

    place: str
    offset_m: tuple[float, float]


@dataclass(frozen=True, slots=True, kw_only=True, order=True)
class Common:
    """What both carpets share: the placement error of single tags, and the share of scans that bring nothing."""

    sigma_m: float
    missed: float


def cell(row: Row, common: Common, carpet: Carpet, *, name: str, trials: int) -> Cell:
    """Return the trials of one row of Tables 5 and 6 under given faults."""
    translation_m_s, rotation_rad_s = setting.NOISE
    return Cell(
        layout=setting.layout(row.readers, row.tags_per_m2, height_m=HEIGHT_M[row.readers]),
        scenario=scenario(common, carpet, name=name),
        # Wheels at rest are exact; the filter of Eq. 1 is uncertain all the same.
        estimator=TimedNoise(
            inner=setting.particle_filter(row.likelihood),
            translation_m_s=translation_m_s,
            rotation_rad_s=rotation_rad_s,
        ),
        trials=trials,
    )


def scenario(common: Common, carpet: Carpet, *, name: str) -> Scenario:
    """Return the tour of eight points, 20 s at each, judged while the robot stands."""
    across_m, up_m = (0.43, 0.37) if carpet.place == "anywhere" else (0.5, 0.5)
    steps = np.array([(0, 0), (1, 0), (2, 0), (3, 0), (3, 1), (2, 1), (1, 1), (0, 1)])
    # Tags lie at multiples of the pitch from the middle, and half a metre is a multiple of both pitches.
    corner = np.array([-1.5, -0.5]) if carpet.place == "anywhere" else np.array([-2.0, -1.0])
    way_points_m = (corner + steps) * np.array([across_m, up_m])
    if carpet.place == "over tags":
        # Over the tags as they lie: the coordinates of the points are off by as much as the carpet.
        way_points_m = way_points_m + np.array(carpet.offset_m)
    way_m = 6.0 * across_m + 2.0 * up_m
    return setting.scenario(
        name=name,
        odometry=setting.odometry_by_way(*setting.NOISE),
        routes=Routes(
            kind="way_points",
            way_points_m=way_points_m,
            pause_s=PAUSE_S,
            heading_rad=0.0,
            centre_spread_m=setting.HALF_METRE if carpet.place == "anywhere" else 0.0,
        ),
        faults=Faults(
            tag_placement_sigma_m=common.sigma_m, tag_offset_m=carpet.offset_m, missed_read_share=common.missed
        ),
        judgement=Judgement(settle_s=0.0, standing_only=True),
        # The way back from the last point to the first is not driven.
        duration_s=STOPS * PAUSE_S + (way_m - min(across_m, up_m)) / setting.SPEED_M_S,
    )
