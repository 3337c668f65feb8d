"""The installation drawing: nothing overlaps or leaves the frame; paper and scale are as small as can be."""

import time

import numpy as np
import pytest
from scipy.spatial import cKDTree
from shapely.geometry import Point, Polygon, box
from sheet_cases import CASES, ROBOT, TINY, WARD, draw, drawn, make, notes_of, pattern, tags_of

from layoutopt.drawings.arrangement import ARRANGEMENTS, fits
from layoutopt.drawings.floor_view import NO_TAGS_FILL, OBSTACLE_FILL, floor_frame, site_shapes
from layoutopt.drawings.frame import frame_box, frame_entities
from layoutopt.drawings.layout_sheet import CLOSEST_TAGS_MM, COARSEST_SCALE, layout_sheet
from layoutopt.drawings.lettering import ELLIPSIS, wrapped
from layoutopt.drawings.sheet import SCALES, Box, Marks, Polyline, Text
from layoutopt.drawings.tag_grid import tag_groups
from layoutopt.drawings.text_boxes import text_boxes
from layoutopt.drawings.zone_names import zone_text
from layoutopt.errors import InvalidInput
from layoutopt.robot import Robot
from layoutopt.site import Site, Zone


@pytest.fixture(params=CASES, scope="module")
def case(request):
    """A layout, its site and robot, and the sheet."""
    return *CASES[request.param], drawn(request.param)


def texts(sheet):
    """Return all texts of the sheet but the grid reference, which belongs outside the frame."""
    outside = [item.text for item in frame_entities(sheet.paper) if isinstance(item, Text)]
    boxes = text_boxes(sheet)
    frame = frame_box(sheet.paper)
    found = [entry for entry in boxes if Box(*entry[1:]).overlaps(frame)]
    assert len(boxes) - len(found) == len(outside)
    return found


def test_no_text_touches_another(case):
    """The boxes of no two texts of a sheet overlap, whatever the layout, site and robot."""
    found = texts(case[3])
    low, high = (np.array([entry[first : first + 2] for entry in found]) for first in (1, 3))
    meet = (low[:, None, :] < high[None, :, :] - 1e-6) & (low[None, :, :] < high[:, None, :] - 1e-6)
    pairs = np.argwhere(np.triu(meet.all(axis=2), k=1))
    assert [(found[one][0], found[other][0]) for one, other in pairs[:5]] == []


def test_a_pillar_under_a_zone_without_tags_is_drawn_as_no_floor():
    """The pillar, a hole in the floor, is filled after the zone was; elsewhere the fill of the zone is on top."""
    pillar, region = box(2, 2, 3, 3), box(1, 1, 4, 4)
    zone = Zone(name="bay", region=region, tags=False)
    shapes = site_shapes(Site(name="map", floor=box(0, 0, 8, 5).difference(pillar), zones=(zone,)))
    filled = [item for item in shapes if isinstance(item, Polyline) and item.fill is not None]
    on_top = {
        place: next(item.fill for item in reversed(filled) if Polygon(item.points_mm).contains(Point(place)))
        for place in ((2500, 2500), (1500, 1500))
    }
    assert on_top == {(2500, 2500): OBSTACLE_FILL, (1500, 1500): NO_TAGS_FILL}


def test_all_texts_lie_inside_the_frame_and_their_view(case):
    """No text leaves the frame of the sheet, and none of a view is cut off at its window."""
    sheet = case[3]
    frame = frame_box(sheet.paper)
    assert [entry[0] for entry in texts(sheet) if not Box(*entry[1:]).inside(frame)] == []
    boxes = text_boxes(sheet)
    for view in sheet.views:
        count = sum(isinstance(item, Text) for item in view.entities)
        assert [entry[0] for entry in boxes[:count] if not Box(*entry[1:]).inside(view.window_mm)] == []
        boxes = boxes[count:]


def test_views_do_not_cut_off_anything(case):
    """Every point of both views lies in its window, and the windows do not overlap."""
    sheet = case[3]
    for view in sheet.views:
        for item in view.entities:
            if isinstance(item, Marks | Polyline) and len(item.points_mm):
                points = view.on_paper(item.points_mm)
                assert Box(*points.min(axis=0), *points.max(axis=0)).inside(view.window_mm)
    assert not sheet.views[0].window_mm.overlaps(sheet.views[1].window_mm)


def test_every_tag_is_drawn_at_its_place_in_the_map_frame(case):
    """The marks are the tag map in millimetres, tag by tag, with its identities."""
    layout, site, _, sheet = case
    tag_map = layout.floor_tags.lay_on(site)
    np.testing.assert_allclose(tags_of(sheet).points_mm, tag_map.xy_m * 1000.0, rtol=0, atol=1e-6)
    assert tags_of(sheet).ids == tuple(str(identity) for identity in tag_map.ids)
    assert f"{len(tag_map)} tags" in notes_of(sheet)


