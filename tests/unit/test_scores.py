"""Outcomes of trials, scores made of them, and their uncertainty."""

import math
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import binom, binomtest

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


def shares(values):
    """Return the score of a share of which these are the outcomes."""
    return outcomes(values, columns=("lost_share",)).score("lost_share")


@pytest.mark.parametrize("count", [2, 5, 24, 200])
@pytest.mark.parametrize("confidence", [0.8, 0.95, 0.999])
def test_bounds_of_zeros_and_ones_are_those_of_clopper_and_pearson(count, confidence):
    """Exact, as scipy has them: at both ends of a two-sided interval, for any number of ones."""
    for ones in {0, 1, 2, count // 2, count - 1, count}:
        score = shares([1.0] * ones + [0.0] * (count - ones))
        exact = binomtest(ones, count).proportion_ci(confidence, method="exact")
        assert score.interval(confidence) == pytest.approx((exact.low, exact.high), abs=1e-9)
        one_sided = binomtest(ones, count, alternative="less").proportion_ci(confidence, method="exact")
        assert score.upper(confidence) == pytest.approx(one_sided.high, abs=1e-9)


def test_one_drive_bounds_a_share():
    """One robot that was never lost, or half of the time, or always: the bound knows that a share ends at 1."""
    assert [shares([value]).upper() for value in (0.0, 0.5, 1.0)] == pytest.approx([0.95, 0.975, 1.0])
    assert [shares([value]).lower() for value in (0.0, 0.5, 1.0)] == pytest.approx([0.0, 0.025, 0.05])


@given(st.lists(st.floats(0.0, 1.0), min_size=1, max_size=40), st.floats(0.6, 0.999))
def test_a_share_that_was_seen_is_never_bounded_below_one_that_was_not(values, confidence):
    """However little was seen; the lower bound of what is left mirrors it, and both lie within the range."""
    score, never = shares(values), shares([0.0] * len(values))
    assert never.upper(confidence) - 1e-12 <= score.upper(confidence) <= 1.0
    assert score.value - 1e-12 <= score.upper(confidence)
    mirrored = shares([1.0 - value for value in values])
    assert score.lower(confidence) == pytest.approx(1.0 - mirrored.upper(confidence), abs=1e-9)


@pytest.mark.parametrize(
    ("draw", "mean"),
    [
        (lambda draws, size: draws.random(size) < 0.02, 0.02),
        (lambda draws, size: 0.5 * (draws.random(size) < 0.06), 0.03),
        (lambda draws, size: np.where(draws.random(size) < 0.014, 1.0, 0.01), 0.014 + 0.986 * 0.01),
        (lambda draws, size: draws.random(size), 0.5),
        (lambda draws, size: draws.beta(0.1, 1.0, size), 0.1 / 1.1),
        (lambda draws, size: draws.beta(5.0, 0.5, size), 5.0 / 5.5),
    ],
    ids=["zeros and ones", "rare halves", "rare losses among crumbs", "even", "skewed", "nearly one"],
)
def test_the_bound_of_a_share_holds_as_often_as_it_says(draw, mean):
    """At most 5 % of 1000 bounds miss the truth; more than those allowed has a chance of a millionth."""
    draws = np.random.Generator(np.random.Philox(6))
    allowed = binom.isf(1e-6, 1000, 0.05)
    for count in (5, 40):
        missed = sum(shares(values).upper() < mean - 1e-12 for values in draw(draws, (1000, count)))
        assert missed <= allowed


def test_students_bound_would_not_hold_for_a_share():
    """The check above has teeth: of rare losses among crumbs Student's bound misses every second one."""
    draws = np.random.Generator(np.random.Philox(6))
    samples = np.where(draws.random((500, 40)) < 0.014, 1.0, 0.01 * (draws.random((500, 40)) < 0.5))
    missed = sum(replace(shares(values), share=False).upper() < 0.018 for values in samples)
    assert missed > 200


def test_many_drives_bound_a_share_as_students_does():
    """Of a thousand drives that lose a fifth of the time on average, half widths agree to a seventh."""
    score = shares(np.random.Generator(np.random.Philox(8)).beta(1.0, 4.0, 1000))
    student = replace(score, share=False)
    assert score.upper() - score.value == pytest.approx(student.upper() - student.value, rel=0.15)
    assert score.value - score.lower() == pytest.approx(student.value - student.lower(), rel=0.15)


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


def test_a_difference_of_shares_has_a_range_of_its_own():
    """Ten drives without a loss under either layout do not show that both are equally good."""
    none, half = (outcomes([value] * 10, columns=("lost_share",)) for value in (0.0, 0.5))
    nothing = paired_difference(none, none, "lost_share")
    never = 1.0 - 0.05**0.1
    assert (nothing.lower(), nothing.upper()) == pytest.approx((-never, never))
    gain = paired_difference(none, half, "lost_share")
    assert gain.value == -0.5
    assert gain.lower() == pytest.approx(-1.0 + 0.5 * (1.0 - never))
    assert gain.upper() == pytest.approx(-0.5 + 1.5 * never)
    plain = paired_difference(outcomes([0.1] * 10), outcomes([0.1] * 10), "position_error_mean")
    assert plain.interval() == (0.0, 0.0)


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
