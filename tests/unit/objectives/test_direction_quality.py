"""Errors of a transponder's direction over a site: known answers, brute force, and what counts."""

import math

import numpy as np
import pytest
from shapely.geometry import Point, box

from layoutopt.antennas.crossed_loops import CrossedLoops
from layoutopt.docking_world import DockingWorld
from layoutopt.errors import InvalidInput
from layoutopt.estimators.direction_of_arrival import direction_error
from layoutopt.layout import FloorTags, Layout, Transponder
from layoutopt.readers.finders import docking_antennas
from layoutopt.robot import Robot
from layoutopt.scenario import Role, Scenario
from layoutopt.scores import DOCKING_UNITS, OUTCOME_COLUMNS, TRACKING_UNITS, TrialOutcomes
from layoutopt.simulation.docking_trials import docking_ground
from layoutopt.simulation.kim2009_rooms import SCATTERERS_M, share_not_nearer
from layoutopt.site import Site
from objectives.direction_quality import DirectionQuality, clearance_m, direction_map
from objectives.docking import Docking
from objectives.localization import Localization

ROOM = Site(name="room", floor=box(-2.5, -2.5, 2.5, 2.5))
ROBOT = Robot(outline_m=[(-0.1, -0.1), (0.1, -0.1), (0.1, 0.1), (-0.1, 0.1)])


def at(*place_m, name="dock"):
    """Return a layout with nothing but crossed antennas and a transponder."""
    return Layout(
        floor_tags=FloorTags(zones=()),
        readers=(docking_antennas(antenna=CrossedLoops()),),
        transponders=(Transponder(name=name, position_m=(*place_m, 0.5)),),
    )


def world(scatterers_m=(), site=ROOM, **changes):
    """Return a scenario of docking."""
    return Scenario(
        name="docking",
        role=Role.HELD_OUT,
        site=site,
        robot=ROBOT,
        scatterers_m=scatterers_m,
        docking=DockingWorld(**changes),
    )


def values(layout, scenario):
    """Return the scores as bare numbers."""
    return {name: score.value for name, score in DirectionQuality()(layout, scenario, None).items()}


@pytest.mark.parametrize("place_m", [(0.0, 0.0), (-1.9, 2.0), (2.3, -2.3)])
@pytest.mark.parametrize("blocks", [False, True])
def test_in_an_empty_room_every_direction_is_right(place_m, blocks):
    """No scatterer, no error, wherever the transponder is; clearance is that of the walls."""
    found = values(at(*place_m), world(blocks_wave=blocks))
    assert found["direction_error_mean"] == 0.0
    assert found["direction_bad_share"] == 0.0
    assert found["scatterer_clearance"] == pytest.approx(2.5 - max(abs(value) for value in place_m), abs=1e-12)


@pytest.mark.parametrize("reflection", [0.2, 0.5])
def test_one_scatterer_turns_no_direction_by_more_than_the_arc_sine_of_its_share(reflection):
    """The error is that of two waves, the smaller a share R of the other at most: strictly below asin(R)."""
    scenario = world([(1.5, 1.0)], reflection=reflection)
    errors = direction_map(docking_ground(at(0.7, -0.3), scenario), scenario).error_rad
    assert 0.0 < np.abs(errors).max() < math.asin(reflection)


def test_scores_are_those_of_a_loop_over_the_cells():
    """Cell by cell, with the rules for which cells count written out again."""
    scatterers_m, place_m = np.array(SCATTERERS_M["c"]), (0.4, 1.0)
    errors = []
    for column in range(50):
        for row in range(50):
            cell = np.array([-2.45 + 0.1 * column, -2.45 + 0.1 * row])
            # A robot whose corners reach 141 mm out keeps 20 mm more from the walls.
            if np.abs(cell).max() > 2.5 - math.hypot(0.1, 0.1) - 0.02 or math.dist(cell, place_m) <= 0.5:
                continue
            if min(math.dist(cell, other) for other in scatterers_m) > 0.2:
                errors.append(
                    float(
                        direction_error(cell, place_m, scatterers_m, 0.5, world().docking.wavelength_m).error_rad
                    )
                )
    found = values(at(*place_m), world(scatterers_m))
    assert found["direction_error_mean"] == pytest.approx(np.mean(np.abs(errors)), abs=1e-12)
    assert found["direction_bad_share"] == share_not_nearer(errors)
    assert 0.0 < found["direction_bad_share"] < 0.1


@pytest.mark.parametrize("case", "abc")
def test_weak_scatterers_mislead_nowhere(case):
    """Table I of kim2009 at R = 0.2: no bad cell in its rooms."""
    assert values(at(0.4, 1.0), world(SCATTERERS_M[case], reflection=0.2))["direction_bad_share"] == 0.0


