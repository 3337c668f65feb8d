"""The limit that no other filter on the same readings should pass by much: very many particles."""

from dataclasses import dataclass
from typing import ClassVar, Final

from layoutopt.estimators.disc_localisation import DiscLocalisation
from layoutopt.identity import by_content
from layoutopt.protocols import EstimatorCard

CARD: Final = EstimatorCard(
    summary="Particle filter on reads and silence with 30,000 particles and a sharp edge, near Bayes-optimal.",
    reference="own; no proven bound, and a smoother would do better still",
    estimates="robot",
    needs="tag_read",
    states_covariance=True,
)


@by_content
@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class BayesLimit(DiscLocalisation):
    """What reads and silence can tell at most, for comparison; its cost is sixty times that of other filters.

    The edge is as sharp as the world's without read faults, and no spread is added to the odometry's own.
    """

    particles: int = 30_000
    edge_share: float = 0.02
    roughening_m: float = 0.0
    card: ClassVar[EstimatorCard] = CARD
    row: ClassVar[str] = "bayes_limit"
    silence: ClassVar[bool] = True

    def __post_init__(self) -> None:
        """Check the settings."""
        self.check()
