"""How often a robot sees a tag on a real floor: from random poses, and on random straight runs.

A floor ends at walls and has zones, obstacles and holes in its pattern, so that no closed form holds. Poses and
runs are drawn evenly over where the robot can drive, the same ones for every layout, and looked up in the bucket
grid over all tags. The scores are shares of these, with the standard error of a share.
"""

import math
from dataclasses import dataclass, field
from functools import lru_cache
from typing import ClassVar, Final

import numpy as np
import shapely

from layoutopt.detection import BucketGrid, antennas_of
from layoutopt.identity import FloatArray, IntArray, by_content
from layoutopt.layout import FloorTags, Layout
from layoutopt.protocols import ObjectiveCard
from layoutopt.robot import Robot
from layoutopt.scenario import Scenario
from layoutopt.scores import SCORE_UNITS, Score, Scores, TrialOutcomes
from layoutopt.sightings import grid_for_ways, tags_on_runs
from layoutopt.simulation.routes import free_space
from layoutopt.site import Site

CARD: Final = ObjectiveCard(
    summary=(
        "Share of random poses on the site that see at least one tag and at least two, and of random straight "
        "runs of 1 m that see at least one."
    ),
    reference="own; standard error of a share",
    scores={name: SCORE_UNITS[name] for name in ("pose_coverage", "pose_coverage_two", "run_coverage")},
    fidelity="sampled",
)
RUN_LENGTH_M: Final = 1.0
"""The run of which the score ``run_coverage`` speaks."""
_ROUNDS: Final = 50
"""How many times as many runs as wanted are tried before a site counts as too narrow for them."""


def random_runs(site: Site, robot: Robot, count: int, length_m: float, seed: int) -> FloatArray:
    """Return poses from which the robot can drive straight ahead for a length, shape (k, 3), m and rad.

    Starts and headings are uniform over all runs that keep the robot's centre where it can be driven. There are
    ``count`` of them, none where the site is too narrow. A length of zero gives poses.

    Raises
    ------
    ValueError
        If the length is negative or not finite.
    """
    if not 0.0 <= length_m < math.inf:
        raise ValueError(f"the length of a run must be zero or more and finite, got {length_m}")
    return _random_runs(site, robot.radius_m, count, length_m, seed)


def tags_seen(layout: Layout, scenario: Scenario, poses: FloatArray, length_m: float, most: int) -> IntArray:
    """Return how many different tags a layout's antennas see on straight runs, shape (k,), counted up to ``most``.

    Every antenna sees all the way, whatever its turn in the scan cycle.

    Parameters
    ----------
    poses
        x, y (m) and heading (rad) at the start of each run, shape (k, 3).
    length_m
        How far each run goes straight ahead; zero for what is seen from the pose itself.
    """
    way_m = length_m * np.stack([np.cos(poses[:, 2]), np.sin(poses[:, 2])], axis=1)
    antennas = antennas_of(layout, scenario.step_s)
    return tags_on_runs(poses, way_m, antennas, _grid(layout.floor_tags, scenario.site), most)


def share_of(hits: int, count: int) -> Score:
    """Return a share with its standard error.

    Examples
    --------
    >>> share_of(75, 100).value, round(share_of(75, 100).standard_error, 4)
    (0.75, 0.0435)
    """
    value = hits / count
    error = math.sqrt(value * (1.0 - value) / max(count - 1, 1))
    return Score(value=value, unit="", standard_error=error, count=count, share=True)


@by_content
@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Coverage:
    """Coverage of the whole site by all antennas together.

    ``samples`` poses and as many runs are drawn from ``seed``. A site too narrow for straight runs of 1 m has no
    ``run_coverage``.

    Raises
    ------
    ValueError
        If there are fewer than two samples.
    """

    samples: int = 1000
    seed: int = 0
    key: str = field(init=False, repr=False, default="")
    card: ClassVar[ObjectiveCard] = CARD

    def __post_init__(self) -> None:
        """Check the number of samples."""
        if self.samples < 2:
            raise ValueError(f"a share needs at least two samples, got {self.samples}")

    def __call__(self, layout: Layout, scenario: Scenario, outcomes: TrialOutcomes | None) -> Scores:
        """Return the shares; none without an HF antenna.

        Raises
        ------
        InvalidInput
            If the robot fits nowhere on the site.
        """
        if len(antennas_of(layout, scenario.step_s)) == 0:
            return {}
        site, robot = scenario.site, scenario.robot
        poses = random_runs(site, robot, self.samples, 0.0, self.seed)
        from_poses = tags_seen(layout, scenario, poses, 0.0, 2)
        scores = {
            "pose_coverage": share_of(int((from_poses >= 1).sum()), len(poses)),
            "pose_coverage_two": share_of(int((from_poses >= 2).sum()), len(poses)),
        }
        runs = random_runs(site, robot, self.samples, RUN_LENGTH_M, self.seed)
        if len(runs):
            on_runs = tags_seen(layout, scenario, runs, RUN_LENGTH_M, 1)
            scores["run_coverage"] = share_of(int(on_runs.sum()), len(runs))
        return scores


@lru_cache(maxsize=32)
def _grid(floor_tags: FloorTags, site: Site) -> BucketGrid:
    return grid_for_ways(floor_tags.lay_on(site).xy_m)


@lru_cache(maxsize=32)
def _random_runs(site: Site, radius_m: float, count: int, length_m: float, seed: int) -> FloatArray:
    space = free_space(site, radius_m)
    draws = np.random.Generator(np.random.Philox(seed))
    shapely.prepare(space.region)
    kept: list[FloatArray] = []
    found = 0
    for _ in range(_ROUNDS):
        start_m, _ = space.draw(draws, count)
        heading_rad = draws.uniform(-math.pi, math.pi, count)
        end_m = start_m + length_m * np.stack([np.cos(heading_rad), np.sin(heading_rad)], axis=1)
        inside = (
            shapely.covers(space.region, shapely.linestrings(np.stack([start_m, end_m], axis=1)))
            if length_m > 0.0
            else np.ones(count, dtype=np.bool_)
        )
        kept.append(np.column_stack([start_m, heading_rad])[inside])
        found += int(inside.sum())
        if found >= count:
            poses = np.concatenate(kept)[:count]
            poses.flags.writeable = False
            return poses
    return np.empty((0, 3))
