"""The sensor model of UHF strengths, learned on a grid about an antenna from calibration drives."""

import math
from dataclasses import dataclass, field
from typing import Final, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from layoutopt.identity import FloatArray, by_content

STRENGTH_SPAN_DB: Final = 60.0
"""UHF readers tell strengths of about -80 to -20 dBm: where nothing is known of one, it is even over these."""
STRENGTH_STEP_DB: Final = 0.5
"""Step in which readers of the class that liang2020 uses tell strengths; no spread is known better."""
LARGEST_GRID: Final = 4_000_000
"""Cells of a model, about those of 500 m x 500 m in cells of 0.25 m: more is a place that is not one."""


@by_content
@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SensorModel:
    """Chance of a detection and strength of the answer, cell by cell, in the antenna's frame (x ahead, y left).

    Attributes
    ----------
    cell_m
        Side of a cell.
    origin_m
        Lower corner, x and y, of the cell (0, 0).
    detection
        Share of detections among readings (Eq. 3), shape (columns, rows); NaN in cells that no reading fell into.
    mean_dbm, sigma_db
        Mean and standard deviation of the strengths of detections (Eq. 4), same shape; NaN in cells without one.
    readings
        Number of readings in each cell, same shape.

    Raises
    ------
    ValueError
        If a cell has no size, the arrays differ in shape or contradict each other, or there is but one cell.

    References
    ----------
    liang2020, Eq. 2-4 and Fig. 3.
    """

    cell_m: float
    origin_m: tuple[float, float]
    detection: FloatArray
    mean_dbm: FloatArray
    sigma_db: FloatArray
    readings: FloatArray
    key: str = field(init=False, repr=False, default="")

    def __post_init__(self) -> None:
        """Freeze the arrays and check that they fit."""
        if not 0.0 < self.cell_m < math.inf:
            raise ValueError(f"a cell has a positive, finite side, got {self.cell_m!r}")
        names = ("detection", "mean_dbm", "sigma_db", "readings")
        for name in names:
            grid = np.array(getattr(self, name), dtype=np.float64, order="C")
            grid[np.isnan(grid)] = np.nan  # One NaN of many, so that equal models have one key.
            grid.setflags(write=False)
            object.__setattr__(self, name, grid)
        shapes = {getattr(self, name).shape for name in names}
        if len(shapes) != 1 or len(self.detection.shape) != 2:
            raise ValueError(f"a sensor model needs four grids of one shape, got {sorted(shapes)}")
        if self.detection.size < 2:
            raise ValueError(
                f"a sensor model of {self.detection.size} cell tells no place from another: calibrate with "
                f"readings from more places, or with cells smaller than {self.cell_m:g} m"
            )
        object.__setattr__(self, "origin_m", tuple(float(value) for value in self.origin_m))
        visited, heard = self.readings > 0.0, np.nan_to_num(self.detection) > 0.0
        if not (
            len(self.origin_m) == 2
            and np.isfinite(self.origin_m).all()
            and np.isfinite(self.readings).all()
            and np.array_equal(visited, ~np.isnan(self.detection))
            and bool(((self.detection[visited] >= 0.0) & (self.detection[visited] <= 1.0)).all())
            and np.array_equal(heard, np.isfinite(self.mean_dbm))
            and np.array_equal(heard, np.isfinite(self.sigma_db))
            and bool((self.sigma_db[heard] > 0.0).all())
        ):
            raise ValueError(
                "the grids of a sensor model contradict each other: a share of 0 to 1 where there are readings, a "
                "finite mean and a positive standard deviation where the share is positive, NaN elsewhere"
            )


class SensorTables(NamedTuple):
    """Logarithms of a model's likelihood, with a ring of cells about the grid for all places off it.

    Attributes
    ----------
    origin_m, cell_m
        Lower corner of the ring's cell (0, 0), shape (2,), and side of a cell.
    log_missed
        Log of the chance that a tag is not heard, shape (columns + 2, rows + 2).
    log_heard
        Log of the chance that it is, times the peak of the density of its strength, same shape.
    mean_dbm, per_sigma
        Mean of the strength, and one over its standard deviation; 0 where strengths are even.
    """

    origin_m: FloatArray
    cell_m: float
    log_missed: FloatArray
    log_heard: FloatArray
    mean_dbm: FloatArray
    per_sigma: FloatArray


