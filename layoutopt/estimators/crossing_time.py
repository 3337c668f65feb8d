"""Localisation by crossing times (kim2010): speed and heading of straight legs from the discs they cross."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import ClassVar, Final

import numpy as np

from layoutopt.estimators.crossing_velocity import Degenerate, StraightStart, two_tag_start, velocity
from layoutopt.estimators.likelihood import without_tag_readers
from layoutopt.estimators.step_by_step import step_by_step
from layoutopt.estimators.straight_legs import Crossing, Leg, LegWatch
from layoutopt.geometry import turned, wrapped
from layoutopt.identity import FloatArray, by_content
from layoutopt.layout import Layout
from layoutopt.protocols import EstimatorCard, FloorKnowledge
from layoutopt.readings import Estimate, Motion, Observations, Prior, Reading, Trajectory

__all__ = ["CrossingTime", "LegFit", "RunningCrossingTime", "velocity", "without_one_antenna"]

CARD: Final = EstimatorCard(
    summary="Speed and heading of each straight leg from the times at which it enters and leaves read discs.",
    reference="kim2010, Eq. 1-6 and Fig. 2-4",
    estimates="robot",
    needs="tag_read",
)
SEARCHING: Final = "the start is not known yet: two discs have to be crossed on one straight way"
MIRRORED: Final = (
    "of two mirror images of the way one is taken: a disc off the line of the first two has to be crossed to tell"
)
_OFF_LINE_SHARE: Final = 0.25
"""A tag tells mirror images apart if it lies farther from the line than this share of its disc's radius."""


@dataclass(frozen=True, slots=True, kw_only=True)
class LegFit:
    """A straight leg: where the antenna was at one moment of its clock, way for each unit of it, and direction.

    ``covariance`` is that of (x, y, speed, direction), or ``None`` where none is stated.
    """

    at_m: FloatArray
    speed: float
    direction_rad: float
    at_clock: float = 0.0
    covariance: FloatArray | None = None

    def place_m(self, clock: float) -> FloatArray:
        """Return where the antenna is when so much has passed on the clock."""
        along = np.array([math.cos(self.direction_rad), math.sin(self.direction_rad)])
        return np.asarray(self.at_m + self.speed * (clock - self.at_clock) * along)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Pose:
    """Where the robot is, and its heading."""

    place_m: FloatArray
    heading_rad: float

    def moved(self, way_m: FloatArray, turn_rad: float) -> "_Pose":
        """Return the pose after a way in the robot's frame and a turn."""
        return _Pose(
            place_m=self.place_m + turned(way_m, self.heading_rad), heading_rad=self.heading_rad + turn_rad
        )


@by_content
@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class CrossingTime:
    """Crossing-time localisation as kim2010 has it.

    The place at the begin of a leg is that at the end of the one before. Every disc that is crossed gives speed
    and, on two mirror branches, heading of the leg; of the branches that nearer to the heading of the odometry is
    taken. The place is what the latest crossing makes of the leg; until the first one it is dead reckoning.
    Crossings without an answer (`layoutopt.estimators.crossing_velocity.Degenerate`) and impossible ones, of which
    the chord is longer than half a scan on either side explains, are left out; those that are badly conditioned
    are used, as in the paper.

    From a start whose place or heading is unknown, one leg has to cross two discs. The mirror image of the way
    about the line through both tags fits as well. A tag off that line tells, on this leg or on a later one; until
    then later legs are dead reckoning.

    The antenna may sit anywhere on the robot. Curves are dead reckoning.
    """

    key: str = field(init=False, repr=False, default="")
    card: ClassVar[EstimatorCard] = CARD

    def __post_init__(self) -> None:
        """Nothing to check: the estimator has no settings."""

    @property
    def name(self) -> str:
        """Name in the estimator table."""
        return "crossing_time"

    def applies(self, layout: Layout) -> str:
        """Return why crossing times cannot localise a layout's robot, or an empty string."""
        return without_one_antenna(layout)

    def start(self, prior: Prior, knowledge: FloorKnowledge, draws: np.random.Generator) -> "RunningCrossingTime":
        """Return the estimator at work, step by step."""
        return RunningCrossingTime(prior, knowledge)

    def run(
        self, prior: Prior, knowledge: FloorKnowledge, observations: Observations, draws: np.random.Generator
    ) -> Trajectory:
        """Return the estimates of a whole drive, step by step."""
        return step_by_step(self.start(prior, knowledge, draws), observations)


def without_one_antenna(layout: Layout) -> str:
    """Return why an estimator of one reader's tags cannot work with a layout, or an empty string."""
    count = sum(len(group.poses) for group in layout.readers if group.kind == "tag_read")
    if count > 1:
        return f"it works with one antenna, and the layout has {count}"
    return without_tag_readers(layout)


