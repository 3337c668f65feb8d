"""Parts of the covering chain: compiled code beside its twins, tables, reduction, bounds, lattices, windows."""

from dataclasses import replace

import numpy as np
import pytest
from covering_cases import everything, grid_case, random_case

from solvers.covering import local_search_kernels as kernels
from solvers.covering import single_rows
from solvers.covering.bounds import cost_bound, cost_value, rounded_up, worth_bound, worth_value
from solvers.covering.bounds_kernels import ascend
from solvers.covering.lattices import lattice_starts
from solvers.covering.local_search import searched, state_of, table_of
from solvers.covering.plain_search import NO_BUDGET, PlainSearch
from solvers.covering.problem import CoverProblem, Incidence, from_pairs, incidence
from solvers.covering.reduction import plain_implied, reduced
from solvers.covering.reduction_kernels import implied
from solvers.covering.windows import windows_searched, windows_solved


def draws_of(*key):
    return np.random.Generator(np.random.Philox(list(key)))


def reduced_case(kind, case, *, every_row, slots=24, rows=40, **given):
    """Return what is left of a random problem, and the random numbers to go on with."""
    draws = draws_of(kind, case)
    return reduced(random_case(draws, slots=slots, rows=rows, **given), every_row=every_row).problem, draws


@pytest.mark.parametrize("case", range(40))
def test_compiled_and_plain_local_search_walk_the_same_way(case):
    """Choice, best, weights, numbers, scores and the order of unmet rows are equal all along the walk."""
    every_row = bool(case % 2)
    problem, draws = reduced_case(
        1, case, every_row=every_row, share=0.2, rules=case % 3 > 0, most_demand=1 + case % 4 // 2
    )
    budget = NO_BUDGET if every_row else int(problem.cost.sum() // 4)
    weight = None if every_row else problem.worth
    start = draws.random(problem.slot_count) < 0.1
    if problem.broken_rules(start) or (not every_row and problem.cost_of(start) > budget):
        start[:] = False
    table, state = table_of(problem), state_of(table_of(problem), start, weight=weight)
    plain = PlainSearch(problem, start, weight=weight)

    def check():
        for name in ("chosen", "best", "weight", "stamp", "changed", "numbers"):
            np.testing.assert_array_equal(getattr(state, name), getattr(plain, name), err_msg=name)
        np.testing.assert_array_equal(state.score, plain.scores())
        assert state.unmet_list[: len(plain.unmet)].tolist() == plain.unmet
        assert not problem.broken_rules(state.chosen)

    check()
    kernels.fill(table, state, budget)
    plain.fill(budget)
    kernels.keep_better(state, budget)
    plain.keep_better(budget)
    check()
    for steps in (1, 9, 40):
        words = draws.integers(0, 2**31, steps)
        kernels.search(table, state, budget, words)
        plain.search(budget, words)
        check()


@pytest.mark.parametrize("case", range(40))
def test_compiled_and_plain_search_for_implied_rows_agree(case):
    """Row for row, with and without equal demands; rows that are alike imply each other nowhere."""
    draws = draws_of(2, case)
    problem = random_case(draws, slots=8, rows=30, share=0.3 + 0.4 * draws.random(), rules=False)
    turned = problem.sees.turned()
    found = implied(problem.sees.start, problem.sees.slot, turned.start, turned.slot, problem.demand)
    expected = plain_implied(problem.sees, problem.demand)
    np.testing.assert_array_equal(found, expected)
    assert expected.any()


@pytest.mark.parametrize("case", range(20))
def test_the_ascent_knows_the_value_of_its_prices(case):
    """The compiled value of the best prices is the plain one and no less than the first; prices stay valid."""
    problem, draws = reduced_case(3, case, every_row=True, share=0.3, rules=False)
    turned = problem.sees.turned()
    price = draws.random(problem.row_count)
    first, best = cost_value(problem, price), price.copy()
    value = ascend(
        turned.start,
        turned.slot,
        np.ones(len(turned.slot)),
        problem.demand.astype(np.float64),
        problem.cost.astype(np.float64),
        price,
        np.zeros(problem.row_count),
        best,
        -np.inf,
        float(problem.cost.sum()),
        0.1,
        0.99,
        200,
    )
    assert value == pytest.approx(cost_value(problem, best), rel=1e-12, abs=1e-9)
    assert value >= first - 1e-9
    assert (best >= 0.0).all()
    assert (price >= 0.0).all()


@pytest.mark.parametrize("case", range(60))
def test_any_prices_of_zero_or_more_give_valid_bounds(case):
    """However bad the prices, no cover is cheaper and no choice within a budget worth more."""
    draws = draws_of(4, case)
    problem = random_case(draws, slots=10, rows=12, share=0.5)
    truth = everything(problem)
    for every_row in (True, False):
        small = reduced(problem, every_row=every_row)
        price = draws.exponential(draws.choice([0.1, 1.0, 10.0]), small.problem.row_count)
        if not every_row:
            budget = int(draws.integers(0, problem.cost.sum()))
            value = worth_value(small.problem, price, budget) + small.worth_met
            assert value >= truth.worthiest(budget)
        elif truth.cheapest is not None:
            value = cost_value(small.problem, price)
            assert value <= truth.cheapest
            assert rounded_up(small.problem, value) <= truth.cheapest
        if len(price):
            for nothing in (-1e-3, np.nan, np.inf):
                price[0] = nothing
                with pytest.raises(ValueError, match="below zero"):
                    cost_value(small.problem, price)
                with pytest.raises(ValueError, match="below zero"):
                    worth_value(small.problem, price, 1)


def test_bounds_do_not_charge_for_what_is_there_already():
    """A locked slot is free, so prices that its cost allows would prove too much; such problems are refused."""
    there = replace(grid_case(4)[0], locked=np.arange(16) == 5)
    with pytest.raises(ValueError, match="without locked slots"):
        cost_bound(there, incumbent=9, iterations=0)
    with pytest.raises(ValueError, match="without locked slots"):
        worth_bound(there, 5, incumbent=0, iterations=0)


@pytest.mark.parametrize("case", range(10))
def test_bounds_come_near_the_linear_relaxation(case):
    """By scipy's linear program: never above its value (below it for worth), and within 3 %."""
    from scipy.optimize import linprog
    from scipy.sparse import csr_array

    problem, _ = reduced_case(5, case, every_row=True, slots=30, rows=40, share=0.15, rules=False)
    table = problem.sees
    shape = (table.row_count, problem.slot_count)
    matrix = csr_array((np.ones(len(table.slot)), table.slot, table.start), shape=shape).toarray()
    relaxed = linprog(problem.cost, A_ub=-matrix, b_ub=-problem.demand, bounds=(0, 1)).fun
    found = cost_bound(problem, incumbent=int(np.ceil(1.2 * relaxed)), iterations=3000)
    assert 0.97 * relaxed <= found.value <= relaxed + 1e-6
    assert found.value == cost_value(problem, found.price)
    budget = int(relaxed / 2)
    rows = len(problem.demand)
    limits = np.block([[-matrix, np.diag(problem.demand)], [problem.cost[None, :], np.zeros((1, rows))]])
    gain = np.concatenate([np.zeros(problem.slot_count), -problem.worth])
    best = linprog(gain, A_ub=limits, b_ub=[*np.zeros(rows), budget], bounds=(0, 1)).fun
    bound = worth_bound(problem, budget, incumbent=int(-0.9 * best), iterations=3000)
    assert -best - 1e-6 <= bound.value <= -1.03 * best


def test_a_bound_is_rounded_to_what_costs_can_add_up_to():
    """Costs of 20 and 30 add up to multiples of ten; a value is exact, so the least above a multiple counts."""
    problem = CoverProblem(
        sees=incidence([[0], [1]], 2), demand=np.array([1, 1]), cost=np.array([20, 30]), worth=np.array([1, 1])
    )
    assert [rounded_up(problem, value) for value in (30.0, 30.0 + 1e-10, 40.0, 0.0)] == [30, 40, 40, 0]


@pytest.mark.parametrize("case", range(60))
def test_reduction_keeps_the_best_values(case):
    """What is left has the same best value as the whole, and its choices are choices of the whole."""
    draws = draws_of(6, case)
    problem = random_case(draws, slots=9, rows=14, share=0.45)
    truth = everything(problem)
    small = reduced(problem, every_row=False)
    budget = int(draws.integers(0, problem.cost.sum()))
    assert everything(small.problem).worthiest(budget) + small.worth_met == truth.worthiest(budget)
    small = reduced(problem, every_row=True)
    if not len(small.lost):
        assert everything(small.problem).cheapest == truth.cheapest
    chosen = np.zeros(small.problem.slot_count, dtype=np.bool_)
    assert problem.broken_rules(small.whole(chosen)) == []
    assert small.part(small.whole(~chosen)).all()


def test_windows_never_break_a_cover_and_never_make_it_dearer():
    """With demands, rules and costs, from greedy covers; some of them get cheaper."""
    covers, cheaper = 0, 0
    for case in range(30):
        problem, _ = reduced_case(7, case, every_row=True, slots=40, rows=50, share=0.12, most_cost=9)
        cover = searched(problem, [], steps=0, seed=0)
        if cover is None:
            continue
        found = windows_solved(problem, cover, slots=15, rounds=2)
        assert not len(problem.unmet(found))
        assert problem.broken_rules(found) == []
        assert problem.cost_of(found) <= problem.cost_of(cover)
        covers += 1
        cheaper += problem.cost_of(found) < problem.cost_of(cover)
    assert covers >= 10
    assert cheaper >= 5


def test_a_window_as_large_as_the_problem_solves_it():
    """The greedy cover of a grid becomes the best one."""
    problem, _ = grid_case(8)
    greedy = searched(problem, [], steps=0, seed=0)
    found = windows_solved(problem, greedy, slots=64, rounds=1)
    assert (problem.cost_of(greedy), problem.cost_of(found)) == (6, 4)
    assert not len(problem.unmet(found))
    stopped = windows_solved(problem, greedy, slots=64, rounds=1, stop=lambda: True)
    np.testing.assert_array_equal(stopped, greedy)


def test_lattices_keep_rules_and_cover_the_inside():
    """On a grid of 30 x 30 the best lattice leaves few rows unmet and takes about one slot in twenty."""
    problem, places = grid_case(30)
    starts = lattice_starts(problem, places, most=4)
    assert len(starts) == 4
    assert all(0.04 * 900 < start.sum() < 0.08 * 900 for start in starts)
    assert min(len(problem.unmet(start)) for start in starts) < 90
    pairs = np.array([[slot, slot + 1] for slot in range(899)])
    ruled = CoverProblem(sees=problem.sees, demand=problem.demand, cost=problem.cost, conflicts=pairs)
    assert all(ruled.broken_rules(start) == [] for start in lattice_starts(ruled, places, most=4))


def test_no_step_at_all_gives_the_greedy_cover():
    """A cover that is found before the first step or by the last one is not forgotten."""
    problem, _ = grid_case(10)
    greedy = searched(problem, [], steps=0, seed=0)
    assert not len(problem.unmet(greedy))
    costs = [problem.cost_of(searched(problem, [], steps=steps, seed=0)) for steps in range(0, 40, 3)]
    assert costs == sorted(costs, reverse=True)
    assert costs[-1] < costs[0]


def test_a_walk_within_a_budget_beats_the_greedy_choice():
    """With worths from 1 to 1000, and with costs from 50 to 200 as well; no step gives the greedy choice."""
    draws = draws_of(10)
    grid, _ = grid_case(16)
    worth = draws.integers(1, 1001, 256)
    for cost, budget in ((grid.cost, 12), (draws.integers(50, 201, 256), 900)):
        problem = CoverProblem(sees=grid.sees, demand=grid.demand, cost=cost, worth=worth)
        greedy, walked = (searched(problem, [], steps=steps, seed=0, budget=budget) for steps in (0, 20_000))
        assert problem.cost_of(walked) <= budget
        assert problem.worth_of(walked) > problem.worth_of(greedy)
        enough = problem.worth_of(greedy)
        np.testing.assert_array_equal(
            searched(problem, [], steps=20_000, seed=0, budget=budget, enough=enough), greedy
        )


def test_a_search_refuses_what_it_cannot_keep():
    """Locked or forbidden slots, full groups, broken starts and budgets below zero are refused in words."""
    sees, one = incidence([[0, 1]], 2), np.ones(1, dtype=np.int64)
    cost = np.ones(2, dtype=np.int64)
    yes, no = np.array([True, True]), np.array([False, False])
    pairs = np.array([[0, 1]])
    for given in ({"locked": yes}, {"forbidden": yes}, {"group": np.zeros(2, int), "capacity": np.zeros(1, int)}):
        with pytest.raises(ValueError, match="taken out before the search"):
            searched(CoverProblem(sees=sees, demand=one, cost=cost, **given), [], steps=1, seed=0)
    ruled = CoverProblem(sees=sees, demand=one, cost=cost, conflicts=pairs)
    with pytest.raises(ValueError, match="start breaks a rule: slots 0 and 1"):
        searched(ruled, [yes], steps=1, seed=0)
    with pytest.raises(ValueError, match="budget is zero or more"):
        searched(ruled, [no], steps=1, seed=0, budget=-1)


@pytest.mark.parametrize(
    ("given", "text"),
    [
        ({"demand": np.array([1])}, "demand has shape"),
        ({"cost": np.array([1, 1])}, "cost has shape"),
        ({"worth": np.array([1, 1, 1])}, "worth has shape"),
        ({"locked": np.array([True])}, "locked has shape"),
        ({"group": np.array([0])}, "group has shape"),
        ({"conflicts": np.array([0, 1])}, "conflicts has shape"),
        ({"cost": np.array([1, -1, 1])}, "costs positive"),
        ({"cost": np.array([1, 0, 1])}, "costs positive"),
        ({"demand": np.array([1, -1])}, "zero or more"),
        ({"cost": np.array([1.5, 1.0, 1.0])}, "cost must be whole numbers"),
        ({"locked": np.array([0, 1, 0])}, "locked must be true or false"),
        ({"conflicts": np.array([[0, 3]])}, "conflicts name slots 0 to 3"),
        ({"conflicts": np.array([[1, 1]])}, "excludes itself"),
        ({"group": np.array([0, 1, -1]), "capacity": np.array([1])}, "every group needs a capacity"),
        ({"locked": np.array([True] * 3), "forbidden": np.array([True] * 3)}, "locked and forbidden at once"),
        ({"locked": np.array([True] * 3), "conflicts": np.array([[0, 2]])}, "slots 0 and 2 exclude each other"),
        (
            {"locked": np.array([True] * 3), "group": np.array([0, 0, 0]), "capacity": np.array([2])},
            "group 0 has 3 slots and takes 2",
        ),
        ({"worth": np.array([2**25, 1]), "cost": np.array([2**20, 1, 1])}, "too large"),
        ({"worth": np.array([2**62, 2**62])}, "too large"),
        ({"worth": np.array([0, 0]), "cost": np.array([2**40, 1, 1])}, "too large"),
    ],
)
def test_a_faulty_problem_is_refused_in_words(given, text):
    """Shapes, kinds, ranges and contradictions among locked slots."""
    plain = {"demand": np.array([1, 1]), "cost": np.array([1, 1, 1])}
    with pytest.raises(ValueError, match=text):
        CoverProblem(sees=incidence([[0, 1], [1, 2]], 3), **{**plain, **given})


@pytest.mark.parametrize(
    ("start", "slot", "text"),
    [
        ([0, 2], [0, 3], "slots are 0 to 2"),
        ([0, 2], [-1, 2], "slots are 0 to 2"),
        ([0, 2], [1, 0], "must rise"),
        ([0, 2], [1, 1], "must rise"),
        ([0, 1], [1, 2], "start must rise"),
        ([0, 2, 1], [1], "start must rise"),
        ([], [], "start must rise"),
    ],
)
def test_a_table_that_is_none_is_refused(start, slot, text):
    """Compiled code would read past the end of a faulty table."""
    with pytest.raises(ValueError, match=text):
        Incidence(start=np.array(start, dtype=np.int64), slot=np.array(slot, dtype=np.int64), slot_count=3)


def test_tables_turn_count_and_pick_rows():
    """Against a dense matrix."""
    draws = draws_of(8)
    for _ in range(20):
        rows, slots = int(draws.integers(1, 9)), int(draws.integers(1, 9))
        dense = draws.random((rows, slots)) < 0.4
        row, slot = np.nonzero(dense)
        order = draws.permutation(np.repeat(np.arange(len(row)), 2))
        table = from_pairs(row[order], slot[order], rows, slots)
        turned, chosen = table.turned(), draws.random(slots) < 0.5
        back = np.zeros((slots, rows), dtype=np.bool_)
        back[turned.row, turned.slot] = True
        np.testing.assert_array_equal(back, dense.T)
        np.testing.assert_array_equal(table.counts(chosen), dense[:, chosen].sum(axis=1))
        some = draws.integers(0, rows, 5)
        np.testing.assert_array_equal(table.of_rows(some).counts(chosen), dense[some][:, chosen].sum(axis=1))
        lists = incidence([np.flatnonzero(line) for line in dense], slots)
        np.testing.assert_array_equal(lists.slot, table.slot)
        np.testing.assert_array_equal(lists.start, table.start)
    with pytest.raises(ValueError, match="twice"):
        incidence([[1, 1]], 3)


def test_a_row_is_lost_only_if_that_is_decided(monkeypatch):
    """A ring of seven rivals lends three slots, never four; with no try to spend the question stays open."""
    ring = np.array([[slot, (slot + 1) % 7] for slot in range(7)])
    usable, room = np.ones(7, dtype=np.bool_), np.empty(0, dtype=np.int64)

    def lost(count):
        demand = np.array([count])
        sees = incidence([range(7)], 7)
        problem = CoverProblem(sees=sees, demand=demand, cost=np.ones(7, dtype=np.int64), conflicts=ring)
        return bool(single_rows.unmeetable(problem, usable, demand, room)[0])

    assert [lost(count) for count in (1, 3, 4, 8)] == [False, False, True, True]
    monkeypatch.setattr(single_rows, "_TRIES", 0)
    assert [lost(count) for count in (4, 8)] == [False, True]


def test_windows_that_are_searched_keep_the_cover_and_lower_its_cost():
    """With demands, rules and costs; the same seed gives the same cover."""
    cheaper = 0
    for case in range(30):
        problem, _ = reduced_case(9, case, every_row=True, slots=60, rows=60, share=0.1, most_cost=9)
        cover = searched(problem, [], steps=0, seed=0)
        if cover is None:
            continue
        found, again = (windows_searched(problem, cover, slots=25, steps=200, seed=3) for _ in range(2))
        np.testing.assert_array_equal(found, again)
        assert not len(problem.unmet(found))
        assert problem.broken_rules(found) == []
        assert problem.cost_of(found) <= problem.cost_of(cover)
        cheaper += problem.cost_of(found) < problem.cost_of(cover)
    assert cheaper >= 3
