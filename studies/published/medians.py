"""Medians over trials with intervals that assume nothing of the distribution."""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np

from layoutopt.identity import FloatArray

_FEWEST: Final = 6
"""Values below which no interval of 95 % is given: six independent ones lie on one side in 3 of 100 cases."""
_RESAMPLES: Final = 2000
_STREAM: Final = 2020


@dataclass(frozen=True, slots=True, kw_only=True)
class Median:
    """A median of ``count`` trials with its interval; infinite ends where there are too few trials for one."""

    value: float
    low: float
    high: float
    count: int

    @property
    def text(self) -> str:
        """Median and interval in words, with three decimals."""
        if not math.isfinite(self.low):
            return f"{self.value:.3f}"
        return f"{self.value:.3f} ({self.low:.3f} to {self.high:.3f})"


def median(values: FloatArray, confidence: float = 0.95) -> Median:
    """Return the median with its two-sided interval.

    The interval goes from the k-th smallest to the k-th largest value, with the largest k at which the median
    lies outside with a chance of at most one less the confidence. Six trials are the fewest with an interval of
    95 %.

    Raises
    ------
    ValueError
        If there is no value or one is no number.

    References
    ----------
    David, Nagaraja: Order Statistics (2003), Section 7.1.

    Examples
    --------
    >>> found = median(np.arange(1.0, 9.0))
    >>> found.value, found.low, found.high
    (4.5, 1.0, 8.0)
    """
    values = np.sort(np.asarray(values, dtype=np.float64))
    if not len(values) or np.isnan(values).any():
        raise ValueError(f"a median needs one number or more and nothing else, got {values.tolist()}")
    # Imported here: it costs more than all the rest of a short command.
    from scipy.special import bdtr

    count = len(values)
    ranks = np.arange(1, count // 2 + 1)
    fitting = ranks[2.0 * bdtr(ranks - 1, count, 0.5) <= 1.0 - confidence]
    value = float(np.median(values))
    if not len(fitting):
        return Median(value=value, low=-math.inf, high=math.inf, count=count)
    rank = int(fitting[-1])
    return Median(value=value, low=float(values[rank - 1]), high=float(values[count - rank]), count=count)


def ratio_of_medians(first: FloatArray, second: FloatArray, confidence: float = 0.95) -> Median:
    """Return the median of ``first`` over that of ``second``, whose values belong together in pairs.

    The interval is that of resampled pairs (percentiles of 2,000 samples of a fixed stream), infinite ends below
    six pairs.

    Raises
    ------
    ValueError
        If the two are not of one length, or empty.

    References
    ----------
    Efron, Tibshirani: An Introduction to the Bootstrap (1993), Chapter 13.
    """
    first, second = np.asarray(first, dtype=np.float64), np.asarray(second, dtype=np.float64)
    if first.shape != second.shape or not len(first):
        raise ValueError(f"pairs need as many values on both sides, got {first.shape} and {second.shape}")
    count = len(first)
    value = float(np.median(first) / np.median(second))
    if count < _FEWEST:
        return Median(value=value, low=-math.inf, high=math.inf, count=count)
    draws = np.random.Generator(np.random.Philox(_STREAM))
    picked = draws.integers(count, size=(_RESAMPLES, count))
    ratios = np.median(first[picked], axis=1) / np.median(second[picked], axis=1)
    low, high = np.quantile(ratios, [(1.0 - confidence) / 2.0, (1.0 + confidence) / 2.0])
    return Median(value=value, low=float(low), high=float(high), count=count)
