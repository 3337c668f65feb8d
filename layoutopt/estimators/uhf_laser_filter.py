"""The plain particle filter on UHF and laser, instant by instant: the truth for `uhf_laser_kernels`."""

import math
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

from layoutopt.estimators.laser_clusters import (
    Clustering,
    check_scans,
    laser_clusters,
    nearest_before,
    radial_velocities,
)
from layoutopt.estimators.particles import systematic_parents
from layoutopt.estimators.phase_velocity import phase_displacement, phase_velocities, similarity
from layoutopt.estimators.sensor_model import log_likelihood, sensor_tables
from layoutopt.geometry import covers, turned
from layoutopt.identity import FloatArray
from layoutopt.readings import Estimate

if TYPE_CHECKING:
    from shapely.geometry.base import BaseGeometry

    from layoutopt.estimators.targets import TargetKnowledge, TargetObservations, TargetSample
    from layoutopt.estimators.uhf_laser import UhfLaser

NORMALS, UNIFORMS = 4, 4
"""Random numbers that each particle gets at each instant, whether they are needed or not."""


class Motion(NamedTuple):
    """What one interval does to particles.

    Attributes
    ----------
    interval_s
        Its length.
    sigma_m
        Standard deviation of a step in x and in y.
    heading
        Whether particles have a direction and a speed; the rest is for these.
    turn_sigma_rad, speed_sigma_m_s
        Standard deviations of their changes.
    fresh_share
        Chance of a new direction and speed.
    fastest_m_s
        Largest speed.
    on_floor
        Whether particles stay on the floor.
    """

    interval_s: float
    sigma_m: float
    heading: bool
    turn_sigma_rad: float
    speed_sigma_m_s: float
    fresh_share: float
    fastest_m_s: float
    on_floor: bool


class Matches(NamedTuple):
    """The clusters that fit the phases best, best first.

    Attributes
    ----------
    centres_m, velocities_m_s
        Where they are in the floor frame, and how they moved since the scan before, shape (k, 2).
    similarities
        How well they fit (Eq. 11), above 0, shape (k,).
    """

    centres_m: FloatArray
    velocities_m_s: FloatArray
    similarities: FloatArray


def draw(draws: np.random.Generator, particles: int) -> tuple[FloatArray, FloatArray, float]:
    """Return the random numbers of an instant: normals, uniforms, and one uniform for the resampling."""
    return draws.standard_normal((NORMALS, particles)), draws.random((UNIFORMS, particles)), draws.random()


def check_told(knowledge: "TargetKnowledge", told: "TargetSample | TargetObservations") -> None:
    """Check what one instant or a whole drive gave.

    Raises
    ------
    ValueError
        If a range is NaN or negative, a strength infinite or a phase word too large, or columns do not fit the
        antennas or the beams.
    """
    check_scans(told.ranges_m, knowledge.laser)
    columns = {name: getattr(told, name) for name in ("read_time_s", "strength_dbm", "phase_word", "frequency_hz")}
    for name, values in columns.items():
        if values.shape != (*told.ranges_m.shape[:-1], knowledge.antennas.count):
            raise ValueError(
                f"{name} has the shape {values.shape} beside scans of the shape {told.ranges_m.shape} and "
                f"{knowledge.antennas.count} antennas: it needs a column for each antenna"
            )
    if np.isinf(told.strength_dbm).any():
        raise ValueError("a strength is finite, or NaN where the tag was not heard")
    steps = 1 << knowledge.phase_bits
    if (told.phase_word >= steps).any() or (told.phase_word < -1).any():
        raise ValueError(
            f"phase words of {knowledge.phase_bits} bits lie between 0 and {steps - 1}; -1 where there is none"
        )


