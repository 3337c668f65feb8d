"""Fronts made budget by budget: the same as by brute force, and honest about what a limit leaves open."""

import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.optimize import Bounds, LinearConstraint, milp

from layoutopt.result import Status
from solvers.epsilon_constraint import BudgetAnswer, epsilon_constraint_front

POINTS = st.lists(st.tuples(st.integers(0, 40), st.integers(0, 8)), max_size=25)
NOTHING = BudgetAnswer(status=Status.INFEASIBLE)


def optimal(value, cost):
    return BudgetAnswer(status=Status.OPTIMAL, solution=(cost, value), value=value, cost=cost)


def finite(points, pick=max):
    """Return a solver of a list of costs in cents and values; of equally good answers ``pick`` picks a cost."""

    def solve(budget):
        inside = [(value, cents / 100) for cents, value in points if cents / 100 <= budget]
        if not inside:
            return NOTHING
        least = min(inside)[0]
        return optimal(least, pick(cost for value, cost in inside if value == least))

    return solve


def cheapest_of(points):
    def cheapest(value):
        return optimal(*min(((v, cents / 100) for cents, v in points if v <= value), key=lambda pair: pair[1]))

    return cheapest


def by_brute_force(points):
    return sorted(
        (cents, value)
        for cents, value in set(points)
        if not any(c <= cents and v <= value and (c, v) != (cents, value) for c, v in points)
    )


def members(front):
    return [(round(item.cost * 100), item.value) for item in front.members]


@given(POINTS, st.sampled_from([min, max]), st.booleans())
def test_the_front_of_a_finite_set_is_the_one_by_brute_force(points, pick, lexicographic):
    """Whether the solver returns cheap or dear ones of equal answers, and with or without the second stage."""
    cheapest = cheapest_of(points) if lexicographic else None
    front = epsilon_constraint_front(finite(points, pick), cheapest=cheapest)
    assert members(front) == by_brute_force(points)
    assert front.complete
    assert front.status is (Status.OPTIMAL if points else Status.INFEASIBLE)
    assert all(item.gap == 0.0 for item in front.members)


def test_the_second_stage_needs_two_solves_a_member():
    """A solver that returns dear answers is asked about every one of them otherwise."""
    points = [(cents, 1) for cents in range(10, 60)] + [(5, 2)]
    plain = epsilon_constraint_front(finite(points))
    lexicographic = epsilon_constraint_front(finite(points), cheapest=cheapest_of(points))
    assert members(plain) == members(lexicographic) == [(5, 2), (10, 1)]
    assert (plain.solves, lexicographic.solves) == (52, 5)


def limited(points, seed):
    """Return a solver that is stopped at times: with any answer and a valid bound, or with none."""
    generator = np.random.Generator(np.random.Philox(seed))

    def solve(budget):
        inside = [(value, cents / 100) for cents, value in points if cents / 100 <= budget]
        kind = generator.integers(4)
        if not inside or kind > 1:
            return finite(points)(budget) if kind != 3 or generator.integers(4) else limited_nothing(inside)
        value, cost = inside[generator.integers(len(inside))]
        bound = None if kind == 0 else float(min(inside)[0]) - float(generator.integers(2))
        return BudgetAnswer(
            status=Status.STOPPED_BY_LIMIT, solution=(cost, value), value=value, cost=cost, bound=bound
        )

    def limited_nothing(inside):
        return BudgetAnswer(status=Status.STOPPED_BY_LIMIT, bound=float(min(inside)[0]) if inside else None)

    return solve


@given(POINTS, st.integers(0, 1000))
def test_what_a_stopped_solver_may_have_missed_lies_in_an_open_range(points, seed):
    """Every member of the true front is found or lies in an open range, above its bound; ranges do not overlap."""
    front = epsilon_constraint_front(limited(points, seed))
    found = members(front)
    for cents, value in by_brute_force(points):
        inside = [item for item in front.open_ranges if item.low_cost - 1e-9 <= cents / 100 <= item.high_cost]
        assert (cents, value) in found or inside
        assert all(item.bound is None or value >= item.bound for item in inside)
    assert all(left.high_cost < right.low_cost for left, right in pairwise(front.open_ranges))
    if front.complete:
        assert found == by_brute_force(points)
    else:
        assert front.status is Status.STOPPED_BY_LIMIT


def test_a_limit_on_solves_leaves_the_cheap_end_open():
    """Two solves give the two dearest members, and everything below the second is open."""
    points = [(10, 5), (20, 4), (30, 3), (40, 2)]
    front = epsilon_constraint_front(finite(points), most_solves=2)
    assert members(front) == [(30, 3), (40, 2)]
    (open_range,) = front.open_ranges
    assert (open_range.low_cost, open_range.bound) == (-math.inf, None)
    assert open_range.high_cost == pytest.approx(0.295)


def test_a_gap_within_the_tolerance_counts_as_proven():
    """The same answers are complete to within a tolerance and open without one."""

    def solve(budget):
        if budget < 1.0:
            return NOTHING
        return BudgetAnswer(status=Status.STOPPED_BY_LIMIT, solution=1, value=2.0, cost=1.0, bound=1.9)

    assert epsilon_constraint_front(solve, tolerance=0.11).complete
    front = epsilon_constraint_front(solve)
    assert [(item.low_cost, item.high_cost, item.bound) for item in front.open_ranges] == [(1.0, math.inf, 1.9)]
    assert front.members[0].gap == pytest.approx(0.1)


@pytest.mark.parametrize(
    ("answer", "message"),
    [
        (BudgetAnswer(status=Status.OPTIMAL), "does not give"),
        (BudgetAnswer(status=Status.INFEASIBLE, solution=1, value=1.0, cost=1.0), "calls the problem infeasible"),
        (BudgetAnswer(status=Status.OPTIMAL, solution=1, cost=1.0), "needs a value"),
        (optimal(1.0, 1.003), "no multiple of 0.01"),
    ],
)
def test_answers_that_contradict_themselves_are_refused(answer, message):
    """No wrong front is made of them."""
    with pytest.raises(ValueError, match=message):
        epsilon_constraint_front(lambda budget: answer)


def test_a_solver_that_overspends_is_refused():
    """It would never come to an end."""
    with pytest.raises(ValueError, match="and spent 2"):
        epsilon_constraint_front(lambda budget: optimal(1.0, 2.0))
    with pytest.raises(ValueError, match="positive step"):
        epsilon_constraint_front(lambda budget: NOTHING, cost_step=0.0)


@pytest.mark.parametrize("seed", range(4))
def test_an_integer_program_gives_the_front_of_all_subsets(seed):
    """Tags of different prices at ten places: HiGHS within the budget against all 1024 subsets."""
    generator = np.random.Generator(np.random.Philox(seed))
    cents, worth = generator.integers(20, 90, 10), generator.integers(1, 30, 10)

    def solve(budget):
        rows = [] if math.isinf(budget) else [LinearConstraint(cents[None, :] / 100, ub=budget)]
        found = milp(-worth.astype(float), constraints=rows, integrality=np.ones(10), bounds=Bounds(0, 1))
        if not found.success:
            return NOTHING
        chosen = np.round(found.x).astype(int)
        return optimal(-float(chosen @ worth), float(chosen @ (cents / 100)))

    subsets = (np.arange(1024)[:, None] >> np.arange(10)) & 1
    points = [(int(row @ cents), -float(row @ worth)) for row in subsets]
    front = epsilon_constraint_front(solve)
    assert members(front) == by_brute_force(points)
    assert front.complete
