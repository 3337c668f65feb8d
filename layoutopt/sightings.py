"""What comes into view along straight ways: which tags, from where to where, and the blind stretches between.

Queries go through the bucket grid of `layoutopt.detection`, so that a way looks only at the buckets near it. The
plain functions here try every tag and are the truth for `sightings_kernels`.
"""

from dataclasses import dataclass
from typing import Final

import numpy as np

from layoutopt.detection import BucketGrid, bucket_grid
from layoutopt.identity import BoolArray, FloatArray, IntArray
from layoutopt.protocols import Antennas

POINT_M: Final = 1e-100
"""A segment that is no longer is a point: rounding loses squares of such lengths, and its direction with them."""


def grid_for_ways(xy_m: FloatArray) -> BucketGrid:
    """Return the grid over points, shape (n, 2), for long ways: with about four points a cell.

    A way of many radii passes many cells, and to look into one costs as much as to try some points.
    """
    size = np.ptp(xy_m, axis=0) if len(xy_m) else np.zeros(2)
    return bucket_grid(xy_m, float(np.sqrt(size.prod() / max(len(xy_m), 1))))


@dataclass(frozen=True, slots=True, kw_only=True)
class Stretches:
    """Pieces of ways: one row a piece, sorted by way and place.

    Attributes
    ----------
    way
        Number of the way on which each piece lies, shape (m,).
    start_m, end_m
        Where it begins and ends along the way, shape (m,), m.
    """

    way: IntArray
    start_m: FloatArray
    end_m: FloatArray

    @property
    def length_m(self) -> FloatArray:
        """Length of each piece, shape (m,)."""
        return self.end_m - self.start_m


@dataclass(frozen=True, slots=True, kw_only=True)
class Sightings:
    """Which tags come into view along ways, and from where to where: one row a sighting.

    Attributes
    ----------
    way, tag
        Numbers of way and tag, shape (m,).
    enter_m, leave_m
        How far along the way the tag comes into view and leaves it, shape (m,), m. It is in view between the two,
        not at them, unless they are ends of the way. A robot that turns on the spot makes sightings of no length.
    length_m
        Length of each way, shape (n,), m.
    """

    way: IntArray
    tag: IntArray
    enter_m: FloatArray
    leave_m: FloatArray
    length_m: FloatArray

    def __len__(self) -> int:
        """Return the number of sightings."""
        return len(self.way)

    def first_m(self) -> FloatArray:
        """Return how far along each way the first tag comes into view, shape (n,); infinite where none does."""
        first_m = np.full(len(self.length_m), np.inf)
        np.minimum.at(first_m, self.way, self.enter_m)
        return first_m

    def tag_counts(self) -> IntArray:
        """Return how many different tags come into view on each way, shape (n,)."""
        pairs = np.unique(np.stack([self.way, self.tag]), axis=1)
        return np.bincount(pairs[0], minlength=len(self.length_m)).astype(np.int64)

    def covered(self) -> Stretches:
        """Return the pieces of the ways on which some tag is in view; those that touch are one."""
        way = np.concatenate([self.way, self.way])
        place_m = np.concatenate([self.enter_m, self.leave_m])
        change = np.repeat(np.array([1, -1]), len(self))
        # At one place tags come before others go.
        order = np.lexsort((-change, place_m, way))
        way, place_m, change = way[order], place_m[order], change[order]
        in_view = np.cumsum(change)
        begins, ends = (change == 1) & (in_view == 1), in_view == 0
        return Stretches(way=way[begins], start_m=place_m[begins], end_m=place_m[ends])

    def blind(self) -> Stretches:
        """Return the pieces of the ways on which no tag is in view, those of no length left out."""
        covered = self.covered()
        way = np.concatenate([np.arange(len(self.length_m)), covered.way])
        # Blind is what lies between the end of one covered piece and the start of the next.
        start_m = np.concatenate([np.zeros(len(self.length_m)), covered.end_m])
        end_m = np.concatenate([self.length_m, covered.start_m])
        by_start, by_end = np.lexsort((start_m, way)), np.lexsort((end_m, way))
        way, start_m, end_m = way[by_start], start_m[by_start], end_m[by_end]
        blind = end_m > start_m
        return Stretches(way=way[blind], start_m=start_m[blind], end_m=end_m[blind])

    def along(self, way: IntArray, start_m: FloatArray, end_m: FloatArray, length_m: FloatArray) -> "Sightings":
        """Return the sightings of segments as those of longer ways, of which each segment serves a piece.

        An antenna passes its segment while the robot passes the piece; several segments may serve one piece.

        Parameters
        ----------
        way, start_m, end_m
            For each segment its way, and where its piece begins and ends along that way, shape (segments,).
        length_m
            Length of each of the longer ways, shape (n,).
        """
        own_m = self.length_m[self.way]
        moves = own_m > 0.0
        # A segment that is a point is in view for the whole piece.
        entered = np.divide(self.enter_m, own_m, out=np.zeros(len(self)), where=moves)
        left = np.divide(self.leave_m, own_m, out=np.ones(len(self)), where=moves)
        begin_m, finish_m = start_m[self.way], end_m[self.way]
        # Written so that the ends of segments become the very ends of their pieces.
        return Sightings(
            way=way[self.way],
            tag=self.tag,
            enter_m=(1.0 - entered) * begin_m + entered * finish_m,
            leave_m=(1.0 - left) * begin_m + left * finish_m,
            length_m=length_m,
        )


