"""What a robot must see of the floor: tags from every pose, or on every straight run, here or along its routes."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Final

import numpy as np
import shapely

from layoutopt.geometry import covers, lattice_points
from layoutopt.identity import BoolArray, FloatArray, IntArray, read_only
from layoutopt.layout import WHOLE_FLOOR
from layoutopt.protocols import Antennas
from layoutopt.scenario import Scenario
from layoutopt.scores import Score
from layoutopt.sightings import grid_for_ways, run_sightings
from layoutopt.simulation.free_space import random_points, triangles_of
from layoutopt.simulation.routes import free_space, route
from layoutopt.streams import Purpose, Streams
from solvers.covering.problem import Incidence, from_pairs

_ROUNDING: Final = 1e-9
"""By this share of a step a run may end beyond its leg and still counts."""
_AT_ONCE: Final = 20_000
"""Runs looked up in one call; bounds memory."""
_ROUTE_STEP_M: Final = 0.1
"""Distance of starts along a route. A route is the dear part, so that all its runs are taken; nearer ones tell
little new."""
_MOST_LINES: Final = 20_000
"""Routes that are kept, some half a kilobyte each: questions of one scenario and seed follow the same ones."""
_ROUNDS: Final = 50
"""How many times as many runs as wanted are drawn before a zone counts as too narrow for them."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Demand:
    """At least ``tags`` different tags in view on every straight run of ``length_m``; a length of zero is a pose.

    ``zone`` names the zone in which runs begin (``""``: the whole floor). ``along_routes`` asks for runs along the
    robot's routes only, else for runs from everywhere in every direction in which the robot has room. Runs that
    touch one of the zones ``without`` are not asked for.

    Raises
    ------
    ValueError
        If there is no tag to see, or the length is negative or not finite.
    """

    tags: int = 1
    length_m: float = 0.5
    zone: str = WHOLE_FLOOR
    along_routes: bool = False
    without: tuple[str, ...] = ()

    def __post_init__(self) -> None:
        """Check the numbers."""
        if self.tags < 1:
            raise ValueError(f"a demand is for at least one tag, got {self.tags}")
        if not 0.0 <= self.length_m < math.inf:
            raise ValueError(f"the length of a run must be zero or more and finite, got {self.length_m}")


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Runs:
    """Straight runs.

    Attributes
    ----------
    poses
        Pose at the start of each, shape (n, 3), m and rad.
    way_m
        How far the robot goes, shape (n, 2), m.
    draw
        Number of the independent draw that each run belongs to, shape (n,): its route along routes, since runs of
        one route are alike; else the run itself, which is the default.

    Raises
    ------
    ValueError
        If there are not as many numbers of draws as runs.
    """

    poses: FloatArray
    way_m: FloatArray
    draw: IntArray = field(default_factory=lambda: np.empty(0, dtype=np.int64))

    def __post_init__(self) -> None:
        """Make every run a draw of its own where nothing else is said."""
        if not self.draw.size:
            object.__setattr__(self, "draw", np.arange(len(self.poses)))
        if self.draw.shape != (len(self.poses),):
            raise ValueError(f"{self.draw.size} numbers of draws for {len(self.poses)} runs")

    def __len__(self) -> int:
        """Return the number of runs."""
        return len(self.poses)

    @property
    def draws(self) -> int:
        """Number of independent draws that the runs belong to."""
        return len(np.unique(self.draw))

    def some(self, chosen: BoolArray | IntArray) -> "Runs":
        """Return some of the runs."""
        return Runs(poses=self.poses[chosen], way_m=self.way_m[chosen], draw=self.draw[chosen])


def joined(parts: Sequence[Runs]) -> Runs:
    """Return the runs of all parts, one after the other; draws of one number count as one."""
    return Runs(
        poses=np.concatenate([np.empty((0, 3)), *(part.poses for part in parts)]),
        way_m=np.concatenate([np.empty((0, 2)), *(part.way_m for part in parts)]),
        draw=np.concatenate([np.empty(0, dtype=np.int64), *(part.draw for part in parts)]),
    )


