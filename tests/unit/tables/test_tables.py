"""Tables for people and robots: what is written comes back, and nothing runs in a spreadsheet."""

import csv
import dataclasses
import math
from decimal import Decimal

import numpy as np
import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st
from shapely.geometry import box

from layoutopt.antennas.sphere import SphereAntenna
from layoutopt.errors import InvalidInput
from layoutopt.layout import EditKind, FloorTags, Layout, ReaderGroup, TagEdit, ZonePattern
from layoutopt.parts import bill_of_material, default_prices
from layoutopt.patterns.square import square
from layoutopt.protocols import Mount
from layoutopt.readers.cross import cross
from layoutopt.readers.profiles import COMMERCIAL, MI2016
from layoutopt.site import Site, Tiling, Zone
from layoutopt.tables.bill import write_bill_csv
from layoutopt.tables.readers import antenna_rows, read_readers_yaml, write_readers_yaml
from layoutopt.tables.tag_files import read_tag_file, tag_header, write_tag_files
from layoutopt.tables.tags import TAG_COLUMNS, tag_rows

SITE = Site(
    name="ward",
    floor=box(-1, -1, 1, 1),
    zones=(Zone(name="dock", region=box(0, 0, 0.5, 0.5)),),
    tiling=Tiling(size_m=0.3, origin_m=(0.05, 0.0), angle_rad=0.1),
)
FLOOR_TAGS = FloorTags(
    zones=(ZonePattern(zone="", pattern=square(pitch_m=0.13), origin_m=(0.011, 0.007), angle_rad=0.3),),
    edits=(),
    placement_sigma_m=0.003,
)
TEXT = st.text(st.characters(exclude_categories=["Cs"]), min_size=1, max_size=20)


def layout():
    """Return a layout with two groups of different antennas."""
    wide = Mount(antenna=SphereAntenna(side_m=0.06), height_m=0.02, profile=COMMERCIAL, antennas_per_module=4)
    small = ReaderGroup(
        name="listed",
        poses=[(0.0123456789, -0.25, 0.015, 1.0), (-0.05, 0.05, 0.015, -math.pi / 2)],
        antenna=SphereAntenna(side_m=0.03),
        profile=MI2016,
        slots=(0, 0),
    )
    return Layout(floor_tags=FLOOR_TAGS, readers=(cross(count=8, mount=wide), small))


def write_tags(folder, tag_map, site=SITE, tag_part="label", surveyed_m=None):
    """Write the three files of a tag map."""
    header = tag_header(layout(), site, len(tag_map))
    return write_tag_files(folder, header, tag_rows(tag_map, site, tag_part, surveyed_m))


def cells(path):
    """Return the rows of a CSV file as any reader sees them."""
    with path.open(encoding="utf-8", newline="") as stream:
        return list(csv.reader(stream))


def test_tags_come_back_to_a_tenth_of_a_millimetre(tmp_path):
    """Tag by tag: identity, place, tile, zone and state, as the tag map has them."""
    tag_map = FLOOR_TAGS.lay_on(SITE)
    write_tags(tmp_path, tag_map, SITE, "disc")
    rows = read_tag_file(tmp_path / "tags.csv")
    assert len(rows) == len(tag_map) > 200
    for index, row in enumerate(rows):
        assert row.tag_id == tag_map.ids[index]
        assert math.hypot(row.x_m - tag_map.xy_m[index, 0], row.y_m - tag_map.xy_m[index, 1]) < 1e-4
        assert row.tile == "c{}r{}".format(*tag_map.tile[index])
        assert row.zone == ("dock" if tag_map.zone[index] == 0 else "")
        assert (row.z_m, row.yaw_rad, row.type, row.install_status) == (0.0, 0.0, "disc", "planned")
        assert (row.surveyed_x_m, row.surveyed_y_m, row.sigma_m) == (None, None, 0.003)
    assert {row.zone for row in rows} == {"", "dock"}


