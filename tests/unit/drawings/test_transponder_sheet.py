"""Where a transponder goes: from which corner it is measured, and that the drawing says the same as the layout."""

from dataclasses import replace

import ezdxf
import numpy as np
import pytest
from shapely.geometry import Point, Polygon, box

from layoutopt.antennas.crossed_loops import CrossedLoops
from layoutopt.drawings.dxf import model_offsets
from layoutopt.drawings.frame import TITLE_BLOCK_MM, TitleBlock, frame_box
from layoutopt.drawings.installation import write_transponder_sheets
from layoutopt.drawings.sheet import Box, Text
from layoutopt.drawings.sheet_set import Job, sheet_set
from layoutopt.drawings.text_boxes import text_box
from layoutopt.drawings.transponder_sheet import CORNER, measured_from, transponder_sheets
from layoutopt.geometry import turned
from layoutopt.layout import FloorTags, Layout, Transponder
from layoutopt.readers.finders import docking_antennas
from layoutopt.site import Site
from layoutopt.spec.reading import read_spec
from layoutopt.spec.template import built_in

BLOCK = TitleBlock(
    **dict.fromkeys(("legal_owner", "identification_number", "date_of_issue", "sheet_number"), "x"),
    **dict.fromkeys(("title", "approval_person", "creator", "document_type"), "x"),
)
ELL = Site(name="L", floor=Polygon([(1, -1), (13, -1), (13, 3), (6, 3), (6, 8), (1, 8)]))
WALLED = Site(name="walled", floor=box(0, 0, 8, 6), obstacles=(box(3, 0, 3.2, 5),))
ROUND = Site(name="round", floor=Point(2.0, 1.0).buffer(3.0))
SITES = {
    "L": (ELL, (11.5, 1.75)),
    "L, up": (ELL, (2.3, 6.5)),
    "walled": (WALLED, (2.5, 1.0)),
    "round": (ROUND, (2.0, 2.0)),
}


def layout(**places_m):
    """Return crossed antennas and transponders by name."""
    return Layout(
        floor_tags=FloorTags(zones=()),
        readers=(docking_antennas(antenna=CrossedLoops()),),
        transponders=tuple(Transponder(name=name, position_m=(*xy_m, 0.5)) for name, xy_m in places_m.items()),
    )


def sheet_of(site, place_m, **changes):
    """Return the sheet of one transponder."""
    (sheet,) = transponder_sheets(layout(dock=place_m), site, block=BLOCK, **changes)
    return sheet


def words_around(sheet):
    """Return what title block and notes say."""
    return " ".join(item.text for item in sheet.entities if isinstance(item, Text))


@pytest.mark.parametrize(
    ("site", "place_m", "corner_m"),
    [
        (ELL, (11.5, 1.75), (13.0, 3.0)),
        (ELL, (11.5, 0.75), (13.0, -1.0)),
        (ELL, (2.3, 6.5), (1.0, 8.0)),
        # The inner corner at (6, 3) is no corner of the room.
        (ELL, (5.8, 2.5), (6.0, 8.0)),
        # The corner of the floor behind the wall is not in sight.
        (WALLED, (3.5, 0.5), (8.0, 0.0)),
        (WALLED, (2.5, 0.5), (0.0, 0.0)),
    ],
)
def test_a_place_is_measured_from_the_nearest_corner_in_sight(site, place_m, corner_m):
    """By hand: corners of rooms alone, and none behind a wall."""
    found = measured_from(site, place_m)
    assert found.place_m == pytest.approx(corner_m)
    assert found.datum is (corner_m == site.datum_m)


