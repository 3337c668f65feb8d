"""Monte Carlo localisation: Algorithm 1 of mi2016 on the tags that the readers saw."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import ClassVar, Final

import numpy as np

from layoutopt.estimators.compiled_run import compiled_run
from layoutopt.estimators.evidence import no_floor, origin_of, places, read_constraints, reads_of
from layoutopt.estimators.likelihood import (
    LIKELIHOODS,
    Detections,
    detections_in,
    likelihood_sigma_m,
    log_likelihood,
    without_tag_readers,
)
from layoutopt.estimators.particles import (
    Likelihood,
    Settings,
    antenna_places,
    cloud_at_start,
    moved,
    systematic_parents,
    weighted_mean,
)
from layoutopt.identity import FloatArray, IntArray, by_content
from layoutopt.layout import Layout
from layoutopt.protocols import EstimatorCard, FloorKnowledge
from layoutopt.readings import Estimate, Motion, Observations, Prior, Reading, Trajectory

CARD: Final = EstimatorCard(
    summary="Particle filter on tag reads with re-initialisation of implausible particles.",
    reference="mi2016, Algorithm 1, Eq. 1-6",
    estimates="robot",
    needs="tag_read",
    states_covariance=True,
)


@by_content
@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class MonteCarloLocalisation:
    """Monte Carlo localisation with systematic resampling in every step that saw a tag.

    Three readings of the paper are choices made here: sigma is the radius of the read disc on the floor, the
    threshold of step 12 is on the geometric mean of the likelihoods per detection (on the product it would
    depend on how many tags were seen), and the weight tested is that of the particle drawn as parent.

    Attributes
    ----------
    particles
        M of Algorithm 1.
    likelihood, beta
        ``"combination"`` or ``"gaussian"`` of Eq. 6, and its constant beyond the flat top.
    reinitialise, alpha
        Whether a particle whose likelihood per detection is below ``alpha`` starts anew from a detection.
    sigma_scale, sigma_floor_m
        Sigma of Eq. 6 in read radii, and the least value it may take.
    motion_scale
        Factor on the standard deviations of the odometry; too large costs less than too small.

    Raises
    ------
    ValueError
        If a setting lies outside its range.
    """

    particles: int = 500
    likelihood: str = "combination"
    beta: float = 1.0
    reinitialise: bool = True
    alpha: float = 0.01
    sigma_scale: float = 1.0
    sigma_floor_m: float = 0.001
    motion_scale: float = 1.0
    key: str = field(init=False, repr=False, default="")
    card: ClassVar[EstimatorCard] = CARD

    def __post_init__(self) -> None:
        """Check the settings."""
        if self.particles < 1:
            raise ValueError(f"a particle filter needs at least one particle, got {self.particles}")
        if self.likelihood not in LIKELIHOODS:
            raise ValueError(f"likelihood is one of {LIKELIHOODS}, not {self.likelihood!r}")
        if not (0.0 < self.beta < math.inf and 0.0 < self.alpha <= 1.0):
            raise ValueError(f"beta must be positive and alpha in (0, 1], got {self.beta} and {self.alpha}")
        if not (0.0 <= self.sigma_scale < math.inf and 0.0 < self.sigma_floor_m < math.inf):
            raise ValueError(
                f"sigma needs a scale of at least zero and a positive floor, got {self.sigma_scale} and "
                f"{self.sigma_floor_m} m"
            )
        if not 0.0 <= self.motion_scale < math.inf:
            raise ValueError(f"motion_scale must be zero or positive, got {self.motion_scale}")

    @property
    def name(self) -> str:
        """Name in the estimator table."""
        return "mcl"

    def applies(self, layout: Layout) -> str:
        """Return why Monte Carlo localisation cannot work with a layout, or an empty string."""
        return without_tag_readers(layout)

    def start(self, prior: Prior, knowledge: FloorKnowledge, draws: np.random.Generator) -> "ParticleFilter":
        """Return the plain filter that works step by step."""
        return ParticleFilter(self, prior, knowledge, draws)

    def run(
        self, prior: Prior, knowledge: FloorKnowledge, observations: Observations, draws: np.random.Generator
    ) -> Trajectory:
        """Return the estimates of a whole drive from the compiled twin of `ParticleFilter`."""
        reads = reads_of(observations)
        origin_m = origin_of(knowledge, prior.pose[:2])
        sigma_m = likelihood_sigma_m(
            knowledge.antennas.radius_m[reads.antenna],
            np.asarray(knowledge.tags.sigma_m)[reads.tag],
            self.sigma_scale,
            self.sigma_floor_m,
        )
        shape = np.zeros((len(sigma_m), 4))
        shape[:, 0] = 1.0 / (2.0 * sigma_m**2)
        return compiled_run(
            self.kernel_settings(),
            prior,
            knowledge,
            draws,
            increments=observations.increments,
            sigma=observations.sigma * self.motion_scale,
            origin_m=origin_m,
            constraints=read_constraints(reads, places(reads, knowledge, origin_m), shape),
            floor=no_floor(observations),
        )

    def kernel_settings(self) -> Settings:
        """Return the settings as the compiled filter takes them."""
        return Settings(
            particles=self.particles,
            least_particles=self.particles,
            likelihood=int(Likelihood.COMBINATION if self.likelihood == "combination" else Likelihood.GAUSSIAN),
            log_beta=math.log(self.beta),
            reinitialise=self.reinitialise,
            log_alpha=math.log(self.alpha),
            patience=1,
            ask_silence=False,
            paired=False,
            bin_m=1.0,
            bin_share=1.0,
            kld_error=1.0,
        )


class ParticleFilter:
    """The plain float64 filter at work: the truth for the compiled run, with a stream of its own."""

    def __init__(
        self,
        settings: MonteCarloLocalisation,
        prior: Prior,
        knowledge: FloorKnowledge,
        draws: np.random.Generator,
    ) -> None:
        self._settings = settings
        self._knowledge = knowledge
        self._draws = draws
        count = settings.particles
        self._cloud = cloud_at_start(prior, knowledge, draws.standard_normal((3, count)), draws.random((3, count)))
        self._unplaced = math.isinf(prior.sigma_m)

    def step(self, motion: Motion, readings: Sequence[Reading]) -> Estimate:
        """Move the particles, weight them by what was read, and return their weighted mean (Eq. 3)."""
        settings, count = self._settings, self._settings.particles
        self._cloud = moved(
            self._cloud,
            motion,
            settings.motion_scale * np.array(motion.sigma),
            self._draws.standard_normal((3, count)),
        )
        detections = detections_in(readings, self._knowledge)
        if len(detections) == 0:
            pose, covariance = weighted_mean(self._cloud, np.ones(count))
            return self._estimate(pose, covariance, lost=self._unplaced)
        log_weight = self._log_weight(detections)
        # The largest weight is 1, so that a lost filter does not divide by zero.
        weight = np.exp(log_weight - log_weight.max())
        limit = len(detections) * math.log(settings.alpha)
        pose, covariance = weighted_mean(self._cloud, weight)
        estimate = self._estimate(pose, covariance, lost=self._unplaced or bool(log_weight.max() < limit))
        parent = systematic_parents(weight, count, float(self._draws.random()))
        self._cloud = self._cloud[:, parent]
        if settings.reinitialise:
            self._reinitialise(np.flatnonzero(log_weight[parent] < limit), detections)
        self._unplaced = False
        return estimate

    def _estimate(self, pose: tuple[float, float, float], covariance: FloatArray, *, lost: bool) -> Estimate:
        health = "lost: no particle explains what was read" if lost else ""
        return Estimate(of="robot", values=pose, covariance=covariance, health=health)

    def _log_weight(self, detections: Detections) -> FloatArray:
        settings = self._settings
        sigma_m = likelihood_sigma_m(
            detections.radius_m, detections.tag_sigma_m, settings.sigma_scale, settings.sigma_floor_m
        )
        log_weight = np.zeros(settings.particles)
        for row in range(len(detections)):
            away_m = antenna_places(self._cloud, detections.antenna_m[row]) - detections.tag_m[row][:, None]
            log_weight += log_likelihood(
                (away_m**2).sum(axis=0), float(sigma_m[row]), settings.likelihood, math.log(settings.beta)
            )
        return log_weight

    def _reinitialise(self, lost: IntArray, detections: Detections) -> None:
        """Put each lost particle where one of the detections, at any heading, would put it (Eq. 4)."""
        row = self._draws.integers(len(detections), size=len(lost))
        heading_rad = math.pi * (2.0 * self._draws.random(len(lost)) - 1.0)
        cos, sin = np.cos(heading_rad), np.sin(heading_rad)
        forward_m, left_m = detections.antenna_m[row].T
        self._cloud[0, lost] = detections.tag_m[row, 0] - (cos * forward_m - sin * left_m)
        self._cloud[1, lost] = detections.tag_m[row, 1] - (sin * forward_m + cos * left_m)
        self._cloud[2, lost] = heading_rad
