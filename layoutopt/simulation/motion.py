"""How a robot moves along its route, and what its odometry makes of it.

A step of motion is (forward, left, turn) in the robot's frame; the translation is taken in the heading before
the turn. Everybody who adds up odometry uses `compose` or `integrate`, so that true increments give back the
true poses exactly.
"""

from dataclasses import dataclass
from functools import lru_cache

import numpy as np
from numpy.typing import ArrayLike

from layoutopt.geometry import wrapped
from layoutopt.identity import FloatArray, read_only
from layoutopt.robot import Drive as DriveKind
from layoutopt.robot import Robot
from layoutopt.scenario import Scenario
from layoutopt.simulation.routes import path
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
        What the odometry says of each step: forward (m), left (m) and turn (rad) in the robot's frame, with
        noise, shape (n, 3).
    sigma
        Standard deviations of that noise, shape (n, 3).
    """

    poses: FloatArray
    increments: FloatArray
    sigma: FloatArray


@lru_cache(maxsize=256)
def drive(scenario: Scenario, streams: Streams, replication: int) -> Drive:
    """Return the drive of one replication, the same for every layout.

    The robot drives at its speed. A differential drive turns on the spot at each corner; an omnidirectional one
    goes on while it turns, with the same turn rate, towards its direction of travel; on a circle both follow
    the tangent. Every step lasts ``scenario.step_s``; at a corner its time is split. A kidnapped robot goes on
    along another route, of which its odometry says nothing.

    Raises
    ------
    InvalidInput
        If there is no such route (`layoutopt.simulation.routes.path`).
    """
    draws = streams.generator(scenario.name, replication, Purpose.ROUTE)
    times_s = np.arange(scenario.step_count + 1, dtype=np.float64) * scenario.step_s
    poses = _route_poses(scenario, draws, times_s)
    true = increments_between(poses)
    kidnapped_at_s = scenario.faults.kidnapped_at_s
    if kidnapped_at_s is not None and kidnapped_at_s < scenario.duration_s:
        # Lifted between two steps and put down at the start of another route; wheels in the air count nothing.
        before = int(np.searchsorted(times_s, kidnapped_at_s))
        after = _route_poses(scenario, draws, times_s[: len(times_s) - before])
        poses = np.concatenate([poses[: before + 1], after[1:]])
        true = np.concatenate([true[:before], increments_between(after)])
    sigma = scenario.robot.odometry.sigma(true)
    noise = streams.generator(scenario.name, replication, Purpose.ODOMETRY).standard_normal(true.shape)
    return Drive(poses=read_only(poses), increments=read_only(true + sigma * noise), sigma=read_only(sigma))


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


def _route_poses(scenario: Scenario, draws: np.random.Generator, times_s: FloatArray) -> FloatArray:
    line_m = path(scenario, draws)
    return _poses(line_m, scenario.robot, times_s, tangent=scenario.routes.kind == "circle")


def _poses(line_m: FloatArray, robot: Robot, times_s: FloatArray, *, tangent: bool) -> FloatArray:
    """Return poses at the times of a robot that follows the line, shape (len(times_s), 3).

    Position and heading are piecewise linear in time, so each is read off between its own knots.
    """
    legs_m = np.diff(line_m, axis=0)
    legs_s = np.hypot(legs_m[:, 0], legs_m[:, 1]) / robot.speed_m_s
    direction_rad = np.unwrap(np.arctan2(legs_m[:, 1], legs_m[:, 0]))
    if tangent:
        at_s, corners_m = np.concatenate([[0.0], np.cumsum(legs_s)]), line_m
        turn_s = at_s
        half_rad = np.diff(direction_rad) / 2.0
        # Between two chords the tangent is halfway; the ends go on as their neighbours.
        heading_rad = np.concatenate(
            [[direction_rad[0] - half_rad[0]], direction_rad[:-1] + half_rad, [direction_rad[-1] + half_rad[-1]]]
        )
    elif robot.drive is DriveKind.DIFFERENTIAL:
        turns_s = np.abs(np.diff(direction_rad)) / robot.turn_rate_rad_s
        # A leg, a turn, a leg, a turn: two knots at each corner, arrival and departure.
        spans_s = np.zeros(2 * len(legs_s) - 1)
        spans_s[0::2], spans_s[1::2] = legs_s, turns_s
        at_s = turn_s = np.concatenate([[0.0], np.cumsum(spans_s)])
        corners_m = np.concatenate([line_m[:1], np.repeat(line_m[1:-1], 2, axis=0), line_m[-1:]])
        heading_rad = np.repeat(direction_rad, 2)
    else:
        at_s, corners_m = np.concatenate([[0.0], np.cumsum(legs_s)]), line_m
        turn_s, heading_rad = _turns_under_way(at_s, direction_rad, robot.turn_rate_rad_s)
    return np.stack(
        [
            np.interp(times_s, at_s, corners_m[:, 0]),
            np.interp(times_s, at_s, corners_m[:, 1]),
            np.interp(times_s, turn_s, heading_rad),
        ],
        axis=1,
    )


def _turns_under_way(
    at_s: FloatArray, direction_rad: FloatArray, turn_rate_rad_s: float
) -> tuple[FloatArray, FloatArray]:
    """Return the knots of a heading that always turns the shorter way towards the present leg's direction."""
    knots_s, headings_rad = [0.0], [float(direction_rad[0])]
    for start_s, end_s, target_rad in zip(at_s[:-1], at_s[1:], direction_rad, strict=True):
        heading_rad = headings_rad[-1]
        missing_rad = float(wrapped(target_rad - heading_rad))
        needed_s = abs(missing_rad) / turn_rate_rad_s
        turned_s = min(needed_s, float(end_s - start_s))
        share = turned_s / needed_s if needed_s > 0.0 else 0.0
        knots_s += [float(start_s) + turned_s, float(end_s)]
        headings_rad += [heading_rad + share * missing_rad] * 2
    return np.array(knots_s), np.array(headings_rad)
