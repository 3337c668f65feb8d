"""Covers by integer programming: beside scipy's call of HiGHS, on known cases, and with a solver that fails."""

import itertools
import math
import sys
from dataclasses import replace
from types import SimpleNamespace

import cvxpy as cp
import numpy as np
import pytest
from covering_cases import grid_case, random_case, scipy_cheapest, scipy_rules
from scipy.optimize import LinearConstraint, milp
from scipy.sparse import diags_array, hstack

from layoutopt.result import Status
from solvers.covering.integer import cheapest_cover, missing_solver, worthiest_choice
from solvers.covering.problem import CoverProblem, incidence
from solvers.covering.search import Effort, cheapest, worthiest

LIMITED = Effort(steps=2000, iterations=300, window_rounds=0)


def scipy_worthiest(problem, budget):
    columns = problem.slot_count + problem.row_count
    matrix, rules, bounds = scipy_rules(problem, columns)
    rules.append(LinearConstraint(hstack([matrix, -diags_array(problem.demand.astype(float))]), 0.0, np.inf))
    cost = np.concatenate([np.where(problem.locked, 0, problem.cost), np.zeros(problem.row_count)])
    rules.append(LinearConstraint(cost, -np.inf, budget))
    gain = np.concatenate([np.zeros(problem.slot_count), -problem.worth])
    return -round(milp(gain, constraints=rules, bounds=bounds, integrality=np.ones(columns)).fun)