def within_reach(knowledge: "TargetKnowledge") -> "BaseGeometry":
    """Return the part of the floor on which the robot may hear a tag; the whole floor if that is none of it.

    It may hear one as far off as the farthest cell in which calibration drives did.
    """
    import shapely

    model = knowledge.sensor_model
    column, row = np.nonzero(model.readings * np.nan_to_num(model.detection) > 0.0)
    cell = np.stack([column, row], axis=1)[:, None, :] + np.array([[0, 0], [0, 1], [1, 0], [1, 1]])
    corners_m = np.array(model.origin_m) + cell * model.cell_m
    antennas_m = knowledge.antennas.poses[:, :2]
    reach_m = np.sqrt((corners_m**2).sum(axis=-1)).max() + np.sqrt((antennas_m**2).sum(axis=1)).max()
    near = knowledge.floor.intersection(shapely.Point(knowledge.robot_pose[:2]).buffer(float(reach_m)))
    return near if near.area > 0.0 else knowledge.floor


def cloud_at_start(
    knowledge: "TargetKnowledge", particles: int, fastest_m_s: float, draws: np.random.Generator
) -> FloatArray:
    """Return particles that lie evenly where the robot may hear a tag, shape (4, n): x, y, direction and speed."""
    region = within_reach(knowledge)
    low_x_m, low_y_m, high_x_m, high_y_m = region.bounds
    found = np.empty((0, 2))
    while len(found) < particles:
        tried = draws.random((particles, 2)) * [high_x_m - low_x_m, high_y_m - low_y_m] + [low_x_m, low_y_m]
        found = np.concatenate([found, tried[covers(region, tried)]])
    uniform = draws.random((2, particles))
    return np.stack(
        [found[:particles, 0], found[:particles, 1], 2.0 * math.pi * uniform[0], fastest_m_s * uniform[1]]
    )


def antenna_frames(knowledge: "TargetKnowledge") -> FloatArray:
    """Return x, y, cosine and sine of each antenna in the floor frame, shape (antennas, 4)."""
    heading_rad, poses = knowledge.robot_pose[2], knowledge.antennas.poses
    place_m = turned(poses[:, :2], heading_rad) + np.array(knowledge.robot_pose[:2])
    yaw_rad = poses[:, 3] + heading_rad
    return np.column_stack([place_m, np.cos(yaw_rad), np.sin(yaw_rad)])


def moved(
    cloud: FloatArray, motion: Motion, normal: FloatArray, uniform: FloatArray, floor: "BaseGeometry"
) -> FloatArray:
    """Return particles, shape (4, n), after one interval.

    Without a heading a step is random (Eq. 12). With one, direction and speed change a little, or are new, and the
    step is theirs plus a random one. A particle that would leave the floor steps the other way instead and turns
    back; where that is off the floor as well it stays.
    """
    x_m, y_m, direction_rad, speed_m_s = cloud
    step_m = motion.sigma_m * normal[:2]
    if motion.heading:
        fresh = uniform[0] < motion.fresh_share
        direction_rad = np.where(
            fresh, 2.0 * math.pi * uniform[1], direction_rad + motion.turn_sigma_rad * normal[2]
        )
        speed_m_s = np.abs(speed_m_s + motion.speed_sigma_m_s * normal[3])
        speed_m_s = np.where(fresh, motion.fastest_m_s * uniform[2], np.minimum(speed_m_s, motion.fastest_m_s))
        way_m = speed_m_s * motion.interval_s
        step_m = step_m + np.stack([way_m * np.cos(direction_rad), way_m * np.sin(direction_rad)])
    place_m = np.stack([x_m + step_m[0], y_m + step_m[1]])
    if motion.on_floor:
        off = ~covers(floor, place_m.T)
        back_m = np.stack([x_m - step_m[0], y_m - step_m[1]])
        stays = off & ~covers(floor, back_m.T)
        place_m = np.where(off, back_m, place_m)
        place_m = np.where(stays, cloud[:2], place_m)
        direction_rad = np.where(off, direction_rad + math.pi, direction_rad)
    return np.stack([*place_m, direction_rad, speed_m_s])


