"""PDF, SVG and DXF of one sheet: true scale, equal content, equal bytes, and no text that can break a file."""

import os
import re
import subprocess
import sys
import xml.etree.ElementTree as ElementTree
from pathlib import Path

import ezdxf
import matplotlib
import numpy as np
import pypdf
import pytest
from ezdxf.lldxf.encoding import decode_dxf_unicode, decode_mif_to_unicode
from ezdxf.tools.text import plain_text
from pypdf.generic import ContentStream

from layoutopt.drawings.canvas import figure
from layoutopt.drawings.dxf import model_offsets, render_dxf
from layoutopt.drawings.layers import PENS
from layoutopt.drawings.lettering import printable, single_line
from layoutopt.drawings.pdf import render_pdf
from layoutopt.drawings.sheet import PAPERS_MM, Box, Circle, Line, Marks, Polyline, Sheet, Text, View
from layoutopt.drawings.svg import render_svg

RENDERERS = {"pdf": render_pdf, "svg": render_svg, "dxf": render_dxf}
SVG = "{http://www.w3.org/2000/svg}"
MM = 25.4 / 72.0
TAGS_MM = np.array([[123.456789, 987.654321], [250.0, -0.0000004], [3333.333333, 1666.666667]])
HOSTILE = [
    r"$\frac{1}{0}$ and \$5",
    "two\nlines\r\x00\x1b[31m",
    "<script>&\"'</script> ]]> -->",
    r"%%u%%d%%% ^J^ \U+0041 \M+12345 {\P\L}",
    "half \ud800 pair \ufffe \u2028",
    "病棟 ward Ω",
    ")( \\ /Type >> endobj",
    "x" * 3000,
    "   ",
]


def plan(scale=50, entities=(), *, name="plan", at_mm=(60.0, 80.0), window_mm=None):
    return View(
        name=name,
        scale=scale,
        at_mm=at_mm,
        window_mm=window_mm or Box(30, 60, 400, 280),
        entities=tuple(entities),
    )


def metre(layer="A-OUTLINE"):
    return Line(layer=layer, start_mm=(0.0, 0.0), end_mm=(1000.0, 0.0))


def tags(**changes):
    fields = {
        "layer": "A-TAGS", "points_mm": TAGS_MM, "symbol": "target", "size_mm": 50.0, "ids": ("T1", "T2", "T3"),
    }  # fmt: skip
    return Marks(**(fields | changes))


@pytest.fixture
def full():
    """A sheet with two views, every kind of entity and paper texts."""
    room = Polyline(
        layer="A-OBSTACLE",
        points_mm=[(0, 0), (4000, 0), (4000, 3000), (0, 3000)],
        closed=True,
        fill="#dddddd",
    )
    column = Circle(layer="A-OBSTACLE", centre_mm=(2000, 1000), radius_mm=200, fill="#bbbbbb")
    label = Text(layer="A-ZONE", text="dock", position_mm=(500, 500), height_mm=3.5, anchor="middle", angle_deg=30)
    symbols = [
        tags(symbol=symbol, kind="reader", layer="A-READERS", ids=None)
        for symbol in ("ring", "disc", "square", "cross", "datum", "cross_square")
    ]
    floor = plan(50, [room, column, label, metre("A-GRID"), tags(), *symbols], window_mm=Box(30, 60, 200, 280))
    robot = plan(10, [metre("A-ROBOT")], name="robot", at_mm=(250.0, 100.0), window_mm=Box(210, 60, 400, 280))
    title = Text(layer="A-TITLE", text="Tag plan", position_mm=(30, 20), height_mm=5)
    return Sheet(title="Tag plan", paper="A3", views=(floor, robot), entities=(title,))


def operations(path, page=0):
    """Return the drawing operators of a PDF page as (operator, operands)."""
    reader = pypdf.PdfReader(path)
    content = ContentStream(reader.pages[page].get_contents(), reader)
    return [(operator.decode(), operands) for operands, operator in content.operations]


