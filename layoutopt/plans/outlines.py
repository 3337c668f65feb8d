"""From free cells of an image to polygons, in units of one cell."""

from typing import Final

import numpy as np
import shapely
from shapely.geometry import MultiPolygon, Polygon

from layoutopt.errors import InvalidInput
from layoutopt.identity import BoolArray, FloatArray, IntArray

_MOST_CORNERS: Final = 100_000
_SMALL_HOLE_CELLS: Final = 25.0
_LARGEST_AREA_CHANGE: Final = 0.01


def outlines(free: BoolArray, place: str) -> list[Polygon]:
    """Return the exact outlines of the free cells, one polygon for each set joined by edges, largest first.

    ``free`` has shape (height, width), bottom row first; cell (row, column) is the unit square with its lower
    left corner at x = column, y = row. Cells that touch at a corner only are not joined.

    Raises
    ------
    InvalidInput
        If the outlines have so many corners that the image must be noise.
    """
    padded = np.pad(free, 1)
    low_left, low_right, high_left, high_right = padded[:-1, :-1], padded[:-1, 1:], padded[1:, :-1], padded[1:, 1:]
    crossing = (low_left == high_right) & (low_right == high_left) & (low_left != low_right)
    corner = crossing | (low_left ^ low_right ^ high_left ^ high_right)
    count = int(corner.sum())
    if count > _MOST_CORNERS:
        raise InvalidInput.at(
            place,
            f"the outlines of the image's free cells have {count} corners",
            f"At most {_MOST_CORNERS} are read; remove the speckle from the image.",
        )
    segments = np.concatenate([_segments(corner, crossing), _segments(corner.T, crossing.T)[:, :, ::-1]])
    lines = np.asarray(shapely.linestrings(segments.astype(np.float64)), dtype=object)
    faces = shapely.get_parts(shapely.polygonize(lines))
    # The lines bound free and other faces alike; a cell within each tells which it is.
    column, row = np.floor(shapely.get_coordinates(shapely.point_on_surface(faces))).astype(np.int64).T
    free_faces = faces[free[row, column]]
    return list(free_faces[np.argsort(-shapely.area(free_faces), kind="stable")])


def simplified(exact: MultiPolygon, tolerance: float | None) -> tuple[MultiPolygon, float]:
    """Return the polygons with fewer corners, and the tolerance in cells that was used.

    Holes of up to 25 cells stay as they are, because a point that moves by one cell would halve them. Without
    a tolerance of its own the call starts with one cell, which straightens the stairs of slanted walls, and
    halves it until the area changes by less than 1 %. Parts and holes never merge (Saalfeld 1999, as in
    GEOS's topology preserving simplifier); a tolerance at which GEOS fails to keep that is halved too.
    """
    small = [
        Polygon(hole) for part in exact.geoms for hole in part.interiors if Polygon(hole).area <= _SMALL_HOLE_CELLS
    ]
    filled = MultiPolygon(
        [
            Polygon(part.exterior, [hole for hole in part.interiors if Polygon(hole).area > _SMALL_HOLE_CELLS])
            for part in exact.geoms
        ]
    )
    small_holes = shapely.union_all(small)
    used = 1.0 if tolerance is None else tolerance
    while used >= 1.0 / 64.0:
        simple = shapely.difference(shapely.simplify(filled, used), small_holes)
        parts = [part for part in shapely.get_parts(simple) if part.area > 0.0]
        change = abs(simple.area / exact.area - 1.0)
        kept = len(parts) == len(exact.geoms) and simple.is_valid
        if kept and (tolerance is not None or change < _LARGEST_AREA_CHANGE):
            return MultiPolygon(parts), used
        used /= 2.0
    return exact, 0.0


def _segments(corner: BoolArray, crossing: BoolArray) -> IntArray:
    """Return the horizontal pieces of the outlines, shape (n, 2, 2) of x and y.

    Along a row of the grid the outline starts and ends at every other corner; a crossing does both.
    """
    row, column = np.nonzero(corner)
    twice = np.where(crossing[row, column], 2, 1)
    ends = np.stack([np.repeat(column, twice), np.repeat(row, twice)], axis=1)
    return ends.reshape(-1, 2, 2)


def placed(region: MultiPolygon, cell_m: float, origin: tuple[float, float, float]) -> Polygon | MultiPolygon:
    """Return a region of cells in metres; ``origin`` is x, y and yaw of the lower left corner of cell (0, 0)."""
    cos, sin = np.cos(origin[2]), np.sin(origin[2])

    def place(corners: FloatArray) -> FloatArray:
        return np.asarray(corners * cell_m @ np.array([[cos, sin], [-sin, cos]]) + origin[:2])

    metric = shapely.transform(region, place)
    return metric.geoms[0] if len(metric.geoms) == 1 else metric
