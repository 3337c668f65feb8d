"""The line tile of kim2010: three tags in a row, laid as equilateral triangles."""

import math
from typing import Final

import numpy as np

from layoutopt.layout import TagPattern
from layoutopt.patterns.checks import check_lengths
from layoutopt.protocols import PatternCard

CARD: Final = PatternCard(
    summary="Tiles of three tags in a row, every second row of tiles moved by half a spacing.",
    reference="kim2010, Fig. 5d and 6d, Eq. 7-9",
)


def line(*, spacing_m: float) -> TagPattern:
    """Return tiles of three tags in a row, ``spacing_m`` apart, that make equilateral triangles.

    A tile is three spacings wide and sqrt(3)/2 spacings high (Eq. 7). Every second row of tiles is moved by half a
    spacing; the tags are those of the equilateral lattice of that side. At the density of a square pattern of
    pitch s the spacing is e with e² = 2 s² / sqrt(3) (Eq. 9).

    Raises
    ------
    ValueError
        If the spacing is not positive and finite.
    """
    check_lengths(spacing_m=spacing_m)
    height_m = math.sqrt(0.75) * spacing_m
    return TagPattern(
        name="line",
        points_m=np.array([(spacing_m / 2.0, height_m / 2.0), (spacing_m, 1.5 * height_m)]),
        cell_m=np.diag([spacing_m, 2.0 * height_m]),
        parameters={"spacing_m": spacing_m},
    )
