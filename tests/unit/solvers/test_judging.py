"""Verdicts on limits, ties and gaps in the data of a race."""

import math
from dataclasses import replace

import numpy as np
import pytest

from layoutopt.evaluate import Evaluator
from layoutopt.problem import Limit
from layoutopt.protocols import Evaluation, Failure
from layoutopt.result import Status
from layoutopt.scores import Score
from layoutopt.spec.reading import read_spec
from layoutopt.streams import Streams
from solvers.judging import meeting_limits, met_in_search, miss_text, nearest_miss, trials_needed
from solvers.racing import Racing
from solvers.stop import Never
from studies.cost_vs_accuracy import CostVersusAccuracy


@pytest.fixture(scope="module")
def problem(tiny_text, tmp_path_factory):
    """The tiny problem, without limits."""
    path = tmp_path_factory.mktemp("judging") / "tiny.toml"
    path.write_text(tiny_text, encoding="utf-8")
    return replace(read_spec(path).problem(), limits=())


@pytest.fixture(scope="module")
def evaluate():
    """An evaluator that remembers, so that no drive is driven twice for all these tests."""
    return Evaluator(Streams(seed=1))


def _study(problem):
    return CostVersusAccuracy.of(
        problem, seed=1, search_trials=60, validation_trials=10, front_trials=5, reference_trials=0
    )


def _finished(study, evaluate):
    found = []
    while (batch := study.next_batch(found)).tasks:
        found += evaluate(batch.tasks)
    return found


def test_a_share_that_was_never_seen_is_not_certain():
    """Two trials without a loss show little; two hundred show less than two per cent at 95 %."""
    few = Score(value=0.0, unit="", standard_error=0.0, count=2, share=True)
    many = Score(value=0.0, unit="", standard_error=0.0, count=200, share=True)
    limit = Limit(score="lost_share", upper=0.02)
    assert few.upper(0.95) == pytest.approx(1.0 - 0.05**0.5)
    assert many.upper(0.95) == pytest.approx(1.0 - 0.05 ** (1 / 200))
    assert not limit.met(few)
    assert limit.met(many)
    assert met_in_search(limit, few)
    assert met_in_search(limit, replace(few, count=1, standard_error=math.inf))


def test_a_share_hardly_seen_is_less_certain_than_one_never_seen():
    """One crumb in 200 drives shows no less than none does not; a search takes both by the spread they showed."""
    never = Score(value=0.0, unit="", standard_error=0.0, count=200, share=True)
    crumb = Score(value=1e-5, unit="", standard_error=1e-5, count=200, share=True)
    half = Score(value=0.0025, unit="", standard_error=0.0025, count=200, share=True)
    assert never.upper() < crumb.upper() < half.upper()
    limit = Limit(score="lost_share", upper=0.015)
    assert limit.met(never)
    assert limit.met(crumb)
    assert not limit.met(half)
    assert met_in_search(limit, half)
    assert not met_in_search(Limit(score="lost_share", upper=0.005), half)


def test_a_share_of_one_breaks_a_limit_for_certain():
    """A robot that is always lost is not saved by a small number of trials."""
    lost = Score(value=1.0, unit="", standard_error=0.0, count=5, share=True)
    assert Limit(score="lost_share", upper=0.02).broken(lost)


def test_of_equal_cost_the_better_layout_comes_first(problem, evaluate):
    """Finalists are sorted by cost, then error, so that the cheapest one is never dominated."""
    standing = Racing(trials=200).standing
    contenders = _study(problem).contenders
    evaluations = []
    while (now := standing(problem, contenders, evaluations)).tasks:
        evaluations += evaluate(now.tasks)
    ranks = [(item.scores["cost"].value, item.scores["position_error_mean"].value) for item in now.finalists]
    assert ranks == sorted(ranks)
    assert len({cost for cost, _ in ranks}) < len(ranks)


def test_without_limits_the_cheapest_is_the_first_of_the_front(problem, evaluate):
    """What is called the cheapest layout of the front is a member of it."""
    study = _study(problem)
    findings = study.findings(_finished(study, evaluate))
    assert findings.result.recommended["cheapest"].layout == findings.result.front.members[0].layout


