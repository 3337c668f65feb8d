"""Errors of tracking, as simulated: means of what the trials gave in which a robot tracked a target."""

from dataclasses import dataclass, field
from typing import ClassVar, Final

from layoutopt.identity import by_content
from layoutopt.protocols import ObjectiveCard
from layoutopt.scores import TRACKING_UNITS
from objectives.outcome_means import OutcomeMeans

CARD: Final = ObjectiveCard(
    summary="Errors of the tracked place, share of time lost, detections and aliases over simulated trials.",
    reference="liang2020, Section 4 (mean error); own for the others",
    scores=TRACKING_UNITS,
    fidelity="simulated",
)


@by_content
@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Tracking(OutcomeMeans):
    """Every column of trials of tracking, averaged over replications; trials of other kinds have none of them."""

    key: str = field(init=False, repr=False, default="")
    card: ClassVar[ObjectiveCard] = CARD

    def __post_init__(self) -> None:
        """Nothing to check: the objective has no settings."""
