"""The robustness study on made-up drives whose answer is known: who is robust, what that costs, when it ends."""

from dataclasses import replace

import numpy as np
import pytest

from layoutopt.problem import Limit
from layoutopt.protocols import Evaluation, Failure
from layoutopt.result import Status
from layoutopt.scores import TrialOutcomes
from layoutopt.simulation.outcomes import outcome_columns
from layoutopt.spec.reading import read_spec
from layoutopt.tolerance import Tolerance
from solvers.robust import scenarios_needed
from studies.cost_vs_accuracy import CostVersusAccuracy
from studies.page import write_page
from studies.robustness import Robustness
from studies.robustness_page import page_of
from studies.robustness_picks import Effort

EFFORT = Effort(contenders=8, screening_trials=6, deciding_trials=30, most_candidates=4, drawn=36)
TARGET = Limit(score="position_error_mean", upper=0.020)
PLACEMENT = Tolerance(placement_m=(0.0, 0.005), dead_tags=(0.0, 0.0), missed_reads=(0.02, 0.02))


@pytest.fixture(scope="module")
def problem(tiny_text, tmp_path_factory):
    """The tiny problem with one limit; cost is the only exact score, because the others take time."""
    path = tmp_path_factory.mktemp("robustness") / "tiny.toml"
    path.write_text(tiny_text, encoding="utf-8")
    whole = read_spec(path).problem()
    objectives = [item for item in whole.objectives if {"cost", TARGET.score} & set(item.card.scores)]
    return replace(whole, limits=(TARGET,), objectives=tuple(objectives))


@pytest.fixture(scope="module")
def search(problem):
    """The search of the tiny problem."""
    return CostVersusAccuracy.of(
        problem, seed=3, search_trials=60, validation_trials=30, front_trials=6, reference_trials=0
    )


def _costs(study):
    return sorted({item.scores["cost"].value for item in study.search.contenders})


def _drive(task, error_m):
    """Return outcomes with an error of the layout and world, and a spread that all layouts share."""
    columns = outcome_columns(task.scenario)
    numbers = np.arange(task.first, task.first + task.count)
    spread_m = 0.0004 * np.sin(1.7 * numbers)
    values = np.zeros((task.count, len(columns)))
    for place, column in enumerate(columns):
        if "position_error" in column:
            values[:, place] = error_m + spread_m
    return TrialOutcomes(replications=numbers, columns=columns, values=values)


def _played(study, error_m, failing=()):
    """Return all evaluations of a study whose layouts have made-up errors, and how many rounds it took."""
    cost_of = {item.layout.key: item.scores["cost"].value for item in study.search.contenders}
    found, rounds = [], 0
    while (batch := study.next_batch(found)).tasks:
        rounds += 1
        assert rounds < 60, batch.name
        assert batch == study.next_batch(list(reversed(found)))
        for task in batch.tasks:
            cost = cost_of[task.layout.key]
            if cost in failing and task.scenario.name.startswith("tolerance/"):
                found.append(Failure(group=task.group, first=task.first, message="a wheel came off"))
                continue
            faults = task.scenario.faults
            outcomes = _drive(task, error_m(cost, faults.tag_placement_sigma_m))
            found.append(Evaluation(group=task.group, first=task.first, outcomes=outcomes, seconds=0.0))
    return found


def _fragile(study):
    """Return errors with which the third cheapest layouts are the first to meet 20 mm at 5 mm of misplacement."""
    costs = _costs(study)

    def error_m(cost, sigma_m):
        rank = costs.index(cost)
        return 0.018 - 0.001 * rank + sigma_m * max(0.0, 2.0 - 0.9 * rank)

    return error_m


