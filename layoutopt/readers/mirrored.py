"""Antennas at listed points and at their mirror images."""

from collections.abc import Sequence
from typing import Final

import numpy as np

from layoutopt.identity import read_only
from layoutopt.layout import ReaderGroup
from layoutopt.protocols import Mount, ReaderCard
from layoutopt.readers.mounting import mounted

CARD: Final = ReaderCard(
    summary="Antennas at listed points of the robot frame, mirrored at its axis or at both axes.",
    reference="own; half or a quarter of the unknowns of a free arrangement",
)
_MIRRORS: Final = {"left_right": ((1, 1), (1, -1)), "both": ((1, 1), (1, -1), (-1, 1), (-1, -1))}


def mirrored(*, points_m: Sequence[Sequence[float]], symmetry: str = "left_right", mount: Mount) -> ReaderGroup:
    """Return antennas at the points given, shape (n, 2), in ``base_link``, and at their images.

    With ``"left_right"`` the images lie across the axis along which the robot drives (y to -y), with ``"both"``
    also across the other one. A point on a mirror is its own image and comes once.

    Raises
    ------
    ValueError
        If there is no point, a number is not finite, or the symmetry is unknown.
    """
    if symmetry not in _MIRRORS:
        raise ValueError(f"symmetry is one of {', '.join(_MIRRORS)}, not {symmetry!r}")
    xy_m = read_only(points_m, (-1, 2))
    images_m = [point * signs + 0.0 for point in xy_m for signs in _MIRRORS[symmetry]]
    places = dict.fromkeys((float(x_m), float(y_m)) for x_m, y_m in images_m)
    return mounted("mirrored", np.array(list(places)), mount, {"count": len(places), "symmetry": symmetry})
