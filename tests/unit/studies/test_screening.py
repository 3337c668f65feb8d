"""What a screen by a closed-form score keeps and loses: brute force, known answers, intervals that hold."""

import math
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import spearmanr

from layoutopt.antennas.sphere import SphereAntenna
from layoutopt.layout import FloorTags, Layout, ZonePattern
from layoutopt.patterns.square import square
from layoutopt.protocols import Mount
from layoutopt.readers.cross import cross
from layoutopt.readers.profiles import COMMERCIAL
from layoutopt.result import Evaluated
from layoutopt.scores import EXACT_UNITS, SAMPLED_UNITS, Score
from studies.screening import (
    CLOSED_FORMS,
    MARGINS,
    STUDY_MARGIN,
    correlation_text,
    kept_by,
    rank_correlation,
    screening,
    screening_lines,
)

GOALS = ("cost", "position_error_mean")
LAYOUT = Layout(
    floor_tags=FloorTags(zones=(ZonePattern(zone="", pattern=square(pitch_m=0.1)),)),
    readers=(cross(count=4, mount=Mount(antenna=SphereAntenna(side_m=0.06), height_m=0.02, profile=COMMERCIAL)),),
)
VALUES = st.integers(1, 12).map(float)


def raced(cost, error_m, standard_error_m=0.001, count=16, **closed_forms):
    """Return a layout with its scores; what it looks like does not matter here."""
    scores = {
        "cost": Score(value=float(cost), unit="EUR"),
        "position_error_mean": Score(value=error_m, unit="m", standard_error=standard_error_m, count=count),
        **{name: Score(value=float(value), unit="m") for name, value in closed_forms.items()},
    }
    return Evaluated(layout=LAYOUT, scores=scores)


def screens_of(items, name, judged=None):
    """Return the screens by one closed-form score, by margin."""
    found = screening(items, judged or [True] * len(items), GOALS)
    return {screen.margin: screen for screen in found.screens if screen.score == name}


@given(st.lists(st.tuples(VALUES, VALUES), min_size=1, max_size=12), st.sampled_from(MARGINS))
def test_a_screen_keeps_what_is_within_the_margin_of_the_best_that_costs_no_more(rows, margin):
    """Compared with the sentence written out as two loops; at an infinite margin everything stays."""
    costs, badness = np.array(rows).T
    wanted = [
        own <= margin * min(other for price, other in rows if price <= cost) * (1 + 1e-9) for cost, own in rows
    ]
    assert kept_by(costs, badness, margin).tolist() == wanted
    assert math.isfinite(margin) or all(wanted)


def test_what_has_no_closed_form_score_is_kept():
    """A screen that cannot judge a layout drops neither it nor, because of it, another."""
    kept = kept_by(np.array([1.0, 2.0, 3.0]), np.array([math.nan, 4.0, 9.0]), 2.0)
    assert kept.tolist() == [True, True, False]
    assert kept_by(np.array([1.0, 2.0]), np.array([math.inf, math.inf]), 1.0).all()


def test_losses_by_hand():
    """Half-gaps 4, 8, 3, 5 at rising cost: margin 1 keeps the first and the third.

    The full front is 20, 10, 7, 6 mm. Without the second, 20 mm stand in for 10; without the fourth, 7 for 6.
    """
    items = [
        raced(1, 0.020, 0.003, derived_half_gap=4),
        raced(2, 0.010, 0.004, derived_half_gap=8),
        raced(3, 0.007, 0.001, derived_half_gap=3),
        raced(4, 0.006, 0.002, derived_half_gap=5),
    ]
    screen = screens_of(items, "derived_half_gap")[1.0]
    assert (screen.kept, screen.dropped_members) == (2, 2)
    assert screen.largest_loss.value == pytest.approx(0.010)
    assert screen.largest_loss.standard_error == pytest.approx(0.005)
    assert screen.mean_loss.value == pytest.approx(0.011 / 4)
    # A fourth each of (first - second) and (third - fourth); what stays in both fronts adds nothing.
    assert screen.mean_loss.standard_error == pytest.approx(math.sqrt(9 + 16 + 1 + 4) / 4 * 1e-3)
    assert screen.largest_loss.count == 16


