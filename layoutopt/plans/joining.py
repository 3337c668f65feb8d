"""Loose lines joined: cut at their crossings, their loose ends found, and gaps between those closed.

A gap is closed between two ends that look at each other, or between an end and the line that it looks at, the
shortest gaps first. An end is where a line stops, or the short side across a wall that is drawn by two lines.
Everything is looked up in trees (STRtree), so that the effort grows little faster than the number of lines.

References
----------
S. Hobby, *Practical segment intersection with finite precision output*, Computational Geometry 13 (1999): snap
rounding, as GEOS nodes lines on a grid.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np
import shapely
from numpy.typing import NDArray

from layoutopt.errors import InvalidInput
from layoutopt.identity import BoolArray, FloatArray, IntArray

Geometries = NDArray[np.object_]
"""Geometries of shapely, shape (n,)."""

GRID_M: Final = 1e-4
"""Ends of lines that are nearer than this count as one point; drawings in millimetres keep a tenth of them."""

MOST_LOOSE_ENDS: Final = 20_000
MOST_CROSSINGS: Final = 100_000  # to cut these takes some seconds
_SAMPLE: Final = 200
_FEW: Final = 10
_WITHOUT_HATCHING: Final = "leave layers of hatching and furniture out of the walls"
# Pairs of ends within a gap of each other: a building has a few for each door.
_MOST_PAIRS: Final = 2_000_000
_FINE_M: Final = GRID_M / 8.0
_ON_LINE_M: Final = 2.5 * GRID_M  # what joining and rounding three points can put between them
_STRAIGHT_M: Final = 3.0 * GRID_M  # pieces of a slanted line on the grid lie that near to it
_SHORTEST_JAMB_M: Final = 0.02
# Two ends look at each other if neither turns away from the gap by more than 60 degrees.
_LEAST_COSINE: Final = 0.5
# The sides of a wall leave its short side at right angles, within 30 degrees, and are longer than it.
_MOST_SLANT: Final = 0.5
_LEAST_SIDE_RATIO: Final = 1.2
_TOUCH_M: Final = 1e-3


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Ends:
    """``points_m`` and ``outward``, unit vectors, shape (n, 2); ``jamb`` is true for the short side of a wall."""

    points_m: FloatArray
    outward: FloatArray
    jamb: BoolArray


def check_crossings(segments_m: FloatArray, place: str, repair: str = _WITHOUT_HATCHING) -> None:
    """Refuse lines that cross each other so often that cutting them would take minutes, from a sample of them.

    Lines that only touch, as those of a building do, do not count. ``repair`` says how to have fewer.

    Raises
    ------
    InvalidInput
        If there are more than some `MOST_CROSSINGS` crossings.
    """
    lines = lines_of(segments_m)
    if not len(lines):
        return
    sample = lines[:: max(1, len(lines) // _SAMPLE)]
    tree = shapely.STRtree(lines)
    # Each crossing has two lines; as soon as there are too many the rest of the sample need not be looked at.
    most = 2.0 * MOST_CROSSINGS * len(sample) / len(lines)
    found = 0
    for few in np.array_split(sample, -(-len(sample) // _FEW)):
        found += tree.query(few, predicate="crosses").shape[1]
        if found > most:
            raise InvalidInput.at(
                place,
                f"the lines cross each other more than {MOST_CROSSINGS:,} times, which would take minutes to cut",
                f"{repair[0].upper()}{repair[1:]}.",
            )


def noded(segments_m: FloatArray) -> FloatArray:
    """Return segments, shape (n, 2, 2), cut at all crossings, on a grid of `GRID_M` and each only once.

    Ends within `GRID_M` of each other become one point, and an end that lies so near to a line cuts it: lines
    that were drawn twice, in other pieces, fall together instead of enclosing slivers.
    """
    segments_m = _cut_at_ends(_ends_united(segments_m))
    if not len(segments_m):
        return segments_m
    lines = shapely.union_all(lines_of(segments_m), grid_size=GRID_M)
    corners_m, line = shapely.get_coordinates(shapely.get_parts(lines), return_index=True)
    follows = line[1:] == line[:-1]
    return np.stack([corners_m[:-1][follows], corners_m[1:][follows]], axis=1)


def _ends_united(segments_m: FloatArray) -> FloatArray:
    """Return segments with ends on the grid, those that are near each other in one place."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components
    from scipy.spatial import KDTree

    # On a finer grid first, so that a crowd of points does not have pairs without number.
    cell, place = np.unique(np.rint(segments_m.reshape(-1, 2) / _FINE_M), axis=0, return_inverse=True)
    points_m = cell * _FINE_M
    near = KDTree(points_m).query_pairs(GRID_M, output_type="ndarray")
    graph = coo_matrix((np.ones(len(near)), (near[:, 0], near[:, 1])), shape=(len(points_m), len(points_m)))
    count, group = connected_components(graph, directed=False)
    size = np.bincount(group, minlength=count)
    mean_m = np.stack([np.bincount(group, points_m[:, axis], minlength=count) / size for axis in (0, 1)], axis=1)
    # A line of pieces shorter than the grid is one chain of near ends, and no point.
    reach_m = np.zeros(count)
    np.maximum.at(reach_m, group, np.abs(points_m - mean_m[group]).max(axis=1))
    joined_m = np.where((reach_m <= GRID_M)[group, None], mean_m[group], points_m)
    united_m = (np.rint(joined_m / GRID_M) * GRID_M)[place.ravel()].reshape(-1, 2, 2)
    return np.asarray(united_m[(united_m[:, 0] != united_m[:, 1]).any(axis=1)])


