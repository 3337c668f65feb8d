"""Limits in conflict, told from a search, from held-out drives, from exact scores and from two searches."""

import math
from dataclasses import replace

import numpy as np
import pytest

from layoutopt.problem import Limit
from layoutopt.protocols import group_of
from layoutopt.result import Evaluated
from layoutopt.scores import Score, TrialOutcomes
from layoutopt.spec.reading import read_spec
from solvers.exhaustive import Screened
from studies.findings import Design
from studies.shortfall import (
    exact_conflict,
    held_out_conflict,
    search_conflict,
    widened_conflict,
    worst_held_out,
)

BUDGET = Limit(score="cost", upper=1000.0)
TARGET = Limit(score="position_error_mean", upper=0.010)
LOST = Limit(score="lost_share", upper=0.02)


@pytest.fixture(scope="module")
def problem(tiny_text, tmp_path_factory):
    """The tiny problem with a budget, a target and a share."""
    path = tmp_path_factory.mktemp("shortfall") / "tiny.toml"
    path.write_text(tiny_text, encoding="utf-8")
    return replace(read_spec(path).problem(), limits=(BUDGET, TARGET, LOST))


@pytest.fixture(scope="module")
def layouts(problem):
    """A few layouts of the space."""
    return list(problem.space.layouts())[:4]


def _item(layout, cost, error_m, lost=0.0, count=50):
    def score(value, unit, *, share=False):
        return Score(value=value, unit=unit, standard_error=1e-6 * value, count=count, share=share)

    scores = {
        "cost": Score(value=cost, unit="EUR"),
        "position_error_mean": score(error_m, "m"),
        "lost_share": score(lost, "", share=True),
    }
    return Evaluated(layout=layout, scores=scores)


def _tables(problem, layout, errors_m):
    """Return outcomes of a layout on the held-out scenarios, with one mean error on each."""
    found = {}
    for scenario, error_m in zip(problem.held_out, errors_m, strict=True):
        values = np.column_stack([error_m + 1e-5 * np.cos(np.arange(200)), np.zeros(200)])
        columns = ("position_error_mean", "lost_share")
        table = TrialOutcomes(replications=np.arange(200), columns=columns, values=values)
        found[group_of(layout, scenario, problem.estimators[0])] = table
    return found


def test_a_search_says_how_many_layouts_the_budget_kept_out(problem, layouts):
    """Of those that were simulated none meets the target; of those above the budget nothing is known."""
    finalists = [_item(layouts[0], 900.0, 0.013)]
    above = Evaluated(layout=layouts[1], scores={"cost": Score(value=1200.0, unit="EUR")})
    screened = [Screened(evaluated=finalists[0]), Screened(evaluated=above, refusal="too dear", rule="cost")]
    text = search_conflict(problem, finalists, screened)
    assert "mean position error at most 10 mm is not met by the only layout that the search compared" in text
    assert "mean position error at most 13" in text
    assert "1 layout above the budget was not simulated" in text


def test_a_share_never_seen_is_no_conflict_in_search(problem, layouts):
    """Fifty trials do not show two per cent, and a search does not ask that of them."""
    assert search_conflict(problem, [_item(layouts[0], 900.0, 0.009)], []) == ""


def test_two_searches_together_tell_both_ways_out(problem, layouts):
    """Either more money or more error; the layout with more drives of the two searches counts."""

    def design(item, trials):
        return Design(evaluated=item, refusal="", trials=trials, on_front=False)

    designs = [
        design(_item(layouts[0], 900.0, 0.0131), 60),
        design(_item(layouts[0], 900.0, 0.0090), 2),
        design(_item(layouts[1], 1340.0, 0.008), 20),
        design(_item(layouts[2], 1100.0, 0.001), 0),
    ]
    text = widened_conflict(problem, designs)
    assert "cost at most 1" in text
    assert "are not met together by any of 2 layouts searched with and without the budget" in text
    assert "+340.00 EUR" in text
    assert "mean position error at most 13.1 mm" in text


def test_held_out_drives_judge_by_the_worst_scenario(problem, layouts):
    """Good on the first scenario and bad on the second is bad; without drives on one nothing is said."""
    known = _tables(problem, layouts[0], (0.008, 0.0125))
    scores = worst_held_out(problem, layouts[0], known)
    assert scores["position_error_mean"].value == pytest.approx(0.0125, abs=1e-6)
    items = [_item(layouts[0], 900.0, 0.008), _item(layouts[1], 900.0, 0.008)]
    text = held_out_conflict(problem, items, known)
    assert "mean position error at most 10 mm is not met by the only layout that held-out drives judged" in text
    assert worst_held_out(problem, layouts[1], known) is None
    assert held_out_conflict(problem, items[1:], known) == ""


def test_a_zone_that_no_drive_entered_is_the_worst(problem, layouts):
    """A score without any value on one scenario is not covered up by the other."""
    known = _tables(problem, layouts[0], (0.008, math.nan))
    assert math.isnan(worst_held_out(problem, layouts[0], known)["position_error_mean"].value)


def test_exact_limits_in_conflict_are_told_before_any_drive(problem, layouts):
    """Each layout breaks one exact limit or the other; what was left out for other reasons does not count."""
    least = Limit(score="pose_coverage", lower=0.9)
    exact = replace(problem, limits=(BUDGET, least))

    def screened(layout, cost, coverage, rule):
        scores = {
            "cost": Score(value=cost, unit="EUR"),
            "pose_coverage": Score(value=coverage, unit="", share=True),
        }
        return Screened(evaluated=Evaluated(layout=layout, scores=scores), refusal="out", rule=rule)

    found = [
        screened(layouts[0], 1100.0, 0.95, "cost"),
        screened(layouts[1], 900.0, 0.85, "pose_coverage"),
        screened(layouts[2], 100.0, 0.99, "a quick run"),
    ]
    text = exact_conflict(exact, found)
    assert "are not met together by any of 2 layouts that can be built" in text
    assert "+100.00 EUR" in text
    assert "at least 85 %" in text
