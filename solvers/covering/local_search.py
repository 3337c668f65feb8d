"""Local search for covers: drop the slot that is missed least, serve an unmet row, let unmet rows grow in weight.

The search walks through choices that are one slot too poor to be covers. Rows that stay unmet gain weight until
somebody serves them, which drives the walk out of every valley. A slot that went does not come back before
something near it changed, and the slot that came last does not go next. That is the row weighting local search
of Gao, Weise and Li, "An efficient local search heuristic with row weighting for the unicost set covering
problem", European Journal of Operational Research 246 (2015); demands above one, costs, a budget, slots that
exclude each other and groups with a capacity are added to it here.
"""

from collections.abc import Callable, Iterable
from typing import TYPE_CHECKING, Final

import numpy as np

from layoutopt.identity import BoolArray, IntArray
from solvers.covering.plain_search import NO_BUDGET
from solvers.covering.problem import CoverProblem

if TYPE_CHECKING:
    from solvers.covering.local_search_kernels import SearchState, Table

_CHUNK: Final = 10_000
"""Steps between two looks at the clock."""
_WORTH_SCALES: Final = (10, 1000)
"""With a budget, so many steps double the weight of a row; on six grids neither walk was the better one on all."""


def searched(
    problem: CoverProblem,
    starts: Iterable[BoolArray],
    *,
    steps: int,
    seed: int,
    budget: int | None = None,
    enough: int | None = None,
    stop: Callable[[], bool] = lambda: False,
) -> BoolArray | None:
    """Return the best choice found, or ``None`` if no cover was found.

    Parameters
    ----------
    starts
        Choices to start from, besides the greedy one; they may leave rows unmet but break no rule. The best of
        them, after it was filled up, is the start.
    steps
        Length of the walk; the same seed and steps give the same choice.
    budget
        If given, rows need not all be met: the choice costs no more, and its met rows are worth most.
    enough
        A cost, or with a budget a worth, that is known to be the best possible: the walk ends there.
    stop
        Asked now and then whether to end early.

    Raises
    ------
    ValueError
        If slots are locked, forbidden or in a group without room (`reduction.reduced` takes them out), a start
        breaks a rule, or the budget is below zero.
    """
    from solvers.covering import local_search_kernels as kernels

    full = problem.capacity[problem.group[problem.group >= 0]] == 0
    if problem.locked.any() or problem.forbidden.any() or full.any():
        raise ValueError("slots that are locked, forbidden or without room must be taken out before the search")
    if budget is not None and budget < 0:
        raise ValueError(f"a budget is zero or more, got {budget}")
    table = table_of(problem)
    limit = NO_BUDGET if budget is None else budget
    begun = []
    for start in (np.zeros(problem.slot_count, dtype=np.bool_), *starts):
        if problem.broken_rules(start):
            raise ValueError(f"a start breaks a rule: {problem.broken_rules(start)[0]}")
        if budget is not None and problem.cost_of(start) > budget:
            continue
        state = state_of(table, start, weight=problem.worth if budget is not None else None)
        kernels.fill(table, state, limit)
        begun.append(state)

    def rank(state: "SearchState") -> tuple[int, int]:
        numbers = state.numbers
        missing = numbers[kernels.UNMET] if budget is None else -numbers[kernels.WORTH]
        return int(missing), int(numbers[kernels.COST])

    first = min(begun, key=rank)
    walks = [first]
    if budget is not None:
        walks = [state_of(table, first.chosen, weight=problem.worth * scale) for scale in _WORTH_SCALES]
    draws = np.random.Generator(np.random.Philox(seed))
    for state in walks:
        kernels.keep_better(state, limit)
        for begin in range(0, steps // len(walks), _CHUNK):
            if enough is not None and _reached(state.numbers, enough, budget):
                break
            count = min(_CHUNK, steps // len(walks) - begin)
            kernels.search(table, state, limit, draws.integers(0, 2**31, count))
            if stop():
                break
    best = max(walks, key=lambda state: int(state.numbers[kernels.BEST_WORTH]))
    return best.best.copy() if best.numbers[kernels.BEST_COST] <= problem.cost.sum() else None


def _reached(numbers: IntArray, enough: int, budget: int | None) -> bool:
    from solvers.covering import local_search_kernels as kernels

    if budget is None:
        return bool(numbers[kernels.BEST_COST] <= enough)
    return bool(numbers[kernels.BEST_WORTH] >= enough)


def table_of(problem: CoverProblem) -> "Table":
    """Return the problem in the columns that the kernels take."""
    from solvers.covering import local_search_kernels as kernels

    turned = problem.sees.turned()
    pairs = np.concatenate([problem.conflicts, problem.conflicts[:, ::-1]])
    pairs = np.unique(pairs, axis=0)
    start = np.concatenate([[0], np.cumsum(np.bincount(pairs[:, 0], minlength=problem.slot_count))])
    columns = (
        problem.sees.start,
        problem.sees.slot,
        turned.start,
        turned.slot,
        problem.demand,
        problem.cost,
        problem.worth,
        start,
        pairs[:, 1],
        problem.group,
        problem.capacity,
    )
    return kernels.Table(*(np.array(column, dtype=np.int64) for column in columns))


def state_of(table: "Table", start: BoolArray, weight: IntArray | None = None) -> "SearchState":
    """Return the state of a search that begins with a choice; rows weigh one each unless said otherwise."""
    from solvers.covering import local_search_kernels as kernels

    slots, rows = len(table.cost), len(table.demand)
    weights = np.ones(rows, dtype=np.int64) if weight is None else np.array(weight, dtype=np.int64)
    row_of_entry = np.repeat(np.arange(rows), np.diff(table.row_start))
    state = kernels.SearchState(
        chosen=np.zeros(slots, dtype=np.bool_),
        best=np.zeros(slots, dtype=np.bool_),
        seen=np.zeros(rows, dtype=np.int64),
        weight=weights,
        score=np.bincount(
            table.row_slot, weights=(weights * (table.demand > 0))[row_of_entry], minlength=slots
        ).astype(np.int64),
        stamp=np.zeros(slots, dtype=np.int64),
        changed=np.ones(slots, dtype=np.bool_),
        load=np.zeros(len(table.capacity), dtype=np.int64),
        chosen_list=np.zeros(slots, dtype=np.int64),
        chosen_place=np.zeros(slots, dtype=np.int64),
        unmet_list=np.zeros(rows, dtype=np.int64),
        unmet_place=np.zeros(rows, dtype=np.int64),
        numbers=np.zeros(kernels.NUMBERS, dtype=np.int64),
    )
    unmet = np.flatnonzero(table.demand > 0)
    state.unmet_list[: len(unmet)] = unmet
    state.unmet_place[unmet] = np.arange(len(unmet))
    numbers = state.numbers
    numbers[kernels.UNMET] = len(unmet)
    numbers[kernels.WORTH] = table.worth[table.demand == 0].sum()
    numbers[kernels.TABU], numbers[kernels.BEST_WORTH] = -1, -1
    numbers[kernels.BEST_COST] = table.cost.sum() + 1
    for slot in np.flatnonzero(start).tolist():
        kernels.add(table, state, slot)
    return state
