"""Covers by integer programming: cvxpy hands the problem to HiGHS, and nothing that comes back is taken on trust.

cvxpy fills variables with zeros where the solver stopped without a solution, and solvers have called wrong answers
optimal; so a choice counts only if the solver says that it has one and the problem itself agrees, a proof only if
bound and choice agree, and that there is no choice at all is asked twice.
"""

import math
import warnings
from dataclasses import dataclass, replace
from typing import Any, Final

import numpy as np

from layoutopt.identity import BoolArray, IntArray
from solvers.covering.problem import CoverProblem

_HAS_SOLUTION: Final = 2
"""HiGHS: ``primal_solution_status`` of a feasible point."""
_TOLERANCE: Final = 1e-6
"""By so much a value of HiGHS may miss a whole number, and by this share a bound may miss the best objective."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class IntegerAnswer:
    """What an integer program said.

    Attributes
    ----------
    chosen
        A choice that keeps every rule, checked; ``None`` if there is none to show.
    bound
        Proven bound on the objective of every choice, infinite if there is no choice at all.
    proven
        Whether the search ended by itself: then ``chosen`` is the best, or none exists.
    message
        Why there is no proof, in words; empty with one.
    """

    chosen: BoolArray | None
    bound: float
    proven: bool
    message: str = ""


def missing_solver() -> str:
    """Return in words why no integer program can be solved here; empty if it can."""
    try:
        import cvxpy as cp
    except ImportError as error:
        return f"nothing was solved exactly, because cvxpy cannot be imported: {error}"
    modelling: Any = cp
    if cp.HIGHS not in modelling.installed_solvers():
        return "nothing was solved exactly, because cvxpy does not find HiGHS: install highspy"
    return ""


def cheapest_cover(
    problem: CoverProblem, *, below: int | None = None, nodes: int | None = None, seconds: float | None = None
) -> IntegerAnswer:
    """Return the cheapest choice that meets every row, or the proof that there is none.

    Parameters
    ----------
    below
        Look only for choices that cost less.
    nodes, seconds
        Limits on the search; only the first leaves results reproducible.
    """
    if not len(problem.unmet(problem.locked)):
        free = below is None or below > 0
        return IntegerAnswer(
            chosen=problem.locked.copy() if free else None, bound=0.0 if free else math.inf, proven=True
        )
    if len(problem.hopeless()):
        return IntegerAnswer(chosen=None, bound=math.inf, proven=True)
    if reason := missing_solver():
        return IntegerAnswer(chosen=None, bound=-math.inf, proven=False, message=reason)
    import cvxpy as cp

    # In the unit that all costs share, bounds are rounded up farther.
    unit = int(np.gcd.reduce(problem.cost))
    take = cp.Variable(problem.slot_count, boolean=True)
    spent = (_to_pay(problem) // unit) @ take
    rules = [*_rules(problem, take), _matrix(problem) @ take >= problem.demand]
    if below is not None:
        rules.append(spent <= -(-below // unit) - 1)
    model = cp.Problem(cp.Minimize(spent), rules)
    answer = _solved(model, take, nodes, seconds)
    if answer.impossible and below is None:
        answer = _asked_again(model, take, nodes, seconds)
    if answer.chosen is None:
        return _without_choice(answer, answer.bound * unit)
    if len(problem.unmet(answer.chosen)) or problem.broken_rules(answer.chosen):
        return _refused("the solver's choice does not meet every row or breaks a rule", -math.inf)
    value = problem.cost_of(answer.chosen)
    if not _agree(value, answer.bound * unit, proven=answer.proven):
        return _refused("the solver's bound does not agree with its own choice", -math.inf)
    if below is not None and value >= below:
        return _refused("the solver's choice is no cheaper than was asked for", -math.inf)
    return IntegerAnswer(
        chosen=answer.chosen, bound=answer.bound * unit, proven=answer.proven, message=answer.message
    )


def worthiest_choice(
    problem: CoverProblem, budget: int, *, nodes: int | None = None, seconds: float | None = None
) -> IntegerAnswer:
    """Return the choice within a budget whose met rows are worth most; the bound is on that worth.

    Raises
    ------
    ValueError
        If the budget is below zero, so that not even the locked slots keep it.
    """
    if budget < 0:
        raise ValueError(f"a budget is zero or more, got {budget}")
    if not len(problem.unmet(problem.locked)):
        return IntegerAnswer(chosen=problem.locked.copy(), bound=float(problem.worth.sum()), proven=True)
    if reason := missing_solver():
        return IntegerAnswer(chosen=None, bound=math.inf, proven=False, message=reason)
    if not problem.slot_count:
        return IntegerAnswer(
            chosen=problem.locked.copy(), bound=float(problem.worth_of(problem.locked)), proven=True
        )
    import cvxpy as cp

    take = cp.Variable(problem.slot_count, boolean=True)
    met = cp.Variable(problem.row_count, boolean=True)
    rules = [
        *_rules(problem, take),
        _matrix(problem) @ take >= _diagonal(problem.demand) @ met,
        _to_pay(problem) @ take <= budget,
    ]
    answer = _solved(cp.Problem(cp.Minimize(-(problem.worth @ met)), rules), take, nodes, seconds)
    if answer.impossible:
        return _refused("HiGHS found no choice, where the locked slots alone are one", math.inf)
    if answer.chosen is None:
        return _without_choice(answer, -answer.bound)
    if problem.cost_of(answer.chosen) > budget or problem.broken_rules(answer.chosen):
        return _refused("the solver's choice breaks a rule or the budget", math.inf)
    if not _agree(-problem.worth_of(answer.chosen), answer.bound, proven=answer.proven):
        return _refused("the solver's bound does not agree with its own choice", math.inf)
    return IntegerAnswer(chosen=answer.chosen, bound=-answer.bound, proven=answer.proven, message=answer.message)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Raw:
    """What the solver said: rounded values of slots, bound of the minimum, proof, "there is none", message."""

    chosen: BoolArray | None = None
    bound: float = -math.inf
    proven: bool = False
    impossible: bool = False
    message: str = ""


def _without_choice(answer: _Raw, bound: float) -> IntegerAnswer:
    return IntegerAnswer(chosen=None, bound=bound, proven=answer.proven, message=answer.message)


def _refused(message: str, bound: float) -> IntegerAnswer:
    return IntegerAnswer(chosen=None, bound=bound, proven=False, message=message)


def _agree(value: int, bound: float, *, proven: bool) -> bool:
    """Return whether a minimum of ``value`` may have a bound: not above it, and with a proof not below either."""
    slack = _TOLERANCE * max(1.0, abs(value))
    return bound <= value + slack and (not proven or bound >= value - slack)


def _to_pay(problem: CoverProblem) -> IntArray:
    """Return what slots cost; those that are there already cost nothing."""
    return np.where(problem.locked, 0, problem.cost)


def _matrix(problem: CoverProblem) -> Any:
    from scipy.sparse import csr_array

    table = problem.sees
    ones = np.ones(len(table.slot))
    return csr_array((ones, table.slot, table.start), shape=(table.row_count, table.slot_count))


def _diagonal(values: IntArray) -> Any:
    from scipy.sparse import diags_array

    return diags_array(values.astype(np.float64), format="csr")


def _rules(problem: CoverProblem, take: Any) -> list[Any]:
    """Return the rules between slots as constraints."""
    rules = []
    if len(problem.conflicts):
        rules.append(take[problem.conflicts[:, 0]] + take[problem.conflicts[:, 1]] <= 1)
    grouped = np.flatnonzero(problem.group >= 0)
    if len(grouped):
        from scipy.sparse import csr_array

        shape = (len(problem.capacity), problem.slot_count)
        members = csr_array((np.ones(len(grouped)), (problem.group[grouped], grouped)), shape=shape)
        rules.append(members @ take <= problem.capacity)
    for state, value in ((problem.locked, 1), (problem.forbidden, 0)):
        if state.any():
            rules.append(take[np.flatnonzero(state)] == value)
    return rules


def _asked_again(model: Any, take: Any, nodes: int | None, seconds: float | None) -> _Raw:
    """Return a second answer where the first was that there is no choice; presolve has been wrong about that."""
    second = _solved(model, take, nodes, seconds, presolve="off")
    if second.impossible or second.chosen is not None:
        return second
    return replace(second, message=f"HiGHS found no choice, and asked again: {second.message}")


def _solved(model: Any, take: Any, nodes: int | None, seconds: float | None, presolve: str = "choose") -> _Raw:
    """Return the answer of HiGHS; one thread and a fixed seed, so that it depends on the model alone."""
    import cvxpy as cp

    options: dict[str, Any] = {"threads": 1, "random_seed": 0, "mip_rel_gap": 0.0, "presolve": presolve}
    if nodes is not None:
        options["mip_max_nodes"] = nodes
    if seconds is not None:
        options["time_limit"] = max(seconds, 0.01)
    try:
        with warnings.catch_warnings():
            # cvxpy warns where a limit stopped the solver; here that is said by the message.
            warnings.simplefilter("ignore")
            model.solve(solver=cp.HIGHS, **options)
    except cp.error.SolverError as error:
        return _Raw(message=f"HiGHS gave up: {error}")
    if model.status in (cp.INFEASIBLE, cp.settings.INFEASIBLE_OR_UNBOUNDED):
        return _Raw(bound=math.inf, proven=True, impossible=True)
    if model.status not in (cp.OPTIMAL, cp.OPTIMAL_INACCURATE, cp.USER_LIMIT):
        return _Raw(message=f"HiGHS ended with '{model.status}'")
    info = model.solver_stats.extra_stats
    bound = float(info.mip_dual_bound)
    proven = model.status == cp.OPTIMAL
    limit = "" if proven else "HiGHS was stopped by its limit"
    if info.primal_solution_status != _HAS_SOLUTION or take.value is None:
        return _Raw(bound=bound, message=f"{limit or 'HiGHS ended'} before it had any solution")
    values = np.atleast_1d(take.value)
    if not np.abs(values - np.round(values)).max(initial=0.0) <= _TOLERANCE:
        return _Raw(message="HiGHS gave values that are not whole")
    return _Raw(chosen=np.round(values) > 0.5, bound=bound, proven=proven, message=limit)
