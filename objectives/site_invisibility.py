"""Blind runs on a real floor: the measures of `objectives.invisibility` where walls, zones and obstacles end them.

On random runs the sighting distance is censored: a run ends at the wall whether or not a tag came into view. The
estimator of Kaplan and Meier takes that into account, as long as how far the wall is tells nothing of how far the
next tag is. Along simulated drives the stretches without a tag in view are measured themselves.
"""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
import shapely

from layoutopt.detection import antennas_of
from layoutopt.identity import FloatArray
from layoutopt.layout import Layout
from layoutopt.scenario import Scenario
from layoutopt.scores import Score
from layoutopt.sightings import Sightings, antenna_segments, grid_for_ways, run_sightings, segment_sightings
from layoutopt.simulation.motion import drive
from layoutopt.simulation.routes import free_space
from layoutopt.streams import Streams
from objectives.coverage import random_runs

RUNS: Final = 4000
"""Random runs, unless told otherwise."""


@dataclass(frozen=True, slots=True, kw_only=True)
class BlindRunCurve:
    """Probability that a robot on a random straight run has seen no tag yet, by the length of the run.

    Attributes
    ----------
    length_m, blind, standard_error
        The curve falls to ``blind`` at each length, shape (k,), which begin at zero; standard errors after
        Greenwood.
    runs
        How many runs it rests on.
    longest_m
        The longest run: nothing is known of greater lengths.
    """

    length_m: FloatArray
    blind: FloatArray
    standard_error: FloatArray
    runs: int
    longest_m: float

    def at(self, length_m: float) -> Score:
        """Return the blind probability of a run of a length.

        Raises
        ------
        ValueError
            If the length is negative or beyond the longest run.
        """
        if not 0.0 <= length_m <= self.longest_m:
            raise ValueError(f"runs on this site are 0 to {self.longest_m:.4g} m long, and {length_m} m is not")
        step = int(np.searchsorted(self.length_m, length_m, side="right")) - 1
        return Score(
            value=float(self.blind[step]),
            unit="",
            standard_error=float(self.standard_error[step]),
            count=self.runs,
            share=True,
        )

    def quantile_m(self, probability: float) -> float:
        """Return the blind run that a share 1 - ``probability`` of runs exceeds; NaN if no run is long enough.

        Raises
        ------
        ValueError
            If the probability is not at least 0 and below 1.
        """
        if not 0.0 <= probability < 1.0:
            raise ValueError(f"the probability of a quantile must be at least 0 and below 1, got {probability}")
        below = np.flatnonzero(self.blind <= 1.0 - probability)
        return float(self.length_m[below[0]]) if len(below) else math.nan


@dataclass(frozen=True, slots=True, kw_only=True)
class BlindDrives:
    """Blind stretches of simulated drives.

    Attributes
    ----------
    way_m, blind_m
        Way of each drive, and how much of it no tag is in view, shape (n,).
    gaps_m
        Stretches from losing sight of the tags to the next sighting, of all drives, ascending; those that begin or
        end with the drive are left out.
    longest_m
        Longest blind stretch of each drive, one at its begin or end included, shape (n,).
    """

    way_m: FloatArray
    blind_m: FloatArray
    gaps_m: FloatArray
    longest_m: FloatArray

    @property
    def blind_share(self) -> Score:
        """Share of the way without a tag in view, a ratio over drives with its standard error (Cochran, 1977)."""
        count = len(self.way_m)
        share = float(self.blind_m.sum() / self.way_m.sum())
        spread = self.blind_m - share * self.way_m
        error = math.sqrt(float((spread**2).sum()) / max(count - 1, 1) / count) / float(self.way_m.mean())
        return Score(value=share, unit="", standard_error=error, count=count, share=True)

    @property
    def mean_gap_m(self) -> float:
        """Mean length of the gaps; NaN if there is none."""
        return float(self.gaps_m.mean()) if len(self.gaps_m) else math.nan

    def gap_quantile_m(self, probability: float) -> float:
        """Return a quantile of the gaps; NaN if there is none."""
        return float(np.quantile(self.gaps_m, probability)) if len(self.gaps_m) else math.nan


def blind_runs_on_site(
    layout: Layout,
    scenario: Scenario,
    *,
    direction_rad: float | None = None,
    runs: int = RUNS,
    seed: int = 0,
) -> BlindRunCurve:
    """Return how the blind probability falls along straight runs ahead, from uniform starts to the next wall.

    Parameters
    ----------
    direction_rad
        Direction of all runs; ``None`` for uniform ones.
    runs
        How many of them.

    Raises
    ------
    InvalidInput
        If the robot fits nowhere on the site.
    ValueError
        If there is no run, or the direction is not finite.
    """
    if runs < 1:
        raise ValueError(f"at least one run is needed, got {runs}")
    if direction_rad is not None and not math.isfinite(direction_rad):
        raise ValueError(f"a direction must be finite, got {direction_rad}")
    poses = np.array(random_runs(scenario.site, scenario.robot, runs, 0.0, seed))
    if direction_rad is not None:
        poses[:, 2] = direction_rad
    room_m = _room_ahead_m(scenario, poses)
    way_m = room_m[:, None] * np.stack([np.cos(poses[:, 2]), np.sin(poses[:, 2])], axis=1)
    antennas = antennas_of(layout, scenario.step_s)
    grid = grid_for_ways(layout.floor_tags.lay_on(scenario.site).xy_m)
    first_m = run_sightings(poses, way_m, antennas, grid).first_m()
    return _kaplan_meier(np.minimum(first_m, room_m), np.isfinite(first_m), float(room_m.max()))


