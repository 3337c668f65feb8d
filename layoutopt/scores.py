"""What trials gave, and the numbers made of it: outcomes per replication, scores with their uncertainty."""

import math
from collections.abc import Collection, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from layoutopt.identity import FloatArray, IntArray

AXES: Final = ("position", "x", "y", "heading")
STATISTICS: Final = ("mean", "p95", "max", "variance")
SPEED_UNITS: Final[Mapping[str, str]] = {
    "speed_limit": "m/s",
    "speed_limit_centre": "m/s",
    "missed_crossing_share": "",
}
"""Unit of every score of how fast antennas may pass tags, which depends on no zone."""

EXACT_UNITS: Final[Mapping[str, str]] = {
    "cost": "EUR",
    "published_half_gap": "m",
    "derived_half_gap": "m",
    "expected_reads_per_step": "",
    "expected_reads_per_m": "1/m",
    "expected_new_tags_per_m": "1/m",
    "static_error_worst": "m",
    "static_error_mean": "m",
    "no_detection_share": "",
    "heading_bound": "rad",
    "blind_probability_mean": "",
    "blind_probability_worst": "",
    "blind_run_p95": "m",
    "blind_run_p99": "m",
    "tail_constant": "m",
    **SPEED_UNITS,
}
"""Unit of every score that comes from a formula."""

SIGNAL_UNITS: Final[Mapping[str, str]] = {
    "area_coverage": "",
    "walk_coverage": "",
    "expected_alias_share": "",
    "direction_error_mean": "rad",
    "direction_bad_share": "",
    "scatterer_clearance": "m",
}
"""Unit of every score of UHF antennas and docking transponders that comes from a formula on a lattice."""

SAMPLED_UNITS: Final[Mapping[str, str]] = {"pose_coverage": "", "pose_coverage_two": "", "run_coverage": ""}
"""Unit of every score that comes from sampled places of the site, without any drive."""

OUTCOME_UNITS: Final[Mapping[str, str]] = {
    **{
        f"{axis}_error_{statistic}": ("rad" if axis == "heading" else "m")
        + ("²" if statistic == "variance" else "")
        for axis in AXES
        for statistic in STATISTICS
    },
    "lost_share": "",
    "time_to_localise": "s",
    "recovery_time": "s",
    "nees": "",
    "reads_per_step": "",
}
"""Unit of every column that a trial fills."""

TRACKING_UNITS: Final[Mapping[str, str]] = {
    "tracking_error_mean": "m",
    "tracking_error_p95": "m",
    "tracking_error_max": "m",
    "tracking_lost_share": "",
    "detection_share": "",
    "alias_share": "",
    "laser_match_share": "",
}
"""Unit of every column that a trial fills in which a robot tracks a target."""

DOCKING_UNITS: Final[Mapping[str, str]] = {
    "docking_success": "",
    "docking_steps": "",
    "docking_direction_error_mean": "rad",
}
"""Unit of every column that a trial fills in which a robot docks by direction."""

TRIAL_UNITS: Final[Mapping[str, str]] = {**OUTCOME_UNITS, **TRACKING_UNITS, **DOCKING_UNITS}
"""Unit of every column that a trial of any kind fills."""

SCORE_UNITS: Final[Mapping[str, str]] = {
    **EXACT_UNITS,
    **SIGNAL_UNITS,
    **SAMPLED_UNITS,
    **TRIAL_UNITS,
}
"""Unit of every score by its name; the score of one zone is written ``zone.name``."""

SHARES: Final = frozenset(
    {
        "lost_share",
        "no_detection_share",
        "blind_probability_mean",
        "blind_probability_worst",
        "missed_crossing_share",
        "area_coverage",
        "walk_coverage",
        "expected_alias_share",
        "direction_bad_share",
        "tracking_lost_share",
        "detection_share",
        "alias_share",
        "laser_match_share",
        "docking_success",
        *SAMPLED_UNITS,
    }
)
"""Scores that are means of values between 0 and 1."""

MORE_IS_BETTER: Final = frozenset(
    {
        "expected_reads_per_step",
        "expected_reads_per_m",
        "expected_new_tags_per_m",
        "reads_per_step",
        "speed_limit",
        "speed_limit_centre",
        "area_coverage",
        "walk_coverage",
        "scatterer_clearance",
        "detection_share",
        "docking_success",
        *SAMPLED_UNITS,
    }
)
"""Scores of which a limit demands at least so much; of all others it allows at most so much."""

OUTCOME_COLUMNS: Final = tuple(OUTCOME_UNITS)

