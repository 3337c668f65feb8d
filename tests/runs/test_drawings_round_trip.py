"""What is written for the installer is read back, file by file, and compared with the layout it came from."""

import csv
import re
import xml.etree.ElementTree as ElementTree

import ezdxf
import numpy as np
import pypdf
import pytest
import yaml
from pypdf.generic import ContentStream

from layoutopt import registry
from layoutopt.drawings.dxf import model_offsets, render_dxf
from layoutopt.drawings.layout_sheet import layout_sheet
from layoutopt.drawings.pdf import render_pdf
from layoutopt.drawings.sheet import Marks
from layoutopt.drawings.sheet_set import Job, sheet_set
from layoutopt.drawings.svg import render_svg
from layoutopt.layout import FloorTags, Layout, ZonePattern
from layoutopt.spec.reading import read_spec
from layoutopt.spec.template import built_in
from layoutopt.tables.readers import antenna_rows, read_readers_yaml, write_readers_yaml
from layoutopt.tables.tag_files import read_tag_file, tag_header, write_tag_files
from layoutopt.tables.tags import tag_rows

MM = 25.4 / 72.0
SVG = "{http://www.w3.org/2000/svg}"
XLINK = "{http://www.w3.org/1999/xlink}"
SPEC = read_spec(built_in())
FILES = ("sheet.pdf", "sheet.svg", "sheet.dxf", "tags.csv", "readers.yaml")


def square(pitch_m):
    return registry.load("patterns", "square")(pitch_m=pitch_m)


def triangular(pitch_m):
    return registry.load("patterns", "triangular")(pitch_m=pitch_m)


LAYOUTS = {
    "coarse": FloorTags(
        zones=(ZonePattern(zone="", pattern=square(0.27)), ZonePattern(zone="dock", pattern=triangular(0.12)))
    ),
    "staggered": FloorTags(zones=(ZonePattern(zone="", pattern=triangular(0.4), angle_rad=0.1),)),
}


def write(folder, floor_tags):
    """Write everything an installer gets and return the layout, its tag map and the sheet."""
    layout = Layout(floor_tags=floor_tags, readers=next(SPEC.space.layouts()).readers)
    tag_map = layout.floor_tags.lay_on(SPEC.site)
    sheet = layout_sheet(layout=layout, site=SPEC.site, robot=SPEC.robot, tag_map=tag_map, title="Tags & readers")
    folder.mkdir()
    render_pdf(sheet, folder / "sheet.pdf")
    render_svg(sheet, folder / "sheet.svg")
    render_dxf(sheet, folder / "sheet.dxf")
    header = tag_header(layout, SPEC.site, len(tag_map))
    write_tag_files(folder, header, tag_rows(tag_map, SPEC.site, layout.floor_tags.tag_part))
    write_readers_yaml(folder / "readers.yaml", layout)
    return layout, tag_map, sheet


@pytest.fixture(scope="module", params=LAYOUTS)
def written(request, tmp_path_factory):
    """The folder of one layout, with the layout, its tag map and the sheet."""
    folder = tmp_path_factory.mktemp("drawings") / "first"
    return folder, *write(folder, LAYOUTS[request.param])


@pytest.fixture(scope="module")
def dxf(written):
    """The DXF of the layout, read."""
    return ezdxf.readfile(written[0] / "sheet.dxf")


@pytest.fixture(scope="module")
def pdf(written):
    """The PDF of the layout, read."""
    return pypdf.PdfReader(written[0] / "sheet.pdf")


def on_paper(sheet, tag_map):
    """Return where the scale of the sheet puts the tags, in mm from the lower left corner."""
    view = sheet.views[0]
    return (tag_map.xy_m * 1000.0 - view.origin_mm) / view.scale + view.at_mm


