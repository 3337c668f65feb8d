"""Surplus cuts: rows that lie near each other cannot all see just as many chosen slots as they demand.

Where slots serve their rows like discs that leave no gap, discs overlap. A linear relaxation knows nothing of
that: parts of slots fit together without any overlap. So a few rows that are near each other, a window, are asked
how much they must see beyond their demands, whatever is chosen; a search through all choices answers in whole
numbers. Summed over a window, the slots seen are then at least the demands and that surplus. Windows that look
alike, as nearly all of a grid do, are asked once. Such a cut is a sum of rows whose right side is lifted as far as
it goes (Nemhauser and Wolsey, "Integer and Combinatorial Optimization", 1988, II.1).
"""

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from layoutopt.identity import IntArray
from solvers.covering.problem import CoverProblem, Incidence

_SPACING: Final = 5
"""One row in so many is the middle of a window; on grids more windows gained nothing."""
_WINDOW_SIZE: Final = 1.45
"""Rows in a window, as a multiple of those that share a slot with its middle. On grids that makes 97 cells, which
must see 4 too many; 69 cells, those that share a slot, need not see more than 1."""
_WINDOW_NODES: Final = 30_000
"""Partial choices that are looked at in one window before its surplus is left at what is proven."""
_BATCH: Final = 100
"""Windows that are laid out at a time."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SurplusCuts:
    """Inequalities that every cover keeps: weight times chosen slot, summed over ``slots``, is at least ``least``.

    Attributes
    ----------
    slots
        Slots of each cut, as a table with one row for each.
    weight
        How many rows of the window see the slot, shape (entries,).
    least
        Demands of the window and its surplus together, shape (cuts,).
    """

    slots: Incidence
    weight: IntArray
    least: IntArray


def surplus_cuts(
    problem: CoverProblem, *, most_rows: int, nodes: int, stop: Callable[[], bool] = lambda: False
) -> SurplusCuts:
    """Return the cuts of windows all over a problem, those left out that say no more than their rows do.

    Parameters
    ----------
    most_rows
        Most rows in a window; there are no cuts where it would take more to hold several slots beside each other.
    nodes
        Partial choices that are looked at altogether; windows whose turn does not come have no cut.
    """
    known: dict[tuple[bytes, bytes, bytes], int] = {}
    found: list[tuple[IntArray, IntArray, int]] = []
    for rows in _windows(problem, most_rows):
        if nodes <= 0 or stop():
            break
        table = problem.sees.of_rows(rows)
        slots, slot = np.unique(table.slot, return_inverse=True)
        part = Incidence(start=table.start, slot=slot.astype(np.int64), slot_count=len(slots))
        demand = problem.demand[rows]
        name = (part.start.tobytes(), part.slot.tobytes(), demand.tobytes())
        if name not in known:
            known[name], used = least_surplus(part, demand, nodes=min(nodes, _WINDOW_NODES))
            nodes -= used
        if known[name]:
            weight = np.bincount(part.slot, minlength=len(slots)).astype(np.int64)
            found.append((slots, weight, int(demand.sum()) + known[name]))
    lengths = [len(slots) for slots, _, _ in found]
    none = np.empty(0, dtype=np.int64)
    return SurplusCuts(
        slots=Incidence(
            start=np.concatenate([[0], np.cumsum(lengths)]).astype(np.int64),
            slot=np.concatenate([none, *(slots for slots, _, _ in found)]),
            slot_count=problem.slot_count,
        ),
        weight=np.concatenate([none, *(weight for _, weight, _ in found)]),
        least=np.array([least for _, _, least in found], dtype=np.int64),
    )


def least_surplus(table: Incidence, demand: IntArray, *, nodes: int) -> tuple[int, int]:
    """Return a surplus that is proven for the rows of a table, and how many partial choices were looked at.

    The surplus of a choice that meets every row is how often rows see a chosen slot beyond their demand, summed.
    Where the nodes suffice, what is proven is the least there is.
    """
    from solvers.covering.surplus_kernels import NO, meets_within

    turned = table.turned()
    proven, left = 0, nodes
    # No choice wastes more than all slots together do.
    most = len(table.slot) - int(demand.sum())
    while proven < most:
        verdict, left = meets_within(table.start, table.slot, turned.start, turned.slot, demand, proven, left)
        if verdict != NO:
            break
        proven += 1
    return proven, nodes - left


def plain_least_surplus(table: Incidence, demand: IntArray) -> int:
    """Return the least surplus by trying every choice, for a table of few slots: the truth of `least_surplus`.

    Raises
    ------
    ValueError
        If no choice meets every row.
    """
    choices = (np.arange(2**table.slot_count)[:, None] >> np.arange(table.slot_count)) % 2 == 1
    over = [table.counts(chosen) - demand for chosen in choices]
    return min(int(one.sum()) for one in over if (one >= 0).all())


def _windows(problem: CoverProblem, most_rows: int) -> Iterator[IntArray]:
    """Yield the rows of each window, ascending: those nearest to one row, by slots shared with it and with these.

    Rows that are equally near go in together or not at all, so that windows of regular problems look alike. There
    are none if they would be too large.
    """
    from scipy.sparse import csr_array

    sees = problem.sees
    shape = (sees.row_count, sees.slot_count)
    matrix: Any = csr_array((np.ones(len(sees.slot), dtype=np.int32), sees.slot, sees.start), shape=shape)
    turned = matrix.T.tocsr()
    # In any order but that of the rows: where the nodes do not last, windows lie all over the problem.
    middles = np.random.Generator(np.random.Philox(0)).permutation(np.arange(0, sees.row_count, _SPACING))
    size = 0
    for begin in range(0, len(middles), _BATCH):
        beside = matrix[middles[begin : begin + _BATCH]] @ turned
        size = size or int(_WINDOW_SIZE * np.median(np.diff(beside.indptr)))
        if size > most_rows:
            return
        near = (beside @ matrix @ turned).tocsr()
        for place in range(near.shape[0]):
            rows = near.indices[near.indptr[place] : near.indptr[place + 1]]
            shared = near.data[near.indptr[place] : near.indptr[place + 1]]
            if len(rows) > size:
                rows = rows[shared > np.sort(shared)[-size - 1]]
            if len(rows) > 1:
                yield np.sort(rows).astype(np.int64)
