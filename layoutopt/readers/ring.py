"""Antennas evenly round a circle."""

from typing import Final

import numpy as np

from layoutopt.layout import ReaderGroup
from layoutopt.protocols import Mount, ReaderCard
from layoutopt.readers.mounting import mounted

CARD: Final = ReaderCard(
    summary="Antennas evenly round a circle about the robot's centre, the first one ahead.",
    reference="the widest arrangement for a given count; own",
)


def ring(*, count: int, radius_m: float, mount: Mount) -> ReaderGroup:
    """Return ``count`` antennas evenly on a circle; a single one sits ahead on the circle.

    Raises
    ------
    ValueError
        If the count or the radius is not positive.
    """
    if count < 1 or not radius_m > 0.0:
        raise ValueError(f"a ring needs a positive count and radius, got {count} and {radius_m}")
    angle_rad = 2.0 * np.pi * np.arange(count) / count
    xy_m = radius_m * np.stack([np.cos(angle_rad), np.sin(angle_rad)], axis=1)
    return mounted("ring", np.round(xy_m, 12), mount, {"count": count, "radius_m": radius_m})
