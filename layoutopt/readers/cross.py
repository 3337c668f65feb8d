"""Antennas along the two axes of the robot."""

from typing import Final

import numpy as np

from layoutopt.layout import ReaderGroup
from layoutopt.protocols import Mount, ReaderCard
from layoutopt.readers.mounting import mounted

CARD: Final = ReaderCard(
    summary="Equal arms forward, left, back and right, evenly spaced from the centre.",
    reference="the arrangement of mi2016, Fig. 6, in general form",
)


def cross(*, count: int, spacing_m: float = 0.1, mount: Mount) -> ReaderGroup:
    """Return ``count`` antennas on four equal arms, at 1, 2, ... times ``spacing_m`` from the centre.

    Raises
    ------
    ValueError
        If the count is no positive multiple of four or the spacing is not positive.
    """
    if count < 4 or count % 4:
        raise ValueError(f"a cross needs a multiple of four antennas, got {count}")
    if not spacing_m > 0.0:
        raise ValueError(f"a spacing must be positive, got {spacing_m}")
    directions = np.array([(1.0, 0.0), (0.0, 1.0), (-1.0, 0.0), (0.0, -1.0)])
    distances_m = spacing_m * np.arange(1, count // 4 + 1)
    xy_m = (distances_m[:, None, None] * directions[None, :, :]).reshape(-1, 2)
    return mounted("cross", xy_m, mount, {"count": count, "spacing_m": spacing_m})
