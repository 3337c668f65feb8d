"""Monte Carlo localisation: Algorithm 1 of mi2016 on the tags that the readers saw."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import ClassVar, Final

import numpy as np

from layoutopt.estimators.likelihood import (
    LIKELIHOODS,
    Detections,
    detections_in,
    detections_of,
    likelihood_sigma_m,
    log_likelihood,
)
from layoutopt.geometry import wrapped
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
        if all(group.kind != "tag_read" for group in layout.readers):
            return "it needs readers of floor tags, and the layout has none"
        return ""

    def start(self, prior: Prior, knowledge: FloorKnowledge, draws: np.random.Generator) -> "ParticleFilter":
        """Return the plain filter that works step by step."""
        return ParticleFilter(self, prior, knowledge, draws)

    def run(
        self, prior: Prior, knowledge: FloorKnowledge, observations: Observations, draws: np.random.Generator
    ) -> Trajectory:
        """Return the estimates of a whole drive from the compiled twin of `ParticleFilter`."""
        from layoutopt.estimators.mcl_kernels import localise

        detections = detections_of(observations, knowledge)
        sigma_m = likelihood_sigma_m(detections, self.sigma_scale, self.sigma_floor_m)
        poses = np.empty((len(observations), 3))
        covariance = np.empty((len(observations), 2, 2))
        localise(
            own_stream(draws),
            self.particles,
            np.array([*prior.pose, prior.sigma_m, prior.sigma_rad]),
            np.array(observations.increments, dtype=np.float64, order="C"),
            np.ascontiguousarray(observations.sigma * self.motion_scale),
            detections.start,
            np.concatenate([detections.antenna_m, detections.tag_m], axis=1),
            1.0 / (2.0 * sigma_m**2),
            self.likelihood == "combination",
            math.log(self.beta),
            self.reinitialise,
            math.log(self.alpha),
            poses,
            covariance,
        )
        return Trajectory(poses=poses, covariance=covariance)


class ParticleFilter:
    """The plain float64 filter at work: the truth for the compiled run.

    The random draws of a step, in this order: three normals a particle; in a step with detections one uniform
    number for the resampling; then two for each particle that is re-initialised, its detection and heading.
    """

    def __init__(
        self,
        settings: MonteCarloLocalisation,
        prior: Prior,
        knowledge: FloorKnowledge,
        draws: np.random.Generator,
    ) -> None:
        self._settings = settings
        self._knowledge = knowledge
        self._draws = own_stream(draws)
        noise = self._draws.standard_normal((3, settings.particles))
        self._x_m = prior.pose[0] + prior.sigma_m * noise[0]
        self._y_m = prior.pose[1] + prior.sigma_m * noise[1]
        self._heading_rad = prior.pose[2] + prior.sigma_rad * noise[2]

    def step(self, motion: Motion, readings: Sequence[Reading]) -> Estimate:
        """Move the particles, weight them by what was read, and return their weighted mean (Eq. 3)."""
        settings = self._settings
        self._move(motion)
        detections = detections_in(readings, self._knowledge)
        if len(detections) == 0:
            return self._estimate(np.ones(settings.particles), "")
        log_weight = self._log_weight(detections)
        # The largest weight is 1, so that a lost filter does not divide by zero.
        weight = np.exp(log_weight - log_weight.max())
        limit = len(detections) * math.log(settings.alpha)
        lost = log_weight.max() < limit
        estimate = self._estimate(weight, "lost: no particle explains what was read" if lost else "")
        parent = self._resample(weight)
        if settings.reinitialise:
            self._reinitialise(np.flatnonzero(log_weight[parent] < limit), detections)
        return estimate

    def _move(self, motion: Motion) -> None:
        """Add odometry and its noise to every particle, in the particle's own frame before the step (Eq. 1)."""
        noise = self._draws.standard_normal((3, self._settings.particles))
        sigma = self._settings.motion_scale * np.array(motion.sigma)
        forward_m = motion.forward_m + sigma[0] * noise[0]
        left_m = motion.left_m + sigma[1] * noise[1]
        cos, sin = np.cos(self._heading_rad), np.sin(self._heading_rad)
        self._x_m = self._x_m + cos * forward_m - sin * left_m
        self._y_m = self._y_m + sin * forward_m + cos * left_m
        self._heading_rad = wrapped(self._heading_rad + motion.turn_rad + sigma[2] * noise[2])

    def _log_weight(self, detections: Detections) -> FloatArray:
        settings = self._settings
        sigma_m = likelihood_sigma_m(detections, settings.sigma_scale, settings.sigma_floor_m)
        cos, sin = np.cos(self._heading_rad), np.sin(self._heading_rad)
        log_weight = np.zeros(settings.particles)
        for row in range(len(detections)):
            forward_m, left_m = detections.antenna_m[row]
            tag_x_m, tag_y_m = detections.tag_m[row]
            away_x_m = self._x_m + cos * forward_m - sin * left_m - tag_x_m
            away_y_m = self._y_m + sin * forward_m + cos * left_m - tag_y_m
            log_weight += log_likelihood(
                away_x_m**2 + away_y_m**2, float(sigma_m[row]), settings.likelihood, math.log(settings.beta)
            )
        return log_weight

    def _estimate(self, weight: FloatArray, health: str) -> Estimate:
        total = weight.sum()
        x_m, y_m = float(weight @ self._x_m / total), float(weight @ self._y_m / total)
        heading_rad = math.atan2(weight @ np.sin(self._heading_rad), weight @ np.cos(self._heading_rad))
        away_m = np.stack([self._x_m - x_m, self._y_m - y_m])
        return Estimate(
            of="robot",
            values=(x_m, y_m, heading_rad),
            covariance=(away_m * weight) @ away_m.T / total,
            health=health,
        )

    def _resample(self, weight: FloatArray) -> IntArray:
        """Draw all particles anew, systematically; return the parent of each, shape (particles,)."""
        count = self._settings.particles
        reached = np.cumsum(weight)
        marks = (self._draws.random() + np.arange(count)) * (reached[-1] / count)
        parent = np.asarray(np.minimum(np.searchsorted(reached, marks, side="right"), count - 1))
        self._x_m = self._x_m[parent]
        self._y_m = self._y_m[parent]
        self._heading_rad = self._heading_rad[parent]
        return parent

    def _reinitialise(self, lost: IntArray, detections: Detections) -> None:
        """Put each lost particle where one of the detections, at any heading, would put it (Eq. 4)."""
        uniform = self._draws.random((len(lost), 2))
        row = (uniform[:, 0] * len(detections)).astype(np.int64)
        heading_rad = -np.pi + 2.0 * np.pi * uniform[:, 1]
        cos, sin = np.cos(heading_rad), np.sin(heading_rad)
        forward_m, left_m = detections.antenna_m[row].T
        self._x_m[lost] = detections.tag_m[row, 0] - (cos * forward_m - sin * left_m)
        self._y_m[lost] = detections.tag_m[row, 1] - (sin * forward_m + cos * left_m)
        self._heading_rad[lost] = heading_rad


def own_stream(draws: np.random.Generator) -> np.random.Generator:
    """Return a filter's own stream, seeded by ``draws``.

    A filter draws millions of normals; SFC64 gives them at about half the time of the counter-based generator
    that keys the streams of a study.
    """
    return np.random.Generator(np.random.SFC64(draws.integers(0, 2**63, size=4)))
