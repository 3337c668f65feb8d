"""An antenna of which only its read disc on the floor is known, measured with the tags at hand."""

import math
from dataclasses import dataclass, field
from typing import ClassVar, Final

import numpy as np

from layoutopt.identity import FloatArray, by_content
from layoutopt.protocols import AntennaCard, Surroundings

CARD: Final = AntennaCard(
    summary="Reads every tag within a measured radius, at any height up to a measured reach.",
    reference="kim2010, Section 5 (sensing radius found by experiment); han2006, Fig. 2 and 6 (circular area)",
    valid_side_m=(0.0, math.inf),
)


@by_content
@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class DiscAntenna:
    """A square antenna of ``side_m`` that reads what lies less than ``radius_m`` off its axis, ``reach_m`` deep.

    The radius is what a test on the floor gave, so the side says only what room the antenna takes and what it
    costs: no side is extrapolated. Without a reach it is one side of the antenna.

    Raises
    ------
    ValueError
        If a length is not positive and finite, or radius or reach is three sides or more, farther than the field
        of a loop antenna carries.
    """

    side_m: float
    radius_m: float
    reach_m: float | None = None
    key: str = field(init=False, repr=False, default="")
    card: ClassVar[AntennaCard] = CARD

    def __post_init__(self) -> None:
        """Check the lengths."""
        lengths = {"side": self.side_m, "radius": self.radius_m, "reach": self.depth_m}
        for name, length_m in lengths.items():
            if not (length_m > 0.0 and math.isfinite(length_m)):
                raise ValueError(f"an antenna needs a positive, finite {name}, got {length_m}")
            if length_m >= 3.0 * self.side_m:
                raise ValueError(
                    f"the {name} of an antenna must be less than three sides, got {length_m} m for a side of "
                    f"{self.side_m} m"
                )

    @property
    def depth_m(self) -> float:
        """Greatest depth below the antenna at which a tag is read."""
        return self.side_m if self.reach_m is None else self.reach_m

    @property
    def extrapolated(self) -> bool:
        """Never: a measured disc holds for its own antenna."""
        return False

    def read_probability(self, offset_m: FloatArray, surroundings: Surroundings) -> FloatArray:
        """Return 1 inside the open cylinder below the antenna and 0 elsewhere for offsets, shape (..., 3).

        Raises
        ------
        ValueError
            If metal lies below the floor or the tag is tilted, for which the disc was not measured.
        """
        if surroundings.metal_depth_m is not None or surroundings.tag_tilt_rad != 0.0:
            raise ValueError("a measured disc knows neither metal nor tilted tags")
        offset_m = np.asarray(offset_m, dtype=np.float64)
        beside = offset_m[..., 0] ** 2 + offset_m[..., 1] ** 2 < self.radius_m**2
        depth_m = -offset_m[..., 2]
        return np.asarray(beside & (depth_m >= 0.0) & (depth_m <= self.depth_m), dtype=np.float64)

    def read_radius_m(self, height_m: float) -> float:
        """Return the measured radius, or zero for a plane out of reach.

        Examples
        --------
        >>> DiscAntenna(side_m=0.15, radius_m=0.1).read_radius_m(0.015)
        0.1
        """
        return self.radius_m if 0.0 <= height_m <= self.depth_m else 0.0

    def disc_error_m(self, height_m: float) -> float:
        """Return zero: what was measured is a disc."""
        return 0.0

    def reads_beside_disc(self, height_m: float) -> bool:
        """Return false: the model knows no reads outside the disc."""
        return False
