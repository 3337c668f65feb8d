"""Global search on made-up outcomes whose best layout is known, and what it refuses."""

import math
from dataclasses import replace

import numpy as np
import pytest

from layoutopt.feasibility import check
from layoutopt.problem import Limit
from layoutopt.protocols import Evaluation, Failure
from layoutopt.result import Status
from layoutopt.scores import TrialOutcomes
from layoutopt.spec.reading import read_spec
from solvers.exhaustive import screen
from solvers.global_search import GlobalSearch
from solvers.search_stages import FRESH
from solvers.stop import Never

LISTS = """
schema = 1
[site]
floor = [[0,0],[4,0],[4,3],[0,3]]
[robots]
outline = [["-0.2 m","-0.2 m"],["0.2 m","-0.2 m"],["0.2 m","0.2 m"],["-0.2 m","0.2 m"]]
[parts]
reader_profile = "mi2016"
[space]
antenna_side = "40 mm"
antenna_height = "20 mm"
antennas_per_module = 1
readers = [{ family = "ring", count = [3, 4, 5, 6, 8], radius = ["80 mm", "110 mm", "150 mm"] }]
patterns = [{ family = "square", pitch = ["100 mm", "150 mm", "200 mm", "250 mm", "300 mm"] }]
[study]
duration = "5 s"
"""
RANGES = (
    LISTS.replace('["80 mm", "110 mm", "150 mm"]', '{ from = "80 mm", to = "150 mm" }')
    .replace('["100 mm", "150 mm", "200 mm", "250 mm", "300 mm"]', '{ from = "100 mm", to = "300 mm" }')
    .replace("[3, 4, 5, 6, 8]", "{ from = 3, to = 8 }")
)
SMALL = GlobalSearch(
    population=12, generations=12, replications=2, race_trials=8, polish_evaluations=30, fresh_trials=4, seed=2
)


@pytest.fixture
def problem_of(tmp_path):
    """Return the problem of a spec with a budget."""

    def of(text, budget_eur=math.inf):
        path = tmp_path / "spec.toml"
        path.write_text(text, encoding="utf-8")
        problem = read_spec(path).problem()
        limits = (Limit(score="cost", upper=budget_eur),) if budget_eur < math.inf else ()
        return replace(problem, limits=limits)

    return of


def true_error_m(layout):
    """Return the made-up error: least for a ring of 5 at 120 mm, and smaller the more tags there are."""
    ring, pattern = layout.readers[0].parameters, layout.floor_tags.zones[0].pattern.parameters
    off = ((ring["radius_m"] - 0.12) / 0.05) ** 2 + 0.3 * (ring["count"] - 5) ** 2
    return 0.01 * (1.0 + off) * (1.0 + 2.0 * pattern["pitch_m"])


class MadeUp:
    """Gives outcomes of a formula with noise that layouts have in common, and keeps the tasks."""

    def __init__(self, error_m=true_error_m, failing=()):
        self.tasks, self._error_m, self._failing = [], error_m, failing

    def __call__(self, tasks):
        self.tasks += tasks
        return [self._run(task) for task in tasks]

    def _run(self, task):
        if task.layout.key in self._failing:
            return Failure(group=task.group, first=task.first, message="a wheel came off")
        numbers = np.arange(task.first, task.first + task.count)
        noise = np.array([np.random.Generator(np.random.Philox(n)).uniform(0.9, 1.1) for n in numbers])
        return Evaluation(
            group=task.group,
            first=task.first,
            seconds=0.0,
            outcomes=TrialOutcomes(
                replications=numbers,
                columns=("position_error_mean",),
                values=(self._error_m(task.layout) * noise)[:, None],
            ),
        )


def enumerated_best(problem):
    """Return the layout with the least true error of all that can be built within the limits."""
    return min((item.evaluated.layout for item in screen(problem) if not item.refusal), key=true_error_m)


