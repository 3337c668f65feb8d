"""The page of a study in a browser: wide and narrow windows, print, console."""

import io

import pypdf
import pytest
from devtools import Browser, browser_path

from layoutopt.plots.figures import new_axes
from studies.page import Data, Listing, Page, Picture, Section, Table, write_page

CHROMIUM = browser_path()
pytestmark = [
    pytest.mark.long,
    pytest.mark.skipif(CHROMIUM is None, reason="no chromium on the PATH; on Debian: apt-get install chromium"),
]
COLUMNS = 14
TOO_WIDE = (
    "[...document.querySelectorAll('table, svg, pre')].map(e => e.getBoundingClientRect().right)"
    ".filter(right => right > document.body.getBoundingClientRect().right + 1)"
)


@pytest.fixture(scope="module")
def report(tmp_path_factory):
    """A page with a figure, a table of many columns and long lines to copy."""
    ax = new_axes(120.0, 60.0)
    ax.plot([0.0, 1.0], [0.0, 1.0])
    folder = tmp_path_factory.mktemp("page")
    table = Table(
        caption="Numbers with intervals",
        head=("pattern of tags", *(f"estimator {number}, mm" for number in range(1, COLUMNS))),
        rows=tuple((f"square {100 * row} mm", *("12.3 (11.9 to 12.8)",) * (COLUMNS - 1)) for row in range(1, 5)),
    )
    page = Page(
        study="speed",
        title="A page",
        summary=("Up to 1.8 m/s.", "Twice that is not shown."),
        sections=(
            Section(
                heading="All points",
                parts=(
                    Picture(name="line", caption="Error against speed.", drawn=ax),
                    table,
                    Listing(caption="Lines to copy", text="points = [" + "[0.176, 0.249], " * 40 + "]"),
                ),
            ),
        ),
        facts={"Seed": "7", "Trials": "48 a cell"},
        data=(Data(name="speed", head=("speed_m_s",), rows=(("0.3",),)),),
    )
    write_page(page, folder, quick=True)
    return folder / "report.html"


@pytest.fixture(scope="module")
def browser(tmp_path_factory):
    """One browser for all tests of the file."""
    with Browser(CHROMIUM, tmp_path_factory.mktemp("profile")) as opened:
        yield opened


@pytest.mark.parametrize("width", [1280, 390])
def test_a_window_of_any_width_scrolls_tables_and_never_the_page(browser, report, width):
    """And the page loads nothing but itself, and has nothing to complain of."""
    browser.call("Emulation.setDeviceMetricsOverride", width=width, height=900, deviceScaleFactor=1, mobile=False)
    browser.open(report)
    assert browser.run("document.documentElement.scrollWidth") <= width
    assert browser.complaints() == []
    assert browser.requests() == [report.as_uri()]


def test_the_answer_stands_in_sight_and_the_figure_below_it(browser, report):
    """In a window of a common size, without scrolling."""
    browser.call("Emulation.setDeviceMetricsOverride", width=1280, height=900, deviceScaleFactor=1, mobile=False)
    browser.open(report)
    bottoms = browser.run(
        "['.lead', 'dl', 'figure'].map(s => document.querySelector(s).getBoundingClientRect()).map(r => r.bottom)"
    )
    assert bottoms == sorted(bottoms)
    assert bottoms[1] < 900.0


def test_print_cuts_nothing_off(browser, report):
    """On A4 a table of many columns, the figure and long lines end within the paper, and every cell is printed."""
    # The breadth of A4 without its margins, in CSS pixels.
    browser.call("Emulation.setDeviceMetricsOverride", width=703, height=1000, deviceScaleFactor=1, mobile=False)
    browser.call("Emulation.setEmulatedMedia", media="print")
    browser.open(report)
    assert browser.run(TOO_WIDE) == []
    browser.call("Emulation.setEmulatedMedia", media="")
    printed = pypdf.PdfReader(io.BytesIO(browser.printed()))
    text = " ".join(page.extract_text() for page in printed.pages)
    assert text.count("11.9") == 4 * (COLUMNS - 1)
    assert len(printed.pages) <= 4
