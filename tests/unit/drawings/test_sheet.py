"""The sheet model: scales, papers, validation, lettering and where texts lie."""

import math
import pickle
import subprocess
import sys
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from layoutopt.drawings.lettering import capital_em, fit_text, points, printable, single_line, width_mm
from layoutopt.drawings.sheet import (
    ANCHORS,
    PAPERS_MM,
    SCALES,
    Box,
    Circle,
    Line,
    Marks,
    Polyline,
    Sheet,
    Text,
    View,
    choose_paper,
    drawing_room,
    extent,
    fit_scale,
    place_view,
)
from layoutopt.drawings.text_boxes import text_box, text_boxes

LENGTHS = st.floats(min_value=1.0, max_value=1e6)


def text(**changes):
    fields = {"layer": "A-TITLE", "text": "Hx", "position_mm": (50.0, 40.0), "height_mm": 5.0}
    return Text(**(fields | changes))


def wide_view():
    return View(name="v", scale=1, at_mm=(0, 0), window_mm=Box(0, 0, 400, 9), entities=())


@given(width=LENGTHS, height=LENGTHS, room=st.tuples(st.floats(100, 1000), st.floats(100, 1000)))
def test_fit_scale_takes_the_largest_scale_that_fits(width, height, room):
    """The chosen scale fits, the next larger one does not, and both are of the ISO 5455 list."""
    scale = fit_scale((width, height), room)
    slack = 1 + 1e-6
    assert width / scale <= room[0] * slack
    assert height / scale <= room[1] * slack
    if scale > 1:
        larger = SCALES[SCALES.index(scale) - 1]
        assert width / larger > room[0] or height / larger > room[1]


def test_fit_scale_refuses_what_no_sheet_can_show():
    """A plan in the wrong unit must give an error that says so, not a sheet with a dot on it."""
    with pytest.raises(ValueError, match="right unit"):
        fit_scale((1e9, 1e9), (400.0, 200.0))


@pytest.mark.parametrize(
    ("metres", "coarsest", "paper"),
    [((5, 4), 100, "A3"), ((20, 12), 100, "A3"), ((45, 25), 100, "A2"), ((110, 70), 100, "A0")],
)
def test_choose_paper_steps_up_only_when_needed(metres, coarsest, paper):
    """The smallest paper on which the plan fits at a legible scale is taken, and the plan fits there."""
    size = (metres[0] * 1000.0, metres[1] * 1000.0)
    chosen, scale = choose_paper(size, clearance_mm=25.0, coarsest=coarsest)
    room = drawing_room(chosen, 25.0)
    assert chosen == paper
    assert scale <= coarsest
    assert size[0] / scale <= room.width
    assert size[1] / scale <= room.height


def test_choose_paper_goes_below_the_legible_scale_only_on_the_largest_paper():
    """A site too large for A0 at the legible scale is still drawn, on A0 and at a coarser scale."""
    paper, scale = choose_paper((300_000.0, 100_000.0), coarsest=100)
    assert paper == "A0"
    assert scale > 100


def test_view_maps_world_to_paper_and_back():
    """A point goes to the paper at the exact scale and comes back to where it was."""
    view = View(
        name="v",
        scale=20,
        at_mm=(100.0, 80.0),
        origin_mm=(5000.0, -300.0),
        window_mm=Box(20, 20, 300, 200),
        entities=(),
    )
    assert view.on_paper(np.array([[5000.0, -300.0], [6000.0, -300.0]])).tolist() == [
        [100.0, 80.0],
        [150.0, 80.0],
    ]
    assert view.in_world((150.0, 80.0)) == (6000.0, -300.0)


def test_place_view_centres_the_geometry_in_the_room():
    """The middle of what is drawn lands on the middle of the room, whatever the world coordinates."""
    room = Box(30.0, 60.0, 400.0, 280.0)
    line = Line(layer="A-OUTLINE", start_mm=(1e6, 2e6), end_mm=(1e6 + 8000, 2e6 + 3000))
    view = place_view("v", [line], scale=50, room_mm=room)
    assert view.on_paper(np.array([[1e6 + 4000, 2e6 + 1500]]))[0] == pytest.approx(room.centre)


