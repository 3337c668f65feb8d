"""The set of sheets: every tag on one plan and in one schedule, nothing overlaps, templates are true to size."""

import re
from dataclasses import replace
from itertools import pairwise

import ezdxf
import numpy as np
import pypdf
import pytest
from shapely.geometry import Polygon, box
from sheet_cases import ROBOT

from layoutopt.antennas.sphere import SphereAntenna
from layoutopt.drawings.cover_sheet import index_rows
from layoutopt.drawings.dxf import render_dxf
from layoutopt.drawings.fields import clipped, fields_of, tags_within
from layoutopt.drawings.frame import frame_box
from layoutopt.drawings.pdf import render_pdf
from layoutopt.drawings.sheet import PAPERS_MM, SCALES, Box, Line, Marks, Polyline, Sheet, Text
from layoutopt.drawings.sheet_set import CLOSEST_MM, Job, plan_scale, sheet_set
from layoutopt.drawings.tag_grid import tag_groups
from layoutopt.drawings.templates import CHECK_MM, OVERLAP_MM
from layoutopt.drawings.text_boxes import text_box
from layoutopt.errors import InvalidInput
from layoutopt.geometry import turned
from layoutopt.layout import EditKind, FloorTags, Layout, TagEdit, ZonePattern
from layoutopt.patterns.random import random
from layoutopt.patterns.square import square
from layoutopt.patterns.triangular import triangular
from layoutopt.protocols import Mount
from layoutopt.readers.cross import cross
from layoutopt.readers.profiles import COMMERCIAL
from layoutopt.site import Site, Tiling, Zone

MOUNT = Mount(antenna=SphereAntenna(side_m=0.06), height_m=0.02, profile=COMMERCIAL, antennas_per_module=4)
L_SHAPED = Site(
    name="L",
    floor=Polygon([(1, -1), (13, -1), (13, 3), (6, 3), (6, 8), (1, 8)]),
    obstacles=(box(3, 0, 4.3, 0.9), box(7.5, 1.2, 7.9, 2.2)),
    zones=(
        Zone(name="dock", region=box(1.2, -0.8, 2.4, 0.6), target_error_m=0.005),
        Zone(name="sluice", region=box(10, 0, 11, 1), tags=False, metal=True),
    ),
    tiling=Tiling(size_m=0.5, angle_rad=0.1),
)


def job(*zones, site=L_SHAPED, edits=()):
    """Return a job of a cross of eight antennas over patterns on zones."""
    layout = Layout(floor_tags=FloorTags(zones=zones, edits=edits), readers=(cross(count=8, mount=MOUNT),))
    return Job(
        layout=layout, site=site, robot=ROBOT, tag_map=layout.floor_tags.lay_on(site), title="Ward 5, ground floor"
    )


CASES = {
    "two patterns": job(
        ZonePattern(zone="", pattern=square(pitch_m=0.2)), ZonePattern(zone="dock", pattern=square(pitch_m=0.07))
    ),
    "turned": job(ZonePattern(zone="", pattern=triangular(pitch_m=0.4), angle_rad=0.2)),
    "random": job(ZonePattern(zone="", pattern=random(tile_m=0.5, radius_m=0.05, seed=3))),
    "dropped": job(
        ZonePattern(zone="", pattern=square(pitch_m=0.5)),
        edits=(
            TagEdit(kind=EditKind.DROPPED, from_m=(2.0, 2.0)),
            TagEdit(kind=EditKind.MOVED, from_m=(2.5, 2.0), to_m=(2.51, 2.03)),
        ),
    ),
}


@pytest.fixture(params=CASES, scope="module")
def case(request):
    """A job and its sheets."""
    return CASES[request.param], sheet_set(CASES[request.param])


def boxes_of(sheet):
    """Return text and box of all texts that the sheet shows; what a view cuts off is not there."""
    found = [(item.text, text_box(item)) for item in sheet.entities if isinstance(item, Text)]
    for view in sheet.views:
        ((dx, dy),) = view.on_paper(np.zeros((1, 2))).tolist()
        for item in view.entities:
            if isinstance(item, Text):
                xmin, ymin, xmax, ymax = text_box(item, view.scale)
                placed = Box(xmin + dx, ymin + dy, xmax + dx, ymax + dy)
                if placed.overlaps(view.window_mm):
                    found.append((item.text, placed))
    return found


