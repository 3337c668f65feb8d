"""The chain that answers a covering problem: greedy, lattices, local search, windows, bound, exact finish."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass

import numpy as np

from layoutopt.identity import BoolArray, IntArray
from layoutopt.result import Status
from solvers.covering.bounds import cost_bound, worth_bound
from solvers.covering.integer import cheapest_cover, worthiest_choice
from solvers.covering.lattices import lattice_starts
from solvers.covering.local_search import searched
from solvers.covering.problem import CoverProblem
from solvers.covering.reduction import Reduced, reduced
from solvers.covering.windows import windows_solved


@dataclass(frozen=True, slots=True, kw_only=True)
class Effort:
    """How long each step of the chain works; counted, not timed, so that answers are reproducible.

    Attributes
    ----------
    steps
        Of the local search.
    iterations
        Of the search for a bound.
    window_slots, window_rounds
        Size of a window that is solved exactly, and how often all of them are.
    exact_slots, exact_nodes
        The whole problem goes to branch and bound if it has no more slots than that, for so many nodes.
    lattices
        How many lattices are tried as a start where slots lie on a grid.
    seed
        Of the local search.
    """

    steps: int = 1_000_000
    iterations: int = 5000
    window_slots: int = 120
    window_rounds: int = 1
    exact_slots: int = 600
    exact_nodes: int = 2000
    lattices: int = 6
    seed: int = 0


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class CoverAnswer:
    """A choice with the proof of how good it is.

    Attributes
    ----------
    status
        `Status.OPTIMAL`, ``BOUNDED``, ``STOPPED_BY_LIMIT``, ``BUDGET_TOO_SMALL``, ``TARGET_NOT_MET`` or
        ``INFEASIBLE``.
    chosen
        Which slots are taken, locked ones included; ``None`` without an answer.
    value
        Cost of the choice, or the worth of the rows that it meets.
    bound
        No choice is cheaper, or worth more.
    lost
        Rows that no choice can meet.
    message
        What is missing, in words; empty where nothing is.
    """

    status: Status
    chosen: BoolArray | None
    value: int | None
    bound: int
    lost: IntArray
    message: str = ""

    @property
    def gap(self) -> float | None:
        """Distance of value and bound as a share of the larger one; zero is proven optimal."""
        if self.value is None:
            return None
        larger = max(self.value, self.bound)
        return abs(self.value - self.bound) / larger if larger else 0.0


def cheapest(
    problem: CoverProblem,
    *,
    budget: int | None = None,
    places: IntArray | None = None,
    starts: Iterable[BoolArray] = (),
    effort: Effort | None = None,
    stop: Callable[[], bool] = lambda: False,
) -> CoverAnswer:
    """Return the cheapest choice found that meets every row, with a bound on every other.

    Parameters
    ----------
    budget
        If given, a dearer choice is no answer; the status says whether a cheaper one may exist.
    places
        Column and row of each slot where they lie on a grid, shape (slots, 2): then lattices are tried first.
    starts
        Choices to begin from, such as the last answer to a like question.
    stop
        Asked now and then whether to end early; the answer is then the best so far.
    """
    effort = effort or Effort()
    small = reduced(problem, every_row=True)
    if len(small.lost):
        return _impossible(small.lost, f"{len(small.lost)} rows see too few slots, whatever is chosen")
    part = small.problem
    if not part.row_count:
        return _answer(small, np.zeros(part.slot_count, dtype=np.bool_), 0, budget, stopped=False)
    chosen = searched(
        part, _starts(small, places, starts, effort), steps=effort.steps, seed=effort.seed, stop=stop
    )
    if chosen is not None:
        chosen = windows_solved(part, chosen, slots=effort.window_slots, rounds=effort.window_rounds, stop=stop)
    incumbent = part.cost_of(chosen) if chosen is not None else int(part.cost.sum())
    bound = cost_bound(part, incumbent=incumbent, iterations=effort.iterations, stop=stop).bound
    if (chosen is None or bound < incumbent) and part.slot_count <= effort.exact_slots and not stop():
        exact = cheapest_cover(part, below=None if chosen is None else incumbent, nodes=effort.exact_nodes)
        if exact.chosen is not None:
            chosen = exact.chosen
        if exact.proven and chosen is None:
            return _impossible(np.empty(0, dtype=np.int64), "the rules between slots leave no choice")
        bound = part.cost_of(chosen) if exact.proven and chosen is not None else max(bound, _whole(exact.bound, 0))
    return _answer(small, chosen, bound, budget, stopped=stop())


def worthiest(
    problem: CoverProblem,
    budget: int,
    *,
    places: IntArray | None = None,
    starts: Iterable[BoolArray] = (),
    effort: Effort | None = None,
    stop: Callable[[], bool] = lambda: False,
) -> CoverAnswer:
    """Return the choice found within the budget whose met rows are worth most, with a bound on every other.

    Parameters as for `cheapest`. Rows that no choice can meet are left out and named in ``lost``.
    """
    effort = effort or Effort()
    small = reduced(problem, every_row=False)
    part = small.problem
    chosen = searched(
        part,
        _starts(small, places, starts, effort),
        steps=effort.steps,
        seed=effort.seed,
        budget=budget,
        stop=stop,
    )
    assert chosen is not None, "to choose nothing keeps every budget"
    incumbent = part.worth_of(chosen)
    bound = worth_bound(part, budget, incumbent=incumbent, iterations=effort.iterations, stop=stop).bound
    if bound > incumbent and part.slot_count <= effort.exact_slots and not stop():
        exact = worthiest_choice(part, budget, nodes=effort.exact_nodes)
        if exact.chosen is not None and part.worth_of(exact.chosen) > incumbent:
            chosen, incumbent = exact.chosen, part.worth_of(exact.chosen)
        bound = incumbent if exact.proven else min(bound, _whole(exact.bound, bound))
    whole = small.whole(chosen)
    value, bound = problem.worth_of(whole), bound + small.worth_met
    return CoverAnswer(
        status=_status(proven=value == bound, stopped=stop()),
        chosen=whole,
        value=value,
        bound=bound,
        lost=small.lost,
    )


def _starts(
    small: Reduced, places: IntArray | None, starts: Iterable[BoolArray], effort: Effort
) -> list[BoolArray]:
    found = [small.part(start) for start in starts]
    found = [start for start in found if not small.problem.broken_rules(start)]
    if places is not None:
        found += lattice_starts(small.problem, places[small.slots], most=effort.lattices)
    return found


def _answer(
    small: Reduced, chosen: BoolArray | None, bound: int, budget: int | None, *, stopped: bool
) -> CoverAnswer:
    lost = np.empty(0, dtype=np.int64)
    whole = None if chosen is None else small.whole(chosen)
    value = None if whole is None else small.given.cost_of(whole)
    if budget is not None and bound > budget:
        status, message = Status.BUDGET_TOO_SMALL, f"no choice costs less than {bound}, {bound - budget} too much"
        return CoverAnswer(status=status, chosen=None, value=None, bound=bound, lost=lost, message=message)
    if whole is None or value is None:
        status = Status.STOPPED_BY_LIMIT
        message = "no choice that keeps all rules was found, and none was shown to be impossible"
        return CoverAnswer(status=status, chosen=None, value=None, bound=bound, lost=lost, message=message)
    if budget is not None and value > budget:
        status = Status.TARGET_NOT_MET
        message = (
            f"the cheapest choice found costs {value}, {value - budget} too much; none costs less than {bound}"
        )
    else:
        status, message = _status(proven=value == bound, stopped=stopped), ""
    return CoverAnswer(status=status, chosen=whole, value=value, bound=bound, lost=lost, message=message)


def _status(*, proven: bool, stopped: bool) -> Status:
    if proven:
        return Status.OPTIMAL
    return Status.STOPPED_BY_LIMIT if stopped else Status.BOUNDED


def _impossible(lost: IntArray, message: str) -> CoverAnswer:
    return CoverAnswer(status=Status.INFEASIBLE, chosen=None, value=None, bound=0, lost=lost, message=message)


def _whole(bound: float, unknown: int) -> int:
    """Return a solver's bound as a whole number on its safe side to a millionth; ``unknown`` if it has none.

    Costs and worths are whole, and a solver's bound is short of a whole number by its tolerance only.
    """
    return int(np.floor(bound + 1e-6)) if np.isfinite(bound) else unknown
