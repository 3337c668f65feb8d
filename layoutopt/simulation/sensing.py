"""What the readers of a robot see on one drive: tags in read range, and everything that spoils it."""

from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Final

import numpy as np

from layoutopt.detection import BucketGrid, antennas_of, bucket_grid
from layoutopt.identity import BoolArray, FloatArray, IntArray
from layoutopt.layout import Layout, TagMap
from layoutopt.protocols import Antennas
from layoutopt.readings import UNKNOWN_TAG, Observations
from layoutopt.scenario import Faults, Scenario
from layoutopt.streams import Purpose, Streams

if TYPE_CHECKING:
    from layoutopt.simulation.motion import Drive

Detected = tuple[IntArray, IntArray, IntArray]
"""Step, antenna and tag of each detection, sorted by all three in this order."""

EDGE_WIDTHS: Final = 14.0
"""Scales of a soft edge beyond which no tag is read: there the logistic curve is below one in a million."""


@dataclass(frozen=True, slots=True, kw_only=True)
class FloorTruth:
    """The tags that answer: their true places, shape (n, 2), m, and their indices in the tag map, shape (n,)."""

    xy_m: FloatArray
    tag: IntArray


@dataclass(frozen=True, slots=True, eq=False)
class _Same:
    """A tag map as the key of a cache: by identity, because its arrays cannot be hashed."""

    tag_map: TagMap

    def __hash__(self) -> int:
        return id(self.tag_map)

    def __eq__(self, other: object) -> bool:
        return isinstance(other, _Same) and other.tag_map is self.tag_map


def true_tags(tag_map: TagMap, faults: Faults, draws: np.random.Generator) -> FloorTruth:
    """Return where the tags of a map truly lie, and which of them answer.

    Every tag is off by its own normal error per axis and by the common offset; dead tags are left out. Only
    faults that exist draw random numbers.
    """
    xy_m = tag_map.xy_m + np.array(faults.tag_offset_m)
    if faults.tag_placement_sigma_m > 0.0:
        xy_m = xy_m + faults.tag_placement_sigma_m * draws.standard_normal(xy_m.shape)
    tag = np.arange(len(tag_map), dtype=np.int64)
    if faults.dead_tag_share > 0.0:
        tag = tag[draws.random(len(tag)) >= faults.dead_tag_share]
    return FloorTruth(xy_m=xy_m[tag], tag=tag)


def observe(
    drive: "Drive",
    layout: Layout,
    scenario: Scenario,
    tag_map: TagMap,
    streams: Streams,
    replication: int,
) -> Observations:
    """Return what a robot with this layout reads on a drive, with its odometry.

    In every step each antenna whose turn it is scans at the pose after the step and reads the tags nearer than
    its read radius (mi2016, Eq. 5: strictly). With ``Faults.read_edge_m`` the edge is a logistic curve instead;
    an antenna that reads one tag at a time reads none where two answer; a missed scan brings nothing; a read
    with a wrong identity names another tag of the map. With a clock error a read belongs to a moment that long
    before its time stamp.

    Reads are sorted by step, antenna and tag.
    """
    faults = scenario.faults
    antennas = antennas_of(layout, scenario.step_s, faults.antenna_height_error_m)
    margin_m = EDGE_WIDTHS * faults.read_edge_m
    grid, truth = _floor(
        tag_map, float(antennas.radius_m.max(initial=0.0)) + margin_m, faults, scenario, streams, replication
    )
    centre_m = antenna_centres(_scanned_from(drive, scenario), antennas)
    steps = np.arange(len(drive.increments))
    active = steps[:, None] % antennas.period_steps == antennas.phase_steps
    # An antenna out of reach of the floor sees nothing however soft its edge.
    reach_m = np.where(antennas.radius_m > 0.0, antennas.radius_m + margin_m, 0.0)
    step, antenna, row = compiled_detections(centre_m, active, reach_m, grid)
    if _spoiled(faults):
        draws = streams.generator(scenario.name, replication, Purpose.SENSING)
        distance_m = np.linalg.norm(truth.xy_m[row] - centre_m[step, antenna], axis=1)
        seen = _within_soft_edge(distance_m - antennas.radius_m[antenna], faults.read_edge_m, draws)
        step, antenna, row = step[seen], antenna[seen], row[seen]
        kept = _not_collided(step, antenna, antennas) & _not_missed(step, antenna, faults.missed_read_share, draws)
        step, antenna, tag = step[kept], antenna[kept], truth.tag[row[kept]]
        tag = _misread(tag, len(tag_map), faults.wrong_identity_share, draws)
        order = np.lexsort((tag, antenna, step))
        step, antenna, tag = step[order], antenna[order], tag[order]
    else:
        kept = _not_collided(step, antenna, antennas)
        step, antenna, tag = step[kept], antenna[kept], truth.tag[row[kept]]
    return Observations(
        step_s=scenario.step_s,
        increments=drive.increments,
        sigma=drive.sigma,
        read_start=np.searchsorted(step, np.arange(len(steps) + 1)).astype(np.int64),
        read_antenna=antenna,
        read_tag=tag,
        active=active,
    )


def antenna_centres(poses: FloatArray, antennas: Antennas) -> FloatArray:
    """Return the centres of the antennas in the floor frame from poses, shape (n, 3), as (n, antennas, 2), m."""
    cos, sin = np.cos(poses[:, 2, None]), np.sin(poses[:, 2, None])
    forward_m, left_m = antennas.xy_m[:, 0], antennas.xy_m[:, 1]
    x_m = poses[:, 0, None] + cos * forward_m - sin * left_m
    y_m = poses[:, 1, None] + sin * forward_m + cos * left_m
    return np.stack([x_m, y_m], axis=2)


