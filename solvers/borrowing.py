"""Borrowing strength: mean errors of layouts, each drawn towards what the exact scores of all layouts predict.

A layout with two trials says little of itself, but what a hundred layouts with two trials each say of how errors
follow cost, reads and gaps says much. The logarithm of a mean error is taken for a linear function of the exact
scores, plus a part of the layout's own, plus noise that falls with its trials:

    log mean = level + scores · slopes + own + noise,   own ~ N(0, A),   slopes ~ N(0, B / scores),
    noise ~ N(0, v / trials).

This is the model of Fay and Herriot (Journal of the American Statistical Association 74, 1979) with a normal prior
of the slopes. Noise is measured within layouts, A and B by the likelihood of all means. If exact scores say
nothing, B comes out small and means keep to their trials; with many trials they always do. What is approximate:
noise is as large in every layout relative to its mean, and variances are taken for known once they are estimated.
"""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from layoutopt.identity import FloatArray, IntArray
from layoutopt.result import Evaluated

FEWEST_LAYOUTS: Final = 10
"""With fewer means than that, variances between layouts cannot be told from anything else."""
_FEWEST_DEGREES: Final = 5
"""Degrees of freedom within layouts from which on the noise counts as measured."""
_SWEEPS: Final = 30
"""Turns of fitting layouts and drives to each other; a turn leaves a small part of the error of the one before."""
_WIDE_RATIO: Final = 2.0
"""A positive score whose largest value is that many times the least works by its logarithm."""
_EQUAL: Final = 1e-9
"""Scores that vary less than this, relative to their size, are the same for all."""
_SLOPE_RATIOS: Final = tuple(4.0**power for power in range(-4, 11))
"""B over v that are tried, up to a million: steps of four change the slopes by less than their errors."""
_OWN_RATIOS: Final = (0.0, *_SLOPE_RATIOS)
"""A over v that are tried; without a measure of the noise it is 1, because nothing tells the two apart."""


@dataclass(frozen=True, slots=True, kw_only=True)
class _Means:
    """Relative means: logarithms with drives taken out, shape (n,), their trials, and the noise of one trial."""

    logarithms: FloatArray
    trials: IntArray
    noise: float | None


def features_of(contenders: Sequence[Evaluated]) -> FloatArray:
    """Return the exact scores that all layouts have, standardised, shape (n, scores).

    Scores that are the same for all are left out. A positive score that spans more than a factor of two enters by
    its logarithm, since costs, densities and reads act by ratios; any other as it is.
    """
    names = sorted(set.intersection(*(set(item.scores) for item in contenders))) if contenders else []
    columns = []
    for name in names:
        values = np.array([item.scores[name].value for item in contenders])
        size = float(np.abs(values).max())
        if not np.isfinite(values).all() or np.ptp(values) <= _EQUAL * size:
            continue
        if values.min() > _EQUAL * size and values.max() > _WIDE_RATIO * values.min():
            values = np.log(values)
        columns.append((values - values.mean()) / values.std())
    return np.stack(columns, axis=1) if columns else np.empty((len(contenders), 0))


def borrowed_log_means(outcomes: FloatArray, features: FloatArray) -> FloatArray | None:
    """Return the posterior mean of the logarithm of each layout's mean error, shape (n,), up to a common constant.

    Parameters
    ----------
    outcomes
        Goal to be made small, shape (n, r), NaN where there is no trial or no value. All layouts meet the same
        drives.
    features
        What is known of each layout without a trial, shape (n, p), every column with mean 0 and variance 1.

    Returns
    -------
    FloatArray or None
        Infinite for a layout without any value. ``None`` where the model cannot be: without features, with fewer
        than ten layouts, where a layout or a drive has no error at all, as logarithms need one, or where there is
        nothing to borrow for: all means are equal, or outcomes have no noise.

    Notes
    -----
    Sums are taken by ``einsum``, which does not depend on the number of threads.
    """
    known = ~np.isnan(outcomes)
    seen = known.any(axis=1)
    if seen.sum() < FEWEST_LAYOUTS or not features.shape[1]:
        return None
    means = _relative_means(outcomes[seen][:, known.any(axis=0)])
    if means is None:
        return None
    found = np.full(len(outcomes), np.inf)
    found[seen] = _posterior(means, features[seen] / math.sqrt(features.shape[1]))
    return found


