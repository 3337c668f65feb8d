"""Two crossed loop antennas on a platform that turns, by which a robot tells the direction of a transponder."""

import math
from dataclasses import dataclass, field
from typing import ClassVar, Final

from layoutopt.antennas.no_floor_reads import NoFloorReads
from layoutopt.identity import by_content
from layoutopt.protocols import AntennaCard

CARD: Final = AntennaCard(
    summary="Tells the direction of a transponder by the ratio of two antennas; reads no tag of the floor.",
    reference="kim2009, Section II and Eq. 1-3",
    valid_side_m=(0.0, math.inf),
    reads="direction",
)


@by_content
@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class CrossedLoops(NoFloorReads):
    """Crossed antennas that turn within a circle of diameter ``side_m``.

    Raises
    ------
    ValueError
        If the size is not positive and finite.
    """

    side_m: float = 0.3
    key: str = field(init=False, repr=False, default="")
    card: ClassVar[AntennaCard] = CARD

    def __post_init__(self) -> None:
        """Check the size."""
        if not 0.0 < self.side_m < math.inf:
            raise ValueError(f"side_m of crossed antennas must be positive and finite, got {self.side_m!r}")
