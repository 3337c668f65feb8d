"""The vehicle: its outline in ``base_link`` (REP-103: x forward, y left), drive, speed, odometry and gyro."""

import dataclasses
import math
from dataclasses import dataclass, field
from enum import Enum, unique
from typing import Final

import numpy as np
import shapely

from layoutopt.identity import FloatArray, by_content, check_not_negative, read_only

BIAS_TIME_S: Final = 5.0
"""Time after which the random walk that stands for a gyro's bias has the variance of that bias.

A Kalman filter of the heading with a fix of half a degree every second and a bias of 0.1 °/s has its least
mean square error with this choice: the lag behind the bias and the noise let in balance.
"""


@unique
class Drive(Enum):
    """How the robot can move."""

    DIFFERENTIAL = "differential"
    OMNIDIRECTIONAL = "omnidirectional"


@dataclass(frozen=True, slots=True, kw_only=True)
class Odometry:
    """Errors of dead reckoning, as random walks over the way a wheel travels and over time.

    ``translation_share`` and ``rotation_rad_per_m`` are standard deviations after 1 m; the variance grows in
    proportion to the way, whatever the step, so after 4 m the deviation is twice that. A turn on the spot
    counts with the way of a wheel at ``half_track_m`` from the centre. ``lateral_share`` is the side slip.

    ``translation_m_per_sqrt_s`` (forward and to the left alike) and ``rotation_rad_per_sqrt_s`` are standard
    deviations after 1 s; their variance grows with time, also while the robot stands, as mi2016 (Eq. 1) has it.
    Both kinds of variance add up.

    Raises
    ------
    ValueError
        If a number is negative or not finite.
    """

    translation_share: float = 0.02
    rotation_rad_per_m: float = float(np.deg2rad(1.0))
    lateral_share: float = 0.005
    half_track_m: float = 0.2
    translation_m_per_sqrt_s: float = 0.0
    rotation_rad_per_sqrt_s: float = 0.0

    def __post_init__(self) -> None:
        """Check that all numbers are finite and none is negative."""
        check_not_negative("the odometry", **dataclasses.asdict(self))

    def way_m(self, increments: FloatArray) -> FloatArray:
        """Return the way of a wheel, m, in body-frame increments (forward, left, turn), shape (n, 3)."""
        return np.asarray(
            np.hypot(increments[:, 0], increments[:, 1]) + self.half_track_m * np.abs(increments[:, 2])
        )

    def sigma(self, increments: FloatArray, step_s: float) -> FloatArray:
        """Return the standard deviations of increments (forward, left, turn) of one step each, shape (n, 3).

        Units are m, m and rad, for increments and deviations alike; ``step_s`` is how long each step takes.
        """
        root_m = np.sqrt(self.way_m(increments))
        root_s = math.sqrt(step_s)
        return np.stack(
            [
                np.hypot(self.translation_share * root_m, self.translation_m_per_sqrt_s * root_s),
                np.hypot(self.lateral_share * root_m, self.translation_m_per_sqrt_s * root_s),
                np.hypot(self.rotation_rad_per_m * root_m, self.rotation_rad_per_sqrt_s * root_s),
            ],
            axis=1,
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class Gyro:
    """Errors of a gyroscope that measures the turn about the vertical: a random walk and a constant bias.

    ``random_walk_rad_per_sqrt_s`` is the standard deviation of the angle after 1 s, which is what data sheets
    give as rate noise density in °/s/√Hz. ``bias_sigma_rad_s`` is the standard deviation of the bias from one
    switch-on to the next.

    The default is an estimate for a consumer part without temperature compensation whose mean at rest was taken
    off at switch-on: InvenSense MPU-6050 (data sheet PS-MPU-6000A-00, revision 3.4, section 6.1) has a rate
    noise density of 0.005 °/s/√Hz, and a zero-rate output that varies by ±20 °/s over 125 K, some 0.16 °/s a
    kelvin; 0.1 °/s is what less than a kelvin since then leaves. As it comes, its bias is up to ±20 °/s.

    Raises
    ------
    ValueError
        If a number is negative or not finite.
    """

    random_walk_rad_per_sqrt_s: float = float(np.deg2rad(0.005))
    bias_sigma_rad_s: float = float(np.deg2rad(0.1))

    def __post_init__(self) -> None:
        """Check that both numbers are finite and none is negative."""
        check_not_negative("the gyro", **dataclasses.asdict(self))

    def sigma(self, step_s: float) -> float:
        """Return the standard deviation, rad, that a filter of independent steps is told of one step's turn.

        Such a filter cannot hold a bias that stays: it is told a random walk instead, whose variance is that of
        the bias after `BIAS_TIME_S`. Before that time it is too cautious, after it too sure.
        """
        variance_rad2_s = self.random_walk_rad_per_sqrt_s**2 + self.bias_sigma_rad_s**2 * BIAS_TIME_S
        return math.sqrt(variance_rad2_s * step_s)


@by_content
@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Robot:
    """One type of robot.

    Attributes
    ----------
    outline_m
        Corners of the chassis in ``base_link``, shape (n, 2), m, counter-clockwise.
    speed_m_s, turn_rate_rad_s
        Cruising speed, and rate of a turn on the spot.
    gyro, gyro_fitted
        The gyroscope, and whether the turn that the robot reports is that of wheels and gyro together, each
        weighted by its inverse variance. Without it the turn is that of the wheels, and the gyro serves only the
        estimators that ask for it by name.
    """

    outline_m: FloatArray
    drive: Drive = Drive.DIFFERENTIAL
    odometry: Odometry = field(default_factory=Odometry)
    gyro: Gyro = field(default_factory=Gyro)
    gyro_fitted: bool = False
    speed_m_s: float = 0.3
    turn_rate_rad_s: float = float(np.deg2rad(45.0))
    key: str = field(init=False, repr=False, default="")

    def __post_init__(self) -> None:
        """Freeze the outline and check the speeds."""
        object.__setattr__(self, "outline_m", read_only(self.outline_m, (-1, 2)))
        if len(self.outline_m) < 3:
            raise ValueError("an outline needs at least three corners")
        if not (0.0 < self.speed_m_s < math.inf and 0.0 < self.turn_rate_rad_s < math.inf):
            raise ValueError("speed and turn rate must be positive and finite")

    @property
    def radius_m(self) -> float:
        """Radius of the circle about ``base_link`` that holds the outline: the room a turn needs."""
        return float(np.linalg.norm(self.outline_m, axis=1).max())

    @property
    def inner_radius_m(self) -> float:
        """Radius of the largest circle about ``base_link`` within the outline: the room for a ring of antennas."""
        corners = np.concatenate([self.outline_m, self.outline_m[:1]])
        return float(shapely.distance(shapely.LineString(corners), shapely.Point(0.0, 0.0)))