def _relative_means(outcomes: FloatArray) -> _Means | None:
    """Return the means of layouts, each drive's outcomes divided by how hard the drive is for all that meet it.

    Layouts and drives are factors, fitted in turn by means of ratios; nothing but a factor in common is lost.
    """
    known = ~np.isnan(outcomes)
    values = np.where(known, outcomes, 0.0)
    trials, layouts = known.sum(axis=1), known.sum(axis=0)
    drives = np.ones(outcomes.shape[1])
    means = values.sum(axis=1) / trials
    for _ in range(_SWEEPS):
        if (means <= 0.0).any():
            return None
        drives = (values / means[:, None]).sum(axis=0) / layouts
        if (drives <= 0.0).any():
            return None
        means = (values / drives).sum(axis=1) / trials
    residuals = np.where(known, values / (means[:, None] * drives) - 1.0, 0.0)
    degrees = int((trials - 1).sum()) - (len(drives) - 1)
    noise = float((residuals**2).sum()) / degrees if degrees >= _FEWEST_DEGREES else None
    logarithms = np.log(means)
    if noise == 0.0 or np.ptp(logarithms) == 0.0:
        return None
    # The logarithm of a mean of few trials lies below that of the mean of many by half of its variance.
    bias = 0.0 if noise is None else noise / trials / 2.0
    return _Means(logarithms=logarithms + bias, trials=trials, noise=noise)


def _posterior(means: _Means, features: FloatArray) -> FloatArray:
    """Return the means under the most likely variances of those that are tried."""
    likelihoods, posteriors = [], []
    for own in (1.0,) if means.noise is None else _OWN_RATIOS:
        weights = 1.0 / (own + 1.0 / means.trials)
        for likelihood, trend in _trends(means, features, weights):
            likelihoods.append(likelihood)
            posteriors.append(trend + own * weights * (means.logarithms - trend))
    return np.asarray(posteriors[int(np.argmax(likelihoods))])


def _trends(means: _Means, features: FloatArray, weights: FloatArray) -> Iterator[tuple[float, FloatArray]]:
    """Yield restricted log likelihood and predicted means for each variance of the slopes, under given weights.

    All variances are relative to the noise.
    """
    count, columns = features.shape
    targets = np.stack([np.ones(count), means.logarithms], axis=1)
    weighted = weights[:, None] * targets
    gram = np.einsum("ni,nj->ij", features, weights[:, None] * features)
    moments = np.einsum("ni,nk->ik", features, weighted)
    totals = np.einsum("nk,nl->kl", targets, weighted)
    for slope in _SLOPE_RATIOS:
        precision = gram + np.eye(columns) / slope
        solved = np.linalg.solve(precision, moments)
        products = totals - np.einsum("ik,il->kl", moments, solved)
        level = products[0, 1] / products[0, 0]
        slopes = solved[:, 1] - level * solved[:, 0]
        predicted = level + np.einsum("ni,i->n", features, slopes)
        # A sum of squares, because a difference of products may be rounded to zero where means hardly differ.
        left = means.logarithms - predicted
        squares = float((weights * left**2).sum() + (slopes**2).sum() / slope)
        # Without a measure of the noise the most likely one is put in.
        noise = squares / (count - 1) if means.noise is None else means.noise
        log_determinant = (
            float(np.linalg.slogdet(precision)[1])
            + columns * math.log(slope)
            - float(np.log(weights).sum())
            + math.log(products[0, 0])
        )
        likelihood = -0.5 * ((count - 1) * math.log(noise) + squares / noise + log_determinant)
        yield likelihood, predicted
