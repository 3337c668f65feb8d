"""Antennas wherever a list puts them."""

from collections.abc import Sequence
from typing import Final

import numpy as np

from layoutopt.layout import ReaderGroup
from layoutopt.protocols import Mount, ReaderCard
from layoutopt.readers.mounting import mounted

CARD: Final = ReaderCard(summary="Antennas at listed points of the robot frame.", reference="any arrangement")


def listed(*, points_m: Sequence[Sequence[float]], mount: Mount) -> ReaderGroup:
    """Return antennas at the points given, shape (n, 2), in ``base_link``.

    Raises
    ------
    ValueError
        If there is no point or a number is not finite.
    """
    xy_m = np.asarray(points_m, dtype=np.float64).reshape(-1, 2)
    return mounted("listed", xy_m, mount, {"count": len(xy_m)})
