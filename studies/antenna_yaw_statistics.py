"""What trials say of many choices at once, by bootstrap over trials: rank correlations, the chance to be best."""

import math
from typing import Final

import numpy as np

from layoutopt.identity import FloatArray, IntArray
from studies.screening import Correlation, rank_correlation

RESAMPLES: Final = 2000
"""So that the ends of a 95 % interval rest on fifty resamples each."""
_TAILS: Final = (0.025, 0.975)


def resampled(count: int, seed: int) -> IntArray:
    """Return the replications of each resample, shape (`RESAMPLES`, count), the same for the same seed."""
    return np.random.Generator(np.random.Philox(seed)).integers(0, count, (RESAMPLES, count))


def resampled_means(errors: FloatArray, seed: int) -> FloatArray:
    """Return the mean error of each choice in each resample, shape (choices, `RESAMPLES`).

    All choices met the same random numbers, so a resample draws replications, the same for all.

    Parameters
    ----------
    errors
        Shape (choices, replications).
    """
    draws = resampled(errors.shape[1], seed)
    return np.stack([row[draws].mean(axis=1) for row in errors])


def bootstrapped_correlation(cheap: FloatArray, errors: FloatArray, seed: int) -> Correlation:
    """Return Spearman's rank correlation of a score with the mean error, and its percentile interval.

    Not known with fewer than six choices or where the score never changes (`studies.screening.rank_correlation`).
    The interval says what other trials would have given for these choices, not what other choices would.

    Parameters
    ----------
    cheap
        Score of each choice, shape (choices,).
    errors
        Error in each replication, shape (choices, replications).

    References
    ----------
    Efron and Tibshirani, An Introduction to the Bootstrap, 1993, Section 13.3.
    """
    value = rank_correlation(cheap, errors.mean(axis=1)).value
    if math.isnan(value) or errors.shape[1] < 2:
        return Correlation(value=value, low=math.nan, high=math.nan)
    # Imported here: it costs more than all the rest of a short command.
    from scipy.stats import rankdata

    ranks = rankdata(cheap)
    drawn = rankdata(resampled_means(errors, seed), axis=0)
    ranks, drawn = ranks - ranks.mean(), drawn - drawn.mean(axis=0)
    values = ranks @ drawn / np.sqrt((ranks**2).sum() * (drawn**2).sum(axis=0))
    low, high = np.quantile(values, _TAILS)
    return Correlation(value=value, low=float(low), high=float(high))


def chance_to_be_best(errors: FloatArray, seed: int) -> float:
    """Return the share of resamples in which the first choice has the least mean error.

    Parameters
    ----------
    errors
        Shape (choices, replications).
    """
    means = resampled_means(errors, seed)
    return float((means[0] <= means.min(axis=0)).mean())
