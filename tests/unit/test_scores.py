"""Outcomes of trials, scores made of them, and their uncertainty."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from layoutopt.scores import OUTCOME_COLUMNS, SCORE_UNITS, Score, TrialOutcomes, joined, paired_difference


def outcomes(values, first=0, columns=("position_error_mean",)):
    """Return outcomes of consecutive replications."""
    values = np.asarray(values, dtype=float).reshape(-1, len(columns))
    return TrialOutcomes(replications=np.arange(first, first + len(values)), columns=columns, values=values)


def test_a_score_is_mean_and_standard_error():
    """1, 2, 3, 4: mean 2.5, sample deviation sqrt(5/3), standard error half of that."""
    score = outcomes([1, 2, 3, 4]).score("position_error_mean")
    assert (score.value, score.unit, score.count) == (2.5, "m", 4)
    assert score.standard_error == pytest.approx(math.sqrt(5 / 3) / 2)
    assert not score.exact


def test_intervals_are_students():
    """With four values the two-sided 95 % interval has t = 3.182, the one-sided bound t = 2.353."""
    score = Score(value=10.0, unit="m", standard_error=1.0, count=4)
    assert score.interval(0.95) == pytest.approx((10 - 3.1824463, 10 + 3.1824463))
    assert score.upper(0.95) == pytest.approx(12.3533634)
    assert score.lower(0.95) == pytest.approx(7.6466366)


def test_an_exact_score_has_no_interval():
    """A formula is as sure as it is."""
    score = Score(value=3.0, unit="EUR")
    assert score.exact
    assert score.interval() == (3.0, 3.0)
    assert score.upper() == score.lower() == 3.0


def test_one_replication_says_nothing_of_its_spread():
    """A single trial has unbounded limits, so that it never meets or breaks a demand."""
    score = outcomes([0.01]).score("position_error_mean")
    assert score.interval() == (-math.inf, math.inf)
    assert score.standard_error == math.inf


def test_a_zone_that_was_never_entered_is_unknown():
    """NaN counts as no value; without any value the score is unknown, and not exact."""
    columns = ("dock.position_error_mean", "lost_share")
    table = outcomes([(math.nan, 0.0), (0.02, 1.0), (0.04, 0.5)], columns=columns)
    assert table.score("dock.position_error_mean").value == pytest.approx(0.03)
    assert table.score("dock.position_error_mean").count == 2
    nothing = outcomes([math.nan, math.nan]).score("position_error_mean")
    assert math.isnan(nothing.value)
    assert nothing.interval() != nothing.interval() or nothing.standard_error == math.inf
    assert not nothing.exact


def test_the_interval_holds_its_promise():
    """95 % intervals over 2000 samples of 8 normal numbers hold the mean 95 % of the time.

    The share has a standard deviation of 0.49 %; a limit of 4 of them fails by chance once in 16 000 runs.
    """
    draws = np.random.Generator(np.random.Philox(5)).normal(2.0, 3.0, (2000, 8))
    held = 0
    for sample in draws:
        low, high = outcomes(sample).score("position_error_mean").interval(0.95)
        held += low <= 2.0 <= high
    assert held / 2000 == pytest.approx(0.95, abs=4 * math.sqrt(0.95 * 0.05 / 2000))


@given(st.permutations(range(5)))
def test_joining_does_not_depend_on_the_order(order):
    """Pieces from workers give one table, ordered by replication, whoever was first."""
    pieces = [outcomes([number, number + 0.5], first=2 * number) for number in range(5)]
    whole = joined([pieces[number] for number in order])
    assert whole == joined(pieces)
    assert whole.replications.tolist() == list(range(10))
    assert whole.values[:, 0].tolist() == [0, 0.5, 1, 1.5, 2, 2.5, 3, 3.5, 4, 4.5]


def test_what_cannot_be_joined():
    """Nothing, other columns, or a replication twice."""
    with pytest.raises(ValueError, match="same columns"):
        joined([])
    with pytest.raises(ValueError, match="same columns"):
        joined([outcomes([1]), outcomes([1], columns=("lost_share",))])
    with pytest.raises(ValueError, match="ascend"):
        joined([outcomes([1]), outcomes([2])])


def test_pairs_cancel_what_both_share():
    """The difference of two layouts over the same replications has only their own spread."""
    draws = np.random.Generator(np.random.Philox(1)).normal(0.0, 1.0, 50)
    difference = paired_difference(outcomes(draws + 0.2), outcomes(draws[10:], first=10), "position_error_mean")
    assert difference.count == 40
    assert difference.value == pytest.approx(0.2)
    assert difference.standard_error == pytest.approx(0.0, abs=1e-12)


def test_outcomes_are_protected_and_checked():
    """Rows fit replications, replications ascend, arrays are read-only, columns have to exist."""
    table = outcomes([1, 2])
    with pytest.raises(ValueError, match="read-only"):
        table.values[0, 0] = 5
    with pytest.raises(KeyError):
        table.column("lost_share")
    with pytest.raises(ValueError, match="outcomes of shape"):
        TrialOutcomes(replications=np.arange(3), columns=("lost_share",), values=np.zeros((2, 1)))
    with pytest.raises(ValueError, match="ascend"):
        TrialOutcomes(replications=np.array([1, 1]), columns=("lost_share",), values=np.zeros((2, 1)))


def test_every_column_has_a_unit():
    """Errors are in m and rad, variances in their squares, shares without a unit; cost is no outcome."""
    assert set(OUTCOME_COLUMNS) < set(SCORE_UNITS)
    assert "cost" not in OUTCOME_COLUMNS
    assert SCORE_UNITS["heading_error_variance"] == "rad²"
    assert SCORE_UNITS["x_error_p95"] == "m"
    assert SCORE_UNITS["lost_share"] == ""
