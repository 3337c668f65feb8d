"""What is written for the installer into one folder, and what is said of that which is not."""

import pytest
from command_line import called

from layoutopt.cli_floor import _bounds
from layoutopt.drawings import installation
from layoutopt.drawings.sheet import Text
from layoutopt.errors import InvalidInput
from layoutopt.layout import FloorTags, Layout, ZonePattern
from layoutopt.patterns.square import square
from layoutopt.spec.layout_file import write_layout
from layoutopt.spec.reading import read_spec
from layoutopt.spec.template import built_in

SPEC = read_spec(built_in())
LAYOUT = Layout(
    floor_tags=FloorTags(zones=(ZonePattern(zone="", pattern=square(pitch_m=0.5)),)),
    readers=next(SPEC.space.layouts()).readers,
)
TABLES = {
    *("readers.yaml", "readers.urdf", "bill_of_material.csv", "work_plan.csv"),
    *("tags.csv", "tags.yaml", "tags.json", "map.pgm", "map.yaml"),
}


def test_too_many_tags_for_one_sheet_leave_the_tables(tmp_path, monkeypatch):
    """The list of files says which there are; none is half written."""
    monkeypatch.setattr(installation, "MOST_ON_ONE_SHEET", 10)
    written = installation.write_overview(SPEC, LAYOUT, tmp_path, title="x")
    assert {path.name for path in written} == TABLES == {path.name for path in tmp_path.iterdir()}


def test_too_many_tags_for_a_set_leave_out_plans_and_schedules_and_say_so(tmp_path, monkeypatch):
    """Cover, key plan, robot and templates are there; an area has its plan."""
    monkeypatch.setattr(installation, "MOST_TAGS", 10)
    for name in ("render_pdf", "render_svg", "render_dxf"):
        monkeypatch.setattr(installation, name, lambda _, path: path.touch())
    _, left_out = installation.write_sheets(SPEC, LAYOUT, tmp_path, title="x")
    assert "--area" in left_out
    names = {path.stem for path in tmp_path.glob("*.svg")}
    assert {"G-001", "A-101", "R-101"} <= names
    assert not [name for name in names if name.startswith("A-2")]
    _, left_out = installation.write_sheets(SPEC, LAYOUT, tmp_path, title="x", area_m=(0.0, 0.0, 1.0, 1.0))
    assert left_out == ""
    assert (tmp_path / "A-201.svg").exists()


@pytest.mark.parametrize("quick", [True, False])
def test_what_a_quick_look_chose_is_marked_on_every_sheet(tmp_path, monkeypatch, quick):
    """`draw` finds the mark in the file, and says so; on standard error also how many sheets there are to draw."""
    drawn = []
    monkeypatch.setattr(installation, "render_pdf", lambda sheets, path: drawn.append(sheets))
    for name in ("render_svg", "render_dxf"):
        monkeypatch.setattr(installation, name, lambda *_: None)
    few = FloorTags(zones=(ZonePattern(zone="", pattern=square(pitch_m=2.0)),))
    write_layout(LAYOUT.replace(floor_tags=few), SPEC, tmp_path / "layout.toml", quick_look=quick)
    told = called("draw", "layout.toml", "--out", "drawings", cwd=tmp_path)
    assert told.returncode == 0, told.stderr
    sheets, single = drawn
    for sheet in (*sheets, single):
        words = " ".join(item.text for item in sheet.entities if isinstance(item, Text))
        assert ("QUICK LOOK, NOT FOR INSTALLATION" in f"{words} {sheet.title}") is quick, sheet.number
        assert ("QUICK LOOK" in words) is quick, sheet.number
        assert ("do not install from it" in words) is (quick and sheet.number in ("G-001", "")), sheet.number
    note = "note: this layout comes from a quick look at few layouts and drives; do not install from it"
    count = f"{len(sheets)} sheets to draw, half a second to a second each"
    assert told.stderr.splitlines() == [note, count][not quick :]
    assert "quick" not in told.stdout


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("0 m, 0 m", "2 lengths, not 4"),
        ("0 m, 0 m, 1 m, inf m", "no number with a unit"),
        ("0, 0, 1, 1", "has no unit"),
        ("1 m, 0 m, 0 m, 1 m", "it holds no area"),
    ],
)
def test_what_is_no_area_is_refused(text, words):
    """With what would be right."""
    with pytest.raises(InvalidInput, match=words):
        _bounds(text)


def test_an_area_may_lie_left_of_the_origin():
    """Plans of robots often have it in their middle."""
    assert _bounds("-3 m, -200 cm, 1m, 2 m") == (-3.0, -2.0, 1.0, 2.0)
