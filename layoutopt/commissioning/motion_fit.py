"""Noise of odometry, fitted from what it said between true poses."""

import dataclasses
import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np

from layoutopt.commissioning.drive_log import DriveLog
from layoutopt.commissioning.estimated import Fitted, hessian, log_scaled
from layoutopt.commissioning.resampling import LONGEST_GAP_S
from layoutopt.geometry import wrapped
from layoutopt.identity import BoolArray, FloatArray
from layoutopt.robot import Odometry
from layoutopt.simulation.motion import increments_between

TERMS: Final = ("translation_share", "lateral_share", "rotation_rad_per_m")
"""The terms of `layoutopt.robot.Odometry` that are fitted, for the errors forward, to the left and of the turn."""
FEWEST: Final = 30
"""Increments below which nothing is fitted."""
_SYSTEMATIC: Final = 4.0
_MOST_NOISE_SHARE: Final = 0.1
_LEAST_WAY_M: Final = 1e-6
_LEAST_TRUTH_NOISE: Final = 1e-7
_LEAST_VARIANCE: Final = 1e-14
_CHI_SQUARE: Final = 5.412
"""One degree of freedom, 98 %: one-sided 99 % for a number that cannot be negative."""
_VAGUE: Final = 0.5
"""Standard error of a logarithm beyond which a term counts as not found."""
_AXES: Final = ("forward", "to the left", "of the turn")
_UNITS: Final = ("mm a metre", "mm a metre", "deg a metre")


@dataclass(frozen=True, slots=True, kw_only=True)
class MotionFit:
    """Noise of the odometry.

    Attributes
    ----------
    terms
        Fitted terms by name (`TERMS`).
    truth_sigma
        Fitted noise of the truth itself by the same names, m, m and rad.
    notes
        Systematic errors, and what was not fitted, one sentence each.
    """

    terms: Mapping[str, Fitted]
    truth_sigma: Mapping[str, float]
    notes: tuple[str, ...]

    def odometry(self, before: Odometry) -> Odometry:
        """Return the odometry with the fitted terms in place of those that were assumed."""
        return dataclasses.replace(before, **{name: fitted.value for name, fitted in self.terms.items()})


@dataclass(frozen=True, slots=True, kw_only=True)
class Increments:
    """Errors of odometry between successive true poses.

    ``error`` are the increments by odometry less the true ones (forward m, left m, turn rad), shape (n, 3);
    ``way_m`` the true way of a wheel and ``said_way_m`` that by odometry, ``span_s`` the time of each, shape (n,);
    ``joined`` whether each begins with the true pose with which the one before ends, shape (n,).
    """

    error: FloatArray
    way_m: FloatArray
    said_way_m: FloatArray
    span_s: FloatArray
    joined: BoolArray


def increments_of(log: DriveLog, odometry: Odometry) -> Increments:
    """Return the errors of odometry between the true poses of a log.

    Where truth and odometry stand in rows of their own the odometry is read off at the times of the truth; true
    poses between which there is no new row of odometry are passed over, and so are jumps and long gaps.
    """
    inside = (log.truth_time_s >= log.time_s[0]) & (log.truth_time_s <= log.time_s[-1])
    time_s, truth = log.truth_time_s[inside], log.truth[inside]
    # The first true pose after each row of odometry: nearer ones would share the noise of one row.
    row = np.searchsorted(log.time_s, time_s + 1e-9, side="right")
    first = np.flatnonzero(np.diff(row, prepend=-1) > 0)
    time_s, truth, row = time_s[first], truth[first], row[first]
    poses = np.stack([np.interp(time_s, log.time_s, axis) for axis in log.poses.T], axis=1)
    if len(time_s) < 2:
        none = np.empty(0)
        return Increments(
            error=np.empty((0, 3)), way_m=none, said_way_m=none, span_s=none, joined=np.empty(0, np.bool_)
        )
    true = increments_between(truth)
    said = increments_between(poses)
    error = said - true
    error[:, 2] = wrapped(error[:, 2])
    span_s = np.diff(time_s)
    jumps = np.searchsorted(np.sort(log.time_s[log.jumps]), np.stack([time_s[:-1], time_s[1:]]) + 1e-9)
    sound = (span_s <= LONGEST_GAP_S) & (jumps[0] == jumps[1])
    joined = np.concatenate([[False], sound[:-1]])
    return Increments(
        error=error[sound],
        way_m=odometry.way_m(true)[sound],
        said_way_m=odometry.way_m(said)[sound],
        span_s=span_s[sound],
        joined=joined[sound],
    )


