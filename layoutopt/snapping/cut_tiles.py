"""Floor tiles that a wall cuts: which ones, and what is left of each."""

from dataclasses import dataclass
from typing import Final

import numpy as np
import shapely

from layoutopt.geometry import turned
from layoutopt.identity import FloatArray, IntArray
from layoutopt.site import Site, Tiling

_WHOLE: Final = 1e-6
"""Share of a tile by which it may be cut and count as whole, or be left and count as gone: a wall on a joint."""
_AROUND: Final = np.array([(column, row) for column in (-1, 0, 1) for row in (-1, 0, 1)])


@dataclass(frozen=True, slots=True, kw_only=True)
class CutTile:
    """A floor tile of which less than the whole lies on the floor.

    Attributes
    ----------
    column, row
        Its place in the tiling.
    width_m, height_m
        Sides of the smallest rectangle, along the tile's own sides, that holds what is left.
    share
        What is left, of the area of a whole tile.
    middle_m
        Centre of that rectangle in the floor frame.
    """

    column: int
    row: int
    width_m: float
    height_m: float
    share: float
    middle_m: tuple[float, float]


def cut_tiles(site: Site) -> tuple[CutTile, ...]:
    """Return the cut tiles of a site by row and column; none without a tiling.

    Walls are the edges of the floor, its holes included; obstacles stand on the tiles and cut none.
    """
    tiling = site.tiling
    if tiling is None:
        return ()
    floor = shapely.transform(site.floor, lambda xy_m: in_tiling(xy_m, tiling))
    found = []
    for column, row in _at_edges(shapely.segmentize(floor.boundary, tiling.size_m / 2.0), tiling.size_m).tolist():
        left, low = column * tiling.size_m, row * tiling.size_m
        visible = floor.intersection(shapely.box(left, low, left + tiling.size_m, low + tiling.size_m))
        share = visible.area / tiling.size_m**2
        if not _WHOLE < share < 1.0 - _WHOLE:
            continue
        # A wall along a joint gives lines beside the areas.
        areas = [part for part in shapely.get_parts(visible) if part.geom_type == "Polygon"]
        xmin, ymin, xmax, ymax = shapely.total_bounds(areas).tolist()
        middle_m = on_floor(np.array((xmin + xmax, ymin + ymax)) / 2.0, tiling)
        found.append(
            CutTile(
                column=column,
                row=row,
                width_m=xmax - xmin,
                height_m=ymax - ymin,
                share=float(share),
                middle_m=(float(middle_m[0]), float(middle_m[1])),
            )
        )
    return tuple(sorted(found, key=lambda tile: (tile.row, tile.column)))


def in_tiling(xy_m: FloatArray, tiling: Tiling) -> FloatArray:
    """Return points of the floor frame, shape (..., 2), in the frame of the tiling: its origin, along its rows."""
    return turned(np.asarray(xy_m) - tiling.origin_m, -tiling.angle_rad)


def on_floor(local_m: FloatArray, tiling: Tiling) -> FloatArray:
    """Return points of the tiling's frame, shape (..., 2), in the floor frame."""
    return turned(local_m, tiling.angle_rad) + tiling.origin_m


def _at_edges(boundary: shapely.Geometry, size_m: float) -> IntArray:
    """Return column and row of all tiles that a boundary may cross, shape (n, 2).

    Its corners lie at most half a tile apart, so each crossed tile holds one or is a neighbour of one that does.
    """
    tiles = np.floor(shapely.get_coordinates(boundary) / size_m).astype(np.int64)
    return np.unique((np.unique(tiles, axis=0)[:, None, :] + _AROUND).reshape(-1, 2), axis=0)