def plain_detections(centre_m: FloatArray, active: BoolArray, radius_m: FloatArray, grid: BucketGrid) -> Detected:
    """Return every detection of a drive by plain loops: the truth for `compiled_detections`.

    ``centre_m`` as from `antenna_centres`; ``active``, shape (steps, antennas), who scans when; ``radius_m``,
    shape (antennas,), how far each sees. The last of the three arrays returned counts the points of the grid.
    """
    found = [
        (step, antenna, int(point))
        for step in range(len(centre_m))
        for antenna in np.flatnonzero(active[step]).tolist()
        for point in grid.near(
            (float(centre_m[step, antenna, 0]), float(centre_m[step, antenna, 1])), float(radius_m[antenna])
        )
    ]
    step, antenna, point = np.array(found, dtype=np.int64).reshape(-1, 3).T
    return step, antenna, point


def compiled_detections(
    centre_m: FloatArray, active: BoolArray, radius_m: FloatArray, grid: BucketGrid
) -> Detected:
    """Return exactly what `plain_detections` returns, from the kernel."""
    from layoutopt.simulation.sensing_kernels import detections

    step, antenna, point = detections(
        centre_m,
        active,
        np.array(radius_m),
        np.array([float(radius) ** 2 for radius in radius_m]),
        grid.origin_m,
        grid.cell_m,
        grid.columns,
        grid.rows,
        grid.start,
        grid.order,
        grid.xy_m,
    )
    return step, antenna, point


def _floor(
    tag_map: TagMap, radius_m: float, faults: Faults, scenario: Scenario, streams: Streams, replication: int
) -> tuple[BucketGrid, FloorTruth]:
    """Return the grid over the tags that answer, and these tags; made once where nothing is drawn."""
    if faults.tag_placement_sigma_m > 0.0 or faults.dead_tag_share > 0.0 or any(faults.tag_offset_m):
        truth = true_tags(tag_map, faults, streams.generator(scenario.name, replication, Purpose.TAG_FAULTS))
        return bucket_grid(truth.xy_m, radius_m), truth
    return _planned_floor(_Same(tag_map), radius_m)


@lru_cache(maxsize=16)
def _planned_floor(same: _Same, radius_m: float) -> tuple[BucketGrid, FloorTruth]:
    xy_m = np.asarray(same.tag_map.xy_m)
    return bucket_grid(xy_m, radius_m), FloorTruth(xy_m=xy_m, tag=np.arange(len(xy_m), dtype=np.int64))


def _scanned_from(drive: "Drive", scenario: Scenario) -> FloatArray:
    """Return the true pose at which the reads of each step were taken, shape (n, 3)."""
    delay_s = scenario.faults.clock_error_s
    if delay_s == 0.0:
        return drive.poses[1:]
    moment_s = np.arange(len(drive.poses)) * scenario.step_s
    return np.stack([np.interp(moment_s[1:] - delay_s, moment_s, axis) for axis in drive.poses.T], axis=1)


def _spoiled(faults: Faults) -> bool:
    return faults.read_edge_m > 0.0 or faults.missed_read_share > 0.0 or faults.wrong_identity_share > 0.0


def _within_soft_edge(beyond_m: FloatArray, edge_m: float, draws: np.random.Generator) -> BoolArray:
    """Return which tags answer, given how far beyond the read radius they lie, shape (n,)."""
    if edge_m == 0.0:
        return np.ones(len(beyond_m), dtype=np.bool_)
    chance = 0.5 - 0.5 * np.tanh(beyond_m / (2.0 * edge_m))
    return np.asarray(draws.random(len(beyond_m)) < chance)


def _scans(step: IntArray, antenna: IntArray, count: int) -> tuple[IntArray, IntArray]:
    """Return the number of reads of each scan, and to which scan each read belongs."""
    _, scan, size = np.unique(step * count + antenna, return_inverse=True, return_counts=True)
    return size, scan


def _not_collided(step: IntArray, antenna: IntArray, antennas: Antennas) -> BoolArray:
    """Return which reads survive: an antenna that takes one tag a scan reads none where several answer."""
    if not antennas.one_tag.any() or len(step) == 0:
        return np.ones(len(step), dtype=np.bool_)
    size, scan = _scans(step, antenna, len(antennas))
    return np.asarray(~antennas.one_tag[antenna] | (size[scan] == 1))


def _not_missed(step: IntArray, antenna: IntArray, share: float, draws: np.random.Generator) -> BoolArray:
    """Return which reads survive that whole scans bring nothing."""
    if share == 0.0 or len(step) == 0:
        return np.ones(len(step), dtype=np.bool_)
    size, scan = _scans(step, antenna, int(antenna.max()) + 1)
    return np.asarray(draws.random(len(size))[scan] >= share)


def _misread(tag: IntArray, count: int, share: float, draws: np.random.Generator) -> IntArray:
    """Return the tags with some of them replaced by a random other one; unknown where there is no other."""
    if share == 0.0 or len(tag) == 0:
        return tag
    wrong = draws.random(len(tag)) < share
    if count < 2:
        return np.where(wrong, UNKNOWN_TAG, tag)
    return np.where(wrong, (tag + draws.integers(1, count, size=len(tag))) % count, tag)