def share_by_draw(some: Runs, of: Runs) -> Score:
    """Return which share of runs some of them are, with bounds that count draws and not runs.

    The share is the mean over the draws of the share of each; runs of one draw are alike, so that many of them
    make no bound narrower.

    Raises
    ------
    ValueError
        If there are no runs, or some are of a draw that has none.
    """
    draws, number = np.unique(of.draw, return_inverse=True)
    if not len(draws) or not np.isin(some.draw, draws).all():
        raise ValueError("a share needs runs, and some of these runs")
    found = np.bincount(np.searchsorted(draws, some.draw), minlength=len(draws))
    shares = found / np.bincount(number, minlength=len(draws))
    error = float(shares.std(ddof=1)) / math.sqrt(len(shares)) if len(shares) > 1 else math.inf
    return Score(value=float(shares.mean()), unit="", standard_error=error, count=len(shares), share=True)


def runs_of(
    demand: Demand, scenario: Scenario, *, step_m: float, headings: int, routes: int = 32, seed: int = 0
) -> Runs:
    """Return runs of which a demand speaks, on a grid of starts.

    Parameters
    ----------
    step_m
        Distance of starts.
    headings
        Directions from each start, the first along x; not along routes.
    routes, seed
        Of a demand along routes: how many of the scenario's routes are followed, and the seed of its streams.
    """
    if demand.along_routes:
        return _along_routes(demand, scenario, step_m, range(routes), seed)
    region = free_space(scenario.site, scenario.robot.radius_m).region
    xmin, ymin, xmax, ymax = region.bounds
    start_m = lattice_points(np.array([(xmin, ymin)]), step_m * np.eye(2), (xmin, ymin, xmax, ymax))
    angles_rad = np.arange(headings) * (2.0 * math.pi / headings)
    poses = np.column_stack([np.repeat(start_m, headings, axis=0), np.tile(angles_rad, len(start_m))])
    return _possible(poses, demand, scenario)


def random_runs_of(demand: Demand, scenario: Scenario, count: int, seed: int, *, routes: int) -> Runs:
    """Return ``count`` runs of which a demand speaks, drawn evenly over starts and headings, or all there are.

    Along routes, ``routes`` other ones are followed than `runs_of` has with the same seed; those without a run of
    the demand are no draws. All their runs are taken, or ``count`` of them drawn evenly.
    """
    draws = np.random.Generator(np.random.Philox(seed))
    if demand.along_routes:
        runs = _along_routes(demand, scenario, _ROUTE_STEP_M, range(routes), seed + 1, draws)
        return runs.some(np.sort(draws.permutation(len(runs))[:count]))
    space = free_space(scenario.site, scenario.robot.radius_m)
    triangles_m = space.triangles_m
    if demand.zone != WHOLE_FLOOR:
        # Starts elsewhere would all be left out, and a zone may be a small part of the floor.
        common = shapely.get_parts(space.region.intersection(scenario.site.zone(demand.zone).region))
        parts = [triangles_of(part) for part in common if part.area > 0.0]
        if not parts:
            return joined([])
        triangles_m = np.concatenate(parts)
    kept: list[Runs] = []
    for _ in range(_ROUNDS):
        start_m, _ = random_points(triangles_m, draws, count)
        poses = np.column_stack([start_m, draws.uniform(-math.pi, math.pi, count)])
        kept.append(_possible(poses, demand, scenario))
        if sum(map(len, kept)) >= count:
            break
    every = joined(kept)
    # Numbered anew: of all that were drawn each run is a draw of its own.
    return Runs(poses=every.poses[:count], way_m=every.way_m[:count])


def visible(runs: Runs, antennas: Antennas, xy_m: FloatArray) -> Incidence:
    """Return which of the places, shape (n, 2), m, a robot sees on each run if there were tags."""
    grid = grid_for_ways(xy_m)
    rows, places = [np.empty(0, dtype=np.int64)], [np.empty(0, dtype=np.int64)]
    for first in range(0, len(runs), _AT_ONCE):
        block = slice(first, first + _AT_ONCE)
        seen = run_sightings(runs.poses[block], runs.way_m[block], antennas, grid)
        rows.append(seen.way + first)
        places.append(seen.tag)
    return from_pairs(np.concatenate(rows), np.concatenate(places), len(runs), len(xy_m))