def test_beside_a_scatterer_the_mean_falls_and_the_clearance_tells_it():
    """The trap: a transponder 150 mm from a scatterer looks better than one in the open."""
    scatterers_m = [(-1.0, 0.0), (1.5, 1.5), (1.5, -1.5)]
    beside, open_floor = values(at(-1.15, 0.0), world(scatterers_m)), values(at(0.0, 0.0), world(scatterers_m))
    assert beside["direction_error_mean"] < open_floor["direction_error_mean"]
    assert beside["scatterer_clearance"] == pytest.approx(0.15, abs=1e-12)
    assert open_floor["scatterer_clearance"] == pytest.approx(1.0, abs=1e-12)


def test_cells_behind_walls_and_scatterers_count_only_where_waves_pass():
    """Two rooms with an open end: behind the wall no direct wave arrives; nor in the shadow of a scatterer."""
    site = Site(name="two rooms", floor=box(0, 0, 6, 4), obstacles=(box(2.9, 0, 3.1, 3),))
    scatterers_m = [(1.5, 3.0)]
    passing, blocking = (world(scatterers_m, site=site, blocks_wave=blocks) for blocks in (False, True))
    everywhere = direction_map(docking_ground(at(1.0, 1.0), passing), passing)
    seen = direction_map(docking_ground(at(1.0, 1.0), blocking), blocking)
    assert everywhere.in_view == 1.0
    assert 0.4 < seen.in_view < 0.7
    assert seen.in_view == pytest.approx(len(seen.cells_m) / len(everywhere.cells_m))
    # Beyond the end of the wall the line from (1, 1) is seen above the slope through (3.1, 3).
    right = seen.cells_m[seen.cells_m[:, 0] > 3.1]
    assert (right[:, 1] - 1.0 > (right[:, 0] - 1.0) * 2.0 / 2.1 - 1e-9).all()
    away_m = [Point(1.5, 3.0).distance(Point(cell).union(Point(1.0, 1.0)).convex_hull) for cell in seen.cells_m]
    assert min(away_m) >= 0.1


def test_a_wall_that_reflects_turns_directions_in_an_empty_room():
    """Mirror images are waves like those of scatterers."""
    assert values(at(0.5, 0.2), world(wall_reflection=0.5))["direction_error_mean"] > math.radians(2.0)


def test_no_scores_without_a_transponder_or_without_docking():
    """The objective does not apply, and says nothing."""
    assert DirectionQuality()(at(0.0, 0.0).replace(transponders=()), world(), None) == {}
    plain = Scenario(name="plain", role=Role.DESIGN, site=ROOM, robot=ROBOT)
    assert DirectionQuality()(at(0.0, 0.0), plain, None) == {}


def test_a_transponder_inside_an_obstacle_is_refused():
    """No silent number for a place where nothing can stand."""
    site = Site(name="shelf", floor=box(0, 0, 4, 4), obstacles=(box(1, 1, 2, 2),))
    with pytest.raises(InvalidInput, match="inside obstacle 1"):
        DirectionQuality()(at(1.5, 1.5), world(site=site), None)


def test_clearance_counts_scatterers_and_outer_walls_but_no_obstacles():
    """A place on a shelf is as far from walls as it is."""
    site = Site(name="hole", floor=box(0, 0, 6, 6).difference(box(2, 2, 3, 3)), obstacles=(box(4, 4, 5, 5),))
    places_m = np.array([(4.0, 4.5), (3.0, 2.5), (1.0, 5.0)])
    assert clearance_m(places_m, site, np.zeros((0, 2))) == pytest.approx([1.5, 2.5, 1.0])
    assert clearance_m(places_m, site, np.array([(3.0, 3.0)])) == pytest.approx([1.5, 0.5, 1.0])


def test_each_simulated_objective_reduces_its_own_columns():
    """Drives over the floor, tracking and docking do not mix, also where one table holds all columns."""
    columns = (*OUTCOME_COLUMNS, "dock.position_error_mean", *TRACKING_UNITS, *DOCKING_UNITS)
    table = TrialOutcomes(
        replications=np.arange(4), columns=columns, values=np.arange(4.0 * len(columns)).reshape(4, -1)
    )
    found = Docking()(at(0.0, 0.0), world(), table)
    assert set(found) == set(DOCKING_UNITS)
    assert found["docking_steps"].value == table.column("docking_steps").mean()
    assert set(Localization()(at(0.0, 0.0), world(), table)) == {*OUTCOME_COLUMNS, "dock.position_error_mean"}
    assert Docking()(at(0.0, 0.0), world(), None) == {}
