"""Means that borrow strength: against dense algebra, and on worlds where exact scores say much, or nothing."""

import numpy as np
import pytest

from layoutopt.result import Evaluated
from layoutopt.scores import Score
from solvers.borrowing import borrowed_log_means, features_of

RATIOS = [4.0**power for power in range(-4, 11)]


def _standardised(features):
    return (features - features.mean(axis=0)) / features.std(axis=0)


def _world(seed, *, layouts=60, trials=2, own=0.0, slopes=1.0, noise=0.2):
    """Return outcomes, features and the true logarithms of a world of the model, with common drives."""
    draws = np.random.default_rng(seed)
    features = _standardised(draws.normal(size=(layouts, 4)))
    truth = slopes * features @ draws.normal(0.0, 0.25, 4) + own * draws.normal(size=layouts)
    drives = draws.normal(0.0, 0.3, trials)
    table = np.exp(truth[:, None] + drives + noise * draws.normal(size=(layouts, trials)))
    return table, features, truth


def _error(logarithms, truth):
    """Return the root mean square error, what is common to all left out."""
    difference = logarithms - truth
    return float(np.sqrt(np.mean((difference - difference.mean()) ** 2)))


def _dense(table, features):
    """Return the posterior means of a complete table by dense normal algebra, over the same variances."""
    count, trials = table.shape
    means, drives = table.mean(axis=1), np.ones(trials)
    for _ in range(200):
        drives = (table / means[:, None]).mean(axis=0)
        means = (table / drives).mean(axis=1)
    noise = ((table / np.outer(means, drives) - 1.0) ** 2).sum() / ((count - 1) * (trials - 1))
    values = np.log(means) + noise / trials / 2.0
    best = (-np.inf, None)
    for own in [0.0, *RATIOS]:
        for slope in RATIOS:
            signal = noise * (slope * features @ features.T / features.shape[1] + own * np.eye(count))
            total = signal + noise / trials * np.eye(count)
            weights = np.linalg.inv(total)
            level = weights.sum(axis=0) @ values / weights.sum()
            left = values - level
            likelihood = -0.5 * (np.linalg.slogdet(total)[1] + np.log(weights.sum()) + left @ weights @ left)
            if likelihood > best[0]:
                best = (likelihood, level + signal @ weights @ left)
    return best[1]


@pytest.mark.parametrize("seed", range(6))
def test_the_means_are_those_of_dense_normal_algebra(seed):
    """Likelihood and posterior agree with covariance matrices written out, where scores say much or little."""
    table, features, _ = _world(seed, layouts=14, trials=3, own=0.1 * seed, slopes=seed % 2)
    np.testing.assert_allclose(borrowed_log_means(table, features), _dense(table, features), rtol=0.0, atol=1e-6)


def test_where_scores_say_much_the_error_falls_by_half():
    """Over twenty worlds of two trials a layout."""
    ratios = []
    for seed in range(20):
        table, features, truth = _world(seed)
        own = _error(np.log(table.mean(axis=1)), truth)
        ratios.append(_error(borrowed_log_means(table, features), truth) / own)
    assert np.mean(ratios) < 0.5


def test_where_scores_say_nothing_little_is_lost():
    """With slopes of zero and layouts that differ for reasons of their own, means keep to their trials."""
    ratios = []
    for seed in range(20):
        table, features, truth = _world(seed, own=0.5, slopes=0.0)
        own = _error(np.log(table.mean(axis=1)), truth)
        ratios.append(_error(borrowed_log_means(table, features), truth) / own)
    assert 0.9 < np.mean(ratios) < 1.03


def test_many_trials_have_the_last_word():
    """A layout that no score explains ends where its own trials put it."""
    table, features, _ = _world(3, trials=2000)
    table[7] *= 3.0
    plain = np.log(table.mean(axis=1))
    found = borrowed_log_means(table, features)
    assert found[7] - np.delete(found, 7).mean() == pytest.approx(plain[7] - np.delete(plain, 7).mean(), abs=0.01)


