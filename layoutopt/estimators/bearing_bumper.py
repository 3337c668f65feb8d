"""The bearing filter, led round what stopped the robot: a bumper's memory on top of directions of arrival.

What directions tell ends at the first obstacle: a robot that follows the true bearing stands before it for ever.
Its bumper knows more. This estimator keeps a disc of assumed size for every stop and answers with the heading next
to the filtered bearing that passes them all, on one side until it got on straight. The part that finds the
transponder is `bearing_filter`, unchanged; the part that passes obstacles is a rule of motion, which needs no
other sensor. It is made for robots that make no detours of their own (`DockingWorld.detour`).
"""

import math
from dataclasses import dataclass, field
from typing import ClassVar, Final

import numpy as np

from layoutopt.estimators.bearing_filter import BearingBelief, FilterAtWork, FilteredBearing
from layoutopt.estimators.bearings import BearingKnowledge, BearingReadings, without_docking
from layoutopt.identity import BoolArray, FloatArray, by_content
from layoutopt.layout import Layout
from layoutopt.protocols import EstimatorCard

CARD: Final = EstimatorCard(
    summary="The filtered bearing, turned as little as passes everything that stopped the robot before.",
    reference="ours",
    estimates="bearing",
    needs="direction",
)
_FAN_RAD: Final = math.radians(10.0)
"""Step of the headings that are tried to either side."""
_TOUCH_SHARE: Final = 0.999
"""Share of a disc's radius within which it bars: a robot that was stopped touches it, and may move along it."""
_BACK_RAD: Final = math.radians(120.0)
"""A robot that would have to turn farther than this has come to an end of its side and tries the other."""


@by_content
@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class BearingAroundStops:
    """Follows the filtered bearing, or the heading nearest to it that no remembered stop bars.

    What it answers is then no bearing of the transponder, so its mean error holds these turns too.

    Attributes
    ----------
    belief
        How much a direction is believed.
    thing_radius_m
        Radius of the disc that is kept for each stop, ahead of the robot, m.
    ahead_m
        How far a heading must be free of such discs, m.

    Raises
    ------
    ValueError
        If a size is not positive and finite.
    """

    belief: BearingBelief = field(default_factory=BearingBelief)
    thing_radius_m: float = 0.15
    ahead_m: float = 1.0
    key: str = field(init=False, repr=False, default="")
    card: ClassVar[EstimatorCard] = CARD

    def __post_init__(self) -> None:
        """Check the sizes."""
        for name in ("thing_radius_m", "ahead_m"):
            if not 0.0 < getattr(self, name) < math.inf:
                raise ValueError(f"{name} must be positive and finite, got {getattr(self, name)!r}")

    @property
    def name(self) -> str:
        """Name in the estimator table."""
        return "bearing_bumper"

    def applies(self, layout: Layout) -> str:
        """Return why it cannot work with a layout, or an empty string."""
        return without_docking(layout)

    def start(self, knowledge: BearingKnowledge, drives: int) -> "AroundStops":
        """Return the estimator at work on so many drives."""
        return AroundStops(self, FilteredBearing(belief=self.belief).start(knowledge, drives), drives)


class AroundStops:
    """The filter at work, the middles of what stopped each drive, and the side on which each passes it."""

    def __init__(self, settings: BearingAroundStops, found: FilterAtWork, drives: int) -> None:
        self._settings, self._filter = settings, found
        # One more column for every step with a stop; infinitely far where it is another drive's.
        self._things_m = np.zeros((drives, 0, 2))
        # Left is 1, right -1, and 0 a drive that passes nothing.
        self._side, self._straight = np.zeros(drives), np.zeros(drives, dtype=np.bool_)

    def step(self, readings: BearingReadings) -> FloatArray:
        """Note what stopped the robots and return headings that pass it, shape (n,), rad."""
        on, wanted_rad = readings.drives, self._filter.step(readings)
        self._note(readings)
        # A robot that got on straight has passed what it met; one that was stopped again has not.
        self._side[on[self._straight[on] & ~readings.stopped]] = 0.0
        turns: FloatArray = _FAN_RAD * np.arange(1.0, round(math.pi / _FAN_RAD) + 1.0)
        fan = np.concatenate([[0.0], turns, -turns])
        free = self._free(self._things_m[on] - readings.places_m[:, None], wanted_rad[:, None] + fan)
        left_rad, right_rad = (_least(rows, turns) for rows in np.split(free[:, 1:], 2, axis=1))
        side = np.where(self._side[on] != 0.0, self._side[on], np.where(left_rad <= right_rad, 1.0, -1.0))
        mine_rad, other_rad = np.where(side > 0.0, (left_rad, right_rad), (right_rad, left_rad))
        back = (mine_rad > _BACK_RAD) & (other_rad < mine_rad)
        side, turn_rad = np.where(back, -side, side), np.where(back, other_rad, mine_rad)
        straight = free[:, 0] | ~np.isfinite(turn_rad)
        self._straight[on] = straight
        self._side[on] = np.where(straight, self._side[on], side)
        return np.asarray(wanted_rad + side * np.where(straight, 0.0, turn_rad))

    def _note(self, readings: BearingReadings) -> None:
        """Keep a disc ahead of every robot that was stopped."""
        if not readings.stopped.any():
            return
        ahead = np.stack([np.cos(readings.headings_rad), np.sin(readings.headings_rad)], axis=1)
        latest = np.full((len(self._things_m), 1, 2), np.inf)
        stood = readings.drives[readings.stopped]
        latest[stood, 0] = (readings.places_m + self._settings.thing_radius_m * ahead)[readings.stopped]
        self._things_m = np.concatenate([self._things_m, latest], axis=1)

    def _free(self, things: FloatArray, headings: FloatArray) -> BoolArray:
        """Return which headings, shape (n, h), keep clear of things at offsets, shape (n, k, 2)."""
        known = np.isfinite(things[..., 0])
        off = np.where(known[..., None], things, 0.0)[:, None]
        ahead = off[..., 0] * np.cos(headings)[..., None] + off[..., 1] * np.sin(headings)[..., None]
        along = np.clip(ahead, 0.0, self._settings.ahead_m)
        nearest_m2 = (off**2).sum(axis=-1) - 2.0 * along * ahead + along**2
        radius_m = _TOUCH_SHARE * self._settings.thing_radius_m
        barred = known[:, None] & (ahead > 0.0) & (nearest_m2 < radius_m**2)
        return np.asarray(~barred.any(axis=2))


def _least(free: BoolArray, turns_rad: FloatArray) -> FloatArray:
    """Return the smallest of turns that is free, infinite where none is, shape (n,)."""
    return np.asarray(np.where(free, turns_rad, np.inf).min(axis=1))
