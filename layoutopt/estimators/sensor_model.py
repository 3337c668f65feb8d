"""The sensor model of UHF strengths, learned on a grid about an antenna from calibration drives."""

from dataclasses import dataclass, field

from layoutopt.identity import FloatArray, by_content, read_only


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
        If a cell has no size or the arrays differ in shape.

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
        if not self.cell_m > 0.0:
            raise ValueError(f"a cell has a positive side, got {self.cell_m!r}")
        for name in ("detection", "mean_dbm", "sigma_db", "readings"):
            object.__setattr__(self, name, read_only(getattr(self, name)))
        shapes = {getattr(self, name).shape for name in ("detection", "mean_dbm", "sigma_db", "readings")}
        if len(shapes) != 1 or len(self.detection.shape) != 2:
            raise ValueError(f"a sensor model needs four grids of one shape, got {sorted(shapes)}")
