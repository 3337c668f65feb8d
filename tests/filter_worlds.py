"""Small worlds in which tests of particle filters drive: antennas, lattices of tags, and what was read."""

from dataclasses import replace

import numpy as np

from layoutopt.detection import bucket_grid
from layoutopt.layout import TagMap
from layoutopt.protocols import Antennas, FloorKnowledge
from layoutopt.readings import Observations
from layoutopt.simulation.motion import integrate
from layoutopt.simulation.sensing import antenna_centres, compiled_detections

SIGMA = (0.0015, 0.0015, 0.0025)
"""Odometry noise of a step of 5 mm: forward (m), left (m), turn (rad)."""
CROSS_M = np.array([0.1, 0.2])[:, None, None] * np.array([(1, 0), (0, 1), (-1, 0), (0, -1)])
CROSS_M = CROSS_M.reshape(-1, 2)


def tag_map(xy_m, sigma_m=0.0):
    count = len(xy_m)
    return TagMap(
        ids=np.arange(1, count + 1),
        xy_m=np.array(xy_m, dtype=np.float64).reshape(-1, 2),
        tile=np.zeros((count, 2), dtype=np.int64),
        zone=np.full(count, -1),
        sigma_m=np.broadcast_to(np.asarray(sigma_m, dtype=np.float64), count).copy(),
        status=("planned",) * count,
        uid=(None,) * count,
    )


def lattice_m(pitch_m, half_m=1.0, shift_m=(0.013, 0.007)):
    axis_m = np.arange(-half_m, half_m + 1e-9, pitch_m)
    return np.stack(np.meshgrid(axis_m + shift_m[0], axis_m + shift_m[1]), axis=-1).reshape(-1, 2)


def antennas(xy_m=CROSS_M, radius_m=0.03, period=1, one_tag=False):
    """Antennas that scan in turn: antenna i in the steps of phase i modulo the period."""
    count = len(xy_m)
    return Antennas(
        xy_m=np.array(xy_m, dtype=np.float64).reshape(-1, 2),
        height_m=np.full(count, 0.02),
        radius_m=np.broadcast_to(np.asarray(radius_m, dtype=np.float64), count).copy(),
        period_steps=np.full(count, period, dtype=np.int64),
        phase_steps=np.arange(count, dtype=np.int64) % period,
        one_tag=np.full(count, one_tag),
    )


def knowledge(xy_m, carried=None, sigma_m=0.0):
    return FloorKnowledge(tags=tag_map(xy_m, sigma_m), antennas=antennas() if carried is None else carried)


def observations(increments, sigma, active, reads):
    """Observations of reads (step, antenna, tag), sorted here."""
    step, antenna, tag = np.array(sorted(reads), dtype=np.int64).reshape(-1, 3).T
    return Observations(
        step_s=0.05,
        increments=np.array(increments, dtype=np.float64),
        sigma=np.array(sigma, dtype=np.float64),
        read_start=np.searchsorted(step, np.arange(len(increments) + 1)).astype(np.int64),
        read_antenna=np.ascontiguousarray(antenna),
        read_tag=np.ascontiguousarray(tag),
        active=np.array(active, dtype=np.bool_),
    )


def drive(draws, known, steps, *, missed=0.0, wrong=0.0, unknown=0.0, sigma=SIGMA, way_m=0.005, kidnapped=None):
    """Return the true poses, shape (steps + 1, 3), and what a robot is told of its drive.

    It drives a circle of 0.5 m about the origin from a random place on it. ``missed`` scans bring nothing,
    ``wrong`` reads name another tag and ``unknown`` ones none that the map holds. Lifted after step ``kidnapped``
    it goes on elsewhere.
    """
    turn_rad = way_m / 0.5
    true = np.tile([way_m, 0.0, turn_rad], (steps, 1))

    def path(count):
        angle_rad = draws.uniform(-np.pi, np.pi)
        start = (0.5 * np.cos(angle_rad), 0.5 * np.sin(angle_rad), angle_rad + np.pi / 2)
        return integrate(start, true[:count])

    poses = path(steps)
    if kidnapped is not None:
        poses[kidnapped + 1 :] = path(steps - kidnapped)[1:]
    carried = known.antennas
    active = np.arange(steps)[:, None] % carried.period_steps == carried.phase_steps
    centre_m = antenna_centres(poses[1:], carried)
    grid = bucket_grid(known.tags.xy_m, float(carried.radius_m.max()))
    step, antenna, tag = compiled_detections(centre_m, active, carried.radius_m, grid)
    scan = step * len(carried) + antenna
    alone = np.bincount(scan, minlength=steps * len(carried))[scan] == 1
    seen = (alone | ~carried.one_tag[antenna]) & (draws.random(steps * len(carried))[scan] >= missed)
    step, antenna, tag = step[seen], antenna[seen], tag[seen]
    tag = np.where(draws.random(len(tag)) < wrong, draws.integers(0, len(known.tags), len(tag)), tag)
    tag = np.where(draws.random(len(tag)) < unknown, -1, tag)
    noisy = true + np.array(sigma) * draws.standard_normal(true.shape)
    told = observations(noisy, np.tile(sigma, (steps, 1)), active, zip(step, antenna, tag, strict=True))
    return poses, told


def without_reads(told):
    return replace(
        told,
        read_start=np.zeros_like(told.read_start),
        read_antenna=told.read_antenna[:0],
        read_tag=told.read_tag[:0],
    )


def by_steps(estimator, prior, known, told, seed):
    """Return the estimates of the plain form, step by step."""
    running = estimator.start(prior, known, np.random.default_rng(seed))
    return [running.step(motion, readings) for motion, readings in told.steps()]


def errors(poses, true):
    """Return position errors (m) and absolute heading errors (rad) of poses, shape (n, 3) each."""
    off = poses - true
    return np.hypot(off[:, 0], off[:, 1]), np.abs(np.angle(np.exp(1j * off[:, 2])))