def test_surveyed_places_and_identities_come_back(tmp_path):
    """Some tags are scanned and measured, others are not yet; a moved tag says so."""
    first = FLOOR_TAGS.lay_on(SITE)
    edit = TagEdit(kind=EditKind.MOVED, from_m=tuple(first.xy_m[3]), to_m=(0.2, 0.21))
    tag_map = dataclasses.replace(FLOOR_TAGS, edits=(edit,)).lay_on(SITE)
    uid = tuple("E00401500A1B2C3D" if index == 1 else None for index in range(len(tag_map)))
    tag_map = dataclasses.replace(tag_map, uid=uid)
    surveyed_m = np.full((len(tag_map), 2), np.nan)
    surveyed_m[1] = (0.1234567, -0.5)
    write_tags(tmp_path, tag_map, SITE, "label", surveyed_m)
    rows = read_tag_file(tmp_path / "tags.csv")
    assert (rows[1].uid, rows[0].uid) == ("E00401500A1B2C3D", None)
    assert (rows[1].surveyed_x_m, rows[1].surveyed_y_m) == (0.123457, -0.5)
    assert rows[0].surveyed_x_m is None
    assert rows[3].install_status == "moved"
    assert (rows[3].x_m, rows[3].y_m) == (0.2, 0.21)


def test_the_tag_table_has_no_comment_and_a_fixed_form(tmp_path):
    """A header, six decimals, line feeds, rising identities, never a negative zero."""
    tag_map = FLOOR_TAGS.lay_on(SITE)
    write_tags(tmp_path, tag_map, SITE, "label")
    text = (tmp_path / "tags.csv").read_bytes().decode()
    assert "\r" not in text
    assert "-0.000000" not in text
    lines = text.splitlines()
    assert lines[0].split(",") == list(TAG_COLUMNS)
    assert [int(line.split(",")[0]) for line in lines[1:]] == list(range(1, len(tag_map) + 1))
    assert all(len(line.split(",")[2].partition(".")[2]) == 6 for line in lines[1:])


def test_no_tile_without_a_tiling():
    """The column stays empty rather than naming a tile that does not exist."""
    site = dataclasses.replace(SITE, tiling=None)
    assert {row.tile for row in tag_rows(FLOOR_TAGS.lay_on(site), site, "label")} == {""}


def test_an_empty_map_is_a_header(tmp_path):
    """No tags: still a table."""
    tag_map = dataclasses.replace(FLOOR_TAGS, tag_size_m=(3.0, 3.0)).lay_on(SITE)
    write_tags(tmp_path, tag_map, SITE, "label")
    assert read_tag_file(tmp_path / "tags.csv") == ()


def test_readers_come_back(tmp_path):
    """Poses in base_link, sides, profiles, modules and slots of all groups, in the order of readings."""
    write_readers_yaml(tmp_path / "readers.yaml", layout())
    rows = read_readers_yaml(tmp_path / "readers.yaml")
    expected = antenna_rows(layout())
    assert len(rows) == 10
    for row, want in zip(rows, expected, strict=True):
        for column in dataclasses.fields(row):
            value = getattr(want, column.name)
            assert getattr(row, column.name) == (pytest.approx(value, abs=1e-6) if column.type is float else value)
    assert [row.antenna for row in rows] == list(range(10))
    assert sorted({row.module for row in rows}) == [0, 1, 2, 3]
    assert len({(row.module, row.slot) for row in rows}) == 10
    assert [row.side_m for row in rows[-3:]] == [0.06, 0.03, 0.03]


def test_readers_are_plain_yaml_with_frames(tmp_path):
    """Any safe YAML reader takes it; schema and frames are named."""
    write_readers_yaml(tmp_path / "readers.yaml", layout())
    table = yaml.safe_load((tmp_path / "readers.yaml").read_text(encoding="utf-8"))
    assert (table["schema"], table["frame_id"], table["tag_frame_id"]) == (1, "base_link", "map")
    assert table["layout"] == layout().key
    assert table["antennas"][9]["frame_id"] == "rfid_antenna_9_link"


