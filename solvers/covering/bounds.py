"""Lagrangian bounds: what no cover can be cheaper than, whatever found it.

Any price of zero or more on every row and cut gives a bound that anybody can check by one sum, here in whole
numbers; the search for good prices is subgradient ascent with a deflected direction, which comes as near to the
linear relaxation as one waits. References: Held, Wolfe and Crowder, "Validation of subgradient optimization",
Mathematical Programming 6 (1974); Camerini, Fratta and Maffioli, "On improving relaxation methods by modified
gradient techniques", Mathematical Programming Study 3 (1975); Beasley, "A Lagrangian heuristic for set-covering
problems", Naval Research Logistics 37 (1990).
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from fractions import Fraction
from typing import Final

import numpy as np

from layoutopt.identity import FloatArray, IntArray
from solvers.covering.problem import CoverProblem, Incidence
from solvers.covering.surplus import SurplusCuts

_FIRST_STEP: Final = 0.1
_LAST_STEP: Final = 0.001
"""Length of the first and last step, as shares of the step of Held, Wolfe and Crowder; tried on k x k grids."""
DEFLECTION: Final = 0.1
"""Share of the new subgradient in the direction; the rest is what the direction was."""
_CHUNK: Final = 200
"""Iterations between two looks at the clock."""
_WHOLE_BITS: Final = 52
"""Sums of whole numbers of so many bits are exact in float64, in any order."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Prices:
    """Prices of rows, then of cuts, and the bound that they prove: a sum, and the whole number that follows."""

    price: FloatArray
    value: float
    bound: int


