"""Stated bounds and optima of random floors beside scipy's integer program, whatever the effort."""

import numpy as np
import pytest
from covering_cases import floor_case, scipy_cheapest

from layoutopt.result import Status
from solvers.covering.bounds import cost_bound
from solvers.covering.reduction import reduced
from solvers.covering.search import Effort, cheapest
from solvers.covering.surplus import surplus_cuts


def _case(case):
    """Return the generator of a case and its problem, of up to 40 slots and 80 rows with demands up to three."""
    draws = np.random.Generator(np.random.Philox([7, case]))
    problem = floor_case(
        draws,
        slots=int(draws.integers(8, 40)),
        rows=int(draws.integers(10, 80)),
        side_m=draws.uniform(2.0, 5.0),
        most_demand=int(draws.integers(1, 4)),
    )
    return draws, problem


def _check(case):
    """Check one problem at an effort drawn at random; return whether cuts lift its bound.

    Few nodes may only weaken what is stated.
    """
    draws, problem = _case(case)
    truth = scipy_cheapest(problem)
    effort = Effort(
        steps=int(draws.choice([50, 2000])),
        iterations=int(draws.choice([20, 400])),
        window_rounds=0,
        cut_nodes=int(draws.choice([1, 30, 3000, 100_000])),
        exact_slots=int(draws.choice([0, 0, 600])),
        exact_nodes=int(draws.choice([1, 2000])),
    )
    answer = cheapest(problem, effort=effort)
    if truth is None:
        assert answer.chosen is None
        return False
    assert answer.status is not Status.INFEASIBLE
    assert answer.bound <= truth
    if answer.chosen is not None:
        assert not len(problem.unmet(answer.chosen))
        assert not problem.broken_rules(answer.chosen)
        assert answer.value == problem.cost_of(answer.chosen) >= truth
    if answer.status is Status.OPTIMAL:
        assert answer.value == truth
    part = reduced(problem, every_row=True).problem
    if not part.row_count:
        return False
    cuts = surplus_cuts(part, most_rows=400, nodes=effort.cut_nodes)
    lifted = cost_bound(part, incumbent=truth + 1, iterations=400, cuts=cuts).bound
    assert lifted <= truth
    return lifted > cost_bound(part, incumbent=truth + 1, iterations=400).bound


def test_no_bound_lies_above_the_least_cost():
    """On 60 floors; in a few of them cuts lift the bound, so that there is something to be wrong about."""
    assert sum(_check(case) for case in range(60)) >= 2


@pytest.mark.long
def test_no_bound_lies_above_the_least_cost_of_many_floors():
    """The same on 3,000 floors."""
    assert sum(_check(case) for case in range(60, 3060)) >= 10