def test_extent_covers_every_kind_of_geometry():
    """The extent is the union of lines, chains, circles and marks at their drawn size."""
    entities = [
        Line(layer="A-OUTLINE", start_mm=(0, 0), end_mm=(10, 5)),
        Polyline(layer="A-OUTLINE", points_mm=[(-3, 1), (2, 2)]),
        Circle(layer="A-OUTLINE", centre_mm=(8, 8), radius_mm=4),
        Marks(layer="A-TAGS", points_mm=[(0, -10)], symbol="ring", size_mm=2, printed_mm=0.1),
        text(position_mm=(1e9, 1e9)),
    ]
    assert extent(entities, scale=50) == (-3.0, -12.5, 12.0, 12.0)
    with pytest.raises(ValueError, match="nothing to draw"):
        extent([text()])


@pytest.mark.parametrize(
    "make",
    [
        lambda: Line(layer="WALLS", start_mm=(0, 0), end_mm=(1, 1)),
        lambda: Line(layer="A-DIMS", start_mm=(0, math.nan), end_mm=(1, 1)),
        lambda: Polyline(layer="A-DIMS", points_mm=[(0, 0)]),
        lambda: Polyline(layer="A-DIMS", points_mm=[(0, 0), (1, 1)], fill="#ffffff"),
        lambda: Polyline(layer="A-DIMS", points_mm=[(0, 0), (1, 1)], closed=True, fill="red"),
        lambda: Circle(layer="A-DIMS", centre_mm=(0, 0), radius_mm=0.0),
        lambda: Marks(layer="A-TAGS", points_mm=[(0, 0)], symbol="star", size_mm=1),
        lambda: Marks(layer="A-TAGS", points_mm=[(0, 0)], symbol="ring", size_mm=1, ids=("a", "b")),
        lambda: Marks(layer="A-TAGS", points_mm=[(0, 0)], symbol="ring", size_mm=1, kind="a b"),
        lambda: text(height_mm=-1.0),
        lambda: text(anchor="somewhere"),
        lambda: View(name="v", scale=33, at_mm=(0, 0), window_mm=Box(0, 0, 1, 1), entities=()),
        lambda: View(name="v", scale=50, at_mm=(0, 0), window_mm=Box(5, 0, 5, 1), entities=()),
        lambda: Sheet(title="t", paper="B3"),
        lambda: Sheet(
            title="t",
            paper="A4",
            views=(place_view("v", [], scale=1, room_mm=Box(0, 0, 400, 9), extent_mm=Box(0, 0, 1, 1)),),
        ),
    ],
)
def test_impossible_entities_are_refused(make):
    """What could not be drawn, or would silently be drawn wrongly, is an error when it is built."""
    with pytest.raises(ValueError, match=r"\w"):
        make()


def test_arrays_are_copied_frozen_and_compared_by_content():
    """Changing the caller's array must not move tags, and equal drawings must be equal, also after pickling."""
    source = np.array([[1.0, 2.0], [3.0, 4.0]])
    marks = Marks(layer="A-TAGS", points_mm=source, symbol="ring", size_mm=1)
    source[:] = 0.0
    assert marks.points_mm.tolist() == [[1.0, 2.0], [3.0, 4.0]]
    with pytest.raises(ValueError, match="read-only"):
        marks.points_mm[0, 0] = 9.0
    assert pickle.loads(pickle.dumps(marks)) == marks
    assert marks != Marks(layer="A-TAGS", points_mm=source, symbol="ring", size_mm=1)


@given(st.text())
def test_cleaned_text_is_one_line_that_every_format_can_hold(raw):
    """No control character, line end or half surrogate survives, and cleaning twice changes nothing."""
    clean = single_line(raw)
    clean.encode("utf-8")
    assert len(clean.splitlines()) <= 1
    assert not any(ord(character) < 32 or ord(character) == 127 for character in clean)
    assert single_line(clean) == clean


def test_letters_have_the_height_that_was_asked_for():
    """A capital of 5 mm is 5 mm high on paper, which fixes the font size."""
    box = text_box(text(text="H", height_mm=5.0))
    assert box.height == pytest.approx(5.0, abs=1e-9)
    assert points(5.0) * capital_em() * 25.4 / 72 == pytest.approx(5.0, abs=1e-9)


def test_text_widths_agree_with_matplotlib():
    """The widths that keep texts apart are never below those of the renderer, and above them by kerning only."""
    from matplotlib.font_manager import FontProperties
    from matplotlib.textpath import TextPath

    from layoutopt.drawings.lettering import font_file

    for words in ("Tag plan, ward 5", "1234567890", "WAVE Type"):
        path = TextPath((0, 0), words, size=points(3.5), prop=FontProperties(fname=str(font_file())))
        drawn_mm = path.get_extents().width * 25.4 / 72
        assert 0.85 * width_mm(words, 3.5) < drawn_mm <= width_mm(words, 3.5)


