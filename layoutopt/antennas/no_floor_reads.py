"""What antennas have in common that read no tag of the floor: no disc, and a chance of zero everywhere."""

import numpy as np

from layoutopt.identity import FloatArray
from layoutopt.protocols import Surroundings


class NoFloorReads:
    """The part of `layoutopt.protocols.AntennaModel` that speaks of floor tags, for an antenna that reads none."""

    __slots__ = ()

    @property
    def extrapolated(self) -> bool:
        """Never: no read disc is derived from the side."""
        return False

    def read_probability(self, offset_m: FloatArray, surroundings: Surroundings) -> FloatArray:
        """Return zeros for offsets, shape (..., 3): no tag of the floor is read."""
        return np.zeros(np.shape(offset_m)[:-1])

    def read_radius_m(self, height_m: float) -> float:
        """Return zero: there is no disc."""
        return 0.0

    def disc_error_m(self, height_m: float) -> float:
        """Return zero: there is no disc."""
        return 0.0

    def reads_beside_disc(self, height_m: float) -> bool:
        """Return false: no tag of the floor is read anywhere."""
        return False
