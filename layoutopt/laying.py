"""Laying floor tags on a site: patterns cut to where tags may lie, kept apart where they meet, then edited."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import lru_cache
from typing import TYPE_CHECKING, Final

import numpy as np
from shapely.geometry.base import BaseGeometry

from layoutopt.geometry import covers, points_inside
from layoutopt.identity import FloatArray, IntArray, read_only
from layoutopt.layout import INSTALLED, WHOLE_FLOOR, EditKind, FloorTags, TagEdit, TagMap, ZonePattern

if TYPE_CHECKING:
    from layoutopt.site import Site

EDIT_M: Final = 1e-6
"""An edit names its tag by its place, to this distance."""


@lru_cache(maxsize=64)
def laid(floor_tags: FloorTags, site: "Site") -> TagMap:
    """Return the tags of an arrangement on a site; see `layoutopt.layout.FloorTags.lay_on`."""
    installed = floor_tags.installed
    planned_m = _planned(floor_tags, site)
    first = 0 if installed is None else len(installed.ids)
    if installed is not None:
        planned_m = np.concatenate([installed.xy_m, planned_m])
    before = [INSTALLED] * first + ["planned"] * (len(planned_m) - first)
    left, xy_m, status = _edited(planned_m, before, floor_tags.edits)
    return TagMap(
        ids=left + 1 if installed is None else _counted_on(installed.ids, left),
        xy_m=read_only(xy_m, (-1, 2)),
        tile=site.tile_of(xy_m),
        zone=site.zone_of(xy_m),
        sigma_m=np.full(len(xy_m), floor_tags.placement_sigma_m),
        status=status,
        uid=(None,) * len(xy_m),
    )


def named_places(floor_tags: FloorTags, site: "Site") -> FloatArray:
    """Return the place by which an edit names each tag, shape (n, 2), m; that of tag i in row i - 1.

    These are the places of installed tags, with NaN for numbers that none has, then those that the patterns give,
    then those where edits added tags.
    """
    added = tuple(edit for edit in floor_tags.edits if edit.kind is EditKind.ADDED)
    tags = laid(replace(floor_tags, edits=added), site)
    places_m = np.full((tags.ids.max(initial=0), 2), np.nan)
    places_m[tags.ids - 1] = tags.xy_m
    return places_m


def left_out(floor_tags: FloorTags, site: "Site") -> FloatArray:
    """Return the places on the floor where the patterns give a tag and none is laid, shape (n, 2), m.

    They lie on obstacles, in zones that bar tags, too near one of these or a wall, or too near a tag of a pattern
    that rules; sorted by y, then x.
    """
    from scipy.spatial import cKDTree

    regions = {
        entry.zone: site.floor if entry.zone == WHOLE_FLOOR else site.zone(entry.zone).region
        for entry in floor_tags.zones
    }
    places_m = _in_rows(np.concatenate(list(_pieces(floor_tags, site, regions).values()) or [np.empty((0, 2))]))
    planned_m = _planned(floor_tags, site)
    if not len(places_m) or not len(planned_m):
        return places_m
    distance_m, _ = cKDTree(planned_m).query(places_m, distance_upper_bound=EDIT_M)
    return places_m[np.isinf(distance_m)]


def _planned(floor_tags: FloorTags, site: "Site") -> FloatArray:
    """Return the places of all tags of the patterns before any edit, by y, then x."""
    longest_m = max(floor_tags.tag_size_m)
    regions = {
        entry.zone: site.taggable_region(entry.zone, longest_m / 2.0, floor_tags.tag_part)
        for entry in floor_tags.zones
    }
    pieces = _pieces(floor_tags, site, regions)
    ruling = [pieces[index] for index in sorted(pieces, reverse=True)]
    if floor_tags.installed is None:
        return _in_rows(_apart(ruling, longest_m))
    laid_m = floor_tags.installed.xy_m
    return _in_rows(_apart([laid_m, *ruling], longest_m)[len(laid_m) :])


def _pieces(floor_tags: FloorTags, site: "Site", regions: Mapping[str, BaseGeometry]) -> dict[int, FloatArray]:
    """Return the places that each pattern gives in its region, by the index of its zone, -1 for the floor's."""
    own = {zone.zone for zone in floor_tags.zones}
    pieces = {}
    for entry in floor_tags.zones:
        region = regions[entry.zone]
        if region.is_empty:
            continue
        xy_m = points_inside(_placed(entry, region.bounds), region)
        if floor_tags.installed is not None:
            xy_m = xy_m[~covers(floor_tags.installed.area, xy_m)]
        # A tag on the border of two patterns belongs to one of them.
        index = -1 if entry.zone == WHOLE_FLOOR else site.zone_names.index(entry.zone)
        pieces[index] = xy_m[site.zone_of(xy_m, own) == index]
    return pieces


