"""What sensors say and what estimators answer, each with a type of its own.

A trial hands an estimator either a stream of typed readings, step by step, or the same in columns
(`Observations`), from which compiled estimators read.
"""

import math
from collections.abc import Iterator
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from layoutopt.identity import BoolArray, FloatArray, IntArray

UNKNOWN_TAG = -1
"""Tag index of a read whose identity is not in the tag map."""


@dataclass(frozen=True, slots=True, kw_only=True)
class TagRead:
    """An antenna saw a tag: indices into the layout's antennas (all groups in a row) and into the tag map."""

    time_s: float
    antenna: int
    tag: int


@dataclass(frozen=True, slots=True, kw_only=True)
class SignalReading:
    """Strength and phase of a UHF tag's answer at one antenna."""

    time_s: float
    antenna: int
    tag: int
    strength_dbm: float
    phase_rad: float
    frequency_hz: float


@dataclass(frozen=True, slots=True, kw_only=True)
class LaserScan:
    """Ranges of a laser scanner, m, from ``start_rad`` in steps of ``step_rad``; infinite where nothing is."""

    time_s: float
    start_rad: float
    step_rad: float
    ranges_m: FloatArray


@dataclass(frozen=True, slots=True, kw_only=True)
class SignalRatio:
    """Ratio of the signals of two crossed antennas, from which a bearing follows."""

    time_s: float
    transponder: int
    ratio: float


Reading = TagRead | SignalReading | LaserScan | SignalRatio


@dataclass(frozen=True, slots=True, kw_only=True)
class Motion:
    """One step of odometry in the robot's frame, with the standard deviations of its error.

    The turn that a gyro of its own measured stands beside it; without a gyro its deviation is infinite.
    """

    forward_m: float
    left_m: float
    turn_rad: float
    sigma: tuple[float, float, float]
    gyro_turn_rad: float = 0.0
    gyro_sigma_rad: float = math.inf


@dataclass(frozen=True, slots=True, kw_only=True)
class Prior:
    """What is known of the pose at the start: mean (x, y, heading) and standard deviations.

    Infinite deviations say that nothing is known; then the mean is the middle of the floor and says nothing.
    """

    pose: tuple[float, float, float]
    sigma_m: float
    sigma_rad: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Estimate:
    """An answer, and of what: the robot's pose, a target's position or a bearing.

    ``values`` are (x, y, heading), (x, y) or (bearing,); ``covariance`` belongs to x and y where the estimator
    has one; ``health`` is empty or says what is wrong, for example that the robot is lost.
    """

    of: Literal["robot", "target", "bearing"]
    values: tuple[float, ...]
    covariance: FloatArray | None = None
    health: str = ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Observations:
    """All that one drive gave an estimator, in columns.

    Attributes
    ----------
    step_s
        Time step.
    increments, sigma
        Odometry (forward m, left m, turn rad) of each step and its standard deviations, shape (n, 3).
    read_start
        Reads of step i are the rows ``read_start[i]`` to ``read_start[i + 1]``, shape (n + 1,).
    read_antenna, read_tag
        Antenna and tag of each read; `UNKNOWN_TAG` for an identity that the map does not hold.
    active
        Whether each antenna scanned in each step, shape (n, antennas): a silent scan tells something too.
    gyro_turn_rad, gyro_sigma_rad
        Turn of each step by the gyro alone and its standard deviation, shape (n,); left out, there is no gyro:
        no turn, with an infinite deviation.
    """

    step_s: float
    increments: FloatArray
    sigma: FloatArray
    read_start: IntArray
    read_antenna: IntArray
    read_tag: IntArray
    active: BoolArray
    gyro_turn_rad: FloatArray = field(default_factory=lambda: np.empty(0))
    gyro_sigma_rad: FloatArray = field(default_factory=lambda: np.empty(0))

    def __post_init__(self) -> None:
        """Fill in the gyro that is not there.

        Raises
        ------
        ValueError
            If only one of the gyro's columns is there, or one has not a row for each step.
        """
        steps = len(self.increments)
        if len(self.gyro_turn_rad) == len(self.gyro_sigma_rad) == 0:
            object.__setattr__(self, "gyro_turn_rad", np.zeros(steps))
            object.__setattr__(self, "gyro_sigma_rad", np.full(steps, np.inf))
        elif len(self.gyro_turn_rad) != steps or len(self.gyro_sigma_rad) != steps:
            raise ValueError(f"a gyro needs a turn and a deviation for each of {steps} steps")

    def __len__(self) -> int:
        """Return the number of steps."""
        return len(self.increments)

    def steps(self) -> Iterator[tuple[Motion, tuple[TagRead, ...]]]:
        """Yield motion and readings step by step: the same drive as a live robot would see it."""
        for step in range(len(self)):
            forward_m, left_m, turn_rad = (float(value) for value in self.increments[step])
            first, second, third = (float(value) for value in self.sigma[step])
            rows = range(int(self.read_start[step]), int(self.read_start[step + 1]))
            time_s = (step + 1) * self.step_s
            yield (
                Motion(
                    forward_m=forward_m,
                    left_m=left_m,
                    turn_rad=turn_rad,
                    sigma=(first, second, third),
                    gyro_turn_rad=float(self.gyro_turn_rad[step]),
                    gyro_sigma_rad=float(self.gyro_sigma_rad[step]),
                ),
                tuple(
                    TagRead(time_s=time_s, antenna=int(self.read_antenna[row]), tag=int(self.read_tag[row]))
                    for row in rows
                ),
            )


@dataclass(frozen=True, slots=True, kw_only=True)
class Trajectory:
    """Estimates of a whole drive.

    Attributes
    ----------
    poses
        x, y, heading after each step, shape (n, 3).
    covariance
        That of x and y, shape (n, 2, 2), or ``None`` where the estimator states none.
    lost
        Health: steps in which nothing that the estimator believes explains what was read, shape (n,), or ``None``
        where it cannot tell.
    log_evidence
        Logarithm of the mean likelihood of each step's readings under the prediction, shape (n,); its sum ranks
        settings by how well they explain a drive; of a step whose reads nothing explains, that of the best guess.
        ``None`` where the estimator has no likelihood.
    """

    poses: FloatArray
    covariance: FloatArray | None = None
    lost: BoolArray | None = None
    log_evidence: FloatArray | None = None