def test_no_word_of_the_notes_is_cut_off(case):
    """Notes wrap to further lines; none of them ends in an ellipsis."""
    assert ELLIPSIS not in notes_of(case[3])


def test_every_zone_is_named_on_the_plan_or_in_the_notes(case):
    """The name of a zone stands on the plan, or the notes say that it has no room there."""
    _, site, _, sheet = case
    words = [item.text for item in sheet.views[0].entities if isinstance(item, Text)]
    unnamed = [zone.name for zone in site.zones if zone_text(zone) not in words]
    assert all(name in notes_of(sheet) for name in unnamed)


def test_paper_is_as_small_as_the_tags_allow(case):
    """Tags lie 1.2 mm apart and the plan is at 1:50 or larger, or no paper would give it a larger scale."""
    layout, site, _, sheet = case
    tag_map = layout.floor_tags.lay_on(site)
    xy_m, closest_mm = tag_map.xy_m, np.inf
    for zone in set(tag_map.zone.tolist()):
        # What counts is what is laid: a zone with a single tag has no spacing.
        laid = xy_m[tag_map.zone == zone]
        if len(laid) > 1:
            nearest_m = cKDTree(laid).query(laid, k=2)[0][:, 1]
            closest_mm = min(closest_mm, 1000.0 * float(np.median(nearest_m)))
    scale = sheet.views[0].scale
    if len(xy_m) and (closest_mm < CLOSEST_TAGS_MM * scale or scale > COARSEST_SCALE):
        xmin, ymin, xmax, ymax = site.bounds_m
        finer = {5: 2, 10: 5, 20: 10, 50: 20, 100: 50, 200: 100, 500: 200, 1000: 500}[scale]
        on_largest = 1000.0 * (xmax - xmin) / finer, 1000.0 * (ymax - ymin) / finer
        room = frame_box("A0")
        assert on_largest[0] > room.width - 240.0 or on_largest[1] > room.height - 160.0


def test_known_papers_and_scales():
    """The ward takes A1 at 1:20 with tags 60 mm apart, and A2 at 1:50 with tags 270 mm apart."""
    found = {
        name: (drawn(name).paper, drawn(name).views[0].scale)
        for name in ("ward, 60 mm", "ward, 270 mm", "tiny, sparse")
    }
    assert found == {"ward, 60 mm": ("A1", 20), "ward, 270 mm": ("A2", 50), "tiny, sparse": ("A3", 50)}


def test_no_larger_scale_fits_the_chosen_paper(case):
    """At the next larger scale of ISO 5455 the plan with its dimensions is larger than its room, without notes."""
    layout, site, _, sheet = case
    finer = SCALES[SCALES.index(sheet.views[0].scale) - 1]
    groups = tag_groups(layout, site, layout.floor_tags.lay_on(site))
    box_mm = floor_frame(site=site, groups=groups, scale=finer).box_mm
    rooms = [arrange(sheet.paper, 0.0, 0.0, 4.0) for arrange in ARRANGEMENTS]
    assert [room.plan for room in rooms if room is not None and fits(box_mm, finer, room.plan)] == []


@pytest.mark.parametrize(
    ("site", "robot", "notes"),
    [
        (Site(name="country", floor=box(0, 0, 30_000, 20_000)), ROBOT, ()),
        (TINY, Robot(outline_m=1e4 * ROBOT.outline_m), ()),
        (TINY, ROBOT, ("word " * 20_000,)),
    ],
)
def test_what_fits_no_sheet_is_told_so(site, robot, notes):
    """Too large a floor or robot, or too long notes, end in one message that names them, not in a torn sheet."""
    layout = make(pattern("listed", points_m=[(1.0, 1.0)]))
    with pytest.raises(InvalidInput, match=r"fit no sheet up to A0.*Check the units"):
        draw(layout, site, robot, notes)


def test_a_floor_with_25000_tags_is_drawn_in_seconds():
    """More than 25 000 tags take less than five seconds of processor time, whatever else the machine does."""
    layout = make(pattern("square", pitch_m=0.06))
    tag_map = layout.floor_tags.lay_on(WARD.site)
    assert len(tag_map) > 25_000
    start = time.process_time()
    layout_sheet(layout=layout, site=WARD.site, robot=ROBOT, tag_map=tag_map, title="t")
    assert time.process_time() - start < 5.0


def test_equal_layouts_give_equal_sheets():
    """Drawing twice gives the same views and entities."""
    assert draw(*CASES["zone patterns"]) == drawn("zone patterns")


def test_wrapped_lines_lose_no_word():
    """Wrapped lines joined by spaces are the text, and a word longer than a line is broken, not lost."""
    text = "measure each tag from the datum " + "x" * 80
    lines = wrapped(text, 40.0, 2.5)
    assert "".join(lines).replace(" ", "") == text.replace(" ", "")
    assert len(lines) > 4