def test_no_text_touches_another(case):
    """On no sheet of the set."""
    for sheet in case[1]:
        found = boxes_of(sheet)
        low, high = (np.array([tuple(item)[first : first + 2] for _, item in found]) for first in (0, 2))
        meet = (low[:, None, :] < high[None, :, :] - 1e-6) & (low[None, :, :] < high[:, None, :] - 1e-6)
        pairs = np.argwhere(np.triu(meet.all(axis=2), k=1))
        assert [(sheet.number, found[one][0], found[other][0]) for one, other in pairs[:5]] == []


def test_no_text_leaves_its_sheet_or_view(case):
    """What stands in a view of a plan stands in its window, everything else within the paper."""
    for sheet in case[1]:
        if sheet.number[0] == "T":
            # A template runs over its pages: a number on the edge of one is whole on the next.
            continue
        paper = Box(0.0, 0.0, *PAPERS_MM[sheet.paper])
        frame = frame_box(sheet.paper)
        boxes = boxes_of(sheet)
        assert [text for text, placed in boxes if not placed.inside(paper)] == []
        views = boxes[sum(isinstance(item, Text) for item in sheet.entities) :]
        assert [(sheet.number, text) for text, placed in views if not placed.inside(frame)] == []


def test_every_tag_is_on_one_plan_at_its_place(case):
    """The marks of all plans together are the tag map, identity by identity."""
    job, sheets = case
    found = {}
    for sheet in sheets:
        if not sheet.number.startswith("A-2"):
            continue
        (view,) = sheet.views
        (marks,) = [item for item in view.entities if isinstance(item, Marks) and item.layer == "A-TAGS"]
        for identity, place_mm in zip(marks.ids, marks.points_mm, strict=True):
            assert identity not in found
            found[identity] = place_mm
        assert Box(*marks.points_mm.min(axis=0), *marks.points_mm.max(axis=0)) or len(marks.points_mm) == 0
        placed = view.on_paper(marks.points_mm)
        assert (placed > np.array(view.window_mm[:2])).all()
        assert (placed < np.array(view.window_mm[2:])).all()
    assert sorted(map(int, found)) == job.tag_map.ids.tolist()
    places_mm = np.array([found[str(identity)] for identity in job.tag_map.ids.tolist()])
    np.testing.assert_allclose(places_mm, job.tag_map.xy_m * 1000.0, rtol=0, atol=1e-6)


def test_every_tag_is_in_the_schedule_with_its_distances_from_the_datum(case):
    """Row by row, whatever plan it is on."""
    job, sheets = case
    rows = {}
    for sheet in sheets:
        if sheet.number[0] != "S":
            continue
        lines = {}
        for item in sheet.entities:
            if isinstance(item, Text) and item.position_mm[1] > 60.0:
                lines.setdefault(round(item.position_mm[1], 3), []).append((item.position_mm[0], item.text))
        for cells in lines.values():
            words = [text for _, text in sorted(cells)]
            for place, word in enumerate(words):
                if word in ("planned", "moved"):
                    start = place - 4 if job.site.tiling is not None else place - 3
                    rows[int(words[start])] = (float(words[start + 1]), float(words[start + 2]))
    assert sorted(rows) == job.tag_map.ids.tolist()
    for identity, place_m in zip(job.tag_map.ids.tolist(), job.tag_map.xy_m, strict=True):
        expected_mm = (place_m - job.site.datum_m) * 1000.0
        assert rows[identity] == pytest.approx(tuple(expected_mm), abs=0.051)


def test_numbers_of_sheets_differ_and_the_cover_lists_them(case):
    """Each sheet once; first and last of each row of the index are sheets of the set."""
    _, sheets = case
    numbers = [sheet.number for sheet in sheets]
    assert len(set(numbers)) == len(numbers)
    assert numbers[:2] == ["G-001", "A-101"]
    words = " ".join(item.text for item in sheets[0].entities if isinstance(item, Text))
    named = re.findall(r"\b[A-Z]-\d{3}(?:-[A-Z]?\d+)?", words)
    assert {number for number in named} - {"R-101"} <= set(numbers)
    assert numbers[-1] in named


