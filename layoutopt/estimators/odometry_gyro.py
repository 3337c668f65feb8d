"""Odometry with a gyro: the way from the wheels, the heading from the gyro alone.

It is the better yardstick where wheels slip in turns, and the worse one where the gyro's bias is large; beside
plain odometry it answers whether floor tags are needed at all.
"""

import dataclasses
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import ClassVar, Final

import numpy as np

from layoutopt.errors import InvalidInput
from layoutopt.estimators.odometry import DeadReckoning
from layoutopt.geometry import wrapped
from layoutopt.identity import by_content
from layoutopt.layout import Layout
from layoutopt.protocols import EstimatorCard, FloorKnowledge
from layoutopt.readings import Estimate, Motion, Observations, Prior, Reading, Trajectory
from layoutopt.simulation.motion import integrate

CARD: Final = EstimatorCard(
    summary="Dead reckoning with the way of the wheels and the turn of a gyro, without any tag.",
    reference="mi2016, Eq. 1 without its noise term; the gyro is ours",
    estimates="robot",
    needs="odometry",
)


@by_content
@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class OdometryWithGyro:
    """Adds up the ways of the wheels along the heading of the gyro, from the mean of the prior, known or not.

    It reads no tag and states no covariance. The wheels' own turn does not count, even where the robot fits it to
    the gyro.
    """

    key: str = field(init=False, repr=False, default="")
    card: ClassVar[EstimatorCard] = CARD

    def __post_init__(self) -> None:
        """Nothing to check: there are no settings."""

    @property
    def name(self) -> str:
        """Name in the estimator table."""
        return "odometry_gyro"

    def applies(self, layout: Layout) -> str:
        """Return an empty string: odometry works with every layout."""
        return ""

    def start(self, prior: Prior, knowledge: FloorKnowledge, draws: np.random.Generator) -> "GyroReckoning":
        """Return the plain form that works step by step."""
        return GyroReckoning(prior)

    def run(
        self, prior: Prior, knowledge: FloorKnowledge, observations: Observations, draws: np.random.Generator
    ) -> Trajectory:
        """Return the poses of a whole drive.

        Raises
        ------
        InvalidInput
            If the drive has no gyro.
        """
        if not np.isfinite(observations.gyro_sigma_rad).all():
            raise _no_gyro()
        increments = np.column_stack([observations.increments[:, :2], observations.gyro_turn_rad])
        poses = integrate(prior.pose, increments)[1:]
        poses[:, 2] = wrapped(poses[:, 2])
        return Trajectory(poses=poses)


class GyroReckoning:
    """Odometry with a gyro at work."""

    def __init__(self, prior: Prior) -> None:
        self._wheels = DeadReckoning(prior)

    def step(self, motion: Motion, readings: Sequence[Reading]) -> Estimate:
        """Add one step; readings do not count.

        Raises
        ------
        InvalidInput
            If the step has no gyro.
        """
        if not np.isfinite(motion.gyro_sigma_rad):
            raise _no_gyro()
        return self._wheels.step(dataclasses.replace(motion, turn_rad=motion.gyro_turn_rad), readings)


def _no_gyro() -> InvalidInput:
    return InvalidInput.at(
        "estimator 'odometry_gyro'", "the drive has no gyro", "Use 'odometry', which takes the turn of the wheels."
    )