def pdf_lines(path):
    """Return the stroked two-point lines of a PDF page as ((x, y), (x, y)) in mm."""
    drawn = operations(path)
    return [
        tuple(tuple(float(value) * MM for value in drawn[place + step][1]) for step in (0, 1))
        for place in range(len(drawn) - 2)
        if [operator for operator, _ in drawn[place : place + 3]] == ["m", "l", "S"]
    ]


def svg_numbers(path, group):
    """Return the points of the path of one group of an SVG file, in mm from the lower left corner."""
    root = ElementTree.parse(path).getroot()
    height = float(root.get("viewBox").split()[3])
    (found,) = [g for g in root.iter(f"{SVG}g") if re.fullmatch(rf"{group}-\d+", g.get("id", ""))]
    numbers = [float(number) for number in re.findall(r"-?\d+\.?\d*", found.find(f"{SVG}path").get("d"))]
    return [(x * MM, (height - y) * MM) for x, y in zip(numbers[::2], numbers[1::2], strict=True)]


@pytest.mark.parametrize("scale", [1, 10, 50, 200])
def test_a_metre_is_a_metre_at_scale_in_pdf_and_svg(tmp_path, scale):
    """A 1000 mm line at 1:s is 1000/s mm long on paper, at the place the view says, to a thousandth."""
    sheet = Sheet(title="t", paper="A0", views=(plan(scale, [metre()], window_mm=Box(0, 0, 1189, 841)),))
    render_pdf(sheet, tmp_path / "a.pdf")
    render_svg(sheet, tmp_path / "a.svg")
    (in_pdf,) = pdf_lines(tmp_path / "a.pdf")
    in_svg = svg_numbers(tmp_path / "a.svg", "view1-A-OUTLINE")
    for start, end in (in_pdf, in_svg):
        assert start == pytest.approx((60.0, 80.0), abs=1e-3)
        assert end == pytest.approx((60.0 + 1000.0 / scale, 80.0), abs=1e-3)


@pytest.mark.parametrize("paper", list(PAPERS_MM))
def test_pages_have_exactly_the_size_of_the_paper(tmp_path, paper):
    """PDF page, SVG picture and DXF layout are as large as the ISO paper, so that printing at 100 % is true."""
    sheet = Sheet(title="t", paper=paper)
    for suffix, render in RENDERERS.items():
        render(sheet, tmp_path / f"a.{suffix}")
    box = pypdf.PdfReader(tmp_path / "a.pdf").pages[0].mediabox
    assert (float(box.width) * MM, float(box.height) * MM) == pytest.approx(PAPERS_MM[paper], abs=1e-3)
    root = ElementTree.parse(tmp_path / "a.svg").getroot()
    size = [float(root.get(side).removesuffix("pt")) * MM for side in ("width", "height")]
    assert size == pytest.approx(PAPERS_MM[paper], abs=1e-3)
    layout = ezdxf.readfile(tmp_path / "a.dxf").layouts.get(f"Sheet {paper}")
    assert (layout.dxf.paper_width, layout.dxf.paper_height) == PAPERS_MM[paper]
    assert layout.dxf.plot_paper_units == 1


def test_marks_lie_where_the_tags_are(tmp_path):
    """Every tag is printed at its coordinates over the scale, in PDF and in SVG, to 0.001 mm."""
    view = plan(20, [tags()], window_mm=Box(0, 0, 420, 297))
    sheet = Sheet(title="t", paper="A3", views=(view,))
    render_pdf(sheet, tmp_path / "a.pdf")
    render_svg(sheet, tmp_path / "a.svg")
    wanted = view.on_paper(TAGS_MM)
    uses = ElementTree.parse(tmp_path / "a.svg").getroot().iter(f"{SVG}use")
    in_svg = [(float(use.get("x")) * MM, 297.0 - float(use.get("y")) * MM) for use in uses]
    assert np.allclose(in_svg, wanted, atol=1e-3)
    pen, in_pdf = np.zeros(2), []
    for operator, operands in operations(tmp_path / "a.pdf"):
        if operator == "cm":
            pen = pen + [float(value) * MM for value in operands[4:]]
        elif operator == "Do":
            in_pdf.append(pen)
    assert np.allclose(in_pdf, wanted, atol=1e-3)


