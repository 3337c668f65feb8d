"""Tags at random places of each tile: what the pseudorandom arrangement of kim2010 imitates."""

from typing import Final

import numpy as np

from layoutopt.identity import FloatArray
from layoutopt.layout import TagPattern
from layoutopt.patterns.checks import check_lengths, check_seed, check_tile
from layoutopt.protocols import PatternCard

CARD: Final = PatternCard(
    summary="Four tags at random places of each tile, without overlap of their discs.",
    reference="kim2010, Section 4, Fig. 7",
)
TILES: Final = 9
"""Tiles a side of the period: as many as a Sudoku has."""
TAGS: Final = 4
_ATTEMPTS: Final = 20_000


def random(*, tile_m: float, radius_m: float, seed: int) -> TagPattern:
    """Return nine by nine tiles, each with four tags at random places of its own.

    The read discs of the four lie within their tile and do not overlap; among all such places each is as likely
    (tiles are drawn until one fits). After nine tiles the pattern repeats, so that exact bounds have a period.

    Raises
    ------
    ValueError
        If a length is not positive and finite, the seed no whole number from 0 on, or the tile has no room for
        four discs, or so little that random places do not fit.
    """
    check_lengths(tile_m=tile_m, radius_m=radius_m)
    check_seed(seed)
    check_tile(tile_m, 4.0 * radius_m, f"“four discs of {1e3 * radius_m:g} mm inside a tile” (4 r)")
    draws = np.random.Generator(np.random.Philox(seed))
    corners = [(column * tile_m, row * tile_m) for row in range(TILES) for column in range(TILES)]
    return TagPattern(
        name="random",
        points_m=np.concatenate([_tile_m(tile_m, radius_m, draws) + corner for corner in corners]),
        cell_m=np.eye(2) * TILES * tile_m,
        parameters={"tile_m": tile_m, "radius_m": radius_m, "seed": seed},
    )


def _tile_m(tile_m: float, radius_m: float, draws: np.random.Generator) -> FloatArray:
    """Return four places whose discs lie in the tile apart from each other, shape (4, 2)."""
    first, second = np.triu_indices(TAGS, 1)
    for _ in range(_ATTEMPTS // 100):
        tries = radius_m + (tile_m - 2.0 * radius_m) * draws.random((100, TAGS, 2))
        distance_m = np.linalg.norm(tries[:, first] - tries[:, second], axis=2).min(axis=1)
        fitting = np.flatnonzero(distance_m >= 2.0 * radius_m)
        if len(fitting):
            return np.asarray(tries[fitting[0]])
    raise ValueError(
        f"no random places for four discs of {1e3 * radius_m:g} mm in a tile of {1e3 * tile_m:g} mm in "
        f"{_ATTEMPTS} attempts: take a larger tile or smaller discs"
    )
