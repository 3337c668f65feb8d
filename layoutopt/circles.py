"""Equal circles in the plane: smallest enclosing ones, regions that they cut out, and their periodic arrangement.

Cut all circles at their intersections. Each arc has the same points within reach all along, on its inner side and
on its outer side; so has each face of the arrangement. Whatever depends on these points alone is constant on a
face, and integrals over faces are sums over their arcs (Green's theorem). So nothing has to be sampled.
"""

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Final

import numpy as np

from layoutopt.geometry import reduced_cell
from layoutopt.identity import FloatArray, IntArray

_SAME_SHARE: Final = 1e-9
"""Points nearer than this share of the radius are at one place."""
_NODES: Final = 12
"""Of the Gauss rule on each piece of an arc; one more changes nothing in the twelfth digit."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Circle:
    """A circle: centre (x, y) and radius, m."""

    centre_m: tuple[float, float]
    radius_m: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Sides:
    """Something of either side of each arc, shape (a, 2) each: inside its circle, and outside."""

    inside: FloatArray
    outside: FloatArray


@dataclass(frozen=True, kw_only=True)
class Arrangement:
    """Arcs of equal circles about the points of a periodic set, those of one cell.

    Attributes
    ----------
    points_m, cell_m, radius_m
        Points of one cell, shape (n, 2), the two period vectors as rows, and the radius.
    near_m, near_step, near_start
        Centres closer than two radii to each point: places, shape (k, 2), number of the point and steps to its
        cell, shape (k, 3), and where those of each point start, shape (n + 1,).
    circle, ends_rad
        Point to which each arc belongs, shape (a,), and its ends counter-clockwise, shape (a, 2).
    held_start, held
        Near centres within reach on each arc: rows ``held[held_start[i]:held_start[i + 1]]``.
    """

    points_m: FloatArray
    cell_m: FloatArray
    radius_m: float
    near_m: FloatArray
    near_step: IntArray
    near_start: IntArray
    circle: IntArray
    ends_rad: FloatArray
    held_start: IntArray
    held: IntArray

    def __len__(self) -> int:
        """Return the number of arcs."""
        return len(self.circle)

    @cached_property
    def centre_m(self) -> FloatArray:
        """Centre of each arc's circle, shape (a, 2)."""
        return np.asarray(self.points_m[self.circle])

    @property
    def bare(self) -> FloatArray:
        """Whether nothing is within reach outside each arc, as 0 or 1, shape (a,)."""
        return np.asarray(np.diff(self.held_start) == 0, dtype=np.float64)

    def middles(self, *, centroid: bool = False) -> Sides:
        """Return the middle of the extremes of the points within reach, or their centroid; NaN without any."""
        from layoutopt.circles_kernels import estimates

        inside, outside = estimates(self.points_m, self.circle, self.held_start, self.held, self.near_m, centroid)
        return Sides(inside=inside, outside=outside)

    def centres(self) -> Sides:
        """Return the centre of the smallest circle round all places with the same points within reach.

        These places may be several faces. NaN where nothing is within reach.
        """
        from layoutopt.circles_kernels import enclosing_circles, read_sets

        number, cell = read_sets(self.near_step, self.circle, self.held_start, self.held)
        number, cell = number.ravel(), cell.reshape(-1, 2)
        moved_m = cell @ self.cell_m
        real = np.flatnonzero(np.concatenate([np.ones(len(self)), 1.0 - self.bare]) > 0.0)
        order = real[np.argsort(number[real], kind="stable")]
        _, start = np.unique(number[order], return_index=True)
        centre_m = np.concatenate([self.centre_m, self.centre_m]) - moved_m
        ends_rad = np.concatenate([self.ends_rad, self.ends_rad])
        bounds = np.append(start, len(order)).astype(np.int64)
        middle_m, _ = enclosing_circles(
            bounds, centre_m[order], ends_rad[order], self.radius_m, _slack_m(centre_m, self.radius_m)
        )
        found = np.full((2 * len(self), 2), np.nan)
        found[order] = np.repeat(middle_m, np.diff(bounds), axis=0) + moved_m[order]
        return Sides(inside=found[: len(self)], outside=found[len(self) :])

    def covered_area_m2(self) -> float:
        """Return the area of one cell that lies within reach of a point."""
        # The arcs of a cell close only together with their copies in other cells, so each face is summed up about
        # a place of its own: any that follows from its points does.
        places = self.middles()
        start, stop = self.ends_rad.T
        along = np.stack([np.sin(stop) - np.sin(start), np.cos(start) - np.cos(stop)], axis=1)
        inner, outer = (
            self.radius_m / 2.0 * (((self.centre_m - side_m) * along).sum(axis=1) + self.radius_m * (stop - start))
            for side_m in (places.inside, places.outside)
        )
        return math.fsum(inner) - math.fsum(outer[~np.isnan(outer)])

    def mean_distance_m(self, places: Sides) -> float:
        """Return the mean distance between a place with something within reach and the estimate of its side."""
        nodes, weights = np.polynomial.legendre.leggauss(_NODES)
        from layoutopt.circles_kernels import distance_flux

        inner, outer = (
            distance_flux(self.centre_m, self.ends_rad, side_m, self.radius_m, nodes, weights)
            for side_m in (places.inside, places.outside)
        )
        return (math.fsum(inner) - math.fsum(outer)) / self.covered_area_m2()

    def largest_distance_m(self, places: Sides) -> float:
        """Return the largest distance between a place with something within reach and the estimate of its side."""
        from layoutopt.circles_kernels import farthest_m

        return float(
            np.nanmax(
                [
                    farthest_m(self.centre_m, self.ends_rad, side_m, self.radius_m)
                    for side_m in (places.inside, places.outside)
                ]
            )
        )


