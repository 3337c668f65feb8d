"""The world of mi2016 as far as the paper states it, with the choices that it leaves open in one place."""

import math
from functools import lru_cache
from typing import Final

import numpy as np
from shapely.geometry import box

from layoutopt import registry
from layoutopt.estimators.mcl import MonteCarloLocalisation
from layoutopt.layout import WHOLE_FLOOR, FloorTags, Layout, ReaderGroup, ZonePattern
from layoutopt.protocols import Mount
from layoutopt.readers.mounting import mounted
from layoutopt.readers.profiles import MI2016
from layoutopt.robot import Drive, Odometry, Robot
from layoutopt.scenario import Faults, Judgement, Role, Routes, Scenario
from layoutopt.site import Site

STEP_S: Final = 0.05
"""Time between readings (Section 6: every 50 ms)."""
SPEED_M_S: Final = 0.1
"""Speed of the robot (Section 6); assumed for the simulations too."""
DURATION_S: Final = 60.0
"""Length of a trial: not stated."""
CIRCLE_RADIUS_M: Final = 0.5
"""The simulated route is not stated: a circle, whose centre lies anywhere against the lattice."""
NOISE: Final = (0.030, 0.05)
"""σ of Eq. 1 in m/s (x and y) and rad/s: not stated."""
NOISE_OF_TABLE_3: Final = (0.020, 0.03)
"""Smaller noise, with which a filter that starts wrong finds back as slowly as the paper's."""
WRONG_START: Final = (0.165, 0.153, 1.5)
"""Error of the start, m, m and rad, behind Table 3: read off its maxima."""
CHASSIS_M: Final = (1.2, 1.1)
"""Length and width that hold all four arrays."""
FLOOR_SIDE_M: Final = 4.0
DENSITIES: Final = (400, 100, 25, 16)
LIKELIHOODS: Final = ("gaussian", "combination")
ARRAYS: Final = {96: (0.030, 0.020), 24: (0.060, 0.024), 20: (0.060, 0.024), 8: (0.060, 0.024)}
"""Readers: antenna side and height, m (Sections 5.3 and 5.4); for 24 and 20 the height is that of 8, assumed."""
HALF_METRE: Final = 0.5
"""Spread of places: one metre is a multiple of every pitch, so that each phase of a lattice is as likely."""


@lru_cache(maxsize=1)
def site() -> Site:
    """Return the empty floor on which everything runs."""
    half_m = FLOOR_SIDE_M / 2.0
    return Site(name="laboratory of mi2016", floor=box(-half_m, -half_m, half_m, half_m))


@lru_cache(maxsize=64)
def layout(readers: int, tags_per_m2: int, *, height_m: float | None = None) -> Layout:
    """Return one of the paper's arrays over one of its lattices."""
    return layout_of(array(readers, height_m=height_m), tags_per_m2)


def layout_of(group: ReaderGroup, tags_per_m2: int) -> Layout:
    """Return readers over a square lattice."""
    pattern = registry.load("patterns", "square")(pitch_m=1.0 / math.sqrt(tags_per_m2))
    return Layout(floor_tags=FloorTags(zones=(ZonePattern(zone=WHOLE_FLOOR, pattern=pattern),)), readers=(group,))


def mount(readers: int, height_m: float | None = None) -> Mount:
    """Return how the antennas of an array are built."""
    side_m, usual_m = ARRAYS[readers]
    antenna = registry.load("antennas", "sphere")(side_m=side_m)
    return Mount(antenna=antenna, height_m=usual_m if height_m is None else height_m, profile=MI2016)


def array(readers: int, *, height_m: float | None = None) -> ReaderGroup:
    """Return one of the paper's arrays, its coordinates reconstructed."""
    group: ReaderGroup = registry.load("readers", f"mi2016_{readers}")(mount=mount(readers, height_m))
    return group