def test_a_zone_that_some_drives_never_enter_does_not_upset_the_race(problem, evaluate):
    """With a zone's error as the goal, drives without a value are left out for all layouts alike."""
    goal = "dock.position_error_mean"
    result = Racing(trials=200)(replace(problem, goals=("cost", goal)), _blinded(goal, evaluate), Never())
    assert result.front.members
    assert all(np.isfinite(member.scores[goal].value) for member in result.front.members)


def _blinded(goal, inner):
    """Return an evaluator that loses every odd drive's value of a score."""

    def evaluate(tasks):
        found = []
        for item in inner(tasks):
            values = item.outcomes.values.copy()
            values[item.outcomes.replications % 2 == 1, item.outcomes.columns.index(goal)] = np.nan
            found.append(replace(item, outcomes=replace(item.outcomes, values=values)))
        return found

    return evaluate


def test_an_unknown_score_is_said_to_be_unknown(problem):
    """A limit that no drive can answer is not met, and the shortfall says why."""
    limited = replace(problem, limits=(Limit(score="nees", upper=1.0),))
    item = replace(
        _study(problem).contenders[0],
        scores={"nees": Score(value=float("nan"), unit="", standard_error=float("inf"), count=1)},
    )
    assert not meeting_limits(limited, [item])
    assert "not known" in nearest_miss(limited, [item])


def test_a_share_that_no_trial_showed_is_no_miss_of_a_search(problem):
    """Two drives without a loss prove little, but what misses the demand is the error."""
    limits = (Limit(score="lost_share", upper=0.02), Limit(score="position_error_mean", upper=0.01))
    limited = replace(problem, limits=limits)
    scores = {
        "lost_share": Score(value=0.0, unit="", standard_error=0.0, count=2, share=True),
        "position_error_mean": Score(value=0.012, unit="m", standard_error=0.0001, count=2),
    }
    item = replace(_study(problem).contenders[0], scores=scores)
    assert "mean position error is 12.00" in nearest_miss(limited, [item])


def test_too_few_drives_for_a_share_are_told_with_the_number_that_would_do(problem):
    """2 % at 95 % takes 149 drives without a loss: 0.98^149 is just below 0.05."""
    limit = Limit(score="lost_share", upper=0.02)
    item = _study(problem).contenders[0]
    short, enough = (
        Score(value=0.0, unit="", standard_error=0.0, count=count, share=True) for count in (148, 149)
    )
    assert "149 drives would show" in miss_text(item, limit, short)
    assert trials_needed(limit, enough) == 0
    assert limit.met(enough)


def test_a_score_without_a_bound_is_not_said_to_be_infinitely_short(problem):
    """Value and demand are told, and that one drive tells no bound; nothing is infinite or no number."""
    limited = replace(problem, limits=(Limit(score="position_error_mean", upper=0.01),))
    score = Score(value=0.008, unit="m", standard_error=math.inf, count=1)
    item = replace(_study(problem).contenders[0], scores={"position_error_mean": score})
    text = nearest_miss(limited, [item])
    assert "too few drives to tell a bound" in text
    assert "8 mm" in text
    assert "10 mm is allowed" in text
    assert "inf" not in text
    assert "nan" not in text


def _failing(which, inner):
    """Return an evaluator in which the tasks fail that ``which`` picks."""

    def evaluate(tasks):
        found = []
        for task, item in zip(tasks, inner(tasks), strict=True):
            if which(task):
                found.append(Failure(group=item.group, first=item.first, message="ValueError: boom"))
            else:
                found.append(item)
        return found

    return evaluate


def test_if_every_layout_fails_the_study_ends_with_a_status(problem, evaluate):
    """No crash: the target is not met, and the failures are told."""
    study = _study(replace(problem, limits=(Limit(score="position_error_mean", upper=0.03),)))
    findings = study.findings(_finished(study, _failing(lambda _: True, evaluate)))
    assert findings.result.status is Status.TARGET_NOT_MET
    assert not findings.result.front.members
    assert all(design.refusal for design in findings.designs)
    assert set(findings.failures.values()) == {"ValueError: boom"}