def fit_motion(log: DriveLog, odometry: Odometry) -> MotionFit:
    """Return the noise of odometry by maximum likelihood from true poses.

    Along each axis the errors of odometry are independent and normal, with a variance of ``term² × way`` plus what
    the time terms of ``odometry`` say, which are not fitted: at an even speed nothing tells the two apart. The
    truth has noise of its own, independent from pose to pose, which is fitted beside the term: it makes
    neighbouring errors depend on each other, and odometry does not.
    """
    increments = increments_of(log, odometry)
    count = len(increments.error)
    if count < FEWEST:
        note = f"odometry is not fitted: {count} increments between true poses, and {FEWEST} are needed"
        return MotionFit(terms={}, truth_sigma={}, notes=(note,))
    time_terms = (
        odometry.translation_m_per_sqrt_s,
        odometry.translation_m_per_sqrt_s,
        odometry.rotation_rad_per_sqrt_s,
    )
    terms, truth_sigma, notes = {}, {}, []
    truth_noise_m = _fit_axis(increments, 0, time_terms[0] ** 2 * increments.span_s)[1]
    if not truth_noise_m < _MOST_NOISE_SHARE * float(np.median(increments.way_m)):
        # A jittering truth goes a longer way than the robot.
        increments = dataclasses.replace(increments, way_m=increments.said_way_m)
    for axis, name in enumerate(TERMS):
        fitted, noise = _fit_axis(increments, axis, time_terms[axis] ** 2 * increments.span_s)
        if fitted is None:
            notes.append(f"{name} is not fitted: the noise of the truth covers that of the odometry")
            continue
        terms[name], truth_sigma[name] = fitted, noise
        note = _systematic(increments, axis, fitted.value)
        if note:
            notes.append(note)
    if any(time_terms):
        notes.append("the noise of odometry over time is held as the layout file has it")
    return MotionFit(terms=terms, truth_sigma=truth_sigma, notes=tuple(notes))


def _fit_axis(increments: Increments, axis: int, known_variance: FloatArray) -> tuple[Fitted | None, float]:
    """Return the term of one axis and the noise of the truth; no term where the truth's noise covers it."""
    from scipy.optimize import minimize

    error, way_m = increments.error[:, axis], increments.way_m
    moving = way_m > _LEAST_WAY_M
    if moving.sum() < FEWEST:
        return None, math.nan
    scale = math.sqrt(float(np.mean(error[moving] ** 2 / way_m[moving])) + 1e-18)

    def cost(log_term: float, truth_sigma: float) -> float:
        variance = math.exp(2.0 * log_term) * way_m + known_variance + _LEAST_VARIANCE
        return -_log_likelihood(error, variance, truth_sigma, increments.joined)

    def cost_alone(at: FloatArray) -> float:
        return cost(at[0], 0.0)

    def cost_both(at: FloatArray) -> float:
        return cost(at[0], math.exp(at[1]))

    middle = math.log(scale)
    term_bounds = (middle - 10.0, middle + 3.0)
    alone = minimize(cost_alone, np.array([middle]), method="L-BFGS-B", bounds=[term_bounds])
    spread = float(np.sqrt(np.mean(error**2))) + _LEAST_TRUTH_NOISE
    both = minimize(
        cost_both,
        np.array([middle, math.log(0.3 * spread)]),
        method="L-BFGS-B",
        bounds=[term_bounds, (math.log(_LEAST_TRUTH_NOISE), 0.0)],
    )
    # Noise that does not show would only take from the odometry's, because it cannot be negative.
    shows = 2.0 * (float(alone.fun) - float(both.fun)) > _CHI_SQUARE
    at, noise = (np.asarray(both.x), math.exp(both.x[1])) if shows else (np.asarray(alone.x), 0.0)
    second = hessian(cost_both if shows else cost_alone, at)
    if at[0] <= term_bounds[0] + 1.0 or np.linalg.eigvalsh(second)[0] <= 0.0:
        return None, noise
    log_se = math.sqrt(float(np.linalg.inv(second)[0, 0]))
    if log_se > _VAGUE:
        return None, noise
    return log_scaled(math.exp(at[0]), log_se, int(moving.sum()), "increments"), noise


def _log_likelihood(error: FloatArray, variance: FloatArray, truth_sigma: float, joined: BoolArray) -> float:
    """Return the log-likelihood of errors that share the noise of the true pose between neighbours.

    Their covariance has three diagonals: variance + 2 truth², and -truth² beside it where two are joined.
    """
    from scipy.linalg import cholesky_banded, solve_banded

    banded = np.zeros((2, len(error)))
    banded[0] = variance + 2.0 * truth_sigma**2
    banded[1, :-1] = np.where(joined[1:], -(truth_sigma**2), 0.0)
    factor = cholesky_banded(banded, lower=True)
    white = solve_banded((1, 0), factor, error)
    return float(-0.5 * white @ white - np.log(factor[0]).sum() - 0.5 * len(error) * math.log(2.0 * math.pi))


def _systematic(increments: Increments, axis: int, term: float) -> str:
    """Return a sentence on an error that grows with the way, if it is more than chance."""
    way_m = float(increments.way_m.sum())
    total = float(increments.error[:, axis].sum())
    if way_m <= 0.0 or abs(total) < _SYSTEMATIC * term * math.sqrt(way_m):
        return ""
    shown = total / way_m * (math.degrees(1.0) if axis == 2 else 1000.0)
    return (
        f"the odometry has a systematic error {_AXES[axis]} of {shown:.3g} {_UNITS[axis]}, "
        f"{abs(total) / (term * math.sqrt(way_m)):.0f} times what its noise explains: calibrate it; the fitted "
        "noise does not hold it"
    )
