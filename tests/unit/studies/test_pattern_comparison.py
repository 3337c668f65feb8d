"""The comparison of patterns: equal densities, exact numbers against closed forms, and the page."""

import math

import numpy as np
import pytest

from layoutopt.patterns.square import square
from layoutopt.scores import TrialOutcomes
from studies.pattern_comparison import QUICK, PatternComparison, estimators
from studies.pattern_page import page_of, summary
from studies.pattern_scores import pattern_scores
from studies.pattern_setting import patterns, settings
from studies.pattern_verdict import draw_verdict, verdict_lines


@pytest.mark.parametrize("setting", settings(), ids=lambda setting: setting.name)
def test_all_patterns_have_one_density(setting):
    """One tag for each square of a pitch, whatever the pattern; else prices would be compared."""
    for label, pattern in patterns(setting).items():
        assert pattern.density_per_m2 == pytest.approx(setting.pitch_m**-2, rel=1e-9), label
        assert pattern.minimum_spacing_m() >= 0.02, label


def test_only_estimators_that_apply_are_run():
    """One reader is needed by the estimators of one reader; nothing is run that could not work."""
    study = PatternComparison(trials=1, labels=QUICK, seed=1)
    places = [place for place, _ in study.cells()]
    assert {label for _, label, _ in places} == set(QUICK)
    assert "one_reader" in {name for where, _, name in places if where == "sparse"}
    assert "one_reader" not in {name for where, _, name in places if where == "eight readers"}
    assert all(not cell.estimator.applies(cell.layout) for _, cell in study.cells())
    assert {name for _, _, name in places} == {estimator.name for estimator in estimators()}


def test_numbers_of_a_square_with_small_discs():
    """Discs that do not touch: worst error r, mean 2 r / 3, B(L) = 1 - n (pi r² + 2 r L) until two can be met."""
    found = pattern_scores(square(pitch_m=1.0), 0.2)
    assert found.static["midrange"].worst_m == pytest.approx(0.2, abs=1e-9)
    assert found.static["minimax"].mean_m == pytest.approx(0.4 / 3.0, abs=1e-9)
    assert found.detection == pytest.approx(math.pi * 0.04, abs=1e-12)
    assert found.covering_m == pytest.approx(math.sqrt(0.5), abs=1e-12)
    assert found.blindness is not None
    assert found.blindness.run_probability[0] == pytest.approx(1.0 - math.pi * 0.04, abs=1e-12)
    assert found.blindness.tail_m > 0.0
    assert found.blindness.probability.max() <= 1.0 - math.pi * 0.04


def test_a_floor_without_gaps_has_no_blind_runs():
    """Where discs cover the floor there is nothing to tell of blind runs."""
    assert pattern_scores(square(pitch_m=0.1), 0.08).blindness is None


def test_the_page_stands_without_trials():
    """Exact numbers need no trial; the summary says that no cell is finished."""
    page = page_of({}, ("square",), seed=1, failed=0)
    assert page.summary == ("No cell is finished.",) == tuple(summary({}))
    headings = [section.heading for section in page.sections]
    assert "Sparse: blind runs" in headings
    assert "Dense: blind runs" not in headings
    exact = next(data for data in page.data if data.name == "exact")
    assert {row[1] for row in exact.rows} == {"square"}
    assert np.isfinite([float(cell) for row in exact.rows for cell in row[2:]]).all()


def test_the_verdict_names_only_patterns_whose_interval_leaves_out_one_for_all_comparisons_together():
    """For one robot one pattern errs half as much on every drive; the others err alike and by chance."""
    draws = np.random.Generator(np.random.Philox(5))
    drives, found = 24, {}
    base = {setting.name: draws.gamma(9.0, 0.002, drives) for setting in settings()}
    for setting in settings():
        for label in patterns(setting):
            better = 0.5 if (setting.name, label) == ("sparse", "tilted") else 1.0
            errors = better * base[setting.name] * draws.uniform(0.9, 1.1, drives)
            found[setting.name, label, "mcl_adaptive"] = TrialOutcomes(
                replications=np.arange(drives), columns=("position_error_mean",), values=errors[:, None]
            )
    (line,) = verdict_lines(found)
    assert "these are shown to err less than the square one (95 % for all 27 comparisons together)" in line
    assert "tilted for the robot “sparse” (5" in line
    assert line.count("for the robot") == 1
    few = {place: table.head(2) for place, table in found.items()}
    assert "seen on 2 drives, too few to decide," in verdict_lines(few)[0]
    (ax,) = draw_verdict(found).axes
    labels = list(patterns(settings()[0]))
    assert [text.get_text() for text in ax.get_yticklabels()] == labels[labels.index("square") + 1 :]
    assert draw_verdict({}) is None
