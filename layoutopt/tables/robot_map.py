"""The site as an occupancy map for nav2, in the frame of the tag map: ``map.pgm`` and ``map.yaml``.

References
----------
nav2_map_server, ``map_io.cpp``: keys, thresholds, origin as the lower left corner of the image. Its grey values of
free, occupied and unknown cells are 254, 0 and 205.
"""

import math
from pathlib import Path
from typing import Final

import numpy as np

from layoutopt.atomic_file import replacing
from layoutopt.errors import InvalidInput
from layoutopt.geometry import covers
from layoutopt.identity import BoolArray, FloatArray
from layoutopt.site import Site

RESOLUTION_M: Final = 0.05
"""What most maps of service robots have."""
_FREE, _OCCUPIED, _UNKNOWN = 254, 0, 205
_BORDER_CELLS: Final = 2
_MOST_CELLS: Final = 400_000_000
_ROWS_AT_ONCE: Final = 256


def write_robot_map(folder: Path, site: Site, resolution_m: float = RESOLUTION_M) -> tuple[Path, Path]:
    """Write ``map.pgm`` and ``map.yaml`` of a site and return both paths.

    A cell is occupied where a wall or the edge of an obstacle passes through it, or its centre is in an obstacle;
    free where its centre is on open floor; unknown elsewhere. The origin is a multiple of the resolution and its
    yaw is zero, which many users of such maps take for granted.

    Raises
    ------
    InvalidInput
        If the map would have more than 400 million cells.
    """
    xmin, ymin, xmax, ymax = site.bounds_m
    first = [math.floor(low / resolution_m) - _BORDER_CELLS for low in (xmin, ymin)]
    last = [math.ceil(high / resolution_m) + _BORDER_CELLS for high in (xmax, ymax)]
    columns, rows = last[0] - first[0], last[1] - first[1]
    if columns * rows > _MOST_CELLS:
        problem = f"the map has {columns} x {rows} cells of {resolution_m:g} m"
        raise InvalidInput.at("robot map", problem, "Take larger cells.")
    origin_m = np.array(first) * resolution_m
    image = folder / "map.pgm"
    with replacing(image) as temporary, temporary.open("wb") as stream:
        stream.write(f"P5\n{columns} {rows}\n255\n".encode())
        walls = _cells_on_walls(site, origin_m, resolution_m, (rows, columns))
        # The first row of the image is the uppermost of the floor.
        for top in range(rows, 0, -_ROWS_AT_ONCE):
            numbers = np.arange(top - 1, max(top - 1 - _ROWS_AT_ONCE, -1), -1)
            stream.write(_greys(site, origin_m, resolution_m, numbers, columns, walls[numbers]).tobytes())
    text = (
        "image: map.pgm\n"
        "mode: trinary\n"
        f"resolution: {resolution_m:g}\n"
        f"origin: [{origin_m[0] + 0.0:.6f}, {origin_m[1] + 0.0:.6f}, 0.0]\n"
        "negate: 0\n"
        "occupied_thresh: 0.65\n"
        # Below the value of unknown cells, which 0.25 is not.
        "free_thresh: 0.196\n"
    )
    with replacing(folder / "map.yaml") as temporary:
        temporary.write_bytes(text.encode())
    return image, folder / "map.yaml"


def _greys(
    site: Site,
    origin_m: FloatArray,
    resolution_m: float,
    numbers: np.ndarray[tuple[int], np.dtype[np.int64]],
    columns: int,
    walls: BoolArray,
) -> np.ndarray[tuple[int, int], np.dtype[np.uint8]]:
    """Return the grey values of some rows, given by number from the bottom."""
    x_m, y_m = np.meshgrid(
        origin_m[0] + (np.arange(columns) + 0.5) * resolution_m, origin_m[1] + (numbers + 0.5) * resolution_m
    )
    centres_m = np.column_stack([x_m.ravel(), y_m.ravel()])
    on_floor = covers(site.floor, centres_m).reshape(walls.shape)
    open_floor = covers(site.open_floor, centres_m).reshape(walls.shape)
    return np.where(walls | (on_floor & ~open_floor), _OCCUPIED, np.where(open_floor, _FREE, _UNKNOWN)).astype(
        np.uint8
    )


def _cells_on_walls(site: Site, origin_m: FloatArray, resolution_m: float, shape: tuple[int, int]) -> BoolArray:
    """Return the cells through which the border of the open floor passes, row 0 at the bottom."""
    import shapely

    border = shapely.segmentize(site.open_floor.boundary, resolution_m / 4.0)
    cells = np.floor((shapely.get_coordinates(border) - origin_m) / resolution_m).astype(np.int64)
    walls = np.zeros(shape, dtype=np.bool_)
    walls[cells[:, 1], cells[:, 0]] = True
    return walls
