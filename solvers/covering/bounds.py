"""Lagrangian bounds: what no cover can be cheaper than, whatever found it.

Any price of zero or more on every row gives a bound that anybody can check by one sum; the search for good
prices is subgradient ascent with a deflected direction, which comes as near to the linear relaxation as one
waits. References: Held, Wolfe and Crowder, "Validation of subgradient optimization", Mathematical Programming 6
(1974); Camerini, Fratta and Maffioli, "On improving relaxation methods by modified gradient techniques",
Mathematical Programming Study 3 (1975); Beasley, "A Lagrangian heuristic for set-covering problems", Naval
Research Logistics 37 (1990).
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np

from layoutopt.identity import FloatArray
from solvers.covering.problem import CoverProblem

_FIRST_STEP: Final = 0.1
_LAST_STEP: Final = 0.001
"""Length of the first and last step, as shares of the step of Held, Wolfe and Crowder; tried on k x k grids."""
DEFLECTION: Final = 0.1
"""Share of the new subgradient in the direction; the rest is what the direction was."""
_CHUNK: Final = 200
"""Iterations between two looks at the clock."""
_ROUNDING: Final = 1e-9
"""By this share a sum of prices may be wrong; a bound is lowered by it before it is rounded up."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Prices:
    """Prices of rows, shape (rows,), and the bound that they prove: a sum, and the whole number that follows."""

    price: FloatArray
    value: float
    bound: int


def cost_bound(
    problem: CoverProblem,
    *,
    incumbent: int,
    iterations: int,
    stop: Callable[[], bool] = lambda: False,
) -> Prices:
    """Return prices that prove that every cover costs at least ``bound``.

    ``incumbent`` is the cost of a cover, which sets the length of steps. Rules between slots are left out: they
    make covers dearer only.

    Raises
    ------
    ValueError
        If a row sees no slot at all.
    """
    from solvers.covering.bounds_kernels import ascend

    if not problem.row_count:
        return Prices(price=np.zeros(0), value=0.0, bound=0)
    if (np.diff(problem.sees.start) == 0).any():
        raise ValueError("a row that sees no slot makes every cover impossible")
    turned = problem.sees.turned()
    # Every row pays its share of the slot that serves most rows; that breaks no slot's budget.
    relief = problem.cost / np.maximum(np.diff(turned.start), 1)
    price = np.minimum.reduceat(relief[problem.sees.slot], problem.sees.start[:-1])
    best, direction = price.copy(), np.zeros(problem.row_count)
    value = cost_value(problem, price)
    for begin in range(0, iterations, _CHUNK):
        value = ascend(
            problem.sees.start,
            problem.sees.slot,
            turned.start,
            turned.slot,
            problem.demand.astype(np.float64),
            problem.cost.astype(np.float64),
            price,
            direction,
            best,
            value,
            float(incumbent),
            _step(begin, iterations),
            _step(begin + 1, iterations) / _step(begin, iterations),
            min(_CHUNK, iterations - begin),
        )
        if stop() or rounded_up(problem, value) >= incumbent:
            break
    value = cost_value(problem, best)
    return Prices(price=best, value=value, bound=rounded_up(problem, value))


def cost_value(problem: CoverProblem, price: FloatArray) -> float:
    """Return what prices prove: the demand at these prices, less what slots that are worth it would save.

    For every cover x, the sum of price times demand is at most the sum over rows of price times chosen slots seen,
    and what a slot earns above its cost it earns at most once.

    Raises
    ------
    ValueError
        If a price is negative.
    """
    return float(price @ problem.demand + np.minimum(problem.cost - _earned(problem, price), 0.0).sum())


def worth_bound(
    problem: CoverProblem,
    budget: int,
    *,
    incumbent: int,
    iterations: int,
    stop: Callable[[], bool] = lambda: False,
) -> Prices:
    """Return prices that prove that no choice within a budget has met rows of more worth than ``bound``.

    Raises
    ------
    ValueError
        If a row sees no slot at all.
    """
    if (np.diff(problem.sees.start) == 0).any():
        raise ValueError("rows that see no slot must be left out")
    price = best = np.zeros(problem.row_count)
    value = float(problem.worth.sum())
    direction = np.zeros(problem.row_count)
    for number in range(iterations if problem.row_count else 0):
        present, taken = _kept_and_bought(problem, price, budget)
        if present < value:
            best, value = price, present
        seen = np.add.reduceat(taken[problem.sees.slot], problem.sees.start[:-1])
        slope = np.where(price * problem.demand < problem.worth, problem.demand, 0.0) - seen
        direction = slope if number == 0 else DEFLECTION * slope + (1.0 - DEFLECTION) * direction
        squared = float(direction @ direction)
        if squared == 0.0 or _rounded_down(value) <= incumbent or stop():
            break
        length = _step(number, iterations) * (present - incumbent) / squared
        price = np.maximum(price + length * direction, 0.0)
    value = worth_value(problem, best, budget)
    return Prices(price=best, value=value, bound=_rounded_down(value))


def worth_value(problem: CoverProblem, price: FloatArray, budget: int) -> float:
    """Return above which worth no choice within the budget comes, by prices of zero or more.

    A row that is met keeps its worth less its price for each demanded slot. Slots earn the prices of the rows that
    see them, and the budget buys those that earn most for their cost, the last of them in part (Dantzig, "Discrete
    variable extremum problems", Operations Research 5, 1957).

    Raises
    ------
    ValueError
        If a price is negative.
    """
    return _kept_and_bought(problem, price, budget)[0]


def _kept_and_bought(problem: CoverProblem, price: FloatArray, budget: int) -> tuple[float, FloatArray]:
    """Return the value of prices and which share of each slot the budget buys, dearest for their cost first."""
    earned = _earned(problem, price)
    order = np.argsort(-earned / problem.cost, kind="stable")
    cost = problem.cost[order]
    taken = np.empty(problem.slot_count)
    taken[order] = np.clip((budget - (np.cumsum(cost) - cost)) / cost, 0.0, 1.0)
    kept = np.maximum(problem.worth - price * problem.demand, 0.0)
    return float(kept.sum() + taken @ earned), taken


def _earned(problem: CoverProblem, price: FloatArray) -> FloatArray:
    """Return what each slot earns: the prices of the rows that see it."""
    if (price < 0.0).any():
        raise ValueError("a price below zero proves nothing")
    earned = np.bincount(problem.sees.slot, weights=price[problem.sees.row], minlength=problem.slot_count)
    return np.asarray(earned, dtype=np.float64)


def _step(number: int, iterations: int) -> float:
    return float(_FIRST_STEP * (_LAST_STEP / _FIRST_STEP) ** (number / iterations))


def _rounded_down(value: float) -> int:
    return math.floor(value * (1.0 + _ROUNDING) + _ROUNDING)


def rounded_up(problem: CoverProblem, value: float) -> int:
    """Return the least cost of any choice that is no less than ``value``: a multiple of what all costs share."""
    unit = int(np.gcd.reduce(problem.cost)) if len(problem.cost) else 1
    return math.ceil(value * (1.0 - _ROUNDING) / unit - _ROUNDING) * unit
