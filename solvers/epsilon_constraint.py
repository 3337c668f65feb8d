"""The whole front from a solver of one goal: the epsilon-constraint method with a budget that falls.

A solver that minimises one goal within a budget is asked with no budget first, then again and again with a budget
just below the cost of its last answer, until nothing can be had for the money (Haimes, Lasdon and Wismer, IEEE
Trans. Syst. Man Cybern. 1(3), 1971). Costs are whole steps, such as cents, so between the budget and the cost of
an answer that was proven optimal there is nothing to be found, and the front is complete (Laumanns, Thiele and
Zitzler, Eur. J. Oper. Res. 169(3), 2006).

A solver may return a dear answer where a cheaper one is as good. Either it is then asked for the cheapest answer
of that value (``cheapest``, the lexicographic form: Mavrotas, Appl. Math. Comput. 213(2), 2009), or the next,
smaller budget finds the cheaper one, and the dear one drops out as dominated. Both give the same front.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Final, Generic, TypeVar

import numpy as np

from layoutopt.result import Status
from solvers.front import non_dominated

CENT_EUR: Final = 0.01
_ROUNDING: Final = 1e-4
"""A cost may be off a whole step by this share of it: sums of prices in binary numbers are."""

Solution = TypeVar("Solution")


@dataclass(frozen=True, slots=True, kw_only=True)
class BudgetAnswer(Generic[Solution]):
    """What a solver found within a budget.

    Attributes
    ----------
    status
        ``OPTIMAL`` or ``INFEASIBLE`` where that is proven, else how the solver ended.
    solution
        What it found, in whatever form; ``None`` if nothing.
    value, cost
        The goal that was minimised, and the money it takes; NaN without a solution.
    bound
        Proven: no solution within the budget has a smaller value; ``None`` if nothing is proven.
    """

    status: Status
    solution: Solution | None = None
    value: float = math.nan
    cost: float = math.nan
    bound: float | None = None

    @property
    def gap(self) -> float | None:
        """How far the value may be above the least one; zero where it is proven optimal, ``None`` if not known."""
        if self.status is Status.OPTIMAL and self.bound is None:
            return 0.0
        return None if self.bound is None or self.solution is None else max(0.0, self.value - self.bound)


@dataclass(frozen=True, slots=True, kw_only=True)
class OpenRange:
    """Costs, both ends included, at which better answers may exist than were found.

    ``bound`` is the least value that they can have, ``None`` where the solver proved nothing.
    """

    low_cost: float
    high_cost: float
    bound: float | None


@dataclass(frozen=True, slots=True, kw_only=True)
class BudgetFront(Generic[Solution]):
    """A front made budget by budget.

    Attributes
    ----------
    members
        Answers that no other beats, by rising cost and falling value, each with the solver's status.
    open_ranges
        Where the front may be incomplete, by rising cost; empty where it is proven complete.
    solves
        How often a solver was called.
    """

    members: tuple[BudgetAnswer[Solution], ...]
    open_ranges: tuple[OpenRange, ...]
    solves: int

    @property
    def complete(self) -> bool:
        """Whether it is proven that nothing is missing."""
        return not self.open_ranges

    @property
    def status(self) -> Status:
        """``OPTIMAL`` if complete, ``INFEASIBLE`` if it is proven that nothing exists, else stopped by a limit."""
        if not self.complete:
            return Status.STOPPED_BY_LIMIT
        return Status.OPTIMAL if self.members else Status.INFEASIBLE


def epsilon_constraint_front(
    solve: Callable[[float], BudgetAnswer[Solution]],
    *,
    cheapest: Callable[[float], BudgetAnswer[Solution]] | None = None,
    cost_step: float = CENT_EUR,
    tolerance: float = 0.0,
    most_solves: int | None = None,
) -> BudgetFront[Solution]:
    """Return the front of cost and value that a solver of one goal gives.

    Parameters
    ----------
    solve
        Minimises the value among solutions that cost at most the budget it is given, infinite the first time.
    cheapest
        Minimises the cost among solutions whose value is at most the one it is given. It saves solves where
        ``solve`` returns answers that are dearer than they need be; an answer of it that breaks the value or costs
        more is not used.
    cost_step
        All costs are whole multiples of it. Budgets lie half a step below a cost, so that no rounding decides.
    tolerance
        An answer counts as proven if its gap is at most this, in units of the value. Zero is exact; a solver that
        stops at a gap of its own needs that here, and the front is then complete to within it.
    most_solves
        Stops after so many calls; what lies below the last budget is then an open range.

    Raises
    ------
    ValueError
        If the solver breaks its budget, calls an answer infeasible or leaves out one that it calls optimal, or a
        cost is no multiple of the step.
    """
    if not cost_step > 0.0:
        raise ValueError(f"costs need a positive step, not {cost_step:g}")
    found: list[BudgetAnswer[Solution]] = []
    open_ranges: list[OpenRange] = []
    budget, solves = math.inf, 0
    while True:
        if most_solves is not None and solves >= most_solves:
            open_ranges.append(OpenRange(low_cost=-math.inf, high_cost=budget, bound=None))
            break
        answer = solve(budget)
        solves += 1
        _check(answer, budget)
        if answer.solution is None:
            if answer.status is not Status.INFEASIBLE:
                open_ranges.append(OpenRange(low_cost=-math.inf, high_cost=budget, bound=answer.bound))
            break
        proven = answer.gap is not None and answer.gap <= tolerance
        if cheapest is not None and proven and (most_solves is None or solves < most_solves):
            answer = _cheapened(answer, cheapest(answer.value))
            solves += 1
        steps = _whole_steps(answer.cost, cost_step)
        if not proven:
            open_ranges.append(OpenRange(low_cost=steps * cost_step, high_cost=budget, bound=answer.bound))
        found.append(answer)
        budget = (steps - 0.5) * cost_step
    goals = np.array([(_whole_steps(item.cost, cost_step), item.value) for item in found]).reshape(-1, 2)
    return BudgetFront(
        members=tuple(found[row] for row in non_dominated(goals)),
        open_ranges=tuple(_joined(open_ranges[::-1], cost_step)),
        solves=solves,
    )


def _check(answer: BudgetAnswer[Solution], budget: float) -> None:
    if answer.solution is None:
        if answer.status is Status.OPTIMAL:
            raise ValueError("a solver calls an answer optimal that it does not give")
        return
    if answer.status is Status.INFEASIBLE:
        raise ValueError("a solver gives an answer and calls the problem infeasible")
    if math.isnan(answer.value) or not math.isfinite(answer.cost):
        raise ValueError(f"an answer needs a value and a cost, not {answer.value} and {answer.cost}")
    if answer.cost > budget:
        raise ValueError(f"a solver was given {budget:g} to spend and spent {answer.cost:g}")


def _whole_steps(cost: float, step: float) -> int:
    steps = round(cost / step)
    if abs(cost / step - steps) > _ROUNDING * max(1.0, abs(steps) * 1e-9):
        raise ValueError(f"a cost of {cost!r} is no multiple of {step:g}")
    return steps


def _cheapened(answer: BudgetAnswer[Solution], other: BudgetAnswer[Solution]) -> BudgetAnswer[Solution]:
    """Return the cheaper of two answers that are equally good; its value is as proven as that of the first."""
    if other.solution is None or not other.value <= answer.value or not other.cost < answer.cost:
        return answer
    return replace(answer, solution=other.solution, value=other.value, cost=other.cost)


def _joined(ranges: list[OpenRange], step: float) -> list[OpenRange]:
    """Return ranges by rising cost, those that touch as one, with the weaker of their bounds."""
    joined: list[OpenRange] = []
    for item in ranges:
        # A budget lies half a step below the next cost, so neighbours are half a step apart.
        if joined and item.low_cost <= joined[-1].high_cost + step:
            last = joined[-1]
            bounds = [bound for bound in (last.bound, item.bound) if bound is not None]
            joined[-1] = OpenRange(
                low_cost=last.low_cost, high_cost=item.high_cost, bound=min(bounds) if len(bounds) == 2 else None
            )
        else:
            joined.append(item)
    return joined