class RunningCrossingTime:
    """Crossing-time localisation at work; `fitted` is what the improved form does otherwise."""

    def __init__(self, prior: Prior, knowledge: FloorKnowledge, *, by_way: bool = False) -> None:
        self._watch = LegWatch(knowledge, by_way=by_way)
        self._lever_m = np.array(knowledge.antennas.xy_m[0])
        self.radius_m = float(knowledge.antennas.radius_m[0])
        self._place_m = np.array(prior.pose[:2])
        self._heading_rad = prior.pose[2]
        self.fit: LegFit | None = None
        self._known = math.isfinite(prior.sigma_m) and math.isfinite(prior.sigma_rad)
        self._health = "" if self._known else SEARCHING
        self._candidates: tuple[StraightStart, ...] = ()
        self._line_m = np.zeros((2, 2))
        self._image: _Pose | None = None

    def step(self, motion: Motion, readings: Sequence[Reading]) -> Estimate:
        """Take one step, look for crossings that it ended, and follow the leg."""
        before = self._watch.leg
        counted = len(before.crossings)
        if self._watch.step(motion, readings):
            self.end(before, motion)
            way_m = np.array([motion.forward_m, motion.left_m])
            self._place_m = self._place_m + turned(way_m, self._heading_rad)
            self._heading_rad += motion.turn_rad
            if self._image is not None:
                self._image = self._image.moved(way_m, motion.turn_rad)
            counted = 0
        leg = self._watch.leg
        for number in range(counted, 0 if leg.leads_nowhere else len(leg.crossings)):
            if not self._known:
                self._search(leg, number)
            elif (fit := self.fitted(leg, number)) is not None:
                self.fit = fit
        place_m, heading_rad = self._now(leg)
        x_m, y_m = (float(value) for value in place_m)
        return Estimate(of="robot", values=(x_m, y_m, float(wrapped(heading_rad))), health=self._health)

    def begun_at_m(self) -> FloatArray:
        """Return where the antenna was when the leg began."""
        return np.asarray(self._place_m + turned(self._lever_m, self._heading_rad))

    def reference_rad(self, leg: Leg) -> float:
        """Return the direction of the leg as odometry has it."""
        return self._heading_rad + leg.body_rad

    def fitted(self, leg: Leg, number: int) -> LegFit | None:
        """Return the leg as a new crossing has it; ``None`` if the crossing has no answer."""
        crossing = leg.crossings[number]
        start_m = self.begun_at_m()
        to_tag_m = crossing.tag_m - start_m
        found = velocity(
            math.hypot(*to_tag_m),
            self.radius_m,
            crossing.entered,
            crossing.left - crossing.entered,
            timing_s=crossing.most_off,
        )
        if not found.headings_rad or Degenerate.IMPOSSIBLE in found.degenerate:
            return None
        line_rad, reference_rad = math.atan2(to_tag_m[1], to_tag_m[0]), self.reference_rad(leg)
        direction_rad = min(
            (line_rad + heading for heading in found.headings_rad),
            key=lambda angle: abs(float(wrapped(angle - reference_rad))),
        )
        return LegFit(at_m=start_m, speed=found.speed_m_s, direction_rad=direction_rad)

    def started(self, leg: Leg, fit: LegFit) -> LegFit:
        """Return the first leg from an unknown start, as it is to be used."""
        return fit

    def _search(self, leg: Leg, number: int) -> None:
        """Find the first leg from an unknown start, or tell its mirror images apart."""
        crossings = leg.crossings[: number + 1]
        if self._image is None:
            self._search_leg(leg, crossings)
            self._known = self.fit is not None and any(self._tells(crossing) for crossing in crossings)
        elif self._tells(crossings[-1]):
            self._choose(leg, crossings[-1], self._image)
            self._known = True
            self.fit = self.fitted(leg, number)
        if self._known:
            self._health = ""

    def _search_leg(self, leg: Leg, crossings: Sequence[Crossing]) -> None:
        """Find the first leg from an unknown start: the best of the ways that two of its crossings allow."""
        if not self._candidates:
            pair = _first_pair(crossings)
            if pair is None:
                return
            self._line_m = np.array([crossing.tag_m for crossing in pair])
            self._candidates = two_tag_start(
                self._line_m, self.radius_m, (pair[0].entered, pair[1].entered), (pair[0].left, pair[1].left)
            )
        fits = [_leg_of(start) for start in self._candidates]
        if not fits:
            return
        usual = float(np.hypot(*leg.displacement_m)) / leg.clock
        misses = [
            (self._miss(fit, crossings), abs(math.log(max(fit.speed, 1e-9) / max(usual, 1e-9)))) for fit in fits
        ]
        # Speeds differ between roots, not between mirror images; crossings of further tags tell those apart. Until
        # then rounding must not make the answer jump from one image to the other.
        best = min(
            range(len(fits)),
            key=lambda index: (round(misses[index][1], 1), round(misses[index][0], 9), misses[index][1]),
        )
        self.fit = self.started(leg, fits[best])
        # The heading is that in which the odometry's way points along the leg.
        self._heading_rad = self.fit.direction_rad - leg.body_rad
        self._place_m = self.fit.place_m(0.0) - turned(self._lever_m, self._heading_rad)
        self._health = MIRRORED

    def _choose(self, leg: Leg, crossing: Crossing, image: "_Pose") -> None:
        """Take that of two mirror images, both of them dead reckoning, that a crossing fits better."""
        poses = [_Pose(place_m=self._place_m, heading_rad=self._heading_rad), image]
        speed = math.hypot(*leg.displacement_m) / leg.clock
        legs = [
            LegFit(
                at_m=pose.place_m + turned(self._lever_m, pose.heading_rad),
                speed=speed,
                direction_rad=pose.heading_rad + leg.body_rad,
            )
            for pose in poses
        ]
        best = poses[0 if self._miss(legs[0], (crossing,)) <= self._miss(legs[1], (crossing,)) else 1]
        self._place_m, self._heading_rad = best.place_m, best.heading_rad
        self._image = None

    def _tells(self, crossing: Crossing) -> bool:
        """Return whether a tag lies so far from the line through the first two that mirror images differ there."""
        along_m, to_tag_m = self._line_m[1] - self._line_m[0], crossing.tag_m - self._line_m[0]
        area_m2 = abs(float(along_m[0] * to_tag_m[1] - along_m[1] * to_tag_m[0]))
        return area_m2 > _OFF_LINE_SHARE * self.radius_m * math.hypot(*along_m)

    def _miss(self, fit: LegFit, crossings: Sequence[Crossing]) -> float:
        """Return by how much a leg is off the edges of the discs, squared and summed."""
        return float(
            sum(
                (math.dist(fit.place_m(clock), crossing.tag_m) - self.radius_m) ** 2
                for crossing in crossings
                for clock in (crossing.entered, crossing.left)
            )
        )

    def end(self, leg: Leg, motion: Motion) -> None:
        """Move to the end of a leg; ``motion`` is the step after it, which belongs to none."""
        if self._image is not None:
            self._image = self._image.moved(leg.displacement_m, leg.turn_rad)
        elif self.fit is not None and not self._known:
            self._image = self._mirrored(leg, self.fit)
        self._place_m, self._heading_rad = self._now(leg)
        self.fit = None
        self._candidates = ()

    def _mirrored(self, leg: Leg, fit: LegFit) -> "_Pose":
        """Return the pose at the end of the mirror image of a leg about the line through the first two tags."""
        along_m = self._line_m[1] - self._line_m[0]
        line_rad = math.atan2(along_m[1], along_m[0])
        to_end_m = turned(fit.place_m(leg.clock) - self._line_m[0], -line_rad)
        heading_rad = 2.0 * line_rad - fit.direction_rad - leg.body_rad
        antenna_m = self._line_m[0] + turned(to_end_m * (1.0, -1.0), line_rad)
        return _Pose(place_m=antenna_m - turned(self._lever_m, heading_rad), heading_rad=heading_rad)

    def _now(self, leg: Leg) -> tuple[FloatArray, float]:
        """Return place and heading of the robot when so much of a leg is done."""
        heading_rad = self._heading_rad + leg.turn_rad
        if self.fit is None:
            return self._place_m + turned(leg.displacement_m, self._heading_rad), heading_rad
        # The leg is straight: what wheels say of a turn on it is noise.
        heading_rad = self.fit.direction_rad - leg.body_rad
        return self.fit.place_m(leg.clock) - turned(self._lever_m, heading_rad), heading_rad


def _leg_of(start: StraightStart) -> LegFit:
    return LegFit(
        at_m=np.array(start.place_m),
        speed=start.speed_m_s,
        direction_rad=start.direction_rad,
        at_clock=start.time_s,
    )


def _first_pair(crossings: Sequence[Crossing]) -> tuple[Crossing, Crossing] | None:
    """Return the first crossing and the last one of another tag, in the order of their middles."""
    first, last = crossings[0], crossings[-1]
    if not (first.tag_m != last.tag_m).any() or first.entered + first.left == last.entered + last.left:
        return None
    return (first, last) if first.entered + first.left < last.entered + last.left else (last, first)