def test_a_hard_drive_does_not_count_against_those_who_met_it():
    """With hardly any noise, layouts that went on to hard drives have the ratios that they have on common ones."""
    table, features, truth = _world(4, trials=4, own=0.3, noise=1e-4)
    table[:, 2:] *= 5.0
    table[::2, 2:] = np.nan
    assert _error(borrowed_log_means(table, features), truth) < 1e-3


def test_the_unit_of_the_goal_does_not_matter():
    """Millimetres move all logarithms alike."""
    table, features, _ = _world(5)
    moved = borrowed_log_means(1000.0 * table, features) - borrowed_log_means(table, features)
    np.testing.assert_allclose(moved, np.log(1000.0), rtol=0.0, atol=1e-9)


def test_one_trial_a_layout_is_enough_to_borrow():
    """Without a measure of the noise the trend still draws, and order follows scores and trials."""
    table, features, truth = _world(6, trials=1, noise=0.4)
    assert _error(borrowed_log_means(table, features), truth) < 0.8 * _error(np.log(table[:, 0]), truth)


def test_a_layout_without_a_value_is_infinitely_bad():
    """It may not win by its exact scores alone."""
    table, features, _ = _world(7)
    table[5] = np.nan
    found = borrowed_log_means(table, features)
    assert np.flatnonzero(np.isinf(found)).tolist() == [5]


def test_where_the_model_cannot_be_there_are_no_means():
    """Too few layouts, no scores, no error to take the logarithm of, nothing that differs, no noise."""
    table, features, truth = _world(8)
    assert borrowed_log_means(table[:9], features[:9]) is None
    assert borrowed_log_means(table, np.empty((60, 0))) is None
    faultless, easy = table.copy(), table.copy()
    faultless[3] = 0.0
    easy[:, 1] = 0.0
    assert borrowed_log_means(faultless, features) is None
    assert borrowed_log_means(easy, features) is None
    assert borrowed_log_means(np.ones((60, 1)), features) is None
    assert borrowed_log_means(np.outer(2.0 ** np.arange(60.0), [1.0, 2.0]), features) is None
    assert borrowed_log_means(np.exp(truth)[:, None], features) is not None


def test_means_that_differ_by_rounding_alone_are_no_error():
    """With one trial each the noise is not measured: differences of a few last bits must not end in an error."""
    _, features, _ = _world(9, layouts=20)
    for seed in range(40):
        draws = np.random.default_rng(seed)
        bits = draws.integers(0, 3, (20, 1)) * draws.choice([1e-16, 1e-15, 1e-12])
        found = borrowed_log_means(0.05 * (1.0 + bits), features)
        assert found is None or np.isfinite(found).all()
    # Two means whose logarithms are the same number.
    table = np.full((20, 1), 0.05)
    table[3] = np.nextafter(0.05, 1.0)
    assert np.log(table[3]) == np.log(table[4])
    assert borrowed_log_means(table, features) is None


def test_scores_that_repeat_each_other_do_no_harm():
    """Of two equal columns each takes half of the slope, so the means are those of one column."""
    table, features, _ = _world(10)
    once = borrowed_log_means(table, features[:, :1])
    np.testing.assert_allclose(borrowed_log_means(table, features[:, [0, 0]]), once, rtol=0.0, atol=1e-9)


def test_features_are_scores_that_all_have_and_that_differ():
    """Wide positive scores enter by logarithms, others as they are; what is the same for all does not enter."""
    costs, gaps = [100.0, 1000.0, 10_000.0], [-1.0, 0.0, 4.0]
    items = [
        Evaluated(
            layout=None,
            scores={
                "cost": Score(value=cost, unit="EUR"),
                "gap": Score(value=gap, unit="m"),
                "side": Score(value=0.04, unit="m"),
                **({"some": Score(value=gap, unit="m")} if gap else {}),
            },
        )
        for cost, gap in zip(costs, gaps, strict=True)
    ]
    found = features_of(items)
    expected = _standardised(np.stack([[2.0, 3.0, 4.0], gaps], axis=1))
    np.testing.assert_allclose(found, expected, rtol=0.0, atol=1e-12)
    assert features_of([]).shape == (0, 0)