def test_the_robust_layout_is_the_cheapest_that_holds_at_the_worst_corner(search):
    """The cheapest is fine as planned and loses 10 mm at the corner; the second misses by little."""
    study = Robustness.of(search, PLACEMENT, EFFORT)
    costs = _costs(study)
    found = study.findings(_played(study, _fragile(study)))
    assert found.status is Status.TARGET_MET
    plain, safe = (found.choices[name].judged.evaluated for name in ("nominal", "robust"))
    assert plain.scores["cost"].value == costs[0]
    # At 5 mm the errors are 18 + 10, 17 + 5.5 and 16 + 1 mm.
    assert safe.scores["cost"].value == costs[2]
    assert found.price.cost_eur == costs[2] - costs[0]
    assert found.price.loss.value == pytest.approx(0.010, abs=1e-9)
    assert found.price.gain.value == pytest.approx(0.011, abs=1e-9)
    assert found.price.nominal_gain.value == pytest.approx(0.002, abs=1e-9)
    assert found.price.loss.count == EFFORT.deciding_trials
    assert found.price.hardest.faults.tag_placement_sigma_m == 0.005
    assert found.choices["robust"].held
    lines = study.answer(_played(study, _fragile(study)), None).lines(None)
    assert any(line.startswith("Price of robustness: +") for line in lines)


def test_what_is_safe_is_found_though_it_is_far_from_the_front_as_planned(search):
    """The fourth cost is twice as bad as every cheaper one as planned, and alone holds at 5 mm.

    With two contenders a race, a search as planned alone would have judged the two cheapest.
    """
    study = Robustness.of(search, PLACEMENT, replace(EFFORT, contenders=2))
    costs = _costs(study)

    def error_m(cost, sigma_m):
        return 0.018 if cost == costs[3] else 0.009 + 4.0 * sigma_m

    evaluations = _played(study, error_m)
    planned = search.racing.standing(search.problem, search.contenders, evaluations)
    assert costs[3] not in {item.scores["cost"].value for item in study.contenders([planned])}
    found = study.findings(evaluations)
    assert found.status is Status.TARGET_MET
    assert found.choices["robust"].judged.evaluated.scores["cost"].value == costs[3]
    assert found.choices["nominal"].judged.evaluated.scores["cost"].value == costs[0]


def test_a_tolerance_without_width_searches_once(search):
    """Both races would be the same; every round is one of the search as planned, or of the judgement."""
    faults = search.problem.design.faults
    same = Tolerance(
        placement_m=(faults.tag_placement_sigma_m,) * 2,
        dead_tags=(faults.dead_tag_share,) * 2,
        missed_reads=(faults.missed_read_share,) * 2,
    )
    study = Robustness.of(search, same, EFFORT)
    found = _played(study, _fragile(study))
    design = {item.group for item in found if item.group.scenario == search.problem.design.name}
    assert len(design) == len({group.layout_key for group in design})
    assert study.plan().lines[1].startswith(f"search: up to {search.racing.trials} trials")


def test_the_error_rises_along_the_sweep_for_both_layouts(search):
    """Five points from the low ends to the high ones, with the same drives at each."""
    study = Robustness.of(search, PLACEMENT, EFFORT)
    found = study.findings(_played(study, _fragile(study)))
    assert len(found.sweeps) == 2
    values = [score.value for score in found.sweeps[0].scores]
    assert values == pytest.approx([0.018, 0.0205, 0.023, 0.0255, 0.028], abs=2e-4)
    assert {score.count for sweep in found.sweeps for score in sweep.scores} == {EFFORT.deciding_trials}


def test_a_layout_that_nothing_disturbs_is_robust_for_nothing(search):
    """Then both are the same and the price is zero."""
    study = Robustness.of(search, PLACEMENT, EFFORT)
    evaluations = _played(study, lambda cost, sigma_m: 0.010)
    found = study.findings(evaluations)
    assert found.choices["nominal"].judged.evaluated == found.choices["robust"].judged.evaluated
    assert found.price.cost_eur == 0.0
    assert any("costs nothing" in line for line in study.answer(evaluations, None).lines(None))


