"""What an explanation makes of outcomes: significance, rates, limits that bind, conflicts, failures."""

import json
import math
import re
from dataclasses import replace

import numpy as np
import pytest

from layoutopt.problem import Limit
from layoutopt.protocols import Evaluation, Failure, group_of
from layoutopt.scores import Score, TrialOutcomes
from layoutopt.spec.reading import read_spec
from studies import explain
from studies.explain_limits import BINDING_USE
from studies.explain_lines import explained_json, explained_lines
from studies.explain_variants import Variant

TRIALS = 40
SPREAD_M = np.random.Generator(np.random.Philox(5)).normal(0.0, 0.002, TRIALS)


@pytest.fixture(scope="module")
def spec(tiny_text, tmp_path_factory):
    """The tiny spec."""
    path = tmp_path_factory.mktemp("explain") / "tiny.toml"
    path.write_text(tiny_text, encoding="utf-8")
    return read_spec(path)


@pytest.fixture(scope="module")
def layouts(spec):
    """Three layouts of the space by price: pitches of 300, 200 and 100 mm."""
    problem = replace(spec.problem(), limits=())
    able = [item for item in spec.space.layouts() if not explain.refusal_of(problem, item)]
    mine = [item for item in able if "60 mm (4 a module)" in item.label]
    return sorted(mine, key=lambda item: item.floor_tags.base.pattern.density_per_m2)


def _outcomes(problem, layout, errors_m, lost=0.0):
    """Return evaluations on both held-out scenarios: the second is 1 mm worse."""
    found = []
    for number, scenario in enumerate(problem.held_out):
        values = np.column_stack([errors_m + 0.001 * number, np.full(len(errors_m), lost)])
        table = TrialOutcomes(
            replications=np.arange(100, 100 + len(errors_m)),
            columns=("position_error_mean", "lost_share"),
            values=values,
        )
        group = group_of(layout, scenario, problem.estimators[0])
        found.append(Evaluation(group=group, first=100, outcomes=table, seconds=0.0))
    return found


def _explained(spec, layouts, errors_mm, limits, *, lost=0.0, failing=()):
    """Return the middle layout explained beside the two others, with these mean errors and a common spread."""
    problem = replace(spec.problem(), limits=limits)
    cheap, base, dear = layouts
    evaluations = []
    for layout, error_mm in zip(layouts, errors_mm, strict=True):
        if layout not in failing:
            # What drives have in common cancels; a tenth of the spread is each layout's own.
            own = np.roll(SPREAD_M, 7 if layout is cheap else 13 if layout is dear else 0) / 10.0
            evaluations += _outcomes(problem, layout, error_mm / 1000.0 + SPREAD_M + own, lost)
        else:
            for scenario in problem.held_out:
                group = group_of(layout, scenario, problem.estimators[0])
                evaluations.append(Failure(group=group, first=100, message="a wheel came off"))
    variants = [
        Variant(kind="tag pattern", change="tags sparser", layout=cheap),
        Variant(kind="tag pattern", change="tags denser", layout=dear),
    ]
    return explain.explained(
        problem, base, [(item, "") for item in variants], evaluations, seed=3, first=100, trials=TRIALS
    )


TARGET = Limit(score="position_error_mean", upper=0.030)


def test_a_change_is_told_with_its_rate_and_what_it_buys(spec, layouts):
    """Denser tags are 2 mm better and dearer; the rate is their cost for a metre of error."""
    found = _explained(spec, layouts, (12.0, 10.0, 8.0), (TARGET,))
    (bought,) = found.bought
    assert bought.variant.change == "tags denser"
    assert bought.differences[found.scenario].value == pytest.approx(-0.002, abs=2e-4)
    assert found.rate(bought) == pytest.approx(-bought.cost_eur / bought.differences[found.scenario].value)
    assert found.rate(bought) > 0.0
    assert found.scenario == spec.problem().held_out[1].name
    text = "\n".join(explained_lines(found))
    assert "tags denser: error -2 mm" in text
    low, high = found.rate_interval(bought)
    assert 0.0 < low < found.rate(bought) < high
    assert (low, high) == pytest.approx(tuple(-bought.cost_eur / end for end in bought.interval))
    assert re.search(r"tags denser: [\d.\u202f]+ EUR \([\d.\u202f]+ to [\d.\u202f]+\) per mm; error -2 mm", text)
    assert " for the floor and " in text
    assert f"n = {TRIALS}" in text
    assert "seed 3" in text
    lines = explained_lines(found)
    short = lines[lines.index("In short") :][:4]
    assert short[1] == "  It meets its limit."
    assert short[2].startswith("  Spend the next euro on this: tags denser (")
    assert short[3].startswith("  Save on this: tags sparser (-")


