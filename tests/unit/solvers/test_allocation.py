"""Comparisons of a front on common drives, and where the next trials go."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.special import polygamma, stdtr

from solvers.allocation import _inverse_trigamma, compared, optimal_allocation, probability_of_correct_selection
from solvers.front import non_dominated

SMALL = st.lists(st.tuples(*[st.integers(0, 4).map(float)] * 3), min_size=1, max_size=9)
"""Costs, means shown and true means of a few layouts, with many ties."""


def _prefixes(full, counts):
    """Return a table in which each layout has its first replications alone."""
    return np.where(np.arange(full.shape[1]) < counts[:, None], full, np.nan)


@given(SMALL)
def test_on_complete_tables_the_front_is_the_ordinary_one(rows):
    """The sweep over paired differences finds what comparing all means does; of equals any may stand there."""
    costs, means, _ = np.array(rows).T
    found = compared(np.stack([means, means], axis=1), costs)
    expected = non_dominated(np.stack([costs, means], axis=1))
    assert [(costs[row], means[row]) for row in found.members] == [(costs[row], means[row]) for row in expected]


@given(SMALL)
def test_the_front_is_right_if_and_only_if_its_comparisons_are(rows):
    """For all true means without ties: the front shown is the true one just when each comparison holds."""
    costs, shown, true = np.array(rows).T
    true = true + np.arange(len(true)) / 100.0
    found = compared(np.stack([shown, shown], axis=1), costs)
    member = np.isin(found.rows, found.members)
    gap = true[found.rows] - true[found.rivals]
    holds = bool(np.where(member, gap < 0.0, gap > 0.0).all())
    assert holds is (set(found.members) == set(non_dominated(np.stack([costs, true], axis=1))))
    assert len(found.rows) == len(costs) - 1


def test_a_probability_is_that_of_students_distribution():
    """With few layouts nothing is shrunk: the bound is one less the tails of paired t-tests."""
    draws = np.random.default_rng(1)
    table = np.array([1.0, 1.5, 2.0])[:, None] + draws.normal(0.0, 1.0, (3, 12))
    best = int(table.mean(axis=1).argmin())
    tails = 0.0
    for row in set(range(3)) - {best}:
        difference = table[row] - table[best]
        tails += stdtr(11, -difference.mean() / (difference.std(ddof=1) / np.sqrt(12)))
    assert probability_of_correct_selection(compared(table)) == pytest.approx(1.0 - tails)


def test_only_common_replications_count():
    """What one layout did in drives that the other has not, or without a value for the other, changes nothing."""
    draws = np.random.default_rng(2)
    full = np.array([1.0, 1.2])[:, None] + draws.normal(0.0, 1.0, (2, 30))
    full[0, 3] = np.nan
    short = compared(full[:, :10])
    found = compared(_prefixes(full, np.array([10, 30])))
    assert found.pairs.tolist() == [9]
    assert found.wrong.tolist() == short.wrong.tolist()


def test_layouts_that_did_the_same_are_equal():
    """Where no drive tells two layouts apart the dearer one is rightly left out, and gets no trial."""
    draws = np.random.default_rng(3)
    row = draws.normal(5.0, 1.0, 6)
    found = compared(np.stack([row, row, row + 3.0 + draws.normal(0.0, 0.1, 6)]), np.array([1.0, 2.0, 3.0]))
    assert found.members.tolist() == [0]
    assert found.wrong[0] == 0.0
    assert optimal_allocation(found, np.full(3, 6), 10)[1] == 6


def test_without_a_common_drive_nothing_is_sure():
    """A comparison without a pair counts as wrong, one pair without a spread of others too."""
    assert probability_of_correct_selection(compared(np.array([[1.0, np.nan], [np.nan, 2.0]]))) == 0.0
    assert probability_of_correct_selection(compared(np.array([[1.0], [2.0]]))) == 0.0


def test_a_layout_that_may_not_be_a_member_speaks_against_the_front():
    """One with few drives and a better mean is no member; that it is left out counts as probably wrong."""
    draws = np.random.default_rng(4)
    full = np.array([5.0, 4.0])[:, None] + draws.normal(0.0, 0.3, (2, 20))
    table = _prefixes(full, np.array([20, 5]))
    found = compared(table, candidates=np.array([True, False]))
    assert found.members.tolist() == [0]
    assert found.wrong[0] > 0.5
    with pytest.raises(ValueError, match="at least one candidate"):
        compared(table, candidates=np.zeros(2, dtype=bool))


def test_means_given_choose_the_members_and_outcomes_judge_them():
    """A member that all drives speak against has a negative margin and is more probably wrong than right."""
    draws = np.random.default_rng(6)
    costs = np.array([1.0, 2.0, 3.0])
    table = np.array([5.0, 6.0, 3.0])[:, None] + draws.normal(0.0, 0.1, (3, 6))
    found = compared(table, costs, means=np.array([3.0, 2.0, 2.5]))
    assert found.members.tolist() == [0, 1]
    assert found.rows.tolist() == [1, 2]
    assert found.rivals.tolist() == [0, 1]
    assert (found.margin < 0.0).all()
    assert (found.wrong > 0.99).all()
    same = compared(table, costs, means=table.mean(axis=1))
    assert same.members.tolist() == compared(table, costs).members.tolist() == [0, 2]
    assert same.wrong.tolist() == compared(table, costs).wrong.tolist()


def test_means_given_make_no_member_of_one_that_did_the_same_for_less():
    """Whatever is predicted: a dearer layout with the same outcomes is left out, and that is not wrong."""
    draws = np.random.default_rng(7)
    row = 5.0 + draws.normal(0.0, 0.1, 6)
    table = np.stack([row, row, row - 3.0 + draws.normal(0.0, 0.1, 6), row - 3.0])
    found = compared(table, np.arange(4.0), means=np.array([3.0, 2.9, 2.0, 1.0]))
    assert found.members.tolist() == [0, 2, 3]
    assert found.rivals[found.rows.tolist().index(1)] == 0
    assert found.wrong[found.rows.tolist().index(1)] == 0.0
    # Of one drive in common nobody can say whether two layouts are equal.
    assert compared(table[:2, :1], np.arange(2.0), means=np.array([3.0, 2.9])).members.tolist() == [0, 1]


def test_an_indifference_takes_what_does_not_matter_for_right():
    """Two layouts a hair apart are sure to be right within a difference that is much larger."""
    draws = np.random.default_rng(5)
    table = np.array([5.0, 5.01])[:, None] + draws.normal(0.0, 0.1, (2, 20))
    unsure = probability_of_correct_selection(compared(table))
    assert unsure < 0.9
    assert probability_of_correct_selection(compared(table, indifference=0.5)) > 0.999
    assert probability_of_correct_selection(compared(table, scales=np.full(2, 5.0), indifference=0.1)) > 0.999


@pytest.mark.parametrize("prior", [2.0, 4.0, 20.0])
def test_the_spread_of_variances_is_found(prior):
    """Degrees of freedom come back from the trigamma function, and shrinking mends single variances.

    Deviations of 4,000 layouts are drawn from the prior; with three replications the logarithm of a shrunk one
    lies nearer to the truth than that of a single one in the mean of squares.
    """
    assert _inverse_trigamma(float(polygamma(1, prior / 2.0))) == pytest.approx(prior / 2.0)
    draws = np.random.default_rng(6)
    true = np.sqrt(prior / draws.chisquare(prior, 4000))
    table = np.vstack([np.zeros(3), 1e6 + draws.normal(0.0, 1.0, (4000, 3)) * true[:, None]])
    found = compared(table)
    single = table[found.rows].std(axis=1, ddof=1)
    off = [np.mean(np.log(deviation / true) ** 2) for deviation in (found.deviation, single)]
    assert off[0] < 0.9 * off[1]


def _exact(means, deviations, replications, seed=7):
    """Return a table whose rows have just these means and sample deviations."""
    noise = np.random.default_rng(seed).normal(0.0, 1.0, (len(means), replications))
    noise = (noise - noise.mean(axis=1, keepdims=True)) / noise.std(axis=1, ddof=1, keepdims=True)
    return np.asarray(means)[:, None] + np.asarray(deviations)[:, None] * noise


def test_with_many_trials_the_rule_is_that_of_optimal_computing_budget_allocation():
    """Trials of the layouts left out are as the squares of deviation over margin (Chen et al. 2000).

    The limit is approached as a logarithm over the number of trials, hence a tenth of leeway.
    """
    means, deviations = np.array([0.0, 1.0, 2.0, 3.0]), np.array([0.0, 2.0, 3.0, 4.0])
    found = compared(_exact(means, deviations, 4000))
    counts = optimal_allocation(found, np.full(4, 4000), 200_000)
    wanted = (deviations[1:] / means[1:]) ** 2
    assert counts[1:] / counts[1] == pytest.approx(wanted / wanted[0], rel=0.1)
    assert counts[0] == counts[1:].max()


@given(st.integers(0, 10**6), st.integers(0, 400), st.integers(1, 12))
def test_a_batch_is_spent_to_the_last_trial(seed, batch, count):
    """No layout loses trials, none goes beyond its most, and the sum is the batch or all that may be spent."""
    draws = np.random.default_rng(seed)
    counts = draws.integers(2, 9, count)
    table = _prefixes(draws.normal(5.0, 1.0, (count, 8)), counts)
    found = compared(table, draws.integers(0, 4, count).astype(float))
    most = counts + draws.integers(0, 60, count)
    got = optimal_allocation(found, counts, batch, most=most)
    assert (got >= counts).all()
    assert (got <= most).all()
    assert (got - counts).sum() <= batch
    free = optimal_allocation(found, counts, batch)
    assert (free - counts).sum() == (batch if count > 1 else 0)


def test_rounding_prefers_the_earlier_of_equal_layouts():
    """Layouts that cannot be told apart by their numbers get what is left over by row, one trial at most."""
    table = np.array([[0.0, 0.2, 0.1], [5.0, 6.0, 7.0], [5.0, 6.0, 7.0], [5.0, 6.0, 7.0]])
    apart = []
    for batch in range(1, 20):
        got = optimal_allocation(compared(table), np.full(4, 3), batch)
        assert got[1] >= got[2] >= got[3]
        apart.append(got[1] - got[3])
    assert set(apart) == {0, 1}


def test_a_hopeless_tie_does_not_get_everything():
    """A pair a thousandth apart takes the smaller part of a batch if other comparisons can be decided."""
    counts = np.array([64, 64, 4, 4, 4, 4])
    table = np.full((6, 64), np.nan)
    table[:2] = _exact([1.0, 1.001], [1.0, 1.0], 64)
    table[2:, :4] = table[0, :4] + _exact([0.7] * 4, [1.0] * 4, 4)
    got = optimal_allocation(compared(table), counts, 20) - counts
    assert got.sum() == 20
    assert got[2:].sum() > 10