def test_where_nothing_is_robust_the_status_says_so_with_the_conflict(search):
    """25 mm at the corner for all: exit 1, the limit in conflict, what would have to give, and no price."""
    study = Robustness.of(search, PLACEMENT, EFFORT)
    evaluations = _played(study, lambda cost, sigma_m: 0.010 + 3.0 * sigma_m)
    answer = study.answer(evaluations, None)
    assert answer.status is Status.TARGET_NOT_MET
    assert answer.exit_code == 1
    text = "\n".join(answer.lines(None))
    assert "mean position error at most 20 mm is not met by any of" in text
    assert "mean position error at most 25" in text
    assert "Price of robustness" not in text
    assert not page_of(study.findings(evaluations), prices="made up, 2026").found


def test_a_bound_beyond_the_limit_is_not_robust_though_its_mean_is_within(search):
    """A mean of 19.95 mm with a bound of more than 20 mm does not hold on the deciding drives."""
    study = Robustness.of(search, PLACEMENT, EFFORT)
    found = study.findings(_played(study, lambda cost, sigma_m: 0.01995 if sigma_m else 0.010))
    assert found.status is Status.TARGET_NOT_MET
    goal = found.choices["robust"].judged.robust["position_error_mean"]
    assert goal.value < TARGET.upper < goal.upper


def test_without_limits_the_knees_are_compared(search, problem):
    """No demand, no target missed: the study ends well with two layouts."""
    free = replace(search, problem=replace(problem, limits=()))
    study = Robustness.of(free, PLACEMENT, EFFORT)
    found = study.findings(_played(study, _fragile(study)))
    assert found.status is Status.SEARCHED
    assert set(found.choices) == {"nominal", "robust"}


def test_a_layout_that_fails_over_the_tolerance_is_neither_chosen_nor_waited_for(search):
    """The study goes on without it, tells the failure, and ends in exit 1."""
    study = Robustness.of(search, PLACEMENT, EFFORT)
    cheapest = _costs(study)[0]
    evaluations = _played(study, lambda cost, sigma_m: 0.010, failing=(cheapest,))
    answer = study.answer(evaluations, None)
    assert study.findings(evaluations).choices["nominal"].judged.evaluated.scores["cost"].value > cheapest
    assert answer.exit_code == 1
    assert "failed: a wheel came off" in answer.lines(None)


def test_a_quantile_is_judged_over_enough_drawn_installations(search):
    """Nine of ten installations: the bound exists, and the draws share their drives with the planned world."""
    tolerance = replace(PLACEMENT, combine="quantile", quantile=0.9)
    effort = replace(EFFORT, contenders=3, screening_trials=2, drawn=scenarios_needed(0.9))
    study = Robustness.of(search, tolerance, effort)
    assert len(study.scenarios) == 36
    assert {scenario.name for scenario in study.scenarios} == {study.nominal.name}
    found = study.findings(_played(study, _fragile(study)))
    goal = found.choices["robust"].judged.robust["position_error_mean"]
    assert goal.value <= goal.upper <= TARGET.upper
    assert found.status is Status.TARGET_MET


def test_the_page_holds_both_layouts_the_figure_and_every_world(search, tmp_path):
    """The report needs nothing else; tables have a row for each contender and world."""
    study = Robustness.of(search, PLACEMENT, EFFORT)
    found = study.findings(_played(study, _fragile(study)))
    write_page(page_of(found, prices="made up, 2026"), tmp_path, quick=False)
    report = (tmp_path / "report.html").read_text(encoding="utf-8")
    assert "Price of robustness" in report
    assert "<svg" in report
    assert "tags off by 5 mm" in report
    assert f"n = {EFFORT.deciding_trials}) over the tolerance" in report
    assert 'class="status first-page"' in report
    worlds = (tmp_path / "tables/worlds.csv").read_text(encoding="utf-8").splitlines()
    assert len(worlds) == 1 + len(found.contenders) * (1 + len(study.scenarios))


def test_the_plan_counts_every_part(search):
    """Layouts, worlds and trials are told, with a pilot in the search's world and in the worst one."""
    study = Robustness.of(search, PLACEMENT, EFFORT)
    plan = study.plan()
    assert "contenders in 3 worlds" in plan.lines[1]
    assert {task.scenario.name for task, _ in plan.pilot} == {study.problem.design.name, study.nominal.name}
    assert all(trials >= 1 for _, trials in plan.pilot)