def arrangement(points_m: FloatArray, cell_m: FloatArray, radius_m: float) -> Arrangement:
    """Return the arrangement of circles about a periodic set.

    Parameters
    ----------
    points_m
        Points of one cell, shape (n, 2), no two at one place.
    cell_m
        The two period vectors as rows.
    radius_m
        Radius of all circles.

    Raises
    ------
    ValueError
        If there is no point, two share a place, or the radius is not positive and finite.
    """
    from layoutopt.circles_kernels import arcs

    if len(points_m) == 0:
        raise ValueError("an arrangement of circles needs at least one point")
    if not 0.0 < radius_m < math.inf:
        raise ValueError(f"a radius must be positive and finite, got {radius_m}")
    cell_m = reduced_cell(cell_m)
    steps = points_m @ np.linalg.inv(cell_m)
    points_m = (steps - np.floor(steps)) @ cell_m
    near_m, near_step, near_start = neighbours(points_m, cell_m, 2.0 * radius_m)
    apart_m = near_m - np.repeat(points_m, np.diff(near_start), axis=0)
    if (np.hypot(*apart_m.T) <= _SAME_SHARE * radius_m).any():
        raise ValueError("two points share a place: an arrangement of circles needs different ones")
    circle, ends_rad, held_start, held = arcs(points_m, near_start, near_m, radius_m)
    return Arrangement(
        points_m=points_m,
        cell_m=cell_m,
        radius_m=radius_m,
        near_m=near_m,
        near_step=near_step,
        near_start=near_start,
        circle=circle,
        ends_rad=ends_rad,
        held_start=held_start,
        held=held,
    )


