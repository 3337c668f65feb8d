"""Errors of localisation, as simulated: means of what the trials gave."""

from dataclasses import dataclass, field
from typing import ClassVar, Final

from layoutopt.identity import by_content
from layoutopt.layout import Layout
from layoutopt.protocols import ObjectiveCard
from layoutopt.scenario import Scenario
from layoutopt.scores import OUTCOME_UNITS, Scores, TrialOutcomes

CARD: Final = ObjectiveCard(
    summary="Position and heading errors, lost share, time to localise and consistency over simulated trials.",
    reference="mi2016, Section 5 (mean and variance of the errors in x, y and heading); own for the others",
    scores=OUTCOME_UNITS,
    fidelity="simulated",
    per_zone=True,
)


@by_content
@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Localization:
    """Every column of drives over the floor, averaged over replications; columns of a zone keep its prefix.

    Columns of tracking and of docking are left to their own objectives.
    """

    key: str = field(init=False, repr=False, default="")
    card: ClassVar[ObjectiveCard] = CARD

    def __post_init__(self) -> None:
        """Nothing to check: the objective has no settings."""

    def __call__(self, layout: Layout, scenario: Scenario, outcomes: TrialOutcomes | None) -> Scores:
        """Return the mean of each column with its standard error; nothing without outcomes."""
        return {} if outcomes is None else outcomes.scores(OUTCOME_UNITS)
