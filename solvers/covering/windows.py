"""Window by window: a part of a cover is set free and solved anew while the rest stands still.

Small windows are solved exactly. Large ones are searched: on a large floor the weights of a search over the whole
grow in a few places while it takes slots away everywhere, and it never comes back to a cover as good as its start.
"""

from collections.abc import Callable
from typing import Final

import numpy as np

from layoutopt.identity import BoolArray, IntArray
from solvers.covering.integer import cheapest_cover
from solvers.covering.local_search import searched
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

    def exact(part: CoverProblem, present: BoolArray) -> BoolArray | None:
        return cheapest_cover(part, below=part.cost_of(present), nodes=_NODES).chosen

    return _rounds(problem, chosen, exact, slots=slots, rounds=rounds, stop=stop)


def windows_searched(
    problem: CoverProblem,
    chosen: BoolArray,
    *,
    slots: int,
    steps: int,
    seed: int,
    stop: Callable[[], bool] = lambda: False,
) -> BoolArray:
    """Return a cover that a local search in each window, one after another, left no dearer.

    Parameters as for `windows_solved`; ``steps`` and ``seed`` are those of the search in each window.
    """

    def search(part: CoverProblem, present: BoolArray) -> BoolArray | None:
        return searched(part, [present], steps=steps, seed=seed, stop=stop)

    return _rounds(problem, chosen, search, slots=slots, rounds=1, stop=stop)


def _rounds(
    problem: CoverProblem,
    chosen: BoolArray,
    solve: Callable[[CoverProblem, BoolArray], BoolArray | None],
    *,
    slots: int,
    rounds: int,
    stop: Callable[[], bool],
) -> BoolArray:
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
            chosen = _renewed(problem, turned, chosen, np.sort(window), solve)
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


def _renewed(
    problem: CoverProblem,
    turned: Incidence,
    chosen: BoolArray,
    window: IntArray,
    solve: Callable[[CoverProblem, BoolArray], BoolArray | None],
) -> BoolArray:
    """Return a cover that differs in the window alone and is no dearer."""
    fixed = chosen.copy()
    fixed[window] = False
    room = problem.capacity - np.bincount(
        problem.group[fixed & (problem.group >= 0)], minlength=len(problem.capacity)
    )
    usable = (problem.group[window] < 0) | (np.append(room, 0)[problem.group[window]] > 0)
    if len(problem.conflicts):
        one, other = np.concatenate([problem.conflicts, problem.conflicts[:, ::-1]]).T
        usable &= ~np.isin(window, one[fixed[other]])
    free = window[usable]
    rows = np.unique(turned.of_rows(window).slot)
    missing = problem.demand[rows] - problem.sees.of_rows(rows).counts(fixed)
    rows, missing = rows[missing > 0], missing[missing > 0]
    part = part_of(problem, rows, free, missing, room)
    found = solve(part, chosen[free])
    if found is None or part.cost_of(found) > part.cost_of(chosen[free]):
        return chosen
    fixed[free[found]] = True
    return fixed
