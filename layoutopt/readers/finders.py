"""Antennas on a robot that find things off the floor: UHF antennas at a yaw, and crossed antennas for docking."""

import math
from typing import Final

import numpy as np

from layoutopt.layout import ReaderGroup, ReaderProfile
from layoutopt.protocols import AntennaModel

UHF_HEIGHT_M: Final = 0.8
"""liang2020, Section 4.1."""
LARGEST_UHF_PORTS: Final = 4
"""Antenna ports of a UHF reader of the class that liang2020 uses (Impinj Speedway R420)."""


def yawed_antennas(
    *,
    antenna: AntennaModel,
    count: int,
    yaw_rad: float,
    interval_s: float = 0.4,
    height_m: float = UHF_HEIGHT_M,
) -> ReaderGroup:
    """Return UHF antennas in the middle of a robot that look from ``-yaw_rad`` to ``yaw_rad``, evenly.

    The first looks farthest to the left. One antenna alone looks at ``yaw_rad``. They share one reader and take
    turns: each reads once in every ``interval_s``.

    Raises
    ------
    ValueError
        If there are fewer than one or more than four antennas, or a number is not finite or outside its range.

    References
    ----------
    liang2020, Section 4.1: two antennas at 45 degrees to either side, a sample every 0.4 s.
    """
    if not 1 <= count <= LARGEST_UHF_PORTS:
        raise ValueError(f"a UHF reader has 1 to {LARGEST_UHF_PORTS} antennas, got {count}")
    if not -math.pi <= yaw_rad <= math.pi:
        raise ValueError(f"yaw_rad lies within half a turn, got {yaw_rad!r}")
    if not 0.0 < interval_s < math.inf:
        raise ValueError(f"interval_s must be positive and finite, got {interval_s!r}")
    yaws = np.array([yaw_rad]) if count == 1 else np.linspace(yaw_rad, -yaw_rad, count)
    poses = np.zeros((count, 4))
    poses[:, 2], poses[:, 3] = height_m, yaws
    return ReaderGroup(
        name="yawed_antennas",
        poses=poses,
        antenna=antenna,
        profile=ReaderProfile(
            name="uhf",
            scan_period_s=interval_s / count,
            tags_per_scan="several",
            spacing_sides=0.0,
            simultaneous_spacing_sides=0.0,
        ),
        slots=tuple(range(count)),
        antennas_per_module=count,
        kind="signal",
        parameters={"count": count, "yaw_rad": yaw_rad, "interval_s": interval_s},
    )


def docking_antennas(*, antenna: AntennaModel, height_m: float = 0.5) -> ReaderGroup:
    """Return the crossed antennas in the middle of a robot by which it docks.

    A reading takes a turn of the platform, taken as one second: robots dock step by step and wait for it.

    References
    ----------
    kim2009, Section II.
    """
    return ReaderGroup(
        name="docking_antennas",
        poses=np.array([[0.0, 0.0, height_m, 0.0]]),
        antenna=antenna,
        profile=ReaderProfile(
            name="direction",
            scan_period_s=1.0,
            tags_per_scan="one",
            spacing_sides=0.0,
            simultaneous_spacing_sides=0.0,
        ),
        slots=(0,),
        kind="direction",
        parameters={"count": 1},
    )
