"""Added tags, zones that bar some parts, and edits that lay a tag where none may lie."""

import math
from dataclasses import replace

import numpy as np
import pytest
from shapely.geometry import box

from layoutopt.antennas.sphere import SphereAntenna
from layoutopt.commissioning.as_built import as_built, corrected
from layoutopt.commissioning.site_records import Survey, read_scans
from layoutopt.errors import InvalidInput
from layoutopt.feasibility import check
from layoutopt.laying import left_out, named_places
from layoutopt.layout import EditKind, FloorTags, Layout, TagEdit, ZonePattern
from layoutopt.patterns.square import square
from layoutopt.prices import TAG_ITEMS
from layoutopt.protocols import Mount
from layoutopt.readers.cross import cross
from layoutopt.readers.profiles import COMMERCIAL
from layoutopt.robot import Robot
from layoutopt.scenario import Role, Scenario
from layoutopt.site import DRILLED_PARTS, METAL_PARTS, Site, Zone
from layoutopt.spec.reading import read_spec
from layoutopt.tables.tags import tag_rows
from solvers.slots import grid_slots, listed_slots

ROOM = Site(name="room", floor=box(0, 0, 1, 1), obstacles=(box(0.25, 0.25, 0.35, 0.35),))
ADDED = TagEdit(kind=EditKind.ADDED, from_m=(0.3, 0.3), to_m=(0.4, 0.2))
ZONED = Site(
    name="room",
    floor=box(0, 0, 3, 1),
    zones=(
        Zone(name="bare", region=box(0, 0, 1, 1), tags=False),
        Zone(name="plate", region=box(1, 0, 2, 1), metal=True),
        Zone(name="heating", region=box(2, 0, 3, 1), drill=False),
    ),
)
BARRED = {"label": "bare plate", "disc": "bare plate", "on_metal": "bare", "puck": "bare plate heating"}


def tags(*edits, pitch_m=0.3, zone="", **fields):
    """Return a square pattern with edits."""
    return FloorTags(zones=(ZonePattern(zone=zone, pattern=square(pitch_m=pitch_m)),), edits=edits, **fields)


def broken(floor_tags, site):
    """Return the messages about a layout with these tags, by rule."""
    mount = Mount(antenna=SphereAntenna(side_m=0.04), height_m=0.02, profile=COMMERCIAL, antennas_per_module=4)
    layout = Layout(floor_tags=floor_tags, readers=(cross(count=4, mount=mount),))
    robot = Robot(outline_m=[(-0.2, -0.2), (0.2, -0.2), (0.2, 0.2), (-0.2, 0.2)])
    found = check(layout, Scenario(name="design", role=Role.DESIGN, site=site, robot=robot))
    return {violation.rule: violation.message for violation in found}


def test_added_tags_count_on_after_the_last():
    """Eight tags lie and one falls on the pillar; what is added is number 9, and the others keep theirs."""
    floor_tags = tags(ADDED, TagEdit(kind=EditKind.DROPPED, from_m=(0.9, 0.9)))
    laid = floor_tags.lay_on(ROOM)
    assert laid.ids.tolist() == [1, 2, 3, 4, 5, 6, 7, 9]
    assert laid.status == ("planned",) * 7 + ("added",)
    assert laid.xy_m[-1].tolist() == [0.4, 0.2]
    assert [(row.tag_id, row.install_status) for row in tag_rows(laid, ROOM, "label")][-1] == (9, "added")
    assert named_places(floor_tags, ROOM).shape == (9, 2)
    inside_m = left_out(floor_tags, ROOM)
    assert inside_m[(inside_m % 1.0 > 0.0).all(axis=1)].tolist() == [[pytest.approx(0.3), pytest.approx(0.3)]]


