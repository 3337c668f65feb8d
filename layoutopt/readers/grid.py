"""Antennas in rows and columns."""

from typing import Final

import numpy as np

from layoutopt.layout import ReaderGroup
from layoutopt.protocols import Mount, ReaderCard
from layoutopt.readers.mounting import mounted

CARD: Final = ReaderCard(
    summary="Rows and columns of antennas centred under the robot; rows run along x.",
    reference="the common product arrangement; own",
)


def grid(*, rows: int, columns: int, spacing_m: float, mount: Mount) -> ReaderGroup:
    """Return ``rows`` times ``columns`` antennas, ``spacing_m`` apart both ways.

    Columns follow one another along x (forward), rows along y (left).

    Raises
    ------
    ValueError
        If a number is not positive.
    """
    if rows < 1 or columns < 1 or not spacing_m > 0.0:
        raise ValueError(f"a grid needs positive numbers, got {rows} × {columns} at {spacing_m} m")
    x_m = (np.arange(columns) - (columns - 1) / 2.0) * spacing_m
    y_m = (np.arange(rows) - (rows - 1) / 2.0) * spacing_m
    xy_m = np.stack(np.meshgrid(x_m, y_m), axis=-1).reshape(-1, 2)
    return mounted("grid", xy_m, mount, {"rows": rows, "columns": columns, "spacing_m": spacing_m})