def _possible(poses: FloatArray, demand: Demand, scenario: Scenario) -> Runs:
    """Return the runs from poses that begin in the demand's zone and keep the robot where it can drive."""
    region = free_space(scenario.site, scenario.robot.radius_m).region
    poses = poses[covers(region, poses[:, :2])]
    poses = poses[_begins(demand, scenario, poses)]
    way_m = demand.length_m * np.column_stack([np.cos(poses[:, 2]), np.sin(poses[:, 2])])
    if demand.length_m > 0.0 and len(poses):
        lines = shapely.linestrings(np.stack([poses[:, :2], poses[:, :2] + way_m], axis=1))
        shapely.prepare(region)
        room = shapely.covers(region, lines)
        poses, way_m = poses[room], way_m[room]
    return _kept_out(demand, scenario, Runs(poses=poses, way_m=way_m))


def _along_routes(
    demand: Demand,
    scenario: Scenario,
    step_m: float,
    routes: range,
    seed: int,
    draws: np.random.Generator | None = None,
) -> Runs:
    """Return runs along the legs of routes, none over a corner: there a robot turns, which is no straight run.

    With ``draws`` the first start of each leg is drawn, else it is its corner.
    """
    lines_m = [_line_m(scenario, seed, replication) for replication in routes]
    start_m = np.concatenate([line_m[:-1] for line_m in lines_m])
    leg_m = np.concatenate([np.diff(line_m, axis=0) for line_m in lines_m])
    route_number = np.repeat(np.array(routes), [len(line_m) - 1 for line_m in lines_m])
    length_m = np.hypot(leg_m[:, 0], leg_m[:, 1])
    first_m = np.zeros(len(leg_m)) if draws is None else draws.uniform(0.0, step_m, len(leg_m))
    room = np.floor((length_m - demand.length_m - first_m) / step_m + _ROUNDING)
    counts = np.where(length_m >= demand.length_m, np.maximum(room + 1.0, 0.0), 0.0).astype(np.int64)
    leg = np.repeat(np.arange(len(counts)), counts)
    nth = np.arange(len(leg)) - np.repeat(np.cumsum(counts) - counts, counts)
    unit = (leg_m / length_m[:, None])[leg]
    places_m = first_m[leg] + nth * step_m
    poses = np.column_stack([start_m[leg] + places_m[:, None] * unit, np.arctan2(leg_m[:, 1], leg_m[:, 0])[leg]])
    found = Runs(poses=poses, way_m=demand.length_m * unit, draw=route_number[leg])
    return _kept_out(demand, scenario, found.some(_begins(demand, scenario, found.poses)))


@lru_cache(maxsize=_MOST_LINES)
def _line_m(scenario: Scenario, seed: int, replication: int) -> FloatArray:
    """Return the corners of one route, shape (k, 2), m."""
    draws = Streams(seed=seed).generator(scenario.name, replication, Purpose.ROUTE)
    return read_only(route(scenario, draws).line_m, (-1, 2))


def _begins(demand: Demand, scenario: Scenario, poses: FloatArray) -> BoolArray:
    """Return for each pose whether it lies in the demand's zone."""
    if demand.zone == WHOLE_FLOOR:
        return np.ones(len(poses), dtype=np.bool_)
    return covers(scenario.site.zone(demand.zone).region, poses[:, :2])


def _kept_out(demand: Demand, scenario: Scenario, runs: Runs) -> Runs:
    """Return the runs that touch none of the zones ``without``."""
    if not demand.without or not len(runs):
        return runs
    zones = shapely.union_all([scenario.site.zone(name).region for name in demand.without])
    shapely.prepare(zones)
    start_m = runs.poses[:, :2]
    ways = (
        shapely.linestrings(np.stack([start_m, start_m + runs.way_m], axis=1))
        if demand.length_m > 0.0
        else shapely.points(start_m)
    )
    return runs.some(np.flatnonzero(~shapely.intersects(zones, ways)))
