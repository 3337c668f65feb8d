"""Answers to covering problems: beside every choice there is, and what is said where something is missing."""

import sys
from dataclasses import replace

import numpy as np
import pytest
from covering_cases import everything, grid_case, random_case

from layoutopt.result import Status
from solvers.covering.local_search import searched
from solvers.covering.problem import CoverProblem, incidence
from solvers.covering.search import Effort, cheapest, worthiest

QUICK = Effort(steps=300, iterations=200, window_slots=6)
CASES = range(300)


def small_case(kind, case):
    """Return a random problem of at most twelve slots, with all its choices, and numbers to go on with."""
    draws = np.random.Generator(np.random.Philox([kind, case]))
    problem = random_case(
        draws,
        slots=int(draws.integers(3, 13)),
        rows=int(draws.integers(1, 15)),
        share=0.3 + 0.5 * draws.random(),
        most_demand=int(draws.integers(1, 4)),
    )
    return problem, everything(problem), draws


def simple(rows, slot_count, **given):
    sees = incidence(rows, slot_count)
    defaults = {
        "demand": np.ones(sees.row_count, dtype=np.int64),
        "cost": np.ones(slot_count, dtype=np.int64),
    }
    return CoverProblem(sees=sees, **{**defaults, **given})


@pytest.mark.parametrize("case", CASES)
def test_the_cheapest_choice_is_that_of_brute_force(case):
    """Value, status, bound and lost rows are those found by trying every choice."""
    problem, truth, draws = small_case(1, case)
    best = truth.cheapest
    budget = None if draws.random() < 0.5 else int(draws.integers(0, problem.cost.sum() + 1))
    answer = cheapest(problem, budget=budget, effort=QUICK)
    if best is None:
        assert answer.status is Status.INFEASIBLE
        assert answer.chosen is None
        assert answer.message
    elif budget is not None and best > budget:
        assert answer.status is Status.BUDGET_TOO_SMALL
        assert answer.chosen is None
        assert budget < answer.bound <= best
        assert str(answer.bound - budget) in answer.message
    else:
        assert (answer.status, answer.value, answer.bound) == (Status.OPTIMAL, best, best)
        assert answer.message == ""
        assert not len(problem.unmet(answer.chosen))
        assert problem.broken_rules(answer.chosen) == []
        assert problem.cost_of(answer.chosen) == best
    assert answer.lost.tolist() == truth.lost.tolist()