def test_the_screen_of_the_study_loses_nothing():
    """Its margin keeps every layout, so that its loss is exactly zero, whatever the closed form says."""
    items = [raced(1, 0.02, derived_half_gap=1), raced(2, 0.01, derived_half_gap=900)]
    screen = screens_of(items, "derived_half_gap")[STUDY_MARGIN]
    assert (screen.kept, screen.dropped_members) == (2, 0)
    assert screen.largest_loss.exact
    assert screen.largest_loss.value == screen.mean_loss.value == 0.0


def test_more_reads_are_better():
    """A layout with a third of the reads of a cheaper one is out at margin 2, in at margin 3."""
    items = [raced(1, 0.02, expected_reads_per_m=30), raced(2, 0.01, expected_reads_per_m=10)]
    found = screens_of(items, "expected_reads_per_m")
    assert [found[margin].kept for margin in (1.0, 2.0, 3.0)] == [1, 1, 2]
    assert found[2.0].largest_loss.value == pytest.approx(0.01)


@given(st.lists(st.tuples(VALUES, VALUES, VALUES), min_size=1, max_size=10))
def test_a_wider_margin_never_loses_more(rows):
    """Kept layouts grow with the margin, losses fall and are never negative among equally tried layouts."""
    items = [raced(cost, error / 1000.0, derived_half_gap=gap) for cost, error, gap in rows]
    found = [screens_of(items, "derived_half_gap")[margin] for margin in MARGINS]
    assert sorted(screen.kept for screen in found) == [screen.kept for screen in found]
    for losses in ([screen.largest_loss.value for screen in found], [screen.mean_loss.value for screen in found]):
        assert all(after <= before + 1e-15 for before, after in pairwise(losses))
        assert losses[-1] == 0.0


def test_a_stand_in_with_few_trials_shows_its_error():
    """Where no well-tried layout is kept, the best of the others takes its place with its own standard error."""
    items = [
        raced(1, 0.030, 0.010, count=2, derived_half_gap=1),
        raced(1, 0.020, 0.001, count=16, derived_half_gap=5),
        raced(2, 0.040, 0.010, count=2, derived_half_gap=1),
    ]
    screen = screens_of(items, "derived_half_gap", judged=[False, True, False])[1.0]
    assert screen.largest_loss.value == pytest.approx(0.010)
    assert screen.largest_loss.standard_error == pytest.approx(math.hypot(0.010, 0.001))
    assert screen.largest_loss.count == 2


def test_a_well_tried_layout_goes_before_a_lucky_one():
    """A kept layout with few trials, however low its mean, replaces no member while a well-tried one is kept."""
    items = [
        raced(1, 0.020, derived_half_gap=1),
        raced(2, 0.001, count=2, derived_half_gap=1),
        raced(3, 0.010, derived_half_gap=9),
    ]
    screen = screens_of(items, "derived_half_gap", judged=[True, False, True])[1.0]
    assert screen.largest_loss.value == pytest.approx(0.010)


def test_rank_correlation_with_ties():
    """Ties get their mean rank, as in scipy; order alone counts."""
    draws = np.random.Generator(np.random.Philox(3))
    first, second = draws.integers(0, 5, 40).astype(float), draws.normal(size=40)
    found = rank_correlation(first, second)
    assert found.value == pytest.approx(spearmanr(first, second).statistic)
    assert found.low < found.value < found.high
    assert rank_correlation(first, np.exp(second)).value == pytest.approx(found.value)
    perfect = rank_correlation(np.arange(6.0), -(np.arange(6.0) ** 3))
    assert (perfect.value, perfect.low, perfect.high) == (-1.0, -1.0, -1.0)


def test_partial_rank_correlation_is_that_of_what_a_third_score_leaves():
    """The textbook way: ranks less their straight line on the ranks of the third score, correlated."""
    draws = np.random.Generator(np.random.Philox(4))
    given = draws.normal(size=50)
    first, second = given + draws.normal(size=50), given + draws.normal(size=50)
    ranks = [np.argsort(np.argsort(column)).astype(float) for column in (first, second, given)]
    left = [rank - np.polyval(np.polyfit(ranks[2], rank, 1), ranks[2]) for rank in ranks[:2]]
    assert rank_correlation(first, second, given).value == pytest.approx(np.corrcoef(*left)[0, 1])


