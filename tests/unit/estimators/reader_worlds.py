"""Drives of a robot with one antenna over a few tags, for tests of the estimators of one reader."""

import numpy as np
from filter_worlds import antennas, knowledge, observations

from layoutopt.simulation.motion import integrate
from layoutopt.simulation.sensing import antenna_centres

AHEAD, LEFT, BACK, RIGHT = (0.01, 0.0, 0.0), (0.0, 0.01, 0.0), (-0.01, 0.0, 0.0), (0.0, -0.01, 0.0)
"""Steps of 10 mm in each direction."""


def one_antenna(xy_m, radius_m=0.1, lever_m=(0.0, 0.0), period=1):
    """Return tags and one antenna, which scans in every so many steps."""
    return knowledge(xy_m, antennas(np.array([lever_m]), radius_m, period))


def grid_m(pitch_m, half_m):
    """Return tags on a square about the origin."""
    count = round(half_m / pitch_m)
    side_m = np.arange(-count, count + 1) * pitch_m
    return np.stack(np.meshgrid(side_m, side_m), axis=-1).reshape(-1, 2)


def driven(known, start, increments, sigma=1e-6, told=None):
    """Return the true poses after each step, and what the robot is told: reads, and steps, true by default."""
    increments = np.array(increments, dtype=np.float64).reshape(-1, 3)
    count, carried = len(increments), known.antennas
    poses = integrate(start, increments)[1:]
    centre_m = antenna_centres(poses, carried)[:, 0]
    active = np.arange(count)[:, None] % carried.period_steps == carried.phase_steps
    near = np.hypot(*(centre_m[:, None] - known.tags.xy_m).transpose(2, 0, 1)) < carried.radius_m[0]
    reads = [(step, 0, tag) for step, tag in np.argwhere(near & active)]
    return poses, observations(
        increments if told is None else told, np.broadcast_to(sigma, (count, 3)), active, reads
    )
