"""Sudoku grids from a seed."""

from typing import Final

import numpy as np

from layoutopt.identity import IntArray
from layoutopt.patterns.checks import check_seed

SIZE: Final = 9
_ALL: Final = (1 << SIZE) - 1
_BOX: Final = 3


def sudoku_grid(seed: int, *, diagonals: bool) -> IntArray:
    """Return a grid of the numbers 0 to 8 without a repeat in any row, column or 3 by 3 box, shape (9, 9).

    With ``diagonals`` neither of the two long diagonals repeats a number. Row 0 is the lowest. The grid is found
    by filling always the place with the fewest numbers left, in an order of numbers drawn from the seed, and going
    back where none is left; the same seed gives the same grid.

    Raises
    ------
    ValueError
        If the seed is no whole number from 0 on.
    """
    check_seed(seed)
    draws = np.random.Generator(np.random.Philox(seed))
    orders = np.array([draws.permutation(SIZE) for _ in range(SIZE * SIZE)])
    ties = draws.permutation(SIZE * SIZE)
    groups = _groups(diagonals=diagonals)
    of_place = [[number for number, group in enumerate(groups) if place in group] for place in range(SIZE * SIZE)]
    used = [0] * len(groups)
    filled: dict[int, int] = {}

    def fill() -> bool:
        if len(filled) == SIZE * SIZE:
            return True
        place, left = _narrowest(filled, of_place, used, ties)
        for number in orders[place]:
            bit = 1 << int(number)
            if not left & bit:
                continue
            filled[place] = int(number)
            for group in of_place[place]:
                used[group] |= bit
            if fill():
                return True
            del filled[place]
            for group in of_place[place]:
                used[group] &= ~bit
        return False

    fill()
    return np.array([filled[place] for place in range(SIZE * SIZE)], dtype=np.int64).reshape(SIZE, SIZE)


def _narrowest(
    filled: dict[int, int], of_place: list[list[int]], used: list[int], ties: IntArray
) -> tuple[int, int]:
    """Return the open place with the fewest numbers left, and these as bits; the first of ``ties`` if equal."""
    best, best_left, fewest = -1, 0, SIZE + 1
    for place in ties.tolist():
        if place in filled:
            continue
        taken = 0
        for group in of_place[place]:
            taken |= used[group]
        left = _ALL & ~taken
        count = left.bit_count()
        if count < fewest:
            best, best_left, fewest = place, left, count
            if count <= 1:
                break
    return best, best_left


def _groups(*, diagonals: bool) -> list[set[int]]:
    """Return the places that may not share a number: rows, columns, boxes, and the two diagonals if asked."""
    places = np.arange(SIZE * SIZE).reshape(SIZE, SIZE)
    groups = [set(row.tolist()) for row in (*places, *places.T)]
    groups += [
        set(places[row : row + _BOX, column : column + _BOX].ravel().tolist())
        for row in range(0, SIZE, _BOX)
        for column in range(0, SIZE, _BOX)
    ]
    if diagonals:
        groups += [set(np.diagonal(places).tolist()), set(np.diagonal(places[:, ::-1]).tolist())]
    return groups