def _in_rows(xy_m: FloatArray) -> FloatArray:
    return xy_m[np.lexsort((np.round(xy_m[:, 0], 9), np.round(xy_m[:, 1], 9)))]


def _apart(pieces: Sequence[FloatArray], least_m: float) -> FloatArray:
    """Return the points of all pieces, less those nearer than ``least_m`` to a point of an earlier piece."""
    from scipy.spatial import cKDTree

    laid = np.empty((0, 2))
    for xy_m in pieces:
        if len(laid) and len(xy_m):
            # The tolerance is that of the feasibility check; without a neighbour that near the distance is inf.
            distance_m, _ = cKDTree(laid).query(xy_m, distance_upper_bound=max(0.0, least_m - 1e-9))
            laid = np.concatenate((laid, xy_m[np.isinf(distance_m)]))
        elif len(xy_m):
            laid = xy_m
    return laid


def _placed(entry: ZonePattern, bounds_m: tuple[float, float, float, float]) -> FloatArray:
    """Return the pattern's points in the floor frame that may fall within ``bounds_m``."""
    cos, sin = np.cos(entry.angle_rad), np.sin(entry.angle_rad)
    turn = np.array([[cos, -sin], [sin, cos]])
    xmin, ymin, xmax, ymax = bounds_m
    corners = np.array([(xmin, ymin), (xmin, ymax), (xmax, ymin), (xmax, ymax)]) - entry.origin_m
    local = corners @ turn
    low, high = local.min(axis=0), local.max(axis=0)
    points_m = entry.pattern.points_in((low[0], low[1], high[0], high[1]))
    return np.asarray(points_m @ turn.T + entry.origin_m)


def _counted_on(ids: IntArray, rows: IntArray) -> IntArray:
    """Return the number of each row: one of ``ids`` for the first rows, then those after the last of them."""
    return np.where(rows < len(ids), ids[np.minimum(rows, len(ids) - 1)], ids[-1] + 1 + rows - len(ids))


def _edited(
    xy_m: FloatArray, before: Sequence[str], edits: tuple[TagEdit, ...]
) -> tuple[IntArray, FloatArray, tuple[str, ...]]:
    """Return which points are left after the edits, where they are, and a status word for each.

    Added tags come after those of the pattern, in the order of the edits. Of two edits of one tag the later one
    rules; a tag that was added is named by the place where it was added.

    Raises
    ------
    ValueError
        If an edit names a place where there is no tag, or adds one where there is one already.
    """
    added_m = [edit.to_m for edit in edits if edit.kind is EditKind.ADDED and edit.to_m is not None]
    others = [edit for edit in edits if edit.kind is not EditKind.ADDED]
    status = [*before, *([EditKind.ADDED.value] * len(added_m))]
    twice = np.flatnonzero(_rows_at(xy_m, added_m) < len(xy_m))
    if len(twice):
        raise ValueError(
            f"the pattern lays a tag at {_place(added_m[twice[0]])} already, so none can be added there"
        )
    xy_m = np.concatenate([xy_m.reshape(-1, 2), np.array(added_m).reshape(-1, 2)])
    rows = _rows_at(xy_m, [edit.from_m for edit in others]).tolist()
    if len(xy_m) in rows:
        missing = others[rows.index(len(xy_m))]
        raise ValueError(
            f"no tag lies at {_place(missing.from_m)} to be {missing.kind.value}: edits of single tags belong to "
            "the pattern that they were made on"
        )
    keep = np.ones(len(xy_m), dtype=bool)
    for edit, row in zip(others, rows, strict=True):
        keep[row] = edit.kind is not EditKind.DROPPED
        status[row] = edit.kind.value
        if edit.to_m is not None:
            xy_m[row] = edit.to_m
    left = np.flatnonzero(keep)
    return left, xy_m[left], tuple(status[row] for row in left.tolist())


def _place(place_m: tuple[float, float]) -> str:
    return f"({place_m[0]:.3f}, {place_m[1]:.3f}) m"


def _rows_at(xy_m: FloatArray, places_m: Sequence[tuple[float, float]]) -> IntArray:
    """Return for each place the row of the point that lies there, or the number of points if none does."""
    from scipy.spatial import cKDTree

    if not places_m or not len(xy_m):
        return np.full(len(places_m), len(xy_m))
    # What is farther away than that is told by an index of one behind the last point.
    _, found = cKDTree(xy_m).query(np.array(places_m), distance_upper_bound=EDIT_M)
    return np.asarray(found)
