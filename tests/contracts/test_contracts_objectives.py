"""What every objective promises."""

import math
import pickle

import numpy as np
import pytest
from shapely.geometry import box

from layoutopt import registry
from layoutopt.antennas.sphere import SphereAntenna
from layoutopt.antennas.uhf_patch import UhfPatch
from layoutopt.docking_world import DockingWorld
from layoutopt.layout import FloorTags, Layout, Transponder, ZonePattern
from layoutopt.parts import default_prices
from layoutopt.patterns.listed import listed
from layoutopt.patterns.square import square
from layoutopt.patterns.triangular import triangular
from layoutopt.protocols import Mount
from layoutopt.readers.cross import cross
from layoutopt.readers.finders import yawed_antennas
from layoutopt.readers.profiles import COMMERCIAL
from layoutopt.robot import Robot
from layoutopt.scenario import Role, Scenario
from layoutopt.scores import DOCKING_UNITS, OUTCOME_COLUMNS, SCORE_UNITS, TRACKING_UNITS, TrialOutcomes
from layoutopt.site import Site, Zone
from layoutopt.tracking_world import TrackingWorld

EXAMPLES = {
    "cost": {"prices": default_prices(), "robot_count": 3},
    "position_bound": {},
    "static_error": {},
    "heading_bound": {},
    "invisibility": {"directions": 16},
    "coverage": {"samples": 200},
    "expected_reads": {},
    "speed_limit": {},
    "direction_quality": {},
    "uhf_coverage": {},
    "localization": {},
    "docking": {},
    "tracking": {},
}
"""Arguments for each row of the table; a new row needs its own."""

PATTERNS = {
    "square": (square(pitch_m=0.1), None),
    "triangular": (triangular(pitch_m=0.1), None),
    "two zones": (square(pitch_m=0.2), triangular(pitch_m=0.06, row_gap_m=0.05)),
    "once": (listed(points_m=[(0.5, 0.5), (1.0, 0.7)]), None),
}


def build(name):
    """Return the objective of an example."""
    return registry.load("objectives", name)(**EXAMPLES[name])


def layout(which, count=8):
    """Return a layout with a cross of antennas and one of the patterns above."""
    base, dock = PATTERNS[which]
    zones = [ZonePattern(zone="", pattern=base)]
    zones += [] if dock is None else [ZonePattern(zone="dock", pattern=dock)]
    mount = Mount(antenna=SphereAntenna(side_m=0.06), height_m=0.02, profile=COMMERCIAL, antennas_per_module=4)
    return Layout(
        floor_tags=FloorTags(zones=tuple(zones)),
        readers=(
            cross(count=count, mount=mount),
            yawed_antennas(antenna=UhfPatch(), count=2, yaw_rad=math.radians(45.0)),
        ),
        target_tags=1,
        transponders=(Transponder(name="dock", position_m=(0.7, 0.6, 0.5)),),
    )


def scenario():
    """Return a scenario in a room with a dock."""
    return Scenario(
        name="design",
        role=Role.DESIGN,
        site=Site(name="room", floor=box(0, 0, 2, 1.5), zones=(Zone(name="dock", region=box(0, 0, 0.5, 0.5)),)),
        robot=Robot(outline_m=[(-0.3, -0.3), (0.3, -0.3), (0.3, 0.3), (-0.3, 0.3)]),
        scatterers_m=[(1.7, 1.2), (0.3, 1.2)],
        tracking=TrackingWorld(robot_pose=(0.4, 0.75, 0.0), walk_m=[(1.0, 0.3), (1.8, 0.3), (1.8, 1.2)]),
        docking=DockingWorld(least_start_m=0.6, stop_m=0.3),
    )


def outcomes():
    """Return outcomes with every column, for the whole floor and for the dock."""
    columns = (*OUTCOME_COLUMNS, *(f"dock.{name}" for name in OUTCOME_COLUMNS), *DOCKING_UNITS, *TRACKING_UNITS)
    values = np.random.Generator(np.random.Philox(2)).exponential(0.01, (12, len(columns)))
    return TrialOutcomes(replications=np.arange(12), columns=columns, values=values)


EVERY_CASE = [(name, which) for name in EXAMPLES for which in PATTERNS]


def test_every_objective_has_an_example():
    """A new row without an example would go untested."""
    assert set(EXAMPLES) == set(registry.names("objectives"))


@pytest.mark.parametrize("name", EXAMPLES)
def test_the_card_is_complete(name):
    """Scores with the units of the one table of units, a known fidelity, and a bound of a score that exists."""
    card = registry.card("objectives", name)
    assert card.scores
    assert all(SCORE_UNITS[score] == unit for score, unit in card.scores.items())
    assert card.fidelity in ("exact", "published", "sampled", "simulated")
    assert card.bounds == "" or card.bounds in SCORE_UNITS


def test_every_score_has_one_objective():
    """No score of the table of units is without an objective, and none has two."""
    made = [score for name in registry.names("objectives") for score in registry.card("objectives", name).scores]
    assert sorted(made) == sorted(SCORE_UNITS)


@pytest.mark.parametrize(("name", "which"), EVERY_CASE)
def test_scores_are_those_of_the_card(name, which):
    """Names and units as the card says; zone scores only where the card allows them; all finite."""
    card = registry.card("objectives", name)
    for score_name, score in build(name)(layout(which), scenario(), outcomes()).items():
        zone, _, plain = score_name.rpartition(".")
        assert zone == "" or (card.per_zone and zone == "dock")
        assert score.unit == card.scores[plain]
        assert math.isfinite(score.value)
        assert math.isfinite(score.standard_error)
        assert score.exact is (card.fidelity in ("exact", "published"))


@pytest.mark.parametrize("name", EXAMPLES)
def test_all_promised_scores_are_made(name):
    """On a square floor, with outcomes, every score of the card is there."""
    found = build(name)(layout("square"), scenario(), outcomes())
    assert set(found) >= set(registry.card("objectives", name).scores)


@pytest.mark.parametrize("name", EXAMPLES)
def test_only_simulated_scores_need_outcomes(name):
    """Without outcomes a simulated objective makes nothing, and any other the same as with them."""
    objective, which = build(name), layout("square")
    without = objective(which, scenario(), None)
    if objective.card.fidelity == "simulated":
        assert without == {}
    else:
        assert without == objective(which, scenario(), outcomes()) != {}


@pytest.mark.parametrize(("name", "which"), EVERY_CASE)
def test_objectives_are_pure(name, which):
    """Same input, same bits, and the inputs are as they were."""
    objective, candidate, world, table = build(name), layout(which), scenario(), outcomes()
    first = objective(candidate, world, table)
    assert objective(candidate, world, table) == first
    assert build(name)(layout(which), scenario(), outcomes()) == first
    assert (candidate.key, world.key, objective.key) == (layout(which).key, scenario().key, build(name).key)
    assert table == outcomes()


@pytest.mark.parametrize("name", EXAMPLES)
def test_objectives_are_values(name):
    """Frozen, equal by content, and fit for the way to a worker."""
    objective = build(name)
    assert pickle.loads(pickle.dumps(objective)) == objective
    assert hash(build(name)) == hash(objective)
    with pytest.raises(AttributeError):
        objective.key = "other"


@pytest.mark.parametrize("name", EXAMPLES)
def test_a_proven_bound_holds(name):
    """An objective that names a score as bounded from below is never above it, on any example."""
    card = registry.card("objectives", name)
    for which in PATTERNS if card.bounds else ():
        found = build(name)(layout(which), scenario(), outcomes())
        assert all(score.value <= outcomes().score(card.bounds).value for score in found.values())
