"""Snapped floors: every tag accounted for, on its mark, apart from the others, where tags may lie."""

from collections import Counter
from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial import cKDTree
from shapely.geometry import Point, box
from snapping_cases import KINDS, LEAST_M, MARGIN_M, SIZE_M, STEP_M, all_marks, grid_of, local, sites, tag_floors

from layoutopt.errors import InvalidInput
from layoutopt.laying import left_out, named_places
from layoutopt.layout import EditKind, FloorTags, TagEdit, ZonePattern
from layoutopt.patterns.square import square
from layoutopt.site import Site, Tiling, Zone
from layoutopt.snapping.marks import marks_of
from layoutopt.snapping.snapped import Fate, snapped

REACH_M = 0.11
GONE = (Fate.DROPPED, Fate.NOT_LAID)


def snap(floor_tags, site, kind, **settings):
    """Return a floor snapped to marks of a kind, ``None`` if no tag finds a place."""
    marks = marks_of(
        site,
        kind,
        margin_m=max(floor_tags.tag_size_m) / 2.0,
        tag_part=floor_tags.tag_part,
        chalk_spacing_m=grid_of(site, kind).size_m if kind == "chalk" else None,
    )
    try:
        return snapped(floor_tags, site, marks, reach_m=REACH_M, **settings)
    except InvalidInput:
        return None


def off_marks_m(places_m, site, kind):
    """Return how far places are from the nearest mark, by the coordinates of the grid alone."""
    grid = grid_of(site, kind)
    steps = local(places_m, grid) / grid.size_m - (0.5 if kind == "centres" else 0.0)
    away_m = np.abs(steps - np.round(steps)) * grid.size_m
    return away_m.min(axis=1) if kind == "joints" else np.linalg.norm(away_m, axis=1)


@pytest.mark.parametrize("kind", KINDS)
@settings(max_examples=8, deadline=None)
@given(site=sites(), floor_tags=tag_floors(), move=st.booleans())
def test_every_tag_is_accounted_for_once_and_lies_on_its_mark(kind, site, floor_tags, move):
    """Kept, snapped, moved, added or dropped, and the laid map is just what the list says."""
    tags = floor_tags.lay_on(site)
    result = snap(floor_tags, site, kind, move=move)
    if result is None:
        return
    # Each tag of the original once; each place that it did not lay once, added or not laid.
    known = [item for item in result.fates if item.fate not in (Fate.ADDED, Fate.NOT_LAID)]
    assert [item.tag_id for item in known] == tags.ids.tolist()
    np.testing.assert_array_equal([item.from_m for item in known], tags.xy_m)
    others_m = [item.from_m for item in result.of(Fate.ADDED, Fate.NOT_LAID)]
    np.testing.assert_array_equal(np.reshape(others_m, (-1, 2)), left_out(floor_tags, site))
    after = result.floor_tags.lay_on(site)
    places = {item.tag_id: item for item in result.fates if item.to_m is not None}
    assert after.ids.tolist() == sorted(places)
    np.testing.assert_array_equal(after.xy_m, [places[tag_id].to_m for tag_id in after.ids.tolist()])
    words = {Fate.KEPT: "planned"}
    expected = [words.get(places[tag_id].fate, places[tag_id].fate.value) for tag_id in after.ids.tolist()]
    assert list(after.status) == expected
    assert [item.tag_id for item in result.of(Fate.ADDED)] == [
        len(tags) + number for number in range(1, len(result.of(Fate.ADDED)) + 1)
    ]
    assert all(item.why for item in result.fates if item.fate is not Fate.KEPT)
    assert move or not result.of(Fate.MOVED, Fate.ADDED)
    # On marks, apart, and where tags may lie.
    listed_m = all_marks(site, "centres") if kind == "centres" else None
    off_m = off_marks_m(after.xy_m, site, kind) if listed_m is None else cKDTree(listed_m).query(after.xy_m)[0]
    assert off_m.max() <= 1e-9
    if len(after) > 1:
        assert cKDTree(after.xy_m).query(after.xy_m, k=2)[0][:, 1].min() >= LEAST_M - 1e-9
    assert not any(site.why_barred(after.xy_m, MARGIN_M - 1e-8))
    assert all(item.by_m <= REACH_M + 1e-9 for item in result.of(Fate.MOVED, Fate.ADDED))


