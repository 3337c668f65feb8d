"""An antenna that was measured: a table of its read discs at several heights, for one side or several."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import ClassVar, Final

import numpy as np

from layoutopt.identity import FloatArray, by_content
from layoutopt.protocols import AntennaCard, Surroundings
from layoutopt.units import format_length

CARD: Final = AntennaCard(
    summary="Reads every tag within the radius that was measured at that height, interpolated between heights.",
    reference="the user's own measurement; linear interpolation",
    valid_side_m=(0.0, math.inf),
)
_LARGEST_SIDES: Final = 3.0
"""The field of a loop antenna carries no farther."""


@by_content
@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class MeasuredAntenna:
    """A square antenna of ``side_m`` by a table of what was measured, with the tags and floor at hand.

    Every row of ``table_m`` is the side of an antenna, a height above the tags and the radius of the disc read
    there; one table may hold several sides. Nothing is read from above the highest or below the lowest height of
    the side, because nobody measured it; a row with a radius of zero says where reading ends. Between heights the
    radius is interpolated, between sides it is not.

    Raises
    ------
    ValueError
        If a row is no three lengths, two heights of a side are equal, the side has fewer than two heights, or a
        height or radius is three sides or more.
    """

    side_m: float
    table_m: Sequence[Sequence[float]]
    key: str = field(init=False, repr=False, default="")
    card: ClassVar[AntennaCard] = CARD

    def __post_init__(self) -> None:
        """Sort the rows, so that their order makes no other antenna, and check them."""
        if not (self.side_m > 0.0 and math.isfinite(self.side_m)):
            raise ValueError(f"an antenna needs a positive, finite side, got {self.side_m}")
        rows = sorted(tuple(float(value) for value in row) for row in self.table_m)
        object.__setattr__(self, "table_m", tuple(rows))
        for row in rows:
            if len(row) != 3 or not all(0.0 <= value < math.inf for value in row):
                raise ValueError(f"a row of the table is side, height and radius, none negative, got {row}")
            if max(row[1:]) >= _LARGEST_SIDES * row[0]:
                raise ValueError(f"height and radius must be less than {_LARGEST_SIDES:g} sides, got {row} m")
        if len({row[:2] for row in rows}) < len(rows):
            raise ValueError("the table holds two radii for one side and height")
        own = sum(row[0] == self.side_m for row in rows)
        if own < 2:
            known = ", ".join(dict.fromkeys(format_length(row[0]) for row in rows)) or "none"
            raise ValueError(
                f"the table has {own} heights for a side of {format_length(self.side_m)} and needs two or more; "
                f"sides in the table: {known}"
            )

    @property
    def extrapolated(self) -> bool:
        """Never: a measured side is not extrapolated, and other sides are refused."""
        return False

    def read_probability(self, offset_m: FloatArray, surroundings: Surroundings) -> FloatArray:
        """Return 1 inside the open measured volume and 0 elsewhere for offsets, shape (..., 3).

        Raises
        ------
        ValueError
            If metal lies below the floor or the tag is tilted: what the table was measured over is all it knows.
        """
        if surroundings.metal_depth_m is not None or surroundings.tag_tilt_rad != 0.0:
            raise ValueError("a measured antenna knows neither metal nor tilted tags beyond what was measured")
        offset_m = np.asarray(offset_m, dtype=np.float64)
        away_m = np.hypot(offset_m[..., 0], offset_m[..., 1])
        return np.asarray(away_m < self._radii_m(-offset_m[..., 2]), dtype=np.float64)

    def read_radius_m(self, height_m: float) -> float:
        """Return the measured radius, interpolated between heights; zero where nothing was measured.

        Examples
        --------
        >>> table_m = [(0.06, 0.01, 0.027), (0.06, 0.03, 0.029), (0.06, 0.05, 0.0)]
        >>> MeasuredAntenna(side_m=0.06, table_m=table_m).read_radius_m(0.02)
        0.028
        """
        return float(self._radii_m(np.array(height_m)))

    def disc_error_m(self, height_m: float) -> float:
        """Return zero: what was measured is a disc."""
        return 0.0

    def reads_beside_disc(self, height_m: float) -> bool:
        """Return false: no reads beside the disc stand in the table."""
        return False

    def _radii_m(self, height_m: FloatArray) -> FloatArray:
        rows = np.array([row[1:] for row in self.table_m if row[0] == self.side_m])
        return np.asarray(np.interp(height_m, rows[:, 0], rows[:, 1], left=0.0, right=0.0))
