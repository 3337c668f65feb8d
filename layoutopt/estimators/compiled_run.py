"""The bridge from estimators to the compiled filter: columns in, a trajectory out."""

import numpy as np

from layoutopt.estimators.counter_normals import key_words
from layoutopt.estimators.evidence import Constraints, Floor
from layoutopt.estimators.particles import Settings, start_bounds_m
from layoutopt.identity import FloatArray
from layoutopt.protocols import FloorKnowledge
from layoutopt.readings import Prior, Trajectory


def compiled_run(
    settings: Settings,
    prior: Prior,
    knowledge: FloorKnowledge,
    draws: np.random.Generator,
    *,
    increments: FloatArray,
    sigma: FloatArray,
    origin_m: FloatArray,
    constraints: Constraints,
    floor: Floor,
) -> Trajectory:
    """Return the estimates of a whole drive.

    ``increments`` and ``sigma``, shape (steps, 3), are odometry and the deviations that the particles get;
    ``origin_m``, shape (2,), is from where the places of constraints and floor count.
    """
    from layoutopt.estimators.mcl_kernels import localise

    steps = len(increments)
    poses, covariance = np.empty((steps, 3)), np.empty((steps, 2, 2))
    lost, log_evidence = np.empty(steps, dtype=np.bool_), np.empty(steps)
    localise(
        key_words(draws),
        settings,
        np.array([*prior.pose, prior.sigma_m, prior.sigma_rad]),
        np.array(start_bounds_m(prior, knowledge)),
        origin_m,
        np.array(increments, dtype=np.float64, order="C"),
        np.array(sigma, dtype=np.float64, order="C"),
        constraints,
        floor,
        poses,
        covariance,
        lost,
        log_evidence,
    )
    return Trajectory(poses=poses, covariance=covariance, lost=lost, log_evidence=log_evidence)
