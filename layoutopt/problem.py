"""The question: which layouts, in which worlds, by which objectives, within which limits."""

from dataclasses import dataclass
from typing import TYPE_CHECKING

from layoutopt.scenario import Scenario
from layoutopt.scores import Score, Scores
from layoutopt.space import DesignSpace

if TYPE_CHECKING:
    from layoutopt.protocols import Estimator, Objective


@dataclass(frozen=True, slots=True, kw_only=True)
class Limit:
    """A demand on a score: at most ``upper``, shown at a one-sided ``confidence``."""

    score: str
    upper: float
    confidence: float = 0.95

    def met(self, score: Score) -> bool:
        """Return whether the confidence bound meets the limit."""
        return score.upper(self.confidence) <= self.upper

    def broken(self, score: Score) -> bool:
        """Return whether the opposite bound already breaks the limit."""
        return score.lower(self.confidence) > self.upper


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
    """

    space: DesignSpace
    design: Scenario
    held_out: tuple[Scenario, ...]
    objectives: tuple["Objective", ...]
    goals: tuple[str, ...]
    limits: tuple[Limit, ...]
    estimators: tuple["Estimator", ...]

    def __post_init__(self) -> None:
        """Check that outcomes can be told apart by scenario and estimator."""
        scenarios = [scenario.name for scenario in (self.design, *self.held_out)]
        estimators = [estimator.name for estimator in self.estimators]
        if len(set(scenarios)) < len(scenarios) or len(set(estimators)) < len(estimators):
            raise ValueError(f"names must differ: scenarios {scenarios}, estimators {estimators}")

    def limits_on(self, scores: Scores) -> tuple[tuple[Limit, Score], ...]:
        """Return the limits with the scores that they speak of, as far as these are known."""
        return tuple((limit, scores[limit.score]) for limit in self.limits if limit.score in scores)