def test_a_failure_of_one_estimator_on_held_out_drives_does_not_change_the_front(problem, evaluate):
    """The front is that of an undisturbed run; the failed rows say so."""
    study = _study(problem)
    calm = study.findings(_finished(study, evaluate))
    shaken = study.findings(_finished(study, _failing(lambda task: task.estimator.name == "midrange", evaluate)))
    assert [m.layout.key for m in calm.result.front.members] == [m.layout.key for m in shaken.result.front.members]
    rows = [row for row in shaken.validations if row.estimator == "midrange"]
    assert rows
    assert all(row.does_not_apply == "failed: ValueError: boom" for row in rows)


def test_one_failing_layout_is_out_and_the_rest_goes_on(problem, evaluate):
    """The failed layout is refused with its message; the others have a front."""
    study = _study(problem)
    victim = study.contenders[0].layout.key
    findings = study.findings(_finished(study, _failing(lambda task: task.layout.key == victim, evaluate)))
    design = next(design for design in findings.designs if design.evaluated.layout.key == victim)
    assert design.refusal == "failed: ValueError: boom"
    assert victim not in {member.layout.key for member in findings.result.front.members}
    assert findings.result.front.members


def test_a_task_that_raises_comes_back_as_a_value(problem, evaluate):
    """A trial that cannot run is a Failure with its message, next to evaluations of the others."""
    study = _study(problem)
    tasks = study.next_batch(()).tasks[:2]
    short = replace(tasks[1], scenario=replace(tasks[1].scenario, step_count=10))
    found = evaluate([tasks[0], short])
    assert isinstance(found[0], Evaluation)
    assert isinstance(found[1], Failure)
    assert "before the errors count" in found[1].message


def test_a_least_limit_is_an_upper_one_turned_round():
    """What is met, broken, over and off by is that of the inverse score under the inverse limit."""
    least, most = Limit(score="run_coverage", lower=0.8), Limit(score="lost_share", upper=1.25)
    for value in (0.5, 0.8, 0.9):
        covered = Score(value=value, unit="")
        inverse = Score(value=1.0 / value, unit="")
        assert least.met(covered) is most.met(inverse)
        assert least.broken(covered) is most.broken(inverse)
        assert least.ratio(value) == pytest.approx(most.ratio(1.0 / value))
        assert (least.excess(value) > 0.0) is least.broken(covered)
    assert least.ratio(0.0) == math.inf
    assert least.ratio(math.nan) == math.inf


def test_a_least_limit_is_met_at_its_lower_bound():
    """A score of 0.85 ± 0.1 may well be below 0.8, and is not surely below 0.9."""
    score = Score(value=0.85, unit="", standard_error=0.1, count=50)
    assert not Limit(score="run_coverage", lower=0.8).met(score)
    assert not Limit(score="run_coverage", lower=0.9).broken(score)
    assert Limit(score="run_coverage", lower=0.6).met(score)


@pytest.mark.parametrize("ends", [{}, {"upper": 1.0, "lower": 0.5}])
def test_a_limit_has_one_end(ends):
    """Neither none nor both."""
    with pytest.raises(ValueError, match="either an upper or a lower end"):
        Limit(score="cost", **ends)


def test_a_least_limit_steers_the_recommendation(problem, evaluate):
    """The cheapest layout that reads often enough is found; a demand that none reaches is told."""
    study = _study(problem)
    reads = [
        item.scores["reads_per_step"].value
        for item in study.findings(_finished(study, evaluate)).result.front.members
    ]
    wanted = _study(replace(problem, limits=(Limit(score="reads_per_step", lower=float(np.median(reads))),)))
    found = wanted.findings(_finished(wanted, evaluate)).result
    assert found.recommended["cheapest"].scores["reads_per_step"].value >= np.median(reads) > min(reads)
    out_of_reach = _study(replace(problem, limits=(Limit(score="reads_per_step", lower=1e6),)))
    refused = out_of_reach.findings(_finished(out_of_reach, evaluate)).result
    assert "is demanded" in refused.shortfall
