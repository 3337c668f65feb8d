"""The question: which layouts, in which worlds, by which objectives, within which limits."""

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, cast

from layoutopt.scenario import Scenario
from layoutopt.scores import Score, Scores
from layoutopt.space import DesignSpace

if TYPE_CHECKING:
    from layoutopt.protocols import Estimator, Objective


@dataclass(frozen=True, slots=True, kw_only=True)
class Limit:
    """A demand on a score: at most ``upper``, or at least ``lower``, shown at a one-sided ``confidence``.

    Raises
    ------
    ValueError
        Unless just one of the two ends is given.
    """

    score: str
    upper: float | None = None
    lower: float | None = None
    confidence: float = 0.95

    def __post_init__(self) -> None:
        """Check that there is one end."""
        if (self.upper is None) == (self.lower is None):
            raise ValueError(f"a limit on {self.score} needs either an upper or a lower end")

    @property
    def end(self) -> float:
        """The number that the score may not pass."""
        return self.upper if self.upper is not None else cast("float", self.lower)

    def bound(self, score: Score) -> float:
        """Return the confidence bound of a score on the side of the limit: what it may be at worst."""
        return score.upper(self.confidence) if self.upper is not None else score.lower(self.confidence)

    def excess(self, value: float) -> float:
        """Return by how much a value passes the limit; negative within it."""
        return value - self.upper if self.upper is not None else self.end - value

    def ratio(self, value: float) -> float:
        """Return how many times the demand a value is off: 1 at the limit, less within it.

        A limit of zero has no ratio: there it is the value itself, or infinite below a lower end of zero. A value
        that is no number misses every limit infinitely.
        """
        if math.isnan(value):
            return math.inf
        if self.upper is not None:
            return value / self.upper if self.upper > 0.0 else value
        return self.end / value if value > 0.0 else (math.inf if self.end > value else 0.0)

    def met(self, score: Score) -> bool:
        """Return whether the confidence bound meets the limit."""
        return self.excess(self.bound(score)) <= 0.0

    def broken(self, score: Score) -> bool:
        """Return whether the opposite bound already breaks the limit."""
        best = score.lower(self.confidence) if self.upper is not None else score.upper(self.confidence)
        return self.excess(best) > 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Problem:
    """What a solver is asked.

    Attributes
    ----------
    space
        The layouts.
    design, held_out
        Scenario to search in, and scenarios for validation only.
    objectives
        What makes scores, exact ones first.
    goals
        Names of the scores to minimise: cost, and one that is simulated.
    limits
        Demands that a recommended layout meets; the accuracy target is one of them.
    estimators
        Those to validate with, the search's own first.
    elsewhere
        Demands of the spec at which a search of floor tags does not look, each with the study that does, in words.
    """

    space: DesignSpace
    design: Scenario
    held_out: tuple[Scenario, ...]
    objectives: tuple["Objective", ...]
    goals: tuple[str, ...]
    limits: tuple[Limit, ...]
    estimators: tuple["Estimator", ...]
    elsewhere: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        """Check that outcomes can be told apart by scenario and estimator."""
        scenarios = [scenario.name for scenario in (self.design, *self.held_out)]
        estimators = [estimator.name for estimator in self.estimators]
        if len(set(scenarios)) < len(scenarios) or len(set(estimators)) < len(estimators):
            raise ValueError(f"names must differ: scenarios {scenarios}, estimators {estimators}")

    def limits_on(self, scores: Scores) -> tuple[tuple[Limit, Score], ...]:
        """Return the limits with the scores that they speak of, as far as these are known."""
        return tuple((limit, scores[limit.score]) for limit in self.limits if limit.score in scores)