def neighbours(points_m: FloatArray, cell_m: FloatArray, within_m: float) -> tuple[FloatArray, IntArray, IntArray]:
    """Return the points of a periodic set closer than a distance to each point of its cell, without that point.

    Returns places, shape (k, 2), number of the point and steps to its cell, shape (k, 3), and where those of each
    point start, shape (n + 1,). ``points_m`` lie in the cell of ``cell_m``, which is a reduced one.
    """
    from scipy.spatial import cKDTree

    lengths_m = np.linalg.norm(cell_m, axis=1)
    heights_m = abs(np.linalg.det(cell_m)) / lengths_m[::-1]
    reaches = [math.ceil(within_m / height_m) + 1 for height_m in heights_m.tolist()]
    first, second = (np.arange(-reach, reach + 1) for reach in reaches)
    shifts = np.stack(np.meshgrid(first, second, indexing="ij"), axis=-1).reshape(-1, 2)
    others_m = (points_m[None, :, :] + (shifts @ cell_m)[:, None, :]).reshape(-1, 2)
    tree = cKDTree(others_m)
    own = int(np.flatnonzero((shifts == 0).all(axis=1))[0]) * len(points_m)
    rows = [
        np.array([row for row in tree.query_ball_point(place, within_m, return_sorted=True) if row != own + index])
        for index, place in enumerate(points_m)
    ]
    all_rows = np.concatenate(rows).astype(np.int64)
    step = np.column_stack([all_rows % len(points_m), shifts[all_rows // len(points_m)]]).astype(np.int64)
    start = np.concatenate([[0], np.cumsum([len(row) for row in rows])]).astype(np.int64)
    return np.ascontiguousarray(others_m[all_rows]), step, start


def arcs_plain(
    points_m: FloatArray, near_start: IntArray, near_m: FloatArray, radius_m: float
) -> tuple[IntArray, FloatArray, IntArray, IntArray]:
    """Return what `layoutopt.circles_kernels.arcs` returns, circle by circle in plain numpy: its truth."""
    from layoutopt.circles_kernels import SHORTEST_RAD, TOUCHING

    circle, ends, held_count, held = [], [], [0], []
    for index, (centre_m, first, last) in enumerate(zip(points_m, near_start, near_start[1:], strict=False)):
        away_m = near_m[first:last] - centre_m
        half = np.hypot(*away_m.T) / (2.0 * radius_m)
        cuts = half < 1.0 - TOUCHING
        towards, wide = np.arctan2(away_m[cuts, 1], away_m[cuts, 0]), np.arccos(half[cuts])
        corners = np.sort(np.concatenate([towards - wide, towards + wide]) % (2.0 * math.pi))
        corners = np.append(corners, corners[0] + 2.0 * math.pi) if cuts.any() else np.array([0.0, 2.0 * math.pi])
        long = np.diff(corners) >= SHORTEST_RAD
        for start, stop in zip(corners[:-1][long], corners[1:][long], strict=True):
            middle = 0.5 * (start + stop)
            place_m = radius_m * np.array([math.cos(middle), math.sin(middle)]) - away_m
            inside = np.flatnonzero(cuts & (np.hypot(*place_m.T) < radius_m))
            circle.append(index)
            ends.append((start, stop))
            held.append(first + inside)
            held_count.append(len(inside))
    return (
        np.array(circle, dtype=np.int64),
        np.array(ends),
        np.cumsum(held_count).astype(np.int64),
        np.concatenate(held).astype(np.int64),
    )


def smallest_circle(points_m: FloatArray) -> Circle:
    """Return the smallest circle that holds all points, shape (n, 2).

    Raises
    ------
    ValueError
        If there is no point.
    """
    from layoutopt.circles_kernels import enclosing_circles

    points_m = np.asarray(points_m, dtype=np.float64).reshape(-1, 2)
    if len(points_m) == 0:
        raise ValueError("no points, no circle")
    # A point is an arc of a circle of no radius.
    middle_m, size_m = enclosing_circles(
        np.array([0, len(points_m)]),
        np.ascontiguousarray(points_m),
        np.zeros((len(points_m), 2)),
        0.0,
        _slack_m(points_m, 0.0),
    )
    return Circle(centre_m=(float(middle_m[0, 0]), float(middle_m[0, 1])), radius_m=float(size_m[0]))


def feasible_circle(read_m: FloatArray, silent_m: FloatArray, radius_m: float) -> Circle | None:
    """Return the smallest circle round all places within reach of some points and of none of others.

    Parameters
    ----------
    read_m, silent_m
        Points within and not within ``radius_m`` of the places, shapes (n, 2) and (m, 2), no two at one place.
    radius_m
        Reach.

    Returns
    -------
    Circle or None
        ``None`` if there is no such place. Its centre is the estimate of a place with the least worst error, and
        its radius is that error.

    Raises
    ------
    ValueError
        If nothing is read, which bounds no place, or the radius is not positive and finite.
    """
    from layoutopt.circles_kernels import arcs, enclosing_circles

    read_m = np.asarray(read_m, dtype=np.float64).reshape(-1, 2)
    silent_m = np.asarray(silent_m, dtype=np.float64).reshape(-1, 2)
    if len(read_m) == 0:
        raise ValueError("without a read point the places have no bound")
    if not 0.0 < radius_m < math.inf:
        raise ValueError(f"a radius must be positive and finite, got {radius_m}")
    points_m = np.concatenate([read_m, silent_m])
    distance_m = np.hypot(*(points_m[:, None] - points_m[None]).transpose(2, 0, 1))
    close = (distance_m < 2.0 * radius_m) & ~np.eye(len(points_m), dtype=np.bool_)
    other = np.nonzero(close)[1]
    start = np.concatenate([[0], np.cumsum(close.sum(axis=1))]).astype(np.int64)
    circle, ends_rad, held_start, held = arcs(points_m, start, points_m[other], radius_m)
    # The region lies inside the circles of what is read and outside those of what is silent.
    arc = np.repeat(np.arange(len(circle)), np.diff(held_start))
    held_read = np.bincount(arc, weights=other[held] < len(read_m), minlength=len(circle))
    held_silent = np.bincount(arc, weights=other[held] >= len(read_m), minlength=len(circle))
    own_read = circle < len(read_m)
    border = (held_silent == 0) & (held_read + own_read == len(read_m))
    if not border.any():
        return None
    middle_m, size_m = enclosing_circles(
        np.array([0, int(border.sum())]),
        points_m[circle[border]],
        ends_rad[border],
        radius_m,
        _slack_m(points_m, radius_m),
    )
    return Circle(centre_m=(float(middle_m[0, 0]), float(middle_m[0, 1])), radius_m=float(size_m[0]))


def _slack_m(points_m: FloatArray, radius_m: float) -> float:
    """Return how far rounding may move a point: a few thousand units in the last place of the largest number."""
    return 1e-12 * (float(np.abs(points_m).max(initial=0.0)) + radius_m)
