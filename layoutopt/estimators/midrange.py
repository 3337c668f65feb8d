"""The midrange estimator of han2006, for any number of antennas, with dead reckoning between reads."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import ClassVar, Final

import numpy as np

from layoutopt.estimators.likelihood import Detections, detections_in, detections_of, without_tag_readers
from layoutopt.geometry import turned, wrapped
from layoutopt.identity import FloatArray, by_content
from layoutopt.layout import Layout
from layoutopt.protocols import EstimatorCard, FloorKnowledge
from layoutopt.readings import Estimate, Motion, Observations, Prior, Reading, Trajectory

CARD: Final = EstimatorCard(
    summary="Middle of the extreme tag positions, dead reckoning between reads.",
    reference="han2006, Eq. 9-10; several antennas and the heading from them are ours",
    estimates="robot",
    needs="tag_read",
)


@by_content
@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Midrange:
    """Midrange of the positions that the reads of a step imply.

    A read says that its antenna is over the tag, so that the robot is at tag - R(heading) antenna; the answer
    is the middle of the largest and the smallest of these in x and in y. Steps without a read add odometry.

    The heading is that of the odometry until a step reads with antennas far enough apart: then the turn that
    best lays the antennas over their tags corrects it (for two antennas, the direction between the tags against
    the direction between the antennas). Both are weighted by their variances, as in a scalar Kalman filter: the
    variance of the odometry grows with each step, that of the measured turn is (r/2)² / sum of squared
    distances of the antennas from their mean, because a tag lies anywhere in a disc of radius r. A turn that no
    tags within the discs could have given is not used.

    Attributes
    ----------
    baseline_m
        Least distance of two antennas from which a heading is measured; more antennas count with the same
        spread about their mean.

    Raises
    ------
    ValueError
        If the baseline is not positive.
    """

    baseline_m: float = 0.1
    key: str = field(init=False, repr=False, default="")
    card: ClassVar[EstimatorCard] = CARD

    def __post_init__(self) -> None:
        """Check the baseline."""
        if not 0.0 < self.baseline_m < math.inf:
            raise ValueError(f"a baseline must be positive, got {self.baseline_m}")

    @property
    def name(self) -> str:
        """Name in the estimator table."""
        return "midrange"

    def applies(self, layout: Layout) -> str:
        """Return why the midrange cannot work with a layout, or an empty string."""
        return without_tag_readers(layout)

    def start(self, prior: Prior, knowledge: FloorKnowledge, draws: np.random.Generator) -> "RunningMidrange":
        """Return the estimator at work, step by step."""
        return RunningMidrange(self, prior, knowledge)

    def run(
        self, prior: Prior, knowledge: FloorKnowledge, observations: Observations, draws: np.random.Generator
    ) -> Trajectory:
        """Return the estimates of a whole drive, by the same steps but for the order of sums."""
        detections = detections_of(observations, knowledge)
        turn_rad, variance_rad2 = measured_headings(detections, self.baseline_m)
        heading = _Heading(prior)
        heading_rad = np.empty(len(observations) + 1)
        heading_rad[0] = prior.pose[2]
        for step in range(len(observations)):
            heading_rad[step + 1] = heading.step(
                float(observations.increments[step, 2]),
                float(observations.sigma[step, 2]),
                float(turn_rad[step]),
                float(variance_rad2[step]),
            )
        way_m = np.cumsum(_turned_each(observations.increments[:, :2], heading_rad[:-1]), axis=0)
        count = np.diff(detections.start)
        seen = np.flatnonzero(count > 0)
        # Where the last read was, and what the odometry said there; before the first read that is the start.
        anchor_m = np.array([prior.pose[:2]])
        anchor_way_m = np.zeros((1, 2))
        if len(seen):
            implied_m = detections.tag_m - _turned_each(detections.antenna_m, np.repeat(heading_rad[1:], count))
            first = detections.start[seen]
            middle_m = (np.maximum.reduceat(implied_m, first) + np.minimum.reduceat(implied_m, first)) / 2.0
            anchor_m = np.concatenate([anchor_m, middle_m])
            anchor_way_m = np.concatenate([anchor_way_m, way_m[seen]])
        latest = np.cumsum(count > 0)
        place_m = anchor_m[latest] + (way_m - anchor_way_m[latest])
        return Trajectory(poses=np.column_stack([place_m, wrapped(heading_rad[1:])]))


class _Heading:
    """The heading and its variance, from odometry and measured turns."""

    def __init__(self, prior: Prior) -> None:
        self.angle_rad = prior.pose[2]
        self.variance_rad2 = prior.sigma_rad**2

    def step(self, turn_rad: float, sigma_rad: float, measured_rad: float, measured_variance_rad2: float) -> float:
        """Turn by odometry, then towards the measured heading (NaN if there is none); return the heading."""
        self.angle_rad += turn_rad
        self.variance_rad2 += sigma_rad**2
        if not math.isnan(measured_rad):
            # A heading of which nothing is known takes the measured one as it is.
            unknown = math.isinf(self.variance_rad2)
            gain = 1.0 if unknown else self.variance_rad2 / (self.variance_rad2 + measured_variance_rad2)
            off_rad = (measured_rad - self.angle_rad + math.pi) % (2.0 * math.pi) - math.pi
            self.angle_rad += gain * off_rad
            self.variance_rad2 = measured_variance_rad2 if unknown else self.variance_rad2 * (1.0 - gain)
        return self.angle_rad


class RunningMidrange:
    """The midrange estimator at work."""

    def __init__(self, settings: Midrange, prior: Prior, knowledge: FloorKnowledge) -> None:
        self._settings = settings
        self._knowledge = knowledge
        self._place_m = np.array(prior.pose[:2])
        self._heading = _Heading(prior)

    def step(self, motion: Motion, readings: Sequence[Reading]) -> Estimate:
        """Dead-reckon one step; where something was read, take the middle of what it implies."""
        before_rad = self._heading.angle_rad
        self._place_m = self._place_m + turned(np.array([motion.forward_m, motion.left_m]), before_rad)
        detections = detections_in(readings, self._knowledge)
        turn_rad, variance_rad2 = measured_headings(detections, self._settings.baseline_m)
        heading_rad = self._heading.step(
            motion.turn_rad, motion.sigma[2], float(turn_rad[0]), float(variance_rad2[0])
        )
        if len(detections):
            implied_m = detections.tag_m - turned(detections.antenna_m, heading_rad)
            self._place_m = (implied_m.max(axis=0) + implied_m.min(axis=0)) / 2.0
        x_m, y_m = (float(value) for value in self._place_m)
        return Estimate(of="robot", values=(x_m, y_m, float(wrapped(heading_rad))))


def measured_headings(detections: Detections, baseline_m: float) -> tuple[FloatArray, FloatArray]:
    """Return for each step the heading that best lays the antennas over their tags, rad, and its variance.

    Both have shape (steps,) and are NaN where the antennas that read lie too close together, or where no
    heading could have brought every tag within its antenna's disc.
    """
    steps = len(detections.start) - 1
    count = np.diff(detections.start)
    step = np.repeat(np.arange(steps), count)

    def sums(values: FloatArray) -> FloatArray:
        return np.asarray(np.bincount(step, weights=values, minlength=steps), dtype=np.float64)

    share = 1.0 / np.maximum(count, 1)

    def centred(points_m: FloatArray) -> FloatArray:
        mean_m = np.stack([sums(points_m[:, 0]), sums(points_m[:, 1])], axis=1) * share[:, None]
        return np.asarray(points_m - mean_m[step])

    antenna_m, tag_m = centred(detections.antenna_m), centred(detections.tag_m)
    spread_m2 = sums((antenna_m**2).sum(axis=1))
    tag_spread_m2 = sums((tag_m**2).sum(axis=1))
    along = sums((antenna_m * tag_m).sum(axis=1))
    across = sums(antenna_m[:, 0] * tag_m[:, 1] - antenna_m[:, 1] * tag_m[:, 0])
    # By the triangle inequality the two spreads differ by no more than the tags are off their antennas.
    off_m2 = sums((detections.radius_m + 3.0 * detections.tag_sigma_m) ** 2)
    possible = np.abs(np.sqrt(tag_spread_m2) - np.sqrt(spread_m2)) <= np.sqrt(off_m2)
    # Two antennas a baseline apart have half its square as their spread.
    apart = spread_m2 >= baseline_m**2 / 2.0 * (1.0 - 1e-9)
    axis_variance_m2 = sums(detections.radius_m**2 / 4.0 + detections.tag_sigma_m**2) * share
    usable = possible & apart & (axis_variance_m2 > 0.0)
    variance_rad2 = axis_variance_m2 / np.where(usable, spread_m2, 1.0)
    return np.where(usable, np.arctan2(across, along), np.nan), np.where(usable, variance_rad2, np.nan)


def _turned_each(points_m: FloatArray, angle_rad: FloatArray) -> FloatArray:
    """Return points, shape (n, 2), each turned counter-clockwise by its own angle."""
    cos, sin = np.cos(angle_rad), np.sin(angle_rad)
    x_m, y_m = points_m[:, 0], points_m[:, 1]
    return np.stack([cos * x_m - sin * y_m, sin * x_m + cos * y_m], axis=1)