@pytest.mark.parametrize("kind", KINDS)
@settings(max_examples=6, deadline=None)
@given(site=sites(), floor_tags=tag_floors())
def test_tags_are_dropped_only_by_the_rules(kind, site, floor_tags):
    """Against a plain count over all pairs: the tag that goes less far stays, and only barred marks are left."""
    result = snap(floor_tags, site, kind)
    tags = floor_tags.lay_on(site)
    marks = marks_of(
        site, kind, margin_m=MARGIN_M, tag_part="label", chalk_spacing_m=0.07 if kind == "chalk" else None
    )
    to_m, why = marks.nearest(tags.xy_m)
    away_m = np.round(np.linalg.norm(to_m - tags.xy_m, axis=1), 9)
    allowed = [
        not words and not barred for words, barred in zip(why, site.why_barred(to_m, MARGIN_M), strict=True)
    ]
    kept = []
    for row in sorted(range(len(tags)), key=lambda row: (away_m[row], row)):
        if allowed[row] and all(np.hypot(*(to_m[row] - to_m[other])) >= LEAST_M - 1e-9 for other in kept):
            kept.append(row)
    if result is None:
        assert not kept
    else:
        laid = {item.tag_id for item in result.fates if item.to_m is not None}
        assert laid == {int(tags.ids[row]) for row in kept}


@pytest.mark.parametrize("kind", KINDS)
@settings(max_examples=6, deadline=None)
@given(site=sites(), floor_tags=tag_floors())
def test_a_moved_tag_goes_to_the_nearest_free_mark(kind, site, floor_tags):
    """Whatever mark is nearer, or within reach of a tag that found none, is barred or too near to another tag."""
    result = snap(floor_tags, site, kind, move=True)
    if result is None:
        return
    listed_m = all_marks(site, kind)
    listed_m = listed_m[[not why for why in site.why_barred(listed_m, MARGIN_M)]]
    after = result.floor_tags.lay_on(site)
    # A fine row of points on joints misses what is free on less than its step.
    slack_m = 2.0 * STEP_M if kind == "joints" else 1e-6
    for item in result.fates:
        moved = item.fate in (Fate.MOVED, Fate.ADDED)
        if not moved and "no free mark" not in item.why:
            continue
        away_m = np.linalg.norm(listed_m - item.from_m, axis=1)
        nearer_m = listed_m[away_m < (item.by_m if moved else REACH_M) - slack_m]
        others_m = after.xy_m[after.ids != item.tag_id]
        if len(nearer_m):
            assert len(others_m)
            assert cKDTree(others_m).query(nearer_m)[0].max() < LEAST_M


def test_tags_on_obstacles_are_added_beside_them_or_listed():
    """Nine tags at 0.25 m; the one in the middle lies on a pillar, a chalk crossing is 100 mm away, none 80 mm."""
    pillar = box(0.42, 0.42, 0.58, 0.58)
    site = Site(name="room", floor=box(0, 0, 1, 1), obstacles=(pillar,))
    floor_tags = FloorTags(zones=(ZonePattern(zone="", pattern=square(pitch_m=0.25)),))
    marks = marks_of(site, "chalk", margin_m=0.01, tag_part="label", chalk_spacing_m=0.05)
    for move, reach_m, fate in (
        (True, 0.101, Fate.ADDED),
        (True, 0.09, Fate.NOT_LAID),
        (False, 0.2, Fate.NOT_LAID),
    ):
        result = snapped(floor_tags, site, marks, move=move, reach_m=reach_m)
        middle = next(item for item in result.fates if item.from_m == (0.5, 0.5))
        assert middle.fate is fate
        assert middle.why.startswith("obstacle 1")
        assert Counter(item.fate for item in result.fates)[Fate.KEPT] == 8
        # Walls are no obstacles: what the pattern puts on them is listed and stays away.
        walls = [item for item in result.fates if 0.0 in item.from_m or 1.0 in item.from_m]
        assert {(item.fate, item.why) for item in walls} == {(Fate.NOT_LAID, "near the wall")}
        assert len(walls) == 16
    added = snapped(floor_tags, site, marks, move=True, reach_m=0.101).of(Fate.ADDED)[0]
    assert (added.tag_id, added.by_m) == (9, pytest.approx(0.1))
    assert pillar.distance(Point(added.to_m)) >= 0.01


def test_two_tags_on_one_corner_leave_the_nearer_one():
    """Of tags at 0.42 and 0.56 m the second goes less far to the corner at 0.5 m; of equals the first stays."""
    site = Site(name="room", floor=box(0, 0, 1, 1), tiling=Tiling(size_m=0.5))
    marks = marks_of(site, "corners", margin_m=0.01, tag_part="label")
    for x_m, stays in (((0.42, 0.56), 2), ((0.44, 0.56), 1)):
        pattern = square(pitch_m=0.1)
        pattern = replace(pattern, points_m=np.array([(x, 0.5) for x in x_m]), cell_m=None)
        result = snapped(FloorTags(zones=(ZonePattern(zone="", pattern=pattern),)), site, marks)
        assert [item.fate for item in result.fates] == [
            Fate.SNAPPED if number == stays else Fate.DROPPED for number in (1, 2)
        ]
        assert f"to tag {stays}" in result.of(Fate.DROPPED)[0].why
        assert result.floor_tags.lay_on(site).ids.tolist() == [stays]


