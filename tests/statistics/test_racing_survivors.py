"""The selection step of the race on normal means with a known best."""

import itertools

import numpy as np
import pytest

from solvers.halving import least_dominated, survivors
from solvers.racing import Racing


def test_the_best_of_equal_cost_survives():
    """With common noise and a clear best the best layout stays in at least 990 of 1,000 races.

    The best leads by 1.0 with an own noise of 0.5 and four replications: the difference of two means has a
    standard error of 0.354, the lead is 2.8 of them, and 20 of 40 places are kept. A failure needs 20 rivals
    ahead; its probability is far below 1e-6 a race, so the false-alarm rate of the limit is below 1e-9.
    """
    draws = np.random.default_rng(5)
    kept = 0
    for _ in range(1000):
        means = np.full(40, 10.0)
        means[17] = 9.0
        errors = means[:, None] + draws.normal(0, 3.0, 4)[None, :] + draws.normal(0, 0.5, (40, 4))
        kept += 17 in survivors(np.ones(40), errors, 20)
    assert kept >= 990


def test_a_dearer_and_worse_layout_goes_first():
    """Layouts beaten by a cheaper one leave, those on the front stay, whatever the common noise."""
    draws = np.random.default_rng(6)
    costs = np.array([1.0, 2.0, 3.0, 4.0])
    means = np.array([8.0, 12.0, 4.0, 9.0])
    errors = means[:, None] + draws.normal(0, 5.0, 6)[None, :] + draws.normal(0, 0.01, (4, 6))
    assert survivors(costs, errors, 2).tolist() == [0, 2]


def test_common_random_numbers_decide():
    """Columns that share their noise separate layouts that independent columns could not."""
    draws = np.random.default_rng(7)
    common = draws.normal(0, 100.0, 8)
    means = np.arange(10, dtype=np.float64)
    errors = 500.0 + means[:, None] + common[None, :] + draws.normal(0, 0.05, (10, 8))
    assert survivors(np.ones(10), errors, 3).tolist() == [0, 1, 2]


def test_one_replication_compares_by_ratios():
    """The rival is the best that costs no more; a layout twice as bad leaves before one a tenth worse."""
    costs = np.array([1.0, 2.0, 3.0, 4.0, 5.0])
    errors = np.array([[10.0], [20.0], [5.0], [5.5], [1.0]])
    assert survivors(costs, errors, 4).tolist() == [0, 2, 3, 4]
    assert survivors(costs, errors, 3).tolist() == [0, 2, 4]
    assert survivors(costs, 1e-3 * errors, 3).tolist() == [0, 2, 4]


def test_least_dominated_by_logarithms():
    """The same rows as by one replication near a tie, and a row without a rival always stays."""
    costs = np.array([1.0, 2.0, 3.0, 4.0, 5.0])
    means = np.log([10.0, 20.0, 5.0, 5.5, 1.0])
    assert least_dominated(costs, means, 4).tolist() == [0, 2, 3, 4]
    assert least_dominated(costs, means, 3).tolist() == [0, 2, 4]
    assert least_dominated(costs, means + 7.0, 3).tolist() == [0, 2, 4]
    assert least_dominated(costs, means, 9).tolist() == [0, 1, 2, 3, 4]


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        ({"first_trials": 0}, "needs a first trial"),
        ({"first_trials": 4, "most_trials": 3}, "4 first trials are more than the most, 3"),
        ({"confidence": 0.0}, "a probability above 0, not 0.0"),
        ({"confidence": 1.5}, "a probability above 0, not 1.5"),
        ({"indifference": float("nan")}, "0 or more, not nan"),
    ],
)
def test_settings_that_make_no_race_are_refused(settings, message):
    """At once, and not after the screen: a plan from no first trial would never end."""
    with pytest.raises(ValueError, match=message):
        Racing(**settings)


def test_the_plan_keeps_to_the_most_trials():
    """No round goes beyond the most trials, and one first trial starts the doubling at one."""
    assert Racing(trials=4000, first_trials=1).rounds(700)[0] == (700, 1)
    ends = [until for _, until in Racing(trials=4000, first_trials=1, most_trials=3).rounds(700)]
    assert ends == [1, 2]
    assert Racing(trials=4000).rounds(100)[-1][1] > 3


def test_the_plan_keeps_to_its_budget():
    """Rounds halve the layouts, double the trials, and cost no more than the trials allowed."""
    race = Racing(trials=4000)
    plan = race.rounds(700)
    spent, before = 0, 0
    for layouts, until in plan:
        spent += layouts * (until - before)
        before = until
    assert plan[0] == (700, 2)
    assert all(
        later[0] <= -(-earlier[0] // 2) or later[0] == race.finalists
        for earlier, later in itertools.pairwise(plan)
    )
    assert 2000 < spent <= 3000


def test_no_place_keeps_nobody_without_a_warning():
    """A race with one layout has no half of a place to give by the goal."""
    assert survivors(np.ones(1), np.ones((1, 4)), 0).tolist() == []
    assert survivors(np.ones(1), np.ones((1, 4)), 1).tolist() == [0]