def _cut_at_ends(segments_m: FloatArray) -> FloatArray:
    """Return segments cut at the ends of others that lie on them, each only once."""
    if not len(segments_m):
        return segments_m
    points_m = np.unique(segments_m.reshape(-1, 2), axis=0)
    point, segment = shapely.STRtree(lines_of(segments_m)).query(
        np.asarray(shapely.points(points_m), dtype=object), predicate="dwithin", distance=_ON_LINE_M
    )
    along = segments_m[segment, 1] - segments_m[segment, 0]
    share = np.einsum("nx,nx->n", points_m[point] - segments_m[segment, 0], along) / np.einsum(
        "nx,nx->n", along, along
    )
    # The ends of a segment lie on it too, at shares of 0 and 1, and so do ends just before and behind them.
    order = np.lexsort((share, segment))
    point, segment = point[order], segment[order]
    follows = segment[1:] == segment[:-1]
    pieces = np.stack([point[:-1][follows], point[1:][follows]], axis=1)
    return np.asarray(points_m[np.unique(np.sort(pieces, axis=1), axis=0)])


def lines_of(segments_m: FloatArray) -> Geometries:
    """Return segments, shape (n, 2, 2), as geometries for the trees and polygons of shapely."""
    return np.asarray(shapely.linestrings(segments_m), dtype=object)


def faces_of(segments_m: FloatArray) -> Geometries:
    """Return the polygons that noded segments enclose, each without what lies in it."""
    return np.asarray(shapely.get_parts(shapely.polygonize(lines_of(segments_m))), dtype=object)


def loose_ends(segments_m: FloatArray) -> FloatArray:
    """Return the points, shape (n, 2), at which only one of the noded segments ends."""
    return _dangling(segments_m, _node_numbers(segments_m)).points_m


