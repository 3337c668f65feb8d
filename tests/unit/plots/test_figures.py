"""What figures share: files that repeat byte for byte, plain text, labels that do not cover each other."""

import re
import subprocess
import sys
import xml.etree.ElementTree as ElementTree

import numpy as np
import pytest
from matplotlib.text import Text

from layoutopt.plots.figures import (
    INK,
    MARKERS,
    SERIES,
    as_svg,
    figure_of,
    grouped,
    label_log_axis,
    new_axes,
    save,
    spans_decade,
)
from layoutopt.plots.labels import PointLabel, place_labels

HOSTILE = "<script>alert(1)</script> $x$ =cmd -- --> &"


def drawn(title="a figure"):
    ax = new_axes(80.0, 60.0)
    ax.plot([1.0, 2.0, 3.0], [1.0, 4.0, 9.0], color=INK, rasterized=True)
    ax.fill_between([1.0, 2.0], [0.0, 1.0], hatch="//", color=SERIES[0])
    ax.set_title(title, parse_math=False)
    return ax


def test_files_are_the_same_every_time(tmp_path):
    """The same figure drawn twice gives the same bytes, with no date and no version in them."""
    first = save(drawn(), tmp_path / "first.figure")
    second = save(drawn(), tmp_path / "second")
    assert [path.name for path in first] == ["first.figure.svg", "first.figure.png"]
    for one, other in zip(first, second, strict=True):
        assert one.read_bytes() == other.read_bytes()
    text = first[0].read_text(encoding="utf-8")
    assert "dc:date" not in text
    assert "Matplotlib" not in text
    assert b"Software" not in first[1].read_bytes()


def test_size_on_paper_is_the_size_asked_for(tmp_path):
    """A figure of 80 mm by 60 mm is that large in the SVG, in points of 1/72 inch."""
    svg = ElementTree.parse(save(drawn(), tmp_path / "figure")[0]).getroot()
    sizes = [float(svg.get(name).removesuffix("pt")) / 72.0 * 25.4 for name in ("width", "height")]
    assert sizes == pytest.approx([80.0, 60.0], abs=0.01)


def test_inline_svg_is_one_clean_element():
    """Text for a page is a well-formed svg element without header, comments or script, whatever the title."""
    text = as_svg(drawn(HOSTILE))
    assert text.startswith("<svg")
    assert "<!" not in text
    assert "<?" not in text
    tags = {element.tag.rpartition("}")[2] for element in ElementTree.fromstring(text).iter()}
    assert "script" not in tags
    assert "image" in tags


def test_inline_svg_follows_the_page_and_owns_its_ids():
    """Ink and paper are variables of the page, and every reference within the drawing finds its id."""
    text = as_svg(drawn())
    assert f"var(--ink, {INK})" in text
    assert INK not in text.replace(f"var(--ink, {INK})", "")
    ids = re.findall(r'\bid="([^"]+)"', text)
    assert len(ids) == len(set(ids))
    wanted = re.findall(r"url\(#([^)]+)\)", text) + re.findall(r'href="#([^"]+)"', text)
    assert wanted
    assert set(wanted) <= set(ids)
    other = re.findall(r'\bid="([^"]+)"', as_svg(drawn("another")))
    assert not set(ids) & set(other)


def test_drawing_leaves_the_library_as_it_was():
    """Styles are those of one figure: the global settings of matplotlib do not change."""
    import matplotlib

    before = dict(matplotlib.rcParams)
    as_svg(drawn())
    assert dict(matplotlib.rcParams) == before


def test_matplotlib_is_loaded_late_and_pyplot_never():
    """Importing the figures loads no matplotlib, and drawing one loads no pyplot."""
    program = (
        "import sys\n"
        "from layoutopt.plots import error_over_time, figures, front, labels, layout_plan\n"
        "assert 'matplotlib' not in sys.modules\n"
        "figures.as_svg(figures.new_axes(50.0, 40.0))\n"
        "assert 'matplotlib' in sys.modules and 'matplotlib.pyplot' not in sys.modules\n"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr


def test_colours_and_markers_differ():
    """Series differ in marker as well as in colour, and every colour is dark enough for white paper."""
    assert len(set(SERIES)) == len(SERIES) == len(set(MARKERS))
    for colour in SERIES:
        red, green, blue = (int(colour[start : start + 2], 16) / 255.0 for start in (1, 3, 5))
        assert 0.2126 * red + 0.7152 * green + 0.0722 * blue < 0.62


@pytest.mark.parametrize(
    ("values", "spans"), [([1.0, 10.0], False), ([1.0, 10.1], True), ([0.0, 100.0], False), ([], False)]
)
def test_logarithmic_axes_need_more_than_a_decade(values, spans):
    """Zero and a span of ten or less stay linear."""
    assert spans_decade(values) is spans


def test_logarithmic_axis_has_plain_numbers():
    """Ticks read 1, 2, 5, 10 and 1 000, never powers of ten in math text."""
    ax = new_axes(80.0, 60.0)
    label_log_axis(ax, x=True)
    ax.set_xlim(1.0, 2000.0)
    figure_of(ax).draw_without_rendering()
    texts = [label.get_text() for label in ax.get_xticklabels()]
    assert {"1", "2", "5", "10", grouped(1000.0)} <= set(texts)
    assert not any("$" in text for text in texts)


def test_labels_cover_neither_each_other_nor_points():
    """Eight labels round close points overlap nowhere, cover no point, and stay within the axes."""
    ax = new_axes(170.0, 110.0)
    ax.set(xlim=(0.0, 10.0), ylim=(0.0, 10.0))
    angles = 2.0 * np.pi * np.arange(8) / 8.0
    points = [(5.0 + 0.4 * np.cos(angle), 5.0 + 0.4 * np.sin(angle)) for angle in angles]
    labels = [PointLabel(x=x, y=y, text=f"label number {n}") for n, (x, y) in enumerate(points)]
    place_labels(ax, labels, [(5.0, 5.0)])
    figure = figure_of(ax)
    figure.draw_without_rendering()
    boxes = [Text.get_window_extent(note) for note in ax.texts]
    assert len(boxes) == len(labels)
    for number, box in enumerate(boxes):
        assert not any(box.overlaps(other) for other in boxes[number + 1 :])
        assert not any(box.contains(*place) for place in ax.transData.transform([*points, (5.0, 5.0)]))
        assert ax.get_window_extent().contains(box.x0, box.y0)
        assert ax.get_window_extent().contains(box.x1, box.y1)


def test_labels_do_not_read_mathematics():
    """Dollar signs in a label stay as they are."""
    ax = new_axes(80.0, 60.0)
    place_labels(ax, [PointLabel(x=0.5, y=0.5, text="$\\frac{1}$")], [])
    figure_of(ax).draw_without_rendering()
    assert ax.texts[0].get_text() == "$\\frac{1}$"
    assert ax.texts[0].get_parse_math() is False
