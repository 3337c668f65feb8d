"""Tags wherever a list puts them."""

from collections.abc import Sequence
from typing import Final

import numpy as np

from layoutopt.layout import TagPattern
from layoutopt.protocols import PatternCard

CARD: Final = PatternCard(
    summary="Tags at listed points, laid once or repeated over a rectangular cell.",
    reference="any arrangement, for example one found by an integer program",
    periodic=False,
)


def listed(*, points_m: Sequence[Sequence[float]], cell_m: Sequence[float] | None = None) -> TagPattern:
    """Return a pattern of the points given, shape (n, 2).

    With ``cell_m`` = (width, height) the points repeat over that rectangle; without it they are laid once.

    Raises
    ------
    ValueError
        If there is no point, a number is not finite, or two tags share a place.
    """
    points = np.asarray(points_m, dtype=np.float64).reshape(-1, 2)
    if len(points) == 0:
        raise ValueError("a list of tags needs at least one point")
    if cell_m is not None and not (len(cell_m) == 2 and min(cell_m) > 0.0):
        raise ValueError(f"a cell needs a positive width and height, got {tuple(cell_m)}")
    pattern = TagPattern(
        name="listed",
        points_m=points,
        cell_m=None if cell_m is None else np.diag(cell_m),
        parameters={"count": len(points)},
    )
    if pattern.minimum_spacing_m() == 0.0:
        raise ValueError("two tags of the list share a place")
    return pattern