@pytest.mark.parametrize("layer", list(PENS))
def test_layer_alone_decides_the_pen_in_every_format(tmp_path, layer):
    """Line width and dashes of a layer are the same on paper in PDF, SVG and DXF."""
    pen = PENS[layer]
    sheet = Sheet(title="t", paper="A3", views=(plan(50, [metre(layer)]),))
    for suffix, render in RENDERERS.items():
        render(sheet, tmp_path / f"a.{suffix}")
    drawn = operations(tmp_path / "a.pdf")
    assert float([operands for operator, operands in drawn if operator == "w"][-1][0]) * MM == pytest.approx(
        pen.width_mm
    )
    dashes = [operands for operator, operands in drawn if operator == "d"]
    in_pdf = tuple(float(value) * MM for value in dashes[-1][0]) if dashes else ()
    assert in_pdf == pytest.approx(pen.dash_mm)
    style = re.search(
        rf'id="view1-{layer}-\d+">\s*<path [^>]*style="([^"]*)"', (tmp_path / "a.svg").read_text()
    ).group(1)
    settings = dict(part.split(": ") for part in style.split("; "))
    assert float(settings["stroke-width"]) * MM == pytest.approx(pen.width_mm, abs=1e-4)
    in_svg = [float(value) * MM for value in settings.get("stroke-dasharray", "").split(",") if value]
    assert in_svg == pytest.approx(list(pen.dash_mm), abs=1e-4)
    document = ezdxf.readfile(tmp_path / "a.dxf")
    entry = document.layers.get(layer)
    assert entry.dxf.lineweight == round(pen.width_mm * 100)
    tags_of = document.linetypes.get(entry.dxf.linetype).pattern_tags.tags
    assert [abs(tag.value) for tag in tags_of if tag.code == 49] == pytest.approx(list(pen.dash_mm))
    assert document.header["$PSLTSCALE"] == 1


def test_drawing_ends_at_the_window_of_its_view(tmp_path):
    """What leaves the window is cut off there in PDF and SVG, as a DXF viewport does."""
    sheet = Sheet(title="t", paper="A3", views=(plan(1, [metre()], window_mm=Box(30, 60, 130, 160)),))
    render_pdf(sheet, tmp_path / "a.pdf")
    render_svg(sheet, tmp_path / "a.svg")
    (clip,) = [operands for operator, operands in operations(tmp_path / "a.pdf") if operator == "re"]
    assert [float(value) * MM for value in clip] == pytest.approx([30, 60, 100, 100], abs=1e-3)
    (rectangle,) = ElementTree.parse(tmp_path / "a.svg").getroot().iter(f"{SVG}rect")
    size = [float(rectangle.get(name)) * MM for name in ("x", "y", "width", "height")]
    assert size == pytest.approx([30, 297 - 160, 100, 100], abs=1e-3)


def test_dxf_is_sound_and_in_millimetres(tmp_path, full):
    """A CAD program finds nothing to repair, and the file says that its unit is the millimetre."""
    render_dxf(full, tmp_path / "a.dxf")
    document = ezdxf.readfile(tmp_path / "a.dxf")
    audit = document.audit()
    assert (audit.errors, audit.fixes) == ([], [])
    assert document.header["$INSUNITS"] == 4
    assert document.header["$MEASUREMENT"] == 1


