"""Where a tag may lie on a real floor: joints of the floor tiles, their centres, a grid, or listed places."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from layoutopt.geometry import covers, lattice_points, turned
from layoutopt.identity import FloatArray, IntArray
from layoutopt.layout import PLAIN_TAG, WHOLE_FLOOR
from layoutopt.site import Site, Tiling


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Slots:
    """Allowed places of tags.

    Attributes
    ----------
    kind
        ``"joints"``, ``"centres"``, ``"grid"`` or ``"listed"``.
    xy_m
        Places in the floor frame, shape (n, 2), m.
    place
        Column and row of each on its grid, shape (n, 2); ``None`` for listed places.
    pitch_m
        Distance of neighbours on the grid; ``None`` for listed places.
    tag_part
        Item of the price list whose tags may lie there.
    """

    kind: str
    xy_m: FloatArray
    place: IntArray | None = None
    pitch_m: float | None = None
    tag_part: str = PLAIN_TAG

    def __len__(self) -> int:
        """Return the number of slots."""
        return len(self.xy_m)


def joint_slots(site: Site, margin_m: float, *, tag_part: str = PLAIN_TAG) -> Slots:
    """Return the corners of floor tiles at which a tag of a part may lie.

    ``margin_m`` is what a tag's centre keeps from walls, obstacles and zones that bar such tags, half its longer
    side.

    Raises
    ------
    ValueError
        If the site has no floor tiles.
    """
    tiling = _tiling(site)
    return _on_grid(site, "joints", tiling.size_m, tiling.origin_m, tiling.angle_rad, margin_m, tag_part)


def centre_slots(site: Site, margin_m: float, *, tag_part: str = PLAIN_TAG) -> Slots:
    """Return the centres of floor tiles at which a tag may lie; margin, part and errors as for `joint_slots`."""
    tiling = _tiling(site)
    half_m = turned(np.array((0.5, 0.5)) * tiling.size_m, tiling.angle_rad)
    origin_m = (tiling.origin_m[0] + float(half_m[0]), tiling.origin_m[1] + float(half_m[1]))
    return _on_grid(site, "centres", tiling.size_m, origin_m, tiling.angle_rad, margin_m, tag_part)


def grid_slots(
    site: Site,
    pitch_m: float,
    margin_m: float,
    *,
    origin_m: tuple[float, float] = (0.0, 0.0),
    angle_rad: float = 0.0,
    tag_part: str = PLAIN_TAG,
) -> Slots:
    """Return the places of a square grid at which a tag may lie; margin and part as for `joint_slots`.

    Raises
    ------
    ValueError
        If the pitch is not positive.
    """
    if not pitch_m > 0.0:
        raise ValueError(f"the pitch of slots must be positive, got {pitch_m}")
    return _on_grid(site, "grid", pitch_m, origin_m, angle_rad, margin_m, tag_part)


def listed_slots(
    site: Site, xy_m: Sequence[Sequence[float]] | FloatArray, margin_m: float, *, tag_part: str = PLAIN_TAG
) -> Slots:
    """Return listed places as slots; margin and part as for `joint_slots`.

    Raises
    ------
    ValueError
        If a place is one where no tag may lie, with the first of them and their number.
    """
    places_m = np.asarray(xy_m, dtype=np.float64).reshape(-1, 2)
    if not np.isfinite(places_m).all():
        raise ValueError("a place is no pair of finite numbers")
    region = site.taggable_region(WHOLE_FLOOR, margin_m, tag_part)
    outside = np.flatnonzero(~covers(region, places_m))
    if len(outside):
        x_m, y_m = places_m[outside[0]]
        why = site.why_barred(places_m[outside[:1]], margin_m, tag_part)[0]
        raise ValueError(
            f"{len(outside)} of {len(places_m)} places are off the floor, on an obstacle or where no tag may lie, "
            f"the first at ({x_m:g}, {y_m:g}) m: {why}"
        )
    return Slots(kind="listed", xy_m=places_m, tag_part=tag_part)


def _tiling(site: Site) -> Tiling:
    if site.tiling is None:
        raise ValueError(f"site '{site.name}' has no floor tiles, so it has no joints and centres")
    return site.tiling


def _on_grid(
    site: Site,
    kind: str,
    pitch_m: float,
    origin_m: tuple[float, float],
    angle_rad: float,
    margin_m: float,
    tag_part: str,
) -> Slots:
    region = site.taggable_region(WHOLE_FLOOR, margin_m, tag_part)
    if region.is_empty:
        place = np.empty((0, 2), dtype=np.int64)
        return Slots(kind=kind, xy_m=np.empty((0, 2)), place=place, pitch_m=pitch_m, tag_part=tag_part)
    xmin, ymin, xmax, ymax = region.bounds
    corners_m = np.array([(xmin, ymin), (xmin, ymax), (xmax, ymin), (xmax, ymax)]) - origin_m
    local_m = turned(corners_m, -angle_rad)
    low_m, high_m = local_m.min(axis=0), local_m.max(axis=0)
    on_grid_m = lattice_points(np.zeros((1, 2)), pitch_m * np.eye(2), (low_m[0], low_m[1], high_m[0], high_m[1]))
    xy_m = turned(on_grid_m, angle_rad) + origin_m
    inside = covers(region, xy_m)
    place = np.round(on_grid_m / pitch_m).astype(np.int64)
    return Slots(kind=kind, xy_m=xy_m[inside], place=place[inside], pitch_m=pitch_m, tag_part=tag_part)
