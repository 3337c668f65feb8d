"""A filter that assumes motion noise by the clock, whatever its odometry says of itself."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import ClassVar

import numpy as np

from layoutopt.identity import by_content
from layoutopt.protocols import Estimator, EstimatorCard, FloorKnowledge, RunningEstimator
from layoutopt.readings import Estimate, Motion, Observations, Prior, Reading, Trajectory
from studies.published.before_another import BeforeAnother
from studies.published.mi2016_setting import STEP_S

CARD = EstimatorCard(
    summary="Another estimator that is told the motion noise of mi2016, Eq. 1, in place of the odometry's own.",
    reference="mi2016, Eq. 1",
    estimates="robot",
    needs="tag_read",
    states_covariance=True,
)


@by_content
@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class TimedNoise(BeforeAnother):
    """An estimator that believes its motion to be uncertain by so much in every step, also at rest.

    In Eq. 1 the noise of a step is ε Δt whatever the robot did. A robot that stands has wheels that do not
    turn, so its odometry is exact; the filter of the paper is uncertain all the same, which keeps its particles
    apart.

    Attributes
    ----------
    translation_m_s, rotation_rad_s
        σ of Eq. 1 for x and y, and for the heading.
    """

    inner: Estimator
    translation_m_s: float
    rotation_rad_s: float
    key: str = field(init=False, repr=False, default="")
    card: ClassVar[EstimatorCard] = CARD

    def __post_init__(self) -> None:
        """Check the deviations."""
        if not (self.translation_m_s >= 0.0 and self.rotation_rad_s >= 0.0):
            raise ValueError("standard deviations must not be negative")

    def start(self, prior: Prior, knowledge: FloorKnowledge, draws: np.random.Generator) -> RunningEstimator:
        """Return the estimator at work; a step takes as long as a scan, 50 ms."""
        return _Running(self, self.inner.start(prior, knowledge, draws))

    def run(
        self, prior: Prior, knowledge: FloorKnowledge, observations: Observations, draws: np.random.Generator
    ) -> Trajectory:
        """Return the estimates of a whole drive."""
        sigma = np.broadcast_to(self.sigma(observations.step_s), observations.sigma.shape).copy()
        return self.inner.run(prior, knowledge, replace(observations, sigma=sigma), draws)

    def sigma(self, step_s: float) -> tuple[float, float, float]:
        """Return the standard deviations of a step: forward m, left m, turn rad."""
        along_m = self.translation_m_s * step_s
        return (along_m, along_m, self.rotation_rad_s * step_s)


class _Running:
    """The estimator within at work, told other deviations."""

    def __init__(self, settings: TimedNoise, inner: RunningEstimator) -> None:
        self._sigma = settings.sigma(STEP_S)
        self._inner = inner

    def step(self, motion: Motion, readings: Sequence[Reading]) -> Estimate:
        """Take one step of odometry with the deviations of Eq. 1."""
        return self._inner.step(replace(motion, sigma=self._sigma), readings)