def test_dxf_viewports_have_exactly_the_scale_and_show_the_window(tmp_path, full):
    """Paper height over model height of each viewport is 1:scale, and its middle is the middle of the window."""
    render_dxf(full, tmp_path / "a.dxf")
    document = ezdxf.readfile(tmp_path / "a.dxf")
    ports = [port for port in document.layouts.get("Sheet A3").viewports() if port.dxf.id != 1]
    assert len(ports) == 2
    for port, view, shift in zip(ports, full.views, model_offsets(full), strict=True):
        assert port.dxf.view_height / port.dxf.height == pytest.approx(view.scale, rel=1e-12)
        assert (port.dxf.width, port.dxf.height) == (view.window_mm.width, view.window_mm.height)
        assert tuple(port.dxf.center)[:2] == view.window_mm.centre
        middle = np.array(view.in_world(view.window_mm.centre)) + shift
        assert tuple(port.dxf.view_center_point)[:2] == pytest.approx(tuple(middle), abs=1e-6)


def test_dxf_views_do_not_meet_in_model_space(tmp_path, full):
    """The first view keeps its coordinates; the second is moved by whole metres to beside the first."""
    render_dxf(full, tmp_path / "a.dxf")
    document = ezdxf.readfile(tmp_path / "a.dxf")
    first, second = model_offsets(full)
    assert first == (0.0, 0.0)
    assert second[0] % 1000 == 0
    floor, robot = full.views
    assert robot.in_world(robot.window_mm[:2])[0] + second[0] > floor.in_world(floor.window_mm[2:])[0]
    line = document.modelspace().query('LINE[layer=="A-ROBOT"]').first
    assert (line.dxf.start.x, line.dxf.end.x) == (second[0], second[0] + 1000.0)
    assert document.header.custom_vars.get("OFFSET_2") == f"robot, {second[0]:.0f}, 0"


def test_dxf_tags_are_blocks_with_their_identity(tmp_path):
    """Every tag is an INSERT at its true place, to 1e-6 mm, and its one attribute holds its identity."""
    moved = plan(10, [tags()], name="second", at_mm=(250, 100), window_mm=Box(210, 60, 400, 280))
    sheet = Sheet(title="t", paper="A3", views=(plan(50, [metre()], window_mm=Box(30, 60, 200, 280)), moved))
    render_dxf(sheet, tmp_path / "a.dxf")
    shift = model_offsets(sheet)[1]
    assert shift[0] > 0
    references = ezdxf.readfile(tmp_path / "a.dxf").modelspace().query("INSERT")
    assert [reference.dxf.name for reference in references] == ["TAG_TARGET"] * 3
    for reference, identity, point in zip(references, ("T1", "T2", "T3"), TAGS_MM, strict=True):
        assert tuple(reference.dxf.insert)[:2] == pytest.approx(tuple(point + shift), abs=1e-6)
        assert reference.dxf.layer == "A-TAGS"
        assert reference.dxf.xscale == 50.0
        (attribute,) = reference.attribs
        assert (attribute.dxf.tag, attribute.dxf.text) == ("TAG_ID", identity)
        assert attribute.is_invisible


def test_dxf_texts_have_their_printed_height_through_the_viewport(tmp_path, full):
    """A text of a 1:50 view is 50 times its paper height in model space; a paper text has its own height."""
    render_dxf(full, tmp_path / "a.dxf")
    document = ezdxf.readfile(tmp_path / "a.dxf")
    assert document.modelspace().query("TEXT").first.dxf.height == 3.5 * 50
    assert document.layouts.get("Sheet A3").query("TEXT").first.dxf.height == 5.0


def test_all_formats_hold_the_same_things(tmp_path, full):
    """Number of tags, texts and filled areas agree between SVG and DXF."""
    render_svg(full, tmp_path / "a.svg")
    render_dxf(full, tmp_path / "a.dxf")
    root = ElementTree.parse(tmp_path / "a.svg").getroot()
    document = ezdxf.readfile(tmp_path / "a.dxf")
    model, paper = document.modelspace(), document.layouts.get("Sheet A3")
    fills = [g for g in root.iter(f"{SVG}g") if "-fill-" in g.get("id", "")]
    assert len(fills) == len(model.query("HATCH")) == 2
    texts = sorted(element.text for element in root.iter(f"{SVG}text"))
    assert texts == sorted(text.dxf.text for space in (model, paper) for text in space.query("TEXT"))
    tag_group = [g for g in root.iter(f"{SVG}g") if re.fullmatch(r"view1-A-TAGS-\d+", g.get("id", ""))]
    assert len(list(tag_group[0].iter(f"{SVG}use"))) == len(model.query('INSERT[layer=="A-TAGS"]')) == 3


