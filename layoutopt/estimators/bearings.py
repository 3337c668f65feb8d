"""What estimators of bearings are told and answer: a `BearingEstimator` tells a docking robot where to head.

Many drives run at once, step by step. Places, headings and bearings are in the floor frame; where robots are,
odometry tells without error (kim2009 names none).
"""

from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

from layoutopt.identity import BoolArray, FloatArray, IntArray
from layoutopt.layout import Layout
from layoutopt.protocols import AnyEstimator

if TYPE_CHECKING:
    from shapely.geometry.base import BaseGeometry


@dataclass(frozen=True, slots=True, kw_only=True)
class BearingReadings:
    """What one step gave to each of the drives that go on.

    Attributes
    ----------
    drives
        Their numbers, shape (n,).
    places_m, headings_rad
        Where the robots stand, shape (n, 2), m, and face, shape (n,), rad.
    moved_m
        Way since the reading before, zero at the first, shape (n,), m.
    stopped
        Whether something stopped that move, as a bumper tells, shape (n,).
    heard
        Whether any wave arrives, shape (n,).
    bearings_rad
        Directions of arrival, shape (n,), rad; zero where nothing is heard.
    strength_range_m, true_range_m
        Distances to the transponder: what the strength of all waves together tells (free space), and the true
        ones, as sonar may tell, shape (n,), m; one metre where nothing is heard.
    """

    drives: IntArray
    places_m: FloatArray
    headings_rad: FloatArray
    moved_m: FloatArray
    stopped: BoolArray
    heard: BoolArray
    bearings_rad: FloatArray
    strength_range_m: FloatArray
    true_range_m: FloatArray


@dataclass(frozen=True, slots=True, kw_only=True)
class BearingKnowledge:
    """What an estimator of bearings knows beforehand: the floor on which the transponder may be."""

    floor: "BaseGeometry"


class RunningBearingEstimator(Protocol):
    """An estimator of bearings at work on many drives."""

    def step(self, readings: BearingReadings) -> FloatArray:
        """Take one step's readings; return the bearing of the transponder for each drive, shape (n,), rad.

        A drive that has never heard anything gets the heading that it has.
        """
        ...


class BearingEstimator(AnyEstimator, Protocol):
    """Turns directions of arrival into bearings to head for; a frozen value that holds its settings."""

    def start(self, knowledge: BearingKnowledge, drives: int) -> RunningBearingEstimator:
        """Return the estimator at work on so many drives."""
        ...


def without_docking(layout: Layout) -> str:
    """Return why an estimator of bearings cannot work with a layout, or an empty string."""
    if not layout.readers_of("direction"):
        return "it needs crossed antennas, and the layout has none"
    if not layout.transponders:
        return "it needs a transponder, and the layout has none"
    return ""
