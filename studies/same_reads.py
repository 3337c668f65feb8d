"""Poses that a robot cannot tell apart while it stands: those from which its antennas read the same tags.

Identities are unique, so a set of reads names its tags. Poses are drawn evenly over one cell of a pattern without
borders and over all headings, and shifted by whole periods until the first tag that they read lies in one cell:
then two poses give the same reads if and only if the sets are equal, and together they stand for the whole floor.
"""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
import numpy.typing as npt

from layoutopt.geometry import reduced_cell, wrapped
from layoutopt.identity import BoolArray, FloatArray, IntArray
from layoutopt.layout import TagPattern
from layoutopt.protocols import Antennas

_DIRECTIONS: Final = 16
"""Directions in which a set of places is measured; the widest of these widths is at most 0.5 % too small."""
_STREAM: Final = 1
MOST_ANTENNAS: Final = 10**9
"""More antennas than any robot has."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Likeness:
    """How far poses with the same reads are apart.

    Attributes
    ----------
    antennas_reading
        Number of antennas that read a tag, one for each pose, shape (n,).
    apart_m, apart_rad
        For each pose the largest distance, and difference in heading, found between poses of its reads, shape
        (n,); zero for one whose reads no other pose has. What other samples would add is not in it.
    alone
        Whether a pose that reads a tag shares its reads with no other one drawn, shape (n,).
    """

    antennas_reading: IntArray
    apart_m: FloatArray
    apart_rad: FloatArray
    alone: BoolArray

    def share(self, least: int, most: int) -> float:
        """Return the share of poses in which so many antennas read a tag."""
        return float(self._of(least, most).mean())

    def mean_m(self, least: int, most: int) -> float:
        """Return the mean distance over the poses in which so many antennas read; NaN if there are none."""
        chosen = self._of(least, most)
        return float(self.apart_m[chosen].mean()) if chosen.any() else math.nan

    def largest_m(self, least: int, most: int) -> float:
        """Return the largest distance over these poses; NaN if there are none."""
        chosen = self._of(least, most)
        return float(self.apart_m[chosen].max()) if chosen.any() else math.nan

    def mean_rad(self, least: int, most: int) -> float:
        """Return the mean difference in heading over these poses; NaN if there are none."""
        chosen = self._of(least, most)
        return float(self.apart_rad[chosen].mean()) if chosen.any() else math.nan

    @property
    def alone_share(self) -> float:
        """Share of the poses that read a tag whose reads no other one has; NaN if none reads a tag."""
        reading = self._of(1, MOST_ANTENNAS)
        return float(self.alone[reading].mean()) if reading.any() else math.nan

    def _of(self, least: int, most: int) -> BoolArray:
        return np.asarray((self.antennas_reading >= least) & (self.antennas_reading <= most))


def farthest_m(antennas: Antennas) -> float:
    """Return how far two poses that read one tag with one antenna may be apart at most, m.

    The antenna is within its read radius r of the tag in both, and the middle of the robot at the distance d from
    the antenna: each lies within d + r of the tag, so they lie within 2 (d + r) of each other.
    """
    return float(2.0 * (np.linalg.norm(antennas.xy_m, axis=1) + antennas.radius_m).max())


def likeness(pattern: TagPattern, antennas: Antennas, poses: int, seed: int) -> Likeness:
    """Return how far poses with the same reads are apart over a periodic pattern.

    Raises
    ------
    ValueError
        If the pattern does not repeat.
    """
    if pattern.cell_m is None:
        raise ValueError(f"the pattern '{pattern.name}' does not repeat, so no cell of it stands for the floor")
    draws = np.random.Generator(np.random.Philox([seed, _STREAM]))
    cell_m = reduced_cell(pattern.cell_m)
    xy_m = draws.random((poses, 2)) @ cell_m
    heading_rad = 2.0 * math.pi * draws.random(poses)
    reads = _reads(xy_m, heading_rad, pattern.points_m, cell_m, antennas)
    pose, antenna, tag, step = reads
    antennas_reading = np.zeros(poses, dtype=np.int64)
    new = np.ones(len(pose), dtype=np.bool_)
    new[1:] = (pose[1:] != pose[:-1]) | (antenna[1:] != antenna[:-1])
    np.add.at(antennas_reading, pose[new], 1)
    first = np.searchsorted(pose, np.arange(poses))
    sees = antennas_reading > 0
    origin = np.zeros((poses, 2), dtype=np.int64)
    origin[sees] = step[first[sees]]
    # The sum of well mixed numbers of all reads is one number for the set; 64 bits make equal sums of unequal
    # sets as good as impossible.
    mixed = _mixed(np.stack([antenna, tag, *(step - origin[pose]).T]))
    key = np.zeros(poses, dtype=np.uint64)
    np.add.at(key, pose, mixed)
    apart_m, apart_rad, alone = np.zeros(poses), np.zeros(poses), np.zeros(poses, dtype=np.bool_)
    seeing = np.flatnonzero(sees)
    order = seeing[np.argsort(key[seeing], kind="stable")]
    if len(order):
        starts = np.flatnonzero(np.concatenate([[True], key[order][1:] != key[order][:-1]]))
        sizes = np.diff(np.append(starts, len(order)))
        shifted_m = (xy_m - origin @ cell_m)[order]
        reference_rad = np.repeat(heading_rad[order][starts], sizes)
        off_rad = wrapped(heading_rad[order] - reference_rad)
        widest = np.zeros(len(starts))
        for number in range(_DIRECTIONS):
            angle_rad = math.pi * number / _DIRECTIONS
            widest = np.maximum(
                widest, _width(shifted_m @ np.array([math.cos(angle_rad), math.sin(angle_rad)]), starts)
            )
        apart_m[order] = np.repeat(widest, sizes)
        apart_rad[order] = np.repeat(_width(np.asarray(off_rad), starts), sizes)
        alone[order] = np.repeat(sizes == 1, sizes)
    return Likeness(antennas_reading=antennas_reading, apart_m=apart_m, apart_rad=apart_rad, alone=alone)


def _width(values: FloatArray, starts: IntArray) -> FloatArray:
    return np.asarray(np.maximum.reduceat(values, starts) - np.minimum.reduceat(values, starts))


def _reads(
    xy_m: FloatArray, heading_rad: FloatArray, points_m: FloatArray, cell_m: FloatArray, antennas: Antennas
) -> tuple[IntArray, IntArray, IntArray, IntArray]:
    """Return pose, antenna, point of the cell and steps of the lattice, shape (n, 2), of every read, sorted."""
    inverse = np.linalg.inv(cell_m)
    cos, sin = np.cos(heading_rad), np.sin(heading_rad)
    found = []
    for antenna, ((x_m, y_m), radius_m) in enumerate(zip(antennas.xy_m, antennas.radius_m, strict=True)):
        centre_m = xy_m + np.stack([cos * x_m - sin * y_m, sin * x_m + cos * y_m], axis=1)
        # In a reduced cell no point of a disc is farther than this many steps from its centre.
        reach = math.ceil(float(radius_m * np.linalg.norm(inverse, axis=0).max())) + 1
        for tag, point_m in enumerate(points_m):
            off_m = centre_m - point_m
            near = np.floor(off_m @ inverse).astype(np.int64)
            for i in range(-reach, reach + 1):
                for j in range(-reach, reach + 1):
                    step = near + np.array([i, j])
                    pose = np.flatnonzero(np.linalg.norm(off_m - step @ cell_m, axis=1) < radius_m)
                    found.append(np.column_stack([pose, np.full((len(pose), 2), (antenna, tag)), step[pose]]))
    rows = np.concatenate(found)
    rows = rows[np.lexsort(rows.T[::-1])]
    return rows[:, 0], rows[:, 1], rows[:, 2], rows[:, 3:]


def _mixed(columns: IntArray) -> npt.NDArray[np.uint64]:
    """Return a well mixed number of 64 bits for each column of integers (the finaliser of SplitMix64)."""
    value = np.zeros(columns.shape[1], dtype=np.uint64)
    for row in columns.astype(np.uint64):
        value = value + row + np.uint64(0x9E3779B97F4A7C15)
        value = (value ^ (value >> np.uint64(30))) * np.uint64(0xBF58476D1CE4E5B9)
        value = (value ^ (value >> np.uint64(27))) * np.uint64(0x94D049BB133111EB)
        value = value ^ (value >> np.uint64(31))
    return value
