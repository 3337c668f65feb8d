"""Places under a robot, the rules for groups of them, and how many fit."""

import itertools

import numpy as np
import pytest
import shapely
from scipy import optimize

from layoutopt import feasibility
from layoutopt.antennas.sphere import SphereAntenna
from layoutopt.layout import FloorTags, Layout, ReaderProfile, TagPattern, ZonePattern
from layoutopt.protocols import Mount
from layoutopt.readers.profiles import COMMERCIAL
from layoutopt.robot import Robot
from layoutopt.scenario import Role, Scenario
from layoutopt.site import Site
from solvers.antenna_slots import (
    ReaderSlots,
    arranged,
    cliques_of,
    most_that_fit,
    packing_of,
    slots_under,
)

BOX = Robot(outline_m=np.array([(-0.3, -0.25), (0.3, -0.25), (0.3, 0.25), (-0.3, 0.25)]))
CORNER = Robot(outline_m=np.array([(-0.3, -0.3), (0.3, -0.3), (0.3, 0.0), (0.0, 0.0), (0.0, 0.3), (-0.3, 0.3)]))
SITE = Site(name="floor", floor=shapely.box(0.0, 0.0, 5.0, 5.0))


def mount(side_m=0.06, antennas_per_module=1, profile=COMMERCIAL):
    return Mount(
        antenna=SphereAntenna(side_m=side_m),
        height_m=0.02,
        profile=profile,
        antennas_per_module=antennas_per_module,
    )


def violations(group, robot):
    """Rules that a group breaks, by the project's own check, which knows nothing of places or rows."""
    pattern = TagPattern(name="one", points_m=np.zeros((1, 2)), cell_m=np.eye(2))
    layout = Layout(floor_tags=FloorTags(zones=(ZonePattern(zone="", pattern=pattern),)), readers=(group,))
    scenario = Scenario(name="check", role=Role.DESIGN, site=SITE, robot=robot)
    return [found.rule for found in feasibility.check(layout, scenario)]


def random_slots(draws, count, antennas_per_module, half_m=0.3):
    return ReaderSlots(
        xy_m=draws.uniform(-half_m, half_m, (count, 2)),
        side_m=0.06,
        radius_m=0.03,
        spacing_m=0.1,
        simultaneous_spacing_m=0.2,
        antennas_per_module=antennas_per_module,
    )


@pytest.mark.parametrize("robot", [BOX, CORNER])
def test_every_place_lies_under_the_robot_and_the_corners_are_among_them(robot):
    """One antenna at each place passes the check; one a millimetre beyond the outermost does not."""
    slots = slots_under(robot, mount())
    assert 60 <= len(slots) <= 200
    assert not [place for place in range(len(slots)) if violations(slots.group([place], mount()), robot)]
    assert slots.xy_m.min(axis=0) == pytest.approx(robot.outline_m.min(axis=0) + 0.03)
    beyond = ReaderSlots(
        xy_m=slots.xy_m[:1] - 0.001,
        side_m=0.06,
        radius_m=0.03,
        spacing_m=0.1,
        simultaneous_spacing_m=0.1,
    )
    assert violations(beyond.group([0], mount()), robot) == ["robot outline"]


def test_places_are_the_same_left_and_right():
    """Under a symmetric robot every place has its mirror image, and that of the image is the place."""
    slots = slots_under(BOX, mount())
    assert (slots.mirrored[slots.mirrored] == np.arange(len(slots))).all()
    assert slots.xy_m[slots.mirrored] * (1.0, -1.0) == pytest.approx(slots.xy_m)
    assert (slots_under(CORNER, mount()).mirrored == -1).any()


def test_an_antenna_that_does_not_fit_or_reads_nothing_is_refused():
    """With a sentence that names it."""
    with pytest.raises(ValueError, match="does not fit under the robot"):
        slots_under(Robot(outline_m=0.1 * BOX.outline_m), mount(side_m=0.08))
    with pytest.raises(ValueError, match="reads no tag"):
        slots_under(BOX, Mount(antenna=SphereAntenna(side_m=0.03), height_m=0.1, profile=COMMERCIAL))
    with pytest.raises(ValueError, match="1 to 8 ports"):
        random_slots(np.random.default_rng(1), 3, 9)
    with pytest.raises(ValueError, match="at least one antenna"):
        packing_of(random_slots(np.random.default_rng(1), 3, 1), 0)


