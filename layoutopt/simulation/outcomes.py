"""From one simulated drive to one row of outcomes."""

import math
from typing import TYPE_CHECKING, Final

import numpy as np

from layoutopt.errors import InvalidInput
from layoutopt.geometry import covers, wrapped
from layoutopt.identity import BoolArray, FloatArray
from layoutopt.protocols import AnyEstimator
from layoutopt.readings import Observations, Trajectory
from layoutopt.scenario import Judgement, Scenario
from layoutopt.scores import AXES, DOCKING_UNITS, OUTCOME_COLUMNS, STATISTICS, TRACKING_UNITS
from layoutopt.site import Zone

if TYPE_CHECKING:
    from layoutopt.simulation.motion import Drive

ZONE_COLUMNS: Final = tuple(
    f"{axis}_error_{statistic}" for axis in ("position", "heading") for statistic in STATISTICS
)
"""What is judged in each zone with a target of its own; written ``zone.column``."""

VARIANCE_FLOOR_M2: Final = 1e-12
"""Added to a stated variance, (1 µm)², so that a filter whose particles agree to the last bit has a NEES."""


_STANDS_WITHIN: Final = 1e-12
"""Change of a pose, m and rad, below which it is rounding."""


def trial_columns(scenario: Scenario, estimator: AnyEstimator) -> tuple[str, ...]:
    """Return the names of all columns that a trial of the scenario fills with an estimator of whatever it is."""
    match estimator.card.estimates:
        case "target":
            return tuple(TRACKING_UNITS)
        case "bearing":
            return tuple(DOCKING_UNITS)
        case _:
            return outcome_columns(scenario)


def outcome_columns(scenario: Scenario) -> tuple[str, ...]:
    """Return the names of all columns that a drive over the floor fills."""
    zones = [f"{zone.name}.{column}" for zone in _judged_zones(scenario) for column in ZONE_COLUMNS]
    return (*OUTCOME_COLUMNS, *zones)


def outcome_row(
    drive: "Drive", observations: Observations, trajectory: Trajectory, scenario: Scenario
) -> FloatArray:
    """Return what one trial gave, in the order of `outcome_columns`.

    Errors are absolute differences of estimate and truth after each step, in x, y, position (their length) and
    heading (wrapped); mean, 95 % quantile, maximum and variance are over the steps from ``settle_s`` on, with
    ``standing_only`` over those of them in which the robot stands, and so are the share of steps lost and the
    NEES (mean of e' C^-1 e / 2 in x and y; NaN where the estimator states no covariance). The recovery time is
    that from the kidnapping until the robot is localised again, the rest of the trial if it never is, and NaN
    without a kidnapping. Reads per step are over the whole trial.

    Raises
    ------
    InvalidInput
        If the trial ends before it has settled, or the robot of a trial judged at rest never stands.
    """
    judged = counted_steps(drive.poses, scenario)
    off = trajectory.poses - drive.poses[1:]
    errors = {
        "position": np.hypot(off[:, 0], off[:, 1]),
        "x": np.abs(off[:, 0]),
        "y": np.abs(off[:, 1]),
        "heading": np.abs(wrapped(off[:, 2])),
    }
    columns = {
        f"{axis}_error_{statistic}": value
        for axis in AXES
        for statistic, value in _statistics(errors[axis][judged]).items()
    }
    columns["lost_share"] = float((errors["position"][judged] > scenario.judgement.lost_beyond_m).mean())
    columns["time_to_localise"] = time_to_localise_s(errors["position"], scenario.step_s, scenario.judgement)
    columns["recovery_time"] = math.nan
    if scenario.lifted_after is not None:
        since = errors["position"][scenario.lifted_after :]
        columns["recovery_time"] = time_to_localise_s(since, scenario.step_s, scenario.judgement)
    columns["nees"] = _nees(
        off[judged, :2], None if trajectory.covariance is None else trajectory.covariance[judged]
    )
    columns["reads_per_step"] = len(observations.read_tag) / len(observations)
    for zone in _judged_zones(scenario):
        inside = judged & covers(zone.region, drive.poses[1:, :2])
        for axis in ("position", "heading"):
            for statistic, value in _statistics(errors[axis][inside]).items():
                columns[f"{zone.name}.{axis}_error_{statistic}"] = value
    return np.array([columns[name] for name in outcome_columns(scenario)])


def counted_steps(poses: FloatArray, scenario: Scenario) -> BoolArray:
    """Return in which steps between true poses, shape (n + 1, 3), errors count, shape (n,).

    Raises
    ------
    InvalidInput
        If there is none: the trial ends before it has settled, or its robot never stands and is judged at rest.
    """
    judged = judged_steps(scenario)
    if scenario.judgement.standing_only:
        judged = judged & standing_steps(poses)
        if not judged.any():
            raise InvalidInput.at(
                f"scenario '{scenario.name}'",
                "errors count while the robot stands, and it never does",
                "Give way points with a pause, and a trial that is long enough to come to one.",
            )
    return judged


def judged_steps(scenario: Scenario) -> BoolArray:
    """Return which steps end at ``settle_s`` or later, shape (steps,).

    Raises
    ------
    InvalidInput
        If there is none.
    """
    ends_s = (np.arange(scenario.step_count) + 1) * scenario.step_s
    judged = np.asarray(ends_s >= scenario.judgement.settle_s - 1e-9)
    if not judged.any():
        raise InvalidInput.at(
            f"scenario '{scenario.name}'",
            f"a trial of {scenario.duration_s:g} s ends before the errors count, after "
            f"{scenario.judgement.settle_s:g} s",
            "Lengthen the trial or shorten the settling time.",
        )
    return judged


def standing_steps(poses: FloatArray) -> BoolArray:
    """Return in which steps between true poses, shape (n + 1, 3), the robot neither moves nor turns."""
    return np.asarray((np.abs(np.diff(poses, axis=0)) < _STANDS_WITHIN).all(axis=1))


def time_to_localise_s(error_m: FloatArray, step_s: float, judgement: Judgement) -> float:
    """Return the end of the first step from which the error stays within the limit for the holding time.

    The whole holding time must lie within the trial; without such a step the answer is the trial's duration.
    """
    hold = max(1, math.ceil(judgement.hold_s / step_s - 1e-9))
    within = np.concatenate([[0], np.cumsum(error_m <= judgement.localised_within_m)])
    begins = np.flatnonzero(within[hold:] - within[:-hold] == hold)
    return float((begins[0] + 1) * step_s) if len(begins) else len(error_m) * step_s


def _judged_zones(scenario: Scenario) -> tuple[Zone, ...]:
    return tuple(zone for zone in scenario.site.zones if zone.target_error_m is not None)


def _statistics(error: FloatArray) -> dict[str, float]:
    """Return the statistics of absolute errors, NaN where there are none."""
    if len(error) == 0:
        return dict.fromkeys(STATISTICS, math.nan)
    return {
        "mean": float(error.mean()),
        "p95": float(np.quantile(error, 0.95)),
        "max": float(error.max()),
        "variance": float(error.var()),
    }


def _nees(off_m: FloatArray, covariance_m2: FloatArray | None) -> float:
    """Return the normalised estimation error squared of x and y over its expectation 2, mean over steps."""
    if covariance_m2 is None:
        return math.nan
    normalised = np.linalg.solve(covariance_m2 + VARIANCE_FLOOR_M2 * np.eye(2), off_m[:, :, None])[:, :, 0]
    return float((off_m * normalised).sum(axis=1).mean() / 2.0)
