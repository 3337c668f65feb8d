"""What a robot must see of the floor: tags from every pose, or on every straight run, here or along its routes."""

import itertools
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
import shapely

from layoutopt.geometry import covers, lattice_points
from layoutopt.identity import BoolArray, FloatArray, IntArray
from layoutopt.layout import WHOLE_FLOOR
from layoutopt.protocols import Antennas
from layoutopt.scenario import Scenario
from layoutopt.sightings import grid_for_ways, run_sightings
from layoutopt.simulation.routes import free_space, route
from layoutopt.streams import Purpose, Streams
from solvers.covering.problem import Incidence, from_pairs

_AT_ONCE: Final = 20_000
"""Runs looked up in one call; bounds memory."""
_RUNS_A_ROUTE: Final = 50
"""A drive of a minute is some 18 m; more than one run for every third of a metre tells little new."""
_ROUTE_STEP_M: Final = 0.1
_DOUBLINGS: Final = 3
"""How often twice as many routes are followed where those so far have too few runs."""
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
    """Straight runs: pose at the start, shape (n, 3), m and rad, and how far the robot goes, shape (n, 2), m."""

    poses: FloatArray
    way_m: FloatArray

    def __len__(self) -> int:
        """Return the number of runs."""
        return len(self.poses)

    def some(self, chosen: BoolArray | IntArray) -> "Runs":
        """Return some of the runs."""
        return Runs(poses=self.poses[chosen], way_m=self.way_m[chosen])


def joined(parts: Sequence[Runs]) -> Runs:
    """Return the runs of all parts, one after the other."""
    return Runs(
        poses=np.concatenate([np.empty((0, 3)), *(part.poses for part in parts)]),
        way_m=np.concatenate([np.empty((0, 2)), *(part.way_m for part in parts)]),
    )


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
        return _along_routes(demand, scenario, step_m, routes, seed)
    region = free_space(scenario.site, scenario.robot.radius_m).region
    xmin, ymin, xmax, ymax = region.bounds
    start_m = lattice_points(np.array([(xmin, ymin)]), step_m * np.eye(2), (xmin, ymin, xmax, ymax))
    angles_rad = np.arange(headings) * (2.0 * math.pi / headings)
    poses = np.column_stack([np.repeat(start_m, headings, axis=0), np.tile(angles_rad, len(start_m))])
    return _possible(poses, demand, scenario)


def random_runs_of(demand: Demand, scenario: Scenario, count: int, seed: int, *, routes: int = 8) -> Runs:
    """Return runs of which a demand speaks, drawn evenly over starts and headings; fewer where there are none.

    Along routes, starts are drawn evenly along other routes than `runs_of` has with the same seed, at least
    ``routes`` of them and one more for every so many runs: routes differ more than the runs of one.
    """
    draws = np.random.Generator(np.random.Philox(seed))
    if demand.along_routes:
        followed = max(routes, math.ceil(count / _RUNS_A_ROUTE))
        found = _along_routes(demand, scenario, _ROUTE_STEP_M, followed, seed + 1, draws)
        for _ in range(_DOUBLINGS):
            if len(found) >= count:
                break
            followed *= 2
            found = _along_routes(demand, scenario, _ROUTE_STEP_M, followed, seed + 1, draws)
        return found.some(np.sort(draws.permutation(len(found))[:count]))
    space = free_space(scenario.site, scenario.robot.radius_m)
    kept: list[Runs] = []
    for _ in range(_ROUNDS):
        start_m, _ = space.draw(draws, count)
        poses = np.column_stack([start_m, draws.uniform(-math.pi, math.pi, count)])
        kept.append(_possible(poses, demand, scenario))
        if sum(map(len, kept)) >= count:
            break
    found = joined(kept)
    return found.some(np.arange(min(count, len(found))))


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
    routes: int,
    seed: int,
    draws: np.random.Generator | None = None,
) -> Runs:
    """Return runs along the legs of routes, none over a corner: there a robot turns, which is no straight run.

    With ``draws`` the first start of each leg is drawn, else it is its corner.
    """
    streams = Streams(seed=seed)
    parts = []
    for replication in range(routes):
        line_m = route(scenario, streams.generator(scenario.name, replication, Purpose.ROUTE)).line_m
        for start_m, end_m in itertools.pairwise(line_m):
            leg_m = end_m - start_m
            length_m = float(np.hypot(*leg_m))
            if length_m < demand.length_m:
                continue
            unit = leg_m / length_m
            first_m = 0.0 if draws is None else float(draws.uniform(0.0, step_m))
            places_m = np.arange(first_m, length_m - demand.length_m + 1e-9, step_m)
            heading_rad = math.atan2(leg_m[1], leg_m[0])
            poses = np.column_stack([start_m + places_m[:, None] * unit, np.full(len(places_m), heading_rad)])
            parts.append(Runs(poses=poses, way_m=np.tile(demand.length_m * unit, (len(poses), 1))))
    found = joined(parts)
    return _kept_out(demand, scenario, found.some(_begins(demand, scenario, found.poses)))


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