def test_the_bill_adds_up_in_print(tmp_path):
    """The last row is the sum of the printed totals above it, to the cent."""
    candidate = layout()
    bill = bill_of_material(candidate, FLOOR_TAGS.lay_on(SITE), 3, default_prices())
    write_bill_csv(tmp_path / "bill.csv", bill)
    rows = cells(tmp_path / "bill.csv")
    totals = [Decimal(row[6]) for row in rows[1:]]
    assert sum(totals[:-1]) == totals[-1] == Decimal(f"{bill.total_eur:.2f}")
    assert rows[-1][:3] == ["total", "total", "floor and 3 robots"]
    assert len(rows) == len(bill.lines) + 2
    for row in rows[1:-1]:
        assert abs(Decimal(row[3]) * Decimal(row[5]) - Decimal(row[6])) <= Decimal("0.0075")


def test_a_second_run_writes_the_same_bytes(tmp_path):
    """Equal layouts, equal files; what was there before is replaced, and no other file is left behind."""
    for name in ("first", "second", "second"):
        folder = tmp_path / name
        folder.mkdir(exist_ok=True)
        tag_map = FLOOR_TAGS.lay_on(SITE)
        write_tags(folder, tag_map)
        write_readers_yaml(folder / "readers.yaml", layout())
        write_bill_csv(folder / "bill.csv", bill_of_material(layout(), tag_map, 3, default_prices()))
    files = ["bill.csv", "readers.yaml", "tags.csv", "tags.json", "tags.yaml"]
    for name in files:
        assert (tmp_path / "first" / name).read_bytes() == (tmp_path / "second" / name).read_bytes()
    assert sorted(entry.name for entry in (tmp_path / "second").iterdir()) == files


def test_a_failed_write_leaves_the_old_table(tmp_path):
    """If a table cannot be made, the one before it stays whole."""
    path = tmp_path / "tags.csv"
    path.write_text("old", encoding="utf-8")
    tag_map = FLOOR_TAGS.lay_on(SITE)
    broken = dataclasses.replace(tag_map, uid=("\ud800",) * len(tag_map))
    with pytest.raises(ValueError, match="surrogate"):
        write_tags(tmp_path, broken)
    assert path.read_text(encoding="utf-8") == "old"
    assert [entry.name for entry in tmp_path.iterdir()] == ["tags.csv"]


@pytest.mark.parametrize(
    "text",
    [
        "=1+1",
        "+1",
        "-1",
        "@SUM(A1)",
        "\tx",
        "\rx",
        "  =1",
        "\u00a0=1",
        "'=1",
        "''@x",
        "＝1",
        "\ufeff=1",
        '=HYPERLINK("x")',
    ],
)
def test_no_cell_is_a_formula(tmp_path, text):
    """What begins like a formula, also after blanks, gets an apostrophe, in every text cell of both tables."""
    tag_map = FLOOR_TAGS.lay_on(SITE)
    site = dataclasses.replace(SITE, zones=(Zone(name=text, region=box(-1, -1, 1, 1)),))
    tag_map = dataclasses.replace(
        FLOOR_TAGS.lay_on(site), uid=(text,) * len(tag_map), status=(text,) * len(tag_map)
    )
    write_tags(tmp_path, tag_map, site, text)
    row = dict(zip(*cells(tmp_path / "tags.csv")[:2], strict=True))
    assert [row[name] for name in ("uid", "zone", "type", "install_status")] == ["'" + text] * 4
    prices = default_prices().replace_item("label", description=text, source=text)
    write_bill_csv(tmp_path / "bill.csv", bill_of_material(layout(), tag_map, 1, prices))
    line = cells(tmp_path / "bill.csv")[1]
    assert (line[2], line[7]) == ("'" + text, "'" + text)


def test_negative_numbers_stay_numbers(tmp_path):
    """Only text is guarded: a coordinate of -0.5 m is no formula."""
    write_tags(tmp_path, FLOOR_TAGS.lay_on(SITE), SITE, "label")
    assert any(row[2].startswith("-0.") for row in cells(tmp_path / "tags.csv"))
    assert not any(cell.startswith("'") for row in cells(tmp_path / "tags.csv") for cell in row)