@pytest.mark.parametrize("suffix", RENDERERS)
def test_second_run_gives_the_same_bytes(tmp_path, full, suffix):
    """Equal sheets give equal files, so that a drawing set can be compared and kept under version control."""
    RENDERERS[suffix](full, tmp_path / "first")
    RENDERERS[suffix](full, tmp_path / "second")
    assert (tmp_path / "first").read_bytes() == (tmp_path / "second").read_bytes()


def test_other_processes_give_the_same_bytes(tmp_path):
    """Neither the order of sets, which changes from process to process, nor the date may enter a file."""
    code = (
        "import sys; from layoutopt.drawings.sheet import *\n"
        "from layoutopt.drawings.dxf import render_dxf; from layoutopt.drawings.pdf import render_pdf\n"
        "from layoutopt.drawings.svg import render_svg\n"
        "marks = Marks(layer='A-TAGS', points_mm=[(0, 0), (10, 10)], symbol='target', size_mm=5, ids=('a', 'b'))\n"
        "label = Text(layer='A-TITLE', text='Plan ±', position_mm=(9, 9), height_mm=5)\n"
        "view = place_view('v', [marks], scale=1, room_mm=Box(30, 30, 90, 90))\n"
        "sheet = Sheet(title='t', paper='A4', views=(view,), entities=(label,))\n"
        "render_dxf(sheet, sys.argv[1] + '.dxf'); render_pdf(sheet, sys.argv[1] + '.pdf')\n"
        "render_svg(sheet, sys.argv[1] + '.svg')"
    )
    for seed in ("0", "3", "4"):
        environment = os.environ | {"PYTHONHASHSEED": seed}
        subprocess.run([sys.executable, "-c", code, str(tmp_path / seed)], check=True, env=environment)
    for suffix in RENDERERS:
        contents = {(tmp_path / f"{seed}.{suffix}").read_bytes() for seed in ("0", "3", "4")}
        assert len(contents) == 1, suffix


def test_settings_of_the_user_neither_change_nor_are_changed(tmp_path, full):
    """A user's matplotlibrc or ezdxf options must not move a line, and are the same after rendering as before."""
    from ezdxf import options

    for suffix, render in RENDERERS.items():
        render(full, tmp_path / f"plain.{suffix}")
    changes = {"font.size": 30, "lines.scale_dashes": True, "pdf.use14corefonts": True, "pdf.compression": 0}
    with matplotlib.rc_context(changes):
        for suffix, render in RENDERERS.items():
            render(full, tmp_path / f"changed.{suffix}")
        assert {name: matplotlib.rcParams[name] for name in changes} == changes
    assert options.write_fixed_meta_data_for_testing is False
    for suffix in RENDERERS:
        assert (tmp_path / f"plain.{suffix}").read_bytes() == (tmp_path / f"changed.{suffix}").read_bytes()