def test_locked_tags_stay_and_earlier_edits_are_kept():
    """Dropped stays dropped, locked stays and rules its mark, moved and added tags go from where they lie."""
    site = Site(name="room", floor=box(0, 0, 1, 1), tiling=Tiling(size_m=0.5))
    edits = (
        TagEdit(kind=EditKind.LOCKED, from_m=(0.4, 0.4), to_m=(0.51, 0.5)),
        TagEdit(kind=EditKind.DROPPED, from_m=(0.8, 0.8)),
        TagEdit(kind=EditKind.MOVED, from_m=(0.8, 0.4), to_m=(0.7, 0.3)),
        TagEdit(kind=EditKind.ADDED, from_m=(0.5, 0.2), to_m=(0.26, 0.72)),
        TagEdit(kind=EditKind.DROPPED, from_m=(0.4, 0.8)),
    )
    floor_tags = FloorTags(zones=(ZonePattern(zone="", pattern=square(pitch_m=0.4)),), edits=edits)
    assert named_places(floor_tags, site).shape == (5, 2)
    marks = marks_of(site, "centres", margin_m=0.01, tag_part="label")
    result = snapped(floor_tags, site, marks)
    after = result.floor_tags.lay_on(site)
    assert after.ids.tolist() == [1, 2, 5]
    np.testing.assert_allclose(after.xy_m, [(0.51, 0.5), (0.75, 0.25), (0.25, 0.75)], atol=1e-12)
    assert after.status == ("locked", "snapped", "snapped")
    again = snapped(result.floor_tags, site, marks)
    assert {item.fate for item in again.fates if item.tag_id} == {Fate.KEPT}
    assert again.floor_tags.lay_on(site).status == after.status
    np.testing.assert_array_equal(again.floor_tags.lay_on(site).xy_m, after.xy_m)


def test_a_tag_is_not_added_where_an_edit_names_another():
    """The tag at 0.6, 0.5 was dropped: what falls on the pillar goes to another crossing as near, or nowhere."""
    site = Site(name="room", floor=box(0, 0, 1, 1), obstacles=(box(0.47, 0.47, 0.53, 0.53),))
    dropped = TagEdit(kind=EditKind.DROPPED, from_m=(0.6, 0.5))
    floor_tags = FloorTags(zones=(ZonePattern(zone="", pattern=square(pitch_m=0.1)),), edits=(dropped,))
    marks = marks_of(site, "chalk", margin_m=0.01, tag_part="label", chalk_spacing_m=0.1)
    result = snapped(floor_tags, site, marks, move=True, reach_m=0.101)
    assert [item.fate for item in result.fates if item.from_m == pytest.approx((0.5, 0.5))] == [Fate.NOT_LAID]
    assert len(result.floor_tags.lay_on(site)) == 79
    finer = marks_of(site, "chalk", margin_m=0.01, tag_part="label", chalk_spacing_m=0.05)
    added = snapped(floor_tags, site, finer, move=True, reach_m=0.101).of(Fate.ADDED)
    assert [item.by_m for item in added] == [pytest.approx(0.05)]


def test_zones_bar_by_the_part_of_the_tag():
    """Chalk marks on a plate and on a floor that must not be drilled are used by the tags that may lie there."""
    zones = (
        Zone(name="plate", region=box(0, 0, 1, 1), metal=True),
        Zone(name="heating", region=box(1, 0, 2, 1), drill=False),
    )
    site = Site(name="room", floor=box(0, 0, 2, 1), zones=zones)
    for part, xmin, xmax in (("label", 1, 2), ("disc", 1, 2), ("on_metal", 0, 2)):
        floor_tags = FloorTags(
            zones=(ZonePattern(zone="", pattern=square(pitch_m=0.13)),), tag_part=part, tag_size_m=SIZE_M
        )
        marks = marks_of(site, "chalk", margin_m=MARGIN_M, tag_part=part, chalk_spacing_m=0.1)
        after = snapped(floor_tags, site, marks, move=True).floor_tags.lay_on(site)
        assert after.xy_m[:, 0].min() < xmin + 0.15
        assert after.xy_m[:, 0].min() >= xmin + MARGIN_M - 1e-8
        assert after.xy_m[:, 0].max() > xmax - 0.15
    pucks = replace(floor_tags, tag_part="puck")
    with pytest.raises(InvalidInput, match="no tag finds a place"):
        snapped(pucks, site, marks_of(site, "chalk", margin_m=MARGIN_M, tag_part="puck", chalk_spacing_m=0.1))


def test_a_reach_of_a_wrong_unit_is_refused():
    """A tag that would look at a million marks is a wrong unit."""
    site = Site(name="room", floor=box(0, 0, 1, 1))
    floor_tags = FloorTags(zones=(ZonePattern(zone="", pattern=square(pitch_m=0.25)),))
    marks = marks_of(site, "chalk", margin_m=0.01, tag_part="label", chalk_spacing_m=0.05)
    with pytest.raises(InvalidInput, match=r"--reach.*over 100 times the distance of the marks"):
        snapped(floor_tags, site, marks, move=True, reach_m=100.0)
