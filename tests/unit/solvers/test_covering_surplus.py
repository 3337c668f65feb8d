"""Surplus cuts: beside every choice there is, on tables with known surplus, and what bounds gain by them."""

from dataclasses import replace
from fractions import Fraction

import cvxpy as cp
import numpy as np
import pytest
from covering_cases import everything, grid_case, random_case

from layoutopt.result import Status
from solvers.covering.bounds import cost_bound, cost_value, worth_value
from solvers.covering.problem import CoverProblem, incidence
from solvers.covering.reduction import reduced
from solvers.covering.search import Effort, cheapest
from solvers.covering.surplus import least_surplus, plain_least_surplus, surplus_cuts

QUICK = Effort(steps=2000, iterations=300, window_rounds=0, exact_slots=0)


def pairs_of(count):
    """Return the pairs of some slots as rows: all slots but one are needed, and a row of two sees both."""
    pairs = [[one, other] for one in range(count) for other in range(one + 1, count)]
    ones = np.ones(len(pairs), dtype=np.int64)
    return CoverProblem(sees=incidence(pairs, count), demand=ones, cost=np.ones(count, dtype=np.int64))


@pytest.mark.parametrize("case", range(60))
def test_compiled_and_plain_least_surplus_agree(case):
    """With demands up to three; too few nodes prove no more than there is."""
    draws = np.random.Generator(np.random.Philox([1, case]))
    problem = random_case(draws, slots=9, rows=8, share=0.3 + 0.5 * draws.random(), rules=False, most_demand=3)
    rows = np.flatnonzero(np.diff(problem.sees.start) >= problem.demand)
    table, demand = problem.sees.of_rows(rows), problem.demand[rows]
    truth = plain_least_surplus(table, demand)
    proven, used = least_surplus(table, demand, nodes=100_000)
    assert proven == truth
    for nodes in (0, used // 2):
        partly, looked = least_surplus(table, demand, nodes=nodes)
        assert 0 <= partly <= truth
        assert looked <= nodes


def test_the_surplus_of_known_tables():
    """Of the pairs of four slots three see both; a row that must see all its slots has none to spare."""
    problem = pairs_of(4)
    assert least_surplus(problem.sees, problem.demand, nodes=1000)[0] == 3
    assert least_surplus(incidence([[0, 1, 2]], 3), np.array([3]), nodes=1000)[0] == 0
    assert least_surplus(incidence([[0, 1]], 2), np.array([0]), nodes=1000)[0] == 0
    with pytest.raises(ValueError, match="empty"):
        plain_least_surplus(incidence([[0]], 1), np.array([2]))


def test_a_window_of_a_grid_is_what_an_integer_program_finds():
    """On the middle of a grid, with slots all round: the least sum of cells seen, by cvxpy and HiGHS."""
    from scipy.sparse import csr_array

    problem, places = grid_case(13)
    inside = ((places >= 3) & (places <= 9)).all(axis=1)
    table, demand = problem.sees.of_rows(np.flatnonzero(inside)), problem.demand[inside]
    matrix = csr_array((np.ones(len(table.slot)), table.slot, table.start), shape=(49, 169))
    take = cp.Variable(169, boolean=True)
    model = cp.Problem(cp.Minimize(cp.sum(matrix @ take)), [matrix @ take >= 1])
    model.solve(solver=cp.HIGHS)
    assert 49 + least_surplus(table, demand, nodes=100_000)[0] == round(model.value) == 50


@pytest.mark.parametrize("case", range(40))
def test_every_cover_keeps_every_cut(case):
    """Of all choices of a random problem those that meet every row; bounds with any prices of cuts hold, too."""
    draws = np.random.Generator(np.random.Philox([2, case]))
    problem = random_case(draws, slots=10, rows=40, share=0.25, rules=False, most_demand=2)
    part = reduced(problem, every_row=True).problem
    if not part.row_count:
        return
    cuts = surplus_cuts(part, most_rows=100, nodes=10_000)
    choices = (np.arange(2**part.slot_count)[:, None] >> np.arange(part.slot_count)) % 2 == 1
    covers = [chosen for chosen in choices if not len(part.unmet(chosen))]
    line = cuts.slots.row
    for chosen in covers:
        sums = np.bincount(line, weights=cuts.weight * chosen[cuts.slots.slot], minlength=len(cuts.least))
        assert (sums >= cuts.least).all()
    cheapest_cost = min(part.cost_of(chosen) for chosen in covers)
    price = draws.exponential(draws.choice([0.01, 0.1, 1.0]), part.row_count + len(cuts.least))
    assert cost_value(part, price, cuts) <= cheapest_cost
    assert cost_bound(part, incumbent=cheapest_cost + 1, iterations=300, cuts=cuts).bound <= cheapest_cost


def test_the_random_cases_have_cuts():
    """In most of the cases above some window has a surplus, so that there is something to keep."""
    with_cuts = 0
    for case in range(40):
        draws = np.random.Generator(np.random.Philox([2, case]))
        problem = random_case(draws, slots=10, rows=40, share=0.25, rules=False, most_demand=2)
        part = reduced(problem, every_row=True).problem
        with_cuts += part.row_count > 0 and len(surplus_cuts(part, most_rows=100, nodes=10_000).least) > 0
    assert with_cuts >= 20


def test_cuts_prove_what_the_linear_relaxation_cannot():
    """Five slots in pairs: their relaxation is two and a half, the window of all rows says four."""
    problem = pairs_of(5)
    plain = cost_bound(problem, incumbent=4, iterations=2000)
    cuts = surplus_cuts(problem, most_rows=100, nodes=100_000)
    raised = cost_bound(problem, incumbent=5, iterations=2000, cuts=cuts)
    assert (plain.bound, raised.bound) == (3, 4)
    answer = cheapest(problem, effort=QUICK)
    assert (answer.status, answer.value, answer.bound) == (Status.OPTIMAL, 4, 4)
    answer = cheapest(problem, effort=replace(QUICK, cut_nodes=0))
    assert (answer.status, answer.value, answer.bound) == (Status.BOUNDED, 4, 3)


def test_windows_that_look_alike_are_asked_once():
    """On a grid of 40 x 40 far fewer nodes than windows times nodes are used, and the surplus inside is four."""
    part = reduced(grid_case(40)[0], every_row=True).problem
    cuts = surplus_cuts(part, most_rows=100, nodes=300_000)
    assert len(cuts.least) > 250
    # Most windows lie inside and have 97 cells.
    assert np.median(cuts.least) == 97 + 4
    assert not len(surplus_cuts(part, most_rows=99, nodes=300_000).least)
    assert not len(surplus_cuts(part, most_rows=100, nodes=0).least)
    assert not len(surplus_cuts(part, most_rows=100, nodes=300_000, stop=lambda: True).least)


def exact_cost_value(problem, price):
    """Return the sum in fractions."""
    prices = [Fraction(one) for one in price.tolist()]
    earned = [Fraction(0)] * problem.slot_count
    for row, slot in zip(problem.sees.row.tolist(), problem.sees.slot.tolist(), strict=True):
        earned[slot] += prices[row]
    paid = sum(one * demand for one, demand in zip(prices, problem.demand.tolist(), strict=True))
    return paid + sum(
        min(cost - one, Fraction(0)) for cost, one in zip(problem.cost.tolist(), earned, strict=True)
    )


@pytest.mark.parametrize("size", [1e-9, 1.0, 1e6])
@pytest.mark.parametrize("case", range(10))
def test_no_sum_of_prices_is_rounded(case, size):
    """Prices of few bits have the value that fractions give, to the last bit; others one that is near it."""
    draws = np.random.Generator(np.random.Philox([3, case]))
    problem = random_case(draws, slots=12, rows=20, share=0.4, rules=False, most_cost=10**6)
    price = size * draws.exponential(1.0, problem.row_count)
    short = np.floor(price * 1024.0) / 1024.0
    assert Fraction(cost_value(problem, short)) == exact_cost_value(problem, short)
    value, truth = Fraction(cost_value(problem, price)), exact_cost_value(problem, price)
    largest = Fraction(float(problem.cost.sum() + price @ (problem.demand + np.diff(problem.sees.start))))
    assert abs(value - truth) <= largest / 2**40
    budget = int(problem.cost.sum() // 3)
    assert worth_value(problem, price, budget) >= everything(problem).worthiest(budget)
