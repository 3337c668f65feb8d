"""The installation drawing: what it says and shows is what the layout is."""

from dataclasses import replace

import numpy as np
import pytest
import shapely
from shapely.geometry import Polygon, box
from sheet_cases import CASES, TINY, WARD, all_words, draw, drawn, make, notes_of, pattern, readers, tags_of

from layoutopt.drawings.sheet import Circle, Line, Marks, Polyline, Text
from layoutopt.drawings.text_boxes import text_box
from layoutopt.layout import EditKind, InstalledTags, TagEdit
from layoutopt.readers.profiles import MI2016
from layoutopt.site import Site


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
    cells = [item for item in sheet.entities if isinstance(item, Text) and item.anchor == "right"]
    rows = {}
    for cell in cells:
        rows.setdefault(cell.position_mm[1], []).append(cell.text)
    group = CASES["tiny"][0].readers[0]
    assert ["No.", "x", "y", "z", "yaw °", "module", "slot"] in rows.values()
    assert sum(len(row) == 7 for row in rows.values()) == group.count + 1
    assert ["0", "100", "0", "20", "0"] in [row[:5] for row in rows.values()]


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


def test_tags_that_lie_already_are_to_be_left():
    """Installed tags are no deviation from a pattern; edited ones still are."""
    installed = InstalledTags(ids=np.array([4, 7]), xy_m=[(0.2, 0.2), (0.4, 0.2)], area=box(0, 0, 0.6, 0.6))
    edit = TagEdit(kind=EditKind.MOVED, from_m=(0.4, 0.2), to_m=(0.45, 0.2))
    for edits, lying in (([], 2), ([edit], 1)):
        layout = make(pattern("square", pitch_m=0.5), edits=edits)
        layout = layout.replace(floor_tags=replace(layout.floor_tags, installed=installed))
        sheet = draw(layout, TINY)
        words = notes_of(sheet)
        rings = [item for item in sheet.views[0].entities if isinstance(item, Marks) and item.symbol == "ring"]
        assert [len(marks.points_mm) for marks in rings] == [lying]
        assert "4" in rings[0].ids
        assert "tag already there" in words
        assert f"Tags that lie already and stay (install_status in tags.csv): {lying} installed." in words
        assert ("install_status in tags.csv): 1 moved." in words) is bool(edits)


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


def test_holes_and_islands_are_filled_like_what_they_are():
    """The hole of a floor is grey, and the part of the floor within it is white again, in this order."""
    sheet = drawn("island")
    fills = [
        (Polygon(item.points_mm).area / 1e6, item.fill)
        for item in sheet.views[0].entities
        if isinstance(item, Polyline) and item.layer == "A-OUTLINE"
    ]
    assert [(round(area), fill) for area, fill in fills] == [(80, None), (16, "#dcdcdc"), (4, "#ffffff")]


def test_notches_of_a_floor_are_filled_like_its_holes():
    """The missing quarter of an L-shaped floor is grey, as on the tag plans."""
    shape = box(0, 0, 4, 3).difference(box(2, 1, 4, 3))
    sheet = draw(make(pattern("square", pitch_m=0.3)), Site(name="notched", floor=shape))
    fills = [item for item in sheet.views[0].entities if isinstance(item, Polyline) and item.layer == "A-FILL"]
    assert [(Polygon(item.points_mm).area / 1e6, item.fill) for item in fills] == [(pytest.approx(4.0), "#dcdcdc")]
