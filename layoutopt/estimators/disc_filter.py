"""The plain filter on read discs, step by step, as it would run on a robot."""

import math
from collections.abc import Sequence
from typing import TYPE_CHECKING, Final

import numpy as np

from layoutopt.estimators.crossings import antenna_ways_m
from layoutopt.estimators.evidence import edge_width_m
from layoutopt.estimators.likelihood import ring_log_likelihood, silence_log_likelihood
from layoutopt.estimators.particles import (
    antenna_places,
    cloud_at_start,
    kld_particles,
    moved,
    systematic_parents,
    weighted_mean,
)
from layoutopt.identity import FloatArray, IntArray
from layoutopt.protocols import FloorKnowledge
from layoutopt.readings import Estimate, Motion, Prior, Reading, TagRead

if TYPE_CHECKING:
    from layoutopt.estimators.disc_localisation import DiscLocalisation

REMEMBERED: Final = 8
"""Reads that a restart may pair with a present one."""


class DiscFilter:
    """The plain float64 filter at work: the truth for the compiled run, with a stream of its own."""

    def __init__(
        self,
        settings: "DiscLocalisation",
        prior: Prior,
        knowledge: FloorKnowledge,
        draws: np.random.Generator,
    ) -> None:
        self._settings = settings
        self._knowledge = knowledge
        self._draws = draws
        count = settings.particles
        self._cloud = cloud_at_start(prior, knowledge, draws.standard_normal((3, count)), draws.random((3, count)))
        self._wanted = count
        self._unplaced = math.isinf(prior.sigma_m)
        self._streak = 0
        self._step = 0
        antennas = len(knowledge.antennas)
        self._tags_before: list[set[int] | None] = [None] * antennas
        self._way_m = np.zeros(antennas)
        self._remembered: list[tuple[FloatArray, FloatArray, float]] = []

    def step(self, motion: Motion, readings: Sequence[Reading]) -> Estimate:
        """Move the particles, weight them by what was read and what was not, and return their weighted mean."""
        settings, count = self._settings, self._cloud.shape[1]
        increment = np.array([[motion.forward_m, motion.left_m, motion.turn_rad]])
        self._cloud = moved(
            self._cloud,
            motion,
            settings.motion_sigma(np.array(motion.sigma)),
            self._draws.standard_normal((3, count)),
        )
        self._way_m += antenna_ways_m(increment, self._knowledge.antennas.xy_m)[0]
        self._carry(increment[0])
        antennas = self._knowledge.antennas
        scanning = np.flatnonzero(self._step % antennas.period_steps == antennas.phase_steps)
        reads = [(read.antenna, read.tag) for read in readings if isinstance(read, TagRead) and read.tag >= 0]
        of_reads = np.zeros(count)
        for antenna, tag in reads:
            radius_m = float(antennas.radius_m[antenna])
            of_reads += self._ring(antenna, tag, 0.0, radius_m, settings.outlier)
        log_weight = of_reads + self._of_crossings(scanning, reads)
        if settings.silence:
            log_weight += self._of_silence(scanning, reads)
        if reads:
            explained = of_reads.max() >= len(reads) * math.log(settings.alpha)
            self._streak = 0 if explained else self._streak + 1
        lost = self._unplaced or self._streak >= settings.patience
        if reads and self._streak > 0 and not lost:
            # Nothing explains the reads: one wrong identity is likelier than a robot that was moved.
            log_weight = np.zeros(count)
        weight = np.exp(log_weight - log_weight.max())
        pose, covariance = weighted_mean(self._cloud, weight)
        if reads and lost:
            self._start_anew(reads)
        elif np.ptp(log_weight) > 0.0:
            parents = systematic_parents(weight, self._wanted, float(self._draws.random()))
            self._cloud = self._cloud[:, parents]
            self._wanted = self._particles_wanted()
        self._remember(reads)
        self._step += 1
        return Estimate(
            of="robot",
            values=pose,
            covariance=covariance,
            health="lost: no particle explains what was read" if lost else "",
        )

    def _ring(self, antenna: int, tag: int, inner_m: float, outer_m: float, least: float) -> FloatArray:
        knowledge = self._knowledge
        centre_m = antenna_places(self._cloud, knowledge.antennas.xy_m[antenna])
        tag_m = knowledge.tags.xy_m[tag]
        width_m = edge_width_m(self._settings.edge_share, knowledge, np.array([antenna]), np.array([tag]))
        return ring_log_likelihood(
            np.hypot(centre_m[0] - tag_m[0], centre_m[1] - tag_m[1]),
            inner_m=inner_m,
            outer_m=outer_m,
            width_m=float(width_m[0]),
            log_floor=math.log(least),
        )

    def _of_crossings(self, scanning: IntArray, reads: Sequence[tuple[int, int]]) -> FloatArray:
        """Return the log weight of tags that appeared or vanished, and keep this scan for the next."""
        log_weight = np.zeros(self._cloud.shape[1])
        for antenna in scanning.tolist():
            tags = {tag for one, tag in reads if one == antenna}
            before, way_m = self._tags_before[antenna], float(self._way_m[antenna])
            radius_m = float(self._knowledge.antennas.radius_m[antenna])
            if self._settings.crossings and before is not None:
                for tag in sorted(tags - before):
                    log_weight += self._ring(
                        antenna, tag, max(radius_m - way_m, 0.0), radius_m, self._settings.doubt
                    )
                for tag in sorted(before - tags):
                    log_weight += self._ring(antenna, tag, radius_m, radius_m + way_m, self._settings.doubt)
            self._tags_before[antenna] = tags
            self._way_m[antenna] = 0.0
        return log_weight

    def _of_silence(self, scanning: IntArray, reads: Sequence[tuple[int, int]]) -> FloatArray:
        log_weight = np.zeros(self._cloud.shape[1])
        antennas, tags = self._knowledge.antennas, self._knowledge.tags
        for antenna in scanning.tolist():
            radius_m = float(antennas.radius_m[antenna])
            read = {tag for one, tag in reads if one == antenna}
            centre_m = antenna_places(self._cloud, antennas.xy_m[antenna])
            low, high = centre_m.min(axis=1) - radius_m, centre_m.max(axis=1) + radius_m
            near = np.flatnonzero(((tags.xy_m >= low) & (tags.xy_m <= high)).all(axis=1))
            silent = near[~np.isin(near, sorted(read))]
            if radius_m > 0.0 and len(silent):
                log_weight += silence_log_likelihood(
                    centre_m,
                    tags.xy_m[silent],
                    edge_width_m(
                        self._settings.edge_share, self._knowledge, np.full(len(silent), antenna), silent
                    ),
                    radius_m=radius_m,
                    log_miss=math.log(self._settings.miss_share),
                    one_tag_alone=bool(antennas.one_tag[antenna]) and not read,
                )
        return log_weight

    def _start_anew(self, reads: Sequence[tuple[int, int]]) -> None:
        """Put every particle where one of the reads could have put it (see the kernel's `_start_anew`)."""
        count, antennas = self._settings.particles, self._knowledge.antennas
        row = np.array(reads)[self._draws.integers(len(reads), size=count)]
        antenna_m, tag_m = antennas.xy_m[row[:, 0]], self._knowledge.tags.xy_m[row[:, 1]]
        radius_m = antennas.radius_m[row[:, 0]]
        centre_m = tag_m + self._in_disc(radius_m)
        heading_rad = math.pi * (2.0 * self._draws.random(count) - 1.0)
        if self._settings.adaptive and self._remembered:
            chosen = self._draws.integers(len(self._remembered), size=count)
            before_m, before_tag_m, before_radius_m = (
                np.array([entry[place] for entry in self._remembered])[chosen] for place in range(3)
            )
            seen_m = antenna_m - before_m
            across_m = centre_m - (before_tag_m + self._in_disc(before_radius_m))
            paired = np.hypot(seen_m[:, 0], seen_m[:, 1]) > radius_m + before_radius_m
            paired &= np.arange(count) % 2 == 0
            heading_rad = np.where(
                paired,
                np.arctan2(across_m[:, 1], across_m[:, 0]) - np.arctan2(seen_m[:, 1], seen_m[:, 0]),
                heading_rad,
            )
        cos, sin = np.cos(heading_rad), np.sin(heading_rad)
        self._cloud = np.stack(
            [
                centre_m[:, 0] - (cos * antenna_m[:, 0] - sin * antenna_m[:, 1]),
                centre_m[:, 1] - (sin * antenna_m[:, 0] + cos * antenna_m[:, 1]),
                heading_rad,
            ]
        )
        self._wanted = count
        self._unplaced = False
        self._streak = 0

    def _in_disc(self, radius_m: FloatArray) -> FloatArray:
        away_m = radius_m * np.sqrt(self._draws.random(len(radius_m)))
        angle_rad = 2.0 * math.pi * self._draws.random(len(radius_m))
        return np.stack([away_m * np.cos(angle_rad), away_m * np.sin(angle_rad)], axis=1)

    def _carry(self, increment: FloatArray) -> None:
        """Tell from where the robot is after a step where the antennas of remembered reads were."""
        cos, sin = math.cos(increment[2]), math.sin(increment[2])
        back = np.array([[cos, sin], [-sin, cos]])
        self._remembered = [
            (back @ (antenna_m - increment[:2]), tag_m, radius_m)
            for antenna_m, tag_m, radius_m in self._remembered
        ]

    def _remember(self, reads: Sequence[tuple[int, int]]) -> None:
        antennas = self._knowledge.antennas
        for antenna, tag in reads:
            entry = (
                antennas.xy_m[antenna],
                self._knowledge.tags.xy_m[tag],
                float(antennas.radius_m[antenna]),
            )
            self._remembered = [entry, *self._remembered][:REMEMBERED]

    def _particles_wanted(self) -> int:
        settings = self._settings
        if not settings.adaptive:
            return settings.particles
        bins = np.floor(
            np.stack(
                [
                    self._cloud[0] / settings.bin_m,
                    self._cloud[1] / settings.bin_m,
                    np.cos(self._cloud[2]) / settings.bin_share,
                    np.sin(self._cloud[2]) / settings.bin_share,
                ]
            )
        )
        needed = kld_particles(np.unique(bins, axis=1).shape[1], settings.kld_error)
        return int(min(max(needed, settings.least_particles), settings.particles))