def test_the_short_answer_says_what_is_missed_and_which_parts_are_needed(spec, layouts):
    """A missed limit comes first with what is lacking, and antennas that lose nothing for certain are counted."""
    found = _explained(spec, layouts, (12.0, 10.0, 9.99), (Limit(score="position_error_mean", upper=0.005),))
    steps = tuple(replace(step, variant=replace(step.variant, kind="antenna less")) for step in found.steps)
    lines = explained_lines(replace(found, steps=steps))
    short = lines[lines.index("In short") :]
    assert re.match(r"  It misses 1 of 1 limit: mean position error at most 5 mm, by [\d.]+ mm\.", short[1])
    assert short[2] == (
        "  Antennas, taken away one by one (2): for 1 of 2 the error grows for certain, by 2 mm; "
        "1 may not be needed, which more drives would tell (--trials)."
    )
    assert short[3] == "  The next euro: no single step makes it better for certain."
    upper = _explained(spec, layouts, (12.0, 10.0, 9.99), (TARGET,)).limits[0].bound + 0.001
    met = _explained(spec, layouts, (12.0, 10.0, 9.99), (Limit(score="position_error_mean", upper=upper),))
    steps = tuple(replace(step, variant=replace(step.variant, kind="tag row")) for step in met.steps)
    assert any("1 would break a limit" in line for line in explained_lines(replace(met, steps=steps)))
    assert any(line.startswith("  missed   mean position error") for line in lines)
    between = Limit(score="position_error_mean", upper=met.limits[0].score.value)
    lines = explained_lines(_explained(spec, layouts, (12.0, 10.0, 9.99), (between,)))
    told = "1 of 1 limit not decided: mean position error at most"
    assert lines[lines.index("In short") + 1].startswith(f"  {told}")
    assert any(line.startswith("  open     mean position error") for line in lines)
    assert "the next cheaper layout breaks it" not in "\n".join(lines)


def test_a_difference_within_its_interval_is_no_change(spec, layouts):
    """A hundredth of a millimetre drowns in the spread of the drives."""
    found = _explained(spec, layouts, (10.01, 10.0, 9.99), (TARGET,))
    assert found.bought == ()
    assert all(math.isnan(found.rate(step)) for step in found.judged)
    text = "\n".join(explained_lines(found))
    assert text.count("no significant change") >= 2
    assert "no single step makes it better for certain" in text


def test_intervals_hold_together_and_are_wider_than_one_alone(spec, layouts):
    """Two steps at 95 % together are 97.5 % each."""
    found = _explained(spec, layouts, (12.0, 10.0, 8.0), (TARGET,))
    step = found.judged[0]
    assert step.interval == step.differences[found.scenario].interval(0.975)
    low, high = step.differences[found.scenario].interval(0.95)
    assert step.interval[0] < low < high < step.interval[1]


def test_only_cheaper_layouts_that_meet_every_limit_can_be_saved(spec, layouts):
    """At 30 mm the sparser tags pass; at 13.5 mm they do not, and the limit binds for that reason alone."""
    assert [step.variant.change for step in _explained(spec, layouts, (12.0, 10.0, 8.0), (TARGET,)).saved] == [
        "tags sparser"
    ]
    tight = Limit(score="position_error_mean", upper=0.0135)
    found = _explained(spec, layouts, (13.5, 10.0, 8.0), (tight,))
    assert found.saved == ()
    (use,) = found.limits
    assert use.use < BINDING_USE
    assert use.binding
    assert use.broken_by == "tags sparser"
    assert use.met
    assert found.exit_code == 0


