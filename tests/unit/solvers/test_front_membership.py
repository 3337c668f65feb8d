"""Probabilities of membership: who is on the front by brute force, and whether probabilities are kept."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from layoutopt.scores import TrialOutcomes
from solvers import front_membership
from solvers.front import non_dominated
from solvers.front_membership import goal_values, mean_draws, membership, on_front

BINS = (0.0, 0.02, 0.1, 0.3, 0.5, 0.7, 0.9, 1.0)
RACE = (2, 4, 8, 16, 32, 64)


def table(replications, values):
    return TrialOutcomes(
        replications=np.array(replications), columns=("error",), values=np.array(values).reshape(-1, 1)
    )


def world(seed, layouts, scatter, trials):
    """Return costs, true means and outcomes: errors fall with cost, half of the variance is that of the drives."""
    generator = np.random.Generator(np.random.Philox(seed))
    costs = np.round(np.sort(generator.uniform(1.0, 10.0, layouts)), 1)
    truth = 0.02 * costs**-0.7 * np.exp(scatter * generator.standard_normal(layouts))
    drives, own = generator.standard_normal(trials), generator.standard_normal((layouts, trials))
    noise = 0.5 * math.sqrt(0.5) * (drives + own)
    return costs, truth, truth[:, None] * np.exp(noise - 0.125)


def raced(costs, values):
    """Return the outcomes that a race would have: after each round the half nearest to the front goes on."""
    left, alive = np.full_like(values, np.nan), np.arange(len(costs))
    for until in RACE:
        left[alive, :until] = values[alive, :until]
        means = values[alive, :until].mean(axis=1)
        best = np.array([means[costs[alive] <= cost].min() for cost in costs[alive]])
        alive = alive[np.sort(np.argsort(means / best, kind="stable")[: max(20, len(alive) // 2)])]
    return left


def reliability(worlds, layouts, scatter, trials, race=False):
    """Return for each bin of predicted probabilities their mean, the share of true members, and the number."""
    predicted, true = [], []
    for seed in range(worlds):
        costs, truth, values = world(seed, layouts, scatter, trials)
        predicted.append(membership(costs, raced(costs, values) if race else values, seed=seed, resamples=400))
        true.append(on_front(costs, truth[None, :])[0])
    shares, members = np.concatenate(predicted), np.concatenate(true)
    rows = np.clip(np.searchsorted(BINS, shares) - 1, 0, None)
    return [
        (float(shares[rows == row].mean()), float(members[rows == row].mean()), int((rows == row).sum()))
        for row in np.unique(rows)
    ]


def off_by(bins):
    """Return how far the worst bin is off beyond five standard errors of its share (p = 6e-7 a bin)."""
    return max(
        abs(share - told) - 5.0 * math.sqrt(max(told * (1 - told), share * (1 - share)) / number)
        for told, share, number in bins
    )


@given(st.lists(st.tuples(st.integers(0, 5), st.integers(0, 5)), min_size=1, max_size=12))
def test_the_front_of_a_draw_is_the_front_by_brute_force(rows):
    """Exact errors, with ties in both goals: of equal layouts all count, of a front the first."""
    goals = np.array(rows, dtype=np.float64)
    found = on_front(goals[:, 0], goals[:, 1][None, :])[0]
    expected = {tuple(goals[row]) for row in non_dominated(goals)}
    strictly = np.array([not ((goals <= row).all(axis=1) & (goals < row).any(axis=1)).any() for row in goals])
    assert {tuple(row) for row in goals[found]} <= expected
    # A layout that costs more and is as good is beaten, just like one that costs the same and is worse.
    assert (found == strictly).all()


def test_a_layout_without_a_value_is_never_on_the_front():
    """NaN draws lose, and beat nobody."""
    draws = np.array([[math.nan, 2.0, 1.0]])
    assert on_front(np.array([1.0, 2.0, 3.0]), draws).tolist() == [[False, True, True]]


def test_columns_are_replications_whatever_each_layout_has():
    """Gaps and layouts without a table become NaN."""
    values = goal_values([table([0, 2], [1.0, 3.0]), None, table([1, 2], [5.0, 6.0])], "error")
    nan = math.nan
    np.testing.assert_array_equal(values, [[1.0, nan, 3.0], [nan, nan, nan], [nan, 5.0, 6.0]])
    assert goal_values([None], "error").shape == (1, 0)


def test_draws_have_the_mean_and_the_covariance_of_the_sample():
    """With the same many drives for all, means and covariance of the draws are those of the sample means.

    Twelve thousand draws: each entry within six of its standard errors, Student's widening (2 %) allowed for.
    """
    generator = np.random.Generator(np.random.Philox(8))
    drives = generator.standard_normal(100)
    values = 10.0 + np.stack([drives * slope + generator.standard_normal(100) for slope in (1.0, 1.5, 3.0)])
    draws = mean_draws(np.array([1.0, 2.0, 3.0]), values, seed=2, resamples=12_000)
    expected = np.cov(values) / 100.0
    spread = np.sqrt(np.diag(expected))
    assert np.abs(draws.mean(axis=0) - values.mean(axis=1)).max() < (6.0 / math.sqrt(12_000)) * spread.max()
    found = np.cov(draws.T)
    allowed = (0.03 + 6.0 * math.sqrt(2.0 / 12_000)) * np.outer(spread, spread)
    assert (np.abs(found - expected) < allowed).all()


def test_few_easy_drives_do_not_make_a_layout_good():
    """A layout that met the easy half of the drives only is judged as if it had met all of them."""
    generator = np.random.Generator(np.random.Philox(3))
    drives = np.concatenate([np.full(8, 0.5), np.full(56, 1.5)])
    values = drives * np.exp(0.05 * generator.standard_normal((4, 64)))
    values[3, 8:] = math.nan
    draws = mean_draws(np.arange(1.0, 5.0), values, seed=1)
    assert np.nanmean(values[3]) < 0.6
    assert draws[:, 3].mean() == pytest.approx(drives.mean(), rel=0.1)


def test_the_same_seed_gives_the_same_draws_and_another_one_others():
    """To the last bit."""
    costs, _, values = world(1, 12, 0.2, 20)
    first = mean_draws(costs, values, seed=4)
    assert first.tobytes() == mean_draws(costs, values, seed=4).tobytes()
    assert first.tobytes() != mean_draws(costs, values, seed=5).tobytes()


def test_a_single_replication_each_is_refused():
    """Without a variance there is no probability; without any value there is nothing to refuse."""
    with pytest.raises(ValueError, match="at least two replications"):
        membership(np.array([1.0, 2.0]), np.array([[1.0], [2.0]]), seed=0)
    assert membership(np.array([1.0]), np.empty((1, 0)), seed=0).tolist() == [0.0]


@pytest.mark.parametrize(("scatter", "trials", "bound"), [(0.2, 64, 0.03), (0.2, 16, 0.03), (0.05, 16, 0.03)])
def test_probabilities_are_kept(scatter, trials, bound):
    """Of layouts told to be members with some probability, that share is; also where all are nearly equal.

    Bound 0.03 beyond five standard errors of the share in each bin (p = 6e-7).
    """
    assert off_by(reliability(60, 30, scatter, trials)) < bound


def test_probabilities_after_a_race_are_kept_to_a_tenth():
    """Where most layouts have two drives, members are told with up to 0.1 too little, and dropped ones are
    right."""
    bins = reliability(25, 200, 0.2, 64, race=True)
    assert off_by(bins) < 0.1
    assert all(abs(share - told) < 0.02 for told, share, number in bins if number > 1000)


def test_without_a_prior_near_ties_would_be_told_wrongly(monkeypatch):
    """The test of reliability can fail: without the prior it does, by far."""
    monkeypatch.setattr(front_membership, "_LEAST_FOR_PRIOR", 10_000)
    assert off_by(reliability(60, 30, 0.05, 16)) > 0.1
