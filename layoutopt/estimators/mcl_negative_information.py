"""Monte Carlo localisation that also learns from silence."""

from dataclasses import dataclass
from typing import ClassVar, Final

from layoutopt.estimators.disc_localisation import DiscLocalisation
from layoutopt.identity import by_content
from layoutopt.protocols import EstimatorCard

CARD: Final = EstimatorCard(
    summary="Particle filter on reads and on what every silent antenna should have read.",
    reference="negative information after Hoffmann, Spranger, Göhring, Jüngel (IROS 2005); filter after mi2016",
    estimates="robot",
    needs="tag_read",
    states_covariance=True,
)


@by_content
@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class NegativeInformation(DiscLocalisation):
    """An antenna that scans and reads nothing tells where the robot is not: over a tag."""

    card: ClassVar[EstimatorCard] = CARD
    row: ClassVar[str] = "mcl_negative_information"
    silence: ClassVar[bool] = True

    def __post_init__(self) -> None:
        """Check the settings."""
        self.check()