def test_an_added_tag_can_be_edited_by_its_place():
    """Whatever the order of the edits: it is moved, dropped or locked as any other, and keeps its number."""
    moved = TagEdit(kind=EditKind.MOVED, from_m=(0.4, 0.2), to_m=(0.45, 0.25))
    for edits in ((ADDED, moved), (moved, ADDED)):
        laid = tags(*edits).lay_on(ROOM)
        assert (laid.ids[-1], laid.status[-1], laid.xy_m[-1].tolist()) == (9, "moved", [0.45, 0.25])
    gone = tags(ADDED, TagEdit(kind=EditKind.DROPPED, from_m=(0.4, 0.2))).lay_on(ROOM)
    assert gone.ids.tolist() == list(range(1, 9))
    locked = tags(ADDED, TagEdit(kind=EditKind.LOCKED, from_m=(0.4, 0.2))).lay_on(ROOM)
    assert (locked.status[-1], locked.xy_m[-1].tolist()) == ("locked", [0.4, 0.2])


def test_edits_without_sense_are_refused():
    """A tag on another of the pattern, and tags that go without a place to go to."""
    twice = TagEdit(kind=EditKind.ADDED, from_m=(0.3, 0.3), to_m=(0.6, 0.3))
    with pytest.raises(ValueError, match=r"lays a tag at \(0.600, 0.300\) m already"):
        tags(twice).lay_on(ROOM)
    for kind in (EditKind.MOVED, EditKind.SNAPPED, EditKind.ADDED):
        with pytest.raises(ValueError, match=f"{kind.value} needs a place to go to"):
            TagEdit(kind=kind, from_m=(0.3, 0.3))


def test_a_floor_with_added_tags_is_read_back_as_built(tmp_path):
    """Of two added tags the first is missing and the second lies elsewhere; both keep their numbers."""
    second = TagEdit(kind=EditKind.ADDED, from_m=(0.3, 0.3), to_m=(0.2, 0.4))
    floor_tags = tags(ADDED, second)
    laid = floor_tags.lay_on(ROOM)
    layout = Layout(
        floor_tags=floor_tags,
        readers=(
            cross(count=4, mount=Mount(antenna=SphereAntenna(side_m=0.04), height_m=0.02, profile=COMMERCIAL)),
        ),
    )
    scans = [f"{tag_id},E004015000{tag_id:04X}01" for tag_id in laid.ids.tolist() if tag_id != 9]
    (tmp_path / "scans.csv").write_text("\n".join(["tag_id,uid", *scans]), encoding="utf-8")
    xy_m = laid.xy_m.copy()
    xy_m[-1] += (0.0, 0.03)
    found = as_built(laid, read_scans(tmp_path / "scans.csv"), Survey(tag_id=laid.ids, xy_m=xy_m))
    built = corrected(layout, ROOM, found).floor_tags.lay_on(ROOM)
    assert built.ids.tolist() == [1, 2, 3, 4, 5, 6, 7, 8, 10]
    assert built.xy_m[-1] == pytest.approx((0.2, 0.43))
    assert built.status[-1] == "moved"


@pytest.mark.parametrize("part", TAG_ITEMS)
def test_zones_bar_the_same_tags_everywhere(part):
    """Laid tags, slots and reasons agree on where tags of a part may lie; both rules name parts of price lists."""
    assert set(TAG_ITEMS) >= DRILLED_PARTS | METAL_PARTS
    laid = tags(pitch_m=0.1, tag_part=part).lay_on(ZONED)
    slots = grid_slots(ZONED, 0.1, 0.01, tag_part=part)
    np.testing.assert_allclose(laid.xy_m, slots.xy_m, atol=1e-12)
    assert slots.tag_part == part
    barred = BARRED[part].split()
    assert set(laid.zone.tolist()) == {
        number for number, name in enumerate(ZONED.zone_names) if name not in barred
    }
    middles_m = np.array([(0.5, 0.5), (1.5, 0.5), (2.5, 0.5)])
    reasons = ZONED.why_barred(middles_m, 0.01, part)
    for zone, why in zip(ZONED.zones, reasons, strict=True):
        assert why == (f"zone '{zone.name}' ({zone.rule_against(part)})" if zone.name in barred else "")
        assert bool(broken(tags(pitch_m=0.1, zone=zone.name, tag_part=part), ZONED)) == (zone.name in barred)
        moved = TagEdit(
            kind=EditKind.SNAPPED,
            from_m=tuple(laid.xy_m[0].tolist()) if len(laid) else (0.0, 0.0),
            to_m=(float(zone.region.centroid.x) + 0.05, 0.55),
        )
        if len(laid):
            told = broken(tags(moved, pitch_m=0.1, tag_part=part), ZONED).get("barred place", "")
            assert (f"zone '{zone.name}' ({zone.rule_against(part)})" in told) == (zone.name in barred)


