"""Fitted numbers with what is known of their error."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np

from layoutopt.identity import FloatArray
from layoutopt.scores import NORMAL_95, wilson

_STEP: Final = 1e-3


@dataclass(frozen=True, slots=True, kw_only=True)
class Fitted:
    """A number fitted from a drive.

    Attributes
    ----------
    value, se
        The estimate and its standard error.
    low, high
        Bounds of the 95 % interval.
    count, of
        What it was fitted from: how many of what.
    """

    value: float
    se: float
    low: float
    high: float
    count: int
    of: str


def fitted_share(hits: int, count: int, of: str) -> Fitted:
    """Return a share after ``hits`` of ``count`` with its Wilson interval."""
    low, high = wilson(hits, count)
    share = hits / count if count else math.nan
    return Fitted(
        value=share,
        se=math.sqrt(share * (1.0 - share) / count) if count else math.nan,
        low=low,
        high=high,
        count=count,
        of=of,
    )


def log_scaled(value: float, log_se: float, count: int, of: str) -> Fitted:
    """Return a positive number whose logarithm has a normal error of ``log_se``."""
    spread = math.exp(min(NORMAL_95 * log_se, 50.0))
    return Fitted(value=value, se=value * log_se, low=value / spread, high=value * spread, count=count, of=of)


def hessian(function: Callable[[FloatArray], float], at: FloatArray) -> FloatArray:
    """Return the second derivatives of a function by central differences, shape (k, k)."""
    size = len(at)
    shifts = _STEP * np.eye(size)
    second = np.empty((size, size))
    for row in range(size):
        for column in range(row, size):
            values = [
                function(at + one * shifts[row] + two * shifts[column]) for one in (1, -1) for two in (1, -1)
            ]
            second[row, column] = second[column, row] = (values[0] - values[1] - values[2] + values[3]) / (
                4.0 * _STEP**2
            )
    return second
