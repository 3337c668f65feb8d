"""Monte Carlo localisation in plain numpy, in the parts that every peer needs of its user, and what a worker says.

A peer gets the same motion, likelihood, re-initialisation and estimate; what differs is its own loop, state,
weights and resampling. Particles are columns x, y, heading and the logarithm of their last likelihood: the test of
re-initialisation needs that of the parent, and no peer hands it on after resampling.

A worker is started with a drive (``.npz``) and a number of particles. It says when it is ready; then each line on
its standard input is a seed, which it answers with the seconds of one whole drive and the error.
"""

import json
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

FloatArray = NDArray[np.float64]

ALPHA = 0.01
WARM_UP_STEPS = 30


@dataclass(frozen=True)
class Detections:
    """The reads of a step: antennas in the robot's frame, tags on the floor, shape (n, 2), and radii, (n,), m."""

    antenna_m: FloatArray
    tag_m: FloatArray
    radius_m: FloatArray

    def __len__(self) -> int:
        """Return the number of reads."""
        return len(self.radius_m)


@dataclass(frozen=True)
class Drive:
    """Odometry with its standard deviations, truth, shape (n, 3), prior, (5,), and the reads of each step."""

    increments: FloatArray
    sigma: FloatArray
    prior: FloatArray
    truth: FloatArray
    detections: tuple[Detections, ...]

    def __len__(self) -> int:
        """Return the number of steps."""
        return len(self.increments)

    def first(self, count: int) -> "Drive":
        """Return the first steps of the drive."""
        return Drive(
            self.increments[:count], self.sigma[:count], self.prior, self.truth[:count], self.detections[:count]
        )

    def errors(self, poses: FloatArray) -> tuple[float, float]:
        """Return the mean errors of position, m, and heading, rad, over the second half."""
        off = (poses - self.truth)[len(self) // 2 :]
        turn = np.abs((off[:, 2] + np.pi) % (2.0 * np.pi) - np.pi)
        return float(np.hypot(off[:, 0], off[:, 1]).mean()), float(turn.mean())


Run = Callable[[Drive, int, int], FloatArray]
"""Takes a drive, the number of particles and a seed; returns the estimated poses, shape (n, 3)."""


def read_drive(path: Path) -> Drive:
    """Return the drive that a benchmark wrote."""
    with np.load(path) as file:
        columns = dict(file)
    bounds = zip(columns["start"][:-1], columns["start"][1:], strict=True)
    return Drive(
        increments=columns["increments"],
        sigma=columns["sigma"],
        prior=columns["prior"],
        truth=columns["truth"],
        detections=tuple(
            Detections(*(columns[name][first:last] for name in ("antenna_m", "tag_m", "radius_m")))
            for first, last in bounds
        ),
    )


def initial(drive: Drive, count: int, draws: np.random.Generator) -> FloatArray:
    """Return particles drawn from the prior, shape (4, count)."""
    particles = np.zeros((4, count))
    particles[:3] = drive.prior[:3, None] + drive.prior[[3, 3, 4], None] * draws.standard_normal((3, count))
    return particles


def moved(
    particles: FloatArray, increment: FloatArray, sigma: FloatArray, draws: np.random.Generator
) -> FloatArray:
    """Return the particles after one step of odometry with noise in each particle's own frame (mi2016, Eq. 1)."""
    x_m, y_m, heading_rad, _ = particles
    forward_m, left_m, turn_rad = increment[:, None] + sigma[:, None] * draws.standard_normal((3, len(x_m)))
    cos, sin = np.cos(heading_rad), np.sin(heading_rad)
    after = np.zeros_like(particles)
    after[0] = x_m + cos * forward_m - sin * left_m
    after[1] = y_m + sin * forward_m + cos * left_m
    after[2] = heading_rad + turn_rad
    return after


def log_likelihood(particles: FloatArray, detections: Detections) -> FloatArray:
    """Return the log likelihood of all reads of a step for each particle (Eq. 6).

    Flat to the radius, then a Gaussian whose width is the radius too; beta is 1.
    """
    x_m, y_m, heading_rad, _ = particles
    cos, sin = np.cos(heading_rad), np.sin(heading_rad)
    forward_m, left_m = detections.antenna_m.T[:, :, None]
    tag_x_m, tag_y_m = detections.tag_m.T[:, :, None]
    away_x_m = x_m + cos * forward_m - sin * left_m - tag_x_m
    away_y_m = y_m + sin * forward_m + cos * left_m - tag_y_m
    exponent = (away_x_m**2 + away_y_m**2) / (2.0 * detections.radius_m**2)[:, None]
    return -np.where(exponent < 0.5, 0.0, exponent).sum(axis=0)


def estimate(particles: FloatArray, weight: FloatArray) -> FloatArray:
    """Return the weighted mean pose (Eq. 3), the heading as a circular mean; weights sum to any number."""
    x_m, y_m, heading_rad, _ = particles
    heading = np.arctan2(weight @ np.sin(heading_rad), weight @ np.cos(heading_rad))
    return np.array([weight @ x_m, weight @ y_m, heading * weight.sum()]) / weight.sum()


def reinitialise(particles: FloatArray, detections: Detections, draws: np.random.Generator) -> None:
    """Put each particle whose likelihood, as a geometric mean per read, is below alpha where a read would put it.

    ``particles`` are those drawn by resampling, changed in place; their last row is the likelihood of the parent.
    """
    lost = np.flatnonzero(particles[3] < len(detections) * np.log(ALPHA))
    if len(lost) == 0:
        return
    row = draws.integers(len(detections), size=len(lost))
    heading_rad = draws.uniform(-np.pi, np.pi, len(lost))
    cos, sin = np.cos(heading_rad), np.sin(heading_rad)
    forward_m, left_m = detections.antenna_m[row].T
    particles[0, lost] = detections.tag_m[row, 0] - (cos * forward_m - sin * left_m)
    particles[1, lost] = detections.tag_m[row, 1] - (sin * forward_m + cos * left_m)
    particles[2, lost] = heading_rad


def serve(run: Run, version: str) -> None:
    """Answer seeds with times and errors until the standard input ends."""
    drive, count = read_drive(Path(sys.argv[1])), int(sys.argv[2])
    run(drive.first(WARM_UP_STEPS), count, 0)
    print(json.dumps({"ready": version, "numpy": np.__version__}), flush=True)
    for line in sys.stdin:
        begin = time.perf_counter()
        poses = run(drive, count, int(line))
        taken_s = time.perf_counter() - begin
        error_m, error_rad = drive.errors(poses)
        print(json.dumps({"seconds": taken_s, "error_m": error_m, "error_rad": error_rad}), flush=True)
