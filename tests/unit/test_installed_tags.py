"""Floor tags of which some lie already: places and numbers, what is laid around them, and what that costs."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from shapely.geometry import MultiPolygon, Point, box

from layoutopt import feasibility
from layoutopt.antennas.sphere import SphereAntenna
from layoutopt.identity import content_key
from layoutopt.laying import left_out, named_places
from layoutopt.layout import (
    EditKind,
    FloorTags,
    InstalledTags,
    Layout,
    TagEdit,
    TagPattern,
    ZonePattern,
)
from layoutopt.parts import Scope, bill_of_material, default_prices, needs
from layoutopt.patterns.square import square
from layoutopt.protocols import Mount
from layoutopt.reach import OnlyInReach
from layoutopt.readers.cross import cross
from layoutopt.readers.profiles import COMMERCIAL
from layoutopt.robot import Robot
from layoutopt.scenario import Role, Scenario
from layoutopt.site import Site, Tiling, Zone
from layoutopt.snapping.marks import marks_of
from layoutopt.snapping.snapped import Fate, snapped
from objectives.cost import Cost

HALL = Site(name="hall", floor=box(0, 0, 3, 2))
OLD_AREA = box(0, 0, 1.5, 2)
LONGEST_M = 0.02


def tags(pitch_m, installed=None, edits=()):
    """Return a square pattern on the whole floor around installed tags."""
    zone = ZonePattern(zone="", pattern=square(pitch_m=pitch_m))
    return FloorTags(zones=(zone,), edits=edits, installed=installed)


def lying(ids=(3, 4, 9), xy_m=((0.4, 0.4), (0.8, 0.4), (1.495, 1.0)), area=OLD_AREA):
    """Return three installed tags with gaps in their numbers, the last of them at the border of the area."""
    return InstalledTags(ids=np.array(ids), xy_m=np.array(xy_m), area=area)


def layout(floor_tags):
    """Return a layout with four antennas over floor tags."""
    mount = Mount(antenna=SphereAntenna(side_m=0.06), height_m=0.02, profile=COMMERCIAL, antennas_per_module=4)
    return Layout(floor_tags=floor_tags, readers=(cross(count=4, spacing_m=0.3, mount=mount),))


def scenario(site=HALL):
    """Return a scenario on a site."""
    robot = Robot(outline_m=[(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)])
    return Scenario(name="design", role=Role.DESIGN, site=site, robot=robot)


@settings(max_examples=60)
@given(
    places=st.lists(
        st.tuples(st.integers(0, 60), st.integers(0, 40)).map(lambda p: (p[0] * 0.05, p[1] * 0.05)),
        min_size=1,
        max_size=12,
        unique=True,
    ),
    steps=st.lists(st.integers(1, 5), min_size=12, max_size=12),
    pitch_mm=st.integers(60, 400),
)
def test_what_is_installed_stays_and_the_pattern_goes_around_it(places, steps, pitch_mm):
    """Places and numbers to the last bit, wherever they lie; the rest is the pattern less area and neighbours."""
    ids = np.cumsum(steps[: len(places)])
    installed = lying(ids, places)
    laid = tags(pitch_mm / 1000, installed).lay_on(HALL)
    count = len(places)
    assert laid.ids[:count].tolist() == ids.tolist()
    assert np.array_equal(laid.xy_m[:count], np.array(places))
    assert laid.status == ("installed",) * count + ("planned",) * (len(laid) - count)
    assert laid.ids[count:].tolist() == list(range(ids[-1] + 1, ids[-1] + 1 + len(laid) - count))
    bare = tags(pitch_mm / 1000).lay_on(HALL).xy_m
    expected = [
        place
        for place in bare.tolist()
        if not OLD_AREA.intersects(Point(place))
        and np.hypot(*(np.array(places) - place).T).min() >= LONGEST_M - 1e-9
    ]
    assert laid.xy_m[count:].tolist() == expected
    assert laid.to_lay().xy_m.tolist() == expected


def test_without_installed_tags_every_key_is_what_it_was():
    """Layout files and journals of before carry the key of the other fields alone."""
    plain = tags(0.1)
    names = ("zones", "edits", "tag_part", "tag_size_m", "placement_sigma_m")
    assert plain.key == content_key("FloorTags", {name: getattr(plain, name) for name in names})
    assert tags(0.1, lying()).key != plain.key
    assert tags(0.1, lying()).key == tags(0.1, lying()).key
    assert tags(0.1, lying()).key != tags(0.1, lying(ids=(3, 4, 10))).key


@pytest.mark.parametrize(
    ("ids", "places", "words"),
    [
        ((1, 1), ((0, 0), (1, 1)), "rise"),
        ((2, 1), ((0, 0), (1, 1)), "rise"),
        ((0, 1), ((0, 0), (1, 1)), "rise"),
        ((), (), "rise"),
        ((1, 2), ((0, 0),), "1 places"),
    ],
)
def test_numbers_that_do_not_fit_are_refused(ids, places, words):
    """A number twice, or falling ones, would give two tags one name."""
    with pytest.raises(ValueError, match=words):
        InstalledTags(ids=np.array(ids, dtype=np.int64), xy_m=np.array(places), area=OLD_AREA)


def test_edits_speak_of_installed_tags_and_of_new_ones():
    """A moved tag is no longer installed, a dropped one leaves its number free, and an added one comes last."""
    laid = tags(0.5, lying()).lay_on(HALL)
    new_m = tuple(laid.xy_m[3].tolist())
    edits = (
        TagEdit(kind=EditKind.MOVED, from_m=(0.4, 0.4), to_m=(0.45, 0.4)),
        TagEdit(kind=EditKind.DROPPED, from_m=(0.8, 0.4)),
        TagEdit(kind=EditKind.DROPPED, from_m=new_m),
        TagEdit(kind=EditKind.ADDED, from_m=(2.9, 1.9), to_m=(2.9, 1.9)),
    )
    after = tags(0.5, lying(), edits).lay_on(HALL)
    assert after.ids.tolist() == [3, 9, *laid.ids[4:].tolist(), laid.ids[-1] + 1]
    assert after.status[:2] == ("moved", "installed")
    assert after.status[-1] == "added"
    assert after.xy_m[0].tolist() == [0.45, 0.4]
    named_m = named_places(tags(0.5, lying(), edits), HALL)
    assert len(named_m) == after.ids[-1]
    assert np.isnan(named_m[[0, 1, 4, 5, 6, 7]]).all()
    assert named_m[[2, 3, 8]].tolist() == [[0.4, 0.4], [0.8, 0.4], [1.495, 1.0]]
    assert tuple(named_m[9]) == new_m


def test_places_within_the_equipped_area_are_not_told_as_left_out():
    """Nothing was to be laid there; a place too near an installed tag beyond the border is told."""
    installed = lying((1, 2), ((0.4, 0.4), (1.995, 1.0)))
    assert left_out(tags(0.5, installed), HALL).tolist() == [
        *([x, 0.0] for x in (2.0, 2.5, 3.0)),
        *([3.0, y] for y in (0.5,)),
        [2.0, 1.0],
        *([3.0, y] for y in (1.0, 1.5)),
        *([x, 2.0] for x in (2.0, 2.5, 3.0)),
    ]


def test_two_installed_tags_may_overlap_and_a_new_one_may_not():
    """What lies there lies there; but an edit that lays a new tag onto an installed one is refused."""
    close = lying((1, 2), ((0.4, 0.4), (0.405, 0.4)))
    assert feasibility.check(layout(tags(0.2, close)), scenario()) == ()
    onto = (TagEdit(kind=EditKind.ADDED, from_m=(0.41, 0.4), to_m=(0.41, 0.4)),)
    rules = [item.rule for item in feasibility.check(layout(tags(0.2, close, onto)), scenario())]
    assert rules == ["laid tags"]
    # Installed where the plan has an obstacle now: no fault of the layout, whatever it edits elsewhere.
    covered = replace(HALL, obstacles=(box(0.3, 0.3, 0.6, 0.6),))
    edited = (TagEdit(kind=EditKind.ADDED, from_m=(2.35, 1.1), to_m=(2.35, 1.1)),)
    assert feasibility.check(layout(tags(0.2, close, edited)), scenario(covered)) == ()


def test_the_bill_is_that_of_the_whole_less_what_lies_there():
    """Tag by tag and second by second; the surveyor's visit comes again, spares are rounded by themselves."""
    grown = layout(tags(0.1, lying()))
    laid = grown.floor_tags.lay_on(HALL)
    new, prices = len(laid) - 3, default_prices()
    bill = bill_of_material(grown, laid, 2, prices)
    whole, gone, rest = (
        {need.item: need.quantity for need in needs(grown, count, 2)} for count in (len(laid), 3, new)
    )
    assert rest == {
        item: count - (gone[item] if "tag" in item or item == "label" else 0) for item, count in whole.items()
    }
    label = prices.items["label"]
    spares = -(-new * round(label.spare_share * 100) // 100)
    assert bill.total_of(Scope.FLOOR) == pytest.approx(new * label.price_eur)
    assert Cost(prices=prices, robot_count=2)(grown, scenario(), None)["cost"].value == bill.total_eur
    carried = Cost(prices=prices, robot_count=2, equipped_count=2, equipped_with=grown.readers)
    labour_s = new * (label.labour_s + prices.items["survey_tag"].labour_s) + prices.items["survey"].labour_s
    expected = (new + spares) * label.price_eur + labour_s / 3600.0 * prices.items["labour"].price_eur
    assert carried.bill(grown, scenario()).total_eur == pytest.approx(expected, abs=0.02)


def test_readers_are_paid_for_robots_that_lack_them():
    """Of three robots one is bare; other readers than those that are carried are for all three."""
    grown = layout(tags(0.1, lying()))
    cost = Cost(prices=default_prices(), robot_count=3, equipped_count=2, equipped_with=grown.readers)
    antennas = {need.item: need.quantity for need in cost.needs(grown, scenario())}["antenna"]
    assert (antennas, cost.bare_count(grown)) == (4, 1)
    mount = Mount(antenna=SphereAntenna(side_m=0.05), height_m=0.02, profile=COMMERCIAL, antennas_per_module=4)
    other = replace(grown, readers=(cross(count=4, spacing_m=0.3, mount=mount),))
    assert {need.item: need.quantity for need in cost.needs(other, scenario())}["antenna"] == 12
    for wrong in (-1, 4):
        with pytest.raises(ValueError, match=f"of 3 robots {wrong} cannot be equipped"):
            Cost(prices=default_prices(), robot_count=3, equipped_count=wrong)
        with pytest.raises(ValueError, match=f"of 3 robots {wrong} cannot be equipped"):
            needs(grown, 10, 3, equipped_count=wrong)


def test_snapping_leaves_installed_tags_alone():
    """Whatever the marks are; the new ones go to them, numbers stay, and edits name no number that is free."""
    site = replace(HALL, tiling=Tiling(size_m=0.3))
    floor_tags = tags(0.25, lying())
    found = snapped(floor_tags, site, marks_of(site, "corners", margin_m=0.01, tag_part="label"), reach_m=0.2)
    after = found.floor_tags.lay_on(site)
    assert after.ids[:3].tolist() == [3, 4, 9]
    assert np.array_equal(after.xy_m[:3], lying().xy_m)
    assert after.status[:3] == ("installed",) * 3
    assert {fate.tag_id for fate in found.fates if fate.fate is Fate.KEPT} >= {3, 4, 9}
    steps = after.xy_m[3:] / 0.3
    assert len(steps) > 10
    assert np.abs(steps - np.round(steps)).max() < 1e-6


def test_what_lies_there_is_not_thinned_out_by_reach():
    """A filter that lays a new list in place of a pattern would lay installed tags twice."""
    with pytest.raises(ValueError, match="before they are edited or laid"):
        OnlyInReach(HALL, 0.3)(layout(tags(0.2, lying())))


def test_a_zone_with_a_pattern_of_its_own_stays_out_of_the_area_too():
    """Neither the floor's pattern nor a zone's lays a tag where the floor is equipped, in several parts."""
    zone = Zone(name="dock", region=box(1.0, 0.0, 2.0, 2.0))
    area = MultiPolygon([box(0, 0, 1.5, 2), box(2.5, 0, 3, 2)])
    listed = TagPattern(name="square", points_m=[(0, 0)], cell_m=[(0.1, 0), (0, 0.1)])
    zones = (ZonePattern(zone="", pattern=square(pitch_m=0.2)), ZonePattern(zone="dock", pattern=listed))
    laid = FloorTags(zones=zones, installed=lying(area=area)).lay_on(replace(HALL, zones=(zone,))).to_lay()
    assert not any(area.intersects(Point(place)) for place in laid.xy_m)
    assert {round(x, 6) for x in laid.xy_m[:, 0].tolist()} == {1.6, 1.7, 1.8, 1.9, 2.0, 2.2, 2.4}
