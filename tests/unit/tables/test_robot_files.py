"""What a robot reads: tag map after its schema, antennas as URDF, occupancy map; and the work to be done."""

import csv
import dataclasses
import json
from importlib import resources
from xml.etree import ElementTree

import jsonschema
import numpy as np
import pytest
import shapely
import yaml
from hypothesis import given
from hypothesis import strategies as st
from shapely.geometry import Point, box

from layoutopt.antennas.sphere import SphereAntenna
from layoutopt.errors import InvalidInput
from layoutopt.layout import FloorTags, Layout, ZonePattern
from layoutopt.parts import Scope, bill_of_material, default_prices, needs
from layoutopt.patterns.square import square
from layoutopt.protocols import Mount
from layoutopt.readers.cross import cross
from layoutopt.readers.profiles import COMMERCIAL
from layoutopt.site import Site, Tiling, Zone
from layoutopt.tables.readers import antenna_rows, write_readers_urdf
from layoutopt.tables.robot_map import write_robot_map
from layoutopt.tables.tag_files import read_tag_file, tag_header, write_tag_files
from layoutopt.tables.tags import tag_rows
from layoutopt.tables.work_plan import work_plan, write_work_plan_csv

SITE = Site(
    name="ward",
    floor=box(-1.03, -1, 2, 1).difference(box(1.5, 0.5, 2, 1)),
    obstacles=(box(0.2, -0.4, 0.7, 0.1),),
    zones=(Zone(name="dock", region=box(-1, -1, -0.5, -0.5)),),
    tiling=Tiling(size_m=0.3),
)
MOUNT = Mount(antenna=SphereAntenna(side_m=0.06), height_m=0.02, profile=COMMERCIAL, antennas_per_module=4)
LAYOUT = Layout(
    floor_tags=FloorTags(zones=(ZonePattern(zone="", pattern=square(pitch_m=0.13)),), placement_sigma_m=0.003),
    readers=(cross(count=8, mount=MOUNT),),
)
TAG_MAP = LAYOUT.floor_tags.lay_on(SITE)
SCHEMA = json.loads(resources.files("layoutopt.tables").joinpath("tags.schema.json").read_text(encoding="utf-8"))


def write_tags(folder, tag_map=TAG_MAP, tag_part="label", site=SITE):
    """Write the three files of a tag map."""
    return write_tag_files(folder, tag_header(LAYOUT, site, len(tag_map)), tag_rows(tag_map, site, tag_part))


def test_the_json_is_what_its_schema_says_and_the_yaml_is_the_same(tmp_path):
    """A validator of JSON schemas accepts it; plain YAML and plain JSON hold the same values."""
    _, as_yaml, as_json = write_tags(tmp_path)
    table = json.loads(as_json.read_text(encoding="utf-8"))
    jsonschema.Draft202012Validator(SCHEMA).validate(table)
    assert yaml.safe_load(as_yaml.read_text(encoding="utf-8")) == table
    assert table["tag_count"] == len(table["tags"]) == len(TAG_MAP)
    assert (table["datum_x_m"], table["datum_y_m"]) == SITE.datum_m
    assert {tag["uid"] for tag in table["tags"]} == {None}


@pytest.mark.parametrize("name", ["frame_id", "tags", "tag_count", "generator"])
def test_the_schema_refuses_what_is_no_tag_map(tmp_path, name):
    """A table without one of its parts, or with a tag too much in it, does not pass."""
    table = json.loads(write_tags(tmp_path)[2].read_text(encoding="utf-8"))
    validator = jsonschema.Draft202012Validator(SCHEMA)
    table["tags"][0]["colour"] = "red"
    assert not validator.is_valid(table)
    del table["tags"][0]["colour"]
    assert validator.is_valid(table)
    del table[name]
    assert not validator.is_valid(table)


def test_the_three_files_are_read_back_as_one_map(tmp_path):
    """CSV, YAML and JSON give the same rows, and those are the tag map to the micrometre."""
    as_csv, as_yaml, as_json = (read_tag_file(path) for path in write_tags(tmp_path))
    assert as_csv == as_yaml == as_json == tuple(tag_rows(TAG_MAP, SITE, "label"))
    places_m = np.array([(row.x_m, row.y_m) for row in as_csv])
    np.testing.assert_allclose(places_m, TAG_MAP.xy_m, rtol=0, atol=5.1e-7)


