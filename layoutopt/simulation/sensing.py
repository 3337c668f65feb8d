"""What the readers of a robot see on one drive: tags in read range, and everything that spoils it."""

from dataclasses import dataclass
from functools import lru_cache
from typing import TYPE_CHECKING, Final

import numpy as np

from layoutopt.detection import BucketGrid, antennas_of, bucket_grid
from layoutopt.identity import BoolArray, FloatArray, IntArray, Same
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


def true_tags(tag_map: TagMap, faults: Faults, draws: np.random.Generator) -> FloorTruth:
    """Return where the tags of a map truly lie, and which of them answer.

    Every tag is off by its own normal error per axis and by the common offset; dead tags are left out. Only
    faults that exist draw random numbers.
    """
    xy_m = tag_map.xy_m + np.array(faults.tag_offset_m)
    answering = np.ones(len(tag_map), dtype=np.bool_)
    if faults.true_places is not None:
        places = faults.true_places
        here = np.isin(places.tag_id, tag_map.ids)
        xy_m[np.searchsorted(tag_map.ids, places.tag_id[here])] = places.xy_m[here] + faults.tag_offset_m
        answering = ~np.isin(tag_map.ids, places.silent)
    if faults.tag_placement_sigma_m > 0.0:
        xy_m = xy_m + faults.tag_placement_sigma_m * draws.standard_normal(xy_m.shape)
    if faults.dead_tag_share > 0.0:
        answering &= draws.random(len(tag_map)) >= faults.dead_tag_share
    tag = np.flatnonzero(answering)
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
    before its time stamp. Asynchronous antennas scan at a moment of their own within the step, each always at the
    same one in a trial.

    Reads are sorted by step, antenna and tag.
    """
    faults = scenario.faults
    antennas = antennas_of(layout, scenario.step_s, faults.antenna_height_error_m)
    margin_m = EDGE_WIDTHS * faults.read_edge_m
    grid, truth = _floor(
        tag_map, float(antennas.radius_m.max(initial=0.0)) + margin_m, faults, scenario, streams, replication
    )
    delays_s = np.full(len(antennas), faults.clock_error_s)
    if faults.asynchronous:
        own_moments = streams.generator(scenario.name, replication, Purpose.ASYNCHRONY)
        delays_s += scenario.step_s * own_moments.random(len(antennas))
    centre_m = _scan_centres(drive, scenario, antennas, delays_s)
    active = _scanning(
        len(drive.increments), tuple(antennas.period_steps.tolist()), tuple(antennas.phase_steps.tolist())
    )
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
        read_start=np.concatenate([[0], np.cumsum(np.bincount(step, minlength=len(active)))]),
        read_antenna=antenna,
        read_tag=tag,
        active=active,
        gyro_turn_rad=drive.gyro_turn_rad,
        gyro_sigma_rad=drive.gyro_sigma_rad,
    )


@lru_cache(maxsize=64)
def _scanning(steps: int, period_steps: tuple[int, ...], phase_steps: tuple[int, ...]) -> BoolArray:
    """Return whether each antenna scans in each step, shape (steps, antennas); made once and read only."""
    active: BoolArray = np.arange(steps)[:, None] % np.array(period_steps, np.int64) == np.array(phase_steps)
    active.setflags(write=False)
    return active


def antenna_centres(poses: FloatArray, antennas: Antennas) -> FloatArray:
    """Return the centres of the antennas in the floor frame, shape (n, antennas, 2), m.

    ``poses`` are those of the robot, shape (n, 3), or of the robot at each antenna's own moment, shape
    (n, antennas, 3).
    """
    from layoutopt.simulation.sensing_kernels import centres

    if poses.ndim == 2:
        poses = poses[:, None, :]
    centre_m = np.empty((len(poses), len(antennas), 2))
    # Copies, because a kernel is compiled once more for arrays that are read only.
    centres(np.array(poses), np.cos(poses[..., 2]), np.sin(poses[..., 2]), np.array(antennas.xy_m), centre_m)
    return centre_m


def plain_antenna_centres(poses: FloatArray, antennas: Antennas) -> FloatArray:
    """Return exactly what `antenna_centres` returns, by numpy: its truth."""
    if poses.ndim == 2:
        poses = poses[:, None, :]
    cos, sin = np.cos(poses[..., 2]), np.sin(poses[..., 2])
    forward_m, left_m = antennas.xy_m[:, 0], antennas.xy_m[:, 1]
    x_m = poses[..., 0] + cos * forward_m - sin * left_m
    y_m = poses[..., 1] + sin * forward_m + cos * left_m
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
        np.array(active),
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
    drawn = faults.tag_placement_sigma_m > 0.0 or faults.dead_tag_share > 0.0 or any(faults.tag_offset_m)
    if drawn or faults.true_places is not None:
        truth = true_tags(tag_map, faults, streams.generator(scenario.name, replication, Purpose.TAG_FAULTS))
        return bucket_grid(truth.xy_m, radius_m), truth
    return _planned_floor(Same(tag_map), radius_m)


@lru_cache(maxsize=16)
def _planned_floor(same: Same[TagMap], radius_m: float) -> tuple[BucketGrid, FloorTruth]:
    xy_m = np.asarray(same.value.xy_m)
    return bucket_grid(xy_m, radius_m), FloorTruth(xy_m=xy_m, tag=np.arange(len(xy_m), dtype=np.int64))


def _scan_centres(drive: "Drive", scenario: Scenario, antennas: Antennas, delays_s: FloatArray) -> FloatArray:
    """Return where each antenna truly is when it scans in each step, shape (n, antennas, 2), m.

    ``delays_s``, shape (antennas,), says how long before the end of the step, or of its time stamp, that is.
    """
    if not delays_s.any():
        return antenna_centres(drive.poses[1:], antennas)
    before = {delay_s: _poses_before(drive.poses, delay_s, scenario) for delay_s in delays_s.tolist()}
    return antenna_centres(np.stack([before[delay_s] for delay_s in delays_s.tolist()], axis=1), antennas)


def _poses_before(poses: FloatArray, delay_s: float, scenario: Scenario) -> FloatArray:
    """Return the true poses that long before the end of each step, shape (n, 3), from those at the ends.

    A robot that is lifted is nowhere between two routes: within that step it is where it is put down.
    """
    ends_s = np.arange(len(poses)) * scenario.step_s
    moments_s = ends_s[1:] - delay_s
    parts = [slice(0, len(poses))]
    if scenario.lifted_after is not None:
        put_down = scenario.lifted_after + 1
        parts = [slice(0, put_down), slice(put_down, len(poses))]
    found = np.empty((len(moments_s), 3))
    for part in parts:
        among = moments_s > ends_s[part.start - 1] if part.start else np.ones(len(moments_s), dtype=np.bool_)
        for axis in range(3):
            found[among, axis] = np.interp(moments_s[among], ends_s[part], poses[part, axis])
    return found


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