def test_plans_are_at_a_scale_of_iso_5455_with_tags_apart(case):
    """As coarse as the tags allow."""
    job, sheets = case
    groups = tag_groups(job.layout, job.site, job.tag_map)
    scale = plan_scale(groups)
    assert scale in SCALES
    closest_mm = min(group.spacing_mm for group in groups)
    assert closest_mm >= CLOSEST_MM * scale or scale == 10
    assert {sheet.views[0].scale for sheet in sheets if sheet.number.startswith("A-2")} == {scale}
    assert {sheet.views[0].scale for sheet in sheets if sheet.number[0] == "T"} == {1}


def test_templates_have_two_bars_of_100_mm_and_cover_each_other(case):
    """Both check bars on every page; neighbours share the overlap, so registration crosses meet."""
    _, sheets = case
    pages = [sheet for sheet in sheets if sheet.number[0] == "T"]
    assert pages
    for sheet in pages:
        lines = [item for item in sheet.entities if isinstance(item, Line)]
        spans = [np.abs(np.subtract(item.end_mm, item.start_mm)) for item in lines]
        assert sum(np.allclose(span, (CHECK_MM, 0.0)) for span in spans) == 1
        assert sum(np.allclose(span, (0.0, CHECK_MM)) for span in spans) == 1
        (crosses,) = [
            item for item in sheet.views[0].entities if isinstance(item, Marks) and item.kind == "registration"
        ]
        window = sheet.views[0].window_mm
        placed = sheet.views[0].on_paper(crosses.points_mm)
        inside = ((placed > window[:2]) & (placed < window[2:])).all(axis=1)
        assert inside.sum() == 4
        gaps = np.abs(placed[inside] - np.array([window[:2], window[2:]])[:, None, :]).min(axis=0)
        np.testing.assert_allclose(gaps, OVERLAP_MM / 2.0, atol=1e-9)


def test_the_robot_template_has_every_antenna_at_true_size_as_seen_from_below():
    """The marks of its pages are the poses of the layout in millimetres, left and right exchanged."""
    case = CASES["turned"]
    readers = replace(
        case.layout.readers[0], poses=case.layout.readers[0].poses + np.array([0.01, 0.03, 0.0, 0.2])
    )
    case = replace(case, layout=case.layout.replace(readers=(readers,)))
    pages = [sheet for sheet in sheet_set(case, tags=False) if "Robot seen" in sheet.title]
    shown = pages[0].views[0].entities
    (marks,) = [item for item in shown if isinstance(item, Marks) and item.kind == "antenna"]
    np.testing.assert_allclose(marks.points_mm, readers.poses[:, :2] * (1000.0, -1000.0), atol=1e-9)
    (outline,) = [item for item in shown if isinstance(item, Polyline) and item.layer == "A-ROBOT"]
    assert Polygon(outline.points_mm).equals(Polygon(ROBOT.outline_m * (1000.0, -1000.0)))
    seen = np.zeros(len(marks.points_mm), dtype=bool)
    for sheet in pages:
        window = sheet.views[0].window_mm
        placed = sheet.views[0].on_paper(marks.points_mm)
        seen |= ((placed > window[:2]) & (placed < window[2:])).all(axis=1)
    assert seen.all()


def test_an_area_gets_its_plans_only():
    """The fields that meet it, with the numbers that they have in the whole set."""
    case = CASES["two patterns"]
    everything = {sheet.number: sheet for sheet in sheet_set(case)}
    part = [sheet for sheet in sheet_set(case, area_m=(11.0, -1.0, 12.5, 0.0)) if sheet.number.startswith("A-2")]
    assert 0 < len(part) < sum(number.startswith("A-2") for number in everything)
    for sheet in part:
        assert sheet.views[0].entities[0] == everything[sheet.number].views[0].entities[0]
    with pytest.raises(InvalidInput, match="no tag in it"):
        sheet_set(case, area_m=(100.0, 100.0, 101.0, 101.0))