def test_a_limit_binds_by_its_confidence_bound_not_its_mean(spec, layouts):
    """A mean at 88 % of the limit with a bound beyond 90 % binds."""
    found = _explained(spec, layouts, (9.0, 10.0, 8.0), (Limit(score="position_error_mean", upper=0.0125),))
    (use,) = found.limits
    assert use.score.value / use.limit.upper < BINDING_USE < use.use < 1.0
    assert use.binding
    assert use.broken_by == ""
    assert use.slack == pytest.approx(use.limit.upper - use.score.upper(0.95))


def test_a_missed_limit_ends_in_exit_1_with_conflict_and_way_out(spec, layouts):
    """A budget below the dear layout and a target that only it meets cannot both be met."""
    problem = spec.problem()
    costs = [explain.exact_scores(problem, item, only="cost")["cost"].value for item in layouts]
    budget = Limit(score="cost", upper=(costs[1] + costs[2]) / 2.0)
    found = _explained(spec, layouts, (14.0, 12.0, 8.0), (Limit(score="position_error_mean", upper=0.010), budget))
    assert found.exit_code == 1
    assert [{limit.score for limit in chosen} for chosen in found.conflicts.sets] == [
        {"cost", "position_error_mean"}
    ]
    text = "\n".join(explained_lines(found))
    assert "are not met together by any of 3 layouts here or one step away" in text
    # What the layout itself misses already is no loss of a step.
    assert "then no longer shown to meet: mean position error" not in text
    assert f"+{(costs[2] - budget.upper):.2f} EUR" in text


def test_too_few_trials_for_a_share_never_seen_are_told_with_the_number_that_shows_it(spec, layouts):
    """Zero in 40 trials may be 7 %; 149 trials would show 2 %."""
    found = _explained(spec, layouts, (9.0, 10.0, 8.0), (Limit(score="lost_share", upper=0.02),))
    (use,) = found.limits
    assert not use.met
    assert use.more_trials == 149
    assert "149 trials" in "\n".join(explained_lines(found))
    enough = Score(value=0.0, unit="", standard_error=0.0, count=use.more_trials, share=True)
    short = Score(value=0.0, unit="", standard_error=0.0, count=use.more_trials - 1, share=True)
    assert use.limit.met(enough)
    assert not use.limit.met(short)


def test_a_variant_that_fails_is_told_and_the_others_stay(spec, layouts):
    """The reason stands beside the variant, the exit code is 1, and the JSON has no number that is none."""
    found = _explained(spec, layouts, (12.0, 10.0, 8.0), (TARGET,), failing=(layouts[0],))
    assert found.exit_code == 1
    assert [step.refusal for step in found.steps] == ["failed: a wheel came off", ""]
    assert "a wheel came off" in "\n".join(explained_lines(found))
    told = json.loads(json.dumps(explained_json(found), allow_nan=False))
    assert told["steps"][0]["cost_eur"] is None
    assert told["steps"][1]["significant"]


def test_a_layout_that_failed_itself_explains_nothing(spec, layouts):
    """Without its own drives there is no difference to tell."""
    found = _explained(spec, layouts, (12.0, 10.0, 8.0), (TARGET,), failing=(layouts[1],))
    assert found.exit_code == 1
    assert found.judged == ()
    assert "not known, so it is not met" in "\n".join(explained_lines(found))


def test_the_best_place_is_the_one_with_the_lowest_goal(spec, layouts):
    """Of three places with drives the second is best; one without drives is never chosen before."""
    problem = spec.problem()
    places = [Variant(kind="antenna more", change=f"place {n}", layout=item) for n, item in enumerate(layouts)]
    scenario, known = problem.held_out[1], {}
    for item, error in zip(layouts[1:], (0.008, 0.009), strict=True):
        for evaluation in _outcomes(problem, item, np.full(3, error)):
            known[evaluation.group] = evaluation.outcomes
    best = explain.best_place(problem, places, scenario, known)
    assert best.layout == layouts[1]
    assert best.change == "place 1, the best of 3 places"
    alone = explain.best_place(problem, places[:1], scenario, known)
    assert alone.change == "place 0, the only place that was tried"
