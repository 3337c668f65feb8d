"""Clusters of a laser scan that may be people, and their radial velocities: the plain form, and the truth.

The compiled twin is `laser_clusters_kernels`.
"""

import math
from typing import Final, NamedTuple

import numpy as np

from layoutopt.identity import FloatArray, IntArray
from layoutopt.tracking_world import LaserScanner


class Clustering(NamedTuple):
    """How a scan is cut into clusters.

    Attributes
    ----------
    group_m
        Two returns that follow each other belong together if they lie nearer than this, plus the spacing of the
        beams there.
    split_m
        A group is cut at the return farthest from the line through its ends if that is farther than this, plus
        the spacing of the beams there.
    least_returns
        Returns of a cluster at least, and of both parts of a cut.
    largest_radius_m
        R_max: what is larger is no person.

    References
    ----------
    Przybyla: Detection and tracking of 2D geometric obstacles from LRF data, 2017 (liang2020's [35]), and the
    author's program obstacle_detector: both distances, the fitted line, and that what is hidden becomes no circle
    (there as soon as one end is). R_max is not printed in liang2020.
    """

    group_m: float = 0.1
    split_m: float = 0.2
    least_returns: int = 3
    largest_radius_m: float = 0.4


PEOPLE: Final = Clustering()
"""A half circle of 0.22 m is not cut, because its bow is 0.2 m high at most."""


def check_scans(ranges_m: FloatArray, laser: LaserScanner) -> None:
    """Check ranges of scans, shape (..., beams).

    Raises
    ------
    ValueError
        If there are not as many as beams, or one is NaN or negative.
    """
    beams = len(laser.beam_rad)
    if ranges_m.shape[-1:] != (beams,):
        raise ValueError(f"the scanner has {beams} beams, and the scans have the shape {ranges_m.shape}")
    bad = np.argwhere(~(ranges_m >= 0.0))
    if len(bad):
        *scan, beam = bad[0].tolist()
        where = f"beam {beam}" + (f" of scan {scan[0]}" if scan else "")
        raise ValueError(
            f"{len(bad)} ranges of laser scans are NaN or negative, the first in {where}: an infinite range says "
            "that nothing is there; leave out what the scanner did not measure by making it infinite"
        )


def laser_clusters(ranges_m: FloatArray, laser: LaserScanner, clustering: Clustering = PEOPLE) -> FloatArray:
    """Return the clusters of a scan that may be people: rows of x, y and radius in the robot's frame, m.

    Returns are grouped by their distances, groups are cut where they bend (iterative end point fit), and each part
    becomes the circle that has its guide line as diameter (Eq. 5): the line of total least squares, between the
    feet of the first and the last return. All returns make it, so that it is steadier than the line between these
    two, and velocities with it; that of a person lies before the middle, by about three quarters of the radius.

    A part is left out that has no free end, neither cut off from its neighbour nor hidden by something nearer on
    the next beam: how large it is nobody sees, and a wall behind people would become clusters whose ends move as
    they walk.

    Raises
    ------
    ValueError
        If there are not as many ranges as beams, or one is NaN or negative.

    References
    ----------
    liang2020, Section 3.2 and Eq. 5.
    """
    check_scans(ranges_m, laser)
    seen = np.isfinite(ranges_m)
    angle_rad, range_m = laser.beam_rad[seen], ranges_m[seen]
    points_m = np.stack([range_m * np.cos(angle_rad), range_m * np.sin(angle_rad)], axis=1)
    allowance_m = range_m * laser.step_rad
    gap_m = np.sqrt((np.diff(points_m, axis=0) ** 2).sum(axis=1))
    cuts = np.flatnonzero(gap_m >= clustering.group_m + allowance_m[1:]) + 1
    beside = np.diff(np.flatnonzero(seen)) == 1
    hidden = np.array(
        [[*(beside & (np.diff(range_m) < 0.0)), False], [False, *(beside & (np.diff(range_m) > 0.0))]]
    )
    found = []
    for group in np.split(np.arange(len(points_m)), cuts):
        for first, last in _parts(points_m, allowance_m, group, clustering):
            free = (first == group[0] and not hidden[1, first]) or (last == group[-1] and not hidden[0, last])
            x_m, y_m, radius_m = _circle(points_m[first : last + 1])
            if free and 0.0 < radius_m <= clustering.largest_radius_m:
                found.append([x_m, y_m, radius_m])
    return np.array(found).reshape(-1, 3)


