"""From free cells of an image to polygons, in units of one cell."""

from typing import Final

import numpy as np
import shapely
from shapely.geometry import MultiPolygon, Polygon

from layoutopt.errors import InvalidInput
from layoutopt.identity import BoolArray, FloatArray, IntArray
from layoutopt.plans.floor import check_extents, check_region

_MOST_CORNERS: Final = 100_000
_SMALL_HOLE_CELLS: Final = 25.0
_LARGEST_AREA_CHANGE: Final = 0.01


def check_cells(free: BoolArray, cell_m: float, place: str) -> None:
    """Check the extents of free cells while they are still whole numbers, before any geometry.

    Raises
    ------
    InvalidInput
        If the sides are not within 0.5 m to 1000 m.
    """
    rows, columns = np.flatnonzero(free.any(axis=1)), np.flatnonzero(free.any(axis=0))
    low, high = (columns[0], rows[0]), (columns[-1] + 1, rows[-1] + 1)
    check_extents((low[0] * cell_m, low[1] * cell_m, high[0] * cell_m, high[1] * cell_m), place)


def floor_of_cells(
    free: BoolArray,
    cell_m: float,
    origin: tuple[float, float, float],
    *,
    tolerance_m: float | None,
    minimum_area_m2: float,
    place: str,
) -> tuple[Polygon | MultiPolygon, list[str]]:
    """Return the free cells of an image as a floor, and what was simplified and left out.

    Parameters
    ----------
    free
        Shape (height, width), bottom row first, as for `outlines`; their extents were checked.
    cell_m, origin
        Side of a cell, and where its lower left corner lies, as for `placed`.
    tolerance_m
        How far a point of an outline may move, as for `simplified`.
    minimum_area_m2
        Parts below it are left out.

    Raises
    ------
    InvalidInput
        If no part has that area, or the floor's sides are not within 0.5 m to 1000 m.
    """
    parts = outlines(free, place)
    kept = [part for part in parts if part.area * cell_m**2 >= minimum_area_m2]
    if not kept:
        raise InvalidInput.at(
            place,
            f"the largest free part has {parts[0].area * cell_m**2:.3g} m²",
            f"At least {minimum_area_m2:g} m² are needed; check the resolution.",
        )
    exact = MultiPolygon(kept)
    simple, used_cells = simplified(exact, None if tolerance_m is None else tolerance_m / cell_m)
    floor = placed(simple, cell_m, origin)
    check_region(floor, place)
    check_extents(floor.bounds, place)
    notes = [
        f"floor {floor.area:.2f} m² in {len(kept)} part(s)",
        f"outlines simplified within {used_cells * cell_m:.3g} m, which changed the area by "
        f"{100.0 * (simple.area / exact.area - 1.0):+.3f} %",
    ]
    if len(kept) < len(parts):
        dropped_m2 = sum(part.area for part in parts[len(kept) :]) * cell_m**2
        notes.append(
            f"left out {len(parts) - len(kept)} free part(s) below {minimum_area_m2:g} m², "
            f"{dropped_m2:.4g} m² together"
        )
    return floor, notes


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
