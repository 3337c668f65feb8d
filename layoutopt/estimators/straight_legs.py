"""Straight legs of a drive, and the crossings of read discs on them.

A leg is a way on which the robot neither turns nor, as seen from itself, travels in another direction. Its clock
counts what passes since its begin: steps, or the way of the wheels. A disc is entered half a scan before its tag
is read for the first time, and left half a scan after it was read last, on average; a tag that was in view before
the leg began says nothing of its entry.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from layoutopt.identity import FloatArray
from layoutopt.protocols import FloorKnowledge
from layoutopt.readings import Motion, Reading, TagRead

TURNING_RAD: Final = 0.002
"""A step that turns by more than this and four standard deviations ends the leg."""
_CURVED_RAD: Final = 0.05
"""So does a turn of all its steps together by more than this and three standard deviations: a curve."""
_SLOW_SHARE: Final = 0.5
"""A step that goes less than this share of the usual way, and three deviations less, belongs to no leg."""
_USUAL_GAIN: Final = 0.05
_NOWHERE_SHARE: Final = 0.1
"""A leg whose end lies no farther from its begin than this share of its way leads nowhere."""
_STRETCHES_M: Final = (0.0, 0.01, 0.1)
"""Latest stretches of a leg whose direction is compared with its own: one step, and so many metres. The longer a
stretch, the smaller the change that it shows; short ones show a large change at once, whatever the step."""
_CERTAIN: Final = 4.0
"""Standard deviations of the wheels by which a direction must differ, beside the angle of a curve."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Crossing:
    """One disc crossed on a leg: the tag, and the clock on entering and on leaving, with their deviation."""

    tag: int
    tag_m: FloatArray
    entered: float
    left: float
    sigma: float

    @property
    def most_off(self) -> float:
        """By how much scans can have missed the clock of either edge: half of one, where none failed."""
        return math.sqrt(3.0) * self.sigma


@dataclass(slots=True)
class _Way:
    """A way in the robot's frame, forward and to the left, and the variances of both."""

    forward_m: float = 0.0
    left_m: float = 0.0
    forward_m2: float = 0.0
    left_m2: float = 0.0

    @property
    def length_m(self) -> float:
        """Distance between its ends."""
        return math.hypot(self.forward_m, self.left_m)

    def add(self, motion: Motion) -> None:
        """Add a step."""
        self.forward_m += motion.forward_m
        self.left_m += motion.left_m
        self.forward_m2 += motion.sigma[0] ** 2
        self.left_m2 += motion.sigma[1] ** 2

    def leaves(self, motion: Motion, ahead: tuple[float, float], ahead_rad2: float) -> bool:
        """Return whether it leads, with one more step, aside from a direction (a unit vector) or back."""
        forward_m, left_m = self.forward_m + motion.forward_m, self.left_m + motion.left_m
        forward_m2 = self.forward_m2 + motion.sigma[0] ** 2
        left_m2 = self.left_m2 + motion.sigma[1] ** 2
        cos2, sin2 = ahead[0] ** 2, ahead[1] ** 2
        along_m = forward_m * ahead[0] + left_m * ahead[1]
        if along_m < 0.0 and along_m**2 > _CERTAIN**2 * (forward_m2 * cos2 + left_m2 * sin2):
            return True
        across_m = abs(left_m * ahead[0] - forward_m * ahead[1])
        aside_m = across_m - _CURVED_RAD * math.hypot(forward_m, left_m)
        variance_m2 = forward_m2 * sin2 + left_m2 * cos2 + along_m**2 * ahead_rad2
        return aside_m > 0.0 and aside_m**2 > _CERTAIN**2 * variance_m2


