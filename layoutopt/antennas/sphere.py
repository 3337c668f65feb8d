"""The detection sphere of mi2016, through the two antennas that the paper measured."""

import math
from dataclasses import dataclass, field
from typing import ClassVar, Final

import numpy as np

from layoutopt.antennas.mi2016_antennas import CALIBRATED_SIDE_M, LARGE, SMALL, calibrated, exponent
from layoutopt.identity import FloatArray, by_content
from layoutopt.protocols import AntennaCard, Surroundings

_REACH_EXPONENT: Final = exponent(SMALL.reach_m, LARGE.reach_m)

CARD: Final = AntennaCard(
    summary="Reads every tag inside a sphere below the antenna; radius half the side, reach by a power law.",
    reference="mi2016, Eq. 5, Sections 5.3 and 5.4 (30 mm: R 15, h_c 8 mm; 60 mm: R 30, h_c 24 mm)",
    valid_side_m=CALIBRATED_SIDE_M,
)


@by_content
@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SphereAntenna:
    """A square antenna of ``side_m`` whose read volume is the sphere of Eq. 5.

    Both measured antennas have R = side / 2; their reaches below the antenna, 23 and 54 mm, fix a power law
    with exponent log2(54/23) = 1.231. Two points are a fit and no law of physics: they belong to two products
    with different drive. Outside 25 to 80 mm the model is marked as extrapolated.

    Raises
    ------
    ValueError
        If the side is not positive.
    """

    side_m: float
    key: str = field(init=False, repr=False, default="")
    card: ClassVar[AntennaCard] = CARD

    def __post_init__(self) -> None:
        """Check the side."""
        if not (self.side_m > 0.0 and math.isfinite(self.side_m)):
            raise ValueError(f"an antenna needs a positive side, got {self.side_m}")

    @property
    def radius_m(self) -> float:
        """R of Eq. 5."""
        return self.side_m / 2.0

    @property
    def reach_m(self) -> float:
        """Greatest depth below the antenna at which a tag is read."""
        return float(SMALL.reach_m * (self.side_m / SMALL.side_m) ** _REACH_EXPONENT)

    @property
    def centre_depth_m(self) -> float:
        """h_c of Eq. 5: depth of the sphere's centre below the antenna."""
        return self.reach_m - self.radius_m

    @property
    def extrapolated(self) -> bool:
        """Whether the side lies outside the calibrated range."""
        return not calibrated(self.side_m)

    def read_probability(self, offset_m: FloatArray, surroundings: Surroundings) -> FloatArray:
        """Return 1 inside the open sphere and 0 elsewhere for offsets, shape (..., 3), in the antenna frame.

        Raises
        ------
        ValueError
            If metal lies below the floor or the tag is tilted, of which a sphere knows nothing.
        """
        if surroundings.metal_depth_m is not None or surroundings.tag_tilt_rad != 0.0:
            raise ValueError("the sphere model knows neither metal nor tilted tags")
        offset_m = np.asarray(offset_m, dtype=np.float64)
        depth_m = offset_m[..., 2] + self.centre_depth_m
        distance_squared = offset_m[..., 0] ** 2 + offset_m[..., 1] ** 2 + depth_m**2
        return np.asarray(distance_squared < self.radius_m**2, dtype=np.float64)

    def read_radius_m(self, height_m: float) -> float:
        """Return the radius of the circle in which the sphere cuts a plane ``height_m`` below the antenna.

        Examples
        --------
        >>> round(SphereAntenna(side_m=0.030).read_radius_m(0.020), 4)
        0.009
        """
        return math.sqrt(max(0.0, self.radius_m**2 - (height_m - self.centre_depth_m) ** 2))

    def disc_error_m(self, height_m: float) -> float:
        """Return zero: the model is a sphere, which cuts the floor in a disc."""
        return 0.0

    def reads_beside_disc(self, height_m: float) -> bool:
        """Return false: the model knows no reads outside the disc."""
        return False