def cost_bound(
    problem: CoverProblem,
    *,
    incumbent: int,
    iterations: int,
    cuts: SurplusCuts | None = None,
    stop: Callable[[], bool] = lambda: False,
) -> Prices:
    """Return prices that prove that every cover costs at least ``bound``.

    ``incumbent`` is the cost of a cover, which sets the length of steps. Rules between slots are left out: they
    make covers dearer only. Cuts bring the bound above the linear relaxation.

    Raises
    ------
    ValueError
        If a row sees no slot at all, or slots are locked.
    """
    from solvers.covering.bounds_kernels import ascend

    if not problem.row_count:
        return Prices(price=np.zeros(0), value=0.0, bound=0)
    if (np.diff(problem.sees.start) == 0).any():
        raise ValueError("a row that sees no slot makes every cover impossible")
    lines = _lines(problem, cuts)
    turned, order = lines.table.turned(), np.argsort(lines.table.slot, kind="stable")
    # Every row pays its share of the slot that serves most rows; that breaks no slot's budget.
    relief = problem.cost / np.maximum(np.bincount(problem.sees.slot, minlength=problem.slot_count), 1)
    price = np.zeros(lines.table.row_count)
    price[: problem.row_count] = np.minimum.reduceat(relief[problem.sees.slot], problem.sees.start[:-1])
    best, direction = price.copy(), np.zeros(len(price))
    value = cost_value(problem, price, cuts)
    # A step is to move all prices alike, so a cut is divided by its length in rows.
    squares = np.add.reduceat(lines.weight.astype(np.float64) ** 2, lines.table.start[:-1])
    length = np.sqrt(squares / squares[: problem.row_count].mean())
    length[: problem.row_count] = 1.0
    for begin in range(0, iterations, _CHUNK):
        value = ascend(
            turned.start,
            turned.slot,
            (lines.weight / length[lines.table.row])[order],
            lines.least / length,
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
    best /= length
    value = cost_value(problem, best, cuts)
    return Prices(price=best, value=value, bound=rounded_up(problem, value))


def cost_value(problem: CoverProblem, price: FloatArray, cuts: SurplusCuts | None = None) -> float:
    """Return what prices prove: the demand at these prices, less what slots that are worth it would save.

    For every cover x, the sum of price times demand is at most the sum over rows of price times chosen slots seen,
    and what a slot earns above its cost it earns at most once. Cuts are priced like rows, by their weights. Prices
    are rounded down to whole numbers of a power of two first, so that no sum is rounded.

    Raises
    ------
    ValueError
        If a price is negative or not finite, or slots are locked.
    """
    _check(problem, price)
    lines = _lines(problem, cuts)
    weights = np.bincount(lines.table.row, weights=lines.weight, minlength=len(price))
    grain = _grain(problem.cost.sum() + price @ (lines.least + weights))
    whole = np.floor(price / grain)
    earned = np.bincount(
        lines.table.slot, weights=lines.weight * whole[lines.table.row], minlength=problem.slot_count
    )
    return float((whole @ lines.least + np.minimum(np.floor(problem.cost / grain) - earned, 0.0).sum()) * grain)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Lines:
    """Rows and cuts in one table: weight times chosen slot, summed over a line, is at least ``least``."""

    table: Incidence
    weight: IntArray
    least: IntArray


def _lines(problem: CoverProblem, cuts: SurplusCuts | None) -> _Lines:
    sees, ones = problem.sees, np.ones(len(problem.sees.slot), dtype=np.int64)
    if cuts is None:
        return _Lines(table=sees, weight=ones, least=problem.demand)
    table = Incidence(
        start=np.concatenate([sees.start, sees.start[-1] + cuts.slots.start[1:]]),
        slot=np.concatenate([sees.slot, cuts.slots.slot]),
        slot_count=sees.slot_count,
    )
    return _Lines(
        table=table,
        weight=np.concatenate([ones, cuts.weight]),
        least=np.concatenate([problem.demand, cuts.least]),
    )


def _grain(largest: float) -> float:
    """Return a power of two of which float64 holds every whole number up to ``largest`` exactly."""
    return 2.0 ** (math.frexp(float(largest))[1] + 1 - _WHOLE_BITS)


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
        If a row sees no slot at all, or slots are locked.
    """
    if (np.diff(problem.sees.start) == 0).any():
        raise ValueError("rows that see no slot must be left out")
    price = best = np.zeros(problem.row_count)
    value = float(problem.worth.sum())
    direction = np.zeros(problem.row_count)
    for number in range(iterations if problem.row_count else 0):
        present, taken, _ = _kept_and_bought(problem, price, budget)
        if present < value:
            best, value = price, present
        seen = np.add.reduceat(taken[problem.sees.slot], problem.sees.start[:-1])
        slope = np.where(price * problem.demand < problem.worth, problem.demand, 0.0) - seen
        direction = slope if number == 0 else DEFLECTION * slope + (1.0 - DEFLECTION) * direction
        squared = float(direction @ direction)
        if squared == 0.0 or math.floor(value) <= incumbent or stop():
            break
        length = _step(number, iterations) * (present - incumbent) / squared
        price = np.maximum(price + length * direction, 0.0)
    value = worth_value(problem, best, budget)
    return Prices(price=best, value=value, bound=math.floor(value))


def worth_value(problem: CoverProblem, price: FloatArray, budget: int) -> float:
    """Return above which worth no choice within the budget comes, by prices of zero or more.

    A row that is met keeps its worth less its price for each demanded slot. Slots earn the prices of the rows that
    see them; money has a price too, and a slot keeps what it earns above its cost at that price. The best price of
    money is what the last slot earns for its cost when the budget buys those that earn most (Dantzig, "Discrete
    variable extremum problems", Operations Research 5, 1957). Sums are exact, as in `cost_value`.

    Raises
    ------
    ValueError
        If a price is negative or not finite, or slots are locked.
    """
    _check(problem, price)
    rate = _kept_and_bought(problem, price, budget)[2]
    cost, demand = problem.cost, problem.demand
    grain = _grain(
        problem.worth.sum()
        + price @ (demand + np.diff(problem.sees.start))
        + rate * (float(budget) + float(cost.sum()))
    )
    whole, money = np.floor(price / grain), math.floor(rate / grain)
    kept = np.maximum(np.ceil(problem.worth / grain) - whole * demand, 0.0).sum()
    saved = np.maximum(_earned(problem, whole) - money * cost.astype(np.float64), 0.0).sum()
    return float((kept + float(money) * budget + saved) * grain)


def _kept_and_bought(problem: CoverProblem, price: FloatArray, budget: int) -> tuple[float, FloatArray, float]:
    """Return the value of prices, which share of each slot the budget buys, and what money earns at the margin."""
    earned = _earned(problem, price)
    order = np.argsort(-earned / problem.cost, kind="stable")
    cost = problem.cost[order]
    taken = np.empty(problem.slot_count)
    taken[order] = np.clip((budget - (np.cumsum(cost) - cost)) / cost, 0.0, 1.0)
    kept = np.maximum(problem.worth - price * problem.demand, 0.0)
    rates = (earned / problem.cost)[taken < 1.0]
    return float(kept.sum() + taken @ earned), taken, float(rates.max(initial=0.0))


def _earned(problem: CoverProblem, price: FloatArray) -> FloatArray:
    """Return what each slot earns: the prices of the rows that see it."""
    earned = np.bincount(problem.sees.slot, weights=price[problem.sees.row], minlength=problem.slot_count)
    return np.asarray(earned, dtype=np.float64)


def _check(problem: CoverProblem, price: FloatArray) -> None:
    if not ((price >= 0.0) & np.isfinite(price)).all():
        raise ValueError("a price below zero, or one that is no number, proves nothing")
    # What is there already costs nothing, and these sums would charge for it.
    if problem.locked.any():
        raise ValueError("bounds are for problems without locked slots: `reduction.reduced` takes them out")


def _step(number: int, iterations: int) -> float:
    return float(_FIRST_STEP * (_LAST_STEP / _FIRST_STEP) ** (number / iterations))


def rounded_up(problem: CoverProblem, value: float) -> int:
    """Return the least cost of any choice that is no less than ``value``: a multiple of what all costs share."""
    unit = int(np.gcd.reduce(problem.cost)) if len(problem.cost) else 1
    return math.ceil(Fraction(value) / unit) * unit
