"""What a composed layout is predicted to do: uniform layouts' paired outcomes, put together zone by zone.

The error within a zone depends nearly on the pattern of that zone and on the readers alone. So every reader group
drives once over each pattern laid everywhere, and what a layout with several patterns would do on a drive is put
together from the same drive over each of them. A robot that comes out of one zone brings its error into the next,
which the prediction leaves out: predictions choose what to simulate and are no results.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from layoutopt.identity import FloatArray
from layoutopt.scores import TrialOutcomes

_MEANS: Final = ("position_error_mean", "heading_error_mean")
"""Columns that are means over steps and have a twin for each zone, so that they compose exactly."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Shares:
    """Where the robot is on each drive.

    A slot is a part of the floor with one pattern: the floor outside all zones with patterns of their own, then
    each of these zones, less what a later zone takes from it.

    Attributes
    ----------
    ruled
        Share of the judged time of a drive that the robot spends on each slot, the floor first, shape
        (replications, slots); rows sum to 1.
    within
        The same of the judged time within each zone with a target; rows are NaN for drives that never enter it.
    """

    ruled: FloatArray
    within: Mapping[str, FloatArray]

    def __post_init__(self) -> None:
        """Check that the rows are shares.

        Raises
        ------
        ValueError
            If a row does not sum to 1.
        """
        for name, share in {"": self.ruled, **self.within}.items():
            sums = share.sum(axis=1)
            if not np.allclose(sums[~np.isnan(sums)], 1.0, atol=1e-9) or (not name and np.isnan(sums).any()):
                raise ValueError(f"shares of time{f' in {name}' if name else ''} must sum to 1 on each drive")


def zone_terms(outcomes: TrialOutcomes, names: Sequence[str], zones: Sequence[str], shares: Shares) -> FloatArray:
    """Return what each slot adds to scores where it has the pattern of a uniform layout.

    The sum over slots, each with the terms of its own pattern's layout, is the prediction for a drive; where all
    slots have one pattern, it is that layout's outcome to rounding.

    - The score of a zone is the zone's own, weighted by the share of the time in it that each slot rules: all of
      it, unless zones overlap.
    - A mean over steps on the whole floor is the mean of the zones weighted by time. What zones with a target do
      not account for is the rest, which the other slots share by time. This is exact where no zones overlap and
      every error stays in its zone.
    - Of any other score on the whole floor, such as a 95 % quantile, nothing is known by zone: there the whole
      layouts' scores are weighted by time, which is an approximation.

    Parameters
    ----------
    outcomes
        Of the uniform layout, on drives 0 to n - 1.
    names
        Columns of the outcomes that are predicted.
    zones
        Zone of each slot, the floor ``""`` first.
    shares
        Of at least n drives.

    Returns
    -------
    Shape (slots, names, n); NaN for drives that say nothing of a zone.

    Raises
    ------
    ValueError
        If the outcomes are not of the first drives, or there are shares of fewer.
    """
    count = len(outcomes)
    if not np.array_equal(outcomes.replications, np.arange(count)) or len(shares.ruled) < count:
        raise ValueError(f"shares of {len(shares.ruled)} drives for outcomes of {outcomes.replications.tolist()}")
    terms = np.empty((len(zones), len(names), count))
    ruled = shares.ruled[:count].T
    for number, name in enumerate(names):
        zone, _, column = name.rpartition(".")
        values = outcomes.column(name)
        if zone:
            terms[:, number] = shares.within[zone][:count].T * values
        elif column in _MEANS:
            terms[:, number] = _mean_terms(outcomes, column, zones, ruled)
        else:
            terms[:, number] = ruled * values
    return terms


def _mean_terms(outcomes: TrialOutcomes, column: str, zones: Sequence[str], ruled: FloatArray) -> FloatArray:
    """Return what each slot adds to a mean over steps on the whole floor, shape (slots, n)."""
    terms = np.zeros_like(ruled)
    others = []
    for slot, zone in enumerate(zones):
        if zone and f"{zone}.{column}" in outcomes.columns:
            # A zone that a drive never enters has no share of it.
            terms[slot] = ruled[slot] * np.nan_to_num(outcomes.column(f"{zone}.{column}"))
        else:
            others.append(slot)
    rest = outcomes.column(column) - terms.sum(axis=0)
    time = ruled[others].sum(axis=0)
    for slot in others:
        alone = 1.0 if slot == others[0] else 0.0
        terms[slot] = rest * np.divide(ruled[slot], time, out=np.full_like(time, alone), where=time > 0.0)
    return terms