def other_array(readers: int) -> ReaderGroup:
    """Return another reading of the lost figures: 96 as four arms of 4 by 6, 8 at 50 and 150 mm."""
    if readers == 8:
        turns = np.array([(1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0)])
        xy_m = (np.array([0.05, 0.15])[:, None, None] * turns[None]).reshape(-1, 2)
        return mounted("listed", xy_m, mount(8), {"count": 8})
    across = np.arange(4) - 1.5
    along = np.arange(6) + 2.5
    forward = np.stack(np.meshgrid(0.0445 * along, 0.0375 * across, indexing="ij"), axis=-1).reshape(-1, 2)
    left = np.stack(np.meshgrid(0.0445 * across, 0.0375 * along, indexing="ij"), axis=-1).reshape(-1, 2)
    xy_m = np.concatenate([forward, -forward, left, -left])
    return mounted("listed", xy_m, mount(96), {"count": len(xy_m)})


def odometry_by_time(translation_m_s: float, rotation_rad_s: float) -> Odometry:
    """Return the noise of Eq. 1 in steps of 50 ms, which is a random walk in time."""
    root_s = math.sqrt(STEP_S)
    return Odometry(
        translation_share=0.0,
        lateral_share=0.0,
        rotation_rad_per_m=0.0,
        translation_m_per_sqrt_s=translation_m_s * root_s,
        rotation_rad_per_sqrt_s=rotation_rad_s * root_s,
    )


def odometry_by_way(translation_m_s: float, rotation_rad_s: float) -> Odometry:
    """Return noise that is that of Eq. 1 at 100 mm/s, but grows with the way and not with time."""
    root_s_per_root_m = STEP_S / math.sqrt(SPEED_M_S * STEP_S)
    share = translation_m_s * root_s_per_root_m
    return Odometry(
        translation_share=share,
        lateral_share=share,
        rotation_rad_per_m=rotation_rad_s * root_s_per_root_m,
        half_track_m=0.0,
    )


EXACT: Final = Odometry(translation_share=0.0, lateral_share=0.0, rotation_rad_per_m=0.0)
"""Odometry without error."""


def robot(odometry: Odometry, speed_m_s: float = SPEED_M_S) -> Robot:
    """Return the omnidirectional vehicle."""
    length_m, width_m = CHASSIS_M[0] / 2.0, CHASSIS_M[1] / 2.0
    corners = [(-length_m, -width_m), (length_m, -width_m), (length_m, width_m), (-length_m, width_m)]
    return Robot(outline_m=np.array(corners), drive=Drive.OMNIDIRECTIONAL, odometry=odometry, speed_m_s=speed_m_s)


CIRCLE: Final = Routes(kind="circle", circle_radius_m=CIRCLE_RADIUS_M, centre_spread_m=HALF_METRE)


def scenario(
    *,
    odometry: Odometry | None = None,
    routes: Routes = CIRCLE,
    speed_m_s: float = SPEED_M_S,
    faults: Faults | None = None,
    name: str = "mi2016",
    judgement: Judgement | None = None,
    duration_s: float = DURATION_S,
) -> Scenario:
    """Return a world in which the start is known; without further word the one that gives Tables 2 and 4.

    Scenarios of one name have the same random streams, so that every cell meets the same drives.
    """
    return Scenario(
        name=name,
        role=Role.HELD_OUT,
        site=site(),
        robot=robot(odometry if odometry is not None else odometry_by_time(*NOISE), speed_m_s),
        routes=routes,
        faults=faults if faults is not None else Faults(),
        judgement=judgement if judgement is not None else Judgement(settle_s=0.0),
        step_s=STEP_S,
        step_count=round(duration_s / STEP_S),
        start_sigma_m=0.0,
        start_sigma_rad=0.0,
    )


def particle_filter(likelihood: str, *, reinitialise: bool = True) -> MonteCarloLocalisation:
    """Return Algorithm 1 with one of the two likelihoods."""
    return MonteCarloLocalisation(likelihood=likelihood, reinitialise=reinitialise)
