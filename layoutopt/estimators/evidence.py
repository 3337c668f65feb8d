"""What a drive's readings say of the pose, in the columns from which compiled filters read.

A *constraint* is a row: an antenna, a tag, and how far apart they may be. A read says: within the disc. What an
antenna does not read is found on the way, because it depends on where the robot may be: `Floor` serves for that.
"""

from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from layoutopt.detection import bucket_grid
from layoutopt.estimators.likelihood import LEAST_WIDTH_M
from layoutopt.estimators.particles import tag_bounds_m
from layoutopt.identity import BoolArray, Float32Array, FloatArray, IntArray, Same
from layoutopt.layout import TagMap
from layoutopt.protocols import FloorKnowledge
from layoutopt.readings import Observations


class Constraints(NamedTuple):
    """Constraints of a whole drive, by step.

    Attributes
    ----------
    start
        Constraints of step i are the rows ``start[i]`` to ``start[i + 1]``, shape (steps + 1,).
    read_end
        The first of them, up to ``read_end[i]``, are reads; the others say what follows from reads before.
    place
        Antenna (forward, left) in ``base_link`` and tag (x, y) from the origin, shape (n, 4), m.
    shape
        Four numbers of the likelihood, shape (n, 4). Of Eq. 6 of mi2016 the first is 1 / (2 sigma²). Of a ring:
        inner and outer radius (m), 1 / width of its soft edges (1/m), logarithm of the least likelihood.
    antenna, tag
        Which ones they are, shape (n,).
    """

    start: IntArray
    read_end: IntArray
    place: Float32Array
    shape: Float32Array
    antenna: IntArray
    tag: IntArray


class Floor(NamedTuple):
    """Tags and antennas for the question what a silent antenna should have read.

    Attributes
    ----------
    active
        Whether each antenna scanned in each step, shape (steps, antennas).
    antenna
        Forward, left, read radius (m) and whether two tags in the field collide (0 or 1), shape (antennas, 4).
    tag_m, tag_sigma_m, tag
        Places from the origin, deviations and indices in the tag map, sorted by bucket: (n, 2), (n,), (n,).
    start, low_m, cell_m, columns, rows
        Buckets of a `layoutopt.detection.BucketGrid` about the origin.
    edge_share
        Width of the soft edge of a disc in read radii.
    log_miss
        Logarithm of the chance that a scan in range brings nothing.
    """

    active: BoolArray
    antenna: Float32Array
    tag_m: Float32Array
    tag_sigma_m: Float32Array
    tag: IntArray
    start: IntArray
    low_m: tuple[float, float]
    cell_m: float
    columns: int
    rows: int
    edge_share: float
    log_miss: float


@dataclass(frozen=True, slots=True, kw_only=True)
class ReadColumns:
    """Reads of known tags of a whole drive: step, antenna and tag of each, shape (n,), and their start by step."""

    step: IntArray
    antenna: IntArray
    tag: IntArray
    start: IntArray


def reads_of(observations: Observations) -> ReadColumns:
    """Return the reads whose tags the map holds."""
    known = observations.read_tag >= 0
    start = np.concatenate([[0], np.cumsum(known)])[observations.read_start].astype(np.int64)
    return ReadColumns(
        step=np.repeat(np.arange(len(observations)), np.diff(start)),
        antenna=observations.read_antenna[known],
        tag=observations.read_tag[known],
        start=start,
    )


def origin_of(knowledge: FloorKnowledge, place_m: tuple[float, float]) -> FloatArray:
    """Return the middle of the tag map, from which single precision counts, or the place given without tags."""
    if len(knowledge.tags) == 0:
        return np.array(place_m, dtype=np.float64)
    low_m, high_m = tag_bounds_m(Same(knowledge.tags))
    return (low_m + high_m) / 2.0


def places(reads: ReadColumns, knowledge: FloorKnowledge, origin_m: FloatArray) -> Float32Array:
    """Return the ``place`` column of constraints."""
    place = np.empty((len(reads.tag), 4), dtype=np.float32)
    place[:, :2] = knowledge.antennas.xy_m.take(reads.antenna, axis=0)
    place[:, 2:] = knowledge.tags.xy_m.take(reads.tag, axis=0) - origin_m
    return place


def read_constraints(reads: ReadColumns, place: Float32Array, shape: FloatArray) -> Constraints:
    """Return constraints that are reads only."""
    return Constraints(
        start=reads.start,
        read_end=reads.start[1:].copy(),
        place=np.ascontiguousarray(place),
        shape=np.ascontiguousarray(shape, dtype=np.float32),
        antenna=np.ascontiguousarray(reads.antenna),
        tag=np.ascontiguousarray(reads.tag),
    )


def no_floor(observations: Observations) -> Floor:
    """Return a floor for filters that do not ask what a silent antenna should have read."""
    return Floor(
        active=np.zeros((len(observations), 0), dtype=np.bool_),
        antenna=np.zeros((0, 4), dtype=np.float32),
        tag_m=np.zeros((0, 2), dtype=np.float32),
        tag_sigma_m=np.zeros(0, dtype=np.float32),
        tag=np.zeros(0, dtype=np.int64),
        start=np.zeros(2, dtype=np.int64),
        low_m=(0.0, 0.0),
        cell_m=1.0,
        columns=1,
        rows=1,
        edge_share=1.0,
        log_miss=0.0,
    )


def floor_of(
    observations: Observations,
    knowledge: FloorKnowledge,
    origin_m: FloatArray,
    *,
    edge_share: float,
    miss_share: float,
) -> Floor:
    """Return the floor with all tags of the map and the antennas that reach it."""
    antennas = knowledge.antennas
    buckets = _buckets(Same(knowledge.tags), float(antennas.radius_m.max(initial=0.0)), tuple(origin_m.tolist()))
    return buckets._replace(
        active=np.ascontiguousarray(observations.active & (antennas.radius_m > 0.0)),
        antenna=np.column_stack([antennas.xy_m, antennas.radius_m, antennas.one_tag]).astype(np.float32),
        edge_share=edge_share,
        log_miss=float(np.log(miss_share)),
    )


@lru_cache(maxsize=16)
def _buckets(tags: Same[TagMap], radius_m: float, origin_m: tuple[float, float]) -> Floor:
    """Return a floor with all tags of a map, made once, and no antenna yet."""
    grid = bucket_grid(tags.value.xy_m - np.array(origin_m), radius_m)
    return Floor(
        active=np.zeros((0, 0), dtype=np.bool_),
        antenna=np.zeros((0, 4), dtype=np.float32),
        tag_m=grid.xy_m.astype(np.float32),
        tag_sigma_m=np.asarray(tags.value.sigma_m)[grid.order].astype(np.float32),
        tag=grid.order,
        start=grid.start,
        low_m=grid.origin_m,
        cell_m=grid.cell_m,
        columns=grid.columns,
        rows=grid.rows,
        edge_share=1.0,
        log_miss=0.0,
    )


def edge_width_m(edge_share: float, knowledge: FloorKnowledge, antenna: IntArray, tag: IntArray) -> FloatArray:
    """Return the width of the soft edge for pairs of antenna and tag, shape (n,), m; never zero."""
    share_m = edge_share * knowledge.antennas.radius_m[antenna]
    return np.maximum(np.hypot(share_m, np.asarray(knowledge.tags.sigma_m)[tag]), LEAST_WIDTH_M)