@given(st.text(st.characters(exclude_categories=["Cs"]), min_size=1, max_size=12))
def test_any_text_comes_back_from_all_three_files(tmp_path_factory, text):
    """Quotes, control characters, what is no character of YAML, and astral ones."""
    folder = tmp_path_factory.mktemp("any")
    tag_map = FloorTags(zones=LAYOUT.floor_tags.zones).lay_on(dataclasses.replace(SITE, floor=box(0, 0, 0.2, 0.2)))
    tag_map = dataclasses.replace(tag_map, uid=(text,) * len(tag_map))
    for path in write_tags(folder, tag_map, tag_part=text):
        assert {(row.uid, row.type) for row in read_tag_file(path)} == {(text, text)}


def test_no_tag_is_a_map_too(tmp_path):
    """An empty map is a header and a list without a tag."""
    tag_map = dataclasses.replace(LAYOUT.floor_tags, tag_size_m=(5.0, 5.0)).lay_on(SITE)
    assert [read_tag_file(path) for path in write_tags(tmp_path, tag_map)] == [(), (), ()]


def test_a_count_that_is_wrong_leaves_the_old_files(tmp_path):
    """The header is written first; if it lied, nothing is replaced."""
    before = [path.read_bytes() for path in write_tags(tmp_path)]
    with pytest.raises(ValueError, match="the header says 3 tags"):
        write_tag_files(tmp_path, tag_header(LAYOUT, SITE, 3), tag_rows(TAG_MAP, SITE, "label"))
    names = ["tags.csv", "tags.yaml", "tags.json"]
    assert [(tmp_path / name).read_bytes() for name in names] == before
    assert len(list(tmp_path.iterdir())) == 3


@pytest.mark.parametrize(
    ("name", "text", "complaint"),
    [
        ("tags.json", "[" * 100_000, "this is no JSON"),
        ("tags.json", '{"schema": 2, "frame_id": "map", "tags": []}', "this is no tag map"),
        ("tags.json", '{"schema": 1, "frame_id": "map", "tags": [1]}', "tags[0]: this is no tag"),
        ("tags.json", '{"schema": 1, "frame_id": "map", "tags": [NaN]}', "this is no JSON"),
        ("tags.yaml", "schema: 1\nframe_id: map\ntags: {}", "this is no tag map"),
        ("tags.yaml", "!!python/object/apply:os.system ['true']", "no YAML"),
        ("tags.yaml", "[" * 1500, "no YAML"),
        ("tags.yaml", "#" * 5_000_001, "over 5000000 bytes. Give the CSV of the same map."),
        ("tags.txt", "", "It ends in .csv, .yaml or .json"),
    ],
)
def test_what_is_no_tag_map_is_refused(tmp_path, name, text, complaint):
    """One clear message, whatever lies there."""
    (tmp_path / name).write_text(text, encoding="utf-8")
    with pytest.raises(InvalidInput) as caught:
        read_tag_file(tmp_path / name)
    assert complaint in str(caught.value)


def test_wrong_values_are_named_by_tag_and_column(tmp_path):
    """All of them at once."""
    path = write_tags(tmp_path)[2]
    table = json.loads(path.read_text(encoding="utf-8"))
    table["tags"][1]["x_m"] = "left"
    table["tags"][2]["tag_id"] = 1.5
    table["tags"][3]["tag_id"] = 1
    path.write_text(json.dumps(table), encoding="utf-8")
    with pytest.raises(InvalidInput) as caught:
        read_tag_file(path)
    for words in (
        "tags[1] x_m: 'left' is no finite number",
        "tags[2] tag_id: 1.5 is no whole",
        "tag 1 was already",
    ):
        assert words in str(caught.value)


def test_urdf_has_a_link_and_a_fixed_joint_for_each_antenna(tmp_path):
    """Child of base_link, at the pose of the layout."""
    write_readers_urdf(tmp_path / "readers.urdf", LAYOUT)
    root = ElementTree.parse(tmp_path / "readers.urdf").getroot()
    links = {link.get("name") for link in root.iter("link")}
    joints = list(root.iter("joint"))
    assert root.tag == "robot"
    assert "base_link" not in links
    for row, joint in zip(antenna_rows(LAYOUT), joints, strict=True):
        assert joint.get("type") == "fixed"
        assert joint.find("parent").get("link") == "base_link"
        assert joint.find("child").get("link") in links
        place = [float(value) for value in joint.find("origin").get("xyz").split()]
        turn = [float(value) for value in joint.find("origin").get("rpy").split()]
        assert place == pytest.approx([row.x_m, row.y_m, row.z_m], abs=1e-6)
        assert turn == pytest.approx([0.0, 0.0, row.yaw_rad], abs=1e-6)