def nearest_before(centres_m: FloatArray, before_m: FloatArray) -> IntArray:
    """Return which of the clusters before, shape (m, 2), lies nearest to each, shape (n, 2), by Eq. 6, shape (n,).

    Raises
    ------
    ValueError
        If there were none before.
    """
    if len(before_m) == 0:
        raise ValueError("no cluster is nearest where there was none before")
    away_m2 = ((centres_m[:, None, :] - before_m[None, :, :]) ** 2).sum(axis=2)
    return np.asarray(away_m2.argmin(axis=1), dtype=np.int64)


def radial_velocities(
    centres_m: FloatArray, before_m: FloatArray, interval_s: float, from_m: tuple[float, float] = (0.0, 0.0)
) -> FloatArray:
    """Return how fast clusters, shape (n, 2), went away from ``from_m`` since the scan before, shape (n,), m/s.

    Eq. 7 counts from the robot, which is the same where its antennas are at its middle.

    References
    ----------
    liang2020, Eq. 6-7.
    """
    then_m = before_m[nearest_before(centres_m, before_m)] - np.array(from_m)
    now_m = centres_m - np.array(from_m)
    return np.asarray((np.sqrt((now_m**2).sum(axis=1)) - np.sqrt((then_m**2).sum(axis=1))) / interval_s)


def _circle(points_m: FloatArray) -> tuple[float, float, float]:
    """Return x, y and radius of the circle whose diameter is the guide line of returns, shape (n, 2)."""
    middle_m = points_m.mean(axis=0)
    x_m, y_m = (points_m - middle_m).T
    angle_rad = 0.5 * math.atan2(2.0 * float(x_m @ y_m), float(x_m @ x_m - y_m @ y_m))
    cos, sin = math.cos(angle_rad), math.sin(angle_rad)
    begin_m, end_m = cos * x_m[0] + sin * y_m[0], cos * x_m[-1] + sin * y_m[-1]
    along_m = 0.5 * (begin_m + end_m)
    return (
        float(middle_m[0] + along_m * cos),
        float(middle_m[1] + along_m * sin),
        0.5 * abs(float(end_m - begin_m)),
    )


def _parts(
    points_m: FloatArray, allowance_m: FloatArray, part: IntArray, clustering: Clustering
) -> list[tuple[int, int]]:
    """Return first and last return of each part of a group; the one at a cut ends one part and begins the next."""
    if len(part) < clustering.least_returns:
        return []
    first, last = int(part[0]), int(part[-1])
    away_m = points_m[part] - points_m[first]
    line_m = away_m[-1]
    length_m = math.sqrt(line_m[0] * line_m[0] + line_m[1] * line_m[1])
    if length_m > 0.0:
        bow_m = np.abs(line_m[0] * away_m[:, 1] - line_m[1] * away_m[:, 0]) / length_m
    else:
        bow_m = np.sqrt((away_m**2).sum(axis=1))
    cut = int(bow_m.argmax())
    bent = bow_m[cut] > clustering.split_m + allowance_m[part[cut]]
    if bent and min(cut + 1, len(part) - cut) >= clustering.least_returns:
        before, after = part[: cut + 1], part[cut:]
        return [
            *_parts(points_m, allowance_m, before, clustering),
            *_parts(points_m, allowance_m, after, clustering),
        ]
    return [(first, last)]
