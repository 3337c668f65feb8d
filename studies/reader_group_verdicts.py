"""Whether chosen reader groups are better in drives than those of a spec, and whether the model foresaw it."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np

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


def best_rival(setting: Setting, number: int, found: Found, column: str) -> Contender | None:
    """Return the spec's group with the least mean error, ``None`` where none was driven."""
    driven = [item for item in setting.contenders if not item.chosen and (number, item.label) in found]
    return min(driven, key=lambda item: found[number, item.label].score(column).value, default=None)


def agreement(comparison: Comparison, found: Found, column: str) -> tuple[Correlation, Correlation]:
    """Return the rank correlation of predicted and simulated error: over all groups, and at equal antennas.

    For the second each error is taken relative to the geometric mean of its setting, so that more antennas or
    larger ones count for nothing. Groups that two criteria chose alike count once.
    """
    rows: dict[tuple[int, str], tuple[float, float]] = {}
    for number, _, contender in pairs(comparison.settings):
        outcomes = found.get((number, contender.label))
        if outcomes is not None:
            predicted = contender.sigma_m if column.startswith("position") else contender.sigma_rad
            simulated = outcomes.score(column).value
            if simulated > 0.0:
                rows[number, contender.layout.key] = (math.log(predicted), math.log(simulated))
    if not rows:
        unknown = Correlation(value=math.nan, low=math.nan, high=math.nan)
        return unknown, unknown
    settings, values = np.array([number for number, _ in rows]), np.array(list(rows.values()))
    centred = values.copy()
    for number in np.unique(settings):
        centred[settings == number] -= values[settings == number].mean(axis=0)
    beside = np.isin(settings, [number for number in np.unique(settings) if (settings == number).sum() > 1])
    # Rounded, so that what is equal but for the order of a sum ties.
    within = np.round(centred[beside], 9)
    return rank_correlation(*np.round(values, 9).T), rank_correlation(*within.T)
