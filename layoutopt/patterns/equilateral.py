"""The lattice of equilateral triangles."""

import math
from typing import Final

import numpy as np

from layoutopt.layout import TagPattern
from layoutopt.patterns.checks import check_lengths
from layoutopt.protocols import PatternCard

CARD: Final = PatternCard(
    summary="Equilateral triangles: every tag has six neighbours at one distance.",
    reference="kim2010, Fig. 6d; Kershner, Amer. J. Math. 61, 1939 (fewest discs that cover the plane)",
)


def equilateral(*, side_m: float) -> TagPattern:
    """Return the lattice of equilateral triangles of ``side_m``, rows along x.

    No arrangement of as many tags leaves smaller gaps: every place has a tag within ``side_m`` / sqrt(3).

    Raises
    ------
    ValueError
        If the side is not positive and finite.

    Examples
    --------
    >>> round(equilateral(side_m=0.1).density_per_m2, 3)
    115.47
    """
    check_lengths(side_m=side_m)
    gap_m = math.sqrt(0.75) * side_m
    return TagPattern(
        name="equilateral",
        points_m=np.array([(0.0, 0.0), (side_m / 2.0, gap_m)]),
        cell_m=np.diag([side_m, 2.0 * gap_m]),
        parameters={"side_m": side_m},
    )
