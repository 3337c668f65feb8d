"""A covering problem made smaller without changing its answers."""

from dataclasses import dataclass

import numpy as np

from layoutopt.identity import BoolArray, IntArray
from solvers.covering.problem import CoverProblem, Incidence, from_pairs
from solvers.covering.single_rows import unmeetable


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Reduced:
    """A problem without locked, forbidden and useless slots, and without rows that others imply.

    Attributes
    ----------
    problem
        What is left; nothing of it is locked or forbidden.
    slots
        For each of its slots the slot of the given problem, shape (slots,).
    rows
        The same for rows.
    lost
        Rows of the given problem that no choice can meet, because too few slots that see them are left or these
        exclude each other; they are not among the rows of ``problem``.
    worth_met
        What the rows are worth that locked slots meet already.
    """

    problem: CoverProblem
    slots: IntArray
    rows: IntArray
    lost: IntArray
    worth_met: int
    given: CoverProblem

    def whole(self, chosen: BoolArray) -> BoolArray:
        """Return a choice of the given problem from one of this."""
        found = self.given.locked.copy()
        found[self.slots[chosen]] = True
        return found

    def part(self, chosen: BoolArray) -> BoolArray:
        """Return a choice of this problem from one of the given."""
        return np.asarray(chosen[self.slots])


def reduced(problem: CoverProblem, *, every_row: bool) -> Reduced:
    """Return the problem without what decides nothing.

    Locked slots are taken out and what they give is taken off the demands; so are slots that are forbidden,
    exclude a locked one, or have no room left in their group. Rows with the same slots become one with the
    greatest demand.

    Parameters
    ----------
    every_row
        Whether all rows must be met. Then a row goes whose slots contain those of another row that demands as
        much. Else only rows of the same slots and demand become one, with their worths added.
    """
    room = problem.capacity - np.bincount(
        problem.group[problem.locked & (problem.group >= 0)], minlength=len(problem.capacity)
    )
    usable = ~(problem.locked | problem.forbidden)
    if len(problem.conflicts):
        for one, other in (problem.conflicts.T, problem.conflicts[:, ::-1].T):
            usable[one[problem.locked[other]]] = False
    grouped = problem.group >= 0
    usable[grouped] &= room[problem.group[grouped]] > 0
    demand = np.maximum(problem.demand - problem.sees.counts(problem.locked), 0)
    met = demand == 0
    enough = ~unmeetable(problem, usable, demand, room)
    rows = np.flatnonzero(~met & enough)
    usable &= np.bincount(problem.sees.of_rows(rows).slot, minlength=problem.slot_count) > 0
    slots = np.flatnonzero(usable)
    number = np.full(problem.slot_count, -1, dtype=np.int64)
    number[slots] = np.arange(len(slots))
    table = _of_slots(problem.sees.of_rows(rows), number, len(slots))
    kept, worth = _merged(table, demand[rows], problem.worth[rows], every_row=every_row)
    pairs = number[problem.conflicts].reshape(-1, 2)
    small = CoverProblem(
        sees=table.of_rows(kept),
        demand=demand[rows][kept],
        cost=problem.cost[slots],
        worth=worth,
        conflicts=pairs[(pairs >= 0).all(axis=1)],
        group=problem.group[slots],
        capacity=room,
    )
    return Reduced(
        problem=small,
        slots=slots,
        rows=rows[kept],
        lost=np.flatnonzero(~enough),
        worth_met=int(problem.worth[met].sum()),
        given=problem,
    )


def part_of(
    problem: CoverProblem, rows: IntArray, slots: IntArray, demand: IntArray, room: IntArray
) -> CoverProblem:
    """Return the problem of some rows and slots alone, with what rows still demand and groups have room for."""
    number = np.full(problem.slot_count, -1, dtype=np.int64)
    number[slots] = np.arange(len(slots))
    pairs = number[problem.conflicts].reshape(-1, 2)
    return CoverProblem(
        sees=_of_slots(problem.sees.of_rows(rows), number, len(slots)),
        demand=demand,
        cost=problem.cost[slots],
        worth=problem.worth[rows],
        conflicts=pairs[(pairs >= 0).all(axis=1)],
        group=problem.group[slots],
        capacity=room,
    )


def _of_slots(table: Incidence, number: IntArray, slot_count: int) -> Incidence:
    """Return the table with slots numbered anew; those of number -1 go."""
    slot = number[table.slot]
    kept = slot >= 0
    return from_pairs(table.row[kept], slot[kept], table.row_count, slot_count)


def _merged(table: Incidence, demand: IntArray, worth: IntArray, *, every_row: bool) -> tuple[IntArray, IntArray]:
    """Return the rows to keep, ascending, and what each is worth with those that it stands for."""
    from solvers.covering.reduction_kernels import implied

    names: dict[tuple[bytes, int], int] = {}
    alike = np.empty(table.row_count, dtype=np.int64)
    for row in range(table.row_count):
        slots = table.slot[table.start[row] : table.start[row + 1]].tobytes()
        alike[row] = names.setdefault((slots, 0 if every_row else int(demand[row])), len(names))
    # Of rows that are alike the one with the greatest demand comes first and stays.
    order = np.lexsort((np.arange(table.row_count), -demand, alike))
    first = order[np.flatnonzero(np.diff(alike[order], prepend=-1))]
    kept = np.sort(first)
    added = np.bincount(alike, weights=worth, minlength=len(names)).astype(np.int64)[alike[kept]]
    if every_row and len(kept):
        rows = table.of_rows(kept)
        slots_seen = rows.turned()
        stays = ~implied(rows.start, rows.slot, slots_seen.start, slots_seen.slot, demand[kept])
        kept, added = kept[stays], added[stays]
    return kept, added


def plain_implied(table: Incidence, demand: IntArray) -> BoolArray:
    """Return what `reduction_kernels.implied` does, by comparing every row with every other: its truth."""
    sets = [set(table.slot[table.start[row] : table.start[row + 1]].tolist()) for row in range(table.row_count)]
    return np.array(
        [
            any(one and one < own and demand[other] >= demand[row] for other, one in enumerate(sets))
            for row, own in enumerate(sets)
        ],
        dtype=np.bool_,
    )
