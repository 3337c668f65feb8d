"""Antennas round two circles, an inner and an outer one."""

import math
from typing import Final

import numpy as np

from layoutopt.identity import FloatArray
from layoutopt.layout import ReaderGroup
from layoutopt.protocols import Mount, ReaderCard
from layoutopt.readers.mounting import mounted

CARD: Final = ReaderCard(
    summary="Antennas evenly round an inner and an outer circle about the robot's centre.",
    reference="own; fills the room under a robot, where one ring leaves its middle empty",
)


def two_rings(
    *,
    inner_count: int,
    inner_radius_m: float,
    outer_count: int,
    outer_radius_m: float,
    phase: float = 0.0,
    mount: Mount,
) -> ReaderGroup:
    """Return antennas evenly on two circles; the first of the inner circle sits ahead.

    The first of the outer circle is turned from there, counter-clockwise, by ``phase`` of the step between two
    antennas of the outer circle.

    Raises
    ------
    ValueError
        If a count or radius is not positive, or the phase is not finite.
    """
    if inner_count < 1 or outer_count < 1 or not (inner_radius_m > 0.0 and outer_radius_m > 0.0):
        raise ValueError(
            f"two rings need positive counts and radii, got {inner_count} at {inner_radius_m} and "
            f"{outer_count} at {outer_radius_m}"
        )
    if not math.isfinite(phase):
        raise ValueError(f"a phase must be finite, got {phase}")
    inner = _circle(inner_count, inner_radius_m, 0.0)
    outer = _circle(outer_count, outer_radius_m, phase)
    parameters = {
        "inner_count": inner_count,
        "inner_radius_m": inner_radius_m,
        "outer_count": outer_count,
        "outer_radius_m": outer_radius_m,
        "phase": phase,
    }
    return mounted("two_rings", np.concatenate([inner, outer]), mount, parameters)


def _circle(count: int, radius_m: float, phase: float) -> FloatArray:
    angle_rad = 2.0 * np.pi * (np.arange(count) + phase) / count
    return np.round(radius_m * np.stack([np.cos(angle_rad), np.sin(angle_rad)], axis=1), 12)
