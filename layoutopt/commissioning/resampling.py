"""A logged drive on the time step of a layout: poses are read off between rows, reads go to their step."""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np

from layoutopt.commissioning.drive_log import DriveLog
from layoutopt.errors import InvalidInput
from layoutopt.identity import BoolArray, FloatArray, IntArray
from layoutopt.protocols import Antennas
from layoutopt.readings import UNKNOWN_TAG, Observations
from layoutopt.robot import Robot
from layoutopt.simulation.motion import increments_between
from layoutopt.spec.building import Spec

MOST_STEPS: Final = 1_000_000
LONGEST_GAP_S: Final = 1.0
"""Over longer gaps the true path is taken as not known; gaps of odometry are told."""
_SAME_TIME: Final = 1e-6
_STEADY_SHARE: Final = 0.95


@dataclass(frozen=True, slots=True, kw_only=True)
class Resampled:
    """A logged drive on the time step of a layout.

    Attributes
    ----------
    time_s
        End of each step on the clock of the log, shape (n,).
    truth
        True pose at the end of each step, NaN where it is not known, shape (n, 3).
    steady
        Whether it is known when each antenna scanned, shape (antennas,): from the log, or because its reads keep
        to one turn of its cycle.
    notes
        What was changed on the way, one sentence each.
    """

    observations: Observations
    time_s: FloatArray
    truth: FloatArray
    steady: BoolArray
    notes: tuple[str, ...]


def resampled(log: DriveLog, spec: Spec, antennas: Antennas) -> Resampled:
    """Return a log on the time step of the spec.

    Poses are read off between rows of odometry; a read goes to the step in which it falls.

    Raises
    ------
    InvalidInput
        If the drive has more steps than anyone can replay.
    """
    step_s = spec.study.step_s
    start_s, end_s = float(log.time_s[0]), float(log.time_s[-1])
    count = max(1, math.ceil((end_s - start_s) / step_s - _SAME_TIME))
    if count > MOST_STEPS:
        raise InvalidInput.at(
            log.file,
            f"from {start_s:.12g} s to {end_s:.12g} s there are {count} steps of {step_s:g} s",
            f"Check the unit of time_s, or cut the log; a replay takes {MOST_STEPS} steps.",
        )
    edges_s: FloatArray = start_s + step_s * np.arange(count + 1, dtype=np.float64)
    poses = np.stack([np.interp(edges_s, log.time_s, axis) for axis in log.poses.T], axis=1)
    increments = increments_between(poses)
    notes = [_clock_note(log, step_s, count)]
    step, antenna, tag = _reads(log, start_s, step_s, count, notes)
    active, steady = _active(log, antennas, step, antenna, start_s, count, step_s, notes)
    gyro: dict[str, FloatArray] = {}
    if log.gyro_rad is not None:
        gyro = {
            "gyro_turn_rad": np.diff(np.interp(edges_s, log.time_s, log.gyro_rad)),
            "gyro_sigma_rad": np.full(count, spec.robot.gyro.sigma(step_s)),
        }
    observations = Observations(
        step_s=step_s,
        increments=increments,
        sigma=_told_sigma(spec.robot, increments, step_s),
        read_start=np.searchsorted(step, np.arange(count + 1)).astype(np.int64),
        read_antenna=antenna,
        read_tag=tag,
        active=active,
        **gyro,
    )
    return Resampled(
        observations=observations,
        time_s=edges_s[1:],
        truth=_truth(log, edges_s[1:]),
        steady=steady,
        notes=tuple(notes),
    )


def _told_sigma(robot: Robot, increments: FloatArray, step_s: float) -> FloatArray:
    """Return the deviations of odometry that an estimator is told, shape (n, 3)."""
    sigma = robot.odometry.sigma(increments, step_s)
    if robot.gyro_fitted:
        # The turn that such a robot logs is that of wheels and gyro together.
        of_gyro = robot.gyro.sigma(step_s)
        both = np.hypot(sigma[:, 2], of_gyro)
        sigma[:, 2] = np.divide(sigma[:, 2] * of_gyro, both, out=np.zeros_like(both), where=both > 0.0)
    return sigma


def _clock_note(log: DriveLog, step_s: float, count: int) -> str:
    spans_s = np.diff(log.time_s)
    usual_s, longest_s = float(np.median(spans_s)), float(spans_s.max())
    rows = (
        f"every {usual_s * 1000.0:.4g} ms"
        if np.ptp(spans_s) < 0.01 * usual_s
        else f"{float(spans_s.min()) * 1000.0:.4g} to {longest_s * 1000.0:.4g} ms apart, "
        f"{usual_s * 1000.0:.4g} ms in the middle"
    )
    gaps = int((spans_s > LONGEST_GAP_S).sum())
    missing = f"; {gaps} gaps of over {LONGEST_GAP_S:g} s are bridged in a straight line" if gaps else ""
    return (
        f"{len(log.time_s)} rows of odometry {rows}, read off every {step_s * 1000.0:g} ms ({count} steps); "
        f"reads go to the step in which they fall{missing}"
    )