def learn_sensor_model(
    places_m: ArrayLike,
    strengths_dbm: ArrayLike,
    *,
    cell_m: float = 0.25,
    sigma_floor_db: float = STRENGTH_STEP_DB,
) -> SensorModel:
    """Return the sensor model that readings of calibration drives teach.

    The variance of a cell's strengths is drawn towards that within all cells with the weight of one reading, so
    that a cell with one detection has the common variance and one with many its own.

    Parameters
    ----------
    places_m
        Where the tag was, in the frame of the antenna that read, shape (n, 2), m.
    strengths_dbm
        Strength of its answer, NaN where it was not detected, shape (n,), dBm.
    cell_m
        Side of a cell; cells are counted from the antenna.
    sigma_floor_db
        Least standard deviation of a cell's strengths.

    Raises
    ------
    ValueError
        If there are no readings, none is a detection, all lie in one cell, a place is not finite, a strength is
        infinite, or the shapes differ.

    References
    ----------
    liang2020, Eq. 2-4: a grid of shares of detection, and of Gaussian strengths.

    Examples
    --------
    >>> model = learn_sensor_model([[0.1, 0.1], [0.1, 0.2], [0.3, 0.1]], [-50.0, -52.0, math.nan])
    >>> model.detection.ravel().tolist(), model.mean_dbm[0, 0].item()
    ([1.0, 0.0], -51.0)
    """
    if not 0.0 < cell_m < math.inf:
        raise ValueError(f"a cell has a positive, finite side, got {cell_m!r}")
    if not 0.0 < sigma_floor_db < math.inf:
        raise ValueError(f"sigma_floor_db must be positive and finite, got {sigma_floor_db!r}")
    place_m, strength_dbm = _places(places_m), np.asarray(strengths_dbm, dtype=np.float64)
    if strength_dbm.shape != (len(place_m),):
        raise ValueError(f"{len(place_m)} places need as many strengths, got the shape {strength_dbm.shape}")
    if len(place_m) == 0:
        raise ValueError("a sensor model cannot be learned from no readings: give those of calibration drives")
    if np.isinf(strength_dbm).any():
        raise ValueError("a strength is finite, or NaN where the tag was not detected")
    detected = ~np.isnan(strength_dbm)
    if not detected.any():
        raise ValueError(
            f"none of {len(place_m)} calibration readings detected the tag: nothing can be learned of its strength"
        )
    cell = np.floor(place_m / cell_m)
    first = cell.min(axis=0)
    sizes = cell.max(axis=0) - first + 1.0
    if sizes.prod() > LARGEST_GRID:
        raise ValueError(
            f"places as far apart as {(sizes * cell_m).max():.4g} m make more than {LARGEST_GRID} cells: look for "
            "a place that is wrong, or take larger cells"
        )
    shape = (int(sizes[0]), int(sizes[1]))
    number = np.ravel_multi_index(tuple((cell - first).astype(np.int64).T), shape)
    readings = np.bincount(number, minlength=shape[0] * shape[1]).astype(np.float64)
    heard_in, heard_dbm = number[detected], strength_dbm[detected]
    detections = np.bincount(heard_in, minlength=len(readings)).astype(np.float64)
    with np.errstate(invalid="ignore"):
        mean_dbm = np.bincount(heard_in, heard_dbm, len(readings)) / detections
    squares = np.bincount(heard_in, (heard_dbm - mean_dbm[heard_in]) ** 2, len(readings))
    freedom = len(heard_dbm) - int((detections > 0.0).sum())
    common_db2 = float(squares.sum()) / freedom if freedom else float(heard_dbm.var())
    sigma_db = np.maximum(np.sqrt((squares + common_db2) / np.maximum(detections, 1.0)), sigma_floor_db)
    return SensorModel(
        cell_m=cell_m,
        origin_m=(float(first[0] * cell_m), float(first[1] * cell_m)),
        detection=np.divide(
            detections, readings, out=np.full(len(readings), np.nan), where=readings > 0.0
        ).reshape(shape),
        mean_dbm=mean_dbm.reshape(shape),
        sigma_db=np.where(detections > 0.0, sigma_db, np.nan).reshape(shape),
        readings=readings.reshape(shape),
    )