def test_fields_cover_the_floor_once():
    """Equal rectangles that share borders only; none without floor."""
    fields = fields_of(L_SHAPED, (3.3, 2.5))
    area_m2 = sum(L_SHAPED.floor.intersection(box(*field.bounds_m)).area for field in fields)
    assert area_m2 == pytest.approx(L_SHAPED.floor.area)
    sizes = {(round(f.bounds_m[2] - f.bounds_m[0], 9), round(f.bounds_m[3] - f.bounds_m[1], 9)) for f in fields}
    assert len(sizes) == 1
    for field in fields:
        part = clipped(L_SHAPED, field.bounds_m)
        assert part.floor.area == pytest.approx(L_SHAPED.floor.intersection(box(*field.bounds_m)).area)
    tags = CASES["two patterns"].tag_map
    rows = np.concatenate([tags_within(tags, field.bounds_m, L_SHAPED) for field in fields])
    assert sorted(rows.tolist()) == list(range(len(tags)))


def test_rows_and_columns_keep_their_labels_on_every_plan():
    """Column 1 is on the plan at the datum only; labels run on over the plans of a row."""
    case = CASES["dropped"]
    site = replace(L_SHAPED, floor=box(0, 0, 40, 3), obstacles=(), zones=())
    wide = job(ZonePattern(zone="", pattern=square(pitch_m=0.5)), site=site)
    plans = [sheet for sheet in sheet_set(wide) if sheet.number.startswith("A-2")]
    assert len(plans) >= 3
    assert case.layout.floor_tags.edits
    labels = []
    for sheet in plans:
        texts = [item for item in sheet.views[0].entities if isinstance(item, Text) and item.layer == "A-DIMS"]
        labels.append([int(item.text) for item in texts if item.text.isdigit() and item.anchor == "middle"])
    assert labels[0][0] == 1
    for before, after in pairwise(labels):
        assert after[0] >= before[-1]


def test_files_of_a_set_are_sound(tmp_path):
    """The PDF has a page for each sheet and the same bytes twice; the DXF of a plan passes its audit."""
    sheets = [sheet for sheet in sheet_set(CASES["dropped"]) if sheet.number in ("A-201", "T-101-A1")]
    assert len(sheets) == 2
    for name in ("first.pdf", "second.pdf"):
        render_pdf(sheets, tmp_path / name)
    assert (tmp_path / "first.pdf").read_bytes() == (tmp_path / "second.pdf").read_bytes()
    pages = pypdf.PdfReader(tmp_path / "first.pdf").pages
    assert len(pages) == len(sheets)
    assert "A-201" in pages[0].extract_text()
    render_dxf(sheets[0], tmp_path / "plan.dxf")
    document = ezdxf.readfile(tmp_path / "plan.dxf")
    assert not document.audit().has_errors
    blocks = document.modelspace().query("INSERT[layer=='A-TAGS']")
    places = {int(item.attribs[0].dxf.text): (item.dxf.insert.x, item.dxf.insert.y) for item in blocks}
    tags = CASES["dropped"].tag_map
    for identity, place_mm in places.items():
        row = tags.ids.tolist().index(identity)
        assert place_mm == pytest.approx(tuple(1000.0 * tags.xy_m[row]), abs=0.1)
    assert len(places) > 10


def texts_of(sheet):
    """Return all texts of a sheet, those of its views too."""
    return [
        item.text
        for item in (*sheet.entities, *(i for v in sheet.views for i in v.entities))
        if isinstance(item, Text)
    ]


def test_no_text_lies_on_a_centring_mark(case):
    """The marks of ISO 5457 reach 10 mm into the drawing."""
    for sheet in case[1]:
        marks = [item for item in sheet.entities if isinstance(item, Line) and item.layer == "A-FRAME"]
        assert len(marks) == (0 if sheet.number[0] == "T" else 4)
        boxes = boxes_of(sheet)
        for mark in marks:
            low, high = np.minimum(mark.start_mm, mark.end_mm), np.maximum(mark.start_mm, mark.end_mm)
            assert [text for text, placed in boxes if placed.overlaps(Box(*low, *high))] == []


