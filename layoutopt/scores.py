"""What trials gave, and the numbers made of it: outcomes per replication, scores with their uncertainty."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from layoutopt.identity import FloatArray, IntArray

AXES: Final = ("position", "x", "y", "heading")
STATISTICS: Final = ("mean", "p95", "max", "variance")
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
}
"""Unit of every score that comes from a formula."""

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

SCORE_UNITS: Final[Mapping[str, str]] = {**EXACT_UNITS, **SAMPLED_UNITS, **OUTCOME_UNITS}
"""Unit of every score by its name; the score of one zone is written ``zone.name``."""

SHARES: Final = frozenset(
    {"lost_share", "no_detection_share", "blind_probability_mean", "blind_probability_worst", *SAMPLED_UNITS}
)
"""Scores that are means of values between 0 and 1."""

MORE_IS_BETTER: Final = frozenset(
    {
        "expected_reads_per_step",
        "expected_reads_per_m",
        "expected_new_tags_per_m",
        "reads_per_step",
        *SAMPLED_UNITS,
    }
)
"""Scores of which a limit demands at least so much; of all others it allows at most so much."""

OUTCOME_COLUMNS: Final = tuple(OUTCOME_UNITS)


@dataclass(frozen=True, slots=True, kw_only=True)
class Score:
    """A value with unit and uncertainty: ``standard_error`` over ``count`` replications, 0 and 0 if exact.

    ``share`` is true for the mean of values between 0 and 1. Its bounds do not collapse where all trials gave 0
    or all gave 1: then they are the exact ones of a share of trials (Clopper and Pearson, Biometrika 26, 1934).
    """

    value: float
    unit: str
    standard_error: float = 0.0
    count: int = 0
    share: bool = False

    @property
    def exact(self) -> bool:
        """Whether the value comes from a formula and not from trials."""
        return self.count == 0

    def interval(self, confidence: float = 0.95) -> tuple[float, float]:
        """Return the two-sided Student interval of the mean; unbounded for a single replication."""
        half = self._half_width(0.5 + confidence / 2.0)
        return self.value - half, self.value + half

    def upper(self, confidence: float = 0.95) -> float:
        """Return the one-sided upper confidence bound of the mean."""
        return self.value + self._half_width(confidence)

    def lower(self, confidence: float = 0.95) -> float:
        """Return the one-sided lower confidence bound of the mean."""
        return self.value - self._half_width(confidence)

    def _half_width(self, quantile: float) -> float:
        if self.exact:
            return 0.0
        if self.share and self.value in (0.0, 1.0):
            return 1.0 - float((1.0 - quantile) ** (1.0 / self.count))
        if self.count < 2 or not math.isfinite(self.standard_error):
            return math.inf
        # Imported here: it costs more than all the rest of a short command.
        from scipy.special import stdtrit

        return float(stdtrit(self.count - 1, quantile)) * self.standard_error


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
    """Return the mean of ``first - second`` over the replications that both have (common random numbers)."""
    _, left, right = np.intersect1d(first.replications, second.replications, return_indices=True)
    difference = first.column(name)[left] - second.column(name)[right]
    paired = TrialOutcomes(
        replications=np.arange(len(difference)), columns=(name,), values=difference.reshape(-1, 1)
    )
    return paired.score(name)
