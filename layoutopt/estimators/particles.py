"""What every particle filter does with its particles: the plain form, and the truth for `particles_kernels`."""

import math
from enum import IntEnum, unique
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from layoutopt.geometry import wrapped
from layoutopt.identity import FloatArray, IntArray, Same
from layoutopt.layout import TagMap
from layoutopt.protocols import FloorKnowledge
from layoutopt.readings import Motion, Prior

_NORMAL_99 = 2.3263478740408408
"""Quantile of the standard normal distribution at 99 %."""


@unique
class Likelihood(IntEnum):
    """How a filter weighs: by the two forms of mi2016's Eq. 6, or by rings that a distance lies within."""

    GAUSSIAN = 0
    COMBINATION = 1
    RINGS = 2


class Settings(NamedTuple):
    """Settings of a compiled filter.

    Attributes
    ----------
    particles, least_particles
        Number of particles at the start and at most, and least number; equal for a fixed number.
    likelihood, log_beta
        A `Likelihood`, and the logarithm of beta of Eq. 6.
    reinitialise, log_alpha, patience
        Particles start anew whose reads have less than this mean log likelihood: of Eq. 6 each for itself, if
        ``reinitialise``; of rings all, once none is left above it in ``patience`` steps with reads running.
    ask_silence
        Whether antennas that read nothing count.
    paired
        Whether a particle that starts anew takes its heading from two reads.
    bin_m, bin_share, kld_error
        Bins of x and y, of cosine and sine, and the bound of the Kullback-Leibler distance that the number of
        particles keeps.
    """

    particles: int
    least_particles: int
    likelihood: int
    log_beta: float
    reinitialise: bool
    log_alpha: float
    patience: int
    ask_silence: bool
    paired: bool
    bin_m: float
    bin_share: float
    kld_error: float


def cloud_at_start(prior: Prior, knowledge: FloorKnowledge, noise: FloatArray, uniform: FloatArray) -> FloatArray:
    """Return particles for what is known of the start, shape (3, n): x, y, heading.

    With an infinite deviation of the place they lie evenly over the bounds of the tag map (over a metre about the
    prior's mean if there is no tag), with an infinite one of the heading in every direction. ``noise``, shape
    (3, n), are standard normals, ``uniform``, shape (3, n), evenly within [0, 1).
    """
    low, high = start_bounds_m(prior, knowledge)
    mean = np.array(prior.pose)[:, None]
    cloud = mean + np.array([[prior.sigma_m], [prior.sigma_m], [prior.sigma_rad]]) * noise
    if math.isinf(prior.sigma_m):
        cloud[:2] = low[:, None] + (high - low)[:, None] * uniform[:2]
    if math.isinf(prior.sigma_rad):
        cloud[2] = math.pi * (2.0 * uniform[2] - 1.0)
    return cloud


def start_bounds_m(prior: Prior, knowledge: FloorKnowledge) -> tuple[FloatArray, FloatArray]:
    """Return the corners of the box in which a robot of unknown place may be, shape (2,) each, m."""
    if len(knowledge.tags) == 0:
        return np.array(prior.pose[:2]) - 0.5, np.array(prior.pose[:2]) + 0.5
    return tag_bounds_m(Same(knowledge.tags))


@lru_cache(maxsize=64)
def tag_bounds_m(tags: Same[TagMap]) -> tuple[FloatArray, FloatArray]:
    """Return the corners of the box about all tags, of which there must be one; looked up once for each map."""
    xy_m = tags.value.xy_m
    return np.asarray(xy_m.min(axis=0)), np.asarray(xy_m.max(axis=0))


def moved(cloud: FloatArray, motion: Motion, sigma: FloatArray, noise: FloatArray) -> FloatArray:
    """Return particles, shape (3, n), after one step of odometry with its noise (mi2016, Eq. 1).

    The noise acts in the particle's own frame before the step; ``sigma``, shape (3,), are its deviations and
    ``noise``, shape (3, n), standard normals.
    """
    forward_m = motion.forward_m + sigma[0] * noise[0]
    left_m = motion.left_m + sigma[1] * noise[1]
    cos, sin = np.cos(cloud[2]), np.sin(cloud[2])
    return np.stack(
        [
            cloud[0] + cos * forward_m - sin * left_m,
            cloud[1] + sin * forward_m + cos * left_m,
            wrapped(cloud[2] + motion.turn_rad + sigma[2] * noise[2]),
        ]
    )


def antenna_places(cloud: FloatArray, antenna_m: FloatArray) -> FloatArray:
    """Return where an antenna, shape (2,), of each particle is on the floor, shape (2, n), m."""
    cos, sin = np.cos(cloud[2]), np.sin(cloud[2])
    return np.stack(
        [
            cloud[0] + cos * antenna_m[0] - sin * antenna_m[1],
            cloud[1] + sin * antenna_m[0] + cos * antenna_m[1],
        ]
    )


def weighted_mean(cloud: FloatArray, weight: FloatArray) -> tuple[tuple[float, float, float], FloatArray]:
    """Return the weighted mean pose (mi2016, Eq. 3; circular in the heading) and the covariance of x and y."""
    total = weight.sum()
    x_m, y_m = float(weight @ cloud[0] / total), float(weight @ cloud[1] / total)
    heading_rad = math.atan2(weight @ np.sin(cloud[2]), weight @ np.cos(cloud[2]))
    away_m = cloud[:2] - np.array([[x_m], [y_m]])
    return (x_m, y_m, heading_rad), np.asarray((away_m * weight) @ away_m.T / total)


def systematic_parents(weight: FloatArray, count: int, uniform: float) -> IntArray:
    """Return the parent of each of ``count`` particles: mark i lies at (uniform + i) / count of the weights' sum.

    References
    ----------
    Carpenter, Clifford, Fearnhead: Improved particle filter for nonlinear problems, IEE Proc. 146(1), 1999.

    Examples
    --------
    >>> systematic_parents(np.array([1.0, 0.0, 3.0]), 4, 0.5).tolist()
    [0, 2, 2, 2]
    """
    reached = np.cumsum(weight)
    marks = (uniform + np.arange(count)) * (reached[-1] / count)
    return np.asarray(np.minimum(np.searchsorted(reached, marks, side="right"), len(weight) - 1), dtype=np.int64)


def kld_particles(bins: int, error: float) -> float:
    """Return how many particles keep the Kullback-Leibler distance to the posterior below ``error``, in 99 of 100.

    References
    ----------
    Fox: Adapting the sample size in particle filters through KLD-sampling, Int. J. Robot. Res. 22, 2003, Eq. 7.

    Examples
    --------
    >>> round(kld_particles(10, 0.05))
    217
    """
    if bins < 2:
        return 1.0
    share = 2.0 / (9.0 * (bins - 1))
    return (bins - 1) / (2.0 * error) * (1.0 - share + math.sqrt(share) * _NORMAL_99) ** 3
