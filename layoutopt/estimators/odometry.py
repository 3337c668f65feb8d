"""Odometry alone: dead reckoning from the start, the yardstick that every use of tags must beat."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import ClassVar, Final

import numpy as np

from layoutopt.geometry import wrapped
from layoutopt.identity import by_content
from layoutopt.layout import Layout
from layoutopt.protocols import EstimatorCard, FloorKnowledge
from layoutopt.readings import Estimate, Motion, Observations, Prior, Reading, Trajectory
from layoutopt.simulation.motion import compose, integrate

CARD: Final = EstimatorCard(
    summary="Dead reckoning from the known start, without any tag.",
    reference="mi2016, Eq. 1 without its noise term",
    estimates="robot",
    needs="odometry",
)


@by_content
@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class OdometryAlone:
    """Adds up the odometry from the mean of the prior, known or not; it reads no tag, states no covariance."""

    key: str = field(init=False, repr=False, default="")
    card: ClassVar[EstimatorCard] = CARD

    def __post_init__(self) -> None:
        """Nothing to check: there are no settings."""

    @property
    def name(self) -> str:
        """Name in the estimator table."""
        return "odometry"

    def applies(self, layout: Layout) -> str:
        """Return an empty string: odometry works with every layout."""
        return ""

    def start(self, prior: Prior, knowledge: FloorKnowledge, draws: np.random.Generator) -> "DeadReckoning":
        """Return the plain form that works step by step."""
        return DeadReckoning(prior)

    def run(
        self, prior: Prior, knowledge: FloorKnowledge, observations: Observations, draws: np.random.Generator
    ) -> Trajectory:
        """Return the poses of a whole drive."""
        poses = integrate(prior.pose, observations.increments)[1:]
        poses[:, 2] = wrapped(poses[:, 2])
        return Trajectory(poses=poses)


class DeadReckoning:
    """Odometry at work."""

    def __init__(self, prior: Prior) -> None:
        self._pose = np.array(prior.pose)

    def step(self, motion: Motion, readings: Sequence[Reading]) -> Estimate:
        """Add one step of odometry; readings do not count."""
        self._pose = compose(self._pose, (motion.forward_m, motion.left_m, motion.turn_rad))
        x_m, y_m, heading_rad = self._pose
        return Estimate(of="robot", values=(float(x_m), float(y_m), float(wrapped(heading_rad))))
