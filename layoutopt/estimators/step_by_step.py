"""Whole drives of estimators that have no faster form than one step after the other."""

import numpy as np

from layoutopt.protocols import RunningEstimator
from layoutopt.readings import Observations, Trajectory


def step_by_step(running: RunningEstimator, observations: Observations) -> Trajectory:
    """Return the poses that an estimator of the robot gives when it is told a drive step by step."""
    poses = [running.step(motion, readings).values for motion, readings in observations.steps()]
    return Trajectory(poses=np.array(poses).reshape(-1, 3))