@pytest.mark.parametrize("case", range(25))
def test_integer_programs_and_the_whole_chain_agree_with_scipy(case):
    """Thirty to sixty slots with all rules: our two models, the chain over them, and a third one."""
    draws = np.random.Generator(np.random.Philox([1, case]))
    slots = int(draws.integers(30, 61))
    problem = random_case(draws, slots=slots, rows=40, share=0.15, most_cost=9)
    best = scipy_cheapest(problem)
    answer = cheapest_cover(problem)
    chained = cheapest(problem, effort=LIMITED)
    assert answer.proven
    if best is None:
        assert answer.chosen is None
        assert answer.bound == math.inf
        assert chained.status is Status.INFEASIBLE
    else:
        assert problem.cost_of(answer.chosen) == best == pytest.approx(answer.bound)
        assert (chained.status, chained.value) == (Status.OPTIMAL, best)
        assert cheapest_cover(problem, below=best + 1).proven
        cheaper = cheapest_cover(problem, below=best)
        assert (cheaper.chosen, cheaper.bound, cheaper.proven) == (None, math.inf, True)
    budget = int(draws.integers(1, problem.cost.sum() // 4))
    worth = scipy_worthiest(problem, budget)
    answer = worthiest_choice(problem, budget)
    assert answer.proven
    assert problem.cost_of(answer.chosen) <= budget
    assert problem.worth_of(answer.chosen) == worth == pytest.approx(answer.bound)
    chained = worthiest(problem, budget, effort=LIMITED)
    assert (chained.status, chained.value) == (Status.OPTIMAL, worth)


@pytest.mark.parametrize(("side", "fewest"), [(8, 4), (10, 7)])
def test_small_grids_have_their_known_covers(side, fewest):
    """Scipy's program gives the number too; the chain proves it."""
    problem, places = grid_case(side)
    assert scipy_cheapest(problem) == fewest
    answer = cheapest(problem, places=places, effort=LIMITED)
    assert (answer.status, answer.value, answer.bound, answer.gap) == (Status.OPTIMAL, fewest, fewest, 0.0)


def every_pair():
    """Return rows that are the pairs of five slots: four slots cover them, equal prices prove three."""
    pairs = list(itertools.combinations(range(5), 2))
    ones = np.ones(10, dtype=np.int64)
    return CoverProblem(sees=incidence(pairs, 5), demand=ones, cost=ones[:5], worth=np.arange(1, 11))


def solve_as(status, values, bound, primal=2):
    """Return a stand-in for cvxpy's solve that fills in what a solver might say."""

    def solve(model, **_options):
        for variable in model.variables():
            variable.save_value(np.resize(np.asarray(values, dtype=np.float64), variable.shape))
        model._status = status
        extra = SimpleNamespace(mip_dual_bound=bound, primal_solution_status=primal)
        model._solver_stats = SimpleNamespace(extra_stats=extra)

    return solve


def fails(_model, **_options):
    raise cp.error.SolverError("no licence for today")


FAULTS = {
    "raises": (fails, "HiGHS gave up: no licence for today"),
    "zeros": (solve_as(cp.USER_LIMIT, [0.0], 0.0, primal=0), "stopped by its limit before it had any solution"),
    "zeros called optimal": (solve_as(cp.OPTIMAL, [0.0], 0.0), "does not meet every row"),
    "halves": (solve_as(cp.OPTIMAL, [0.5], 1.5), "values that are not whole"),
    "no numbers": (solve_as(cp.OPTIMAL, [math.nan], 1.5), "values that are not whole"),
    "a proof of less than its choice": (solve_as(cp.OPTIMAL, [1.0], 1.0), "does not agree"),
    "a bound above its choice": (solve_as(cp.USER_LIMIT, [1.0], 7.0), "does not agree"),
    "unbounded": (solve_as(cp.UNBOUNDED, [0.0], -math.inf), "ended with 'unbounded'"),
}


@pytest.mark.parametrize("fault", FAULTS)
def test_a_solver_that_fails_is_told_and_believed_in_nothing(monkeypatch, fault):
    """Neither choice nor proof comes of it; the chain answers from search and prices and says what happened."""
    solve, text = FAULTS[fault]
    monkeypatch.setattr(cp.Problem, "solve", solve)
    answer = cheapest_cover(every_pair())
    assert answer.chosen is None
    assert not answer.proven
    assert text in answer.message
    chained = cheapest(every_pair(), effort=Effort(steps=100, iterations=0, cut_nodes=0))
    assert chained.status is Status.BOUNDED
    assert (chained.value, chained.bound) == (4, 3)
    assert text in chained.message


def test_a_solver_that_finds_none_of_the_known_choices_proves_nothing(monkeypatch):
    """It is asked for choices that cost no more than the known one, so it ought to find that one at least."""

    def finds_none(model, **_options):
        model._status = cp.INFEASIBLE

    monkeypatch.setattr(cp.Problem, "solve", finds_none)
    answer = cheapest(every_pair(), effort=Effort(steps=100, iterations=0, cut_nodes=0))
    assert (answer.status, answer.value, answer.bound) == (Status.BOUNDED, 4, 3)
    assert answer.message == "HiGHS found no choice where one is known"


@pytest.mark.parametrize("fault", ["raises", "zeros", "halves", "no numbers", "unbounded"])
def test_a_failing_solver_leaves_the_worthiest_choice_to_the_search(monkeypatch, fault):
    """The choice keeps the budget, and the message says why nothing is proven."""
    solve, text = FAULTS[fault]
    monkeypatch.setattr(cp.Problem, "solve", solve)
    answer = worthiest_choice(every_pair(), 1)
    assert (answer.chosen, answer.proven) == (None, False)
    assert text in answer.message
    chained = worthiest(every_pair(), 1, effort=Effort(steps=100, iterations=0))
    assert chained.status is Status.BOUNDED
    assert (chained.value, chained.bound) == (4 + 7 + 9 + 10, 55)
    assert text in chained.message or "a known choice disproves" in chained.message


@pytest.mark.parametrize(
    ("values", "bound", "text"),
    [([1.0], -55.0, "breaks a rule or the budget"), ([0.0], -55.0, "does not agree")],
)
def test_a_wrong_worthiest_choice_is_refused(monkeypatch, values, bound, text):
    """All slots cost too much, no slot is worth what was claimed."""
    monkeypatch.setattr(cp.Problem, "solve", solve_as(cp.OPTIMAL, values, bound))
    answer = worthiest_choice(every_pair(), 1)
    assert (answer.chosen, answer.proven) == (None, False)
    assert text in answer.message


def test_no_choice_is_said_only_after_the_second_question(monkeypatch):
    """A presolve that wrongly finds no choice is overruled; a second failure leaves the question open."""
    presolves, solve = [], cp.Problem.solve

    def wrong_at_first(model, **options):
        presolves.append(options["presolve"])
        if options["presolve"] == "choose":
            model._status = cp.INFEASIBLE
        else:
            solve(model, **options)

    monkeypatch.setattr(cp.Problem, "solve", wrong_at_first)
    answer = cheapest_cover(every_pair())
    assert presolves == ["choose", "off"]
    assert (answer.bound, answer.proven) == (4.0, True)
    assert answer.chosen.sum() == 4

    def fails_at_second(model, **options):
        if options["presolve"] == "off":
            fails(model)
        model._status = cp.INFEASIBLE

    monkeypatch.setattr(cp.Problem, "solve", fails_at_second)
    answer = cheapest_cover(every_pair())
    assert (answer.chosen, answer.proven) == (None, False)
    assert answer.message == "HiGHS found no choice, and asked again: HiGHS gave up: no licence for today"


def lines_of(dimension):
    """Return the lines of the affine space over three elements as rows, its points as slots."""
    points = list(itertools.product(range(3), repeat=dimension))
    lines = {
        frozenset(points.index(tuple((np.array(point) + step * np.array(way)) % 3)) for step in range(3))
        for point in points
        for way in points
        if any(way)
    }
    ones = np.ones(len(lines), dtype=np.int64)
    return CoverProblem(
        sees=incidence(sorted(sorted(line) for line in lines), 3**dimension),
        demand=ones,
        cost=ones[: 3**dimension],
    )


def test_limits_leave_a_bound_and_no_proof():
    """Points that meet every line: 5 of a plane; 18 of space (all but a largest cap), which takes many nodes."""
    assert cheapest(lines_of(2), effort=LIMITED).value == 5
    problem = lines_of(3)
    answer = cheapest_cover(problem, nodes=1)
    assert not answer.proven
    assert 9.0 <= answer.bound < 18.0
    assert "stopped by its limit" in answer.message
    if answer.chosen is not None:
        assert not len(problem.unmet(answer.chosen))
    chained = cheapest(problem, effort=replace(LIMITED, exact_nodes=1))
    assert (chained.status, chained.value) == (Status.BOUNDED, 18)
    assert chained.bound >= np.ceil(answer.bound)
    assert "stopped by its limit" in chained.message
    assert not cheapest_cover(problem, seconds=0.0).proven


def test_programs_without_anything_to_decide_need_no_solver(monkeypatch):
    """Locked slots that meet everything, no slots, hopeless rows."""
    monkeypatch.setattr(cp.Problem, "solve", fails)
    one = np.ones(1, dtype=np.int64)
    locked = CoverProblem(sees=incidence([[0]], 1), demand=one, cost=one, locked=np.array([True]))
    assert cheapest_cover(locked).chosen.tolist() == [True]
    assert cheapest_cover(locked, below=0).chosen is None
    assert worthiest_choice(locked, 0).bound == 1.0
    nowhere = CoverProblem(sees=incidence([[]], 0), demand=one, cost=one[:0])
    assert cheapest_cover(nowhere).bound == math.inf
    answer = worthiest_choice(nowhere, 0)
    assert (answer.chosen.size, answer.bound, answer.proven) == (0, 0.0, True)
    with pytest.raises(ValueError, match="budget is zero or more"):
        worthiest_choice(locked, -1)


def test_a_missing_solver_is_named(monkeypatch):
    """Whether cvxpy or HiGHS is missing."""
    assert missing_solver() == ""
    monkeypatch.setattr(cp, "installed_solvers", lambda: ["CLARABEL"])
    assert "install highspy" in missing_solver()
    assert cheapest_cover(every_pair()).message == missing_solver()
    monkeypatch.setitem(sys.modules, "cvxpy", None)
    assert "cvxpy cannot be imported" in missing_solver()
    assert worthiest_choice(every_pair(), 1).message == missing_solver()
