"""The triangular lattice of staggered rows."""

from typing import Final

import numpy as np

from layoutopt.layout import TagPattern
from layoutopt.patterns.checks import check_lengths
from layoutopt.protocols import PatternCard

CARD: Final = PatternCard(
    summary="Staggered rows: every second row is shifted by half a pitch.",
    reference="han2006, Fig. 6, Eq. 17-20",
)


def triangular(*, pitch_m: float, row_gap_m: float | None = None) -> TagPattern:
    """Return rows of tags ``pitch_m`` apart, every second one shifted by half a pitch.

    Rows are ``row_gap_m`` apart, by default one pitch: the isosceles pattern of han2006, which has the density
    of the square lattice. A gap of sqrt(3)/2 pitches makes the triangles equilateral.

    Raises
    ------
    ValueError
        If a length is not positive and finite.
    """
    gap_m = pitch_m if row_gap_m is None else row_gap_m
    check_lengths(pitch_m=pitch_m, row_gap_m=gap_m)
    return TagPattern(
        name="triangular",
        points_m=np.array([(0.0, 0.0), (pitch_m / 2.0, gap_m)]),
        cell_m=np.diag([pitch_m, 2.0 * gap_m]),
        parameters={"pitch_m": pitch_m, "row_gap_m": gap_m},
    )
