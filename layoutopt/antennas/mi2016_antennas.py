"""The two antennas that mi2016 measured: what every antenna law with a free side is fitted to."""

import math
from dataclasses import dataclass
from typing import Final

CALIBRATED_SIDE_M: Final = (0.025, 0.080)
"""Sides for which a law through the two antennas counts as calibrated; outside it extrapolates."""


@dataclass(frozen=True, slots=True, kw_only=True)
class MeasuredReach:
    """Side of a square antenna, and the greatest depth below it at which it read the paper's tags."""

    side_m: float
    reach_m: float


SMALL: Final = MeasuredReach(side_m=0.030, reach_m=0.023)
"""Section 5.3: R 15 and h_c 8 mm."""
LARGE: Final = MeasuredReach(side_m=0.060, reach_m=0.054)
"""Section 5.4: R 30 and h_c 24 mm."""


def calibrated(side_m: float) -> bool:
    """Return whether a side lies in the calibrated range."""
    return CALIBRATED_SIDE_M[0] <= side_m <= CALIBRATED_SIDE_M[1]


def exponent(of_small: float, of_large: float) -> float:
    """Return the exponent of the power law of the side through a value of either antenna.

    Examples
    --------
    >>> round(exponent(SMALL.reach_m, LARGE.reach_m), 4)
    1.2313
    """
    return math.log(of_large / of_small) / math.log(LARGE.side_m / SMALL.side_m)
