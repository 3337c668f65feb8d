"""What the scans of a drive could have read and what they did read, along a path and without one."""

from dataclasses import dataclass
from typing import Final

import numpy as np

from layoutopt.commissioning.estimated import Fitted, fitted_share
from layoutopt.commissioning.replay import Replay
from layoutopt.detection import bucket_grid
from layoutopt.geometry import wrapped
from layoutopt.identity import BoolArray, FloatArray, IntArray
from layoutopt.readings import UNKNOWN_TAG
from layoutopt.simulation.motion import integrate
from layoutopt.simulation.sensing import antenna_centres, compiled_detections

MARGIN_MOST_M: Final = 0.1
"""Farther beyond the read radius no read is taken for that of a scattered tag."""
_MARGIN_LEAST_M: Final = 0.01
_PATH_DEVIATIONS: Final = 4.0
_CORNER_RAD: Final = 0.35
_STANDING_M: Final = 0.0005


@dataclass(frozen=True, slots=True, kw_only=True)
class Chances:
    """Pairs of a scan and a tag that it could have read.

    ``beyond_m`` is how far the planned tag lies beyond the read radius (negative inside), ``radius_m`` that
    radius, ``hit`` whether it was read, ``tag`` which it is, ``scan`` which scan it was; shape (n,) each.
    """

    beyond_m: FloatArray
    radius_m: FloatArray
    hit: BoolArray
    tag: IntArray
    scan: IntArray

    def __len__(self) -> int:
        """Return the number of pairs."""
        return len(self.hit)

    def among(self, rows: BoolArray) -> "Chances":
        """Return some of the pairs."""
        return Chances(
            beyond_m=self.beyond_m[rows],
            radius_m=self.radius_m[rows],
            hit=self.hit[rows],
            tag=self.tag[rows],
            scan=self.scan[rows],
        )


def between_reads(replayed: Replay) -> tuple[int, int]:
    """Return how many scans between two reads of one pass brought nothing, and how many such scans there were.

    A read disc has no dents: an antenna that reads a tag and, farther along a line or an arc, reads it again had
    it in the disc all the way. So the scans strictly between first and last read of such a pass are reads or
    misses, whatever the pose. A pass ends where the antenna turns a corner, by odometry, or has moved on by twice
    the width of the disc; neither depends on what was read.
    """
    observations, antennas = replayed.drive.observations, replayed.knowledge.antennas
    centre_m = antenna_centres(integrate((0.0, 0.0, 0.0), observations.increments)[1:], antennas)
    moved_m = np.diff(centre_m, axis=0, prepend=centre_m[:1])
    way_m = np.linalg.norm(moved_m, axis=2).cumsum(axis=0)
    leg = _legs(moved_m)
    scans = observations.active.cumsum(axis=0)
    step = np.repeat(np.arange(len(observations)), np.diff(observations.read_start))
    antenna, tag = observations.read_antenna, observations.read_tag
    use = (tag != UNKNOWN_TAG) & replayed.drive.steady[antenna] & ~antennas.one_tag[antenna]
    step, antenna, tag = step[use], antenna[use], tag[use]
    order = np.lexsort((step, tag, antenna))
    step, antenna, tag = step[order], antenna[order], tag[order]
    same = (antenna[1:] == antenna[:-1]) & (tag[1:] == tag[:-1])
    same &= leg[step[1:], antenna[1:]] == leg[step[:-1], antenna[:-1]]
    same &= way_m[step[1:], antenna[1:]] - way_m[step[:-1], antenna[:-1]] <= 4.0 * antennas.radius_m[antenna[1:]]
    missed = int((scans[step[1:], antenna[1:]] - scans[step[:-1], antenna[:-1]] - 1)[same].sum())
    # Between first and last of a pass lie all its other reads: those with a neighbour of the pass on both sides.
    inner = int((same[1:] & same[:-1]).sum())
    return missed, missed + inner


