"""The square lattice."""

from typing import Final

import numpy as np

from layoutopt.layout import TagPattern
from layoutopt.patterns.checks import check_lengths
from layoutopt.protocols import PatternCard

CARD: Final = PatternCard(
    summary="Square lattice: one tag a pitch in both directions.", reference="mi2016, Fig. 7; han2006, Fig. 5"
)


def square(*, pitch_m: float) -> TagPattern:
    """Return the square lattice with tags ``pitch_m`` apart in rows and columns.

    Raises
    ------
    ValueError
        If the pitch is not positive and finite.

    Examples
    --------
    >>> round(square(pitch_m=0.1).density_per_m2)
    100
    """
    check_lengths(pitch_m=pitch_m)
    return TagPattern(
        name="square", points_m=np.zeros((1, 2)), cell_m=np.eye(2) * pitch_m, parameters={"pitch_m": pitch_m}
    )
