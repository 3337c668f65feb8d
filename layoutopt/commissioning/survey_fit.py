"""The rigid motion between a survey and the plan: surveyors measure in frames of their own."""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np

from layoutopt.geometry import turned
from layoutopt.identity import FloatArray

_ROUNDS: Final = 20
_OUTLIER: Final = 4.0
"""Residuals beyond so many robust standard deviations are left out of the fit: moved and swapped tags."""
_RAYLEIGH_MEDIAN: Final = math.sqrt(2.0 * math.log(2.0))
_LEAST_M: Final = 1e-6


@dataclass(frozen=True, slots=True, kw_only=True)
class RigidFit:
    """A turn about the origin, then a shift: ``map = turned(survey, angle_rad) + shift_m``.

    ``sigma_m`` is the robust standard deviation per axis of what is left, ``used`` counts the points behind it.
    """

    shift_m: tuple[float, float]
    angle_rad: float
    sigma_m: float
    used: int

    def applied(self, xy_m: FloatArray) -> FloatArray:
        """Return surveyed places, shape (n, 2), in the frame of the plan."""
        moved: FloatArray = turned(xy_m, self.angle_rad) + self.shift_m
        return moved


def rigid_fit(surveyed_m: FloatArray, planned_m: FloatArray) -> RigidFit:
    """Return the rigid motion that brings surveyed places onto planned ones, both of shape (n, 2), n >= 2.

    Least squares over the points that are no outliers (Arun, Huang & Blostein 1987, without reflection), found
    again until they stay the same; the first round takes the median of both coordinates for the shift, so that
    up to half of the tags may be elsewhere.

    Raises
    ------
    ValueError
        If there are fewer than two points, or all of them are at one place.
    """
    if len(surveyed_m) < 2 or np.ptp(surveyed_m, axis=0).max() < _LEAST_M:
        raise ValueError("a frame needs at least two tags at different places")
    used = np.ones(len(surveyed_m), dtype=np.bool_)
    for _ in range(_ROUNDS):
        fit = _least_squares(surveyed_m, planned_m, used)
        left_m = np.linalg.norm(fit.applied(surveyed_m) - planned_m, axis=1)
        sigma_m = float(np.median(left_m)) / _RAYLEIGH_MEDIAN
        now = left_m <= max(_OUTLIER * sigma_m, _LEAST_M)
        if now.sum() < 2 or (now == used).all():
            break
        used = now
    return RigidFit(shift_m=fit.shift_m, angle_rad=fit.angle_rad, sigma_m=sigma_m, used=int(used.sum()))


def _least_squares(surveyed_m: FloatArray, planned_m: FloatArray, used: np.ndarray) -> RigidFit:
    from_m, to_m = surveyed_m[used].mean(axis=0), planned_m[used].mean(axis=0)
    a, b = surveyed_m[used] - from_m, planned_m[used] - to_m
    angle_rad = math.atan2(float((a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]).sum()), float((a * b).sum()))
    shift_m = to_m - turned(from_m, angle_rad)
    return RigidFit(
        shift_m=(float(shift_m[0]), float(shift_m[1])), angle_rad=angle_rad, sigma_m=math.nan, used=int(used.sum())
    )
