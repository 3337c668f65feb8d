"""The pseudorandom arrangement of kim2010: nine tilted tiles laid as the numbers of a Sudoku."""

import math
from typing import Final

import numpy as np

from layoutopt.identity import FloatArray
from layoutopt.layout import TagPattern
from layoutopt.patterns.checks import check_lengths, check_tile
from layoutopt.patterns.sudoku_grid import SIZE, sudoku_grid
from layoutopt.patterns.tilted import least_tile_m, tile_points_m
from layoutopt.protocols import PatternCard

CARD: Final = PatternCard(
    summary="Nine kinds of tilted tiles laid as the numbers of a Sudoku.",
    reference="kim2010, Section 4, Eq. 10, Fig. 8 and 9; its own grid is in a lost figure, ours comes from a seed",
)
RULES: Final = ("boxes", "diagonals")
BONDS: Final = ("stack", "running")
TILTS_RAD: Final = tuple(kind * math.pi / 18.0 for kind in range(SIZE))
"""Eq. 10: ninths of a right angle."""


def sudoku(
    *, tile_m: float, seed: int, radius_m: float | None = None, rule: str = "boxes", bond: str = "stack"
) -> TagPattern:
    """Return nine by nine tiles of four tags whose tilts are placed like the numbers of a Sudoku.

    Parameters
    ----------
    tile_m
        Side of a tile (2s in kim2010).
    seed
        Which grid.
    radius_m
        If given, read discs have to lie within their tiles, at every tilt: the tile is at least 6.83 r.
    rule
        ``"boxes"``: no tilt twice in a row, a column or a box of 3 by 3 tiles; ``"diagonals"``: nor on the two
        long diagonals, which the paper asks for.
    bond
        ``"stack"``: tiles in straight rows and columns; ``"running"``: every row moved by half a tile against the
        one below, as bricks are laid. In stack bond every seam between tiles with discs inside them is a blind
        line, in both directions; running bond leaves only those along the rows.

    Raises
    ------
    ValueError
        If a length is not positive and finite, a choice is unknown, the seed negative, or the tile too small.
    """
    check_lengths(tile_m=tile_m)
    if rule not in RULES:
        raise ValueError(f"rule is one of {', '.join(RULES)}, not {rule!r}")
    if bond not in BONDS:
        raise ValueError(f"bond is one of {', '.join(BONDS)}, not {bond!r}")
    if radius_m is not None:
        check_lengths(radius_m=radius_m)
        least_m = max(least_tile_m(radius_m, tilt_rad) for tilt_rad in (*TILTS_RAD, math.pi / 4.0))
        check_tile(tile_m, least_m, f"“discs of {1e3 * radius_m:g} mm inside a tile at every tilt” (6.83 r)")
    parameters: dict[str, float | int | str] = {"tile_m": tile_m, "seed": seed, "rule": rule, "bond": bond}
    return TagPattern(
        name="sudoku",
        points_m=_points_m(tile_m, seed, rule, bond),
        cell_m=np.array([(SIZE * tile_m, 0.0), (tile_m / 2.0 if bond == "running" else 0.0, SIZE * tile_m)]),
        parameters=parameters if radius_m is None else {**parameters, "radius_m": radius_m},
    )


def _points_m(tile_m: float, seed: int, rule: str, bond: str) -> FloatArray:
    grid = sudoku_grid(seed, diagonals=rule == "diagonals")
    tiles = [tile_points_m(tile_m, tilt_rad) for tilt_rad in TILTS_RAD]
    moved_m = tile_m / 2.0 if bond == "running" else 0.0
    return np.concatenate(
        [
            tiles[grid[row, column]] + (column * tile_m + row % 2 * moved_m, row * tile_m)
            for row in range(SIZE)
            for column in range(SIZE)
        ]
    )
