"""What every reader family promises."""

import numpy as np
import pytest
from shapely.geometry import box

from layoutopt import registry
from layoutopt.antennas.sphere import SphereAntenna
from layoutopt.feasibility import check
from layoutopt.layout import FloorTags, Layout, ZonePattern
from layoutopt.patterns.square import square
from layoutopt.protocols import Mount
from layoutopt.readers.profiles import COMMERCIAL, MI2016
from layoutopt.robot import Robot
from layoutopt.scenario import Role, Scenario
from layoutopt.site import Site

EXAMPLES = {
    "cross": {"count": 8, "spacing_m": 0.09},
    "ring": {"count": 6, "radius_m": 0.15},
    "grid": {"rows": 3, "columns": 4, "spacing_m": 0.08},
    "listed": {"points_m": [(0.1, 0.0), (-0.05, 0.11), (0.0, -0.2)]},
    "two_rings": {"inner_count": 4, "inner_radius_m": 0.06, "outer_count": 8, "outer_radius_m": 0.15},
    "mirrored": {"points_m": [(0.1, 0.0), (-0.05, 0.11)]},
    "mi2016_8": {},
    "mi2016_20": {},
    "mi2016_24": {},
    "mi2016_96": {},
}
"""Arguments for each row of the table; a new row needs its own."""

COUNTS = {
    "cross": 8,
    "ring": 6,
    "grid": 12,
    "listed": 3,
    "two_rings": 12,
    "mirrored": 3,
    "mi2016_8": 8,
    "mi2016_20": 20,
    "mi2016_24": 24,
    "mi2016_96": 96,
}
MIRRORED_X = ("cross", "grid", "ring", "two_rings", "mirrored", "mi2016_8", "mi2016_20", "mi2016_24", "mi2016_96")
"""Families that are the same seen from the left and from the right (y to -y)."""
MIRRORED_Y = ("cross", "grid", "ring", "two_rings", "mi2016_8", "mi2016_20", "mi2016_24", "mi2016_96")
"""Families that are the same seen from ahead and from behind (x to -x); a ring of an even count is."""
BAD = {
    "cross": [{"count": 0}, {"count": -4}, {"count": 6}, {"spacing_m": 0.0}, {"spacing_m": float("nan")}],
    "ring": [{"count": 0}, {"count": -1}, {"radius_m": 0.0}, {"radius_m": -1.0}, {"radius_m": float("nan")}],
    "grid": [{"rows": 0}, {"columns": -1}, {"spacing_m": 0.0}, {"spacing_m": float("nan")}],
    "listed": [{"points_m": []}, {"points_m": [(0.0, float("nan"))]}],
    "two_rings": [
        {"inner_count": 0},
        {"outer_count": -1},
        {"inner_radius_m": 0.0},
        {"outer_radius_m": float("nan")},
        {"phase": float("nan")},
    ],
    "mirrored": [{"points_m": []}, {"points_m": [(float("inf"), 0.1)]}],
    "mi2016_8": [],
    "mi2016_20": [],
    "mi2016_24": [],
    "mi2016_96": [],
}
"""Arguments that make no group."""

SMALL = Mount(antenna=SphereAntenna(side_m=0.03), height_m=0.02, profile=MI2016)


def build(name, mount=SMALL, **changes):
    """Return the group of an example."""
    return registry.load("readers", name)(**{**EXAMPLES[name], **changes}, mount=mount)


def rules_broken(group, half_width_m):
    """Return the rules that the group breaks under a square robot of that half width."""
    corner = half_width_m
    robot = Robot(outline_m=[(-corner, -corner), (corner, -corner), (corner, corner), (-corner, corner)])
    scenario = Scenario(
        name="design", role=Role.DESIGN, site=Site(name="room", floor=box(0, 0, 4, 4)), robot=robot
    )
    floor_tags = FloorTags(zones=(ZonePattern(zone="", pattern=square(pitch_m=0.1)),))
    return {violation.rule for violation in check(Layout(floor_tags=floor_tags, readers=(group,)), scenario)}


def places(xy_m):
    """Return places as a set, to the micrometre."""
    return {(round(x_m, 6) + 0.0, round(y_m, 6) + 0.0) for x_m, y_m in xy_m}


def test_every_family_has_examples():
    """A new row without an example would go untested."""
    names = set(registry.names("readers"))
    assert set(EXAMPLES) == set(COUNTS) == set(BAD) == names


