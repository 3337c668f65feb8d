"""What trackers of targets are told and answer: an estimator of a target is a `TargetEstimator`.

All that a robot hears and sees of one tag comes in columns; row k belongs to sampling instant (k + 1) times the
interval. Frames: the robot stands at a known pose of the floor frame; beams and antennas are in its own frame.
"""

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING, Protocol

import numpy as np

from layoutopt.estimators.sensor_model import SensorModel
from layoutopt.identity import BoolArray, FloatArray, IntArray
from layoutopt.layout import ReaderGroup
from layoutopt.protocols import AnyEstimator
from layoutopt.readings import Estimate
from layoutopt.tracking_world import LaserScanner

if TYPE_CHECKING:
    from shapely.geometry import Polygon


@dataclass(frozen=True, slots=True, kw_only=True)
class TargetSample:
    """What one sampling instant gave: a row of `TargetObservations`."""

    time_s: float
    read_time_s: FloatArray
    strength_dbm: FloatArray
    phase_word: IntArray
    frequency_hz: FloatArray
    ranges_m: FloatArray


@dataclass(frozen=True, slots=True, kw_only=True)
class TargetObservations:
    """All that a drive gave a tracker, in columns.

    Attributes
    ----------
    interval_s
        Time from one sampling instant to the next.
    read_time_s
        When each antenna read, shape (n, antennas); antennas that take turns read before the instant of their row.
    strength_dbm
        Strength of the tag's answer, NaN where an antenna heard none, shape (n, antennas).
    phase_word
        Phase in steps of a turn over 2^bits, -1 where there is none, shape (n, antennas).
    frequency_hz
        Channel on which each antenna read, shape (n, antennas).
    ranges_m
        The laser's ranges at the instant, infinite where nothing is, shape (n, beams); beams as the
        `LaserScanner` has them.
    """

    interval_s: float
    read_time_s: FloatArray
    strength_dbm: FloatArray
    phase_word: IntArray
    frequency_hz: FloatArray
    ranges_m: FloatArray

    def __len__(self) -> int:
        """Return the number of sampling instants."""
        return len(self.read_time_s)

    def samples(self) -> Iterator[TargetSample]:
        """Yield what each instant gave, as a live robot would get it."""
        for row in range(len(self)):
            yield TargetSample(
                time_s=(row + 1) * self.interval_s,
                read_time_s=self.read_time_s[row],
                strength_dbm=self.strength_dbm[row],
                phase_word=self.phase_word[row],
                frequency_hz=self.frequency_hz[row],
                ranges_m=self.ranges_m[row],
            )


@dataclass(frozen=True, slots=True, kw_only=True)
class TargetKnowledge:
    """What a tracker knows beforehand.

    Attributes
    ----------
    antennas
        The UHF antennas of the robot, in its frame.
    robot_pose
        x, y (m) and heading (rad) of the robot.
    floor
        Where a target can be.
    laser
        The robot's scanner.
    phase_bits
        Bits of a phase word.
    sensor_model
        What calibration drives taught of strengths (liang2020, Eq. 2-4).
    """

    antennas: ReaderGroup
    robot_pose: tuple[float, float, float]
    floor: "Polygon"
    laser: LaserScanner
    phase_bits: int
    sensor_model: SensorModel


@dataclass(frozen=True, slots=True, kw_only=True)
class TargetTrack:
    """Where a tracker thinks that the target was.

    Attributes
    ----------
    places_m
        In the floor frame, one a sampling instant, shape (n, 2), m.
    blind
        Health: instants that told the tracker nothing of the target, shape (n,).
    matched
        Instants at which something that the laser saw counted for the target, shape (n,). At the others signals
        alone told of it: without any match a fused track is one by strength.
    """

    places_m: FloatArray
    blind: BoolArray
    matched: BoolArray


class RunningTargetEstimator(Protocol):
    """A tracker at work."""

    def step(self, sample: TargetSample) -> Estimate:
        """Take what one instant gave; return the estimate of the target, with a health flag where it is blind."""
        ...


class TargetEstimator(AnyEstimator, Protocol):
    """Turns what a robot hears and sees into the place of a target; a frozen value that holds its settings."""

    def start(self, knowledge: TargetKnowledge, draws: np.random.Generator) -> RunningTargetEstimator:
        """Return the tracker at work, step by step: the plain twin, the truth for the compiled run."""
        ...

    def run(
        self, knowledge: TargetKnowledge, observations: TargetObservations, draws: np.random.Generator
    ) -> TargetTrack:
        """Return the track of a whole drive, as `start` and step by step would, but fast."""
        ...
