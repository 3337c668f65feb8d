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


def listed(
    *, points_m: Sequence[Sequence[float]], cell_m: Sequence[float] | None = None, shift_m: float = 0.0
) -> TagPattern:
    """Return a pattern of the points given, shape (n, 2).

    With ``cell_m`` = (width, height) the points repeat over that rectangle, a tile for example; without it they
    are laid once. ``shift_m`` moves every row of cells to the right against the one below: half a width is running
    bond.

    Raises
    ------
    ValueError
        If there is no point, a number is not finite, two tags share a place, the cell has no width or height, or
        there is a shift without a cell, or one of a width or more.
    """
    points = np.asarray(points_m, dtype=np.float64)
    if len(points) == 0:
        raise ValueError("a list of tags needs at least one point")
    if points.ndim != 2 or points.shape[1] != 2:
        raise ValueError(f"each point of a list has an x and a y, got an array of shape {points.shape}")
    if cell_m is not None and not (len(cell_m) == 2 and min(cell_m) > 0.0):
        raise ValueError(f"a cell needs a positive width and height, got {tuple(cell_m)}")
    if cell_m is None and shift_m != 0.0:
        raise ValueError("a shift moves rows of cells: give the cell too")
    if cell_m is not None and not abs(shift_m) < cell_m[0]:
        raise ValueError(f"a shift must be less than the width of the cell, got {shift_m} for {cell_m[0]} m")
    parameters: dict[str, float | int] = {"count": len(points)}
    pattern = TagPattern(
        name="listed",
        points_m=points,
        cell_m=None if cell_m is None else np.array([(cell_m[0], 0.0), (shift_m, cell_m[1])]),
        parameters=parameters if shift_m == 0.0 else {**parameters, "shift_m": shift_m},
    )
    if pattern.minimum_spacing_m() == 0.0:
        raise ValueError("two tags of the list share a place")
    return pattern
