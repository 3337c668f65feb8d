"""What docs/security.md promises of names: whatever stands in a file, names stay names."""

import json
import re
import tomllib
from importlib import resources
from pathlib import Path
from xml.etree import ElementTree

import ezdxf
import pytest
import tomli_w
import yaml
from command_line import called
from harmless import check_page, check_picture, check_table
from made_studies import SPEC, made_study

from layoutopt.errors import FailureKind, InvalidInput
from layoutopt.protocols import Failure
from layoutopt.spec.layout_file import read_layout
from studies import effort, output
from studies.page import REPORT, Listing, Page, Section, Table, write_page

NAMES = {
    "path": "../../MARK",
    "absolute": "/etc/MARK",
    "script": "<script>MARK()</script>",
    "attribute": '" onmouseover="MARK()" x="',
    "comment": "--><script>MARK()</script><!--",
    "template": "{{ MARK }}{% MARK %}",
    "formula": "=MARK()",
    "formula behind a blank": "\t=MARK()",
    "DDE": "@SUM(1+1)*cmd|' /C MARK'!A0",
    "line": "MARK\n  0\nENDSEC\n  0\nEOF",
    "link": "javascript:MARK()",
    "long": "MARK" * 50,
}


@pytest.mark.parametrize("name", ["a\0b", "\x1b[31m", "x" * 10_000])
@pytest.mark.parametrize(
    "place", ["site.name", "site.source", "zone.name", "reader_profile.name", "exact.name", "tag", "prices", "key"]
)
def test_names_that_no_reader_takes(tmp_path, place, name):
    """Control characters and endless names are refused with a message, wherever a name may stand."""
    document = spec_with_names("MARK")
    spoil(document, place, name)
    (tmp_path / "layout.toml").write_text(tomli_w.dumps(document), encoding="utf-8")
    with pytest.raises(InvalidInput) as caught:
        read_layout(tmp_path / "layout.toml")
    assert len(str(caught.value)) < 1000


def spoil(document, place, name):
    """Put a name into a place of a layout file."""
    if place == "exact.name":
        document["layout"]["tags"][0]["exact"]["name"] = name
    elif place in ("tag", "key"):
        document["layout"][place] = name
    elif place == "zone.name":
        document["site"]["zone"][0]["name"] = name
    elif place == "reader_profile.name":
        document["parts"]["reader_profile"]["name"] = name
    elif place == "prices":
        del document["parts"]["price_list"]
        document["parts"]["prices"] = name
    else:
        document["site"][place.partition(".")[2]] = name


@pytest.mark.parametrize("place", ["zone.name", "reader_profile.name", "exact.name", "tag", "prices", "key"])
@pytest.mark.parametrize("name", NAMES)
def test_names_that_stand_in_heads_and_files_are_plain(tmp_path, place, name):
    """Names of zones, profiles and patterns have few characters; those of parts and price lists must be known."""
    document = spec_with_names("MARK")
    spoil(document, place, NAMES[name])
    (tmp_path / "layout.toml").write_text(tomli_w.dumps(document), encoding="utf-8")
    with pytest.raises(InvalidInput):
        read_layout(tmp_path / "layout.toml")


def spec_with_names(name):
    """Return a layout file with a name wherever free text may stand; the zone begins like a formula."""
    document = tomllib.loads(SPEC)
    document["site"] |= {"name": name, "source": name}
    document["site"]["zone"] = [{"name": "-MARK", "region": [[0, 0], [1, 0], [1, 1]]}]
    document["parts"] = {"reader_profile": {"name": "own"}, "price_list": price_list(name)}
    document["layout"] = {
        "readers": {
            "family": "ring",
            "count": 4,
            "radius": "0.15 m",
            "antenna_side": "60 mm",
            "antenna_height": "20 mm",
        },
        "tags": [
            {
                "exact": {
                    "name": "own",
                    "points": [[0, 0]],
                    "cell": [[0.2, 0], [0, 0.2]],
                    "parameters": {name: name},
                }
            }
        ],
    }
    return document


def price_list(name):
    """Return the default prices as a frozen copy holds them, with a name wherever text may stand."""
    text = (resources.files("layoutopt") / "prices" / "default-2026.toml").read_text(encoding="utf-8")
    items = tomllib.loads(text)["items"]
    texts = {"description": name, "unit": name, "source": name, "date": name}
    kept = ("price", "labour", "spare", "size", "base_side")
    table = {item: {**{key: value[key] for key in kept if key in value}, **texts} for item, value in items.items()}
    return {"name": name, "date": name, "items": table}