@pytest.mark.parametrize("name", EXAMPLES)
def test_name_count_and_height(name):
    """As many antennas as promised, all at the mount's height, unturned, none on another's place."""
    group = build(name)
    assert group.name == name
    assert group.count == COUNTS[name]
    assert set(group.poses[:, 2]) == {0.02}
    assert set(group.poses[:, 3]) == {0.0}
    assert len(places(group.poses[:, :2])) == group.count


@pytest.mark.parametrize("name", EXAMPLES)
def test_equal_arguments_make_equal_groups(name):
    """A family is a pure function; another mount makes another group."""
    assert build(name).key == build(name).key
    higher = Mount(antenna=SphereAntenna(side_m=0.03), height_m=0.021, profile=MI2016)
    assert build(name, higher).key != build(name).key


@pytest.mark.parametrize("name", EXAMPLES)
def test_the_outline_is_kept_just_so(name):
    """Under a robot that just holds the antennas no rule is broken; a millimetre less breaks the outline."""
    group = build(name)
    need_m = np.abs(group.poses[:, :2]).max() + 0.015
    assert rules_broken(group, need_m) == set()
    assert rules_broken(group, need_m - 0.001) == {"robot outline"}


@pytest.mark.parametrize("ports", [1, 2, 4, 8])
@pytest.mark.parametrize("name", EXAMPLES)
def test_every_antenna_has_a_slot_of_a_module(name, ports):
    """Slots lie below the number of ports, no slot has more antennas than there are modules, none is wasted."""
    mount = Mount(antenna=SphereAntenna(side_m=0.03), height_m=0.02, profile=COMMERCIAL, antennas_per_module=ports)
    group = build(name, mount)
    per_slot = np.bincount(group.slots, minlength=ports)
    assert len(per_slot) == ports
    assert per_slot.sum() == group.count
    assert group.module_count == per_slot.max() == -(-group.count // ports)
    assert group.cycle_s == pytest.approx(ports * COMMERCIAL.scan_period_s)


@pytest.mark.parametrize("name", MIRRORED_X)
def test_left_and_right_are_alike(name):
    """Mirrored at the robot's axis, the antennas lie where they lay."""
    xy_m = build(name).poses[:, :2]
    assert places(xy_m * (1, -1)) == places(xy_m)


@pytest.mark.parametrize("name", MIRRORED_Y)
def test_front_and_back_are_alike(name):
    """Mirrored across the robot's axis, the antennas lie where they lay."""
    xy_m = build(name).poses[:, :2]
    assert places(xy_m * (-1, 1)) == places(xy_m)


def test_the_outer_ring_is_turned_by_a_share_of_its_own_step():
    """Half a step puts the outer antennas between the rays of a ring of as many; a whole step changes nothing."""
    turned = build("two_rings", phase=0.5).poses[4:, :2]
    angles = np.sort(np.degrees(np.arctan2(turned[:, 1], turned[:, 0])))
    np.testing.assert_allclose(angles, np.arange(-157.5, 180.0, 45.0), atol=1e-6)
    assert places(build("two_rings", phase=1.0).poses[:, :2]) == places(build("two_rings").poses[:, :2])


def test_four_images_of_a_point_and_two_of_one_on_a_mirror():
    """Both mirrors make a rectangle of a point, a pair of one on an axis, and leave the middle alone."""
    group = build("mirrored", points_m=[(0.1, 0.05), (0.0, 0.2), (0.0, 0.0)], symmetry="both")
    corners = {(x_m, y_m) for x_m in (-0.1, 0.1) for y_m in (-0.05, 0.05)}
    assert places(group.poses[:, :2]) == corners | {(0.0, 0.2), (0.0, -0.2), (0.0, 0.0)}
    assert group.count == 7
    with pytest.raises(ValueError, match="symmetry is one of left_right, both"):
        build("mirrored", symmetry="up_down")


@pytest.mark.parametrize(("name", "changes"), [(name, changes) for name, rows in BAD.items() for changes in rows])
def test_what_makes_no_group_is_refused(name, changes):
    """Nothing to build, or no number: a ValueError."""
    with pytest.raises(ValueError, match=r"\d|finite|at least one|positive"):
        build(name, **changes)


@pytest.mark.parametrize("name", [name for name in EXAMPLES if name.startswith("mi2016")])
def test_arrays_that_were_inferred_say_so(name):
    """The coordinates of mi2016 are reconstructed, and the card says it."""
    assert registry.card("readers", name).reconstructed
    assert "reconstructed" in registry.card("readers", name).summary