def segment_sightings(segment_m: FloatArray, radius_m: FloatArray | float, grid: BucketGrid) -> Sightings:
    """Return which points of the grid come closer than a radius to straight segments, each a way of its own.

    Sightings are sorted by segment, then as the points are in the grid.

    Parameters
    ----------
    segment_m
        x and y of start and end of each segment, shape (n, 4), m; a segment may be a point.
    radius_m
        One radius for all, or one for each segment, shape (n,), m: open discs, as in `BucketGrid.near`.

    Raises
    ------
    ValueError
        If a place or a radius is not finite, or a radius is negative.
    """
    from layoutopt.sightings_kernels import segment_sightings as compiled

    segment_m, radii_m, length_m = _checked(segment_m, radius_m)
    way, tag, enter_m, leave_m = compiled(segment_m, radii_m, *_fields(grid))
    return Sightings(way=way, tag=tag, enter_m=enter_m, leave_m=leave_m, length_m=length_m)


def plain_segment_sightings(segment_m: FloatArray, radius_m: FloatArray | float, grid: BucketGrid) -> Sightings:
    """Return exactly what `segment_sightings` returns, trying every point with every segment: its truth."""
    segment_m, radii_m, length_m = _checked(segment_m, radius_m)
    enter_m, leave_m = _in_view(segment_m[:, None], length_m[:, None], radii_m[:, None], grid.xy_m)
    way, place = np.nonzero(enter_m <= leave_m)
    return Sightings(
        way=way,
        tag=grid.order[place],
        enter_m=enter_m[way, place],
        leave_m=leave_m[way, place],
        length_m=length_m,
    )


def tags_on_runs(
    poses: FloatArray, way_m: FloatArray, antennas: Antennas, grid: BucketGrid, most: int
) -> IntArray:
    """Return how many different tags a group of antennas sees on straight runs, shape (n,), up to ``most``.

    Every antenna sees all the way, whatever its turn in the scan cycle.

    Parameters
    ----------
    poses
        x, y (m) and heading (rad) at the start of each run, shape (n, 3); the heading stays.
    way_m
        How far each run goes in x and y, shape (n, 2), m; zero for what is seen from the pose itself.

    Raises
    ------
    ValueError
        If ``most`` is not positive or a number is not finite.
    """
    from layoutopt.sightings_kernels import tags_on_runs as compiled

    if most < 1:
        raise ValueError(f"tags are counted up to a positive number, got {most}")
    if not (np.isfinite(poses).all() and np.isfinite(way_m).all()):
        raise ValueError("poses and ways must be finite")
    turned = np.stack([poses[:, 0], poses[:, 1], np.cos(poses[:, 2]), np.sin(poses[:, 2])], axis=1)
    # Copies, because a kernel is compiled once more for arrays that are read only.
    antenna_m, radius_m = np.array(antennas.xy_m), np.array(antennas.radius_m)
    return compiled(turned, np.array(way_m, dtype=np.float64), antenna_m, radius_m, most, *_fields(grid))


def plain_tags_on_runs(
    poses: FloatArray, way_m: FloatArray, antennas: Antennas, grid: BucketGrid, most: int
) -> IntArray:
    """Return exactly what `tags_on_runs` returns, from every sighting of every antenna: its truth."""
    segment_m = antenna_segments(poses, way_m, antennas.xy_m)
    radius_m = np.tile(antennas.radius_m, len(poses))
    seen = plain_segment_sightings(segment_m, radius_m, grid)
    return np.minimum(_of_runs(seen, way_m, len(antennas)).tag_counts(), most)


