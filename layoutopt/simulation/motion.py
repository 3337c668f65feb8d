"""How a robot moves along its route, and what its wheels and its gyro make of it.

A step of motion is (forward, left, turn) in the robot's frame; the translation is taken in the heading before
the turn. Everybody who adds up odometry uses `compose` or `integrate`, so that true increments give back the
true poses exactly.
"""

import math
from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike

from layoutopt.geometry import wrapped
from layoutopt.identity import FloatArray, read_only
from layoutopt.robot import Drive as DriveKind
from layoutopt.robot import Gyro, Robot
from layoutopt.scenario import Faults, Routes, Scenario
from layoutopt.simulation.routes import Route, route
from layoutopt.streams import Purpose, Streams


@dataclass(frozen=True, slots=True, kw_only=True)
class Drive:
    """One simulated drive of n steps.

    Attributes
    ----------
    poses
        True x, y (m) and heading (rad, continuous, not wrapped) before the first step and after each, shape
        (n + 1, 3).
    increments
        What the robot says of each step: forward (m), left (m) and turn (rad) in its frame, with noise, shape
        (n, 3).
    sigma
        Standard deviations of that noise as far as the robot knows them, shape (n, 3): slips are not in them.
    gyro_turn_rad, gyro_sigma_rad
        Turn of each step by the gyro alone, and its standard deviation as `Gyro.sigma` states it, shape (n,).
    """

    poses: FloatArray
    increments: FloatArray
    sigma: FloatArray
    gyro_turn_rad: FloatArray
    gyro_sigma_rad: FloatArray


@lru_cache(maxsize=256)
def drive(scenario: Scenario, streams: Streams, replication: int) -> Drive:
    """Return the drive of one replication, the same for every layout.

    The robot drives at its speed. A differential drive turns on the spot at each corner; an omnidirectional one
    goes on while it turns, with the same turn rate, towards its direction of travel; on a circle both follow
    the tangent. An omnidirectional robot may keep one heading instead. Every step lasts ``scenario.step_s``; at a
    corner its time is split. A kidnapped robot goes on along another route, of which wheels and gyro say nothing:
    in the air they are not read.

    Wheels err by the deviations of `Odometry`, and by slips that they do not know of. The gyro errs by its random
    walk and by a bias that is drawn once for the trial. Where it is fitted, the turn is the mean of both, each
    weighted by the inverse of the variance that it states.

    Raises
    ------
    InvalidInput
        If there is no such route (`layoutopt.simulation.routes.route`).
    """
    robot, step_s = scenario.robot, scenario.step_s
    draws = streams.generator(scenario.name, replication, Purpose.ROUTE)
    times_s = np.arange(scenario.step_count + 1, dtype=np.float64) * step_s
    poses = _route_poses(scenario, draws, times_s)
    true = increments_between(poses)
    before = scenario.lifted_after
    if before is not None:
        # Lifted between two steps and put down at the start of another route; wheels in the air count nothing.
        after = _route_poses(scenario, draws, times_s[: len(times_s) - before])
        poses = np.concatenate([poses[: before + 1], after[1:]])
        true = np.concatenate([true[:before], increments_between(after)])
    sigma = robot.odometry.sigma(true, step_s)
    noise = streams.generator(scenario.name, replication, Purpose.ODOMETRY).standard_normal(true.shape)
    increments = true + sigma * noise
    if scenario.faults.slips_per_m > 0.0 and scenario.faults.slip_sigma_m > 0.0:
        slips = streams.generator(scenario.name, replication, Purpose.SLIP)
        increments[:, 0] += _slipped_m(robot.odometry.way_m(true), scenario.faults, slips)
    of_gyro = streams.generator(scenario.name, replication, Purpose.GYRO)
    gyro_turn_rad = true[:, 2] + _gyro_error_rad(robot.gyro, len(true), step_s, of_gyro)
    gyro_sigma_rad = np.full(len(true), robot.gyro.sigma(step_s))
    if robot.gyro_fitted:
        increments[:, 2], sigma[:, 2] = _weighted_mean(
            increments[:, 2], sigma[:, 2], gyro_turn_rad, gyro_sigma_rad
        )
    return Drive(
        poses=read_only(poses),
        increments=read_only(increments),
        sigma=read_only(sigma),
        gyro_turn_rad=read_only(gyro_turn_rad),
        gyro_sigma_rad=read_only(gyro_sigma_rad),
    )


