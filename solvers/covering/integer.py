"""Covers by integer programming: cvxpy hands the problem to HiGHS, and nothing that comes back is taken on trust.

cvxpy fills variables with zeros where the solver stopped without a solution, and solvers have called wrong answers
optimal; so a choice counts only if the solver says that it has one and the problem itself agrees.
"""

import math
from dataclasses import dataclass
from typing import Any, Final

import numpy as np

from layoutopt.identity import BoolArray, IntArray
from solvers.covering.problem import CoverProblem

_HAS_SOLUTION: Final = 2
"""HiGHS: ``primal_solution_status`` of a feasible point."""
_TOLERANCE: Final = 1e-6


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
    import cvxpy as cp

    # In the unit that all costs share, bounds are rounded up farther.
    unit = int(np.gcd.reduce(problem.cost)) if problem.slot_count else 1
    take = cp.Variable(problem.slot_count, boolean=True)
    spent = (problem.cost // unit) @ take
    rules = [*_rules(problem, take), _matrix(problem) @ take >= problem.demand]
    if below is not None:
        rules.append(spent <= -(-below // unit) - 1)
    answer = _solved(cp.Problem(cp.Minimize(spent), rules), nodes, seconds)
    chosen = None if answer.values is None else answer.values[: problem.slot_count]
    if chosen is not None and (len(problem.unmet(chosen)) or problem.broken_rules(chosen)):
        return IntegerAnswer(
            chosen=None, bound=-math.inf, proven=False, message="the solver's choice does not meet every row"
        )
    return IntegerAnswer(chosen=chosen, bound=answer.bound * unit, proven=answer.proven, message=answer.message)


def worthiest_choice(
    problem: CoverProblem, budget: int, *, nodes: int | None = None, seconds: float | None = None
) -> IntegerAnswer:
    """Return the choice within a budget whose met rows are worth most; the bound is on that worth."""
    import cvxpy as cp

    take = cp.Variable(problem.slot_count, boolean=True)
    met = cp.Variable(problem.row_count, boolean=True)
    rules = [
        *_rules(problem, take),
        _matrix(problem) @ take >= _diagonal(problem.demand) @ met,
        problem.cost @ take <= budget,
    ]
    answer = _solved(cp.Problem(cp.Minimize(-(problem.worth @ met)), rules), nodes, seconds)
    chosen = None if answer.values is None else answer.values[: problem.slot_count]
    if chosen is not None and (problem.cost_of(chosen) > budget or problem.broken_rules(chosen)):
        return IntegerAnswer(
            chosen=None, bound=math.inf, proven=False, message="the solver's choice breaks a rule or the budget"
        )
    return IntegerAnswer(chosen=chosen, bound=-answer.bound, proven=answer.proven, message=answer.message)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Raw:
    """Rounded values of all variables in the order of the model, with bound, proof and message."""

    values: BoolArray | None
    bound: float
    proven: bool
    message: str = ""


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


def _solved(model: Any, nodes: int | None, seconds: float | None) -> _Raw:
    """Return the answer of HiGHS; one thread and a fixed seed, so that it depends on the model alone."""
    import cvxpy as cp

    options: dict[str, Any] = {"threads": 1, "random_seed": 0, "mip_rel_gap": 0.0}
    if nodes is not None:
        options["mip_max_nodes"] = nodes
    if seconds is not None:
        options["time_limit"] = max(seconds, 0.01)
    try:
        model.solve(solver=cp.HIGHS, **options)
    except cp.error.SolverError as error:
        return _Raw(values=None, bound=-math.inf, proven=False, message=f"HiGHS gave up: {error}")
    if model.status in (cp.INFEASIBLE, cp.settings.INFEASIBLE_OR_UNBOUNDED):
        return _Raw(values=None, bound=math.inf, proven=True)
    info = model.solver_stats.extra_stats
    bound = float(info.mip_dual_bound)
    if model.status not in (cp.OPTIMAL, cp.OPTIMAL_INACCURATE, cp.USER_LIMIT):
        return _Raw(values=None, bound=-math.inf, proven=False, message=f"HiGHS ended with '{model.status}'")
    proven = model.status == cp.OPTIMAL
    message = "" if proven else "HiGHS was stopped by its limit"
    if info.primal_solution_status != _HAS_SOLUTION:
        return _Raw(values=None, bound=bound, proven=False, message=f"{message} before it had any solution")
    values = np.concatenate([np.atleast_1d(variable.value) for variable in model.variables()])
    if np.abs(values - np.round(values)).max(initial=0.0) > _TOLERANCE:
        return _Raw(values=None, bound=bound, proven=False, message="HiGHS gave values that are not whole")
    return _Raw(values=np.round(values) > 0.5, bound=bound, proven=proven, message=message)