def run_sightings(poses: FloatArray, way_m: FloatArray, antennas: Antennas, grid: BucketGrid) -> Sightings:
    """Return what a group of antennas sees on straight runs, each a way; arguments as for `tags_on_runs`."""
    segment_m = antenna_segments(poses, way_m, antennas.xy_m)
    seen = segment_sightings(segment_m, np.tile(antennas.radius_m, len(poses)), grid)
    return _of_runs(seen, way_m, len(antennas))


def antenna_segments(poses: FloatArray, way_m: FloatArray, antenna_m: FloatArray) -> FloatArray:
    """Return the ways of all antennas on straight runs, shape (n * antennas, 4), those of one run side by side."""
    forward, left = antenna_m[:, 0], antenna_m[:, 1]
    cos, sin = np.cos(poses[:, 2])[:, None], np.sin(poses[:, 2])[:, None]
    x_m = poses[:, 0, None] + cos * forward - sin * left
    y_m = poses[:, 1, None] + sin * forward + cos * left
    return np.stack([x_m, y_m, x_m + way_m[:, 0, None], y_m + way_m[:, 1, None]], axis=2).reshape(-1, 4)


def _of_runs(seen: Sightings, way_m: FloatArray, antennas: int) -> Sightings:
    length_m = np.hypot(way_m[:, 0], way_m[:, 1])
    run = np.repeat(np.arange(len(way_m)), antennas)
    return seen.along(run, np.zeros(len(run)), length_m[run], length_m)


def _checked(segment_m: FloatArray, radius_m: FloatArray | float) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return segments and radii as arrays of the kernel's own kind, and the length of each segment."""
    segments = np.array(segment_m, dtype=np.float64).reshape(-1, 4)
    radii = np.array(np.broadcast_to(np.asarray(radius_m, dtype=np.float64), len(segments)))
    if not (np.isfinite(radii).all() and (radii >= 0.0).all()):
        raise ValueError("a radius of detection must be finite and zero or more")
    if not np.isfinite(segments).all():
        raise ValueError("the ends of a segment must be finite")
    # Not numpy's hypot, which rounds otherwise than the kernel.
    dx, dy = segments[:, 2] - segments[:, 0], segments[:, 3] - segments[:, 1]
    length_m = np.sqrt(dx * dx + dy * dy)
    return segments, radii, np.where(length_m > POINT_M, length_m, 0.0)


def _fields(
    grid: BucketGrid,
) -> tuple[tuple[float, float], float, int, int, IntArray, IntArray, FloatArray]:
    return (grid.origin_m, grid.cell_m, grid.columns, grid.rows, grid.start, grid.order, grid.xy_m)


def _in_view(
    segment_m: FloatArray, length_m: FloatArray, radius_m: FloatArray, xy_m: FloatArray
) -> tuple[FloatArray, FloatArray]:
    """Return the ways, shape (n, m), at which segments, shape (n, 1, 4), enter and leave the discs of m points.

    Where a point is not seen the first is the greater. At both ends the distance itself decides, so that queries
    of a segment and of its ends agree.
    """
    from_x, from_y = segment_m[..., 0] - xy_m[:, 0], segment_m[..., 1] - xy_m[:, 1]
    to_x, to_y = segment_m[..., 2] - xy_m[:, 0], segment_m[..., 3] - xy_m[:, 1]
    squared = radius_m * radius_m
    at_start, at_end = from_x * from_x + from_y * from_y < squared, to_x * to_x + to_y * to_y < squared
    # A segment that is a point has no direction.
    unit_m = np.where(length_m > 0.0, length_m, 1.0)
    ahead_x = (segment_m[..., 2] - segment_m[..., 0]) / unit_m
    ahead_y = (segment_m[..., 3] - segment_m[..., 1]) / unit_m
    foot = -(from_x * ahead_x + from_y * ahead_y)
    beside = from_x * ahead_y - from_y * ahead_x
    between: BoolArray = (foot > 0.0) & (foot < length_m) & (beside * beside < squared)
    half = np.sqrt(np.maximum(squared - beside * beside, 0.0))
    enter_m = np.where(at_start, 0.0, np.minimum(np.maximum(foot - half, 0.0), length_m))
    leave_m = np.where(at_end, length_m, np.maximum(np.minimum(foot + half, length_m), enter_m))
    seen = at_start | at_end | between
    return np.where(seen, enter_m, 1.0), np.where(seen, leave_m, 0.0)
