"""Docking by direction, as simulated: means of what the trials gave."""

from dataclasses import dataclass, field
from typing import ClassVar, Final

from layoutopt.identity import by_content
from layoutopt.protocols import ObjectiveCard
from layoutopt.scores import DOCKING_UNITS
from objectives.outcome_means import OutcomeMeans

CARD: Final = ObjectiveCard(
    summary="Share of simulated drives that dock, their steps, and the error of the direction that they follow.",
    reference="kim2009, Table II and Fig. 13",
    scores=DOCKING_UNITS,
    fidelity="simulated",
)


@by_content
@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Docking(OutcomeMeans):
    """Every column of docking, averaged over replications."""

    key: str = field(init=False, repr=False, default="")
    card: ClassVar[ObjectiveCard] = CARD

    def __post_init__(self) -> None:
        """Nothing to check: the objective has no settings."""
