"""Monte Carlo localisation with as many particles as its uncertainty takes, and restarts from pairs of reads."""

from dataclasses import dataclass
from typing import ClassVar, Final

from layoutopt.estimators.disc_localisation import DiscLocalisation
from layoutopt.identity import by_content
from layoutopt.protocols import EstimatorCard

CARD: Final = EstimatorCard(
    summary="Particle filter on reads and silence whose number of particles follows the spread of the cloud.",
    reference="Fox: KLD-sampling, Int. J. Robot. Res. 22(12), 2003; restarts own; filter after mi2016",
    estimates="robot",
    needs="tag_read",
    states_covariance=True,
)


@by_content
@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class AdaptiveParticles(DiscLocalisation):
    """Negative information with few particles where the robot knows its place, and many where it does not.

    A filter that is lost proposes poses from two reads at once, which fix the heading too.
    """

    particles: int = 4000
    card: ClassVar[EstimatorCard] = CARD
    row: ClassVar[str] = "mcl_adaptive"
    silence: ClassVar[bool] = True
    adaptive: ClassVar[bool] = True

    def __post_init__(self) -> None:
        """Check the settings."""
        self.check()
