"""How far scattered waves turn the direction of a transponder over a site, cell by cell."""

from dataclasses import dataclass, field
from functools import lru_cache
from typing import ClassVar, Final

import numpy as np
import shapely

from layoutopt.docking_world import DockingWorld
from layoutopt.estimators.direction_of_arrival import direction_error
from layoutopt.geometry import covers, lattice_points
from layoutopt.identity import BoolArray, FloatArray, by_content
from layoutopt.layout import Layout
from layoutopt.protocols import ObjectiveCard
from layoutopt.robot import Robot
from layoutopt.scenario import Scenario
from layoutopt.scores import SCORE_UNITS, Score, Scores, TrialOutcomes
from layoutopt.simulation.kim2009_rooms import STEP_SHARE, share_not_nearer
from layoutopt.simulation.ray_casting import visible, walls_of
from layoutopt.simulation.routes import reachable_region
from layoutopt.site import Site

CARD: Final = ObjectiveCard(
    summary=(
        "Mean size of the error of a transponder's direction over the cells of the site, the share of cells where "
        "a step along it leads no nearer, and the transponder's clearance."
    ),
    reference="kim2009, Eq. 4-11 and Table I; clearance: own",
    scores={
        name: SCORE_UNITS[name] for name in ("direction_error_mean", "direction_bad_share", "scatterer_clearance")
    },
    fidelity="exact",
)
CELL_M: Final = 0.1
"""Pitch of the cells, as in the maps of kim2009: a tenth of a wavelength, over which errors change little."""
NEAR_TRANSPONDER_M: Final = 0.5
"""Cells nearer to the transponder do not count: a robot there has docked (kim2009, Section V-A)."""
NEAR_SCATTERER_M: Final = 0.2
"""Cells nearer to a scatterer do not count: a robot is larger than that."""


@dataclass(frozen=True, slots=True, kw_only=True)
class DirectionMap:
    """Errors of the direction over a site.

    Attributes
    ----------
    cells_m
        Middles of the cells that count, shape (n, 2), m.
    error_rad
        Direction that is found less the true one, shape (n,), rad.
    in_view
        Share of all cells off transponder and scatterers that are in view of the transponder.
    """

    cells_m: FloatArray
    error_rad: FloatArray
    in_view: float


def direction_map(transponder_m: FloatArray, scenario: Scenario) -> DirectionMap:
    """Return the error of the direction of a transponder in every cell that counts.

    Cells lie `CELL_M` apart where the robot's centre can be driven, farther than `NEAR_TRANSPONDER_M` from the
    transponder and `NEAR_SCATTERER_M` from scatterers. Where things block waves only cells count of which the
    straight line to the transponder meets no wall, obstacle or scatterer.

    Parameters
    ----------
    transponder_m
        Its place, shape (2,), m.
    scenario
        Site, robot, scatterers and the world of docking. Scatterers at random places are not in it.

    Raises
    ------
    InvalidInput
        If the robot fits nowhere on the site.
    ValueError
        If the scenario has no docking, or the transponder lies on a scatterer.
    """
    world = scenario.docking
    if world is None:
        raise ValueError(f"scenario '{scenario.name}' says nothing of docking")
    scatterers = scenario.scatterers_m
    cells_m = free_cells(scenario.site, scenario.robot)
    off_m = np.hypot(*np.moveaxis(cells_m[:, None, :] - scatterers[None, :, :], -1, 0))
    free = (np.hypot(*(cells_m - transponder_m).T) > NEAR_TRANSPONDER_M) & (off_m > NEAR_SCATTERER_M).all(axis=1)
    cells_m = cells_m[free]
    seen = in_view(cells_m, transponder_m, scenario.site, scatterers, world)
    found = direction_error(cells_m[seen], transponder_m, scatterers, world.reflection, world.wavelength_m)
    share = float(seen.mean()) if len(seen) else 0.0
    return DirectionMap(cells_m=cells_m[seen], error_rad=found.error_rad, in_view=share)


def in_view(
    cells_m: FloatArray, transponder_m: FloatArray, site: Site, scatterers_m: FloatArray, world: DockingWorld
) -> BoolArray:
    """Return which cells the direct wave of a transponder reaches, shape (n,); all where nothing blocks waves."""
    if not world.blocks_wave:
        return np.ones(len(cells_m), dtype=np.bool_)
    radius_m = np.full((len(scatterers_m), 1), world.scatterer_radius_m)
    discs = np.hstack([scatterers_m, radius_m])
    return visible(cells_m, np.tile(transponder_m, (len(cells_m), 1)), walls_of(site), discs)


def clearance_m(places_m: FloatArray, site: Site, scatterers_m: FloatArray) -> FloatArray:
    """Return the distance of each place, shape (n, 2), from the nearest scatterer or wall, shape (n,), m.

    Walls are the borders of the floor. Obstacles on it count by their scatterers alone, since a transponder may be
    mounted on them.
    """
    least = np.asarray(shapely.distance(shapely.points(places_m), site.floor.boundary))
    for scatterer_m in scatterers_m:
        least = np.minimum(least, np.hypot(*(places_m - scatterer_m).T))
    return least


@by_content
@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class DirectionQuality:
    """Errors over the cells of the site; of several transponders the mean over all and the least clearance.

    The mean falls where a transponder stands beside a scatterer, whose wave then comes from about the same
    direction. ``scatterer_clearance`` is the limit against that.
    """

    key: str = field(init=False, repr=False, default="")
    card: ClassVar[ObjectiveCard] = CARD

    def __post_init__(self) -> None:
        """Nothing to check: the objective has no settings."""

    def __call__(self, layout: Layout, scenario: Scenario, outcomes: TrialOutcomes | None) -> Scores:
        """Return the scores; none without a transponder or without docking.

        Where no cell counts only the clearance has a score.

        Raises
        ------
        InvalidInput
            If the robot fits nowhere on the site.
        ValueError
            If a transponder lies on a scatterer.
        """
        if not layout.transponders or scenario.docking is None:
            return {}
        places_m = np.array([transponder.position_m[:2] for transponder in layout.transponders])
        values = {"scatterer_clearance": float(clearance_m(places_m, scenario.site, scenario.scatterers_m).min())}
        errors = np.concatenate([direction_map(place_m, scenario).error_rad for place_m in places_m])
        if len(errors):
            values["direction_error_mean"] = float(np.abs(errors).mean())
            values["direction_bad_share"] = share_not_nearer(errors, STEP_SHARE)
        return {name: Score(value=value, unit=CARD.scores[name]) for name, value in values.items()}


@lru_cache(maxsize=8)
def free_cells(site: Site, robot: Robot) -> FloatArray:
    """Return the cells where the robot's centre can be driven, shape (n, 2), m, counted from the site's datum.

    Raises
    ------
    InvalidInput
        If the robot fits nowhere.
    """
    region = reachable_region(site, robot)
    middle = np.array([site.datum_m]) + CELL_M / 2.0
    cells_m = lattice_points(middle, CELL_M * np.eye(2), site.bounds_m)
    inside = cells_m[covers(region, cells_m)]
    inside.flags.writeable = False
    return inside