def _reads(
    log: DriveLog, start_s: float, step_s: float, count: int, notes: list[str]
) -> tuple[IntArray, IntArray, IntArray]:
    """Return step, antenna and tag of the reads, sorted by all three, each of them once."""
    step = _steps(log.read_time_s, start_s, step_s)
    within = (step >= 0) & (step < count)
    if not within.all():
        notes.append(f"{int((~within).sum())} reads before or after the odometry are left out")
    rows = np.stack([step, log.read_antenna, log.read_tag], axis=1)[within]
    known = np.unique(rows[rows[:, 2] != UNKNOWN_TAG], axis=0)
    foreign = rows[rows[:, 2] == UNKNOWN_TAG]
    again = int((rows[:, 2] != UNKNOWN_TAG).sum()) - len(known)
    if again:
        notes.append(f"{again} reads of a tag by the same antenna in the same step count once")
    table = np.concatenate([known, foreign])
    table = table[np.lexsort((table[:, 2], table[:, 1], table[:, 0]))]
    return table[:, 0].copy(), table[:, 1].copy(), table[:, 2].copy()


def _steps(time_s: FloatArray, start_s: float, step_s: float) -> IntArray:
    """Return the step in which each time falls: a step holds its end, and the first one also its beginning."""
    steps = np.ceil((time_s - start_s) / step_s - _SAME_TIME).astype(np.int64) - 1
    return np.where((steps == -1) & (time_s >= start_s - _SAME_TIME * step_s), 0, steps)


def _active(
    log: DriveLog,
    antennas: Antennas,
    step: IntArray,
    antenna: IntArray,
    start_s: float,
    count: int,
    step_s: float,
    notes: list[str],
) -> tuple[BoolArray, BoolArray]:
    """Return who scanned in which step, shape (count, antennas), and of which antennas that is known."""
    if log.scan_time_s is not None and log.scan_antenna is not None:
        scanned = np.zeros((count, len(antennas)), dtype=np.bool_)
        at = _steps(log.scan_time_s, start_s, step_s)
        within = (at >= 0) & (at < count)
        scanned[at[within], log.scan_antenna[within]] = True
        scanned[step, antenna] = True
        return scanned, np.ones(len(antennas), dtype=np.bool_)
    phase = antennas.phase_steps.copy()
    steady = np.ones(len(antennas), dtype=np.bool_)
    for index in np.flatnonzero(antennas.period_steps > 1):
        period = int(antennas.period_steps[index])
        turns = np.bincount(step[antenna == index] % period, minlength=period)
        if turns.sum():
            phase[index] = int(turns.argmax())
            steady[index] = turns.max() >= _STEADY_SHARE * turns.sum()
    moved = int((steady & (phase != antennas.phase_steps)).sum())
    if moved:
        notes.append(
            f"{moved} of {len(antennas)} antennas read in other steps of their cycle than the layout has it; "
            "their turns are taken from their reads"
        )
    if not steady.all():
        notes.append(
            f"{int((~steady).sum())} of {len(antennas)} antennas keep no fixed turn in their cycle, so it is not "
            "known when they scanned without a read; a column 'scans' in the log would say it"
        )
    active = np.arange(count)[:, None] % antennas.period_steps == phase
    active[step, antenna] = True
    return active, steady


def _truth(log: DriveLog, time_s: FloatArray) -> FloatArray:
    """Return the true poses at those times, NaN outside the truth and in its long gaps, shape (n, 3)."""
    if len(log.truth) == 0:
        return np.full((len(time_s), 3), np.nan)
    poses = np.stack([np.interp(time_s, log.truth_time_s, axis) for axis in log.truth.T], axis=1)
    after = np.searchsorted(log.truth_time_s, time_s - 1e-9).clip(0, len(log.truth) - 1)
    before = (np.searchsorted(log.truth_time_s, time_s + 1e-9, side="right") - 1).clip(0)
    outside = (time_s < log.truth_time_s[0] - 1e-9) | (time_s > log.truth_time_s[-1] + 1e-9)
    poses[outside | (log.truth_time_s[after] - log.truth_time_s[before] > LONGEST_GAP_S)] = np.nan
    return poses