NORMAL_95: Final = 1.959963984540054
"""Standard deviations from the mean to either end of the 95 % interval of a normal distribution."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Score:
    """A value with unit and uncertainty: ``standard_error`` over ``count`` replications, 0 and 0 if exact.

    ``share`` is true for the mean of values between ``least`` and 1: 0 for a share, -1 for the difference of two.
    Its bounds count what was not seen, however rare: those of a share of which no trial showed anything are the
    exact ones of a share of trials, and a trial that shows something never narrows them below these.

    Notes
    -----
    Other means have Student's bounds. For shares these promise too much: a crumb of a loss in one of 200 trials
    gives a narrow interval, although a total loss in every hundredth trial may have gone unseen. Of the mean of
    values x from 0 to 1 the upper bound is instead the quantile of the mean of x_1, ..., x_n and 1 with weights
    even on the simplex (Gaffke, Math. Methods Stat. 14, 2005; Learned-Miller and Thomas, arXiv:1905.06208, 2019),
    taken as a beta distribution of its mean and variance. For trials that give 0 or 1 that is exact, and the bound
    of Clopper and Pearson (Biometrika 26, 1934). For others no counter-example to the bound is known and no proof;
    the beta distribution is an approximation, whose coverage is tested. The bound is at least the mean that there
    would be if all was lost in the share of trials that n of them may miss.
    """

    value: float
    unit: str
    standard_error: float = 0.0
    count: int = 0
    share: bool = False
    least: float = 0.0

    @property
    def exact(self) -> bool:
        """Whether the value comes from a formula and not from trials."""
        return self.count == 0

    def interval(self, confidence: float = 0.95) -> tuple[float, float]:
        """Return the two-sided interval of the mean; unbounded for one replication of what is no share."""
        tail = 0.5 + confidence / 2.0
        return self.lower(tail), self.upper(tail)

    def upper(self, confidence: float = 0.95) -> float:
        """Return the one-sided upper confidence bound of the mean."""
        if self._bounded:
            span = 1.0 - self.least
            return self.least + span * self._share_bound((self.value - self.least) / span, confidence)
        return self.value + self._half_width(confidence)

    def lower(self, confidence: float = 0.95) -> float:
        """Return the one-sided lower confidence bound of the mean."""
        if self._bounded:
            span = 1.0 - self.least
            return 1.0 - span * self._share_bound((1.0 - self.value) / span, confidence)
        return self.value - self._half_width(confidence)

    @property
    def _bounded(self) -> bool:
        return self.share and not self.exact and not math.isnan(self.value)

    def _share_bound(self, mean: float, confidence: float) -> float:
        """Return the upper bound for a mean on the scale from 0 to 1; see the notes of the class."""
        if mean >= 1.0:
            return mean
        count, span = self.count, 1.0 - self.least
        # Squared deviations of all trials; no values from 0 to 1 have more than zeros and ones.
        squares = count * (count - 1) * (self.standard_error / span) ** 2 if count > 1 else 0.0
        squares = min(squares, count * mean * (1.0 - mean))
        middle = (count * mean + 1.0) / (count + 1.0)
        variance = (squares + count * (1.0 - mean) ** 2 / (count + 1.0)) / ((count + 1.0) * (count + 2.0))
        weight = middle * (1.0 - middle) / variance - 1.0
        # Imported here: it costs more than all the rest of a short command.
        from scipy.special import betaincinv

        never_seen = 1.0 - float((1.0 - confidence) ** (1.0 / count))
        quantile = float(betaincinv(middle * weight, (1.0 - middle) * weight, confidence))
        return max(quantile, mean + (1.0 - mean) * never_seen)

    def _half_width(self, quantile: float) -> float:
        if self.exact:
            return 0.0
        if self.count < 2 or not math.isfinite(self.standard_error):
            return math.inf
        # Imported here: it costs more than all the rest of a short command.
        from scipy.special import stdtrit

        return float(stdtrit(self.count - 1, quantile)) * self.standard_error


def wilson(hits: int, count: int) -> tuple[float, float]:
    """Return the 95 % interval of a share after ``hits`` of ``count``; (0, 1) for a count of zero.

    E. B. Wilson, J. Am. Stat. Assoc. 22 (1927) 209.

    Examples
    --------
    >>> [round(bound, 4) for bound in wilson(0, 100)]
    [0.0, 0.037]
    """
    if count == 0:
        return 0.0, 1.0
    share, square = hits / count, NORMAL_95**2
    middle = (share + square / (2 * count)) / (1.0 + square / count)
    half = (
        NORMAL_95 / (1.0 + square / count) * math.sqrt(share * (1.0 - share) / count + square / (4.0 * count**2))
    )
    # Rounding must not exclude a share of exactly none or all.
    return 0.0 if hits == 0 else middle - half, 1.0 if hits == count else middle + half


Scores = Mapping[str, Score]


_COLUMN_SETS: Final[dict[tuple[str, ...], tuple[str, ...]]] = {}
"""The few sets of column names that occur, so that a hundred thousand tables share them."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class TrialOutcomes:
    """A table of what trials gave: one row a replication, one named column a quantity.

    A column of one zone is named ``zone.column`` and is NaN for a replication that never entered the zone.
    Equality and hash go by content, to the last bit; there is no content key, because studies hold very many.

    Attributes
    ----------
    replications
        Numbers of the trials, ascending, shape (n,).
    columns
        Names, in the order of ``values``.
    values
        Shape (n, columns); units as in `SCORE_UNITS`.
    """

    replications: IntArray
    columns: tuple[str, ...]
    values: FloatArray

    def __post_init__(self) -> None:
        """Freeze the arrays and check that they fit."""
        replications = np.array(self.replications, dtype=np.int64)
        values = np.array(self.values, dtype=np.float64)
        if values.shape != (len(replications), len(self.columns)):
            raise ValueError(f"outcomes of shape {values.shape} for {len(replications)} × {len(self.columns)}")
        if (replications[1:] <= replications[:-1]).any():
            raise ValueError("replications must ascend")
        for array in (replications, values):
            array.setflags(write=False)
        object.__setattr__(self, "replications", replications)
        object.__setattr__(self, "values", values)
        object.__setattr__(self, "columns", _COLUMN_SETS.setdefault(self.columns, self.columns))

    def __eq__(self, other: object) -> bool:
        return isinstance(other, TrialOutcomes) and self._content() == other._content()

    def __hash__(self) -> int:
        return hash(self._content())

    def __reduce__(self) -> tuple[object, ...]:
        # Unpickling runs the constructor again, because numpy forgets the read-only flag.
        return (_outcomes, (self.replications, self.columns, self.values))

    def _content(self) -> tuple[object, ...]:
        return self.columns, self.values.shape, self.replications.tobytes(), self.values.tobytes()

    def __len__(self) -> int:
        """Return the number of replications."""
        return len(self.replications)

    def column(self, name: str) -> FloatArray:
        """Return one column, shape (n,).

        Raises
        ------
        KeyError
            If there is no such column.
        """
        if name not in self.columns:
            raise KeyError(name)
        return self.values[:, self.columns.index(name)]

    def head(self, count: int) -> "TrialOutcomes":
        """Return the first ``count`` replications."""
        return TrialOutcomes(
            replications=self.replications[:count], columns=self.columns, values=self.values[:count]
        )

    def score(self, name: str) -> Score:
        """Return the mean of a column over the replications that have a value, with its standard error.

        Without any value the score is NaN with an infinite standard error and a count of 1: known to be
        unknown, and never exact.
        """
        values = self.column(name)
        values = values[~np.isnan(values)]
        unit = SCORE_UNITS[name.rpartition(".")[2]]
        if len(values) == 0:
            return Score(value=math.nan, unit=unit, standard_error=math.inf, count=1)
        error = float(values.std(ddof=1)) / math.sqrt(len(values)) if len(values) > 1 else math.inf
        share = name.rpartition(".")[2] in SHARES
        return Score(value=float(values.mean()), unit=unit, standard_error=error, count=len(values), share=share)

    def scores(self, names: Collection[str]) -> Scores:
        """Return the score of each column of these names, those of zones included; none without replications."""
        if len(self) == 0:
            return {}
        return {column: self.score(column) for column in self.columns if column.rpartition(".")[2] in names}