def test_dxf_is_sound_and_holds_every_tag_to_a_tenth_of_a_millimetre(written, dxf):
    """The audit finds nothing; blocks in model space are the tag map, identity by identity."""
    _, _, tag_map, _ = written
    auditor = dxf.audit()
    assert not auditor.has_errors
    assert not auditor.fixes
    found = {}
    for block in dxf.modelspace().query("INSERT[layer=='A-TAGS']"):
        (attribute,) = block.attribs
        assert attribute.dxf.tag == "TAG_ID"
        found[int(attribute.dxf.text)] = (block.dxf.insert.x, block.dxf.insert.y)
    assert sorted(found) == tag_map.ids.tolist()
    places_mm = np.array([found[identity] for identity in tag_map.ids.tolist()])
    np.testing.assert_allclose(places_mm, tag_map.xy_m * 1000.0, rtol=0, atol=0.1)


def test_dxf_holds_every_antenna_in_base_link(written, dxf):
    """Blocks of antennas, less the offset of their view, are the poses of the layout."""
    _, layout, _, sheet = written
    shift_mm = model_offsets(sheet)[1]
    blocks = dxf.modelspace().query("INSERT[layer=='A-READERS']")
    found = {int(block.attribs[0].dxf.text): np.array(block.dxf.insert)[:2] - shift_mm for block in blocks}
    for row in antenna_rows(layout):
        assert found.pop(row.antenna) == pytest.approx((1000.0 * row.x_m, 1000.0 * row.y_m), abs=0.1)
    assert not found


def test_svg_puts_every_tag_at_its_place_at_scale(written):
    """The SVG repeats the tag symbol once for each tag, at its place on the paper to 0.01 mm."""
    folder, _, tag_map, sheet = written
    root = ElementTree.parse(folder / "sheet.svg").getroot()
    height_pt = float(root.get("viewBox").split()[3])
    (group,) = [g for g in root.iter(f"{SVG}g") if re.fullmatch(r"view1-A-TAGS-\d+", g.get("id", ""))]
    uses = [(float(use.get("x")) * MM, (height_pt - float(use.get("y"))) * MM) for use in group.iter(f"{SVG}use")]
    assert len(uses) == len(tag_map)
    np.testing.assert_allclose(np.array(uses), on_paper(sheet, tag_map), rtol=0, atol=0.01)


def painted(page, document, count):
    """Return where a page paints the symbol that it paints ``count`` times, in mm from the lower left corner."""
    placed = {}
    corner = np.zeros(2)
    for operands, operator in ContentStream(page.get_contents(), document).operations:
        if operator in (b"q", b"Q"):
            corner = np.zeros(2)
        elif operator == b"cm":
            corner = corner + [float(value) for value in operands[4:6]]
        elif operator == b"Do":
            placed.setdefault(str(operands[0]), []).append(corner * MM)
    (found,) = [places for places in placed.values() if len(places) == count]
    return np.array(found)


def test_pdf_puts_every_tag_at_its_place_at_scale(written, pdf):
    """The PDF paints the tag symbol once for each tag, at its place on the paper to 0.01 mm."""
    _, _, tag_map, sheet = written
    page = pdf.pages[0]
    assert (float(page.mediabox.width) * MM, float(page.mediabox.height) * MM) == pytest.approx(
        sheet.size_mm, abs=0.01
    )
    np.testing.assert_allclose(painted(page, pdf, len(tag_map)), on_paper(sheet, tag_map), rtol=0, atol=0.01)


