"""Simulated errors as an objective: a reduction of outcomes and nothing else."""

import math

import numpy as np

from layoutopt.scores import OUTCOME_COLUMNS, SCORE_UNITS, TrialOutcomes
from objectives.localization import CARD, Localization

# The objective looks at neither layout nor scenario, and these tests hold it to that.
NOTHING = None


def test_without_outcomes_there_are_no_scores():
    """A layout that was not simulated has no simulated score, rather than a guess."""
    assert Localization()(NOTHING, NOTHING, None) == {}
    empty = TrialOutcomes(replications=np.arange(0), columns=("lost_share",), values=np.empty((0, 1)))
    assert Localization()(NOTHING, NOTHING, empty) == {}


def test_every_column_becomes_the_score_of_its_name():
    """Means and standard errors of all columns, those of zones with their prefix."""
    columns = (*OUTCOME_COLUMNS, "dock.position_error_mean")
    values = np.arange(4.0 * len(columns)).reshape(4, -1)
    found = Localization()(
        NOTHING, NOTHING, TrialOutcomes(replications=np.arange(4), columns=columns, values=values)
    )
    assert set(found) == set(columns)
    for number, name in enumerate(columns):
        assert found[name].value == values[:, number].mean()
        assert found[name].standard_error == values[:, number].std(ddof=1) / 2.0
        assert found[name].unit == SCORE_UNITS[name.removeprefix("dock.")]
        assert found[name].count == 4


def test_an_estimator_without_covariance_leaves_consistency_unknown():
    """A column without any value becomes an unknown score, not a zero."""
    table = TrialOutcomes(replications=np.arange(2), columns=("nees",), values=np.full((2, 1), np.nan))
    score = Localization()(NOTHING, NOTHING, table)["nees"]
    assert math.isnan(score.value)
    assert not score.exact


def test_the_card_names_all_columns():
    """What trials give is what the objective promises."""
    assert tuple(CARD.scores) == OUTCOME_COLUMNS