STAIRS = Polygon([*((0.05 * ((n + 1) // 2), 0.05 * (n // 2)) for n in range(80)), (0.0, 2.0)])
TURNED = Polygon(turned(np.array([(0.0, 0.0), (4.0, 0.0), (4.0, 3.0), (0.0, 3.0)]), 0.3))


@pytest.mark.parametrize("floor", [STAIRS, TURNED])
def test_without_a_corner_to_lay_a_rule_along_the_datum_counts_and_is_to_be_set_out(floor):
    """Stairs of a map, and walls that run along neither axis."""
    site = Site(name="map", floor=floor)
    place_m = floor.representative_point().coords[0]
    assert measured_from(site, place_m).datum
    assert "set it out first" in words_around(sheet_of(site, place_m))


@pytest.mark.parametrize("name", SITES)
def test_dimensions_and_notes_say_where_the_transponder_is(name):
    """The numbers beside the floor and in the notes are the distances from the corner, in millimetres."""
    site, place_m = SITES[name]
    sheet = sheet_of(site, place_m)
    corner = measured_from(site, place_m)
    dx_mm, dy_mm = (1000.0 * (value - start) for value, start in zip(place_m, corner.place_m, strict=True))
    labels = [item.text for item in sheet.views[0].entities if isinstance(item, Text) and item.layer == "A-DIMS"]
    assert sorted(labels) == sorted(
        ["0", "0", f"{dx_mm:.1f}".removesuffix(".0"), f"{dy_mm:.1f}".removesuffix(".0")]
    )
    told = words_around(sheet)
    assert f"{abs(dx_mm):.0f} mm {'right' if dx_mm >= 0 else 'left'} and {abs(dy_mm):.0f} mm" in told
    assert "500 mm above the floor" in told
    names = [item.text for item in sheet.views[0].entities if isinstance(item, Text) and item.layer == "A-DATUM"]
    assert (CORNER in names) is not corner.datum


@pytest.mark.parametrize("name", SITES)
def test_all_words_lie_within_the_frame_and_off_the_title_block(name):
    """Nothing of the plan is cut off, and no note runs into the title block."""
    site, place_m = SITES[name]
    sheet = sheet_of(site, place_m, remarks=("A remark.",))
    frame = frame_box(sheet.paper)
    room = Box(frame.xmin, frame.ymin + TITLE_BLOCK_MM[1], frame.xmax, frame.ymax)
    view = sheet.views[0]
    for item in view.entities:
        if isinstance(item, Text):
            (place,) = view.on_paper(np.array([item.position_mm]))
            moved = replace(item, position_mm=(float(place[0]), float(place[1])))
            assert text_box(moved, 1).inside(room)
    (remark,) = [item for item in sheet.entities if isinstance(item, Text) and item.text == "A remark."]
    notes = [
        item for item in sheet.entities if isinstance(item, Text) and item.position_mm[0] == remark.position_mm[0]
    ]
    assert max(text_box(item, 1).xmax for item in notes) < frame.xmax - TITLE_BLOCK_MM[0]


def test_files_hold_the_place_of_each_transponder(tmp_path):
    """DXF is read back: a block a transponder with its name as an attribute, at its place in the floor frame."""
    places_m = {"dock": (11.5, 1.75), "gate": (2.3, 6.5)}
    both = layout(**places_m)
    spec = replace(read_spec(built_in()), site=ELL)
    paths = write_transponder_sheets(spec, both, tmp_path, title="L: transponder")
    names = [f"transponder{end}.{suffix}" for end in ("", "_2") for suffix in ("pdf", "svg", "dxf")]
    assert [path.name for path in paths] == names
    sheets = transponder_sheets(both, ELL, block=BLOCK)
    assert [sheet.number for sheet in sheets] == ["A-102", "A-103"]
    for path, sheet in zip((paths[2], paths[5]), sheets, strict=True):
        inserts = ezdxf.readfile(path).modelspace().query("INSERT")
        found = {name: item for item in inserts if (name := item.get_attrib_text("TRANSPONDER_ID"))}
        offset = np.array(model_offsets(sheet)[0])
        assert found.keys() == places_m.keys()
        for name, item in found.items():
            place_mm = np.array(item.dxf.insert)[:2] - offset
            assert place_mm == pytest.approx(1000.0 * np.array(places_m[name]), abs=1e-6)


def test_the_set_of_sheets_has_one_for_each_transponder():
    """It follows the key plan, and the cover lists it."""
    spec = read_spec(built_in())
    with_dock = next(iter(spec.space.layouts())).replace(transponders=layout(dock=(7.0, 4.0)).transponders)
    nothing = with_dock.floor_tags.lay_on(spec.site)
    job = Job(layout=with_dock, site=spec.site, robot=spec.robot, tag_map=nothing, title="ward")
    cover, key_plan, dock, *_ = sheet_set(job, tags=False)
    assert (key_plan.number, dock.number, dock.title) == ("A-101", "A-102", "Transponder: ward")
    assert any("A-102" in item.text for item in cover.entities if isinstance(item, Text))
