"""The comparison of patterns: equal densities, exact numbers against closed forms, and the page."""

import math

import numpy as np
import pytest

from layoutopt.patterns.square import square
from studies.pattern_comparison import QUICK, PatternComparison, estimators
from studies.pattern_page import page_of, summary
from studies.pattern_scores import pattern_scores
from studies.pattern_setting import patterns, settings


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
    assert page.summary == ("no cell is finished",) == tuple(summary({}))
    headings = [section.heading for section in page.sections]
    assert "Sparse: blind runs" in headings
    assert "Dense: blind runs" not in headings
    exact = next(data for data in page.data if data.name == "exact")
    assert {row[1] for row in exact.rows} == {"square"}
    assert np.isfinite([float(cell) for row in exact.rows for cell in row[2:]]).all()