@pytest.mark.parametrize("case", CASES)
def test_the_worthiest_choice_is_that_of_brute_force(case):
    """Worth, bound and lost rows are those found by trying every choice, and the budget is kept."""
    problem, truth, draws = small_case(2, case)
    budget = int(draws.integers(0, max(problem.cost.sum() // 2, 1)))
    answer = worthiest(problem, budget, effort=QUICK)
    best = truth.worthiest(budget)
    assert (answer.status, answer.value, answer.bound) == (Status.OPTIMAL, best, best)
    assert problem.broken_rules(answer.chosen) == []
    assert problem.cost_of(answer.chosen) <= budget
    assert problem.worth_of(answer.chosen) == best
    assert answer.lost.tolist() == truth.lost.tolist()


@pytest.mark.parametrize("case", range(20))
def test_without_an_exact_finish_bounds_still_hold(case):
    """Local search and prices alone: no value beats the truth, and no bound is on its wrong side."""
    effort = Effort(steps=300, iterations=200, window_rounds=0, exact_slots=0)
    problem, truth, draws = small_case(3, case)
    if truth.cheapest is not None:
        answer = cheapest(problem, effort=effort)
        assert answer.bound <= truth.cheapest
        assert answer.value is None or answer.value >= truth.cheapest
    budget = int(draws.integers(0, problem.cost.sum()))
    answer = worthiest(problem, budget, effort=effort)
    assert answer.value <= truth.worthiest(budget) <= answer.bound


def test_a_row_whose_slots_exclude_each_other_is_lost():
    """Two slots are enough by their number; the rule between them says that they are not."""
    problem = simple(
        [[0, 1], [2]], 3, demand=np.array([2, 1]), conflicts=np.array([[0, 1]]), worth=np.array([5, 7])
    )
    answer = cheapest(problem, effort=QUICK)
    assert answer.status is Status.INFEASIBLE
    assert answer.lost.tolist() == [0]
    answer = worthiest(problem, 3, effort=QUICK)
    assert (answer.value, answer.bound, answer.lost.tolist()) == (7, 7, [0])


def test_rules_that_leave_no_choice_are_told_apart_from_lost_rows():
    """Each row could be met alone, both cannot."""
    answer = cheapest(simple([[0], [1]], 2, conflicts=np.array([[0, 1]])), effort=QUICK)
    assert answer.status is Status.INFEASIBLE
    assert answer.lost.size == 0
    assert "rules between slots" in answer.message


def test_a_problem_of_nothing_is_answered():
    """Without rows, or with all of them met by locked slots, the answer costs nothing."""
    empty = simple([], 0)
    assert cheapest(empty).status is Status.OPTIMAL
    assert worthiest(empty, 0).value == 0
    met = simple([[0]], 2, locked=np.array([True, False]), worth=np.array([3]))
    answer = cheapest(met, budget=0)
    assert (answer.status, answer.value, answer.chosen.tolist()) == (Status.OPTIMAL, 0, [True, False])
    assert worthiest(met, 0).value == 3


def test_a_budget_below_zero_is_misuse():
    """There is no such choice, and no such question."""
    problem = simple([[0]], 1)
    for ask in (lambda: cheapest(problem, budget=-1), lambda: worthiest(problem, -1)):
        with pytest.raises(ValueError, match="budget is zero or more"):
            ask()


def test_the_random_cases_are_of_every_kind():
    """Among them are lost rows, also some that only rules between slots lose, contradictions and short budgets."""
    kinds = {"lost": 0, "lost by rules": 0, "contradiction": 0, "answer": 0}
    for case in CASES:
        problem, truth, _ = small_case(1, case)
        kinds["lost"] += truth.lost.size > 0
        kinds["lost by rules"] += truth.lost.size > problem.hopeless().size
        kinds["contradiction"] += truth.cheapest is None and not truth.lost.size
        kinds["answer"] += truth.cheapest is not None
    assert min(kinds.values()) >= 5


def test_the_same_seed_gives_the_same_choice_and_another_may_give_another():
    """Every answer covers; over six seeds more than one choice comes up."""
    problem, places = grid_case(12)
    effort = Effort(steps=3000, iterations=300, exact_slots=0)

    def chosen(seed):
        answer = cheapest(problem, places=places, effort=replace(effort, seed=seed))
        assert not len(problem.unmet(answer.chosen))
        return answer.chosen.tobytes()

    assert chosen(0) == chosen(0)
    assert len({chosen(seed) for seed in range(6)}) > 1


def test_a_search_that_is_stopped_says_so_and_shows_a_cover():
    """Stopped at the first question: the choice covers, the bound holds, and the status is that of a limit."""
    problem, places = grid_case(14)
    asked = []

    def stop():
        asked.append(True)
        return True

    answer = cheapest(problem, places=places, stop=stop)
    assert answer.status is Status.STOPPED_BY_LIMIT
    assert asked
    assert not len(problem.unmet(answer.chosen))
    assert 0 < answer.bound < answer.value == problem.cost_of(answer.chosen)
    answer = worthiest(problem, 5, places=places, stop=stop)
    assert answer.status is Status.STOPPED_BY_LIMIT
    assert answer.value == problem.worth_of(answer.chosen) < answer.bound
    assert problem.cost_of(answer.chosen) <= 5


def test_starts_are_used_and_faulty_ones_left_out():
    """With no step to go the better of greedy choice and start is the answer; a faulty start is left out."""
    rows = [[0, 1], [0, 2], [1, 3], [2, 3], [0], [3]]
    problem = simple(rows, 4, conflicts=np.array([[1, 2]]))
    effort = Effort(steps=0, iterations=50, window_rounds=0, exact_slots=0)
    good, faulty = np.array([True, False, False, True]), np.array([True, True, True, True])
    answer = cheapest(problem, starts=[faulty, good], effort=effort)
    assert (answer.value, answer.status) == (2, Status.OPTIMAL)


@pytest.mark.parametrize(("budget", "status"), [(None, Status.BOUNDED), (9, Status.TARGET_NOT_MET)])
def test_without_cvxpy_the_answer_comes_from_search_and_bound(monkeypatch, budget, status):
    """The choice covers, the bound holds, and the message says what was not done and why."""
    monkeypatch.setitem(sys.modules, "cvxpy", None)
    problem, places = grid_case(12)
    answer = cheapest(problem, budget=budget, places=places, effort=Effort(steps=3000, iterations=500))
    assert answer.status is status
    assert answer.value == problem.cost_of(answer.chosen)
    assert not len(problem.unmet(answer.chosen))
    assert 0 < answer.bound < answer.value
    assert "cvxpy cannot be imported" in answer.message
    answer = worthiest(problem, 3, places=places, effort=Effort(steps=3000, iterations=50))
    assert answer.status is Status.BOUNDED
    assert "cvxpy cannot be imported" in answer.message


def test_a_problem_too_large_for_one_walk_is_searched_region_by_region():
    """The answer covers, beats the greedy one and is the same again."""
    problem, places = grid_case(24)
    effort = Effort(
        walk_slots=500, region_slots=200, region_steps=2000, iterations=300, window_rounds=0, exact_slots=0
    )
    answers = [cheapest(problem, places=places, effort=effort) for _ in range(2)]
    greedy = searched(problem, [], steps=0, seed=0)
    assert answers[0].bound < answers[0].value < problem.cost_of(greedy)
    assert not len(problem.unmet(answers[0].chosen))
    np.testing.assert_array_equal(answers[0].chosen, answers[1].chosen)