def _legs(moved_m: FloatArray) -> IntArray:
    """Return on which leg between corners each antenna is, shape (steps, antennas).

    ``moved_m`` are its moves in the steps, shape (steps, antennas, 2).
    """
    heading = np.arctan2(moved_m[:, :, 1], moved_m[:, :, 0])
    moving = np.linalg.norm(moved_m, axis=2) > _STANDING_M
    # While an antenna stands it keeps the direction in which it came.
    last = np.maximum.accumulate(np.where(moving, np.arange(len(moved_m))[:, None], 0), axis=0)
    heading = np.take_along_axis(heading, last, axis=0)
    turned_rad = np.abs(wrapped(np.diff(heading, axis=0, prepend=heading[:1])))
    return np.asarray((turned_rad > _CORNER_RAD).cumsum(axis=0))


def chances_of(replayed: Replay) -> tuple[Chances, Fitted | None, list[str]]:
    """Return the pairs of scan and tag along the reference path, the share of wrong reads, and notes.

    Scans that read a tag out of reach do not count, nor do those of one-tag readers with two tags near, nor those
    of antennas whose turns are not known.
    """
    drive, knowledge = replayed.drive, replayed.knowledge
    observations, antennas = drive.observations, knowledge.antennas
    count = len(antennas)
    reference = replayed.reference
    known = np.asarray(np.isfinite(reference).all(axis=1), dtype=np.bool_)
    centre_m = antenna_centres(np.where(known[:, None], reference, 0.0), antennas)
    step = np.repeat(np.arange(len(observations)), np.diff(observations.read_start))
    antenna, tag = observations.read_antenna, observations.read_tag
    use = known[step] & (tag != UNKNOWN_TAG)
    step, antenna, tag = step[use], antenna[use], tag[use]
    away_m = (
        np.linalg.norm(knowledge.tags.xy_m[tag] - centre_m[step, antenna], axis=1) - antennas.radius_m[antenna]
    )
    margin_m = _margin_m(away_m)
    doubt_m = _path_doubt_m(replayed)[step]
    far = np.asarray(away_m > margin_m + doubt_m)
    wrong = fitted_share(int(far.sum()), len(far), "reads") if len(far) and np.isfinite(doubt_m).all() else None
    active = observations.active & known[:, None] & drive.steady & (antennas.radius_m > 0.0)
    active[step[far], antenna[far]] = False
    grid = bucket_grid(np.asarray(knowledge.tags.xy_m), float(antennas.radius_m.max(initial=0.0)) + margin_m)
    at, by, of = compiled_detections(
        centre_m, active, np.where(antennas.radius_m > 0.0, antennas.radius_m + margin_m, 0.0), grid
    )
    scan = at * count + by
    several = np.bincount(scan, minlength=1)[scan] > 1
    alone = np.asarray(~(antennas.one_tag[by] & several))
    at, by, of, scan = at[alone], by[alone], of[alone], scan[alone]
    tags = len(knowledge.tags)
    hit = np.asarray(np.isin(scan * tags + of, (step * count + antenna) * tags + tag), dtype=np.bool_)
    chances = Chances(
        beyond_m=np.linalg.norm(knowledge.tags.xy_m[of] - centre_m[at, by], axis=1) - antennas.radius_m[by],
        radius_m=antennas.radius_m[by],
        hit=hit,
        tag=of,
        scan=scan,
    )
    notes = []
    if not known.all():
        notes.append(f"{int((~known).sum())} of {len(known)} steps without a known pose do not count for reads")
    return chances, wrong, notes


def _path_doubt_m(replayed: Replay) -> FloatArray:
    """Return how far the reference path may be off in each step, shape (n,), infinite if nobody knows."""
    steps, sigma_m = len(replayed.trajectory.poses), replayed.stated_sigma_m
    if replayed.with_truth:
        return np.zeros(steps)
    return np.full(steps, np.inf) if sigma_m is None else MARGIN_MOST_M + _PATH_DEVIATIONS * sigma_m


def _margin_m(away_m: FloatArray) -> float:
    """Return how far beyond the read radius a read may still be that of a scattered tag and not a wrong one."""
    outside = away_m[(away_m > 0.0) & (away_m < MARGIN_MOST_M)]
    if len(outside) == 0:
        return _MARGIN_LEAST_M
    return float(np.clip(2.0 * np.quantile(outside, 0.99), _MARGIN_LEAST_M, MARGIN_MOST_M))
