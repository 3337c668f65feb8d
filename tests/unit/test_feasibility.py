"""Whether a layout can be built: each rule alone, just kept and just broken."""

import math
from dataclasses import replace

import numpy as np
import pytest
from shapely.geometry import box

from layoutopt.antennas.sphere import SphereAntenna
from layoutopt.feasibility import check
from layoutopt.layout import EditKind, FloorTags, Layout, ReaderGroup, ReaderProfile, TagEdit, ZonePattern
from layoutopt.patterns.square import square
from layoutopt.protocols import Mount
from layoutopt.readers.ring import ring
from layoutopt.robot import Robot
from layoutopt.scenario import Role, Scenario
from layoutopt.site import Site, Zone

SCENARIO = Scenario(
    name="design",
    role=Role.DESIGN,
    site=Site(name="room", floor=box(0, 0, 2, 2), zones=(Zone(name="dock", region=box(0.405, 0.405, 1.2, 1.2)),)),
    robot=Robot(outline_m=[(-0.2, -0.15), (0.2, -0.15), (0.2, 0.15), (-0.2, 0.15)]),
)


def layout(
    places_m,
    *,
    slots=None,
    ports=1,
    pitch_m=0.2,
    side_m=0.06,
    height_m=0.02,
    yaw_rad=0.0,
    zones=(),
    edits=(),
    **profile,
):
    """Return a layout with antennas at places of the robot frame."""
    group = ReaderGroup(
        name="listed",
        poses=[(x_m, y_m, height_m, yaw_rad) for x_m, y_m in places_m],
        antenna=SphereAntenna(side_m=side_m),
        profile=ReaderProfile(**{"name": "test", "scan_period_s": 0.05, "tags_per_scan": "several", **profile}),
        slots=slots or (0,) * len(places_m),
        antennas_per_module=ports,
    )
    patterns = [ZonePattern(zone="", pattern=square(pitch_m=pitch_m)), *zones]
    floor_tags = FloorTags(zones=tuple(patterns), edits=edits, tag_size_m=(0.02, 0.01))
    return Layout(floor_tags=floor_tags, readers=(group,))


def broken(candidate):
    """Return the rules that a layout breaks, with their shortfalls."""
    return {violation.rule: violation.shortfall_m for violation in check(candidate, SCENARIO)}


def test_a_sound_layout_breaks_no_rule():
    """Two antennas well apart, tags well apart."""
    assert broken(layout([(-0.1, 0.0), (0.1, 0.0)])) == {}


@pytest.mark.parametrize(("x_m", "beyond_m"), [(0.17, 0.0), (0.18, 0.01), (-0.25, 0.08)])
def test_an_antenna_stays_under_the_robot(x_m, beyond_m):
    """A 60 mm antenna ends 30 mm beside its centre; the outline ends at 200 mm."""
    assert broken(layout([(x_m, 0.0)])).get("robot outline", 0.0) == pytest.approx(beyond_m)


def test_a_turned_antenna_reaches_further():
    """Turned by 45 degrees, its corner lies side / sqrt(2) from the centre."""
    beyond_m = broken(layout([(0.17, 0.0)], yaw_rad=math.pi / 4))["robot outline"]
    assert beyond_m == pytest.approx(0.17 + 0.06 / math.sqrt(2) - 0.2)


@pytest.mark.parametrize(("gap_m", "short_m"), [(0.066, 0.0), (0.065, 0.001), (0.0, 0.066)])
def test_antennas_do_not_overlap(gap_m, short_m):
    """Centres keep 1.1 sides, whatever the scan order."""
    shortfall_m = broken(layout([(0.0, 0.0), (gap_m, 0.0)], slots=(0, 1), ports=2)).get("antenna spacing", 0.0)
    assert shortfall_m == pytest.approx(short_m)


def test_antennas_of_one_slot_keep_more_distance():
    """Four sides between fields that are on together; scanned in turn they may sit closer."""
    places_m = [(0.0, 0.0), (0.1, 0.0)]
    together = broken(layout(places_m, simultaneous_spacing_sides=4.0))
    assert together == {"simultaneous antennas": pytest.approx(0.14)}
    assert broken(layout(places_m, slots=(0, 1), ports=2, simultaneous_spacing_sides=4.0)) == {}


def test_what_antennas_need_and_have_is_told_with_the_ways_out():
    """The distance in sides and in millimetres, that of the arrangement by name, and the keys that change it."""
    mount = Mount(
        antenna=SphereAntenna(side_m=0.06),
        height_m=0.02,
        profile=ReaderProfile(
            name="test", scan_period_s=0.05, tags_per_scan="several", simultaneous_spacing_sides=4.0
        ),
    )
    group = ring(count=4, radius_m=0.1, mount=mount)
    (found,) = check(replace(layout([(0.0, 0.0)]), readers=(group,)), SCENARIO)
    assert found.message == (
        "cannot be built under profile 'test': antennas that are on at the same time need 4 sides between their "
        "centres, 240 mm for antennas of 60 mm; ring 4 of radius 100 mm has 141.4 mm; let more of them share a "
        "reader module (antennas_per_module), set them farther apart or take smaller ones (antenna_side)"
    )
    touching = check(layout([(0.0, 0.0), (0.065, 0.0)], slots=(0, 1), ports=2), SCENARIO)
    assert [violation.message for violation in touching] == [
        "cannot be built under profile 'test': antennas need 1.1 sides between their centres, 66 mm for antennas "
        "of 60 mm; listed 2 has 65 mm; take smaller antennas (antenna_side) or set them farther apart"
    ]


