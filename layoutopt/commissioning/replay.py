"""Replay of a logged drive: resampled to the time step of the layout, and estimated as a simulated one is."""

import dataclasses
import math
from dataclasses import dataclass
from typing import Final

import numpy as np

from layoutopt import registry
from layoutopt.commissioning.drive_log import DriveLog
from layoutopt.commissioning.resampling import Resampled, resampled
from layoutopt.detection import antennas_of
from layoutopt.errors import InvalidInput
from layoutopt.geometry import wrapped
from layoutopt.identity import BoolArray, FloatArray, IntArray
from layoutopt.layout import Layout
from layoutopt.protocols import Estimator, FloorKnowledge
from layoutopt.readings import UNKNOWN_TAG, Prior, Trajectory
from layoutopt.spec.building import Spec
from layoutopt.streams import Purpose, Streams
from layoutopt.units import Dimension, parse_quantity

SCENARIO: Final = "replay"
"""Name under which a replay draws its random numbers."""
_ODOMETRY: Final = "odometry"
_ENOUGH_TRUTH: Final = 0.1


@dataclass(frozen=True, slots=True, kw_only=True)
class Replay:
    """A logged drive as an estimator sees it: what it knew, what it was told and what it answered.

    ``reference`` is the path against which reads are fitted: the truth where there is one, else the estimated
    path; NaN where it is not known, and where the estimator says that it is lost.
    """

    log: DriveLog
    spec: Spec
    layout: Layout
    knowledge: FloorKnowledge
    prior: Prior
    drive: Resampled
    estimator: Estimator
    trajectory: Trajectory
    seed: int
    notes: tuple[str, ...]

    @property
    def with_truth(self) -> bool:
        """Whether the true pose is known in enough steps to fit against it: a tenth of them."""
        return bool(np.isfinite(self.drive.truth[:, 0]).mean() >= _ENOUGH_TRUTH)

    @property
    def reference(self) -> FloatArray:
        """Pose at the end of each step, shape (n, 3)."""
        if self.with_truth:
            return self.drive.truth
        poses = self.trajectory.poses.copy()
        poses[self.lost] = np.nan
        return poses

    @property
    def position_error_m(self) -> FloatArray:
        """Distance of estimate and truth after each step, NaN where the truth is not known, shape (n,)."""
        off_m = self.trajectory.poses[:, :2] - self.drive.truth[:, :2]
        return np.asarray(np.hypot(off_m[:, 0], off_m[:, 1]))

    @property
    def heading_error_rad(self) -> FloatArray:
        """Absolute difference of the headings after each step, NaN where the truth is not known, shape (n,)."""
        return np.abs(wrapped(self.trajectory.poses[:, 2] - self.drive.truth[:, 2]))

    @property
    def read_tags(self) -> IntArray:
        """Index in the tag map of each read of a tag that is in it, shape (r,)."""
        tags = self.drive.observations.read_tag
        return np.asarray(tags[tags != UNKNOWN_TAG])

    @property
    def lost(self) -> BoolArray:
        """Whether the estimator says that it is lost, shape (n,); nowhere if it cannot tell."""
        told = self.trajectory.lost
        return np.zeros(len(self.trajectory.poses), dtype=np.bool_) if told is None else told

    @property
    def stated_sigma_m(self) -> FloatArray | None:
        """Deviation of the position that the estimator states, along its worst axis, shape (n,), m."""
        covariance = self.trajectory.covariance
        return None if covariance is None else np.sqrt(np.linalg.eigvalsh(covariance)[:, -1].clip(0.0))


