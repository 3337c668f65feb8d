"""Where on the floor an estimator errs: position errors of many drives by square cells of the floor."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from layoutopt.identity import BoolArray, FloatArray, IntArray
from layoutopt.site import Site

LEAST_DRIVES: Final = 5
"""Fewer drives through a cell give no interval that is worth showing."""
WIDEST_INTERVAL: Final = 0.5
"""A mean is certain if its 95 % interval reaches at most this share of it to either side."""
_MOST_CELLS: Final = 40
"""Along the longer side of a site: cells can still be told apart on paper, and each is crossed by many drives."""
_SIDES_M: Final = (0.1, 0.2, 0.5, 1.0, 2.0, 5.0, 10.0)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ErrorMap:
    """Position errors by cell of the floor; the cell (0, 0) is the lower left one.

    Attributes
    ----------
    origin_m, cell_m
        Lower left corner of the cell (0, 0), and side of a cell, m.
    drives
        How many drives came into each cell, shape (columns, rows).
    mean_m
        Mean over those drives of the mean error of each within the cell, m, NaN where none came.
    standard_error_m
        Of that mean, over drives, m; NaN where fewer than two came.
    drive_count
        How many drives there were.
    """

    origin_m: tuple[float, float]
    cell_m: float
    drives: IntArray
    mean_m: FloatArray
    standard_error_m: FloatArray
    drive_count: int

    @property
    def certain(self) -> BoolArray:
        """Whether a cell's mean can be relied on, shape (columns, rows).

        It is with `LEAST_DRIVES` drives and Student's 95 % interval within `WIDEST_INTERVAL` of the mean.
        """
        # Imported here: it costs more than all the rest of a short command.
        from scipy.special import stdtrit

        certain = self.drives >= LEAST_DRIVES
        half_m = stdtrit(self.drives[certain] - 1, 0.975) * self.standard_error_m[certain]
        certain[certain] = half_m <= WIDEST_INTERVAL * self.mean_m[certain]
        return np.asarray(certain)


def cell_side_m(site: Site) -> float:
    """Return a round side of cells of which at most 40 lie along the longer side of a site, 100 mm or more.

    A site longer than 400 m has cells of 10 m, and more of them.
    """
    xmin, ymin, xmax, ymax = site.bounds_m
    longer_m = max(xmax - xmin, ymax - ymin)
    return next((side_m for side_m in _SIDES_M if side_m * _MOST_CELLS >= longer_m), _SIDES_M[-1])


def error_map(
    site: Site, drives: Sequence[tuple[FloatArray, FloatArray]], *, cell_m: float | None = None
) -> ErrorMap:
    """Return where drives erred; steps of one drive in a cell are one value, since they are not independent.

    Parameters
    ----------
    drives
        True places of a drive, shape (n, 2), m, and the position error at each, shape (n,), m. Errors that are not
        known (NaN) do not count.
    cell_m
        Side of a cell, m; by default `cell_side_m`.

    Raises
    ------
    ValueError
        If the side is not positive, the columns of a drive differ in length, or a place lies beyond the bounds of
        the site.
    """
    side_m = cell_side_m(site) if cell_m is None else cell_m
    if not side_m > 0.0:
        raise ValueError(f"cells need a positive side, got {side_m!r} m")
    low_m, high_m = np.array(site.bounds_m[:2]), np.array(site.bounds_m[2:])
    shape = np.maximum(1, np.ceil((high_m - low_m) / side_m - 1e-9)).astype(np.int64)
    size = int(shape.prod())
    count, average_m, squares_m2 = np.zeros(size, dtype=np.int64), np.zeros(size), np.zeros(size)
    for places_m, errors_m in drives:
        if len(places_m) != len(errors_m):
            raise ValueError(f"a drive of {len(places_m)} places and {len(errors_m)} errors")
        known = np.isfinite(errors_m)
        within = (places_m[known] >= low_m) & (places_m[known] <= high_m)
        if not within.all():
            x_m, y_m = places_m[known][int(np.flatnonzero(~within.all(axis=1))[0])]
            raise ValueError(f"a drive leaves the bounds of site '{site.name}' at ({x_m:g}, {y_m:g}) m")
        # The upper edges belong to the last cells.
        cells = np.minimum((places_m[known] - low_m) // side_m, shape - 1).astype(np.int64)
        flat = cells[:, 0] * shape[1] + cells[:, 1]
        steps = np.bincount(flat, minlength=size)
        came = steps > 0
        own_m = np.bincount(flat, weights=errors_m[known], minlength=size)[came] / steps[came]
        # Welford's update, which does not lose the spread of nearly equal values (Technometrics 4, 1962, 419).
        count[came] += 1
        off_m = own_m - average_m[came]
        average_m[came] += off_m / count[came]
        squares_m2[came] += off_m * (own_m - average_m[came])
    mean_m = np.where(count > 0, average_m, np.nan)
    standard_error_m = np.full(size, np.nan)
    several = count > 1
    standard_error_m[several] = np.sqrt(squares_m2[several] / (count[several] * (count[several] - 1)))
    return ErrorMap(
        origin_m=(float(low_m[0]), float(low_m[1])),
        cell_m=side_m,
        drives=count.reshape(shape),
        mean_m=mean_m.reshape(shape),
        standard_error_m=standard_error_m.reshape(shape),
        drive_count=len(drives),
    )