@pytest.mark.parametrize("budget_eur", [math.inf, 900.0])
@pytest.mark.parametrize("method", ["differential_evolution", "dual_annealing", "direct"])
def test_on_lists_of_values_it_finds_what_enumeration_finds(problem_of, method, budget_eur):
    """Every method comes to the best of 75 layouts, with a budget and without; nothing is continuous here."""
    problem = problem_of(LISTS, budget_eur)
    evaluate = MadeUp()
    result = replace(SMALL, method=method)(problem, evaluate, Never())
    best = result.recommended["best"].layout
    assert true_error_m(best) == true_error_m(enumerated_best(problem))
    assert result.status is (Status.TARGET_MET if problem.limits else Status.SEARCHED)
    assert result.trials == sum(task.count for task in evaluate.tasks)


def test_between_the_levels_it_beats_enumeration(problem_of):
    """Within a budget the best ring lies between two levels, and the pitch on the edge of the budget."""
    problem = problem_of(RANGES, 1000.0)
    best = replace(SMALL, generations=25)(problem, MadeUp(), Never()).recommended["best"]
    enumerated = enumerated_best(problem)
    assert true_error_m(best.layout) < true_error_m(enumerated)
    ring = best.layout.readers[0].parameters
    assert ring["count"] == 5
    assert ring["radius_m"] == pytest.approx(0.12, abs=0.005)
    assert 950.0 < best.scores["cost"].value <= 1000.0


def test_what_breaks_a_rule_or_the_budget_is_never_simulated(problem_of):
    """Every task is of a layout that can be built for the money."""
    problem = problem_of(RANGES.replace("to = 8", "to = 20"), 800.0)
    evaluate = MadeUp()
    result = SMALL(problem, evaluate, Never())
    cost = next(objective for objective in problem.objectives if "cost" in objective.card.scores)
    layouts = {task.layout.key: task.layout for task in evaluate.tasks}
    assert len(layouts) > 20
    for layout in layouts.values():
        assert not check(layout, problem.design)
        assert cost(layout, problem.design, None)["cost"].value <= 800.0
    assert result.front.members


def test_a_target_of_accuracy_is_met_at_the_least_cost(problem_of):
    """With a limit on the error it is the cost that is minimised; enumeration of the lists knows the answer."""
    limit = Limit(score="position_error_mean", upper=0.0135)
    problem = replace(problem_of(LISTS), limits=(limit,))
    best = replace(SMALL, fresh_trials=32)(problem, MadeUp(), Never()).recommended["best"]
    fit = [item.evaluated for item in screen(problem) if not item.refusal]
    cheapest = min(item.scores["cost"].value for item in fit if true_error_m(item.layout) <= 0.0130)
    assert best.scores["cost"].value == cheapest
    assert true_error_m(best.layout) <= 0.0135


def test_scores_are_of_fresh_trials_alone(problem_of):
    """Where fresh drives are twice as bad, that is what is reported, of so many trials as were asked for."""
    problem = problem_of(RANGES, 1000.0)

    class Unlucky(MadeUp):
        def _run(self, task):
            found = super()._run(task)
            factor = 2.0 if task.first >= FRESH else 1.0
            return replace(found, outcomes=replace(found.outcomes, values=found.outcomes.values * factor))

    for item in SMALL(problem, Unlucky(), Never()).front.members:
        score = item.scores["position_error_mean"]
        assert score.value == pytest.approx(2.0 * true_error_m(item.layout), rel=0.1)
        assert score.count == SMALL.fresh_trials


