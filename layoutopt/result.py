"""The answer: status, front, recommendations, and how they held on worlds not searched in."""

from collections.abc import Mapping
from dataclasses import dataclass
from enum import Enum, unique

from layoutopt.layout import Layout
from layoutopt.scores import Score, Scores
from layoutopt.shown import Shown


@unique
class Status(Enum):
    """How a search ended; the value is the sentence to print."""

    OPTIMAL = "Proven optimal."
    BOUNDED = "The best that was found; how much better another could be at most is stated beside it."
    TARGET_MET = "A layout meets every limit at the stated confidence on held-out drives."
    SEARCHED = "The search is complete; nothing more was demanded."
    STOPPED_BY_LIMIT = "Stopped by a limit on effort before every question was decided."
    TARGET_NOT_MET = "No layout of the design space was shown to meet every limit."
    BUDGET_TOO_SMALL = "Every layout that can be built costs more than the budget."
    INFEASIBLE = "No layout of the design space can be built and judged."

    @property
    def exit_code(self) -> int:
        """Exit code of the command line."""
        return {"STOPPED_BY_LIMIT": 3, "TARGET_NOT_MET": 1, "BUDGET_TOO_SMALL": 1, "INFEASIBLE": 1}.get(
            self.name, 0
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class Evaluated:
    """A layout with all its scores by name."""

    layout: Layout
    scores: Scores


@dataclass(frozen=True, slots=True, kw_only=True)
class Front(Shown):
    """Layouts that no other beats in every goal, by rising first goal."""

    goals: tuple[str, ...]
    members: tuple[Evaluated, ...]

    def __len__(self) -> int:
        """Return the number of members."""
        return len(self.members)


@dataclass(frozen=True, slots=True, kw_only=True)
class Result(Shown):
    """What a solver returns.

    ``bound`` is a proven bound on the first goal and ``gap`` the relative distance to it, both ``None`` where
    there is no proof; ``shortfall`` says in words what is missing where the status is a refusal.
    ``correct_selection`` is a lower bound of the probability that a front found by simulation is the right one,
    ``None`` where none is stated.
    """

    status: Status
    front: Front
    recommended: Mapping[str, Evaluated]
    trials: int
    bound: float | None = None
    gap: float | None = None
    shortfall: str = ""
    correct_selection: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Validation:
    """One layout with one estimator on held-out trials, or why that estimator does not apply.

    ``optimism`` is the held-out score less the search score of the same name, where both exist.
    """

    layout_key: str
    scenario: str
    estimator: str
    does_not_apply: str = ""
    scores: Scores | None = None
    optimism: Score | None = None