def compose(pose: ArrayLike, increments: ArrayLike) -> FloatArray:
    """Return poses after one step each: translation in the heading before the turn, then the turn.

    ``x' = x + cos(h) f - sin(h) l``, ``y' = y + sin(h) f + cos(h) l``, ``h' = h + turn``. Both arguments have
    shape (..., 3) and are broadcast against each other.

    Examples
    --------
    >>> compose([1.0, 2.0, 0.0], [0.5, 0.25, 0.1]).tolist()
    [1.5, 2.25, 0.1]
    """
    before, step = np.broadcast_arrays(
        np.asarray(pose, dtype=np.float64), np.asarray(increments, dtype=np.float64)
    )
    cos, sin = np.cos(before[..., 2]), np.sin(before[..., 2])
    forward_m, left_m, turn_rad = step[..., 0], step[..., 1], step[..., 2]
    return np.stack(
        [
            before[..., 0] + cos * forward_m - sin * left_m,
            before[..., 1] + sin * forward_m + cos * left_m,
            before[..., 2] + turn_rad,
        ],
        axis=-1,
    )


def integrate(start_pose: ArrayLike, increments: FloatArray) -> FloatArray:
    """Return the poses that follow from a start, shape (3,), and increments, shape (n, 3): shape (n + 1, 3).

    The same as `compose` step after step; headings are not wrapped.
    """
    x_m, y_m, start_rad = (float(value) for value in np.asarray(start_pose, dtype=np.float64))
    heading_rad = np.concatenate([[start_rad], start_rad + np.cumsum(increments[:, 2])])
    cos, sin = np.cos(heading_rad[:-1]), np.sin(heading_rad[:-1])
    east_m = np.cumsum(cos * increments[:, 0] - sin * increments[:, 1])
    north_m = np.cumsum(sin * increments[:, 0] + cos * increments[:, 1])
    return np.stack(
        [np.concatenate([[x_m], x_m + east_m]), np.concatenate([[y_m], y_m + north_m]), heading_rad], axis=1
    )


def increments_between(poses: FloatArray) -> FloatArray:
    """Return the true increments between successive poses, shape (n + 1, 3): the inverse of `integrate`."""
    cos, sin = np.cos(poses[:-1, 2]), np.sin(poses[:-1, 2])
    moved = np.diff(poses, axis=0)
    return np.stack(
        [cos * moved[:, 0] + sin * moved[:, 1], cos * moved[:, 1] - sin * moved[:, 0], moved[:, 2]], axis=1
    )


def _slipped_m(way_m: FloatArray, faults: Faults, draws: np.random.Generator) -> FloatArray:
    """Return what slips add to the forward way of each step, given the way of a wheel, shape (n,)."""
    count = draws.poisson(faults.slips_per_m * way_m)
    # The sum of several slips of one step is as normal as each of them.
    return np.asarray(faults.slip_sigma_m * np.sqrt(count) * draws.standard_normal(len(way_m)))


def _gyro_error_rad(gyro: Gyro, steps: int, step_s: float, draws: np.random.Generator) -> FloatArray:
    """Return the error of each step's turn, shape (steps,): one bias for all, and noise for each."""
    bias_rad_s = gyro.bias_sigma_rad_s * draws.standard_normal()
    noise = draws.standard_normal(steps)
    return np.asarray(bias_rad_s * step_s + gyro.random_walk_rad_per_sqrt_s * math.sqrt(step_s) * noise)