def closings(segments_m: FloatArray, gap_m: float, thickest_wall_m: float, place: str) -> FloatArray:
    """Return the lines, shape (k, 2, 2), that close gaps of noded segments up to ``gap_m``.

    Gaps within the thickness of a wall come first, so that two lines of one wall are joined to each other before
    a door is crossed.

    Raises
    ------
    InvalidInput
        If there are more than `MOST_LOOSE_ENDS` ends.
    """
    if gap_m <= 0.0 or not len(segments_m):
        return np.empty((0, 2, 2))
    runs_m = _straight_runs(segments_m)
    loose = _dangling(runs_m, _node_numbers(runs_m))
    first = _closed(segments_m, loose, min(gap_m, thickest_wall_m), place)
    if len(first):
        segments_m = noded(np.concatenate([segments_m, first]))
        runs_m = _straight_runs(segments_m)
    numbers = _node_numbers(runs_m)
    dangling, jambs = _dangling(runs_m, numbers), _jambs(runs_m, numbers, thickest_wall_m)
    ends = _Ends(
        points_m=np.concatenate([dangling.points_m, jambs.points_m]),
        outward=np.concatenate([dangling.outward, jambs.outward]),
        jamb=np.concatenate([dangling.jamb, jambs.jamb]),
    )
    return np.concatenate([first, _closed(segments_m, ends, gap_m, place)])


def _node_numbers(segments_m: FloatArray) -> IntArray:
    """Return the number of the node at each end of each segment, shape (n, 2)."""
    grid = np.rint(segments_m.reshape(-1, 2) / GRID_M).astype(np.int64)
    _, number = np.unique(grid, axis=0, return_inverse=True)
    return number.reshape(-1, 2).astype(np.int64)


def _pairs(flat: IntArray) -> IntArray:
    """Return the places in a list of nodes, shape (k, 2), of those that stand in it just twice."""
    order = np.argsort(flat, kind="stable")
    return np.asarray(order[np.bincount(flat)[flat[order]] == 2].reshape(-1, 2))