def read_map(folder):
    """Read a ROS map as its server does: probabilities by row from the bottom, resolution and origin."""
    table = yaml.safe_load((folder / "map.yaml").read_text(encoding="utf-8"))
    content = (folder / table["image"]).read_bytes()
    magic, size, largest, pixels = content.split(b"\n", 3)
    assert (magic, largest) == (b"P5", b"255")
    columns, rows = map(int, size.split())
    grey = np.frombuffer(pixels, dtype=np.uint8).reshape(rows, columns)[::-1]
    return table, (255 - grey.astype(float)) / 255.0


@pytest.mark.parametrize("resolution_m", [0.05, 0.07])
def test_the_map_is_free_where_a_robot_may_be(tmp_path, resolution_m):
    """Centre by centre: free on open floor away from walls, occupied on walls and obstacles, unknown outside."""
    write_robot_map(tmp_path, SITE, resolution_m)
    table, occupied = read_map(tmp_path)
    assert table["origin"][2] == 0.0
    half_diagonal_m = resolution_m * np.sqrt(0.5) + 1e-9
    for row in range(occupied.shape[0]):
        for column in range(occupied.shape[1]):
            x_m = table["origin"][0] + (column + 0.5) * resolution_m
            y_m = table["origin"][1] + (row + 0.5) * resolution_m
            state = (
                "occupied"
                if occupied[row, column] > table["occupied_thresh"]
                else "free"
                if occupied[row, column] < table["free_thresh"]
                else "unknown"
            )
            centre = Point(x_m, y_m)
            border_m = SITE.open_floor.boundary.distance(centre)
            if border_m > half_diagonal_m:
                inside = "occupied" if shapely.covers(SITE.floor, centre) else "unknown"
                assert state == ("free" if shapely.covers(SITE.open_floor, centre) else inside)
            if border_m < resolution_m / 4.0:
                assert state == "occupied"


def test_no_wall_has_a_gap(tmp_path):
    """The free cells are joined to nothing that is unknown: one cannot leave the map through its walls."""
    from scipy.ndimage import label

    write_robot_map(tmp_path, SITE)
    table, occupied = read_map(tmp_path)
    walkable = occupied < table["occupied_thresh"]
    parts, _ = label(walkable)
    free = occupied < table["free_thresh"]
    assert not set(np.unique(parts[free])) & set(np.unique(parts[walkable & ~free]))


def test_a_map_of_too_many_cells_is_refused(tmp_path):
    """Nobody waits for a picture of ten thousand million cells."""
    with pytest.raises(InvalidInput, match="Take larger cells"):
        write_robot_map(tmp_path, SITE, 2e-5)


def test_the_hours_of_the_work_are_those_of_the_bill(tmp_path):
    """Their sum is the labour that is paid, and each zone and robot has its part."""
    prices = default_prices()
    found = needs(LAYOUT, len(TAG_MAP), 3)
    steps = work_plan(found, TAG_MAP, SITE, 3, prices)
    bill = bill_of_material(LAYOUT, TAG_MAP, 3, prices)
    labour_hours = sum(line.quantity for line in bill.lines if line.scope is Scope.LABOUR and line.unit == "hour")
    assert sum(step.hours for step in steps) == pytest.approx(labour_hours)
    placed = {step.where: step.quantity for step in steps if step.what.startswith("place tags")}
    assert placed == {
        "floor outside all zones": int((TAG_MAP.zone < 0).sum()),
        "dock": int((TAG_MAP.zone == 0).sum()),
    }
    assert {step.where for step in steps} >= {"robot 1", "robot 2", "robot 3"}
    write_work_plan_csv(tmp_path / "work_plan.csv", steps)
    with (tmp_path / "work_plan.csv").open(encoding="utf-8", newline="") as stream:
        rows = list(csv.DictReader(stream))
    assert [row["step"] for row in rows[:-1]] == [str(number) for number in range(1, len(steps) + 1)]
    assert float(rows[-1]["hours"]) == pytest.approx(labour_hours, abs=1e-4)
