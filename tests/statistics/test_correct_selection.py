"""Normal means with a known best: what is stated of a selection holds, and allocation beats equal shares."""

import numpy as np
import pytest
from scipy.stats import binom

from solvers.allocation import compared, optimal_allocation, probability_of_correct_selection
from solvers.borrowing import borrowed_log_means
from solvers.front import non_dominated
from solvers.halving import least_dominated, survivors
from solvers.run_off import run_off, up_to

FALSE_ALARM = 1e-6
CONFIDENCE = 0.9
BATCHES = 6
COMMON = [0.0, 3.0]
"""Standard deviation of what layouts share in a replication, beside an own one of 1: correlations of 0 and 0.9."""


def _selected(means, costs, common, draws, trials, *, confidence=1.0, indifference=0.0, equal=False):
    """Run a selection on fresh normal outcomes; return its comparisons and the trials it took."""
    count, first = len(means), 4
    most = trials // 2
    own = draws.normal(0.0, 1.0, (count, most))
    full = means[:, None] + draws.normal(0.0, common, most)[None, :] + own if common else means[:, None] + own
    counts = np.full(count, trials // count if equal else first)
    batch = -(-(trials - counts.sum()) // BATCHES)
    while True:
        reach = counts.max()
        table = np.where(np.arange(reach) < counts[:, None], full[:, :reach], np.nan)
        found = compared(table, costs, indifference=indifference)
        left = trials - int(counts.sum())
        if equal or left <= 0 or probability_of_correct_selection(found) >= confidence:
            return found, int(counts.sum())
        counts = optimal_allocation(found, counts, min(batch, left), most=np.full(count, most))


def _one_best(draws):
    """Return ten means half a deviation apart, shuffled, and no costs."""
    return draws.permutation(10.0 + 0.5 * np.arange(10.0)), None


def _front(draws):
    """Return means and costs of twelve layouts of which about every third is on the front."""
    costs = np.arange(12.0)
    return np.where(costs % 3 == 0, 20.0, 21.4 + draws.uniform(0.0, 2.0, 12)) - 0.4 * costs, costs


def _right(found, means, costs):
    true = non_dominated(np.stack([np.zeros(len(means)) if costs is None else costs, means], axis=1))
    return found.members.tolist() == true.tolist()


def _check_the_stated_probability(world, common, runs):
    """Selections that end with a stated probability are right at least so often.

    If the probability of a correct selection were just the one stated, the number of right ones would lie below
    its binomial quantile with a probability of one in a million.
    """
    right = stated = 0
    for seed in range(runs):
        draws = np.random.default_rng(seed)
        means, costs = world(draws)
        found, _ = _selected(means, costs, common, draws, 2000, confidence=CONFIDENCE)
        if probability_of_correct_selection(found) >= CONFIDENCE:
            stated += 1
            right += _right(found, means, costs)
    assert stated >= 0.9 * runs
    assert right >= binom.ppf(FALSE_ALARM, stated, CONFIDENCE)


@pytest.mark.parametrize("common", COMMON)
@pytest.mark.parametrize("world", [_one_best, _front])
def test_a_selection_is_right_as_often_as_stated(world, common):
    """For one goal and for a front, with and without correlation between layouts."""
    _check_the_stated_probability(world, common, 60)


@pytest.mark.long
@pytest.mark.parametrize("common", COMMON)
@pytest.mark.parametrize("world", [_one_best, _front])
def test_a_selection_is_right_as_often_as_stated_in_many_runs(world, common):
    """The same with 1,500 runs: a share below 0.863 would be noticed."""
    _check_the_stated_probability(world, common, 1500)


def _check_the_probability_of_a_front_that_borrows(common, runs):
    """The exact scores mislead: they name errors in the opposite order, plus one that says nothing.

    What the run-off states rests on the trials, so a front that it states with confidence is right at least so
    often, whoever chose its members; the limit has a false-alarm rate of one in a million.
    """
    right = stated = borrowed = 0
    for seed in range(runs):
        draws = np.random.default_rng(seed)
        means, costs = _front(draws)
        features = np.stack([-means, draws.normal(size=12)], axis=1)
        features = (features - features.mean(axis=0)) / features.std(axis=0)
        full = means[:, None] + draws.normal(0.0, common, 800)[None, :] + draws.normal(0.0, 1.0, (12, 800))
        counts = available = np.full(12, 4)
        while True:
            table = np.where(np.arange(800) < available[:, None], full, np.nan)
            found = run_off(
                table,
                costs,
                available,
                counts,
                np.ones(12, dtype=bool),
                trials=2000,
                confidence=CONFIDENCE,
                indifference=0.0,
                features=features,
            )
            if (found.wanted <= available).all():
                break
            available = found.wanted
        borrowed += found.borrowed
        if probability_of_correct_selection(found.found) >= CONFIDENCE:
            stated += 1
            right += _right(found.found, means, costs)
    assert borrowed == runs
    assert stated >= runs / 2
    assert right >= binom.ppf(FALSE_ALARM, stated, CONFIDENCE)


def test_a_front_that_borrows_is_right_as_often_as_stated():
    """Even where its exact scores mislead it."""
    _check_the_probability_of_a_front_that_borrows(3.0, 15)


@pytest.mark.long
@pytest.mark.parametrize("common", COMMON)
def test_a_front_that_borrows_is_right_as_often_as_stated_in_many_runs(common):
    """The same with 200 runs: a share below 0.78 would be noticed."""
    _check_the_probability_of_a_front_that_borrows(common, 200)


def _raced(seed):
    """Run a race of twenty layouts, with rounds; return its comparisons, and whether its front is the true one.

    Half of the worlds have many layouts that are nearly as good as those of the front; exact scores say nothing,
    mislead, or are not used, and layouts begin with one trial or two.
    """
    draws = np.random.default_rng(seed)
    costs, most = np.arange(20.0), 600
    apart = np.where(costs % 3 == 0, 20.0, 21.4 + draws.uniform(0.0, 2.0, 20)) - 0.3 * costs
    means = apart if seed % 2 else draws.normal(20.0, 1.0, 20) - 0.15 * costs
    told = (None, -means, draws.normal(size=20))[seed // 2 % 3]
    features = None
    if told is not None:
        features = np.stack([told, costs], axis=1)
        features = (features - features.mean(axis=0)) / features.std(axis=0)
    full = means[:, None] + draws.normal(0.0, 3.0 * draws.integers(2), most) + draws.normal(0.0, 1.0, (20, most))
    counts, alive = np.full(20, draws.integers(1, 3)), np.arange(20)
    for keep in (10, 6):
        until = int(counts[alive].max())
        log_means = None if features is None else borrowed_log_means(up_to(full, counts), features)
        if log_means is None:
            alive = alive[survivors(costs[alive], full[alive, :until], keep)]
        else:
            alive = alive[least_dominated(costs[alive], log_means[alive], keep)]
        counts[alive] = 2 * until
    ended = run_off(
        full,
        costs,
        np.full(20, most),
        counts,
        np.isin(np.arange(20), alive),
        trials=int(draws.choice([200, 1500])),
        confidence=CONFIDENCE,
        indifference=0.0,
        most=most,
        features=features,
    )
    return ended.found, _right(ended.found, means, costs)


def _check_races(runs):
    """Of the stated ones at least so many are right, and over all runs no fewer than stated in the mean."""
    raced = [_raced(seed) for seed in range(runs)]
    probabilities = np.array([probability_of_correct_selection(found) for found, _ in raced])
    right = np.array([true for _, true in raced])
    stated = probabilities >= CONFIDENCE
    assert stated.sum() >= runs / 4
    assert right[stated].sum() >= binom.ppf(FALSE_ALARM, int(stated.sum()), CONFIDENCE)
    assert right.sum() >= probabilities.sum() - np.sqrt(runs * np.log(1.0 / FALSE_ALARM) / 2.0)


def test_a_race_with_rounds_is_right_as_often_as_stated():
    """What the rounds dropped counts in what is stated."""
    _check_races(24)


@pytest.mark.long
def test_a_race_with_rounds_is_right_as_often_as_stated_in_many_runs():
    """The same with 1,200 races: a share of right ones below 0.84 would be noticed."""
    _check_races(1200)


@pytest.mark.long
def test_with_means_at_random_the_stated_bound_holds_in_the_mean():
    """Over layouts drawn at random the selections are right at least as often as their bounds say in the mean.

    Budgets end most runs before they are sure, so all bounds between 0 and 1 occur. The mean of the number of
    right selections is the sum of the true probabilities; by Hoeffding's inequality the number lies farther below
    than the margin with a probability of one in a million.
    """
    runs, right, stated = 800, 0, 0.0
    for seed in range(runs):
        draws = np.random.default_rng(seed)
        means = draws.normal(10.0, 2.0, 15)
        found, _ = _selected(means, None, 3.0, draws, 150)
        right += _right(found, means, None)
        stated += probability_of_correct_selection(found)
    assert right >= stated - np.sqrt(runs * np.log(1.0 / FALSE_ALARM) / 2.0)


def _wrong_ones(world, common, runs, trials):
    """Return how often equal shares alone, and allocation alone, select wrongly on the same means."""
    wrong = np.zeros((2, runs), dtype=bool)
    for seed in range(runs):
        for row, equal in enumerate((True, False)):
            draws = np.random.default_rng(seed)
            means, costs = world(draws)
            found, spent = _selected(means, costs, common, draws, trials, equal=equal)
            assert spent <= trials
            wrong[row, seed] = not _right(found, means, costs)
    return int((wrong[0] & ~wrong[1]).sum()), int((wrong[1] & ~wrong[0]).sum())


def _check_that_allocation_wins(world, common, runs, trials):
    """Of the runs in which one of the two is wrong, more than chance explains are those of equal shares.

    Were both equally good, each would be a toss of a coin (McNemar, Psychometrika 12, 1947).
    """
    equal_alone, allocated_alone = _wrong_ones(world, common, runs, trials)
    assert allocated_alone <= binom.ppf(0.01, equal_alone + allocated_alone, 0.5)


@pytest.mark.parametrize("common", COMMON)
def test_allocation_selects_the_best_more_often_than_equal_shares(common):
    """At the same budget of 150 trials on ten layouts."""
    _check_that_allocation_wins(_one_best, common, 100, 150)


def test_allocation_selects_the_front_more_often_than_equal_shares():
    """At the same budget of 180 trials on twelve layouts of two goals."""
    _check_that_allocation_wins(_front, 3.0, 120, 180)


@pytest.mark.long
@pytest.mark.parametrize(("world", "trials"), [(_one_best, 150), (_one_best, 300), (_front, 180), (_front, 400)])
def test_allocation_beats_equal_shares_in_many_runs(world, trials):
    """The same over 600 runs, and at larger budgets."""
    _check_that_allocation_wins(world, 3.0, 600, trials)


def test_layouts_as_good_as_equal_are_told_with_an_indifference():
    """With two layouts a twentieth of a deviation apart what is selected is good within the indifference."""
    good = stated = 0
    for seed in range(60):
        draws = np.random.default_rng(seed)
        means = draws.permutation(np.array([10.0, 10.05, 10.9, 11.2, 11.5, 12.0]))
        found, _ = _selected(means, None, 3.0, draws, 1000, confidence=CONFIDENCE, indifference=0.3)
        if probability_of_correct_selection(found) >= CONFIDENCE:
            stated += 1
            good += means[found.members[0]] <= means.min() + 0.3
    assert stated >= 54
    assert good >= binom.ppf(FALSE_ALARM, stated, CONFIDENCE)