def blind_stretches(layout: Layout, scenario: Scenario, *, drives: int, seed: int) -> BlindDrives:
    """Return the blind stretches along the true paths of simulated drives, those of the streams of a seed.

    Raises
    ------
    ValueError
        If there is no drive.
    """
    if drives < 1:
        raise ValueError(f"at least one drive is needed, got {drives}")
    antennas = antennas_of(layout, scenario.step_s)
    grid = grid_for_ways(layout.floor_tags.lay_on(scenario.site).xy_m)
    radius_m = np.tile(antennas.radius_m, scenario.step_count)
    ways_m, blind_m, longest_m, gaps_m = [], [], [], []
    for replication in range(drives):
        poses = np.array(drive(scenario, Streams(seed=seed), replication).poses)
        step_m = np.hypot(*np.diff(poses[:, :2], axis=0).T)
        done_m = np.concatenate([[0.0], np.cumsum(step_m)])
        seen = _along_path(poses, done_m, segment_sightings(_segments(poses, antennas.xy_m), radius_m, grid))
        stretches = seen.blind()
        length_m = stretches.length_m
        inner = (stretches.start_m > 0.0) & (stretches.end_m < done_m[-1])
        ways_m.append(done_m[-1])
        blind_m.append(float(length_m.sum()))
        longest_m.append(float(length_m.max(initial=0.0)))
        gaps_m.append(length_m[inner])
    return BlindDrives(
        way_m=np.array(ways_m),
        blind_m=np.array(blind_m),
        gaps_m=np.sort(np.concatenate(gaps_m)),
        longest_m=np.array(longest_m),
    )


def _segments(poses: FloatArray, antenna_m: FloatArray) -> FloatArray:
    """Return the ways of all antennas between poses that follow each other, shape (steps * antennas, 4)."""
    places = antenna_segments(poses, np.zeros((len(poses), 2)), antenna_m)[:, :2].reshape(len(poses), -1, 2)
    return np.concatenate([places[:-1], places[1:]], axis=2).reshape(-1, 4)


def _along_path(poses: FloatArray, done_m: FloatArray, seen: Sightings) -> Sightings:
    """Return the sightings of all antennas and steps as those of the one way of the robot."""
    antennas = len(seen.length_m) // (len(poses) - 1)
    begin_m, end_m = np.repeat(done_m[:-1], antennas), np.repeat(done_m[1:], antennas)
    return seen.along(np.zeros(len(begin_m), dtype=np.int64), begin_m, end_m, done_m[-1:])


def _room_ahead_m(scenario: Scenario, poses: FloatArray) -> FloatArray:
    """Return how far the robot can drive straight ahead from poses, shape (n,)."""
    region = free_space(scenario.site, scenario.robot.radius_m).region
    low_x, low_y, high_x, high_y = region.bounds
    beyond_m = math.hypot(high_x - low_x, high_y - low_y)
    ends = poses[:, :2] + beyond_m * np.stack([np.cos(poses[:, 2]), np.sin(poses[:, 2])], axis=1)
    ahead = shapely.linestrings(np.stack([poses[:, :2], ends], axis=1))
    walls = shapely.intersection(ahead, region.boundary)
    return np.asarray(shapely.distance(shapely.points(poses[:, :2]), walls))


def _kaplan_meier(end_m: FloatArray, seen: FloatArray, longest_m: float) -> BlindRunCurve:
    """Return the curve from where each run ended, shape (n,), and whether that was at a sighting.

    Kaplan and Meier, J. Amer. Statist. Assoc. 53, 1958; Greenwood's variance.
    """
    length_m = np.unique(end_m[seen])
    ends = np.sort(end_m)
    at_risk = len(ends) - np.searchsorted(ends, length_m, side="left")
    sighted = np.searchsorted(np.sort(end_m[seen]), length_m, side="right") - np.searchsorted(
        np.sort(end_m[seen]), length_m, side="left"
    )
    blind = np.cumprod(1.0 - sighted / at_risk)
    with np.errstate(divide="ignore", invalid="ignore"):
        spread = np.cumsum(np.where(at_risk > sighted, sighted / (at_risk * (at_risk - sighted)), 0.0))
    # Before the first sighting nothing has fallen yet.
    start = [] if len(length_m) and length_m[0] == 0.0 else [0.0]
    return BlindRunCurve(
        length_m=np.concatenate([start, length_m]),
        blind=np.concatenate([np.ones(len(start)), blind]),
        standard_error=np.concatenate([np.zeros(len(start)), blind * np.sqrt(spread)]),
        runs=len(end_m),
        longest_m=longest_m,
    )
