"""Ours beside a paper's: ratios, intervals and tables."""

import math

import numpy as np
import pytest

from layoutopt.scores import Score, TrialOutcomes
from studies.published.comparison import (
    Compared,
    Quantity,
    comparison_data,
    comparison_table,
    half_width,
    paired_ratio,
    score_of,
    with_interval,
)

X = Quantity(column="x_error_mean", heading="x", unit="mm", factor=1e3)


def outcomes(values, first=0):
    values = np.asarray(values, dtype=np.float64)
    return TrialOutcomes(
        replications=np.arange(first, first + len(values)), columns=("x_error_mean",), values=values[:, None]
    )


def compared(printed, ours):
    return Compared(table="2", row=("8", "100"), quantity=X, printed=printed, ours=ours)


def test_scores_come_in_the_unit_named():
    """Four millimetres are 4, with a standard error in millimetres too."""
    score = score_of(outcomes([0.003, 0.005]), X)
    assert (score.value, score.unit, score.count) == (pytest.approx(4.0), "mm", 2)
    assert score.standard_error == pytest.approx(1.0)
    assert score_of(None, X) is None


def test_ratio_and_factor():
    """Ours over printed, with the relative error of ours; a factor holds both ways."""
    item = compared(2.0, Score(value=3.0, unit="mm", standard_error=0.2, count=10))
    assert item.ratio.value == pytest.approx(1.5)
    assert item.ratio.standard_error == pytest.approx(0.1)
    assert item.within(1.5)
    assert not item.within(1.49)
    assert compared(6.0, item.ours).within(2.0)
    assert not compared(6.1, item.ours).within(2.0)


@pytest.mark.parametrize("printed", [None, 0.0])
def test_nothing_is_divided_by_nothing(printed):
    """Where the paper prints nothing, or nought, there is no ratio and no agreement."""
    item = compared(printed, Score(value=3.0, unit="mm", standard_error=0.2, count=10))
    assert item.ratio is None
    assert not item.within(1e9)


def test_a_paired_ratio_loses_what_both_share():
    """Twice the same errors have a ratio of exactly 2 without any uncertainty, however much they scatter."""
    values = np.random.default_rng(1).exponential(size=50)
    ratio = paired_ratio(outcomes(2.0 * values), outcomes(values), "x_error_mean")
    assert ratio.value == pytest.approx(2.0)
    assert ratio.standard_error == pytest.approx(0.0, abs=1e-12)


def test_a_paired_ratio_states_its_spread():
    """The stated standard error is the spread over repetitions.

    2000 repetitions give a spread within 1.6 % (one sigma) and a mean of stated errors within 1 %; asked are
    10 %, more than five of them: false alarm below one in a million.
    """
    draws = np.random.default_rng(2)
    ratios, errors = [], []
    for _ in range(2000):
        common = 1.0 + 0.2 * draws.standard_normal(60)
        first, second = 1.3 * common + 0.1 * draws.standard_normal(60), common + 0.1 * draws.standard_normal(60)
        found = paired_ratio(outcomes(first), outcomes(second), "x_error_mean")
        ratios.append(found.value)
        errors.append(found.standard_error)
    assert np.mean(errors) == pytest.approx(np.std(ratios), rel=0.1)


def test_only_common_replications_are_paired():
    """Trials that one of the two lacks do not count."""
    ratio = paired_ratio(outcomes([9.0, 2.0, 4.0]), outcomes([1.0, 2.0, 7.0], first=1), "x_error_mean")
    assert ratio.count == 2
    assert ratio.value == pytest.approx(2.0)


def test_interval_in_words():
    """The half width is Student's at 95 %, and unknown values and single trials are told as such."""
    score = Score(value=3.6251, unit="mm", standard_error=0.05, count=30)
    assert half_width(score) == pytest.approx(2.0452 * 0.05, rel=1e-4)
    assert with_interval(score) == "3.63 ± 0.10"
    assert with_interval(score, 1) == "3.6 ± 0.1"
    assert with_interval(None) == "not known"
    assert with_interval(Score(value=math.nan, unit="mm", standard_error=math.inf, count=1)) == "not known"
    assert with_interval(Score(value=3.6251, unit="mm", standard_error=math.inf, count=1)) == "3.63"


def test_tables_hold_paper_ours_and_ratio():
    """A row of the paper is a row; the table for programs has a line a number, empty where nothing is known."""
    known = compared(4.0, Score(value=5.0, unit="mm", standard_error=0.1, count=12))
    table = comparison_table("Table 2", ("readers", "tags"), [known])
    assert table.head == ("readers", "tags", "x, mm: paper", "ours", "ratio")
    assert table.rows == (("8", "100", "4", "5.00 ± 0.22", "1.25 ± 0.06"),)
    data = comparison_data("two", ("readers", "tags"), [known, compared(None, None)])
    first, second = (dict(zip(data.head, row, strict=True)) for row in data.rows)
    assert (first["paper"], first["ours"], first["ratio"], first["trials"]) == ("4", "5", "1.25", "12")
    assert float(first["ours_low"]) < 5.0 < float(first["ours_high"])
    assert (second["paper"], second["ours"], second["ratio"], second["trials"]) == ("", "", "", "0")