def replay_log(
    log: DriveLog,
    spec: Spec,
    layout: Layout,
    estimator: Estimator,
    *,
    seed: int,
    start: tuple[float, float, float] | None = None,
) -> Replay:
    """Return what an estimator makes of a logged drive.

    The start is the truth of the first row of odometry where there is one, else ``start`` (x m, y m, heading rad),
    each with the deviations of the spec; with neither the estimator is told that nothing is known.

    Raises
    ------
    InvalidInput
        If the estimator cannot work with the layout or without a start, or the drive has too many steps.
    """
    reason = estimator.applies(layout)
    if reason:
        repair = "Choose another estimator, or a layout that it can work with."
        raise InvalidInput.at(f"estimator '{estimator.name}'", f"does not apply, because {reason}", repair)
    knowledge = FloorKnowledge(
        tags=layout.floor_tags.lay_on(spec.site), antennas=antennas_of(layout, spec.study.step_s)
    )
    drive = resampled(log, spec, knowledge.antennas)
    prior, note = _prior(log, spec, start)
    if math.isinf(prior.sigma_m) and estimator.card.needs == _ODOMETRY:
        raise InvalidInput.at(
            log.file,
            f"estimator '{estimator.name}' needs a start, and the log has no truth in its first row",
            "Name the start with --start 'X,Y,HEADING', or take an estimator that reads tags.",
        )
    draws = Streams(seed=seed).generator(SCENARIO, 0, Purpose.FILTER)
    trajectory = estimator.run(prior, knowledge, drive.observations, draws)
    unknown = np.asarray(~np.isfinite(trajectory.poses).all(axis=1))
    if unknown.any():
        raise InvalidInput.at(
            log.file,
            f"estimator '{estimator.name}' gives no pose in {int(unknown.sum())} of {len(unknown)} steps",
            "Name the start with --start 'X,Y,HEADING', or take another estimator.",
        )
    return Replay(
        log=log,
        spec=spec,
        layout=layout,
        knowledge=knowledge,
        prior=prior,
        drive=drive,
        estimator=estimator,
        trajectory=trajectory,
        seed=seed,
        notes=(*log.notes, *drive.notes, note),
    )


def estimator_of(name: str, spec: Spec) -> Estimator:
    """Return an estimator of the table with the spec's number of particles.

    Raises
    ------
    UnknownName
        If the table has no such name.
    """
    made = registry.load("estimators", name, place="--estimator")
    particles = spec.study.particles
    takes = particles is not None and "particles" in {field.name for field in dataclasses.fields(made)}
    estimator: Estimator = made(particles=particles) if takes else made()
    return estimator


def pose_in(text: str) -> tuple[float, float, float]:
    """Return the pose in a text such as ``"1.2 m, 3 m, 90 deg"``; bare numbers are m and rad.

    Raises
    ------
    InvalidInput
        If it is no pose.

    Examples
    --------
    >>> pose_in("1.2, 300 mm, 0 deg")
    (1.2, 0.3, 0.0)
    """
    parts = [part.strip() for part in text.split(",")]
    dimensions: tuple[Dimension, ...] = ("length", "length", "angle")
    try:
        x_m, y_m, heading_rad = (
            parse_quantity(_number(part), dimension) for part, dimension in zip(parts, dimensions, strict=True)
        )
    except ValueError as error:
        problem = str(error).partition("; use ")[0] if len(parts) == len(dimensions) else "a pose has three parts"
        raise InvalidInput.at(
            f"--start {text!r}", problem, "Write 'X, Y, HEADING', such as '1.2 m, 3 m, 90 deg'."
        ) from None
    return x_m, y_m, heading_rad


def _number(text: str) -> str | float:
    """Return a bare number as one, since only texts need a unit."""
    try:
        return float(text)
    except ValueError:
        return text


def _prior(log: DriveLog, spec: Spec, start: tuple[float, float, float] | None) -> tuple[Prior, str]:
    """Return what is known of the start, and a sentence that says it."""
    sigma_m, sigma_rad = spec.study.start_sigma_m, spec.study.start_sigma_rad
    pose, source = start, "as given"
    if start is None and len(log.truth) and abs(log.truth_time_s[0] - log.time_s[0]) < 1e-9:
        true_x_m, true_y_m, true_heading_rad = (float(value) for value in log.truth[0])
        pose, source = (true_x_m, true_y_m, true_heading_rad), "the truth of the first row"
    if pose is not None:
        x_m, y_m, heading_rad = pose
        return (
            Prior(
                pose=(x_m, y_m, math.remainder(heading_rad, 2.0 * math.pi)), sigma_m=sigma_m, sigma_rad=sigma_rad
            ),
            f"start: {source}, with deviations of {sigma_m * 1000.0:g} mm and {math.degrees(sigma_rad):.3g} deg",
        )
    xmin, ymin, xmax, ymax = spec.site.bounds_m
    return (
        Prior(pose=((xmin + xmax) / 2.0, (ymin + ymax) / 2.0, 0.0), sigma_m=math.inf, sigma_rad=math.inf),
        "start: not known, found from the reads",
    )