def seeded(
    cloud: FloatArray,
    clusters: "Matches",
    share: float,
    sigma_m: float,
    normal: FloatArray,
    uniform: FloatArray,
    motion: Motion,
    floor: "BaseGeometry",
) -> FloatArray:
    """Return particles, shape (4, n), a share of which is put to the matched clusters, with their velocities.

    A cluster gets them in proportion to its similarity, with a standard deviation of ``sigma_m`` about its centre;
    where that is off the floor, though particles stay on it, the particle is left as it was. A filter that follows
    the wrong cluster, with no particle left near the right one, recovers so.

    References
    ----------
    Lenser, Veloso: Sensor resetting localization for poorly modelled mobile robots, ICRA 2000.
    """
    reached = np.cumsum(clusters.similarities)
    chosen = np.searchsorted(reached, uniform[3] / share * reached[-1], side="right")
    chosen = np.minimum(chosen, len(reached) - 1)
    place_m = clusters.centres_m[chosen] + sigma_m * normal[:2].T
    taken = uniform[3] < share
    if motion.on_floor:
        taken = taken & covers(floor, place_m)
    velocity_m_s = clusters.velocities_m_s[chosen]
    speed_m_s = np.sqrt((velocity_m_s**2).sum(axis=1))
    put = np.stack(
        [
            *place_m.T,
            np.arctan2(velocity_m_s[:, 1], velocity_m_s[:, 0]),
            np.minimum(speed_m_s, motion.fastest_m_s),
        ]
    )
    return np.where(taken, put, cloud)


def velocity_log_weight(cloud: FloatArray, clusters: "Matches", rho_m2: float) -> FloatArray:
    """Return the logarithm of Eq. 13's factor for particles, shape (n,), from the matched clusters.

    In logarithms, because far from all clusters the sum is smaller than any number.

    References
    ----------
    liang2020, Eq. 13-14.
    """
    away_m = cloud[:2, :, None] - clusters.centres_m.T[:, None, :]
    terms = np.log(clusters.similarities) - 0.5 * (away_m[0] * away_m[0] + away_m[1] * away_m[1]) / rho_m2
    largest = terms.max(axis=1)
    return np.asarray(largest + np.log(np.exp(terms - largest[:, None]).sum(axis=1)))


