"""How far scattered waves turn the direction of a transponder over a site, cell by cell."""

from dataclasses import dataclass, field
from functools import lru_cache
from typing import ClassVar, Final

import numpy as np
import shapely

from layoutopt.geometry import covers, lattice_points
from layoutopt.identity import FloatArray, by_content
from layoutopt.layout import Layout
from layoutopt.protocols import ObjectiveCard
from layoutopt.robot import Robot
from layoutopt.scenario import Scenario
from layoutopt.scores import SCORE_UNITS, Score, Scores, TrialOutcomes
from layoutopt.simulation.docking_ground import DockingGround
from layoutopt.simulation.docking_trials import docking_ground
from layoutopt.simulation.kim2009_rooms import STEP_SHARE, share_not_nearer
from layoutopt.simulation.routes import free_space
from layoutopt.site import Site

CARD: Final = ObjectiveCard(
    summary=(
        "Mean size of the error of a transponder's direction over the cells of the site, the share of cells where "
        "a step along it leads no nearer, and the transponder's clearance. Rank correlation of the mean with "
        "drives that dock: -0.42 on one site, none on three others."
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
        Share of all cells off transponder and scatterers that the direct wave reaches.
    """

    cells_m: FloatArray
    error_rad: FloatArray
    in_view: float


def direction_map(ground: DockingGround, scenario: Scenario) -> DirectionMap:
    """Return the error of the direction of a transponder in every cell that counts.

    Cells lie `CELL_M` apart where the robot's centre can be driven, farther than `NEAR_TRANSPONDER_M` from the
    transponder and `NEAR_SCATTERER_M` from scatterers, and where the direct wave arrives: all of them, unless
    walls and scatterers block waves.

    Parameters
    ----------
    ground
        Walls, transponder and how waves are met.
    scenario
        Site, robot and scatterers. Scatterers at random places are not in it.

    Raises
    ------
    InvalidInput
        If the robot fits nowhere on the site.
    ValueError
        If the transponder lies on a scatterer.
    """
    scatterers_m = scenario.scatterers_m
    cells_m = _cells(scenario.site, scenario.robot)
    off_m = np.hypot(*np.moveaxis(cells_m[:, None, :] - scatterers_m[None, :, :], -1, 0))
    away_m = np.hypot(*(cells_m - np.array(ground.transponder_m)).T)
    cells_m = cells_m[(away_m > NEAR_TRANSPONDER_M) & (off_m > NEAR_SCATTERER_M).all(axis=1)]
    seen = ground.direct_share(scatterers_m, cells_m) > 0.0
    return DirectionMap(
        cells_m=cells_m[seen],
        error_rad=ground.arrivals(scatterers_m, cells_m[seen]).error_rad,
        in_view=float(seen.mean()) if len(seen) else 0.0,
    )


def scores_of(error_rad: FloatArray) -> dict[str, Score]:
    """Return mean size and bad share of errors of a direction, shape (n,), rad; none without an error."""
    if not len(error_rad):
        return {}
    values = {
        "direction_error_mean": float(np.abs(error_rad).mean()),
        "direction_bad_share": share_not_nearer(error_rad, STEP_SHARE),
    }
    return {name: Score(value=value, unit=CARD.scores[name]) for name, value in values.items()}


def clearance_m(places_m: FloatArray, site: Site, scatterers_m: FloatArray) -> FloatArray:
    """Return the distance of each place, shape (n, 2), from the nearest scatterer or wall, shape (n,), m.

    Walls are the outer borders of the floor. Obstacles on it, and the holes that maps have in their place, count
    by their scatterers alone, since a transponder may be mounted on them.
    """
    walls = shapely.union_all(shapely.get_exterior_ring(shapely.get_parts(site.floor)))
    least = np.asarray(shapely.distance(shapely.points(places_m), walls))
    for scatterer_m in scatterers_m:
        least = np.minimum(least, np.hypot(*(places_m - scatterer_m).T))
    return least


@by_content
@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class DirectionQuality:
    """Errors of the direction of the transponder that robots dock at, over the cells of the site.

    The mean falls where a transponder stands beside a scatterer, whose wave then comes from about the same
    direction. ``scatterer_clearance`` is the limit against that.

    Notes
    -----
    Spearman's rank correlation of ``direction_error_mean`` with the share of simulated drives that dock was -0.42
    (-0.49 to -0.34) over the places of the built-in ward with six scatterers, 24 drives a place, seed 7. On three
    other sites there was none. Walls and obstacles stop robots, and the mean knows nothing of them: it may explain
    how a place does, and does not choose one.
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
            If no robot can dock at the transponder, as `docking_trials.docking_ground` tells.
        """
        if not layout.transponders or scenario.docking is None:
            return {}
        ground = docking_ground(layout, scenario)
        clear_m = clearance_m(np.array([ground.transponder_m]), scenario.site, scenario.scatterers_m)
        clearance = Score(value=float(clear_m[0]), unit=CARD.scores["scatterer_clearance"])
        errors = direction_map(ground, scenario).error_rad
        return {**scores_of(errors), "scatterer_clearance": clearance}


@lru_cache(maxsize=8)
def _cells(site: Site, robot: Robot) -> FloatArray:
    """Return the cells where the robot's centre can be driven, shape (n, 2), m, counted from the site's datum."""
    region = free_space(site, robot.radius_m).region
    middle = np.array([site.datum_m]) + CELL_M / 2.0
    cells_m = lattice_points(middle, CELL_M * np.eye(2), site.bounds_m)
    inside = cells_m[covers(region, cells_m)]
    inside.flags.writeable = False
    return inside
