"""Errors of localisation, as simulated: means of what the trials gave."""

from dataclasses import dataclass, field
from typing import ClassVar, Final

from layoutopt.identity import by_content
from layoutopt.protocols import ObjectiveCard
from layoutopt.scores import OUTCOME_UNITS
from objectives.outcome_means import OutcomeMeans

CARD: Final = ObjectiveCard(
    summary="Position and heading errors, lost share, time to localise and consistency over simulated trials.",
    reference="mi2016, Section 5 (mean and variance of the errors in x, y and heading); own for the others",
    scores=OUTCOME_UNITS,
    fidelity="simulated",
    per_zone=True,
)


@by_content
@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Localization(OutcomeMeans):
    """Every column of drives over the floor, averaged over replications; columns of a zone keep its prefix.

    Columns of tracking and of docking are left to their own objectives.
    """

    key: str = field(init=False, repr=False, default="")
    card: ClassVar[ObjectiveCard] = CARD

    def __post_init__(self) -> None:
        """Nothing to check: the objective has no settings."""