def test_the_datum_is_drawn_on_key_plan_and_first_plan_only(case):
    """At the corner from which all dimensions run."""
    job, sheets = case
    drawn = {
        sheet.number: item.points_mm.tolist()
        for sheet in sheets
        for view in sheet.views
        for item in view.entities
        if isinstance(item, Marks) and item.kind == "datum"
    }
    assert drawn == {number: [[1000.0, -1000.0]] for number in ("A-101", "A-201")}
    assert job.site.datum_m == (1.0, -1.0)


def test_a_plan_with_a_tag_without_number_says_so(case):
    """Whether a whole group has none, or the name of a zone stands in the place of some."""
    for sheet in case[1]:
        if sheet.number.startswith("A-2"):
            items = sheet.views[0].entities
            numbers = sum(isinstance(item, Text) and item.layer == "A-TAGS-ID" for item in items)
            (tags,) = [item for item in items if isinstance(item, Marks) and item.layer == "A-TAGS"]
            told = "Tags without a number here: see the schedule or tags.csv." in texts_of(sheet)
            assert told == (numbers < len(tags.points_mm))


def test_the_cover_tells_tolerances_and_two_points_to_measure_from():
    """In words that are filled in."""
    words = " ".join(texts_of(sheet_set(CASES["turned"], tags=False)[0]))
    for said in ("tag centres ±5 mm", "antenna centres ±1 mm", "from the datum is at x 12000, y 4000"):
        assert said in words
    assert "{" not in words


def test_a_pattern_that_repeats_late_has_no_template_and_the_cover_says_so():
    """Nine random tiles of 0.5 m would take hundreds of pages."""
    sheets = sheet_set(CASES["random"], tags=False)
    assert {sheet.title for sheet in sheets if sheet.number[0] == "T"} == {"Template 1:1: Robot seen from below"}
    assert any("No template of floor" in text for text in texts_of(sheets[0]))


def test_notes_of_many_zones_keep_clear_of_the_title_block():
    """What a layout of sixty zones is called is cut; what has no room is said to be elsewhere."""
    zones = [Zone(name=f"zone_{place}", region=box(place, 0, place + 0.9, 2)) for place in range(60)]
    site = Site(name="s", floor=box(0, 0, 60, 2), zones=tuple(zones))
    many = job(*(ZonePattern(zone=zone.name, pattern=square(pitch_m=0.3)) for zone in zones), site=site)
    cover = sheet_set(replace(many, notes=("word " * 100,) * 12), tags=False)[0]
    found = boxes_of(cover)
    (title,) = [placed for text, placed in found if text == "Legal owner"]
    assert [text for text, placed in found if placed.overlaps(title) and text != "Legal owner"] == []
    assert any("more notes than have room" in text for text in texts_of(cover))


def test_a_template_of_a_turned_pattern_has_tags_as_they_lie():
    """Turned back onto the floor, the longer side of each is along x; zones of one pattern share a template."""
    pattern = triangular(pitch_m=0.1)
    turned_job = job(
        ZonePattern(zone="", pattern=pattern, angle_rad=0.2),
        ZonePattern(zone="dock", pattern=pattern, angle_rad=0.2),
    )
    pages = [sheet for sheet in sheet_set(turned_job, tags=False) if sheet.number.startswith("T-101")]
    assert {sheet.title for sheet in pages} == {"Template 1:1: Tags of floor, dock"}
    tags = [item for item in pages[0].views[0].entities if isinstance(item, Polyline) and item.layer == "A-TAGS"]
    assert len(tags) > 4
    for tag in tags:
        size_mm = np.ptp(turned(tag.points_mm, 0.2), axis=0)
        np.testing.assert_allclose(size_mm, np.array(turned_job.layout.floor_tags.tag_size_m) * 1000.0)


def test_an_index_of_many_titles_ends_in_one_row():
    """No row of it runs into the revisions, and the last sheet is named."""
    sheets = [Sheet(title=f"Template {number}", paper="A3", number=f"T-{number}") for number in range(60)]
    rows = index_rows(sheets, 5)
    assert len(rows) == 5
    assert rows[-1] == ("T-4 to T-59", "Template 4, and 55 more")
    assert index_rows(sheets[:5], 5)[-1] == ("T-4", "Template 4")
