"""Monte Carlo localisation with entry into and exit from the read disc as constraints."""

from dataclasses import dataclass
from typing import ClassVar, Final

from layoutopt.estimators.disc_localisation import DiscLocalisation
from layoutopt.identity import by_content
from layoutopt.protocols import EstimatorCard

CARD: Final = EstimatorCard(
    summary="Particle filter on reads and on the moments in which a tag appears or vanishes.",
    reference="own; the constraint of a crossing after kim2010, Eq. 1-6; particle filter after mi2016",
    estimates="robot",
    needs="tag_read",
    states_covariance=True,
)


@by_content
@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class CrossingConstraints(DiscLocalisation):
    """A tag that appears or vanishes lies on the edge of the disc, as exactly as the antenna moved in one scan.

    It needs no tag but those that were read.
    """

    card: ClassVar[EstimatorCard] = CARD
    row: ClassVar[str] = "mcl_crossings"
    crossings: ClassVar[bool] = True

    def __post_init__(self) -> None:
        """Check the settings."""
        self.check()