def _weighted_mean(
    first: FloatArray, first_sigma: FloatArray, second: FloatArray, second_sigma: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return the means weighted by inverse variance, and their deviations; what has no deviation is believed."""
    total = first_sigma**2 + second_sigma**2
    share = np.divide(first_sigma**2, total, out=np.zeros_like(total), where=total > 0.0)
    return first + share * (second - first), np.sqrt(share) * second_sigma


def _route_poses(scenario: Scenario, draws: np.random.Generator, times_s: FloatArray) -> FloatArray:
    return _poses(route(scenario, draws), scenario.robot, scenario.routes, times_s)


def _poses(way: Route, robot: Robot, routes: Routes, times_s: FloatArray) -> FloatArray:
    """Return poses at the times of a robot that follows the way, shape (len(times_s), 3).

    Position and heading are piecewise linear in time, so each is read off between its own knots.
    """
    legs_m = np.diff(way.line_m, axis=0)
    legs_s = np.hypot(legs_m[:, 0], legs_m[:, 1]) / robot.speed_m_s
    direction_rad = np.unwrap(np.arctan2(legs_m[:, 1], legs_m[:, 0]))
    pauses_s = np.where(way.stops[:-1], routes.pause_s, 0.0)
    turns_s = np.zeros(len(legs_s))
    looks_ahead = routes.heading_rad is None and routes.kind != "circle"
    if looks_ahead and robot.drive is DriveKind.DIFFERENTIAL:
        turns_s[1:] = np.abs(np.diff(direction_rad)) / robot.turn_rate_rad_s
    if not pauses_s.any() and not turns_s.any():
        # It never stands, so each corner has one moment.
        arrived_s = np.cumsum(legs_s)
        stood_s = turned_s = np.concatenate([[0.0], arrived_s[:-1]])
        at_s, corners_m = np.concatenate([[0.0], arrived_s]), way.line_m
    else:
        # At each corner the robot stands, turns if it must, and goes on to the next.
        stood_s, turned_s, arrived_s = np.cumsum(np.stack([pauses_s, turns_s, legs_s], axis=1)).reshape(-1, 3).T
        at_s = np.stack([turned_s, arrived_s], axis=1).ravel()
        corners_m = np.stack([way.line_m[:-1], way.line_m[1:]], axis=1).reshape(-1, 2)
    if routes.heading_rad is not None:
        turn_s, heading_rad = np.zeros(1), np.array([routes.heading_rad])
    elif not looks_ahead:
        turn_s = np.concatenate([[0.0], arrived_s])
        half_rad = np.diff(direction_rad) / 2.0
        # Between two chords the tangent is halfway; the ends go on as their neighbours.
        heading_rad = np.concatenate(
            [[direction_rad[0] - half_rad[0]], direction_rad[:-1] + half_rad, [direction_rad[-1] + half_rad[-1]]]
        )
    elif robot.drive is DriveKind.DIFFERENTIAL:
        turn_s = np.stack([turned_s, np.append(stood_s[1:], arrived_s[-1])], axis=1).ravel()
        heading_rad = np.repeat(direction_rad, 2)
    else:
        turn_s, heading_rad = _turns_under_way(turned_s, arrived_s, direction_rad, robot.turn_rate_rad_s)
    return np.stack(
        [
            np.interp(times_s, at_s, corners_m[:, 0]),
            np.interp(times_s, at_s, corners_m[:, 1]),
            np.interp(times_s, turn_s, heading_rad),
        ],
        axis=1,
    )


def _turns_under_way(
    starts_s: FloatArray, ends_s: FloatArray, direction_rad: FloatArray, turn_rate_rad_s: float
) -> tuple[FloatArray, FloatArray]:
    """Return the knots of a heading that on each leg turns the shorter way towards the leg's direction."""
    knots_s, headings_rad = [0.0], [float(direction_rad[0])]
    for start_s, end_s, target_rad in zip(starts_s, ends_s, direction_rad, strict=True):
        heading_rad = headings_rad[-1]
        missing_rad = float(wrapped(target_rad - heading_rad))
        needed_s = abs(missing_rad) / turn_rate_rad_s
        turned_s = min(needed_s, float(end_s - start_s))
        share = turned_s / needed_s if needed_s > 0.0 else 0.0
        knots_s += [float(start_s), float(start_s) + turned_s, float(end_s)]
        headings_rad += [heading_rad, heading_rad + share * missing_rad, heading_rad + share * missing_rad]
    return np.array(knots_s), np.array(headings_rad)
