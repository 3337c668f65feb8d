"""Everything that is compiled, compiled once: what an installation does before anybody waits for it.

Compiled code is kept beside its source, so that later processes load it. A kernel that is not met here is compiled
where it is first used.
"""

import math
from typing import Final

import numpy as np
from shapely.geometry import box

from layoutopt import registry
from layoutopt.antennas.sphere import SphereAntenna
from layoutopt.layout import WHOLE_FLOOR, FloorTags, Layout, ZonePattern
from layoutopt.parts import default_prices
from layoutopt.patterns.tilted import tilted
from layoutopt.protocols import Mount
from layoutopt.readers.cross import cross
from layoutopt.readers.profiles import COMMERCIAL
from layoutopt.robot import Robot
from layoutopt.scenario import Role, Routes, Scenario
from layoutopt.sightings import grid_for_ways, segment_sightings
from layoutopt.simulation.trials import warm_up
from layoutopt.site import Site
from objectives.position_bound import static_error
from solvers.covering.problem import CoverProblem, incidence
from solvers.covering.search import Effort, cheapest

_ROWS: Final = 200
_SLOTS: Final = 60
"""So many rows over few slots leave a gap between cover and bound, which all steps of the search then work on."""


def compile_all() -> None:
    """Run a little of everything that has compiled parts: trials, exact objectives and covers."""
    warm_up(("robot", "target", "bearing"))
    layout, scenario = _layout(), _scenario()
    for name in registry.names("objectives"):
        objective = registry.load("objectives", name)
        told = {"prices": default_prices(), "robot_count": 1} if name == "cost" else {}
        objective(**told)(layout, scenario, None)
    pattern = layout.floor_tags.base.pattern
    segment_sightings(np.array([[0.0, 0.0, 1.0, 0.0]]), 0.06, grid_for_ways(pattern.points_m))
    for estimator in ("midrange", "centroid", "minimax"):
        static_error(pattern, 0.06, estimator=estimator)
    cheapest(_cover(), effort=Effort(steps=1000, iterations=100, cut_nodes=1000, exact_nodes=1))


def _layout() -> Layout:
    mount = Mount(antenna=SphereAntenna(side_m=0.06), height_m=0.02, profile=COMMERCIAL)
    pattern = tilted(tile_m=0.3, angle_rad=math.radians(13.0))
    return Layout(
        floor_tags=FloorTags(zones=(ZonePattern(zone=WHOLE_FLOOR, pattern=pattern),)),
        readers=(cross(count=4, mount=mount),),
    )


def _scenario() -> Scenario:
    return Scenario(
        name="compiled",
        role=Role.DESIGN,
        site=Site(name="compiled", floor=box(-2.0, -2.0, 2.0, 2.0)),
        robot=Robot(outline_m=np.array([(-0.2, -0.2), (0.2, -0.2), (0.2, 0.2), (-0.2, 0.2)])),
        routes=Routes(kind="circle"),
    )


def _cover() -> CoverProblem:
    draws = np.random.Generator(np.random.Philox(1))
    rows = [np.sort(draws.choice(_SLOTS, 5, replace=False)) for _ in range(_ROWS)]
    return CoverProblem(
        sees=incidence(rows, _SLOTS),
        demand=np.ones(_ROWS, dtype=np.int64),
        cost=draws.integers(1, 4, _SLOTS),
    )
