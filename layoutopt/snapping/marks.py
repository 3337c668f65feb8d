"""Marks that an installer finds without measuring: tile corners, points on joints, tile centres, chalk lines."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Final, Protocol, get_args
from typing import Literal as OneOf

import numpy as np
import shapely

from layoutopt.errors import InvalidInput, UnknownName, did_you_mean
from layoutopt.identity import FloatArray
from layoutopt.layout import WHOLE_FLOOR
from layoutopt.site import Site, Tiling
from layoutopt.snapping.cut_tiles import CutTile, cut_tiles, in_tiling, on_floor

MarkKind = OneOf["corners", "joints", "centres", "chalk"]
LEAST_SHARE: Final = 0.5
"""A cut tile of which less is left gets no tag at its centre: there is little of it to glue a tag to."""
_TIE_M: Final = 1e-9
"""Halfway between two marks a tag goes up or right, whatever the last bit of a sum says."""
_INSIDE_M: Final = 1e-7
"""How far inside a border a tag is laid that could not lie nearer to it."""


class Marks(Protocol):
    """Places to which tags can be snapped."""

    @property
    def words(self) -> str:
        """What the marks are, for people."""

    @property
    def pitch_m(self) -> float:
        """Distance of neighbouring marks, or of the joints on which they lie."""

    def nearest(self, xy_m: FloatArray) -> tuple[FloatArray, tuple[str, ...]]:
        """Return the mark of each point, shape (n, 2), and why it has none, empty where it has one."""

    def near(self, place_m: FloatArray, reach_m: float, taken_m: FloatArray, least_m: float) -> FloatArray:
        """Return marks within reach of a place, among them the nearest free one, shape (k, 2).

        ``taken_m``, shape (m, 2), are the tags about, from which a free mark is at least ``least_m`` away.
        """


@dataclass(frozen=True, slots=True, kw_only=True)
class PointMarks:
    """Marks at the points of a square grid; some may lie elsewhere, or be none.

    Attributes
    ----------
    grid
        Frame and pitch of the grid, one mark in the middle of each square.
    cut
        Squares that a wall cuts: their mark is the middle of what is left, if enough is.
    """

    words: str
    grid: Tiling
    cut: Mapping[tuple[int, int], CutTile] = field(default_factory=dict)

    @property
    def pitch_m(self) -> float:
        """Distance of neighbouring marks."""
        return self.grid.size_m

    def nearest(self, xy_m: FloatArray) -> tuple[FloatArray, tuple[str, ...]]:
        """Return the mark of the square that holds each point; a cut tile with too little left has none."""
        squares = np.floor((in_tiling(xy_m, self.grid) + _TIE_M) / self.grid.size_m)
        marks_m, why = on_floor((squares + 0.5) * self.grid.size_m, self.grid), [""] * len(xy_m)
        if self.cut:
            for row, (column, line) in enumerate(squares.astype(np.int64).tolist()):
                tile = self.cut.get((column, line))
                if tile is not None:
                    marks_m[row] = tile.middle_m
                    why[row] = "" if tile.share >= LEAST_SHARE else too_little(tile)
        return marks_m, tuple(why)

    def near(self, place_m: FloatArray, reach_m: float, taken_m: FloatArray, least_m: float) -> FloatArray:
        """Return all marks within reach."""
        local_m = in_tiling(place_m, self.grid)
        # The mark of a cut square lies anywhere in it.
        low, high = (np.floor((local_m + way_m) / self.grid.size_m) for way_m in (-reach_m, reach_m))
        columns, rows = (np.arange(low[axis] - 1.0, high[axis] + 2.0) for axis in (0, 1))
        squares = np.stack(np.meshgrid(columns, rows), axis=-1).reshape(-1, 2)
        marks_m, why = self.nearest(on_floor((squares + 0.5) * self.grid.size_m, self.grid))
        usable = np.array([not words for words in why], dtype=np.bool_)
        return _within(marks_m[usable], place_m, reach_m)


@dataclass(frozen=True, slots=True, kw_only=True)
class JointMarks:
    """Marks anywhere on the joints between floor tiles.

    Attributes
    ----------
    tiling
        The floor tiles.
    border_m
        Edges of where tags may lie, shape (n, 2, 2): two ends each, in the tiling's frame.
    tree
        The same edges, to find those about a place.
    """

    words: str
    tiling: Tiling
    border_m: FloatArray
    tree: shapely.STRtree

    @property
    def pitch_m(self) -> float:
        """Distance of neighbouring joints."""
        return self.tiling.size_m

    def nearest(self, xy_m: FloatArray) -> tuple[FloatArray, tuple[str, ...]]:
        """Return the nearest point on a joint: the place along it is kept."""
        local_m = in_tiling(xy_m, self.tiling)
        joints_m = np.floor(local_m / self.tiling.size_m + 0.5 + _TIE_M) * self.tiling.size_m
        away_m = np.abs(joints_m - local_m)
        upright = away_m[:, 0] <= away_m[:, 1] + _TIE_M
        local_m = np.where(np.stack([upright, ~upright], axis=1), joints_m, local_m)
        return on_floor(local_m, self.tiling), ("",) * len(xy_m)

    def near(self, place_m: FloatArray, reach_m: float, taken_m: FloatArray, least_m: float) -> FloatArray:
        """Return the places on joints within reach at which something begins or ends, and those beside the place.

        On each joint the nearest free place is the one beside the given place, or lies at a border of where tags
        may lie, or just keeps its distance from a tag.
        """
        local_m, tags_m = in_tiling(place_m, self.tiling), in_tiling(taken_m.reshape(-1, 2), self.tiling)
        around = shapely.box(*(local_m - reach_m), *(local_m + reach_m))
        ends_m = self.border_m[self.tree.query(around)]
        found = []
        for across in (0, 1):
            along = 1 - across
            first, last = (
                math.ceil((local_m[across] - reach_m) / self.tiling.size_m),
                math.floor((local_m[across] + reach_m) / self.tiling.size_m),
            )
            for joint_m in (number * self.tiling.size_m for number in range(first, last + 1)):
                ways_m = [
                    local_m[along : along + 1],
                    _crossings(ends_m, joint_m, across),
                    _beside(tags_m, joint_m, across, least_m),
                ]
                places_m = np.full((sum(map(len, ways_m)), 2), joint_m)
                places_m[:, along] = np.concatenate(ways_m)
                found.append(places_m)
        marks_m = on_floor(np.concatenate(found) if found else np.empty((0, 2)), self.tiling)
        return _within(marks_m, place_m, reach_m)


def marks_of(
    site: Site, kind: str, *, margin_m: float, tag_part: str, chalk_spacing_m: float | None = None
) -> Marks:
    """Return the marks of a site.

    Parameters
    ----------
    kind
        ``"corners"``, ``"joints"`` or ``"centres"`` of floor tiles, or ``"chalk"``: where lines cross that are
        snapped from the site's datum, along x and y.
    margin_m, tag_part
        What centres of tags keep from walls, and which tags they are.
    chalk_spacing_m
        Distance of chalk lines.

    Raises
    ------
    InvalidInput
        If there are no such marks, the site has no floor tiles, or the spacing is missing or useless.
    """
    known = get_args(MarkKind)
    if kind not in known:
        raise UnknownName.at(f"--to {kind}", "there are no such marks", did_you_mean(kind, known))
    if kind != "chalk" and chalk_spacing_m is not None:
        raise InvalidInput.at(
            "--chalk-spacing", f"{kind} are marks of floor tiles", "Leave it out, or --to chalk."
        )
    if kind == "chalk":
        if chalk_spacing_m is None:
            raise InvalidInput.at("--to chalk", "chalk lines need a distance", 'Add --chalk-spacing "50 mm".')
        words = f"crossings of chalk lines, {1000.0 * chalk_spacing_m:g} mm apart from the datum"
        return PointMarks(words=words, grid=_centred(Tiling(size_m=chalk_spacing_m, origin_m=site.datum_m)))
    tiling = site.tiling
    if tiling is None:
        raise InvalidInput.at(
            f"--to {kind}",
            f"site '{site.name}' has no floor tiles",
            'Add tiling = { size = "0.5 m" } to [site] of the layout file, or give --to chalk.',
        )
    words = f"{kind} of floor tiles of {1000.0 * tiling.size_m:g} mm"
    if kind == "corners":
        return PointMarks(words=words, grid=_centred(tiling))
    if kind == "centres":
        cut = {(tile.column, tile.row): tile for tile in cut_tiles(site)}
        return PointMarks(words=words, grid=tiling, cut=cut)
    border = shapely.transform(
        site.taggable_region(WHOLE_FLOOR, margin_m, tag_part).boundary, lambda xy_m: in_tiling(xy_m, tiling)
    )
    lines = [shapely.get_coordinates(line) for line in shapely.get_parts(border)]
    border_m = np.concatenate([np.empty((0, 2, 2)), *(np.stack([line[:-1], line[1:]], axis=1) for line in lines)])
    tree = shapely.STRtree(np.atleast_1d(np.asarray(shapely.linestrings(border_m))))
    return JointMarks(words=words, tiling=tiling, border_m=border_m, tree=tree)


def too_little(tile: CutTile) -> str:
    """Return in words what is left of a cut tile."""
    return (
        f"cut tile c{tile.column}r{tile.row}: {100.0 * tile.share:.0f} % left, within "
        f"{1000.0 * tile.width_m:.0f} x {1000.0 * tile.height_m:.0f} mm"
    )


def _within(marks_m: FloatArray, place_m: FloatArray, reach_m: float) -> FloatArray:
    near = np.linalg.norm(marks_m - place_m, axis=1) <= reach_m
    return np.asarray(marks_m[near])


def _centred(grid: Tiling) -> Tiling:
    """Return the grid whose squares have the corners of the given one in their middles."""
    half_m = -grid.size_m / 2.0
    x_m, y_m = on_floor(np.array((half_m, half_m)), grid).tolist()
    return Tiling(size_m=grid.size_m, origin_m=(x_m, y_m), angle_rad=grid.angle_rad)


def _crossings(ends_m: FloatArray, joint_m: float, across: int) -> FloatArray:
    """Return where border segments, shape (n, 2, 2), cross a joint, each with a place on either side of it."""
    beside_m = ends_m[:, :, across] - joint_m
    crossing = (beside_m.min(axis=1, initial=np.inf) <= 0.0) & (beside_m.max(axis=1, initial=-np.inf) >= 0.0)
    step_m = np.diff(ends_m[crossing], axis=1)[:, 0]
    start_m, away_m = ends_m[crossing, 0], beside_m[crossing, 0]
    parallel = step_m[:, across] == 0.0
    share = np.where(parallel, 0.0, -away_m / np.where(parallel, 1.0, step_m[:, across]))
    at_m = start_m[:, 1 - across] + share * step_m[:, 1 - across]
    return np.concatenate([at_m - _INSIDE_M, at_m, at_m + _INSIDE_M])


def _beside(tags_m: FloatArray, joint_m: float, across: int, least_m: float) -> FloatArray:
    """Return the places on a joint that are just ``least_m`` away from one of the tags, shape (n, 2)."""
    half_m = np.sqrt(np.maximum(0.0, least_m**2 - (tags_m[:, across] - joint_m) ** 2))
    near_m, half_m = tags_m[half_m > 0.0, 1 - across], half_m[half_m > 0.0]
    return np.concatenate([near_m - half_m, near_m + half_m])
