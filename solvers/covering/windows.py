"""Window by window: a small part of a cover is set free and solved exactly while the rest stands still."""

from collections.abc import Callable
from typing import Final

import numpy as np

from layoutopt.identity import BoolArray, IntArray
from solvers.covering.integer import cheapest_cover
from solvers.covering.problem import CoverProblem, Incidence
from solvers.covering.reduction import part_of

_NODES: Final = 200
"""Branch and bound ends here: a window that takes more is no cheap one."""


def windows_solved(
    problem: CoverProblem,
    chosen: BoolArray,
    *,
    slots: int,
    rounds: int,
    stop: Callable[[], bool] = lambda: False,
) -> BoolArray:
    """Return a cover that no window makes cheaper, or the last one after so many rounds over all windows.

    Parameters
    ----------
    chosen
        A cover that breaks no rule.
    slots
        Size of a window: the slots nearest to a chosen one, by rows that see both.
    """
    turned = problem.sees.turned()
    chosen = chosen.copy()
    for _ in range(rounds):
        before = problem.cost_of(chosen)
        visited = np.zeros(problem.slot_count, dtype=np.bool_)
        for seed in np.flatnonzero(chosen):
            if visited[seed] or not chosen[seed]:
                continue
            if stop():
                return chosen
            window = _window(problem.sees, turned, int(seed), slots)
            # Its inner half counts as done; the rest is tried again from another side.
            visited[window[: max(len(window) // 2, 1)]] = True
            better = _solved(problem, turned, chosen, np.sort(window))
            if better is not None:
                chosen = better
        if problem.cost_of(chosen) == before:
            break
    return chosen


def _window(sees: Incidence, turned: Incidence, seed: int, size: int) -> IntArray:
    """Return up to ``size`` slots round one, nearest first: those that share a row with it, then with these."""
    found, known = [seed], {seed}
    for slot in found:
        if len(found) >= size:
            break
        rows = turned.slot[turned.start[slot] : turned.start[slot + 1]]
        for other in np.unique(sees.of_rows(rows).slot).tolist():
            if other not in known:
                known.add(other)
                found.append(other)
    return np.array(found[:size], dtype=np.int64)


def _solved(problem: CoverProblem, turned: Incidence, chosen: BoolArray, window: IntArray) -> BoolArray | None:
    """Return a cheaper cover that differs in the window alone, or ``None``."""
    fixed = chosen.copy()
    fixed[window] = False
    free = window
    if len(problem.conflicts):
        one, other = np.concatenate([problem.conflicts, problem.conflicts[:, ::-1]]).T
        free = np.setdiff1d(window, one[fixed[other]])
    room = problem.capacity - np.bincount(
        problem.group[fixed & (problem.group >= 0)], minlength=len(problem.capacity)
    )
    rows = np.unique(turned.of_rows(window).slot)
    missing = problem.demand[rows] - problem.sees.of_rows(rows).counts(fixed)
    rows, missing = rows[missing > 0], missing[missing > 0]
    part = part_of(problem, rows, free, missing, room)
    answer = cheapest_cover(part, below=int(problem.cost[window[chosen[window]]].sum()), nodes=_NODES)
    if answer.chosen is None:
        return None
    fixed[free[answer.chosen]] = True
    return fixed
