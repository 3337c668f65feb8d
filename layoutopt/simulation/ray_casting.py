"""How far one sees: rays against walls and round things, in the plane.

The compiled kernels are in `ray_casting_kernels`; the plain functions here are the truth for them.
"""

from functools import lru_cache
from typing import Final

import numpy as np
import shapely

from layoutopt.identity import BoolArray, FloatArray
from layoutopt.site import Site

CORNER_SHARE: Final = 1e-9
"""Walls are longer at both ends by this share, so that no ray slips through a corner by rounding."""
TOUCH_M: Final = 1e-9
"""What touches a straight way by no more than this does not hide one of its ends from the other."""


@lru_cache(maxsize=64)
def walls_of(site: Site) -> FloatArray:
    """Return every straight piece of wall: the borders of the floor less its obstacles.

    Returns
    -------
    numpy.ndarray
        x and y of start and end, shape (n, 4), m, in the floor frame; read-only, and one array for one site.
    """
    rings = shapely.get_rings(shapely.get_parts(site.open_floor))
    corners_m, ring = shapely.get_coordinates(rings, return_index=True)
    same = ring[1:] == ring[:-1]
    walls_m: FloatArray = np.concatenate([corners_m[:-1], corners_m[1:]], axis=1)[same]
    walls_m.setflags(write=False)
    return walls_m


def cast(
    origins_m: FloatArray, angles_rad: FloatArray, segments_m: FloatArray, discs: FloatArray, range_m: float
) -> FloatArray:
    """Return how far each ray gets before it meets a wall or a disc.

    A ray that begins in a disc gets nowhere. A wall seen exactly edge-on is not seen, its neighbours are.

    Parameters
    ----------
    origins_m, angles_rad
        Where the rays begin, shape (n, 2), m, and their directions in the same frame, shape (n,).
    segments_m
        x and y of start and end of each wall, shape (w, 4), m.
    discs
        x, y and radius of each disc, shape (k, 3), m.
    range_m
        How far a ray can get; may be infinite.

    Returns
    -------
    numpy.ndarray
        Shape (n,), m; infinite where nothing is within range.

    Raises
    ------
    ValueError
        If an array has another shape or holds what is no finite number, a radius is negative, or the range is not
        positive.
    """
    from layoutopt.simulation.ray_casting_kernels import distances

    return distances(*_checked_rays(origins_m, angles_rad, segments_m, discs, range_m))


def plain_cast(
    origins_m: FloatArray, angles_rad: FloatArray, segments_m: FloatArray, discs: FloatArray, range_m: float
) -> FloatArray:
    """Return what `cast` does, every ray against everything in one array."""
    origins_m, angles_rad, segments_m, discs, range_m = _checked_rays(
        origins_m, angles_rad, segments_m, discs, range_m
    )
    ahead_x, ahead_y = np.cos(angles_rad)[:, None], np.sin(angles_rad)[:, None]
    share, away = _crossings(origins_m, ahead_x, ahead_y, segments_m)
    met = (share >= -CORNER_SHARE) & (share <= 1.0 + CORNER_SHARE) & (away >= 0.0)
    to_wall = np.where(met, away, np.inf).min(axis=1, initial=np.inf)
    middle_x, middle_y = (discs[:, axis] - origins_m[:, axis, None] for axis in (0, 1))
    away = disc_distances(ahead_x, ahead_y, middle_x, middle_y, discs[:, 2])
    nearest = np.minimum(to_wall, away.min(axis=1, initial=np.inf))
    return np.where(nearest <= range_m, nearest, np.inf)


def disc_distances(
    ahead_x: FloatArray,
    ahead_y: FloatArray,
    middle_x: FloatArray,
    middle_y: FloatArray,
    radius_m: FloatArray | float,
) -> FloatArray:
    """Return how far rays from the origin get before they meet discs, infinite for those that miss, m.

    Directions as unit vectors, middles and radii are arrays that broadcast against each other.
    """
    before = middle_x * ahead_x + middle_y * ahead_y
    beside = middle_x * ahead_y - middle_y * ahead_x
    reach = radius_m * radius_m - beside * beside
    away = np.maximum(before - np.sqrt(np.maximum(reach, 0.0)), 0.0)
    away = np.where((before > 0.0) & (reach > 0.0), away, np.inf)
    return np.where(middle_x * middle_x + middle_y * middle_y < radius_m * radius_m, 0.0, away)


def visible(from_m: FloatArray, to_m: FloatArray, segments_m: FloatArray, discs: FloatArray) -> BoolArray:
    """Return which straight ways no wall crosses and no disc covers.

    What touches a way by `TOUCH_M` at most does not count, so that a thing on a wall is seen; an end within a disc
    is hidden by it. A wall along the way hides nothing, but its neighbours do.

    Parameters
    ----------
    from_m, to_m
        Ends of each way, shape (n, 2), m.
    segments_m, discs
        As in `cast`.

    Returns
    -------
    numpy.ndarray
        True where one end sees the other, shape (n,).

    Raises
    ------
    ValueError
        If an array has another shape or holds what is no finite number, or a radius is negative.
    """
    from layoutopt.simulation.ray_casting_kernels import sights

    return sights(*_checked_ways(from_m, to_m, segments_m, discs))


