"""The run-off of a race: after the rounds, trials go where they make the front surer, batch by batch."""

from dataclasses import dataclass
from typing import Final

import numpy as np

from layoutopt.identity import BoolArray, FloatArray, IntArray
from solvers.allocation import Comparisons, compared, optimal_allocation, probability_of_correct_selection
from solvers.borrowing import borrowed_log_means

_BATCHES: Final = 8
"""Allocations of a run-off: each sees what the one before it brought, and all workers wait at its end."""
_LEAST_SCALE: Final = 1e-12
"""Relative deviations of layouts without any error are taken against this."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RunOff:
    """Where a run-off stands.

    Attributes
    ----------
    wanted
        Trials that each layout should have now, shape (n,). Where all have them, the run-off is over.
    found
        The front on the trials of the last batch that is complete, with its comparisons.
    borrowed
        Whether the members were chosen by means that borrow from the other layouts. The comparisons, and with them
        the probabilities, rest on the trials alone in any case.
    """

    wanted: IntArray
    found: Comparisons
    borrowed: bool


def run_off(
    errors: FloatArray,
    costs: FloatArray,
    available: IntArray,
    counts: IntArray,
    candidates: BoolArray,
    *,
    trials: int,
    confidence: float,
    indifference: float,
    most: int | None = None,
    features: FloatArray | None = None,
) -> RunOff:
    """Return how a run-off stands: a replay of its batches, so a function of the outcomes alone.

    Parameters
    ----------
    errors
        Goal to be made small, shape (n, r), NaN where there is no trial or no value.
    costs
        Exact other goal, shape (n,).
    available
        Trials that each layout has, shape (n,).
    counts
        Trials that each had before the run-off, at most ``available``, shape (n,).
    candidates
        Layouts that came through the rounds, shape (n,). Others may join the front when they have as many trials.
    trials
        Budget of the run-off.
    confidence
        It ends before the budget does when the front is right with this probability.
    indifference
        Share of the error that does not matter.
    most
        No layout gets more trials; ``None`` for no bound.
    features
        What is known of each layout without a trial, as `solvers.borrowing.features_of` gives it. Then the front
        is that of the means that borrow from other layouts, if there are such means, and every layout may join it.
    """
    base = int(counts[candidates].min())
    batch, left = -(-trials // _BATCHES), trials
    while True:
        known = up_to(errors, counts)
        log_means = None if features is None else borrowed_log_means(known, features)
        found = compared(
            known,
            costs,
            candidates=candidates | (counts >= base) if log_means is None else np.isfinite(log_means),
            means=log_means,
            scales=_scales(known),
            indifference=indifference,
        )
        wanted = counts
        if left > 0 and probability_of_correct_selection(found) < confidence:
            ceiling = 2 * counts if most is None else np.minimum(2 * counts, most)
            wanted = optimal_allocation(found, counts, min(batch, left), most=ceiling)
        if (wanted == counts).all() or (available < wanted).any():
            return RunOff(wanted=wanted, found=found, borrowed=log_means is not None)
        left -= int((wanted - counts).sum())
        counts = wanted


def up_to(errors: FloatArray, counts: IntArray) -> FloatArray:
    """Return the outcomes of the first ``counts`` trials of each layout, NaN behind them."""
    longest = int(counts.max())
    return np.where(np.arange(longest) < counts[:, None], errors[:, :longest], np.nan)


def _scales(errors: FloatArray) -> FloatArray:
    """Return the mean error of each layout, to which deviations are about proportional; unknown, that of all."""
    known = ~np.isnan(errors)
    sums, values = np.where(known, errors, 0.0).sum(axis=1), known.sum(axis=1)
    overall = float(sums.sum()) / max(int(values.sum()), 1)
    means = np.divide(sums, values, out=np.full(len(errors), overall), where=values > 0)
    return np.asarray(np.maximum(means, _LEAST_SCALE))