def test_rank_correlation_that_is_not_known():
    """Too few pairs, a score that is the same for all, or one that the third score fixes."""
    steps = np.arange(9.0)
    for found in (
        rank_correlation(np.arange(5.0), np.arange(5.0)),
        rank_correlation(np.ones(9), steps),
        rank_correlation(np.full(9, math.inf), steps),
        rank_correlation(steps, steps[[1, 0, 3, 2, 5, 4, 7, 6, 8]], given=steps**2),
    ):
        assert np.isnan([found.value, found.low, found.high]).all()
        assert correlation_text(found) == "not known"


@pytest.mark.parametrize("partial", [False, True])
def test_the_interval_of_the_rank_correlation_holds_its_promise(partial):
    """95 % intervals over 2000 samples of 60 normal pairs hold the true rank correlation 6/pi asin(rho/2).

    With a third score that has nothing to do with either, the partial one is the same. The share has a standard
    deviation of 0.49 %; beyond 4 of them lies a right interval once in 16 000 runs. One more per cent is for the
    approximation.
    """
    draws = np.random.Generator(np.random.Philox(11))
    rho = 0.8
    true = 6.0 / math.pi * math.asin(rho / 2.0)
    held = 0
    for _ in range(2000):
        first, noise, other = draws.normal(size=(3, 60))
        second = rho * first + math.sqrt(1 - rho**2) * noise
        found = rank_correlation(first, second, other if partial else None)
        held += found.low <= true <= found.high
    assert held / 2000 == pytest.approx(0.95, abs=4 * math.sqrt(0.95 * 0.05 / 2000) + 0.01)


def test_cost_alone_makes_no_agreement_at_equal_cost():
    """Half-gaps and errors that both only fall with cost agree overall and not at equal cost."""
    draws = np.random.Generator(np.random.Philox(6))
    costs = draws.uniform(1.0, 9.0, 300)
    items = [
        raced(cost, 0.01 * (10 - cost + noise), derived_half_gap=11 - cost + other)
        for cost, noise, other in zip(costs, *draws.normal(0.0, 0.5, (2, 300)), strict=True)
    ]
    agreement = screening(items, [True] * 300, GOALS).agreements[0]
    assert agreement.overall.low > 0.9
    assert agreement.at_equal_cost.low < 0.0 < agreement.at_equal_cost.high


def test_the_sign_says_better_in_both():
    """More reads and less error agree, and so do a smaller half-gap and less error."""
    items = [
        raced(
            n, 0.05 / n, derived_half_gap=1.0 / n, expected_reads_per_m=float(n), expected_new_tags_per_m=1.0 / n
        )
        for n in range(1, 9)
    ]
    found = {item.score: item.overall.value for item in screening(items, [True] * 8, GOALS).agreements}
    assert found == {"derived_half_gap": 1.0, "expected_reads_per_m": 1.0, "expected_new_tags_per_m": -1.0}


def test_without_a_front_there_is_nothing_to_tell():
    """No layout, none tried enough, or none with a closed form: no screens, no lines."""
    for items, judged in ([], []), ([raced(1, 0.01, derived_half_gap=1)], [False]), ([raced(1, 0.01)], [True]):
        found = screening(items, judged, GOALS)
        assert found.screens == found.agreements == ()
        assert screening_lines(found) == []


def test_the_lines_state_margin_and_loss():
    """The study's own margin and its loss come first, then what a tighter screen would have kept and lost."""
    items = [raced(n, 0.05 / n, derived_half_gap=n) for n in range(1, 7)]
    lines = screening_lines(screening(items, [True] * 6, GOALS))
    assert "margin infinite, loss 0" in lines[0]
    assert lines[1].startswith("  derived half-gap (no bound): rank correlation")
    assert "-1.00 (-1.00 to -1.00), at equal cost not known; a margin of 1.5" in lines[1]
    assert "kept 1 of 6" in lines[1]
    assert "lost up to 41.7 ± 1.4 mm (n = 16)" in lines[1]


def test_every_closed_form_is_a_score():
    """The screens go by exact scores other than cost."""
    assert set(CLOSED_FORMS) < {*EXACT_UNITS, *SAMPLED_UNITS} - {"cost"}
