"""Particle filters that take the edge of the read disc seriously: their settings, and what they make of readings.

mi2016 asks how near a tag that was read is. These filters also ask what follows from the disc having an edge: a
tag that appears or vanishes lies on it (`mcl_crossings`), and where an antenna reads nothing there is none in
it (`mcl_negative_information`).
"""

import math
from dataclasses import dataclass, field
from typing import ClassVar, Final

import numpy as np

from layoutopt.estimators.compiled_run import compiled_run
from layoutopt.estimators.crossings import crossings_of
from layoutopt.estimators.disc_filter import DiscFilter
from layoutopt.estimators.evidence import (
    Constraints,
    ReadColumns,
    edge_width_m,
    floor_of,
    no_floor,
    origin_of,
    places,
    reads_of,
)
from layoutopt.estimators.likelihood import without_tag_readers
from layoutopt.estimators.particles import Likelihood, Settings
from layoutopt.identity import FloatArray
from layoutopt.layout import Layout
from layoutopt.protocols import EstimatorCard, FloorKnowledge
from layoutopt.readings import Observations, Prior, Trajectory

_LEVER_M: Final = 0.2
_BIN_LEVER_M: Final = 0.1


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class DiscLocalisation:
    """Settings that the filters on read discs share; each filter is a class of its own with a card.

    Attributes
    ----------
    particles, least_particles
        Number of particles; where it adapts, the most and the least (no more than the most).
    edge_share
        Width of the soft edge of a disc, in its radii; a tag laid with a tolerance widens it as errors add.
    miss_share
        Chance that a scan brings nothing of a tag in range, as the filter believes; too large costs little.
    doubt
        Least likelihood of an appearing or vanishing tag away from the edge: a missed scan makes such events too.
    outlier
        Least likelihood of a read: identities may be wrong.
    alpha, patience
        Particles start anew once no particle explains the reads with a mean likelihood above ``alpha``, in
        ``patience`` steps with reads running.
    roughening_m
        Added to the deviations of each step, so that a cloud never collapses (the heading gets it over 0.2 m).
    motion_scale
        Factor on the standard deviations of the odometry.
    bin_m, kld_error
        Bins in which an adaptive number of particles counts its spread, and its bound (Fox, 2003).

    Raises
    ------
    ValueError
        If a setting lies outside its range.
    """

    particles: int = 500
    least_particles: int = 100
    edge_share: float = 0.15
    miss_share: float = 0.1
    doubt: float = 0.1
    outlier: float = 0.001
    alpha: float = 0.01
    patience: int = 3
    roughening_m: float = 0.0002
    motion_scale: float = 1.0
    bin_m: float = 0.01
    kld_error: float = 0.05
    key: str = field(init=False, repr=False, default="")
    card: ClassVar[EstimatorCard]
    row: ClassVar[str]
    crossings: ClassVar[bool] = False
    silence: ClassVar[bool] = False
    adaptive: ClassVar[bool] = False

    def check(self) -> None:
        """Check the settings.

        Raises
        ------
        ValueError
            If one lies outside its range.
        """
        if self.least_particles < 1 or self.particles < 1:
            raise ValueError(
                f"a particle filter needs at least one particle, got {self.particles} and {self.least_particles}"
            )
        for name in ("miss_share", "doubt", "outlier", "alpha"):
            if not 0.0 < getattr(self, name) < 1.0:
                raise ValueError(f"{name} must lie between 0 and 1, got {getattr(self, name)}")
        for name in ("edge_share", "bin_m", "kld_error"):
            if not 0.0 < getattr(self, name) < math.inf:
                raise ValueError(f"{name} must be positive, got {getattr(self, name)}")
        for name in ("roughening_m", "motion_scale"):
            if not 0.0 <= getattr(self, name) < math.inf:
                raise ValueError(f"{name} must be zero or positive, got {getattr(self, name)}")
        if self.patience < 1:
            raise ValueError(f"patience is counted in steps from 1, got {self.patience}")

    @property
    def name(self) -> str:
        """Name in the estimator table."""
        return self.row

    def applies(self, layout: Layout) -> str:
        """Return why the filter cannot work with a layout, or an empty string."""
        return without_tag_readers(layout)

    def start(self, prior: Prior, knowledge: FloorKnowledge, draws: np.random.Generator) -> DiscFilter:
        """Return the plain filter that works step by step."""
        return DiscFilter(self, prior, knowledge, draws)

    def run(
        self, prior: Prior, knowledge: FloorKnowledge, observations: Observations, draws: np.random.Generator
    ) -> Trajectory:
        """Return the estimates of a whole drive from the compiled twin of `DiscFilter`."""
        origin_m = origin_of(knowledge, prior.pose[:2])
        floor = no_floor(observations)
        if self.silence:
            floor = floor_of(
                observations, knowledge, origin_m, edge_share=self.edge_share, miss_share=self.miss_share
            )
        return compiled_run(
            self.kernel_settings(),
            prior,
            knowledge,
            draws,
            increments=observations.increments,
            sigma=self.motion_sigma(observations.sigma),
            origin_m=origin_m,
            constraints=self.constraints(observations, knowledge, origin_m),
            floor=floor,
        )

    def kernel_settings(self) -> Settings:
        """Return the settings as the compiled filter takes them."""
        return Settings(
            particles=self.particles,
            least_particles=min(self.least_particles, self.particles) if self.adaptive else self.particles,
            likelihood=int(Likelihood.RINGS),
            log_beta=0.0,
            reinitialise=True,
            log_alpha=math.log(self.alpha),
            patience=self.patience,
            ask_silence=self.silence,
            paired=self.adaptive,
            bin_m=self.bin_m,
            bin_share=self.bin_share,
            kld_error=self.kld_error,
        )

    @property
    def bin_share(self) -> float:
        """Bin of cosine and sine that goes with the bin of x and y."""
        return self.bin_m / _BIN_LEVER_M

    def motion_sigma(self, sigma: FloatArray) -> FloatArray:
        """Return the deviations of steps of odometry, shape (..., 3), that the particles get."""
        rough = np.array([self.roughening_m, self.roughening_m, self.roughening_m / _LEVER_M])
        return np.ascontiguousarray(np.hypot(sigma * self.motion_scale, rough))

    def constraints(
        self, observations: Observations, knowledge: FloorKnowledge, origin_m: FloatArray
    ) -> Constraints:
        """Return a ring for every read and, if the filter asks for them, one for every crossing of an edge."""
        reads = reads_of(observations)
        width_m = edge_width_m(self.edge_share, knowledge, reads.antenna, reads.tag)
        radius_m = knowledge.antennas.radius_m[reads.antenna]
        rings = [(reads, _rings(np.zeros(len(radius_m)), radius_m, width_m, self.outlier))]
        if self.crossings:
            edge, inner_m, outer_m = crossings_of(observations, knowledge, reads)
            width_m = edge_width_m(self.edge_share, knowledge, edge.antenna, edge.tag)
            rings.append((edge, _rings(inner_m, outer_m, width_m, self.doubt)))
        step, antenna, tag = (
            np.concatenate([getattr(rows, name) for rows, _ in rings]) for name in ("step", "antenna", "tag")
        )
        kind = np.repeat(np.arange(len(rings)), [len(rows.step) for rows, _ in rings])
        order = np.lexsort((kind, step))
        every = ReadColumns(
            step=step[order],
            antenna=antenna[order],
            tag=tag[order],
            start=np.searchsorted(step[order], np.arange(len(observations) + 1)).astype(np.int64),
        )
        return Constraints(
            start=every.start,
            read_end=every.start[:-1] + np.diff(reads.start),
            place=places(every, knowledge, origin_m),
            shape=np.ascontiguousarray(np.concatenate([shape for _, shape in rings])[order], dtype=np.float32),
            antenna=np.ascontiguousarray(every.antenna),
            tag=np.ascontiguousarray(every.tag),
        )


def _rings(inner_m: FloatArray, outer_m: FloatArray, width_m: FloatArray, least: float) -> FloatArray:
    """Return the ``shape`` column of constraints."""
    return np.column_stack([inner_m, outer_m, 1.0 / width_m, np.full(len(inner_m), math.log(least))])
