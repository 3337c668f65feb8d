"""Whether chosen reader groups are better in drives than those of a spec, and whether the model foresaw it."""

import itertools
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np

from layoutopt.identity import FloatArray, IntArray
from layoutopt.score_text import NOT_KNOWN
from layoutopt.scores import Score, TrialOutcomes
from solvers.information import CRITERIA
from studies.published.comparison import paired_ratio
from studies.reader_group_setting import Comparison, Contender, Setting, chosen_label, pairs
from studies.screening import Correlation, rank_correlation

Found = Mapping[tuple[int, str], TrialOutcomes]
"""Outcomes by number of the setting and label of the group."""
COLUMNS: Final = {"position_error_mean": "position", "heading_error_mean": "heading"}
"""What is compared, and its word."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Verdict:
    """A chosen group's error over that of the spec's group with the least error in the same setting and trials."""

    setting: Setting
    criterion: str
    rival: str
    ratio: Score

    @property
    def better(self) -> bool:
        """Whether the interval of the ratio lies below one."""
        return self.ratio.interval()[1] < 1.0

    @property
    def worse(self) -> bool:
        """Whether the interval of the ratio lies above one."""
        return self.ratio.interval()[0] > 1.0


def verdicts(comparison: Comparison, found: Found, column: str) -> list[Verdict]:
    """Return a verdict for each chosen group that has rivals; the best rival is picked by the same trials."""
    made = []
    for number, setting in enumerate(comparison.settings):
        rival = best_rival(setting, number, found, column)
        for criterion in CRITERIA:
            ours = found.get((number, chosen_label(criterion)))
            if rival is not None and ours is not None:
                ratio = paired_ratio(ours, found[number, rival.label], column)
                made.append(Verdict(setting=setting, criterion=criterion, rival=rival.label, ratio=ratio))
    return made


def mean_ratio_text(comparison: Comparison, found: Found, column: str, criterion: str) -> str:
    """Return the geometric mean of the ratios of a criterion over all settings, with its 95 % interval.

    Settings share their drives, so the interval is that of a mean over drives: each drive counts with the mean
    over settings of what it adds to the logarithm of the ratio (the delta method; Cochran, Sampling Techniques,
    1977, Eq. 2.46, for each setting alone). Only drives that all groups have count. Where none are compared it is
    not known.
    """
    pairs = []
    for number, setting in enumerate(comparison.settings):
        rival, ours = best_rival(setting, number, found, column), found.get((number, chosen_label(criterion)))
        if rival is not None and ours is not None:
            pairs.append((ours, found[number, rival.label]))
    if not pairs:
        return NOT_KNOWN
    shared = pairs[0][0].replications
    for table in itertools.chain(*pairs):
        shared = np.intersect1d(shared, table.replications)
    values = np.array(
        [[table.column(column)[np.isin(table.replications, shared)] for table in beside] for beside in pairs]
    )
    means = values.mean(axis=2)
    logarithm = float(np.log(means[:, 0] / means[:, 1]).mean())
    parts = values / means[:, :, None]
    each = (parts[:, 0] - parts[:, 1]).mean(axis=0)
    error = float(each.std(ddof=1)) / math.sqrt(len(each)) if len(each) > 1 else math.inf
    low, high = Score(value=logarithm, unit="", standard_error=error, count=len(each)).interval()
    interval = f"{math.exp(low):.2f} to {math.exp(high):.2f}" if math.isfinite(high) else f"interval {NOT_KNOWN}"
    return f"{math.exp(logarithm):.2f} ({interval})"


def best_rival(setting: Setting, number: int, found: Found, column: str) -> Contender | None:
    """Return the spec's group with the least mean error, ``None`` where none was driven."""
    driven = [item for item in setting.contenders if not item.chosen and (number, item.label) in found]
    return min(driven, key=lambda item: found[number, item.label].score(column).value, default=None)


@dataclass(frozen=True, slots=True, kw_only=True)
class Agreement:
    """Rank correlations of predicted and simulated error.

    Attributes
    ----------
    overall
        Over all groups: more and larger antennas count.
    equal
        At equal antennas: each error relative to the geometric mean of its setting.
    own
        The same over the spec's groups alone. Chosen groups differ from all of these in both errors, which by
        itself makes a correlation; this one says whether the model ranks groups that it did not choose.
    """

    overall: Correlation
    equal: Correlation
    own: Correlation


def agreement(comparison: Comparison, found: Found, column: str) -> Agreement:
    """Return the rank correlations of one error; groups that two criteria chose alike count once."""
    rows: dict[tuple[int, str], tuple[float, float, bool]] = {}
    for number, _, contender in pairs(comparison.settings):
        outcomes = found.get((number, contender.label))
        if outcomes is not None:
            predicted = contender.sigma_m if column.startswith("position") else contender.sigma_rad
            simulated = outcomes.score(column).value
            if simulated > 0.0:
                rows[number, contender.layout.key] = (
                    math.log(predicted),
                    math.log(simulated),
                    contender.chosen,
                )
    settings = np.array([number for number, _ in rows], dtype=np.int64)
    values = np.array([row[:2] for row in rows.values()]).reshape(-1, 2)
    own = ~np.array([row[2] for row in rows.values()], dtype=np.bool_)
    return Agreement(
        overall=_ranked(values),
        equal=_ranked(_centred(values, settings)),
        own=_ranked(_centred(values[own], settings[own])),
    )


def _centred(values: FloatArray, settings: IntArray) -> FloatArray:
    """Return the values less the mean of their setting; a setting of one value says nothing and is left out."""
    parts = [values[settings == number] for number in np.unique(settings)]
    kept = [part - part.mean(axis=0) for part in parts if len(part) > 1]
    return np.concatenate(kept) if kept else np.empty((0, 2))


def _ranked(values: FloatArray) -> Correlation:
    # Rounded, so that what is equal but for the order of a sum ties.
    return rank_correlation(*np.round(values, 9).T)