@pytest.mark.parametrize("written", ["coarse"], indirect=True)
def test_the_tag_plans_of_a_pdf_hold_every_tag_to_a_tenth_of_a_millimetre(written, tmp_path):
    """All plans of the set together, brought back from the paper by the scale, are the tag map."""
    _, layout, tag_map, _ = written
    job = Job(layout=layout, site=SPEC.site, robot=SPEC.robot, tag_map=tag_map, title="Tags")
    plans = [item for item in sheet_set(job) if item.number.startswith("A-2")]
    render_pdf(plans, tmp_path / "plans.pdf")
    document = pypdf.PdfReader(tmp_path / "plans.pdf")
    found = []
    for page, plan in zip(document.pages, plans, strict=True):
        (view,) = plan.views
        (marks,) = [item for item in view.entities if isinstance(item, Marks) and item.layer == "A-TAGS"]
        paper_mm = painted(page, document, len(marks.points_mm))
        found.append((paper_mm - view.at_mm) * view.scale + view.origin_mm)
    places_mm = np.concatenate(found)
    order, wanted = (
        np.lexsort((np.round(xy[:, 0]), np.round(xy[:, 1]))) for xy in (places_mm, tag_map.xy_m * 1e3)
    )
    assert len(places_mm) == len(tag_map)
    np.testing.assert_allclose(places_mm[order], tag_map.xy_m[wanted] * 1000.0, rtol=0, atol=0.1)


def test_pdf_text_can_be_found_and_names_the_layout(written, pdf):
    """Key, scale, number of tags and file names can be searched in the PDF."""
    _, layout, tag_map, sheet = written
    text = pdf.pages[0].extract_text()
    for words in (layout.short_key, f"1:{sheet.views[0].scale}", f"{len(tag_map)} tags", "readers.yaml", "DATUM"):
        assert words in text


def test_tag_table_is_the_tag_map_for_us_and_for_plain_csv(written):
    """Both readers of tags.csv give every tag of the map, to the six decimals that are written."""
    folder, layout, tag_map, sheet = written
    rows = read_tag_file(folder / "tags.csv")
    expected = tag_rows(tag_map, SPEC.site, layout.floor_tags.tag_part)
    assert len(rows) == len(tag_map)
    for row, plan in zip(rows, expected, strict=True):
        assert (row.tag_id, row.tile, row.zone) == (plan.tag_id, plan.tile, plan.zone)
        assert (row.x_m, row.y_m) == pytest.approx((plan.x_m, plan.y_m), abs=5e-7)
    with (folder / "tags.csv").open(newline="", encoding="utf-8") as stream:
        plain = {int(row["tag_id"]): (float(row["x_m"]), float(row["y_m"])) for row in csv.DictReader(stream)}
    (drawn,) = [item for item in sheet.views[0].entities if isinstance(item, Marks) and item.layer == "A-TAGS"]
    for identity, place_mm in zip(drawn.ids, drawn.points_mm, strict=True):
        assert plain.pop(int(identity)) == pytest.approx(tuple(place_mm / 1000.0), abs=5e-7)
    assert not plain


def test_reader_table_is_the_layout_for_us_and_for_plain_yaml(written):
    """Both readers of readers.yaml give every antenna with pose, side, module and slot."""
    folder, layout, _, _ = written
    rows = read_readers_yaml(folder / "readers.yaml")
    poses = np.concatenate([group.poses for group in layout.readers])
    found = np.array([(row.x_m, row.y_m, row.z_m, row.yaw_rad) for row in rows])
    np.testing.assert_allclose(found, poses, rtol=0, atol=5e-7)
    assert [(row.module, row.slot) for row in rows] == [(row.module, row.slot) for row in antenna_rows(layout)]
    plain = yaml.safe_load((folder / "readers.yaml").read_text(encoding="utf-8"))
    assert (plain["frame_id"], plain["layout"]) == ("base_link", layout.key)
    places = [(antenna["x_m"], antenna["y_m"]) for antenna in plain["antennas"]]
    np.testing.assert_allclose(places, poses[:, :2], rtol=0, atol=5e-7)


@pytest.mark.parametrize("written", ["coarse"], indirect=True)
def test_second_run_gives_the_same_bytes(written, tmp_path):
    """Every file of a second run equals that of the first, byte for byte."""
    write(tmp_path / "second", LAYOUTS["coarse"])
    for name in FILES:
        assert (written[0] / name).read_bytes() == (tmp_path / "second" / name).read_bytes(), name
