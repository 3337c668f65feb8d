"""The vehicle: its outline in ``base_link`` (REP-103: x forward, y left), drive, speed and odometry."""

from dataclasses import dataclass, field
from enum import Enum, unique

import numpy as np
import shapely

from layoutopt.identity import FloatArray, by_content, read_only


@unique
class Drive(Enum):
    """How the robot can move."""

    DIFFERENTIAL = "differential"
    OMNIDIRECTIONAL = "omnidirectional"


@dataclass(frozen=True, slots=True, kw_only=True)
class Odometry:
    """Errors of dead reckoning, as random walks over the way a wheel travels.

    ``translation_share`` and ``rotation_rad_per_m`` are standard deviations after 1 m; the variance grows in
    proportion to the way, whatever the step, so after 4 m the deviation is twice that. A turn on the spot
    counts with the way of a wheel at ``half_track_m`` from the centre. ``lateral_share`` is the side slip.
    """

    translation_share: float = 0.02
    rotation_rad_per_m: float = float(np.deg2rad(1.0))
    lateral_share: float = 0.005
    half_track_m: float = 0.2

    def sigma(self, increments: FloatArray) -> FloatArray:
        """Return the standard deviations of body-frame increments (forward, left, turn), shape (n, 3).

        Units are m, m and rad.
        """
        way_m = np.hypot(increments[:, 0], increments[:, 1]) + self.half_track_m * np.abs(increments[:, 2])
        root = np.sqrt(way_m)
        return np.stack(
            [self.translation_share * root, self.lateral_share * root, self.rotation_rad_per_m * root], axis=1
        )


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
    """

    outline_m: FloatArray
    drive: Drive = Drive.DIFFERENTIAL
    odometry: Odometry = field(default_factory=Odometry)
    speed_m_s: float = 0.3
    turn_rate_rad_s: float = float(np.deg2rad(45.0))
    key: str = field(init=False, repr=False, default="")

    def __post_init__(self) -> None:
        """Freeze the outline and check the speeds."""
        object.__setattr__(self, "outline_m", read_only(self.outline_m, (-1, 2)))
        if len(self.outline_m) < 3:
            raise ValueError("an outline needs at least three corners")
        if not (self.speed_m_s > 0.0 and self.turn_rate_rad_s > 0.0):
            raise ValueError("speed and turn rate must be positive")

    @property
    def radius_m(self) -> float:
        """Radius of the circle about ``base_link`` that holds the outline: the room a turn needs."""
        return float(np.linalg.norm(self.outline_m, axis=1).max())

    @property
    def inner_radius_m(self) -> float:
        """Radius of the largest circle about ``base_link`` within the outline: the room for a ring of antennas."""
        corners = np.concatenate([self.outline_m, self.outline_m[:1]])
        return float(shapely.distance(shapely.LineString(corners), shapely.Point(0.0, 0.0)))
