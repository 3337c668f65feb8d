"""Several near-optimal layouts that truly differ: every two at least a stated difference apart.

Near-optimal is what is shown to be within a stated tolerance of the best, not what happens to look so. Of those
the portfolio takes as many as are asked for and can be had, and among all such choices the one with the least sum
of the goal. Greedy choice (the best first, then always the best that keeps the difference) need not find as many
nor as good ones; an integer program does, with proof (a stable set of least weight, solved by HiGHS).
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from layoutopt.identity import FloatArray, IntArray
from layoutopt.layout import Layout
from layoutopt.scores import Score
from solvers.layout_difference import difference_matrix

CONFIDENCE: Final = 0.95
"""One-sided confidence at which a layout is shown to be within the tolerance."""
_NODES: Final = 20_000
"""A limit on the branches of an integer program, not on time, so that the answer does not depend on the
machine."""
_ROUNDING: Final = 1e-9
"""Differences are sums of rounded numbers; one that is equal to the least one but for that keeps it."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Portfolio:
    """Layouts that are near-optimal and differ, as row numbers of the candidates.

    Attributes
    ----------
    chosen
        The best, then the others by rising goal.
    near
        How many candidates are near-optimal, the best among them.
    proven
        Whether it is proven that no other choice has more layouts, or as many with a smaller sum of the goal.
    shortfall
        Why there are fewer than asked for, in words; empty if there are not.
    """

    chosen: tuple[int, ...]
    near: int
    proven: bool
    shortfall: str


def portfolio(
    candidates: Sequence[Layout],
    scores: Sequence[Score],
    *,
    count: int,
    minimum_difference: float,
    tolerance: float,
    best: int | None = None,
    excess: Callable[[int], Score] | None = None,
) -> Portfolio:
    """Return up to ``count`` near-optimal layouts, every two at least ``minimum_difference`` apart.

    Parameters
    ----------
    scores
        The goal of each candidate, smaller is better.
    minimum_difference
        Of `solvers.layout_difference`, from 0 to 1.
    tolerance
        Near-optimal is a goal of at most 1 + tolerance times that of the best, shown at `CONFIDENCE`.
    best
        Row that the portfolio starts from and is measured by; without it the one with the least goal.
    excess
        Gives for a row its goal less 1 + tolerance times that of the best, paired over common replications.
        Without it the scores are taken for independent.

    Raises
    ------
    ValueError
        If there is no candidate, none has a known goal, or a number lies outside its range.
    """
    if not candidates or len(candidates) != len(scores):
        raise ValueError(f"{len(candidates)} candidates with {len(scores)} scores make no portfolio")
    if count < 1 or not 0.0 <= minimum_difference <= 1.0 or not tolerance >= 0.0:
        raise ValueError(
            f"a portfolio needs a count of 1 or more, a difference from 0 to 1 and a tolerance of 0 or more, not "
            f"{count}, {minimum_difference:g} and {tolerance:g}"
        )
    values = np.array([score.value for score in scores])
    if best is None and np.isnan(values).all():
        raise ValueError("no candidate has a known goal, so none is the best; name the row to start from")
    first = int(np.nanargmin(values)) if best is None else best
    measure = excess if excess is not None else lambda row: _independent(scores[row], scores[first], tolerance)
    near = [row for row in range(len(scores)) if row == first or measure(row).upper(CONFIDENCE) <= 0.0]
    differences = difference_matrix([candidates[row] for row in near])
    picked, proven = far_apart(
        values[near], differences, count=count, minimum_difference=minimum_difference, first=near.index(first)
    )
    return Portfolio(
        chosen=tuple(near[row] for row in picked),
        near=len(near),
        proven=proven,
        shortfall=_shortfall(len(picked), count, len(near), len(scores), minimum_difference, tolerance, proven),
    )


def greedily_far_apart(
    values: FloatArray, differences: FloatArray, *, count: int, minimum_difference: float, first: int
) -> list[int]:
    """Return ``first`` and then always the best row that keeps the difference to all chosen ones."""
    chosen = [first]
    for row in np.argsort(values, kind="stable").tolist():
        if len(chosen) == count:
            break
        if row != first and (differences[row, chosen] >= minimum_difference - _ROUNDING).all():
            chosen.append(row)
    return chosen