def _outcomes(replications: IntArray, columns: tuple[str, ...], values: FloatArray) -> TrialOutcomes:
    return TrialOutcomes(replications=replications, columns=columns, values=values)


def joined(parts: Sequence[TrialOutcomes]) -> TrialOutcomes:
    """Return outcomes of the same columns as one table, ordered by replication.

    Raises
    ------
    ValueError
        If the columns differ, a replication occurs twice, or there is nothing to join.
    """
    if not parts or any(part.columns != parts[0].columns for part in parts):
        raise ValueError("outcomes to be joined need the same columns")
    replications = np.concatenate([part.replications for part in parts])
    order = np.argsort(replications, kind="stable")
    values = np.concatenate([part.values for part in parts])
    return TrialOutcomes(replications=replications[order], columns=parts[0].columns, values=values[order])


def paired_difference(first: TrialOutcomes, second: TrialOutcomes, name: str) -> Score:
    """Return the mean of ``first - second`` over the replications that both have (common random numbers).

    The difference of two shares lies between -1 and 1, and its bounds count what no replication showed.
    """
    _, left, right = np.intersect1d(first.replications, second.replications, return_indices=True)
    difference = first.column(name)[left] - second.column(name)[right]
    paired = TrialOutcomes(
        replications=np.arange(len(difference)), columns=(name,), values=difference.reshape(-1, 1)
    )
    score = paired.score(name)
    return replace(score, least=-1.0) if score.share else score
