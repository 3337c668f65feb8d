"""Exact error of a midrange reading by a box: the reading area that the half-gap rule has in mind."""

import math
from dataclasses import dataclass
from functools import lru_cache
from itertools import pairwise

import numpy as np

from layoutopt.geometry import lattice_points
from layoutopt.identity import FloatArray
from layoutopt.layout import TagPattern


@dataclass(frozen=True, slots=True, kw_only=True)
class BoxError:
    """Error of the midrange of one reading by an axis-parallel square box, given that a tag is read.

    Attributes
    ----------
    worst_m, mean_m
        Largest and mean distance between estimate and place.
    worst_axis_m, mean_axis_m
        The same along x and y alone.
    detection_probability
        Share of places where a tag is read.
    """

    worst_m: float
    mean_m: float
    worst_axis_m: tuple[float, float]
    mean_axis_m: tuple[float, float]
    detection_probability: float


def box_error(pattern: TagPattern, side_m: float) -> BoxError:
    """Return the exact error of a box reader whose sides are parallel to the pattern's rows and columns.

    Where a tag enters or leaves the box is a line, so places with the same reading are rectangles; worst error and
    mean over each have closed forms. On the square lattice with a side of (k + f) pitches, k whole and positive
    and 0 <= f < 1, the worst error along an axis is max(f, 1 - f) / 2 pitches (1/2 for f = 0), and the mean is (f²
    + (1 - f)²) / 4: the best box, k + 1/2 pitches wide, errs half as much as the half-gap rule says.

    Raises
    ------
    ValueError
        If the side is not positive and finite, or the pattern has no axis-parallel cell with tags.

    Examples
    --------
    >>> from layoutopt.patterns.square import square
    >>> round(box_error(square(pitch_m=1.0), 1.5).worst_m, 4)
    0.3536
    """
    if not 0.0 < side_m < math.inf:
        raise ValueError(f"a box needs a positive, finite side, got {side_m}")
    return _box_error(pattern, float(side_m))


def rectangular_cell_m(pattern: TagPattern) -> tuple[float, float]:
    """Return width and height of a pattern's cell.

    Raises
    ------
    ValueError
        If it is no axis-parallel rectangle or has no tag; the message says why nothing applies.
    """
    if pattern.cell_m is None:
        raise ValueError("does not apply, because the pattern is laid once and has no period")
    width_m, height_m = np.diag(pattern.cell_m)
    if not (np.array_equal(pattern.cell_m, np.diag([width_m, height_m])) and min(width_m, height_m) > 0.0):
        raise ValueError("does not apply, because the cell of the pattern is no axis-parallel rectangle")
    if len(pattern.points_m) == 0:
        raise ValueError("does not apply, because the pattern has no tag")
    return float(width_m), float(height_m)


@lru_cache(maxsize=1024)
def _box_error(pattern: TagPattern, side_m: float) -> BoxError:
    width_m, height_m = rectangular_cell_m(pattern)
    half_m = side_m / 2.0
    tags_m = lattice_points(
        pattern.points_m, pattern.cell_m, (-half_m, -half_m, width_m + half_m, height_m + half_m)
    )
    x_m, y_m = (_borders(pattern.points_m[:, axis], half_m, size) for axis, size in ((0, width_m), (1, height_m)))
    middle_y_m = (y_m[1:] + y_m[:-1]) / 2.0
    totals = np.zeros(4)
    worst = np.zeros(3)
    for left_m, right_m in pairwise(x_m.tolist()):
        band_m = tags_m[np.abs(tags_m[:, 0] - (left_m + right_m) / 2.0) < half_m]
        read = np.abs(band_m[:, 1] - middle_y_m[:, None]) < half_m
        some = read.any(axis=1)
        if not some.any():
            continue
        read = read[some]
        estimate_m = [
            (
                np.where(read, band_m[:, axis], -np.inf).max(axis=1)
                + np.where(read, band_m[:, axis], np.inf).min(axis=1)
            )
            / 2.0
            for axis in (0, 1)
        ]
        ends = (
            [left_m - estimate_m[0], right_m - estimate_m[0]],
            [
                y_m[:-1][some] - estimate_m[1],
                y_m[1:][some] - estimate_m[1],
            ],
        )
        far = [np.maximum(np.abs(low), np.abs(high)) for low, high in ends]
        worst = np.maximum(worst, [far[0].max(), far[1].max(), np.hypot(*far).max()])
        (left, right), (low, high) = ends
        area = (right - left) * (high - low)
        distance = _distance(right, high) - _distance(left, high) - _distance(right, low) + _distance(left, low)
        along_x = (right * np.abs(right) - left * np.abs(left)) / 2.0 * (high - low)
        along_y = (high * np.abs(high) - low * np.abs(low)) / 2.0 * (right - left)
        totals += [area.sum(), distance.sum(), along_x.sum(), along_y.sum()]
    covered_m2 = totals[0]
    return BoxError(
        worst_m=float(worst[2]),
        mean_m=float(totals[1] / covered_m2),
        worst_axis_m=(float(worst[0]), float(worst[1])),
        mean_axis_m=(float(totals[2] / covered_m2), float(totals[3] / covered_m2)),
        detection_probability=float(covered_m2 / (width_m * height_m)),
    )


def _borders(places_m: FloatArray, half_m: float, period_m: float) -> FloatArray:
    """Return where along an axis the reading may change, ascending, from 0 to one period."""
    changes_m = np.sort(np.concatenate([(places_m - half_m) % period_m, (places_m + half_m) % period_m]))
    changes_m = changes_m[np.append(True, np.diff(changes_m) > 1e-12 * period_m)]
    return np.concatenate([[0.0], changes_m[(changes_m > 0.0) & (changes_m < period_m)], [period_m]])


def _distance(x_m: FloatArray, y_m: FloatArray) -> FloatArray:
    """Return the integral of the distance from the origin over the rectangle from it to (x, y), signed, m³."""
    distance_m = np.hypot(x_m, y_m)
    x, y = np.abs(x_m), np.abs(y_m)
    with np.errstate(divide="ignore", invalid="ignore"):
        sides = np.where(x > 0.0, x**3 * np.arcsinh(y / x), 0.0) + np.where(y > 0.0, y**3 * np.arcsinh(x / y), 0.0)
    return np.asarray(np.sign(x_m) * np.sign(y_m) * (2.0 * x * y * distance_m + sides) / 6.0)
