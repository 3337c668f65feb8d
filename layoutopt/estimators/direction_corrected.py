"""The published correction of directions of arrival from three positions, at work on drives."""

from dataclasses import dataclass, field
from typing import ClassVar, Final

import numpy as np

from layoutopt.estimators.bearings import BearingKnowledge, BearingReadings, without_docking
from layoutopt.estimators.direction_of_arrival import correct_direction
from layoutopt.identity import FloatArray, by_content
from layoutopt.layout import Layout
from layoutopt.protocols import EstimatorCard

RANGE_SOURCES: Final = ("strength", "true")
CARD: Final = EstimatorCard(
    summary="The direction of arrival, corrected from the last three positions as published.",
    reference="kim2009, Eq. 12-19, Algorithm 1, with three repairs",
    estimates="bearing",
    needs="direction",
)


@by_content
@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class DirectionCorrected:
    """Corrects every direction from the two readings before it (`direction_of_arrival.correct_direction`).

    Until there are three readings in a row the direction stays as it was measured; a step without a reading begins
    the row anew, and the robot keeps its heading.

    Attributes
    ----------
    range_source
        Where ranges come from: ``"strength"`` of the signal, as published, which scattered waves change with the
        direction, or ``"true"`` ones, as good as odometry or sonar may get.

    Raises
    ------
    ValueError
        If there is no such source.
    """

    range_source: str = "strength"
    key: str = field(init=False, repr=False, default="")
    card: ClassVar[EstimatorCard] = CARD

    def __post_init__(self) -> None:
        """Check the source."""
        if self.range_source not in RANGE_SOURCES:
            raise ValueError(f"range_source is one of {', '.join(RANGE_SOURCES)}, not {self.range_source!r}")

    @property
    def name(self) -> str:
        """Name in the estimator table."""
        return "direction_corrected"

    def applies(self, layout: Layout) -> str:
        """Return why it cannot work with a layout, or an empty string."""
        return without_docking(layout)

    def start(self, knowledge: BearingKnowledge, drives: int) -> "LastThree":
        """Return the estimator at work on so many drives."""
        return LastThree(drives, by_strength=self.range_source == "strength")


class LastThree:
    """The last readings and moves of every drive, oldest first, and the correction that they give."""

    def __init__(self, drives: int, *, by_strength: bool) -> None:
        self._by_strength = by_strength
        self._directions_rad, self._ranges_m = np.zeros((drives, 3)), np.ones((drives, 3))
        self._moves_m, self._turns_rad = np.zeros((drives, 2)), np.zeros((drives, 2))
        self._headings_rad, self._in_a_row = np.zeros(drives), np.zeros(drives, dtype=np.int64)

    def step(self, readings: BearingReadings) -> FloatArray:
        """Note the readings and return corrected bearings, shape (n,), rad."""
        on, headings = readings.drives, readings.headings_rad
        # How often each was heard before; the first has no move behind it.
        first = self._in_a_row[on] == 0
        turn_rad = np.where(first, 0.0, headings - self._headings_rad[on])
        range_m = readings.strength_range_m if self._by_strength else readings.true_range_m
        for rows, latest in (
            (self._moves_m, np.where(first, 0.0, readings.moved_m)),
            (self._turns_rad, turn_rad),
            (self._directions_rad, readings.bearings_rad - headings),
            (self._ranges_m, range_m),
        ):
            rows[on] = np.column_stack([rows[on, 1:], latest])
        self._headings_rad[on] = headings
        self._in_a_row[on] = np.where(readings.heard, self._in_a_row[on] + 1, 0)
        error_rad = np.zeros(len(on))
        ready = self._in_a_row[on] >= 3
        rows_of = on[ready]
        error_rad[ready] = correct_direction(
            self._directions_rad[rows_of],
            self._ranges_m[rows_of],
            self._moves_m[rows_of],
            self._turns_rad[rows_of],
        ).error_rad
        return np.where(readings.heard, readings.bearings_rad + error_rad, headings)
