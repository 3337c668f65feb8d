"""Tracking by UHF and laser with particles that keep their direction and speed, some of them put to clusters."""

from dataclasses import dataclass
from typing import ClassVar, Final

from layoutopt.estimators.uhf_laser import UhfLaser
from layoutopt.identity import by_content
from layoutopt.protocols import EstimatorCard

CARD: Final = EstimatorCard(
    summary="Particle filter on UHF and laser whose particles walk on in a direction, with three aliases.",
    reference="own; a motion model with direction and speed is the future work of liang2020",
    estimates="target",
    needs="signal",
)


@by_content
@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class UhfLaserHeading(UhfLaser):
    """`UhfLaser` with other defaults: people walk on, whether they are heard or not, and silence tells something.

    The random step on top of a walk is small, so that a filter might follow the wrong cluster for long; particles
    that are put to matching clusters prevent that. Three aliases keep phases useful at three times the speed.
    """

    motion: str = "heading"
    aliases: str = "three aliases"
    sigma_m: float = 0.1
    steps_unread: bool = True
    seeded_share: float = 0.1
    card: ClassVar[EstimatorCard] = CARD
    row: ClassVar[str] = "uhf_laser_heading"

    def __post_init__(self) -> None:
        """Check the settings."""
        UhfLaser.__post_init__(self)
