"""Small floors for tests of tag placements, and their answers by trying every choice."""

import itertools

import numpy as np
from shapely.geometry import box

from layoutopt.protocols import Antennas
from layoutopt.robot import Robot
from layoutopt.scenario import Role, Routes, Scenario
from layoutopt.site import Site, Tiling, Zone
from solvers.covering.search import Effort
from solvers.demands import Demand
from solvers.placement_answer import PlacementEffort
from solvers.placement_model import TagPlacement
from solvers.slots import grid_slots

_COVER = Effort(steps=5_000, iterations=300, window_rounds=0, exact_slots=40, lattices=2)

ROUGH = PlacementEffort(
    step_m=0.2,
    headings=8,
    sample_routes=8,
    rounds=0,
    mending_rounds=0,
    trial_runs=500,
    trial_routes=8,
    check_runs=200,
    check_routes=20,
    budget_runs=500,
    front_runs=500,
    budget_routes=8,
    cover=_COVER,
    budget_cover=_COVER,
)


def scenario_of(site, routes=None):
    """Return drives of a small round robot on a site."""
    half_m = 0.1
    outline_m = np.array([(-half_m, -half_m), (half_m, -half_m), (half_m, half_m), (-half_m, half_m)])
    return Scenario(
        name="placement",
        role=Role.DESIGN,
        site=site,
        robot=Robot(outline_m=outline_m, speed_m_s=0.3),
        routes=routes or Routes(kind="point_to_point"),
        step_s=0.05,
        step_count=400,
    )


def antennas_at(places_m, radius_m):
    """Return antennas at places under the robot with discs of one radius."""
    count = len(places_m)
    return Antennas(
        xy_m=np.array(places_m, dtype=np.float64),
        height_m=np.full(count, 0.02),
        radius_m=np.full(count, radius_m),
        period_steps=np.ones(count, dtype=np.int64),
        phase_steps=np.zeros(count, dtype=np.int64),
        one_tag=np.zeros(count, dtype=np.bool_),
    )


def hall(width_m=1.6, height_m=1.2, **given):
    """Return a question on an empty hall with a coarse grid of slots."""
    zones = given.pop("zones", ())
    site = Site(name="hall", floor=box(0.0, 0.0, width_m, height_m), zones=zones, tiling=Tiling(size_m=0.4))
    values = {
        "scenario": scenario_of(site),
        "antennas": antennas_at([(0.0, 0.0)], 0.35),
        "slots": grid_slots(site, 0.4, 0.01),
        "demands": (Demand(length_m=0.3),),
        "tag_size_m": 0.02,
        "tag_price_cents": 200,
    }
    return TagPlacement(**{**values, **given})


def plate(*bounds_m):
    """Return a metal zone."""
    return Zone(name="plate", region=box(*bounds_m), metal=True)


def fewest(problem):
    """Return the least number of slots that meets every row and keeps every rule, by trying all choices."""
    for count in range(problem.slot_count + 1):
        for some in itertools.combinations(range(problem.slot_count), count):
            chosen = problem.locked.copy()
            chosen[list(some)] = True
            fits = chosen.sum() == count + problem.locked.sum() and not problem.broken_rules(chosen)
            if fits and not len(problem.unmet(chosen)):
                return count
    return None