@given(TEXT)
def test_any_text_comes_back_from_the_guard(tmp_path_factory, text):
    """Whatever is in a cell, quotes, line ends and apostrophes included: it comes back as it was."""
    path = tmp_path_factory.getbasetemp() / "tags.csv"
    tag_map = FLOOR_TAGS.lay_on(dataclasses.replace(SITE, floor=box(0, 0, 0.2, 0.2)))
    tag_map = dataclasses.replace(tag_map, uid=(text,) * len(tag_map))
    write_tags(path.parent, tag_map)
    assert [row.uid for row in read_tag_file(path)] == [text] * len(tag_map)


GOOD = "1,,0.1,0.2,0,0,label,,,planned,,,0.001"


@pytest.mark.parametrize(
    ("line", "complaint"),
    [
        ("1,,nan,0.2,0,0,label,,,planned,,,0", "tags.csv:3 x_m: 'nan' is no finite number"),
        ("2,,0.1,1e999,0,0,label,,,planned,,,0", "tags.csv:3 y_m: '1e999' is no finite number"),
        ("two,,0.1,0.2,0,0,label,,,planned,,,0", "tags.csv:3 tag_id: 'two' is no whole number"),
        ("2,,0.1,0.2,0,0,label,,,planned,inf,,0", "tags.csv:3 surveyed_x_m: 'inf' is no finite number"),
        ("2,,,0.2,0,0,label,,,planned,,,0", "tags.csv:3 x_m: '' is no finite number"),
        ("2,,0.1", "tags.csv:3: 3 cells where 13 are needed"),
        (GOOD, "tags.csv:2."),
        ('2,"x"y,0.1,0.2,0,0,label,,,planned,,,0', "tags.csv:3: this is no CSV"),
    ],
)
def test_faults_of_a_tag_table_are_named(tmp_path, line, complaint):
    """Line and column of each fault."""
    path = tmp_path / "tags.csv"
    path.write_text("\n".join([",".join(TAG_COLUMNS), GOOD, line]) + "\n", encoding="utf-8")
    with pytest.raises(InvalidInput) as caught:
        read_tag_file(path)
    assert complaint in str(caught.value)


def test_all_faults_of_a_tag_table_come_at_once(tmp_path):
    """Two bad lines, two messages."""
    path = tmp_path / "tags.csv"
    path.write_text("\n".join([",".join(TAG_COLUMNS), "x" + GOOD, GOOD.replace("0.2", "?")]), encoding="utf-8")
    with pytest.raises(InvalidInput) as caught:
        read_tag_file(path)
    assert len(caught.value.faults) == 2


@pytest.mark.parametrize(
    "content", [b"", b"\xff\xfe1\x00", b"a,b\n1,2\n", b"\x00" * 10, b'"' + b"x" * 200_000 + b'"']
)
def test_what_is_no_tag_table(tmp_path, content):
    """Anything else is refused by name and never a traceback."""
    path = tmp_path / "tags.csv"
    path.write_bytes(content)
    for wrong in (path, tmp_path, tmp_path / "missing.csv"):
        with pytest.raises(InvalidInput):
            read_tag_file(wrong)


@pytest.mark.parametrize(
    "text",
    [
        "",
        "- 1",
        "schema: 2\nframe_id: base_link\nantennas: []",
        "schema: 1\nframe_id: map\nantennas: []",
        "schema: 1\nframe_id: base_link",
        "schema: 1\nframe_id: base_link\nantennas: [1]",
        "schema: 1\nframe_id: base_link\nantennas: [{antenna: .nan}]",
        "!!python/object/apply:os.system ['true']",
        "a: &a [*a]",
        "[" * 1500,
        "\x00",
    ],
)
def test_what_is_no_table_of_readers(tmp_path, text):
    """Another schema or frame, code, or nonsense: one clear error."""
    path = tmp_path / "readers.yaml"
    path.write_text(text, encoding="utf-8")
    with pytest.raises(InvalidInput):
        read_readers_yaml(path)