def _straight_runs(segments_m: FloatArray) -> FloatArray:
    """Return noded segments, those joined that go straight on: how a line was cut must not matter."""
    from scipy.sparse import coo_matrix
    from scipy.sparse.csgraph import connected_components

    corners_m = segments_m.reshape(-1, 2)
    pairs = _pairs(_node_numbers(segments_m).ravel())
    node_m, far_m = corners_m[pairs[:, 0]], corners_m[pairs ^ 1]
    on = np.einsum("nx,nx->n", node_m - far_m[:, 0], far_m[:, 1] - node_m) > 0.0
    links = pairs[on & (_offset_m(node_m, far_m) <= _STRAIGHT_M)]
    count = len(segments_m)
    graph = coo_matrix((np.ones(len(links)), (links[:, 0] // 2, links[:, 1] // 2)), shape=(count, count))
    run_count, run = connected_components(graph, directed=False)
    outer = np.ones(2 * count, dtype=np.bool_)
    outer[links.ravel()] = False
    ends = np.flatnonzero(outer)
    ends = ends[np.argsort(run[ends // 2], kind="stable")]
    # A circle of fine pieces goes straight on everywhere and has no ends; an arc of them leaves its chord.
    whole = np.bincount(run[ends // 2], minlength=run_count) == 2
    ends = ends[whole[run[ends // 2]]].reshape(-1, 2)
    chord_m = np.zeros((run_count, 2, 2))
    chord_m[run[ends[:, 0] // 2]] = corners_m[ends]
    of_link = run[links[:, 0] // 2]
    bent = ~whole
    bent[of_link[_offset_m(corners_m[links[:, 0]], chord_m[of_link]) > _STRAIGHT_M]] = True
    return np.concatenate([chord_m[~bent], segments_m[bent[run]]])


def _offset_m(points_m: FloatArray, lines_m: FloatArray) -> FloatArray:
    """Return the distance of points, shape (n, 2), from the straight lines through pairs of others."""
    along = _unit(lines_m[:, 1] - lines_m[:, 0])
    to_point = points_m - lines_m[:, 0]
    return np.asarray(np.abs(along[:, 0] * to_point[:, 1] - along[:, 1] * to_point[:, 0]))


def _dangling(segments_m: FloatArray, numbers: IntArray) -> _Ends:
    alone = (np.bincount(numbers.ravel(), minlength=1)[numbers] == 1).ravel()
    points_m = segments_m.reshape(-1, 2)[alone]
    others_m = segments_m[:, ::-1].reshape(-1, 2)[alone]
    return _Ends(
        points_m=points_m, outward=_unit(points_m - others_m), jamb=np.zeros(len(points_m), dtype=np.bool_)
    )


def _jambs(segments_m: FloatArray, numbers: IntArray, thickest_wall_m: float) -> _Ends:
    """Return the short sides across walls, with their middle as the point."""
    flat = numbers.ravel()
    partner = np.full(len(flat), -1, dtype=np.int64)
    pairs = _pairs(flat)
    partner[pairs], partner[pairs[:, ::-1]] = pairs[:, ::-1], pairs
    across = segments_m[:, 1] - segments_m[:, 0]
    length_m = np.hypot(*across.T)
    short = (length_m >= _SHORTEST_JAMB_M) & (length_m <= thickest_wall_m)
    chosen = np.flatnonzero(short & (partner.reshape(-1, 2) >= 0).all(axis=1))
    corners_m = segments_m.reshape(-1, 2)
    # The neighbour leaves at its own other end, whose place in the flat list differs in the last bit.
    sides = corners_m[partner.reshape(-1, 2)[chosen] ^ 1] - segments_m[chosen]
    side_m = np.linalg.norm(sides, axis=2)
    along = _unit(across[chosen])
    normal = np.stack([-along[:, 1], along[:, 0]], axis=1)
    away = np.einsum("nsx,nx->ns", sides, normal)
    slant = np.abs(np.einsum("nsx,nx->ns", sides, along)) <= _MOST_SLANT * side_m
    longer = side_m >= _LEAST_SIDE_RATIO * length_m[chosen, None]
    good = slant.all(axis=1) & longer.all(axis=1) & (away.prod(axis=1) > 0.0)
    outward = -np.sign(away[good, :1]) * normal[good]
    return _Ends(
        points_m=segments_m[chosen[good]].mean(axis=1), outward=outward, jamb=np.ones(len(outward), dtype=np.bool_)
    )


def _closed(segments_m: FloatArray, ends: _Ends, gap_m: float, place: str) -> FloatArray:
    """Return the shortest lines that join ends to each other or to what they look at, each end once."""
    if len(ends.points_m) > MOST_LOOSE_ENDS:
        raise InvalidInput.at(
            place,
            f"the lines of the walls have {len(ends.points_m)} loose ends",
            f"At most {MOST_LOOSE_ENDS:,} can be joined; {_WITHOUT_HATCHING}.",
        )
    if not len(ends.points_m):
        return np.empty((0, 2, 2))
    tree = shapely.STRtree(lines_of(segments_m))
    facing, facing_ends = _facing(ends, gap_m, place)
    hits, hit_ends = _looked_at(segments_m, tree, ends, gap_m)
    lines_m = np.concatenate([facing, hits])
    who = np.concatenate([facing_ends, hit_ends])
    if not len(lines_m):
        return lines_m
    length_m = np.linalg.norm(lines_m[:, 1] - lines_m[:, 0], axis=1)
    free = ~_crossing(lines_m, length_m, tree)
    used = np.zeros(len(ends.points_m) + 1, dtype=np.bool_)
    chosen = []
    # Across a door each end also meets the line in front of it, which may lie a little nearer than the other end.
    rank_m = np.round(length_m + np.where(who[:, 1] < 0, _TOUCH_M, 0.0), 6)
    for number in np.lexsort((who[:, 1], who[:, 0], rank_m)):
        one, other = who[number]
        if free[number] and not used[one] and not (other >= 0 and used[other]):
            used[[one, other]] = True, other >= 0
            chosen.append(number)
    return lines_m[np.array(chosen, dtype=np.int64)]


def _facing(ends: _Ends, gap_m: float, place: str) -> tuple[FloatArray, IntArray]:
    """Return lines between ends that look at each other, shape (k, 2, 2), and their ends, shape (k, 2)."""
    from scipy.spatial import KDTree

    corners = KDTree(ends.points_m)
    if corners.count_neighbors(corners, gap_m) > _MOST_PAIRS:
        raise InvalidInput.at(
            place,
            f"loose ends of walls lie so close that a gap of {gap_m:g} m joins almost any of them",
            f"Give a smaller gap; {_WITHOUT_HATCHING}.",
        )
    points = np.asarray(shapely.points(ends.points_m), dtype=object)
    pairs = shapely.STRtree(points).query(points, predicate="dwithin", distance=gap_m)
    one, other = pairs[:, pairs[0] < pairs[1]]
    lines_m = np.stack([ends.points_m[one], ends.points_m[other]], axis=1)
    along = _unit(lines_m[:, 1] - lines_m[:, 0])
    looks = (np.einsum("nx,nx->n", along, ends.outward[one]) >= _LEAST_COSINE) & (
        np.einsum("nx,nx->n", along, ends.outward[other]) <= -_LEAST_COSINE
    )
    # Two lines of one wall that both stop at a door are joined across the wall, sideways.
    sideways = (
        ~ends.jamb[one]
        & ~ends.jamb[other]
        & (np.einsum("nx,nx->n", ends.outward[one], ends.outward[other]) >= _LEAST_COSINE)
    )
    kept = looks | sideways
    return lines_m[kept], np.stack([one[kept], other[kept]], axis=1)


def _looked_at(
    segments_m: FloatArray, tree: shapely.STRtree, ends: _Ends, gap_m: float
) -> tuple[FloatArray, IntArray]:
    """Return lines from ends straight on to the first segment there, shape (k, 2, 2), and their end and -1."""
    rays_m = np.stack(
        [ends.points_m + _TOUCH_M * ends.outward, ends.points_m + max(gap_m, 2.0 * _TOUCH_M) * ends.outward],
        axis=1,
    )
    ray, segment = tree.query(lines_of(rays_m), predicate="intersects")
    start, direction = ends.points_m[ray], ends.outward[ray]
    side = segments_m[segment, 1] - segments_m[segment, 0]
    slope = direction[:, 0] * side[:, 1] - direction[:, 1] * side[:, 0]
    to_segment = segments_m[segment, 0] - start
    with np.errstate(divide="ignore", invalid="ignore"):
        reach_m = (to_segment[:, 0] * side[:, 1] - to_segment[:, 1] * side[:, 0]) / slope
    sound = np.isfinite(reach_m) & (np.abs(slope) > 1e-9) & (reach_m > 0.0) & (reach_m <= gap_m + _TOUCH_M)
    nearest_m = np.full(len(ends.points_m), np.inf)
    np.minimum.at(nearest_m, ray[sound], reach_m[sound])
    found = np.flatnonzero(np.isfinite(nearest_m))
    lines_m = np.stack(
        [ends.points_m[found], ends.points_m[found] + nearest_m[found, None] * ends.outward[found]], axis=1
    )
    return lines_m, np.stack([found, np.full(len(found), -1)], axis=1)


def _crossing(lines_m: FloatArray, length_m: FloatArray, tree: shapely.STRtree) -> BoolArray:
    """Return which lines cross or follow a segment between their ends, shape (k,)."""
    crosses = np.zeros(len(lines_m), dtype=np.bool_)
    tested = np.flatnonzero(length_m > 3.0 * _TOUCH_M)
    along = _unit(lines_m[tested, 1] - lines_m[tested, 0])
    inner_m = lines_m[tested] + _TOUCH_M * np.stack([along, -along], axis=1)
    line, _ = tree.query(lines_of(inner_m), predicate="intersects")
    crosses[tested[line]] = True
    return crosses


def _unit(vectors: FloatArray) -> FloatArray:
    length = np.linalg.norm(vectors, axis=-1, keepdims=True)
    return np.asarray(vectors / np.where(length > 0.0, length, 1.0))