def far_apart(
    values: FloatArray, differences: FloatArray, *, count: int, minimum_difference: float, first: int
) -> tuple[list[int], bool]:
    """Return ``first`` and as many other rows as possible, and whether it is proven that none are better.

    Every two keep the difference, and there are up to ``count`` in all. Of all choices of that number it is one
    with the least sum of values; the others come by rising value.
    """
    greedy = greedily_far_apart(
        values, differences, count=count, minimum_difference=minimum_difference, first=first
    )
    free = np.flatnonzero(differences[first] >= minimum_difference - _ROUNDING)
    free = free[free != first]
    too_close = differences[np.ix_(free, free)] < minimum_difference - _ROUNDING
    close = np.argwhere(np.triu(too_close, k=1)).astype(np.int64)
    # Where no two are too close the best are the answer, and so is the best of all for a single place.
    if not len(close) or count <= 2:
        return greedy, True
    most, proven = len(greedy) - 1, True
    if most < count - 1:
        rows, proven = _solved(-np.ones(len(free)), close, most=count - 1, least=most)
        most = max(most, len(rows))
    # Shifted and scaled, which changes no choice of a given number, so that the solver's tolerances fit.
    spread = float(np.ptp(values[free])) or 1.0
    rows, least_sum = _solved((values[free] - values[free].min()) / spread, close, most=most, least=most)
    choices = [greedy[1:], [int(free[row]) for row in rows]]
    found = min(choices, key=lambda chosen: (-len(chosen), float(values[chosen].sum())))
    return [first, *sorted(found, key=lambda row: (values[row], row))], proven and least_sum


def _solved(weights: FloatArray, close: IntArray, *, most: int, least: int) -> tuple[list[int], bool]:
    """Return the rows of least weight of which no two are close, if any are found, and whether that is proven."""
    # Imported here: it costs more than all the rest of a short command.
    from scipy.optimize import Bounds, LinearConstraint, milp
    from scipy.sparse import coo_array

    number = len(weights)
    pairs = np.repeat(np.arange(len(close)), 2)
    apart = coo_array((np.ones(2 * len(close)), (pairs, close.ravel())), shape=(len(close), number))
    found = milp(
        weights,
        integrality=np.ones(number, dtype=np.int64),
        bounds=Bounds(0.0, 1.0),
        constraints=[
            LinearConstraint(apart.tocsr(), ub=1.0),
            LinearConstraint(np.ones((1, number)), lb=float(least), ub=float(most)),
        ],
        options={"node_limit": _NODES, "mip_rel_gap": 0.0},
    )
    taken = np.zeros(number, dtype=np.bool_) if found.x is None else np.round(found.x) > 0.5
    # What a solver claims counts only if the rows themselves agree.
    if taken[close].all(axis=1).any() or not least <= taken.sum() <= most:
        return [], False
    return np.flatnonzero(taken).tolist(), found.status == 0


def _independent(score: Score, best: Score, tolerance: float) -> Score:
    """Return by how much a score passes the tolerance, both taken for independent."""
    counts = [item.count for item in (score, best) if not item.exact]
    return Score(
        value=score.value - (1.0 + tolerance) * best.value,
        unit=score.unit,
        standard_error=float(np.hypot(score.standard_error, (1.0 + tolerance) * best.standard_error)),
        count=min(counts, default=0),
    )


def _shortfall(
    found: int, count: int, near: int, candidates: int, difference: float, tolerance: float, proven: bool
) -> str:
    if found >= count:
        return ""
    counted = f"of {candidates} layouts {near} {'is' if near == 1 else 'are'}"
    within = f"{counted} shown to be within {100.0 * tolerance:.3g} %"
    if found == near:
        return f"{found} instead of {count}: {within} of the best"
    more = "no more than" if proven else "by a search that did not finish"
    return f"{found} instead of {count}: {within} of the best, and {more} {found} of them differ by {difference:g}"