@pytest.mark.parametrize("words", HOSTILE)
def test_hostile_words_stay_words(tmp_path, words):
    """No title or identity, whatever its characters, breaks a file or is taken for markup."""
    named = tags(points_mm=TAGS_MM[:1], ids=(words,))
    label = Text(layer="A-TITLE", text=words, position_mm=(30, 30), height_mm=3)
    sheet = Sheet(title=words, paper="A3", views=(plan(50, [named, label], name=words),), entities=(label,))
    for suffix, render in RENDERERS.items():
        render(sheet, tmp_path / f"a.{suffix}")
    clean = single_line(words)
    visible = [clean] * 2 if clean.strip() else []
    texts = [element.text for element in ElementTree.parse(tmp_path / "a.svg").getroot().iter(f"{SVG}text")]
    assert texts == [printable(text) for text in visible]
    document = ezdxf.readfile(tmp_path / "a.dxf")
    assert not document.audit().errors
    spaces = (document.modelspace(), document.layouts.get("Sheet A3"))
    assert [shown(entity) for space in spaces for entity in space.query("TEXT")] == visible
    assert shown(document.modelspace().query("INSERT").first.attribs[0]) == clean
    reader = pypdf.PdfReader(tmp_path / "a.pdf")
    assert reader.metadata.title == clean
    letters = "".join(printable(clean).split())
    assert "".join(reader.pages[0].extract_text().split()).count(letters) == (2 if letters else 1)


def shown(entity):
    """Return what a CAD program shows: codes of %% and ^ resolved, \\M+ and \\U+ codes decoded once."""
    return decode_dxf_unicode(decode_mif_to_unicode(plain_text(entity.dxf.text)))


@pytest.mark.parametrize("suffix", RENDERERS)
def test_failed_rendering_leaves_the_old_file_and_no_other(tmp_path, full, monkeypatch, suffix):
    """When rendering fails half way, what was there stays whole and no temporary file remains."""
    target = tmp_path / f"a.{suffix}"
    target.write_bytes(b"old")

    def fail(*_, **__):
        raise OSError("disk full")

    monkeypatch.setattr("matplotlib.figure.Figure.savefig", fail)
    monkeypatch.setattr("ezdxf.document.Drawing.saveas", fail)
    with pytest.raises(OSError, match="disk full"):
        RENDERERS[suffix](full, target)
    assert target.read_bytes() == b"old"
    assert [path.name for path in tmp_path.iterdir()] == [target.name]


@pytest.mark.parametrize("suffix", RENDERERS)
def test_missing_folder_is_an_error_of_the_file_system(tmp_path, full, suffix):
    """A folder that does not exist gives the usual error, not a file somewhere else."""
    with pytest.raises(FileNotFoundError):
        RENDERERS[suffix](full, tmp_path / "missing" / "a")


def test_a_set_of_sheets_becomes_the_pages_of_one_pdf(tmp_path, full):
    """Pages keep their order and their own paper size; an empty set is refused and writes nothing."""
    cover = Sheet(title="Cover", paper="A4")
    render_pdf([cover, full], tmp_path / "set.pdf")
    pages = pypdf.PdfReader(tmp_path / "set.pdf").pages
    assert [round(float(page.mediabox.width) * MM) for page in pages] == [297, 420]
    with pytest.raises(ValueError, match="at least one"):
        render_pdf([], tmp_path / "none.pdf")
    assert not Path(tmp_path / "none.pdf").exists()


def test_effort_does_not_grow_with_an_artist_for_each_tag():
    """Twenty thousand tags are one collection, otherwise a floor of that size would take minutes."""
    places = np.random.default_rng(1).uniform(0, 15000, (20_000, 2))
    sheet = Sheet(title="t", paper="A3", views=(plan(50, [tags(points_mm=places, ids=None)]),))
    assert len(figure(sheet).get_children()) <= 3


def test_small_tags_are_printed_at_their_least_size(tmp_path):
    """A 20 mm tag at 1:100 would be a dot: it is printed at the stated least size, never below its true one."""
    small = tags(size_mm=20.0, printed_mm=1.0)
    assert small.drawn_size_mm(100) == 100.0
    assert small.drawn_size_mm(10) == 20.0
    render_dxf(Sheet(title="t", paper="A3", views=(plan(100, [small]),)), tmp_path / "a.dxf")
    reference = ezdxf.readfile(tmp_path / "a.dxf").modelspace().query("INSERT").first
    assert reference.dxf.xscale == 100.0
