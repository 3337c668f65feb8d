"""The page of a study: everything on it, safe in a browser, and files that go with it."""

import re

import pytest

from layoutopt.plots.figures import new_axes
from studies.page import REPORT, Data, Page, Picture, Section, Table, write_page
from studies.page_frame import closing_lines


def page_of(**changes):
    drawn = new_axes(60.0, 40.0)
    drawn.plot([0.0, 1.0], [0.0, 1.0])
    settings = {
        "study": "speed",
        "title": "A title & <more>",
        "summary": ("It is <b>so</b>.",),
        "sections": (
            Section(
                heading="First part",
                paragraphs=("Some words.",),
                parts=(
                    Picture(name="line", caption="A line.", drawn=drawn),
                    Table(caption="Numbers", head=("what", "mm"), rows=(("width", "3.5 ± 0.1"),)),
                ),
            ),
        ),
        "facts": {"Seed": "7", "Trials": "48 a cell"},
        "data": (Data(name="numbers", head=("what", "value_m"), rows=(("=SUM(A1)", "-0.0035"), ("x", "1e-05"))),),
    }
    return Page(**{**settings, **changes})


def text_of(page, folder, *, quick=False):
    write_page(page, folder, quick=quick)
    return (folder / REPORT).read_text(encoding="utf-8")


def test_everything_is_on_the_page(tmp_path):
    """Title, question, summary, heading, words, table, figure, facts and links are there, and text is escaped."""
    text = text_of(page_of(), tmp_path)
    for part in ("How fast may my robots drive", "Some words.", "Numbers", "3.5 ± 0.1", "A line.", "<svg", "Seed"):
        assert part in text, part
    assert "A title &amp; &lt;more&gt;" in text
    assert "<b>so</b>" not in text
    assert 'href="tables/numbers.csv"' in text


def test_nothing_is_loaded_and_nothing_runs(tmp_path):
    """The page has no script and no address but links to its own files and parts."""
    text = text_of(page_of(), tmp_path)
    assert "<script" not in text
    assert not re.findall(r'(?:src|href)="(?!#|tables/)[^"]*"', text)
    assert "{{" not in text


@pytest.mark.parametrize("quick", [True, False])
def test_a_quick_look_says_so(quick, tmp_path):
    """A banner stands on the page of a quick run and only there."""
    assert ('class="banner"' in text_of(page_of(), tmp_path, quick=quick)) is quick


def test_contents_lead_to_their_sections(tmp_path):
    """Every entry of the table of contents has a target."""
    contents = re.search(r"<nav.*?</nav>", text := text_of(page_of(), tmp_path), re.DOTALL)
    assert re.findall(r'href="#([^"]+)"', contents[0]) == re.findall(r'<h2 id="([^"]+)"', text)


@pytest.mark.parametrize("found", [True, False])
def test_what_to_do_next_depends_on_whether_anything_was_found(found, tmp_path):
    """Nobody is sent to draw a layout that was not found."""
    text = text_of(page_of(found=found), tmp_path)
    assert ("relax a demand" in text) is not found
    assert ("Set the speed under [robots]" in text) is found
    assert ("relax a demand" in closing_lines("speed", found=found)[1]) is not found


def test_files_are_written_and_stale_ones_go(tmp_path):
    """Figures and tables of an earlier run disappear; a cell is no formula, and a negative number stays one."""
    (tmp_path / "figures").mkdir()
    (tmp_path / "figures/old.svg").write_text("old")
    write_page(page_of(), tmp_path, quick=False)
    assert not (tmp_path / "figures/old.svg").exists()
    assert (tmp_path / "figures/line.svg").exists()
    assert (tmp_path / "figures/line.png").exists()
    lines = (tmp_path / "tables/numbers.csv").read_text(encoding="utf-8").splitlines()
    assert lines == ["what,value_m", "'=SUM(A1),-0.0035", "x,1e-05"]


def test_the_same_page_gives_the_same_bytes(tmp_path):
    """Written twice from equal content, no byte differs."""
    for name in ("one", "two"):
        (tmp_path / name).mkdir()
        write_page(page_of(), tmp_path / name, quick=False)
    files = [path.relative_to(tmp_path / "one") for path in (tmp_path / "one").rglob("*") if path.is_file()]
    assert len(files) == 4
    for path in files:
        assert (tmp_path / "one" / path).read_bytes() == (tmp_path / "two" / path).read_bytes(), path


def test_crooked_tables_and_names_are_refused():
    """A row that is too short, and two figures of one name, are mistakes of the study."""
    with pytest.raises(ValueError, match="every row needs 2 cells"):
        Table(caption="Numbers", head=("what", "mm"), rows=(("width",),))
    picture = Picture(name="line", caption="A line.", drawn=new_axes(60.0, 40.0))
    with pytest.raises(ValueError, match="different names"):
        page_of(sections=(Section(heading="Twice", parts=(picture, picture)),))


@pytest.mark.parametrize("left_out", ["Seed", "Trials"])
def test_a_page_that_does_not_tell_what_it_rests_on_is_refused(left_out):
    """Without seed or number of trials nobody can judge a figure."""
    facts = {name: value for name, value in {"Seed": "7", "Trials": "9"}.items() if name != left_out}
    with pytest.raises(ValueError, match=f"page of speed: the facts have to tell {left_out}"):
        page_of(facts=facts)