@given(st.text(max_size=80), st.floats(min_value=8.0, max_value=120.0))
def test_fitted_text_fits(raw, room):
    """A fitted text is not wider than its room and not lower than the smallest legible letters."""
    fitted, height = fit_text(raw, room, 5.0)
    assert width_mm(fitted, height) <= room + 1e-9
    assert 1.8 <= height <= 5.0


def test_fitted_text_shrinks_before_it_is_cut():
    """A text that fits at a smaller height stays whole; only a longer one loses its end, visibly."""
    whole, height = fit_text("Tag plan of the ward", 30.0, 5.0)
    assert whole == "Tag plan of the ward"
    assert 1.8 <= height < 5.0
    cut, height = fit_text("Tag plan of the ward " * 20, 30.0, 5.0)
    assert cut.startswith("Tag plan")
    assert cut.endswith("…")
    assert height == 1.8


def test_characters_outside_the_font_are_shown_as_missing():
    """A character without a glyph becomes the replacement character, known ones stay."""
    assert printable("Ä ± 床") == "Ä ± \ufffd"


@pytest.mark.parametrize("anchor", ANCHORS)
@pytest.mark.parametrize("angle", [0.0, 90.0, 180.0, 30.0])
def test_anchor_point_lies_where_it_says(anchor, angle):
    """Turning the text back about its position puts the anchor on the stated edge or middle of the text."""
    turned = text_box(text(text="HH", anchor=anchor, angle_deg=angle))
    flat = text_box(text(text="HH", anchor=anchor))
    row = {"middle": 0.5, "top": 1.0}.get(anchor.split("-")[0], 0.0)
    share = {"left": 0.0, "right": 1.0}.get(anchor.split("-")[-1], 0.5)
    assert flat.ymin == pytest.approx(40.0 - 5.0 * row)
    assert flat.xmin == pytest.approx(50.0 - share * width_mm("HH", 5.0))
    radians = math.radians(angle)
    corners = [(x - 50.0, y - 40.0) for x in (flat.xmin, flat.xmax) for y in (flat.ymin, flat.ymax)]
    right = max(50.0 + x * math.cos(radians) - y * math.sin(radians) for x, y in corners)
    top = max(40.0 + x * math.sin(radians) + y * math.cos(radians) for x, y in corners)
    assert (turned.xmax, turned.ymax) == pytest.approx((right, top))


def test_text_boxes_lists_view_and_paper_texts_in_paper_millimetres():
    """Texts of a view are placed by its scale but keep their printed height."""
    view = View(
        name="v",
        scale=50,
        at_mm=(100.0, 100.0),
        window_mm=Box(20, 20, 200, 200),
        entities=(text(text="H", position_mm=(500.0, 250.0)),),
    )
    sheet = Sheet(title="t", paper="A4", views=(view,), entities=(text(text="H", position_mm=(30.0, 20.0)),))
    in_view, on_paper = text_boxes(sheet)
    assert in_view[0] == "H"
    assert (in_view[2], in_view[4] - in_view[2]) == pytest.approx((105.0, 5.0))
    assert in_view[1] == pytest.approx(110.0)
    assert (on_paper[2], on_paper[4]) == pytest.approx((20.0, 25.0))


def test_model_and_renderers_load_no_heavy_package():
    """Importing the drawing modules must not import matplotlib or ezdxf; only rendering does."""
    code = (
        "import sys, layoutopt.drawings.dxf, layoutopt.drawings.frame\n"
        "import layoutopt.drawings.pdf, layoutopt.drawings.svg\n"
        "print(sorted({'matplotlib', 'ezdxf'} & set(sys.modules)))"
    )
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert found.stdout.strip() == "[]"


def test_papers_are_landscape_and_halve_each_other():
    """Each paper has half the area of the next larger one, to the rounding of whole millimetres."""
    sizes = list(PAPERS_MM.values())
    assert all(width > height for width, height in sizes)
    for smaller, larger in pairwise(sizes):
        assert smaller[0] == larger[1]
        assert smaller[1] == pytest.approx(larger[0] / 2, abs=0.6)