def plain_visible(from_m: FloatArray, to_m: FloatArray, segments_m: FloatArray, discs: FloatArray) -> BoolArray:
    """Return what `visible` does, every way against everything in one array."""
    from_m, to_m, segments_m, discs = _checked_ways(from_m, to_m, segments_m, discs)
    ways_m = to_m - from_m
    length = np.sqrt(ways_m[:, 0] * ways_m[:, 0] + ways_m[:, 1] * ways_m[:, 1])
    length[length <= TOUCH_M] = 0.0
    ahead = np.divide(ways_m, length[:, None], out=np.zeros_like(ways_m), where=length[:, None] > 0.0)
    ahead_x, ahead_y, length = ahead[:, :1], ahead[:, 1:], length[:, None]
    share, away = _crossings(from_m, ahead_x, ahead_y, segments_m)
    crossed = (share >= -CORNER_SHARE) & (share <= 1.0 + CORNER_SHARE)
    crossed &= (away > TOUCH_M) & (away < length - TOUCH_M)
    middle_x, middle_y = (discs[:, axis] - from_m[:, axis, None] for axis in (0, 1))
    before = np.minimum(np.maximum(middle_x * ahead_x + middle_y * ahead_y, 0.0), length)
    off_x, off_y = middle_x - before * ahead_x, middle_y - before * ahead_y
    covered = np.sqrt(off_x * off_x + off_y * off_y) < discs[:, 2] - TOUCH_M
    return np.asarray(~(crossed.any(axis=1) | covered.any(axis=1)))


def warm_up() -> None:
    """Compile, or load from the cache, the kernels of rays and sight."""
    place_m, wall_m, disc = np.zeros((1, 2)), np.ones((1, 4)), np.ones((1, 3))
    cast(place_m, np.zeros(1), wall_m, disc, 1.0)
    visible(place_m, place_m, wall_m, disc)


def _crossings(
    origins_m: FloatArray, ahead_x: FloatArray, ahead_y: FloatArray, segments_m: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return where rays cross the lines of walls: share along the wall, way along the ray; NaN for parallels."""
    start_x, start_y = (segments_m[:, axis] - origins_m[:, axis, None] for axis in (0, 1))
    along_x, along_y = segments_m[:, 2] - segments_m[:, 0], segments_m[:, 3] - segments_m[:, 1]
    turn = ahead_x * along_y - ahead_y * along_x
    turn = np.where(turn == 0.0, np.nan, turn)
    return (start_x * ahead_y - start_y * ahead_x) / turn, (start_x * along_y - start_y * along_x) / turn


def _checked_rays(
    origins_m: FloatArray, angles_rad: FloatArray, segments_m: FloatArray, discs: FloatArray, range_m: float
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray, float]:
    if not range_m > 0.0:
        raise ValueError(f"range_m must be positive, got {range_m!r}")
    origins_m = _finite("origins_m", origins_m, 2)
    angles_rad = _finite("angles_rad", angles_rad)
    if len(origins_m) != len(angles_rad):
        raise ValueError(f"{len(angles_rad)} directions of rays but {len(origins_m)} places where they begin")
    return origins_m, angles_rad, _finite("segments_m", segments_m, 4), _radii_checked(discs), float(range_m)


def _checked_ways(
    from_m: FloatArray, to_m: FloatArray, segments_m: FloatArray, discs: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray]:
    from_m, to_m = _finite("from_m", from_m, 2), _finite("to_m", to_m, 2)
    if len(from_m) != len(to_m):
        raise ValueError(f"{len(from_m)} starts of straight ways but {len(to_m)} ends")
    return from_m, to_m, _finite("segments_m", segments_m, 4), _radii_checked(discs)


def _radii_checked(discs: FloatArray) -> FloatArray:
    discs = _finite("discs", discs, 3)
    if (discs[:, 2] < 0.0).any():
        raise ValueError(f"the radius of disc {int(np.argmin(discs[:, 2]))} is negative: {discs[:, 2].min()!r} m")
    return discs


def _finite(name: str, values: FloatArray, columns: int = 0) -> FloatArray:
    """Return rows of finite numbers, each of so many columns (0: a number alone)."""
    array = np.ascontiguousarray(values, dtype=np.float64)
    if columns and array.size == 0:
        array = array.reshape(0, columns)
    if array.ndim != (2 if columns else 1) or (columns and array.shape[1] != columns):
        raise ValueError(f"{name} has shape {array.shape}, needed is {f'(n, {columns})' if columns else '(n,)'}")
    if not np.isfinite(array).all():
        row = int(np.argwhere(~np.isfinite(array))[0, 0])
        raise ValueError(f"row {row} of {name} holds no finite number: {array[row]!r}; every place must be known")
    # Kernels are compiled anew for arrays that cannot be written to, such as walls; so none here can.
    array = array.view()
    array.setflags(write=False)
    return array
