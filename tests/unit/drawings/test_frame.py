"""Frame, title block and scale bar: ISO sizes, complete fields, texts inside their cells."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from layoutopt.drawings.frame import (
    DO_NOT_SCALE,
    TITLE_BLOCK_MM,
    TitleBlock,
    frame_box,
    frame_entities,
    legend,
    notes,
    scale_bar,
    title_block_entities,
)
from layoutopt.drawings.lettering import printable, single_line
from layoutopt.drawings.sheet import (
    PAPERS_MM,
    SCALES,
    TITLE_STRIP_MM,
    Box,
    Line,
    Marks,
    Polyline,
    Sheet,
    Text,
    extent,
)
from layoutopt.drawings.text_boxes import text_boxes

FIELDS = {
    "legal_owner": "Trust",
    "identification_number": "LO-7",
    "date_of_issue": "2026-11-22",
    "sheet_number": "A-201",
    "title": "Tag plan",
    "approval_person": "M. Approver",
    "creator": "layoutopt",
    "document_type": "Installation drawing",
}


def texts(entities):
    return [entity.text for entity in entities if isinstance(entity, Text)]


def boxes(entities, paper="A3"):
    return [
        (found[0], Box(*found[1:]))
        for found in text_boxes(Sheet(title="t", paper=paper, entities=tuple(entities)))
    ]


def overlaps(found):
    return [
        (one, other)
        for place, (one, box) in enumerate(found)
        for other, second in found[:place]
        if box.overlaps(second)
    ]


@pytest.mark.parametrize("paper", list(PAPERS_MM))
def test_frame_has_the_margins_of_iso_5457(paper):
    """The thick frame leaves 20 mm on the left for filing and 10 mm on the other sides."""
    width, height = PAPERS_MM[paper]
    thick = [
        entity for entity in frame_entities(paper) if isinstance(entity, Polyline) and entity.layer == "A-FRAME"
    ]
    assert extent(thick) == (20.0, 10.0, width - 10.0, height - 10.0) == frame_box(paper)


@pytest.mark.parametrize(
    ("paper", "digits", "letter"),
    [("A4", 6, "D"), ("A3", 8, "F"), ("A2", 12, "H"), ("A1", 16, "M"), ("A0", 24, "R")],
)
def test_grid_reference_has_the_fields_of_iso_5457(paper, digits, letter):
    """Digits run across and letters down, each on both sides, as many as the standard lists for the paper."""
    labels = texts(frame_entities(paper))
    assert max(int(label) for label in labels if label.isdigit()) == digits
    assert max(label for label in labels if label.isalpha()) == letter
    assert all(labels.count(label) == 2 for label in labels)
    assert not {"I", "O"} & set(labels)


def test_grid_reference_reads_from_the_upper_left():
    """Field A1 is in the upper left corner."""
    places = {entity.text: entity.position_mm for entity in frame_entities("A3") if isinstance(entity, Text)}
    assert places["A"][1] > places["B"][1]
    assert places["1"][0] < places["2"][0]


@pytest.mark.parametrize("paper", list(PAPERS_MM))
def test_centring_marks_lie_on_the_axes_of_the_paper(paper):
    """Four thick marks at the middles of the sides let a copy be centred."""
    width, height = PAPERS_MM[paper]
    marks = [entity for entity in frame_entities(paper) if isinstance(entity, Line) and entity.layer == "A-FRAME"]
    middles = [np.mean([mark.start_mm, mark.end_mm], axis=0) for mark in marks]
    assert sorted(middle[0] == width / 2 for middle in middles) == [False, False, True, True]
    assert sorted(middle[1] == height / 2 for middle in middles) == [False, False, True, True]


@pytest.mark.parametrize("paper", list(PAPERS_MM))
def test_title_block_lies_in_the_lower_right_corner_of_the_frame(paper):
    """It is 180 mm wide, touches the frame, and leaves the drawing room above the title strip free."""
    block = extent(title_block_entities(TitleBlock(**FIELDS), paper))
    frame = frame_box(paper)
    assert (block.xmax, block.ymin) == (frame.xmax, frame.ymin)
    assert block.width == pytest.approx(180.0)
    assert block.height == pytest.approx(TITLE_BLOCK_MM[1])
    assert block.height <= TITLE_STRIP_MM


def test_title_block_holds_every_field_of_iso_7200():
    """The eight mandatory fields, revision, scale, units and projection are written with their captions."""
    further = {"revision": "C", "scale": "1:50", "units": "mm"}
    written = texts(title_block_entities(TitleBlock(**FIELDS, **further), "A3"))
    for value in (*FIELDS.values(), *further.values(), "plan view", DO_NOT_SCALE):
        assert value in written
    captions = {
        "Legal owner",
        "Identification number",
        "Date of issue",
        "Sheet",
        "Title",
        "Approved by",
        "Created by",
    }
    assert captions | {"Document type", "Revision", "Scale", "Units", "Projection"} <= set(written)


def test_projection_symbols_mirror_each_other():
    """First angle has the end view on the right of the cone, third angle on the left."""

    def end_view(projection):
        entities = title_block_entities(TitleBlock(**FIELDS, projection=projection), "A3")
        circles = [entity for entity in entities if hasattr(entity, "radius_mm")]
        cone = [
            entity for entity in entities if isinstance(entity, Polyline) and np.ptp(entity.points_mm[:, 1]) == 4.0
        ]
        assert [circle.radius_mm for circle in circles] == [1.0, 2.0]
        return circles[0].centre_mm[0] - cone[0].points_mm[:, 0].mean()

    assert end_view("first angle") == pytest.approx(8.0)
    assert end_view("third angle") == pytest.approx(-8.0)


@settings(max_examples=60, deadline=None)
@given(st.lists(st.text(max_size=300), min_size=8, max_size=8))
def test_no_words_leave_their_cell_of_the_title_block(words):
    """Whatever the user writes, its width stays in its cell, and what is cut ends in an ellipsis."""
    block = TitleBlock(**dict(zip(FIELDS, words, strict=True)))
    entities = title_block_entities(block, "A3")
    cells = [extent([entity]) for entity in entities if isinstance(entity, Polyline) and entity.layer == "A-TITLE"]
    for label, box in boxes(entities):
        holders = [cell for cell in cells if cell.xmin <= box.xmin and box.xmax <= cell.xmax + 1e-9]
        assert any(cell.ymin <= (box.ymin + box.ymax) / 2 <= cell.ymax for cell in holders), label
    whole = {single_line(word) for word in words}
    written = set(texts(entities))
    # Only the title takes several lines, which follow each other.
    in_lines = "".join("".join(texts(entities)).split())
    assert all(
        word in written or "".join(word.split()) in in_lines or any(text.endswith("…") for text in written)
        for word in whole
    )


def test_long_title_takes_several_lines_and_is_not_cut():
    """A title of 150 letters stands in the block word for word, inside its cell and above 1.8 mm."""
    title = "QUICK LOOK, NOT FOR INSTALLATION: " + " ".join(["most accurate layout of the ward"] * 4)
    entities = title_block_entities(TitleBlock(**{**FIELDS, "title": title}), "A3")
    lines = [item for item in entities if isinstance(item, Text) and item.text in title and len(item.text) > 5]
    assert " ".join(item.text for item in lines) == title
    assert all(item.height_mm > 1.8 for item in lines)
    frame = frame_box("A3")
    cell = Box(frame.xmax - 110.0, frame.ymin + 20.0, frame.xmax, frame.ymin + 40.0)
    assert all(box.inside(cell) for text, box in boxes(entities) if text in {item.text for item in lines})
    assert overlaps(boxes(entities)) == []


def test_title_that_fits_nowhere_is_cut_with_an_ellipsis():
    """Of a title of thousands of letters the first lines are kept, and the last one says that it goes on."""
    entities = title_block_entities(TitleBlock(**{**FIELDS, "title": "endless title " * 300}), "A3")
    lines = [text for text in texts(entities) if text.startswith(("endless", "title"))]
    assert len(lines) > 3
    assert [text.endswith("…") for text in lines] == [False] * (len(lines) - 1) + [True]
    assert overlaps(boxes(entities)) == []


@pytest.mark.parametrize("paper", list(PAPERS_MM))
@pytest.mark.parametrize("length", [1, 12, 400])
def test_texts_of_a_framed_sheet_never_overlap(paper, length):
    """Frame, title block, scale bar, arrow, legend and notes leave every text free and on the paper."""
    block = TitleBlock(**{name: (value * length)[: max(length, 3)] for name, value in FIELDS.items()})
    frame = frame_box(paper)
    entities = [
        *frame_entities(paper),
        *title_block_entities(block, paper),
        *scale_bar((frame.xmin + 6, frame.ymin + 3), 50, 40.0),
        *legend(
            (frame.xmin + 5, frame.ymin + 42),
            [("A-TAGS", "target", "tag"), ("A-ZONE", None, "zone " * length)],
            40,
        ),
        *notes((frame.xmin + 5, frame.ymin + 28), ["Tag position ±5 mm. " * length, "All from the datum."], 55),
    ]
    found = boxes(entities, paper)
    assert overlaps(found) == []
    width, height = PAPERS_MM[paper]
    assert all(box.inside(Box(0, 0, width, height)) for _, box in found)


@pytest.mark.parametrize("scale", SCALES)
@pytest.mark.parametrize("longest", [30.0, 80.0, 150.0])
def test_scale_bar_is_true(scale, longest):
    """The printed length of the bar times the scale is the length written at its end."""
    entities = scale_bar((10.0, 20.0), scale, longest)
    bar = extent(entities)
    number, unit = texts(entities)[-1].split(" ")
    assert bar.width * scale == pytest.approx(float(number) * {"m": 1000.0, "mm": 1.0}[unit])
    assert longest * 0.4 <= bar.width <= longest * (1 + 1e-9)
    assert texts(entities)[0] == "0"
    assert overlaps(boxes(entities)) == []
    labels = [entity for entity in entities if isinstance(entity, Text)]
    for label in labels:
        worth = float(label.text.split(" ")[0]) / float(number)
        assert len(label.text.split(" ")[0].replace(".", "").strip("0")) <= 2, "divisions are round numbers"
        assert label.position_mm[0] == pytest.approx(10.0 + bar.width * worth)


def test_legend_shows_the_very_symbol_of_the_layer():
    """Samples use layer and symbol of the drawing, so that legend and drawing cannot disagree."""
    rows = [("A-TAGS", "target", "Tag"), ("A-GRID", None, "Grid")]
    symbol, line = [entity for entity in legend((0, 50), rows, 60) if not isinstance(entity, Text)]
    assert isinstance(symbol, Marks)
    assert (symbol.layer, symbol.symbol) == ("A-TAGS", "target")
    assert isinstance(line, Line)
    assert line.layer == "A-GRID"


def test_notes_are_cut_to_their_width_and_keep_printable_letters():
    """A long note is cut rather than run into its neighbour."""
    entities = notes((20.0, 100.0), ["a" * 500, "short"], 50.0)
    assert texts(entities)[0].endswith("…")
    assert texts(entities)[1] == "short"
    assert all(box.xmax <= 70.0 for _, box in boxes(entities))
    assert all(printable(text) == text for text in texts(entities))
