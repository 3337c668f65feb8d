"""The installation drawing: nothing overlaps, nothing leaves the frame, and what it says is what the layout is."""

import time
from dataclasses import replace
from functools import cache

import numpy as np
import pytest
import shapely
from scipy.spatial import cKDTree
from shapely.geometry import MultiPolygon, Polygon, box

from layoutopt import registry
from layoutopt.antennas.sphere import SphereAntenna
from layoutopt.drawings.arrangement import ARRANGEMENTS, fits
from layoutopt.drawings.floor_view import floor_frame
from layoutopt.drawings.frame import frame_box, frame_entities
from layoutopt.drawings.layout_sheet import CLOSEST_TAGS_MM, COARSEST_SCALE, layout_sheet
from layoutopt.drawings.lettering import ELLIPSIS, wrapped
from layoutopt.drawings.sheet import SCALES, Box, Circle, Line, Marks, Polyline, Text
from layoutopt.drawings.tag_grid import tag_groups
from layoutopt.drawings.text_boxes import text_box, text_boxes
from layoutopt.drawings.zone_names import zone_text
from layoutopt.errors import InvalidInput
from layoutopt.layout import EditKind, FloorTags, Layout, TagEdit, ZonePattern
from layoutopt.protocols import Mount
from layoutopt.readers.profiles import COMMERCIAL, MI2016
from layoutopt.robot import Robot
from layoutopt.site import Site, Tiling, Zone
from layoutopt.spec.reading import read_spec
from layoutopt.spec.template import built_in

ROBOT = Robot(outline_m=np.array([(-0.3, -0.25), (0.3, -0.25), (0.3, 0.25), (-0.3, 0.25)]))
WARD = read_spec(built_in())
TINY = Site(
    name="tiny",
    floor=box(0, 0, 4, 3),
    zones=(
        Zone(name="dock", region=box(0, 0, 1.5, 1.5), target_error_m=0.04),
        Zone(name="plate", region=box(3, 2, 4, 3), metal=True),
    ),
    tiling=Tiling(size_m=0.5),
)


def pattern(family, **parameters):
    return registry.load("patterns", family)(**parameters)


def readers(family="cross", *, side_m=0.06, profile=COMMERCIAL, ports=1, **parameters):
    mount = Mount(antenna=SphereAntenna(side_m=side_m), height_m=0.02, profile=profile, antennas_per_module=ports)
    return registry.load("readers", family)(mount=mount, **parameters)


def make(base, *, zones=(), group=None, edits=(), **changes):
    """Return a layout with a pattern on the whole floor and patterns on zones."""
    entries = [ZonePattern(zone="", pattern=base, **changes)]
    entries += [ZonePattern(zone=zone, pattern=own) for zone, own in zones]
    floor_tags = FloorTags(zones=tuple(entries), edits=tuple(edits))
    return Layout(floor_tags=floor_tags, readers=(group or readers(count=4),))


def draw(layout, site, robot=ROBOT, notes=()):
    tag_map = layout.floor_tags.lay_on(site)
    return layout_sheet(layout=layout, site=site, robot=robot, tag_map=tag_map, title="Tag plan", notes=notes)


def walked_map(parts=1):
    """Return a floor as a map reader makes it: stairs of 5 cm, hundreds of corners, holes, several parts."""
    draws = np.random.default_rng(3)
    floors = []
    for part in range(parts):
        cells = [box(-20 + 14 * part + x, 3 + y, -19 + 14 * part + x, 4 + y) for x in range(12) for y in range(8)]
        bites = []
        for x, y in draws.uniform((-20 + 14 * part, 3), (-8 + 14 * part, 11), (180, 2)):
            left, low = round(x / 0.05) * 0.05, round(y / 0.05) * 0.05
            bites.append(box(left, low, left + 0.15, low + 0.1))
        floor = shapely.union_all(cells).difference(shapely.union_all(bites))
        floors += [piece for piece in shapely.get_parts(floor) if piece.area > 1.0]
    return floors[0] if len(floors) == 1 else MultiPolygon(floors)


