"""Two crossed loop antennas on a platform that turns, by which a robot tells the direction of a transponder."""

import math
from dataclasses import dataclass, field
from typing import ClassVar, Final

import numpy as np

from layoutopt.identity import FloatArray, by_content
from layoutopt.protocols import AntennaCard, Surroundings

CARD: Final = AntennaCard(
    summary="Tells the direction of a transponder by the ratio of two antennas; reads no tag of the floor.",
    reference="kim2009, Section II and Eq. 1-3",
    valid_side_m=(0.0, math.inf),
    reads="direction",
)


@by_content
@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class CrossedLoops:
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

    @property
    def extrapolated(self) -> bool:
        """Never: the size is stated."""
        return False

    def read_probability(self, offset_m: FloatArray, surroundings: Surroundings) -> FloatArray:
        """Return zeros: they read no HF tag."""
        return np.zeros(np.shape(offset_m)[:-1])

    def read_radius_m(self, height_m: float) -> float:
        """Return zero: they read no tag of the floor."""
        return 0.0

    def disc_error_m(self, height_m: float) -> float:
        """Return zero: there is no disc."""
        return 0.0

    def reads_beside_disc(self, height_m: float) -> bool:
        """Return false: they read no tag of the floor anywhere."""
        return False
