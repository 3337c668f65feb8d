"""Which tiles to make for a pattern, and where each goes: how patterns are laid (kim2010, Section 3.1).

Tags are put on tiles in a workshop and the tiles are laid side by side, because many single tags cannot be placed
precisely. A tile may be laid in any of its quarter turns, but not face down: mirror images are tiles of their own.
"""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np

from layoutopt.geometry import lattice_points, turned
from layoutopt.identity import FloatArray, IntArray
from layoutopt.layout import TagPattern

_SAME: Final = 1e-6
"""Places of tags that differ by less, relative to the tile, are one."""


@dataclass(frozen=True, slots=True, kw_only=True)
class TileSchedule:
    """Tiles of one period of a pattern, which repeats to the right, and above after a shift.

    Attributes
    ----------
    size_m
        Width and height of a tile.
    tiles_m
        Tags of each kind of tile, seen from its lower left corner, shape (n, 2) each.
    kind
        Kind of the tile in each row and column of the period, counted from the lower left, shape (rows, columns).
    quarter_turns
        How often it is turned counter-clockwise by 90° from the way it was made, shape (rows, columns).
    row_offset_m
        How far each row of tiles is moved to the right, shape (rows,).
    shift_m
        How far the next period above is moved to the right as a whole.
    mirror_of
        For each kind the kind that is its mirror image, perhaps itself, or -1.
    """

    size_m: tuple[float, float]
    tiles_m: tuple[FloatArray, ...]
    kind: IntArray
    quarter_turns: IntArray
    row_offset_m: FloatArray
    shift_m: float
    mirror_of: tuple[int, ...]

    def counts(self) -> IntArray:
        """Return how many tiles of each kind a period has, shape (kinds,)."""
        return np.bincount(self.kind.ravel(), minlength=len(self.tiles_m)).astype(np.int64)

    def laid_m(self) -> FloatArray:
        """Return the tags of all tiles of one period, shape (n, 2)."""
        width_m, height_m = self.size_m
        laid = []
        for row, column in np.ndindex(self.kind.shape):
            tags_m = self.tiles_m[self.kind[row, column]]
            corner_m = np.array([self.row_offset_m[row] + column * width_m, row * height_m])
            laid.append(_quarter_turned(tags_m, int(self.quarter_turns[row, column]), self.size_m) + corner_m)
        return np.concatenate(laid)


def tile_schedule(pattern: TagPattern) -> TileSchedule:
    """Return the tiles of a pattern: those of its family, or one cell if the family has none of its own.

    Raises
    ------
    ValueError
        If the pattern is laid once, or its cell is none of tiles along the axes in rows that are moved sideways.
    """
    if pattern.cell_m is None:
        raise ValueError("a pattern that is laid once has no tiles: every tag of it has a place of its own")
    (across_m, up_m), (_, above_m) = pattern.cell_m
    if up_m != 0.0 or not (across_m > 0.0 and above_m > 0.0):
        raise ValueError(
            "tiles lie side by side along x, in rows above each other: a cell is (width, 0) and (shift, height)"
        )
    width_m, height_m = _size_m(pattern)
    offset_m = _row_offset_m(pattern, width_m)
    rows = max(len(offset_m), round(pattern.cell_m[1, 1] / height_m))
    columns = max(1, round(pattern.cell_m[0, 0] / width_m))
    offset_m = np.resize(offset_m, rows)
    kinds: list[FloatArray] = []
    kind, turns = np.zeros((rows, columns), dtype=np.int64), np.zeros((rows, columns), dtype=np.int64)
    size_m = (width_m, height_m)
    for row, column in np.ndindex(rows, columns):
        corner_m = np.array([offset_m[row] + column * width_m, row * height_m])
        tags_m = _on_tile(pattern, corner_m, size_m)
        known = _known_as(tags_m, kinds, size_m)
        if known is None:
            kinds.append(tags_m)
            known = len(kinds) - 1, 0
        kind[row, column], turns[row, column] = known
    return TileSchedule(
        size_m=size_m,
        tiles_m=tuple(kinds),
        kind=kind,
        quarter_turns=turns,
        row_offset_m=offset_m,
        shift_m=float(pattern.cell_m[1, 0] * rows * height_m / pattern.cell_m[1, 1]),
        mirror_of=tuple(_mirror_of(tags_m, kinds, size_m) for tags_m in kinds),
    )


def _size_m(pattern: TagPattern) -> tuple[float, float]:
    assert pattern.cell_m is not None
    if "tile_m" in pattern.parameters:
        tile_m = float(pattern.parameters["tile_m"])
        return tile_m, tile_m
    if pattern.name == "line":
        spacing_m = float(pattern.parameters["spacing_m"])
        return 3.0 * spacing_m, math.sqrt(0.75) * spacing_m
    return float(pattern.cell_m[0, 0]), float(pattern.cell_m[1, 1])


def _row_offset_m(pattern: TagPattern, width_m: float) -> FloatArray:
    """Return by how much the rows of tiles of one period are moved."""
    if pattern.name == "line":
        return np.array([0.0, width_m / 6.0])
    if pattern.name == "sudoku" and pattern.parameters["bond"] == "running":
        return np.resize([0.0, width_m / 2.0], 9)
    return np.zeros(1)


def _on_tile(pattern: TagPattern, corner_m: FloatArray, size_m: tuple[float, float]) -> FloatArray:
    """Return the tags on a tile as seen from its corner, by height, then from the left."""
    slack_m = _SAME * min(size_m)
    low, high = corner_m - slack_m, corner_m + size_m - slack_m
    found = lattice_points(pattern.points_m, pattern.cell_m, (low[0], low[1], high[0], high[1])) - corner_m
    # Those on the upper or right edge belong to the next tile.
    found = found[(found < np.array(size_m) - slack_m).all(axis=1)]
    return np.asarray(found[np.lexsort(np.round(found / slack_m).T)])


def _known_as(tags_m: FloatArray, kinds: list[FloatArray], size_m: tuple[float, float]) -> tuple[int, int] | None:
    """Return the kind and the turn in which a tile is known already."""
    square = math.isclose(*size_m)
    for number, known_m in enumerate(kinds):
        for turn in range(4) if square else (0, 2):
            if _same(_quarter_turned(known_m, turn, size_m), tags_m, size_m):
                return number, turn
    return None


def _mirror_of(tags_m: FloatArray, kinds: list[FloatArray], size_m: tuple[float, float]) -> int:
    known = _known_as((size_m[0], 0.0) + tags_m * (-1.0, 1.0), kinds, size_m)
    return -1 if known is None else known[0]


def _quarter_turned(tags_m: FloatArray, turn: int, size_m: tuple[float, float]) -> FloatArray:
    middle_m = np.array(size_m) / 2.0
    return turned(tags_m - middle_m, turn * math.pi / 2.0) + middle_m


def _same(first_m: FloatArray, second_m: FloatArray, size_m: tuple[float, float]) -> bool:
    if len(first_m) != len(second_m):
        return False
    apart_m = np.hypot(*(first_m[:, None] - second_m[None]).transpose(2, 0, 1))
    return bool((apart_m.min(axis=1, initial=math.inf) < _SAME * min(size_m)).all())
