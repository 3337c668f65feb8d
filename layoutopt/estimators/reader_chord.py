"""Chord from one place of a robot to a later one, with what the wheels say of the way between.

The direction of the chord on the floor comes from tags. Seen from the robot at its begin it comes from the wheels;
the difference of the two is the heading, whatever the way was: ahead, sideways, back, round a corner.
"""

import math
from typing import Final

import numpy as np

from layoutopt.geometry import wrapped
from layoutopt.identity import FloatArray
from layoutopt.readings import Motion

_ARC_RAD: Final = 0.05
"""By wheels a way is no arc if their turn differs by more than this and some deviations from that of an arc."""
_OFF_SHARE: Final = 0.5
"""A length by tags is wrong if it is off that by wheels by more than this share of the longer one, and as many."""
_CERTAIN: Final = 4.0
"""Deviations of the wheels."""


class Chord:
    """A chord in the making.

    Parameters
    ----------
    place_m, place_m2
        Where it begins, and the variance of that along an axis.
    heading_rad, heading_rad2
        Heading of the robot there, and its variance; infinite if it is unknown.

    Attributes
    ----------
    turn_rad
        What the wheels have turned since.
    """

    def __init__(self, *, place_m: FloatArray, place_m2: float, heading_rad: float, heading_rad2: float) -> None:
        self.place_m = place_m
        self.place_m2 = place_m2
        self.heading_rad = heading_rad
        self.heading_rad2 = heading_rad2
        self.turn_rad = 0.0
        self._ahead_m = 0.0
        self._aside_m = 0.0
        self._covariance = np.zeros((3, 3))

    @property
    def way_m(self) -> float:
        """Its length by the wheels."""
        return math.hypot(self._ahead_m, self._aside_m)

    @property
    def bearing_rad(self) -> float:
        """Its direction by the wheels, as seen from the robot at its begin: zero if it drove straight ahead."""
        return math.atan2(self._aside_m, self._ahead_m)

    @property
    def onward_rad(self) -> float:
        """Angle from the chord to the heading at its end; on an arc that is half the turn (han2006, Eq. 7-8)."""
        half_rad = self.turn_rad / 2.0
        if not self.is_arc():
            return float(wrapped(self.turn_rad - self.bearing_rad))
        # Driven back, or for more than a whole turn, the chord points the other way.
        return float(wrapped(half_rad if math.cos(self.bearing_rad - half_rad) > 0.0 else half_rad + math.pi))

    @property
    def onward_rad2(self) -> float:
        """Variance of `onward_rad`, by the wheels."""
        return float(self._covariance[2, 2]) / 4.0 if self.is_arc() else self._variance_rad2(bearings=1.0)

    def add(self, motion: Motion) -> None:
        """Add a step of odometry."""
        cos, sin = math.cos(self.turn_rad), math.sin(self.turn_rad)
        ahead_m = cos * motion.forward_m - sin * motion.left_m
        aside_m = sin * motion.forward_m + cos * motion.left_m
        # What the wheels were wrong in the turn so far moves the end of this step.
        moves = np.array([[1.0, 0.0, -aside_m], [0.0, 1.0, ahead_m], [0.0, 0.0, 1.0]])
        axes = np.array([[cos, -sin, 0.0], [sin, cos, 0.0], [0.0, 0.0, 1.0]]) * motion.sigma
        self._covariance = moves @ self._covariance @ moves.T + axes @ axes.T
        self._ahead_m += ahead_m
        self._aside_m += aside_m
        self.turn_rad += motion.turn_rad

    def agrees(self, length_m: float) -> bool:
        """Return whether its length by tags can be true; else a read is wrong, or the robot was carried."""
        sigma_m = math.sqrt(max(float(np.trace(self._covariance[:2, :2])), 0.0))
        return abs(length_m - self.way_m) <= _OFF_SHARE * max(length_m, self.way_m) + _CERTAIN * sigma_m

    def is_arc(self) -> bool:
        """Return whether the equations of an arc give the turn that the wheels measured."""
        off_rad = abs(float(wrapped(self.turn_rad - 2.0 * self.bearing_rad)))
        return off_rad <= _ARC_RAD + _CERTAIN * math.sqrt(self._variance_rad2(bearings=2.0))

    def _variance_rad2(self, bearings: float) -> float:
        """Return the variance of the turn less so many bearings."""
        squared_m2 = self._ahead_m**2 + self._aside_m**2
        if squared_m2 == 0.0:
            return math.inf
        slope = np.array([bearings * self._aside_m / squared_m2, -bearings * self._ahead_m / squared_m2, 1.0])
        # Rounding can leave less than nothing of a variance of zero.
        return max(float(slope @ self._covariance @ slope), 0.0)