@pytest.mark.parametrize(("pitch_m", "short_m"), [(0.02, 0.0), (0.015, 0.005)])
def test_tags_do_not_overlap(pitch_m, short_m):
    """Tags keep the length of their longer side, in every pattern of the floor."""
    assert broken(layout([(0.0, 0.0)], pitch_m=pitch_m)).get("tag spacing", 0.0) == pytest.approx(short_m)
    dock = ZonePattern(zone="dock", pattern=square(pitch_m=pitch_m))
    assert broken(layout([(0.0, 0.0)], zones=[dock])).get("tag spacing", 0.0) == pytest.approx(short_m)


def test_tags_of_two_patterns_do_not_overlap():
    """Floor of 200 mm and zone of 135 mm would meet 7.1 mm apart; the laid map has no such pair."""
    dock = ZonePattern(zone="dock", pattern=square(pitch_m=0.135))
    assert broken(layout([(0.0, 0.0)], zones=[dock])) == {}


@pytest.mark.parametrize(("to_m", "short_m"), [((0.42, 0.2), 0.0), ((0.415, 0.2), 0.005), ((0.4, 0.2), 0.02)])
@pytest.mark.parametrize("zones", [(), (ZonePattern(zone="dock", pattern=square(pitch_m=0.15)),)])
def test_an_edit_may_not_lay_a_tag_on_another(to_m, short_m, zones):
    """A tag that is moved keeps the length of a tag from its new neighbour at (0.4, 0.2), or the place is told."""
    edit = TagEdit(kind=EditKind.MOVED, from_m=(0.2, 0.2), to_m=to_m)
    candidate = layout([(0.0, 0.0)], edits=(edit,), zones=zones)
    assert broken(candidate).get("laid tags", 0.0) == pytest.approx(short_m)
    messages = [violation.message for violation in check(candidate, SCENARIO)]
    assert all(f"near ({(0.4 + to_m[0]) / 2:.3f}, 0.200) m" in message for message in messages)


def test_the_border_of_a_zone_counts_for_readers_of_one_tag():
    """Two sparse patterns may still put two tags in one field at their border: here 60 mm apart."""
    need_m = 2.0 * SphereAntenna(side_m=0.06).read_radius_m(0.02) + 0.02
    near, far = (ZonePattern(zone="dock", pattern=square(pitch_m=0.2), origin_m=(x_m, 0.6)) for x_m in (0.46, 0.5))
    found = broken(layout([(0.0, 0.0)], zones=[near], tags_per_scan="one"))
    assert found == {"one tag a scan": pytest.approx(need_m - 0.06)}
    assert broken(layout([(0.0, 0.0)], zones=[near], tags_per_scan="several")) == {}
    assert broken(layout([(0.0, 0.0)], zones=[far], tags_per_scan="one")) == {}


def test_thousands_of_layouts_are_checked_without_laying_their_tags(monkeypatch):
    """A single pattern is judged by its own spacing, and a floor of two patterns is laid once for all readers."""
    laid, lay_on = [], FloorTags.lay_on
    monkeypatch.setattr(FloorTags, "lay_on", lambda self, site: laid.append(self) or lay_on(self, site))
    for height_m in np.linspace(0.01, 0.05, 50):
        assert broken(layout([(0.0, 0.0)], pitch_m=0.19, height_m=height_m)) == {}
    assert laid == []
    dock = ZonePattern(zone="dock", pattern=square(pitch_m=0.171))
    for height_m in np.linspace(0.01, 0.05, 50):
        assert broken(layout([(0.0, 0.0)], pitch_m=0.19, height_m=height_m, zones=[dock])) == {}
    assert len(laid) == 1


def test_an_antenna_reads_the_floor():
    """A 60 mm antenna reaches 54 mm: it reads from 53 mm and not from 55 mm."""
    assert broken(layout([(0.0, 0.0)], height_m=0.053)) == {}
    assert "antenna height" in broken(layout([(0.0, 0.0)], height_m=0.055))


def test_readers_of_one_tag_need_sparse_tags():
    """Two tags never lie in one field: pitch at least the field's diameter and a tag."""
    need_m = 2.0 * SphereAntenna(side_m=0.06).read_radius_m(0.02) + 0.02
    dense, sparse = layout([(0.0, 0.0)], pitch_m=need_m - 1e-4, tags_per_scan="one"), need_m + 1e-6
    assert broken(dense) == {"one tag a scan": pytest.approx(1e-4)}
    assert broken(layout([(0.0, 0.0)], pitch_m=sparse, tags_per_scan="one")) == {}
    assert broken(layout([(0.0, 0.0)], pitch_m=need_m - 1e-4)) == {}


@pytest.mark.parametrize(("count", "allowed"), [(8, True), (9, False)])
def test_a_multiplexer_has_at_most_eight_ports(count, allowed):
    """Nine antennas on one module cannot be wired, and no length would cure it."""
    angle_rad = 2 * np.pi * np.arange(count) / count
    places_m = [(0.11 * np.cos(angle), 0.11 * np.sin(angle)) for angle in angle_rad]
    found = broken(layout(places_m, slots=tuple(range(count)), ports=count, side_m=0.03))
    assert found == ({} if allowed else {"multiplexer ports": math.inf})


def test_all_broken_rules_are_named():
    """A layout with three faults gets three messages, each with the numbers that matter."""
    violations = check(layout([(0.3, 0.0), (0.3, 0.01)], pitch_m=0.01), SCENARIO)
    assert {violation.rule for violation in violations} >= {"robot outline", "antenna spacing", "tag spacing"}
    assert all(violation.message and violation.shortfall_m > 0 for violation in violations)
