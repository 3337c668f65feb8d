"""The direction of arrival as it is measured: the yardstick that every correction must beat."""

from dataclasses import dataclass, field
from typing import ClassVar, Final

import numpy as np

from layoutopt.estimators.bearings import BearingKnowledge, BearingReadings, without_docking
from layoutopt.identity import FloatArray, by_content
from layoutopt.layout import Layout
from layoutopt.protocols import EstimatorCard

CARD: Final = EstimatorCard(
    summary="The latest direction of arrival, as it is measured.",
    reference="kim2009, Section II and Fig. 12",
    estimates="bearing",
    needs="direction",
)


@by_content
@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class DirectionAsMeasured:
    """Follows every direction of arrival; a robot that hears nothing keeps its heading."""

    key: str = field(init=False, repr=False, default="")
    card: ClassVar[EstimatorCard] = CARD

    def __post_init__(self) -> None:
        """Nothing to check: there are no settings."""

    @property
    def name(self) -> str:
        """Name in the estimator table."""
        return "direction_as_measured"

    def applies(self, layout: Layout) -> str:
        """Return why it cannot work with a layout, or an empty string."""
        return without_docking(layout)

    def start(self, knowledge: BearingKnowledge, drives: int) -> "LatestDirection":
        """Return the estimator at work."""
        return LatestDirection()


class LatestDirection:
    """The latest direction, at work."""

    def step(self, readings: BearingReadings) -> FloatArray:
        """Return the bearings as measured, shape (n,), rad."""
        return np.where(readings.heard, readings.bearings_rad, readings.headings_rad)