@pytest.mark.parametrize(
    "names",
    [
        ("formula", "script", "comment", "template"),
        ("formula behind a blank", "line", "attribute", "path"),
        ("DDE", "script", "link", "absolute"),
    ],
)
def test_names_in_drawings_stay_names(tmp_path, names):
    """Whatever a layout file says in words, its drawings and tables lie in their folder, sound and harmless."""
    (tmp_path / "layout.toml").write_text(
        tomli_w.dumps(spec_with_names("".join(NAMES[name] for name in names))), encoding="utf-8"
    )
    spec, layout = read_layout(tmp_path / "layout.toml")
    written = output.write_overview(spec, layout, tmp_path / "out", title=f"{spec.site.name}: drawn")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["layout.toml", "out"]
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == sorted(path.name for path in written)
    for path in written:
        if path.suffix == ".csv":
            check_table(path)
        elif path.suffix == ".svg":
            check_picture(path)
        elif path.suffix in (".yaml", ".json"):
            # JSON is YAML, and the safe loader makes nothing but plain values.
            table = yaml.safe_load(path.read_text(encoding="utf-8"))
            assert path.stem != "tags" or table["site"] == spec.site.name
        elif path.suffix == ".urdf":
            names = [element.get("name", "") for element in ElementTree.parse(path).iter()]
            assert all(re.fullmatch(r"rfid_antenna(s|_\d+_(link|joint))|", name) for name in names)
    drawing = ezdxf.readfile(tmp_path / "out" / "sheet.dxf")
    assert not drawing.audit().errors
    assert len(drawing.modelspace()) > 100
    assert b"/JavaScript" not in (tmp_path / "out" / "sheet.pdf").read_bytes()
    assert b"/Launch" not in (tmp_path / "out" / "sheet.pdf").read_bytes()


def test_names_in_a_report_stay_names(tmp_path, monkeypatch):
    """Hostile names and failures leave a report that runs and loads nothing, and tables of plain cells."""
    monkeypatch.setattr(output, "write_overview", lambda *_, **__: [])
    hostile = "".join(NAMES[name] for name in ("comment", "attribute", "template", "path"))
    document = spec_with_names(hostile)
    del document["layout"]
    document["study"]["validate_with"] = ["mcl", "midrange"]
    made = made_study(tmp_path, tomli_w.dumps(document))
    outcomes = dict(made.recorded)
    last = next(key for key, item in outcomes.items() if item.group.scenario.startswith("held-out"))
    failed = outcomes[last]
    outcomes[last] = Failure(
        group=failed.group, first=failed.first, message=f"={hostile}", kind=FailureKind.RAISED
    )
    folder = tmp_path / "out"
    folder.mkdir()
    evaluations = sorted(outcomes.values(), key=lambda item: (item.group, item.first))
    made.question.answer(tuple(evaluations), made.spec).write(folder, streams=made.streams, quick=True)
    text = (folder / "report.html").read_text(encoding="utf-8")
    check_page(text, folder)
    assert "&lt;script&gt;MARK()" in text
    tables = sorted(folder.glob("*.csv"))
    assert len(tables) >= 5
    for path in tables:
        check_table(path)
    for path in folder.rglob("*.svg"):
        check_picture(path)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["given.toml", "out"]
    plain = re.compile(r"[a-z0-9_]+\.(csv|html|toml|svg|png)|layouts|recommended|figures")
    assert all(plain.fullmatch(path.name) for path in folder.rglob("*"))


def test_names_on_a_page_stay_names(tmp_path):
    """The pages of the other studies escape titles, sentences, tables, listings and facts."""
    hostile = "".join(NAMES[name] for name in ("comment", "attribute", "template", "link"))
    table = Table(caption=hostile, head=(hostile, hostile), rows=((hostile, hostile),))
    listing = Listing(caption=hostile, text=hostile)
    section = Section(heading=hostile, paragraphs=(hostile,), parts=(table, listing))
    facts = {"Seed": hostile, "Trials": hostile, hostile: hostile}
    page = Page(study="speed", title=hostile, summary=(hostile,), sections=(section,), facts=facts)
    write_page(page, tmp_path, quick=True)
    text = (tmp_path / REPORT).read_text(encoding="utf-8")
    check_page(text, Path())
    assert text.count("&lt;script&gt;MARK()") == text.count("script&gt;MARK()") > 10


@pytest.mark.parametrize("name", ["\x1b[31m", "\x9b31m", "\u202ex"])
def test_control_characters_of_a_spec_do_not_reach_the_terminal(tmp_path, monkeypatch, name):
    """Nothing that a spec says moves the cursor, changes colours or turns the direction of writing."""
    spec = SPEC.replace("[site]", f"[site]\nname = {json.dumps(name)}")
    (tmp_path / "faulty.toml").write_text(spec.replace("pitch", "pitches"), encoding="utf-8")
    (tmp_path / "spec.toml").write_text(spec, encoding="utf-8")
    monkeypatch.setattr(effort, "plan_lines", lambda *_, **__: [])
    for file in ("faulty.toml", "spec.toml"):
        ended = called("check", file, cwd=tmp_path)
        said = [*ended.stdout.splitlines(), *ended.stderr.splitlines()]
        assert said
        assert all(line.isprintable() for line in said), said
