"""Plane geometry without any word of the domain: polygons, lattices, segments."""

from typing import TYPE_CHECKING

import numpy as np

from layoutopt.identity import BoolArray, FloatArray

if TYPE_CHECKING:
    from shapely.geometry.base import BaseGeometry

Bounds = tuple[float, float, float, float]


def lattice_points(points_m: FloatArray, cell_m: FloatArray | None, bounds_m: Bounds) -> FloatArray:
    """Return the points of a periodic set within closed bounds, shape (n, 2), sorted by y, then x.

    ``cell_m`` holds the two period vectors as rows; ``None`` means that the set does not repeat.
    """
    low, high = np.array(bounds_m[:2]), np.array(bounds_m[2:])
    points_m = np.asarray(points_m)
    if cell_m is not None and len(points_m):
        corners = np.array([(x, y) for x in (low[0], high[0]) for y in (low[1], high[1])])
        inverse = np.linalg.inv(cell_m)
        steps = (corners[:, None, :] - points_m[None, :, :]).reshape(-1, 2) @ inverse
        first = np.floor(steps.min(axis=0)).astype(int) - 1
        last = np.ceil(steps.max(axis=0)).astype(int) + 1
        i, j = np.meshgrid(np.arange(first[0], last[0] + 1), np.arange(first[1], last[1] + 1), indexing="ij")
        shifts = np.stack([i.ravel(), j.ravel()], axis=1) @ cell_m
        points_m = (shifts[:, None, :] + points_m[None, :, :]).reshape(-1, 2)
    # A point on the border must not come and go with the last bit of a sum.
    inside = ((points_m >= low - 1e-9) & (points_m <= high + 1e-9)).all(axis=1)
    points_m = points_m[inside]
    return points_m[np.lexsort((np.round(points_m[:, 0], 9), np.round(points_m[:, 1], 9)))]


def reduced_cell(cell_m: FloatArray) -> FloatArray:
    """Return the two shortest vectors, as rows, that span the same lattice as those of ``cell_m`` (Gauss)."""
    short, long = sorted(np.array(cell_m, dtype=np.float64), key=np.linalg.norm)
    while True:
        long = long - np.round(long @ short / (short @ short)) * short
        # The margin ends the search where both are equally long but for rounding.
        if np.linalg.norm(long) >= np.linalg.norm(short) * (1.0 - 1e-12):
            return np.array([short, long])
        short, long = long, short


def points_inside(points_m: FloatArray, region: "BaseGeometry") -> FloatArray:
    """Return those of the points, shape (n, 2), that lie in the closed region."""
    return points_m[covers(region, points_m)]


def covers(region: "BaseGeometry", points_m: FloatArray) -> BoolArray:
    """Return for each point, shape (n, 2), whether the closed region holds it, shape (n,)."""
    import shapely

    shapely.prepare(region)
    return np.asarray(shapely.intersects_xy(region, points_m[:, 0], points_m[:, 1]), dtype=np.bool_)


def turned(points_m: FloatArray, angle_rad: float) -> FloatArray:
    """Return points, shape (..., 2), turned counter-clockwise about the origin."""
    cos, sin = np.cos(angle_rad), np.sin(angle_rad)
    return np.asarray(points_m @ np.array([[cos, sin], [-sin, cos]]))


def wrapped(angle_rad: FloatArray | float) -> FloatArray:
    """Return angles in [-pi, pi)."""
    return np.asarray((np.asarray(angle_rad) + np.pi) % (2.0 * np.pi) - np.pi)