class Leg:
    """The leg on which the robot is, with what it has crossed.

    Attributes
    ----------
    clock
        What has passed since its begin.
    displacement_m, turn_rad
        What the odometry says since then, in the robot's frame at the begin.
    way_m
        Length of all its steps together.
    variance_m2, variance_rad2
        Variances of the way and of the turn by odometry.
    crossings
        Crossings so far, in the order in which they ended.
    """

    def __init__(self) -> None:
        self.clock = 0.0
        self.displacement_m = np.zeros(2)
        self.turn_rad = 0.0
        self.way_m = 0.0
        self.variance_m2 = 0.0
        self.variance_rad2 = 0.0
        self.crossings: list[Crossing] = []
        self._body = _Way()
        self._latest = [_Way() for _ in _STRETCHES_M]

    @property
    def body_rad(self) -> float:
        """Direction of the way as seen from the robot: zero if it drives ahead."""
        return math.atan2(self._body.left_m, self._body.forward_m)

    @property
    def leads_nowhere(self) -> bool:
        """Whether the steps cancel out: nothing follows from what is crossed on such a leg."""
        return math.hypot(*self.displacement_m) <= _NOWHERE_SHARE * self.way_m

    def add(self, motion: Motion, passed: float) -> None:
        """Add a step of odometry, and what passed on the clock."""
        cos, sin = math.cos(self.turn_rad), math.sin(self.turn_rad)
        self._body.add(motion)
        for number, length_m in enumerate(_STRETCHES_M):
            self._latest[number].add(motion)
            if self._latest[number].length_m >= length_m:
                self._latest[number] = _Way()
        self.displacement_m += (
            cos * motion.forward_m - sin * motion.left_m,
            sin * motion.forward_m + cos * motion.left_m,
        )
        self.turn_rad += motion.turn_rad
        self.way_m += math.hypot(motion.forward_m, motion.left_m)
        self.variance_m2 += motion.sigma[0] ** 2
        self.variance_rad2 += motion.sigma[2] ** 2
        self.clock += passed

    def bends(self, motion: Motion) -> bool:
        """Return whether one more step would make it a curve."""
        sigma_rad = math.sqrt(self.variance_rad2 + motion.sigma[2] ** 2)
        return (
            abs(motion.turn_rad) > TURNING_RAD + 4.0 * motion.sigma[2]
            or abs(self.turn_rad + motion.turn_rad) > _CURVED_RAD + 3.0 * sigma_rad
        )

    def swerves(self, motion: Motion) -> bool:
        """Return whether with one more step the robot travels in another direction than so far, or back.

        It need not turn for that: an omnidirectional robot rounds a corner with its heading kept.
        """
        body, length_m = self._body, self._body.length_m
        variance_m2 = body.forward_m2 + body.left_m2
        if length_m**2 <= _CERTAIN**2 * variance_m2:
            return False
        ahead = (body.forward_m / length_m, body.left_m / length_m)
        across_m2 = body.forward_m2 * ahead[1] ** 2 + body.left_m2 * ahead[0] ** 2
        return any(way.leaves(motion, ahead, across_m2 / length_m**2) for way in self._latest)


@dataclass(slots=True)
class _InView:
    """A tag in view: the clock half a scan before its first read (NaN if that was before the leg), and latest."""

    entered: float
    latest: float
    half_scan: float


class LegWatch:
    """Cuts a drive into legs and finds the crossings of one antenna on each, step by step.

    Parameters
    ----------
    knowledge
        Map and antennas; only the first antenna is watched.
    by_way
        Whether clocks count the way of the wheels, in metres; else they count steps.
    """

    def __init__(self, knowledge: FloorKnowledge, *, by_way: bool) -> None:
        self._knowledge = knowledge
        self._by_way = by_way
        self._period = int(knowledge.antennas.period_steps[0])
        self._phase = int(knowledge.antennas.phase_steps[0])
        self._step = -1
        self._usual_m = 0.0
        self._in_view: dict[int, _InView] = {}
        self._scanned_at = 0.0
        self.leg = Leg()

    def step(self, motion: Motion, readings: Sequence[Reading]) -> bool:
        """Take one step; return whether it began a new leg. Crossings that ended are added to the leg."""
        self._step += 1
        way_m = math.hypot(motion.forward_m, motion.left_m)
        usual_m = self._usual_m
        straight = not (self.leg.bends(motion) or self.leg.swerves(motion))
        slow = way_m < _SLOW_SHARE * usual_m - 3.0 * motion.sigma[0] or way_m == 0.0
        begins = slow or not straight
        if not begins:
            self._usual_m = way_m if usual_m == 0.0 else usual_m + _USUAL_GAIN * (way_m - usual_m)
        if begins:
            self.leg = Leg()
            self._scanned_at = 0.0
            for view in self._in_view.values():
                view.entered, view.latest = math.nan, 0.0
        else:
            self.leg.add(motion, way_m if self._by_way else 1.0)
        if self._step % self._period == self._phase:
            self._scan({read.tag for read in readings if isinstance(read, TagRead) and read.tag >= 0})
        return begins

    def _scan(self, tags: set[int]) -> None:
        """Note which tags came into view and which left it."""
        now, half_scan = self.leg.clock, 0.5 * (self.leg.clock - self._scanned_at)
        for tag in sorted(tags):
            view = self._in_view.get(tag)
            if view is None:
                entered = now - half_scan if half_scan > 0.0 else math.nan
                self._in_view[tag] = _InView(entered=entered, latest=now, half_scan=half_scan)
            else:
                view.latest = now
        for tag in [tag for tag in self._in_view if tag not in tags]:
            view = self._in_view.pop(tag)
            if not math.isnan(view.entered) and half_scan > 0.0:
                # The time of an edge is uniform over one scan.
                sigma = 2.0 * max(half_scan, view.half_scan) / math.sqrt(12.0)
                self.leg.crossings.append(
                    Crossing(
                        tag=tag,
                        tag_m=np.array(self._knowledge.tags.xy_m[tag]),
                        entered=view.entered,
                        left=0.5 * (view.latest + now),
                        sigma=sigma,
                    )
                )
        self._scanned_at = now