def test_a_search_goes_on_from_any_part_of_its_evaluations(problem_of):
    """Killed after any number of evaluations, in any order, it comes to the same tasks and the same end."""
    problem = problem_of(RANGES, 1000.0)
    search = replace(SMALL, generations=4, polish_evaluations=8)
    evaluate, evaluations, candidates = MadeUp(), [], search.candidates(problem)
    standing, stages = search.standing(candidates, evaluations), []
    while standing.tasks:
        stages.append(standing.stage)
        evaluations += evaluate(standing.tasks)
        standing = search.standing(candidates, evaluations)
    assert list(dict.fromkeys(stages)) == ["search", "race", "polish", "fresh"]
    assert standing.stage == "done"
    for kept in (0, 5, len(evaluations) // 2, len(evaluations) - 1):
        again, fresh_candidates = evaluations[:kept][::-1], search.candidates(problem)
        resumed = search.standing(fresh_candidates, again)
        while resumed.tasks:
            again += MadeUp()(resumed.tasks)
            resumed = search.standing(fresh_candidates, again)
        assert resumed == standing
        assert {(item.group, item.first) for item in again} == {(item.group, item.first) for item in evaluations}


def test_a_layout_that_fails_is_passed_over(problem_of):
    """The best layout fails in every trial: the next best is found and nothing is asked for without end."""
    problem = problem_of(LISTS)
    broken = enumerated_best(problem)
    best = SMALL(problem, MadeUp(failing={broken.key}), Never()).recommended["best"].layout
    others = [item.evaluated.layout for item in screen(problem) if not item.refusal]
    assert true_error_m(best) == min(true_error_m(layout) for layout in others if layout.key != broken.key)


def refusing(tasks):
    """An evaluation that must not be called."""
    raise AssertionError(f"{len(tasks)} tasks were asked for")


def test_a_budget_below_the_cheapest_is_refused_without_a_trial(problem_of):
    """The status says so, and the nearest layout's cost stands beside the budget."""
    result = SMALL(problem_of(RANGES, 50.0), refusing, Never())
    assert result.status is Status.BUDGET_TOO_SMALL
    assert result.trials == 0
    assert not result.front.members
    assert "cost is" in result.shortfall
    assert "beyond 50" in result.shortfall


def test_a_space_of_which_nothing_can_be_built_is_infeasible(problem_of):
    """Twelve antennas of 40 mm do not fit on a circle of 80 mm."""
    text = LISTS.replace("[3, 4, 5, 6, 8]", "[16, 17]").replace(
        '["80 mm", "110 mm", "150 mm"]', '["50 mm", "60 mm"]'
    )
    result = SMALL(problem_of(text), refusing, Never())
    assert result.status is Status.INFEASIBLE
    assert "antennas" in result.shortfall


def test_a_space_of_one_layout_is_judged(problem_of):
    """Without any choice there is nothing to search, and still an answer."""
    text = (
        LISTS.replace("[3, 4, 5, 6, 8]", "5")
        .replace('["80 mm", "110 mm", "150 mm"]', '"110 mm"')
        .replace('["100 mm", "150 mm", "200 mm", "250 mm", "300 mm"]', '"150 mm"')
    )
    result = SMALL(problem_of(text), MadeUp(), Never())
    assert len(result.front.members) == 1
    assert result.front.members[0].scores["position_error_mean"].count == SMALL.fresh_trials


def test_an_empty_space_is_refused(problem_of):
    """No family of readers, or none for the floor."""
    problem = problem_of(LISTS)
    for change in ({"readers": ()}, {"patterns": {}}, {"patterns": {"": ()}}):
        empty = replace(problem, space=replace(problem.space, **change))
        with pytest.raises(ValueError, match="design space is empty"):
            SMALL(empty, refusing, Never())


@pytest.mark.parametrize(
    ("changes", "said"),
    [
        ({"method": "annealing"}, "a method is one of"),
        ({"population": 4}, "population must be at least 5"),
        ({"replications": 0}, "replications must be at least 1"),
        ({"race_trials": 1}, "at least the trials of the search"),
        ({"fresh_trials": 1}, "fresh_trials must be at least 2"),
        ({"method": "direct", "starts": ((0.5,),)}, "only differential evolution takes starts"),
    ],
)
def test_settings_that_make_no_search_are_refused(changes, said):
    """With the number that would do."""
    with pytest.raises(ValueError, match=said):
        replace(SMALL, **changes)


def test_a_goal_that_the_problem_does_not_have_is_refused(problem_of):
    """The goals that it has are named."""
    with pytest.raises(ValueError, match="no goal of the problem; its goals are cost, position_error_mean"):
        replace(SMALL, minimise="beauty")(problem_of(LISTS), refusing, Never())