def test_cliques_hold_every_conflict_and_nothing_else():
    """Members of a clique conflict with each other, each conflict is in one, and none can grow."""
    draws = np.random.Generator(np.random.Philox(1))
    for _ in range(20):
        xy_m = draws.uniform(-0.3, 0.3, (30, 2))
        conflicts = np.linalg.norm(xy_m[:, None] - xy_m[None], axis=2) < 0.15
        np.fill_diagonal(conflicts, False)
        covered = np.zeros_like(conflicts)
        for clique in cliques_of(conflicts, xy_m):
            inside = conflicts[np.ix_(clique, clique)]
            assert inside.sum() == len(clique) * (len(clique) - 1)
            assert not conflicts[list(clique)].all(axis=0).any()
            covered[np.ix_(clique, clique)] = True
        assert (covered >= conflicts).all()


@pytest.mark.parametrize("antennas_per_module", [1, 2, 4])
def test_what_is_arranged_can_be_built_and_keeps_the_rows(antennas_per_module):
    """Random groups of four of fourteen places: the project's check accepts each that was given an order.

    Of those that keep the distances and were given none, the check refuses the order as it was.
    """
    draws = np.random.Generator(np.random.Philox(2))
    wide = Robot(outline_m=2.0 * BOX.outline_m)
    profile = ReaderProfile(
        name="own",
        scan_period_s=0.05,
        tags_per_scan="several",
        spacing_sides=0.1 / 0.06,
        simultaneous_spacing_sides=0.2 / 0.06,
    )
    built = mount(antennas_per_module=antennas_per_module, profile=profile)
    accepted = refused = 0
    for _ in range(10):
        slots = random_slots(draws, 14, antennas_per_module)
        packing = packing_of(slots, 4)
        for chosen in itertools.islice(itertools.combinations(range(14), 4), 0, None, 31):
            order = arranged(slots, packing, chosen)
            if order is None:
                refused += 1
                assert violations(slots.group(chosen, built), wide)
            else:
                accepted += 1
                assert sorted(order) == list(chosen)
                assert packing.within(order)
                assert not violations(slots.group(order, built), wide)
    assert accepted > 5
    assert refused > 5


@pytest.mark.parametrize("antennas_per_module", [1, 3])
def test_most_that_fit_is_the_most_by_brute_force(antennas_per_module):
    """Of eight places, against every subset and, for a module of three, every way to give out the turns."""
    draws = np.random.Generator(np.random.Philox(3))
    seen = set()
    for _ in range(8):
        slots = random_slots(draws, 8, antennas_per_module, half_m=0.15)
        packing = packing_of(slots, 5)
        found = most_that_fit(slots, packing)
        most = max(
            size
            for size in range(6)
            for chosen in itertools.combinations(range(8), size)
            if turns_exist(packing, chosen)
        )
        assert found.bound == most == len(found.chosen)
        assert turns_exist(packing, found.chosen)
        seen.add(most)
    assert len(seen) > 1


def test_a_refusal_that_rests_on_the_presolve_alone_does_not_count(monkeypatch):
    """A solver that proves too little with its presolve and not without it has proven nothing."""
    milp = optimize.milp

    def wrong(*arguments, options, **settings):
        found = milp(*arguments, options=options, **settings)
        if options["presolve"]:
            found.mip_dual_bound = -1.0
        return found

    slots = random_slots(np.random.Generator(np.random.Philox(4)), 8, 1)
    packing = packing_of(slots, 3)
    right = most_that_fit(slots, packing)
    assert right.bound > 1
    monkeypatch.setattr(optimize, "milp", wrong)
    assert most_that_fit(slots, packing).bound == right.bound


def turns_exist(packing, chosen):
    if packing.conflicts[np.ix_(chosen, chosen)].any():
        return False
    for turns in itertools.product(range(packing.scan_slots), repeat=len(chosen)):
        counts = np.bincount(turns, minlength=1) if turns else np.zeros(1)
        same = np.equal.outer(turns, turns) & packing.together[np.ix_(chosen, chosen)]
        if counts.max() <= packing.modules and not same.any():
            return True
    return False
