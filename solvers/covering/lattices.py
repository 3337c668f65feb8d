"""Lattices as first choices: where slots lie on a grid, the best regular pattern is a start that is hard to beat.

A search that begins from nothing on a large floor finds patches of good patterns with faults between them; one
that begins from the best lattice only has to mend its edges. A lattice of index N takes one of N grid places;
there are as many as N has divisors, summed (Cassels, "An Introduction to the Geometry of Numbers", 1959: Hermite
normal form).
"""

from collections.abc import Iterator
from typing import Final

import numpy as np

from layoutopt.identity import BoolArray, IntArray
from solvers.covering.problem import CoverProblem

_SAMPLE: Final = 400
"""Rows on which lattices are compared."""
_GROWTH: Final = 1.03
"""Indices are tried one by one at first, then every so much larger one."""
_MOST_INDEX: Final = 2000
_MENDING: Final = 3.0
"""A slot that mends a gap in a lattice serves about a third of the rows that it could serve."""
_HOPELESS: Final = 0.5
"""With more of the rows unmet at the best lattice of an index, larger ones are not tried."""


def lattice_starts(problem: CoverProblem, places: IntArray, *, most: int) -> list[BoolArray]:
    """Return up to ``most`` choices of slots that form lattices, the most promising first.

    They may leave rows unmet, near the edges above all, and break no rule between slots.

    Parameters
    ----------
    places
        Column and row of each slot on its grid, shape (slots, 2); not every place of the grid needs a slot.
    """
    if not (problem.slot_count and problem.row_count):
        return []
    # Evenly spaced rows would meet a lattice at the same few places again and again.
    draws = np.random.Generator(np.random.Philox(0))
    rows = np.sort(draws.choice(problem.row_count, min(_SAMPLE, problem.row_count), replace=False))
    sample, demand = problem.sees.of_rows(rows), problem.demand[rows]
    served = max(np.diff(problem.sees.turned().start).mean(), 1.0)
    found: list[tuple[float, int, tuple[int, int, int], int]] = []
    for index in _indices(problem.slot_count):
        least_unmet = 1.0
        for basis in _bases(index):
            residue = _residue(places, basis)
            for offset in {0, index // 2}:
                chosen = residue == offset
                unmet = float((sample.counts(chosen) < demand).mean())
                least_unmet = min(least_unmet, unmet)
                mending = _MENDING * unmet * problem.row_count / served
                found.append((chosen.sum() + mending, index, basis, offset))
        if least_unmet > _HOPELESS:
            break
    found.sort()
    return _distinct(problem, places, [entry[1:3] for entry in found[: 4 * most]], most)


def _distinct(
    problem: CoverProblem, places: IntArray, ranked: list[tuple[int, tuple[int, int, int]]], most: int
) -> list[BoolArray]:
    """Return the best place of each of the best lattices, by what is unmet on all rows."""
    starts: list[BoolArray] = []
    for index, basis in dict.fromkeys(ranked):
        residue = _residue(places, basis)
        candidates = [residue == offset for offset in range(0, index, max(index // 24, 1))]
        allowed = [chosen for chosen in candidates if not problem.broken_rules(chosen)]
        if allowed:
            starts.append(min(allowed, key=lambda chosen: int(chosen.sum()) + len(problem.unmet(chosen))))
        if len(starts) == most:
            break
    return starts


def _indices(slot_count: int) -> Iterator[int]:
    """Yield the indices to try, rising."""
    index = 1
    while index <= min(slot_count, _MOST_INDEX):
        yield index
        index = max(index + 1, int(index * _GROWTH))


def _bases(index: int) -> Iterator[tuple[int, int, int]]:
    """Yield the lattices of an index in Hermite normal form (a, b, d): vectors (a, 0) and (b, d) with a d = index.

    Long thin ones are left out: their rows of slots would touch and leave wide gaps between.
    """
    for rise in range(1, index + 1):
        if index % rise:
            continue
        width = index // rise
        for shift in range(width):
            shortest = min(
                np.hypot(i * width + j * shift, j * rise)
                for i in range(-3, 4)
                for j in range(3)
                if (i, j) != (0, 0)
            )
            if shortest >= 0.5 * np.sqrt(index):
                yield width, shift, rise


def _residue(places: IntArray, basis: tuple[int, int, int]) -> IntArray:
    """Return the class of each place modulo the lattice, 0 to index - 1."""
    width, shift, rise = basis
    up, rest = np.divmod(places[:, 1], rise)
    return np.asarray((places[:, 0] - up * shift) % width * rise + rest, dtype=np.int64)