def sensor_tables(model: SensorModel) -> SensorTables:
    """Return the logarithms of a model's likelihood, complete: no NaN, and no chance of nought.

    Eq. 2-4 say nothing of what follows. A share of nought or one among n readings counts as 1 / (n + 2) or one
    less that (Laplace's rule of succession). A cell that no reading fell into is taken for the nearest one with
    readings. Where the tag was never detected, its strength is even over 60 dB. Off the grid, where no
    calibration drive came, it is taken to be out of range: as in a cell with as many readings as all cells
    together and no detection.
    """
    from scipy.ndimage import distance_transform_edt

    _, places = distance_transform_edt(model.readings == 0.0, return_indices=True)
    nearest = tuple(np.asarray(places))
    readings, share = model.readings[nearest], model.detection[nearest]
    least = 1.0 / (readings + 2.0)
    never = 1.0 / (model.readings.sum() + 2.0)
    share = np.pad(np.clip(share, least, 1.0 - least), 1, constant_values=never)
    mean_dbm, sigma_db = (
        np.pad(grid[nearest], 1, constant_values=np.nan) for grid in (model.mean_dbm, model.sigma_db)
    )
    peak = np.where(np.isnan(sigma_db), 1.0 / STRENGTH_SPAN_DB, 1.0 / (math.sqrt(2.0 * math.pi) * sigma_db))
    return SensorTables(
        origin_m=np.array(model.origin_m) - model.cell_m,
        cell_m=model.cell_m,
        log_missed=np.log1p(-share),
        log_heard=np.log(share) + np.log(peak),
        mean_dbm=np.nan_to_num(mean_dbm),
        per_sigma=np.nan_to_num(1.0 / sigma_db),
    )


def log_likelihood(tables: SensorTables, places_m: FloatArray, strength_dbm: float) -> FloatArray:
    """Return the logarithm of `likelihood` for places, shape (p, 2), from the tables of a model, shape (p,)."""
    shape = np.array(tables.log_missed.shape)
    cell = np.clip(np.floor((places_m - tables.origin_m) / tables.cell_m), 0.0, shape - 1.0).astype(np.int64)
    column, row = cell[:, 0], cell[:, 1]
    if math.isnan(strength_dbm):
        return np.asarray(tables.log_missed[column, row])
    off = (strength_dbm - tables.mean_dbm[column, row]) * tables.per_sigma[column, row]
    return np.asarray(tables.log_heard[column, row] - 0.5 * off * off)


def likelihood(model: SensorModel, places_m: ArrayLike, strength_dbm: float) -> FloatArray:
    """Return how likely one reading is for a tag at each of some places.

    Parameters
    ----------
    model
        The sensor model; see `sensor_tables` for places of which it knows nothing.
    places_m
        Places in the antenna's frame, shape (p, 2), m.
    strength_dbm
        Strength of the tag's answer, a density per dB (Eq. 2), or NaN for none: one less the chance of one.

    Raises
    ------
    ValueError
        If a place is not finite, the shape is wrong or the strength infinite.

    References
    ----------
    liang2020, Eq. 2.
    """
    if math.isinf(strength_dbm):
        raise ValueError("a strength is finite, or NaN where the tag was not detected")
    return np.asarray(np.exp(log_likelihood(sensor_tables(model), _places(places_m), strength_dbm)))


def _places(places_m: ArrayLike) -> FloatArray:
    """Return places as an array of shape (n, 2), checked."""
    place_m = np.asarray(places_m, dtype=np.float64)
    if place_m.size == 0:
        place_m = place_m.reshape(0, 2)
    if place_m.ndim != 2 or place_m.shape[1] != 2:
        raise ValueError(f"places are rows of x and y, got an array of shape {place_m.shape}")
    bad = np.flatnonzero(~np.isfinite(place_m).all(axis=1))
    if len(bad):
        raise ValueError(
            f"{len(bad)} places are not finite, the first in row {bad[0]}: {place_m[bad[0]].tolist()}; leave out "
            "readings of which nobody knows where they were taken"
        )
    return place_m