class RunningUhfLaser:
    """`UhfLaser` at work, instant by instant; ``matched`` tells whether a cluster counted at the latest one."""

    def __init__(self, settings: "UhfLaser", knowledge: "TargetKnowledge", draws: np.random.Generator) -> None:
        self.settings, self.knowledge, self.draws = settings, knowledge, draws
        self.cloud = cloud_at_start(knowledge, settings.particles, settings.fastest_m_s, draws)
        self.tables = sensor_tables(knowledge.sensor_model)
        self.frames = antenna_frames(knowledge)
        self.clustering = Clustering(largest_radius_m=settings.largest_radius_m)
        self.place_m = self.cloud[:2].mean(axis=1)
        self.clusters_before_m = np.empty((0, 2))
        self.before: TargetSample | None = None
        self.matched = False

    def step(self, sample: "TargetSample") -> Estimate:
        """Take what one instant gave; return the estimate of the target.

        Raises
        ------
        ValueError
            If a range is NaN or negative, or the readings do not fit the antennas or come out of order.
        """
        check_told(self.knowledge, sample)
        clusters_m = self._clusters(sample.ranges_m)
        matches = self._matches(clusters_m, sample)
        matched = self.matched = len(matches.similarities) > 0
        heard = not np.isnan(sample.strength_dbm).all()
        told = (self.settings.uses_strength and heard) or matched
        normal, uniform, mark = draw(self.draws, self.settings.particles)
        if told or self.settings.steps_unread:
            motion = self.settings.motion_in(self._interval_s(sample))
            self.cloud = moved(self.cloud, motion, normal, uniform, self.knowledge.floor)
            log_weight = np.zeros(self.settings.particles)
            if matched and self.settings.seeded_share > 0.0:
                self.cloud = seeded(
                    self.cloud,
                    matches,
                    self.settings.seeded_share,
                    math.sqrt(self.settings.rho_m2),
                    normal,
                    uniform,
                    motion,
                    self.knowledge.floor,
                )
            if self.settings.uses_strength:
                log_weight = log_weight + self._strength_log_weight(sample.strength_dbm)
            if matched:
                log_weight = log_weight + velocity_log_weight(self.cloud, matches, self.settings.rho_m2)
            weight = np.exp(log_weight - log_weight.max())
            self.place_m = self.cloud[:2] @ weight / weight.sum()
            self.cloud = self.cloud[:, systematic_parents(weight, self.settings.particles, mark)]
        self.before, self.clusters_before_m = sample, clusters_m
        return Estimate(
            of="target",
            values=(float(self.place_m[0]), float(self.place_m[1])),
            health="" if told else "nothing was heard of the target",
        )

    def _interval_s(self, sample: "TargetSample") -> float:
        """Return the time since the instant before; the first comes one interval after the start."""
        return sample.time_s - (0.0 if self.before is None else self.before.time_s)

    def _clusters(self, ranges_m: FloatArray) -> FloatArray:
        """Return the centres of a scan's clusters in the floor frame, shape (n, 2)."""
        if not self.settings.uses_velocity:
            return np.empty((0, 2))
        pose = self.knowledge.robot_pose
        centres_m = laser_clusters(ranges_m, self.knowledge.laser, self.clustering)[:, :2]
        return np.asarray(turned(centres_m, pose[2]) + np.array(pose[:2]))

    def _matches(self, clusters_m: FloatArray, sample: "TargetSample") -> Matches:
        """Return the clusters whose radial velocity fits the phases best (Eq. 11), mean over antennas.

        The best of the velocities that a pair of phases may stand for counts. An antenna without a phase at both
        instants, or that changed its channel between them, has no pair; without any pair nothing fits.
        """
        before, before_m = self.before, self.clusters_before_m
        if before is None or len(before_m) == 0 or len(clusters_m) == 0:
            return Matches(np.empty((0, 2)), np.empty((0, 2)), np.empty(0))
        interval_s = self._interval_s(sample)
        total, pairs = np.zeros(len(clusters_m)), 0
        for antenna, frame in enumerate(self.frames):
            frequency_hz = float(sample.frequency_hz[antenna])
            then, now = int(before.phase_word[antenna]), int(sample.phase_word[antenna])
            if then < 0 or now < 0 or before.frequency_hz[antenna] != frequency_hz:
                continue
            displacement_m = phase_displacement(
                then,
                now,
                frequency_hz,
                bits=self.knowledge.phase_bits,
                literal=self.settings.aliases == "literal",
            )
            by_phase_m_s = phase_velocities(
                float(displacement_m),
                float(sample.read_time_s[antenna] - before.read_time_s[antenna]),
                frequency_hz,
                self.settings.aliases,
            )
            by_laser_m_s = radial_velocities(clusters_m, before_m, interval_s, (float(frame[0]), float(frame[1])))
            total += similarity(by_laser_m_s[:, None], by_phase_m_s).max(axis=1)
            pairs += 1
        similarities = total / max(pairs, 1)
        best = np.argsort(-similarities, kind="stable")[: self.settings.matches]
        best = best[similarities[best] > 0.0]
        velocities_m_s = (clusters_m - before_m[nearest_before(clusters_m, before_m)]) / interval_s
        return Matches(clusters_m[best], velocities_m_s[best], similarities[best])

    def _strength_log_weight(self, strength_dbm: FloatArray) -> FloatArray:
        """Return the logarithm of Eq. 15's factor for all particles, from all antennas, shape (n,)."""
        total = np.zeros(self.settings.particles)
        for frame, one_dbm in zip(self.frames, strength_dbm, strict=True):
            away_m = self.cloud[:2].T - frame[:2]
            cos, sin = frame[2], frame[3]
            local_m = np.stack(
                [cos * away_m[:, 0] + sin * away_m[:, 1], cos * away_m[:, 1] - sin * away_m[:, 0]], axis=1
            )
            total = total + log_likelihood(self.tables, local_m, float(one_dbm))
        return total