def many_zones():
    """Return a site with 20 zones, some without tags, some too small for their names."""
    zones = []
    for number in range(20):
        x, y, side = 0.2 + 2.3 * (number % 5), 0.2 + 1.9 * (number // 5), 0.1 if number % 7 == 3 else 1.5
        region = box(x, y, x + side, y + side)
        zones.append(Zone(name=f"zone_with_a_long_name_{number}", region=region, tags=number % 3 > 0))
    return Site(name="many zones", floor=box(0, 0, 12, 8), zones=tuple(zones))


def island():
    """Return a floor in a hole of another one, and an obstacle with a hole."""
    ring = box(0, 0, 10, 8).difference(box(3, 2, 7, 6))
    wall = box(0.5, 0.5, 2.5, 2.5).difference(box(1, 1, 2, 2))
    return Site(name="island", floor=MultiPolygon([ring, box(4, 3, 6, 5)]), obstacles=(wall,))


def random_points(count, width_m, height_m):
    points = np.random.default_rng(5).uniform((0.1, 0.1), (width_m - 0.1, height_m - 0.1), (count, 2))
    return pattern("listed", points_m=points.tolist())


ward_layouts = list(WARD.space.layouts())
CASES = {
    "ward, first": (ward_layouts[0], WARD.site, WARD.robot),
    "ward, middle": (ward_layouts[len(ward_layouts) // 2], WARD.site, WARD.robot),
    "ward, last": (ward_layouts[-1], WARD.site, WARD.robot),
    "ward, 60 mm": (make(pattern("square", pitch_m=0.06)), WARD.site, ROBOT),
    "ward, 270 mm": (
        make(pattern("square", pitch_m=0.27), zones=[("dock", pattern("square", pitch_m=0.12))]), WARD.site, ROBOT,
    ),
    "tiny": (make(pattern("square", pitch_m=0.1)), TINY, ROBOT),
    "tiny, sparse": (make(pattern("square", pitch_m=0.5)), TINY, ROBOT),
    "one tag": (make(pattern("square", pitch_m=3.0), origin_m=(1.0, 1.0)), TINY, ROBOT),
    "no tag": (make(pattern("listed", points_m=[(50.0, 50.0)])), TINY, ROBOT),
    "triangular": (make(pattern("triangular", pitch_m=0.15)), TINY, ROBOT),
    "turned": (make(pattern("square", pitch_m=0.1), angle_rad=0.3), TINY, ROBOT),
    "random": (make(random_points(300, 4, 3)), TINY, ROBOT),
    "zone patterns": (
        make(
            pattern("square", pitch_m=0.4),
            zones=[("dock", pattern("triangular", pitch_m=0.11)), ("plate", pattern("square", pitch_m=0.1))],
        ),
        TINY,
        ROBOT,
    ),
    "many zones": (
        make(
            pattern("square", pitch_m=0.2),
            zones=[(f"zone_with_a_long_name_{n}", pattern("square", pitch_m=0.05 + 0.013 * n)) for n in range(9)],
        ),
        many_zones(),
        ROBOT,
    ),
    "96 readers": (
        make(pattern("square", pitch_m=0.2), group=readers("mi2016_96", side_m=0.03, profile=MI2016)),
        TINY,
        Robot(outline_m=1.2 * np.array([(-0.6, -0.5), (0.6, -0.5), (0.6, 0.5), (-0.6, 0.5)])),
    ),
    "96 readers, 8 ports": (
        make(pattern("square", pitch_m=0.06), group=readers("mi2016_96", side_m=0.03, ports=8)), WARD.site, ROBOT,
    ),
    "one reader": (
        make(pattern("square", pitch_m=0.2), group=readers("listed", points_m=[(0.0, 0.0)])), TINY, ROBOT,
    ),
    "map": (make(pattern("square", pitch_m=0.15)), Site(name="map", floor=walked_map()), ROBOT),
    "map in parts": (
        make(pattern("square", pitch_m=0.3)),
        Site(name="map", floor=walked_map(3), tiling=Tiling(size_m=0.6, origin_m=(0.1, 0.2), angle_rad=0.2)),
        ROBOT,
    ),
    "island": (make(pattern("square", pitch_m=0.25)), island(), ROBOT),
    "corridor": (make(pattern("square", pitch_m=0.3)), Site(name="corridor", floor=box(0, 0, 60, 2.5)), ROBOT),
    "tower": (make(pattern("square", pitch_m=0.3)), Site(name="tower", floor=box(0, 0, 2.5, 60)), ROBOT),
    "hall": (make(pattern("square", pitch_m=2.0)), Site(name="hall", floor=box(-400, 90, 420, 700)), ROBOT),
    "far away": (
        make(pattern("square", pitch_m=0.2)),
        Site(name="far", floor=box(350_000, -580_000, 350_006, -579_996)),
        ROBOT,
    ),
}  # fmt: skip


@cache
def drawn(name):
    """Return the sheet of a case, drawn once for all tests that look at it."""
    return draw(*CASES[name])


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


def all_words(sheet):
    return [entry[0] for entry in text_boxes(sheet)]


def notes_of(sheet):
    """Return what the notes say, in one line."""
    return " ".join(item.text for item in sheet.entities if isinstance(item, Text))


def tags_of(sheet):
    (found,) = [item for item in sheet.views[0].entities if isinstance(item, Marks) and item.layer == "A-TAGS"]
    return found


def test_no_text_touches_another(case):
    """The boxes of no two texts of a sheet overlap, whatever the layout, site and robot."""
    found = texts(case[3])
    low, high = (np.array([entry[first : first + 2] for entry in found]) for first in (1, 3))
    meet = (low[:, None, :] < high[None, :, :] - 1e-6) & (low[None, :, :] < high[:, None, :] - 1e-6)
    pairs = np.argwhere(np.triu(meet.all(axis=2), k=1))
    assert [(found[one][0], found[other][0]) for one, other in pairs[:5]] == []


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


def test_dimensions_run_from_the_datum_of_the_site():
    """On a floor whose bounds begin at (-1, 2) m, tags at x = -0.8 and y = 2.3 m have the labels 200 and 300."""
    site = Site(name="moved", floor=box(-1, 2, 1, 4))
    sheet = draw(make(pattern("square", pitch_m=0.4), origin_m=(-0.8, 2.3)), site)
    labels = [item for item in sheet.views[0].entities if isinstance(item, Text) and item.layer == "A-DIMS"]
    below = {item.text for item in labels if item.angle_deg == 90.0 and item.text.isdigit()}
    left = {item.text for item in labels if item.angle_deg == 0.0 and item.anchor == "middle-right"}
    assert below == {"0", "200", "600", "1000", "1400", "1800"}
    assert left == {"0", "300", "700", "1100", "1500", "1900"}
    (cross,) = [item for item in sheet.views[0].entities if isinstance(item, Marks) and item.kind == "datum"]
    np.testing.assert_array_equal(cross.points_mm, [(-1000.0, 2000.0)])
    assert {"x -1.000 m", "y 2.000 m"} <= set(all_words(sheet))


def test_staggered_rows_have_both_sets_of_columns():
    """A triangular pattern of 400 mm has grid columns every 200 mm, and so many labels."""
    sheet = draw(make(pattern("triangular", pitch_m=0.4)), Site(name="room", floor=box(0, 0, 3, 3)))
    labels = {item.text for item in sheet.views[0].entities if isinstance(item, Text) and item.angle_deg == 90.0}
    assert {"200", "400", "600", "800", "1000"} <= labels


def test_zone_patterns_have_a_dimension_line_of_their_own():
    """Columns that only a zone has are dimensioned on a second line, and both lines are named."""
    sheet = drawn("ward, 270 mm")
    words = [item.text for item in sheet.views[0].entities if isinstance(item, Text)]
    assert words.count("floor") == 2
    assert words.count("dock") == 2
    assert {"270", "360"} <= set(words)


def test_tags_in_no_rows_are_said_to_be_in_the_table():
    """A random arrangement has neither grid nor dimensions, and the notes point to tags.csv."""
    sheet = drawn("random")
    assert not [item for item in sheet.views[0].entities if item.layer == "A-GRID"]
    assert "Tag columns of floor are not dimensioned: see tags.csv." in notes_of(sheet)


def test_identities_are_printed_where_they_fit_and_only_there():
    """Tags half a metre apart carry their number; those 60 mm apart do not, and the notes say so."""
    sparse, dense = drawn("tiny, sparse"), drawn("ward, 60 mm")
    printed = {item.text for item in sparse.views[0].entities if item.layer == "A-TAGS-ID"}
    assert printed == set(tags_of(sparse).ids)
    assert not [item for item in dense.views[0].entities if item.layer == "A-TAGS-ID"]
    assert "have no room on the plan: see tags.csv" in notes_of(dense)
    assert "have no room on the plan" not in notes_of(sparse)


def test_antennas_are_true_squares_with_number_yaw_and_read_disc():
    """The square of an antenna turned by 30 degrees has its corners there; discs have the radius on the floor."""
    flat = readers("listed", points_m=[(0.1, 0.0), (-0.1, 0.05)])
    group = replace(flat, poses=np.array([(0.1, 0.0, 0.02, np.pi / 6), (-0.1, 0.05, 0.025, 0.0)]))
    sheet = draw(make(pattern("square", pitch_m=0.3), group=group), TINY)
    view = sheet.views[1]
    squares = [item for item in view.entities if isinstance(item, Polyline) and item.layer == "A-READERS"]
    corner = np.array([(-0.03, -0.03)]) @ np.array([(3**0.5 / 2, 0.5), (-0.5, 3**0.5 / 2)])
    np.testing.assert_allclose(squares[0].points_mm[0], 1000.0 * corner[0] + (100.0, 0.0), atol=1e-9)
    discs = [item for item in view.entities if isinstance(item, Circle) and item.layer == "A-READ-DISC"]
    expected = [1000.0 * group.antenna.read_radius_m(height_m) for height_m in (0.02, 0.025)]
    assert [disc.radius_mm for disc in discs] == pytest.approx(expected)
    numbers = [item.text for item in view.entities if isinstance(item, Text) and item.layer == "A-READERS"]
    assert numbers == ["0", "1"]


def test_robot_is_drawn_at_an_installers_scale_with_its_dimensions():
    """The ward's robot is drawn at 1:2, 1:5 or 1:10 with chassis and antennas dimensioned from base_link."""
    sheet = drawn("ward, 270 mm")
    assert sheet.views[1].scale in (2, 5, 10)
    words = {item.text for item in sheet.views[1].entities if isinstance(item, Text) and item.layer == "A-DIMS"}
    assert {"0", "300", "-300", "250", "-250", "100", "-100"} <= words


def test_modules_and_slots_stand_in_the_table_of_antennas():
    """Each antenna has a row with its number, place, module and scan slot."""
    sheet = draw(make(pattern("square", pitch_m=0.27), group=readers(count=4, ports=2)), WARD.site)
    cells = [item for item in sheet.entities if isinstance(item, Text) and item.height_mm == 2.2]
    rows = {}
    for cell in cells:
        rows.setdefault(cell.position_mm[1], []).append(cell.text)
    group = CASES["tiny"][0].readers[0]
    assert ["No.", "x mm", "y mm", "yaw °", "module", "slot"] in rows.values()
    assert sum(len(row) == 6 for row in rows.values()) == group.count + 1
    assert ["0", "100", "0", "0"] in [row[:4] for row in rows.values()]


@pytest.mark.parametrize(
    ("group", "words"),
    [
        (readers("mi2016_8", profile=MI2016), "reconstructed"),
        (readers(count=4, side_m=0.12, spacing_m=0.2), "extrapolated for 120 mm"),
    ],
)
def test_what_is_uncertain_is_said(group, words):
    """Reconstructed coordinates and antennas outside the calibrated range are named in the notes, others not."""
    assert words in notes_of(draw(make(pattern("square", pitch_m=0.3), group=group), TINY))
    assert words not in notes_of(draw(make(pattern("square", pitch_m=0.3)), TINY))


def test_edited_tags_are_counted_in_the_notes():
    """A moved tag shows up in the notes, with the column of the table that names it."""
    edit = TagEdit(kind=EditKind.MOVED, from_m=(0.5, 0.5), to_m=(0.55, 0.52))
    words = notes_of(draw(make(pattern("square", pitch_m=0.5), edits=[edit]), TINY))
    assert "install_status in tags.csv): 1 moved." in words


def test_title_block_names_the_layout_and_invents_nobody():
    """The identification number is the layout's key; owner, approval and date are left to be filled in."""
    layout, sheet = CASES["tiny"][0], drawn("tiny")
    words = all_words(sheet)
    assert layout.short_key in words
    assert words.count("to be filled in") == 2
    assert {"Installation drawing", "layoutopt", "-", "1 / 1", "Tag plan"} <= set(words)


def test_own_notes_are_wrapped_and_kept_whole():
    """Notes of the user stand on the sheet word for word, also long ones and ones in another script."""
    own = ["Glue with " + "very " * 60 + "clean hands.", "x" * 300, "床を拭く \u2028 first"]
    sheet = draw(make(pattern("square", pitch_m=0.3)), TINY, notes=own)
    assert notes_of(sheet).count("very") == 60
    assert sum(len(word) for word in all_words(sheet) if set(word) == {"x"} and len(word) > 1) == 300
    assert "first" in notes_of(sheet)


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


def leaders_of(sheet):
    """Return the lines of the plan that belong to no dimension: leaders and their strokes."""
    return [item for item in sheet.views[0].entities if isinstance(item, Line) and item.layer == "A-DIMS"]


def test_leader_of_a_zone_ends_in_a_stroke_and_not_in_a_dot():
    """Beside a zone full of tags its name has a leader, and nothing but a tag is a filled dot on the plan."""
    layout = make(pattern("square", pitch_m=0.4), zones=[("dock", pattern("square", pitch_m=0.07))])
    sheet = draw(layout, TINY)
    dots = [item for item in sheet.views[0].entities if isinstance(item, Circle) and item.fill is not None]
    assert dots == []
    dock = TINY.zone("dock").region.boundary
    ends = [
        shapely.LineString([line.start_mm, line.end_mm]).interpolate(0.5, normalized=True)
        for line in leaders_of(sheet)
        if np.hypot(*np.subtract(line.end_mm, line.start_mm)) == pytest.approx(2.5 * sheet.views[0].scale)
    ]
    assert any(dock.distance(shapely.Point(end.x / 1000.0, end.y / 1000.0)) < 1e-6 for end in ends)


def test_zone_names_stand_clear_of_the_dots():
    """Where the floor has room, half a capital is left between a zone's name and every tag."""
    layout = make(pattern("square", pitch_m=0.4), zones=[("dock", pattern("square", pitch_m=0.07))])
    sheet = draw(layout, TINY)
    view, tags = sheet.views[0], tags_of(sheet)
    (name,) = [item for item in view.entities if isinstance(item, Text) and item.text.startswith("dock, target")]
    found = text_box(name, view.scale)
    middle, half_mm = (found.ymin + found.ymax) / 2.0, name.height_mm
    half_dot_mm = tags.drawn_size_mm(view.scale) / view.scale / 2.0
    places = tags.points_mm / view.scale
    along = (places[:, 0] > found.xmin - half_dot_mm) & (places[:, 0] < found.xmax + half_dot_mm)
    across = np.abs(places[:, 1] - name.position_mm[1] / view.scale) < half_mm + half_dot_mm - 0.5
    assert middle == pytest.approx(name.position_mm[1] / view.scale, abs=name.height_mm)
    assert not (along & across).any()


@pytest.mark.parametrize(
    ("floor", "words"),
    [
        (Polygon([(0, 3), (4, 3), (4, 0), (9, 0), (9, 7), (0, 7)]), "which is at x 0, y 3000 from it"),
        (Polygon([(1, 4.5), (3, 2), (9, 2), (9, 7), (1, 7)]), "which is at x 2000, y 0 from it"),
        (box(0, 0, 9, 7), ""),
        (Polygon([(0, 0), (9, 0), (9, 7), (4, 3)]), ""),
    ],
)
def test_datum_outside_the_walls_is_set_out_from_a_corner(floor, words):
    """The notes name the nearest corner of the floor if the datum is no point of the floor, and only then."""
    notes = notes_of(draw(make(pattern("square", pitch_m=0.5)), Site(name="L", floor=floor)))
    assert ("The datum lies outside the walls" in notes) == bool(words)
    assert words in notes


def test_equal_layouts_give_equal_sheets():
    """Drawing twice gives the same views and entities."""
    assert draw(*CASES["zone patterns"]) == drawn("zone patterns")


def test_wrapped_lines_lose_no_word():
    """Wrapped lines joined by spaces are the text, and a word longer than a line is broken, not lost."""
    text = "measure each tag from the datum " + "x" * 80
    lines = wrapped(text, 40.0, 2.5)
    assert "".join(lines).replace(" ", "") == text.replace(" ", "")
    assert len(lines) > 4


def test_holes_and_islands_are_filled_like_what_they_are():
    """The hole of a floor is grey, and the part of the floor within it is white again, in this order."""
    sheet = drawn("island")
    fills = [
        (Polygon(item.points_mm).area / 1e6, item.fill)
        for item in sheet.views[0].entities
        if isinstance(item, Polyline) and item.layer == "A-OUTLINE"
    ]
    assert [(round(area), fill) for area, fill in fills] == [(80, None), (16, "#dcdcdc"), (4, "#ffffff")]
