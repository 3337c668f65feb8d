"""The chain that answers a covering problem: greedy, lattices, bound, search, windows, cuts, exact finish."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from typing import Final

import numpy as np

from layoutopt.identity import BoolArray, IntArray
from layoutopt.result import Status
from solvers.covering.bounds import cost_bound, rounded_up, worth_bound
from solvers.covering.integer import cheapest_cover, missing_solver, worthiest_choice
from solvers.covering.lattices import lattice_starts
from solvers.covering.local_search import searched
from solvers.covering.problem import CoverProblem
from solvers.covering.reduction import Reduced, reduced
from solvers.covering.surplus import surplus_cuts
from solvers.covering.windows import windows_searched, windows_solved

_TOLERANCE: Final = 1e-6
"""By this share a solver's bound may lie on the wrong side of a whole number."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Effort:
    """How long each step of the chain works; counted, not timed, so that answers are reproducible.

    Attributes
    ----------
    steps
        Of the local search.
    walk_slots, region_slots, region_steps
        A problem of more slots than the first is searched region by region, with these slots and steps for each.
    iterations
        Of the search for a bound.
    window_slots, window_rounds
        Size of a window that is solved exactly, and how often all of them are.
    cut_rows, cut_nodes
        Most rows in a window that is asked for its surplus, and partial choices that are looked at for all windows
        together; the search for a bound then goes once more with these cuts. Zero nodes mean no cuts.
    exact_slots, exact_nodes
        The whole problem goes to branch and bound if it has no more slots than that, for so many nodes.
    exact_seconds
        If given, branch and bound also ends after that time; answers are then no longer reproducible.
    lattices
        How many lattices are tried as a start where slots lie on a grid.
    seed
        Of the local search.
    """

    steps: int = 1_000_000
    walk_slots: int = 15_000
    region_slots: int = 1600
    region_steps: int = 100_000
    iterations: int = 5000
    window_slots: int = 60
    window_rounds: int = 1
    cut_rows: int = 400
    cut_nodes: int = 500_000
    exact_slots: int = 600
    exact_nodes: int = 2000
    exact_seconds: float | None = None
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
        Rows that no choice can meet, whatever it costs.
    message
        What is missing, in words, such as a choice, money, or a solver; empty where nothing is.
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
    _check_budget(budget)
    small = reduced(problem, every_row=True)
    if len(small.lost):
        return _impossible(small.lost, f"{len(small.lost)} rows cannot see enough slots, whatever is chosen")
    part = small.problem
    if not part.row_count:
        return _answer(small, np.zeros(part.slot_count, dtype=np.bool_), 0, budget, stopped=False)
    message = missing_solver()
    begun = searched(part, _starts(small, places, starts, effort), steps=0, seed=effort.seed)
    incumbent = part.cost_of(begun) if begun is not None else int(part.cost.sum())
    bound = cost_bound(part, incumbent=incumbent, iterations=effort.iterations, stop=stop).bound
    by_region = part.slot_count > effort.walk_slots
    if by_region:
        # The search of all regions may take all the time there is.
        bound = _raised(part, bound, incumbent, effort, stop)
    chosen = _walked(part, begun, bound, effort, stop)
    if chosen is not None and not message and part.cost_of(chosen) > bound:
        chosen = windows_solved(part, chosen, slots=effort.window_slots, rounds=effort.window_rounds, stop=stop)
    incumbent = part.cost_of(chosen) if chosen is not None else int(part.cost.sum())
    if not by_region:
        bound = _raised(part, bound, incumbent, effort, stop)
    if (chosen is None or bound < incumbent) and part.slot_count <= effort.exact_slots and not stop():
        # The known cover stays among the choices: a solver that finds none is then known to be wrong.
        exact = cheapest_cover(
            part,
            below=None if chosen is None else incumbent + 1,
            nodes=effort.exact_nodes,
            seconds=effort.exact_seconds,
        )
        message = exact.message
        if exact.chosen is not None:
            chosen = exact.chosen
            bound = part.cost_of(chosen) if exact.proven else bound
        elif exact.proven and chosen is None:
            return _impossible(np.empty(0, dtype=np.int64), "the rules between slots leave no choice")
        elif exact.proven:
            message = "HiGHS found no choice where one is known"
        if not exact.proven and (lowest := _rounded_up(part, exact.bound)) < incumbent:
            bound = max(bound, lowest)
    return _answer(small, chosen, bound, budget, stopped=stop(), message=message)


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
    _check_budget(budget)
    small = reduced(problem, every_row=False)
    part = small.problem
    chosen = searched(part, _starts(small, places, starts, effort), steps=0, seed=effort.seed, budget=budget)
    assert chosen is not None, "to choose nothing keeps every budget"
    incumbent = part.worth_of(chosen)
    bound = worth_bound(part, budget, incumbent=incumbent, iterations=effort.iterations, stop=stop).bound
    if bound > incumbent:
        walked = searched(
            part, [chosen], steps=effort.steps, seed=effort.seed, budget=budget, enough=bound, stop=stop
        )
        chosen = chosen if walked is None else walked
        incumbent = part.worth_of(chosen)
    message = missing_solver() if bound > incumbent else ""
    if bound > incumbent and part.slot_count <= effort.exact_slots and not stop():
        exact = worthiest_choice(part, budget, nodes=effort.exact_nodes, seconds=effort.exact_seconds)
        message = exact.message
        if exact.chosen is not None and part.worth_of(exact.chosen) > incumbent:
            chosen, incumbent = exact.chosen, part.worth_of(exact.chosen)
        highest = _rounded_down(exact.bound, bound)
        # A bound below a choice that is known is none; then nothing of the answer proves anything.
        if highest < incumbent:
            message = "HiGHS gave a bound that a known choice disproves"
        else:
            bound = min(bound, highest)
    whole = small.whole(chosen)
    value, bound = problem.worth_of(whole), bound + small.worth_met
    return CoverAnswer(
        status=_status(proven=value == bound, stopped=stop()),
        chosen=whole,
        value=value,
        bound=bound,
        lost=small.lost,
        message="" if value == bound else message,
    )


