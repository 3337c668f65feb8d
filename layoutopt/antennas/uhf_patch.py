"""A UHF patch antenna: no tag of the floor, but tags metres ahead of it."""

import math
from dataclasses import dataclass, field
from typing import ClassVar, Final

import numpy as np

from layoutopt.antennas.no_floor_reads import NoFloorReads
from layoutopt.identity import FloatArray, by_content
from layoutopt.protocols import AntennaCard

CARD: Final = AntennaCard(
    summary="Hears UHF tags metres ahead, the less the farther aside; reads no tag of the floor.",
    reference="3GPP TR 36.814, Table A.2.1.1-2 (pattern); liang2020, Section 4.1 (two patch antennas)",
    valid_side_m=(0.0, math.inf),
    reads="signal",
)


@by_content
@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class UhfPatch(NoFloorReads):
    """A patch antenna that looks along the x axis of its frame.

    Its gain falls with the square of the angle aside, to 3 dB less at half the beam, and to the front-to-back
    ratio at most. Angles up and down count like those aside.

    Attributes
    ----------
    side_m
        Side of its square housing.
    beam_rad
        Full width of the beam at half power.
    front_to_back_db
        How much less than straight ahead it hears at most.

    Raises
    ------
    ValueError
        If a number is not positive and finite, or the beam is wider than half a turn.
    """

    side_m: float = 0.26
    beam_rad: float = math.radians(70.0)
    front_to_back_db: float = 25.0
    key: str = field(init=False, repr=False, default="")
    card: ClassVar[AntennaCard] = CARD

    def __post_init__(self) -> None:
        """Check the numbers."""
        for name in ("side_m", "beam_rad", "front_to_back_db"):
            if not 0.0 < getattr(self, name) < math.inf:
                raise ValueError(f"{name} of an antenna must be positive and finite, got {getattr(self, name)!r}")
        if self.beam_rad > math.pi:
            raise ValueError(
                f"a patch antenna looks at half the horizon at most, got a beam of {self.beam_rad} rad"
            )

    def gain_db(self, offset_m: FloatArray) -> FloatArray:
        """Return the gain on one way against straight ahead, dB, for offsets, shape (..., 3), m.

        Examples
        --------
        >>> float(UhfPatch().gain_db(np.array([math.cos(math.radians(35.0)), math.sin(math.radians(35.0)), 0.0])))
        -3.0
        """
        offset_m = np.asarray(offset_m, dtype=np.float64)
        aside_rad = np.arctan2(np.hypot(offset_m[..., 1], offset_m[..., 2]), offset_m[..., 0])
        return np.asarray(-np.minimum(12.0 * (aside_rad / self.beam_rad) ** 2, self.front_to_back_db))