def test_why_no_tag_may_lie_is_told():
    """The nearest thing is named: an obstacle by its number, a zone by its rule, the wall, or no floor at all."""
    places_m = np.array([(0.3, 0.3), (0.24, 0.3), (0.015, 0.5), (1.5, 0.5), (0.5, 0.5), (0.5, 1.0)])
    assert ROOM.why_barred(places_m, 0.02) == (
        "obstacle 1",
        "near obstacle 1",
        "near the wall",
        "off the floor",
        "",
        "near the wall",
    )
    assert ROOM.why_barred(np.empty((0, 2)), 0.02) == ()
    with pytest.raises(ValueError, match=r"the first at \(0.3, 0.3\) m: obstacle 1"):
        listed_slots(ROOM, [(0.5, 0.5), (0.3, 0.3)], 0.02)


@pytest.mark.parametrize("kind", [EditKind.SNAPPED, EditKind.MOVED, EditKind.ADDED])
def test_an_edit_may_not_lay_a_tag_on_an_obstacle(kind):
    """Measured places may lie within the margin of an obstacle, planned ones may not; nothing lies on it."""
    from_m = (0.3, 0.3) if kind is EditKind.ADDED else (0.6, 0.6)
    on, near, free = (
        broken(tags(TagEdit(kind=kind, from_m=from_m, to_m=(x_m, 0.3))), ROOM) for x_m in (0.34, 0.355, 0.361)
    )
    assert on["barred place"] == "an edit lays a tag at (0.340, 0.300) m, where none may lie: obstacle 1"
    assert ("barred place" in near) == (kind is not EditKind.MOVED)
    assert free == {}


def test_a_zone_key_does_not_change_unless_drilling_is_barred():
    """Studies and layout files from before know their sites again."""
    zone = Zone(name="a", region=box(0, 0, 1, 1))
    assert replace(zone, drill=True).key == zone.key
    assert replace(zone, drill=False).key != zone.key


@pytest.mark.parametrize(
    ("rules", "part", "said"),
    [
        ("metal = true", "label", "(metal = true) cannot be met there"),
        ("metal = true", "on_metal", ""),
        ("drill = false", "puck", "(drill = false) cannot be met there"),
        ("drill = false", "label", ""),
        ("tags = false", "on_metal", "(tags = false) cannot be met there"),
    ],
)
def test_a_target_in_a_zone_needs_tags_that_may_lie_there(tmp_path, rules, part, said):
    """Whether a zone bars its tags depends on the part that the spec lays."""
    (tmp_path / "spec.toml").write_text(
        f"[site]\nfloor = [[0,0],[3,0],[3,2],[0,2]]\n[[site.zone]]\nname = 'z'\n{rules}\ntarget_error = '9 mm'\n"
        f"region = [[1,1],[2,1],[2,2],[1,2]]\n[parts]\ntag = '{part}'\n",
        encoding="utf-8",
    )
    if said:
        with pytest.raises(InvalidInput) as caught:
            read_spec(tmp_path / "spec.toml")
        assert said in str(caught.value)
    else:
        zone = read_spec(tmp_path / "spec.toml").site.zone("z")
        assert math.isclose(zone.target_error_m, 0.009)
        assert zone.drill == (rules != "drill = false")