def _raised(part: CoverProblem, bound: int, incumbent: int, effort: Effort, stop: Callable[[], bool]) -> int:
    """Return the bound that cuts prove, or the given one if it is higher or they have nothing to say."""
    if bound >= incumbent or not (effort.iterations and effort.cut_nodes) or stop():
        return bound
    cuts = surplus_cuts(part, most_rows=effort.cut_rows, nodes=effort.cut_nodes, stop=stop)
    if not len(cuts.least):
        return bound
    raised = cost_bound(part, incumbent=incumbent, iterations=effort.iterations, cuts=cuts, stop=stop)
    return max(bound, raised.bound)


def _walked(
    part: CoverProblem, begun: BoolArray | None, bound: int, effort: Effort, stop: Callable[[], bool]
) -> BoolArray | None:
    """Return what the local search finds from a cover, or without one, over the whole or region by region."""
    if begun is not None and part.slot_count > effort.walk_slots:
        return windows_searched(
            part, begun, slots=effort.region_slots, steps=effort.region_steps, seed=effort.seed, stop=stop
        )
    starts = [] if begun is None else [begun]
    return searched(part, starts, steps=effort.steps, seed=effort.seed, enough=bound, stop=stop)


def _check_budget(budget: int | None) -> None:
    if budget is not None and budget < 0:
        raise ValueError(f"a budget is zero or more, got {budget}")


def _starts(
    small: Reduced, places: IntArray | None, starts: Iterable[BoolArray], effort: Effort
) -> list[BoolArray]:
    found = [small.part(start) for start in starts]
    found = [start for start in found if not small.problem.broken_rules(start)]
    if places is not None:
        found += lattice_starts(small.problem, places[small.slots], most=effort.lattices)
    return found


def _answer(
    small: Reduced,
    chosen: BoolArray | None,
    bound: int,
    budget: int | None,
    *,
    stopped: bool,
    message: str = "",
) -> CoverAnswer:
    lost = np.empty(0, dtype=np.int64)
    whole = None if chosen is None else small.whole(chosen)
    value = None if whole is None else small.given.cost_of(whole)
    if budget is not None and bound > budget:
        text = f"no choice costs less than {bound}, {bound - budget} too much"
        return CoverAnswer(
            status=Status.BUDGET_TOO_SMALL, chosen=None, value=None, bound=bound, lost=lost, message=text
        )
    if whole is None or value is None:
        text = "no choice that keeps all rules was found, and none was shown to be impossible"
        return CoverAnswer(
            status=Status.STOPPED_BY_LIMIT,
            chosen=None,
            value=None,
            bound=bound,
            lost=lost,
            message=_joined(text, message),
        )
    if budget is not None and value > budget:
        status = Status.TARGET_NOT_MET
        text = f"the cheapest choice found costs {value}, {value - budget} too much; none costs less than {bound}"
    else:
        status, text = _status(proven=value == bound, stopped=stopped), ""
    message = _joined(text, "" if value == bound else message)
    return CoverAnswer(status=status, chosen=whole, value=value, bound=bound, lost=lost, message=message)


def _joined(*sentences: str) -> str:
    return "; ".join(sentence for sentence in sentences if sentence)


def _status(*, proven: bool, stopped: bool) -> Status:
    if proven:
        return Status.OPTIMAL
    return Status.STOPPED_BY_LIMIT if stopped else Status.BOUNDED


def _impossible(lost: IntArray, message: str) -> CoverAnswer:
    return CoverAnswer(status=Status.INFEASIBLE, chosen=None, value=None, bound=0, lost=lost, message=message)


def _rounded_up(problem: CoverProblem, bound: float) -> int:
    """Return the least whole cost that a solver's bound allows; zero without a bound."""
    if not np.isfinite(bound):
        return 0
    return rounded_up(problem, bound - _TOLERANCE * max(1.0, abs(bound)))


def _rounded_down(bound: float, unknown: int) -> int:
    """Return the greatest whole worth that a solver's bound allows; ``unknown`` without a bound."""
    return int(np.floor(bound + _TOLERANCE * max(1.0, abs(bound)))) if np.isfinite(bound) else unknown
