"""Floors from DXF drawings."""

import math

import ezdxf
import pytest
from plan_drawings import MM, lines, new, rectangle, two_rooms

from layoutopt.errors import InvalidInput
from layoutopt.plans.dxf import read_dxf
from layoutopt.plans.placing import Layers

WALLS = Layers(walls=("WALLS",))


@pytest.fixture
def read(tmp_path):
    def call(drawing, **settings):
        path = tmp_path / "ward.dxf"
        if isinstance(drawing, bytes):
            path.write_bytes(drawing)
        elif drawing is not None:
            drawing.saveas(path)
        return read_dxf(path, place="site.plan", **{"layers": WALLS, **settings})

    return call


def fault_of(read, drawing, **settings):
    with pytest.raises(InvalidInput) as caught:
        read(drawing, **settings)
    assert all(fault.place == "site.plan" for fault in caught.value.faults)
    return str(caught.value)


def ward(units=MM, scale=1.0, shift=(0.0, 0.0)):
    """Two rooms beside each other, in mm times ``scale``."""
    drawing, space = new(units)
    pairs = [[scale * value + shift[number % 2] for number, value in enumerate(pair)] for pair in two_rooms()]
    lines(space, pairs)
    return drawing


@pytest.mark.parametrize("version", ["R12", "R2000", "R2004", "R2007", "R2010", "R2013", "R2018"])
def test_drawings_of_every_version_give_the_same_floor(read, version):
    drawing = ezdxf.new(version)
    drawing.header["$INSUNITS"] = MM
    lines(drawing.modelspace(), two_rooms())
    floor = read(drawing, units="mm")
    assert floor.polygon.area == pytest.approx(24.18)
    assert floor.source == "ward.dxf"


@pytest.mark.parametrize(("code", "scale"), [(MM, 1.0), (5, 0.1), (6, 0.001), (1, 1 / 25.4), (2, 1 / 304.8)])
def test_the_header_names_the_unit_and_the_extents_are_told(read, code, scale):
    floor = read(ward(code, scale))
    assert floor.polygon.area == pytest.approx(24.18, rel=1e-4)
    assert any("measures 8.60 m x 3.40 m" in note and f"$INSUNITS = {code}" in note for note in floor.notes)


def test_the_unit_of_the_spec_rules_over_the_header(read):
    floor = read(ward(1), units="mm")
    assert floor.polygon.area == pytest.approx(24.18)
    assert any("drawn in mm, from the spec" in note for note in floor.notes)


@pytest.mark.parametrize("code", [0, 3, 20])
def test_a_drawing_without_a_unit_of_buildings_is_refused(read, code):
    assert 'Write units = "mm"' in fault_of(read, ward(code))


def test_a_wrong_unit_shows_in_extents_that_no_building_has(read):
    assert "check the unit" in fault_of(read, ward(), units="ft", smallest_room_m2=0.0, thickest_wall_m=100.0)


def test_a_drawing_far_from_its_origin_is_moved_and_the_shift_is_told(read):
    floor = read(ward(shift=(512_345_678.0, 5_400_000_250.0)))
    assert floor.polygon.area == pytest.approx(24.18, rel=1e-4)
    assert floor.polygon.bounds[:2] == pytest.approx((0.678 + 0.0, 0.250), abs=1e-3)
    assert floor.source == "ward.dxf, from (512345, 5400000) m"


def test_layers_that_are_not_named_are_listed_with_a_proposal(read):
    drawing = ward()
    lines(drawing.modelspace(), [(0, 0, 10, 0)], "A-DOOR")
    lines(drawing.modelspace(), [(0, 0, 10, 0)], "Möbel")
    said = fault_of(read, drawing, layers=None)
    assert "WALLS (16 LINE, " in said
    assert "layers = { walls = ['WALLS'], doors = ['A-DOOR'], obstacles = ['Möbel'] }" in said
    assert "measures 8.60 m x 3.40 m" in said


def test_a_layer_that_does_not_exist_is_answered_with_the_nearest(read):
    assert "Did you mean 'WALLS'?" in fault_of(read, ward(), layers=Layers(walls=("WALS",)))


def test_a_layer_named_twice_is_refused(read):
    assert "for walls and for doors" in fault_of(read, ward(), layers=Layers(walls=("WALLS",), doors=("walls",)))


def test_names_of_layers_count_in_any_case_and_others_are_told(read):
    drawing = ward()
    lines(drawing.modelspace(), [(0, 0, 10, 0)], "GRID")
    drawing.modelspace().add_text("hall", dxfattribs={"layer": "TEXT"})
    notes = read(drawing, layers=Layers(walls=("walls",))).notes
    assert "layers that were left out: GRID" in notes
    assert any("1 TEXT on TEXT" in note for note in notes)


def test_a_layer_written_in_two_ways_is_one(read):
    drawing, space = new()
    lines(space, two_rooms()[:7], "WALLS")
    lines(space, two_rooms()[7:], "Walls")
    assert read(drawing).polygon.area == pytest.approx(24.18)


def test_obstacles_and_zones_come_from_their_layers(read):
    drawing = ward()
    lines(drawing.modelspace(), rectangle(500, 500, 1000, 500), "RACKS")
    lines(drawing.modelspace(), rectangle(6000, 500, 5000, 1000), "PLATE")
    floor = read(drawing, layers=Layers(walls=("WALLS",), obstacles=("RACKS",), metal=("PLATE",)))
    assert [obstacle.area for obstacle in floor.obstacles] == pytest.approx([0.5])
    assert [(zone.name, zone.metal) for zone in floor.zones] == [("metal_1", True)]
    assert floor.zones[0].region.area == pytest.approx(2.2)
    assert any("cut 2.8 m² of metal" in note for note in floor.notes)


def test_arcs_on_door_layers_open_walls_and_blocks_may_hold_them(read):
    """The wall runs on behind the door, whose symbol is a block that is turned, mirrored and placed."""
    drawing, space = new()
    lines(space, [*rectangle(0, 0, 8000, 3000), (4000, 0, 4000, 3000)])
    block = drawing.blocks.new("DOOR")
    block.add_arc((0, 0), 900, 0, 90, dxfattribs={"layer": "0"})
    block.add_line((0, 0), (0, 900), dxfattribs={"layer": "0"})
    space.add_blockref("DOOR", (4000, 1000), dxfattribs={"layer": "DOORS", "rotation": 90, "yscale": -1})
    floor = read(drawing, layers=Layers(walls=("WALLS",), doors=("DOORS",)))
    assert floor.polygon.geom_type == "Polygon"
    assert floor.polygon.area == pytest.approx(24.0 - 0.3 + 0.09)


def closed_shape(kind, space):
    """Draw a room of known area, m², in mm."""
    attributes = {"layer": "WALLS"}
    if kind == "circle":
        space.add_circle((0, 0), 2000, dxfattribs=attributes)
        return math.pi * 4.0
    if kind == "arcs":
        space.add_arc((0, 0), 2000, 0, 180, dxfattribs=attributes)
        space.add_line((-2000, 0), (2000, 0), dxfattribs=attributes)
        return math.pi * 2.0
    if kind == "ellipse":
        space.add_ellipse((0, 0), (3000, 0), 0.5, dxfattribs=attributes)
        return math.pi * 4.5
    if kind == "bulges":
        space.add_lwpolyline(
            [(-1000, 0, 0), (1000, 0, 1), (1000, 2000, 0), (-1000, 2000, 1)],
            "xyb",
            close=True,
            dxfattribs=attributes,
        )
        return 4.0 + math.pi
    if kind == "old polyline":
        space.add_polyline2d(
            [(-1000, 0, 0), (1000, 0, 1), (1000, 2000, 0), (-1000, 2000, 1)],
            "xyb",
            close=True,
            dxfattribs=attributes,
        )
        return 4.0 + math.pi
    if kind == "polyline in space":
        space.add_polyline3d([(0, 0, 0), (4, 0, 9), (4, 3, 0), (0, 3, 0)], close=True, dxfattribs=attributes)
        for entity in space:
            entity.transform(ezdxf.math.Matrix44.scale(1000))
        return 12.0
    spline = space.add_spline(degree=1, dxfattribs=attributes)
    spline.control_points = [(0, 0), (4000, 0), (4000, 3000), (0, 3000), (0, 0)]
    spline.knots = [0, 0, 1, 2, 3, 4, 4]
    return 12.0


SHAPES = ["circle", "arcs", "ellipse", "bulges", "old polyline", "polyline in space", "spline"]


@pytest.mark.parametrize("kind", SHAPES)
def test_curves_are_followed_within_a_millimetre(read, kind):
    drawing, space = new()
    area = closed_shape(kind, space)
    floor = read(drawing)
    # Within 1 mm of its outline, of at most 15 m, the area is off by less than 0.015 m².
    assert floor.polygon.area == pytest.approx(area, abs=0.015)
    if kind == "polyline in space":
        assert any("heights up to 9 m were dropped" in note for note in floor.notes)


def test_curves_within_a_coarser_tolerance_have_fewer_corners(read):
    drawing, space = new()
    closed_shape("circle", space)
    fine, coarse = read(drawing).polygon, read(drawing, tolerance_m=0.05).polygon
    assert len(coarse.exterior.coords) < len(fine.exterior.coords) / 4
    assert coarse.area == pytest.approx(math.pi * 4.0, abs=0.05 * 4 * math.pi)


@pytest.mark.parametrize("depth", [1, 3, 16])
def test_blocks_within_blocks_are_taken_apart(read, depth):
    drawing, space = new()
    inner = drawing.blocks.new("B0")
    lines(inner, two_rooms(), "0")
    for level in range(1, depth):
        drawing.blocks.new(f"B{level}").add_blockref(f"B{level - 1}", (0, 0))
    space.add_blockref(f"B{depth - 1}", (1000, 0), dxfattribs={"layer": "WALLS", "xscale": 2, "yscale": 2})
    floor = read(drawing)
    assert floor.polygon.area == pytest.approx(4 * 24.18)


def test_an_array_of_blocks_draws_each_copy(read):
    drawing, space = new()
    lines(drawing.blocks.new("CELL"), rectangle(0, 0, 3000, 3000), "0")
    array = space.add_blockref("CELL", (0, 0), dxfattribs={"layer": "WALLS"})
    array.grid(size=(2, 3), spacing=(4000, 5000))
    assert [room.area for room in read(drawing).rooms] == pytest.approx([9.0] * 6)


def bomb():
    """Ten levels of ten insertions each: 10 billion lines in a small file."""
    drawing, space = new()
    lines(drawing.blocks.new("B0"), [(0, 0, 1, 0)])
    for level in range(1, 11):
        block = drawing.blocks.new(f"B{level}")
        for number in range(10):
            block.add_blockref(f"B{level - 1}", (number, 0))
    space.add_blockref("B10", (0, 0))
    return drawing


def huge_array():
    drawing, space = new()
    lines(drawing.blocks.new("CELL"), [(0, 0, 1, 0)])
    space.add_blockref("CELL", (0, 0)).grid(size=(30_000, 30_000), spacing=(1, 1))
    return drawing


def mutual():
    drawing, space = new()
    drawing.blocks.new("A").add_blockref("B", (0, 0))
    drawing.blocks.new("B").add_blockref("A", (0, 0))
    space.add_blockref("A", (0, 0))
    return drawing


def deep():
    drawing, space = new()
    lines(drawing.blocks.new("B0"), two_rooms())
    for level in range(1, 20):
        drawing.blocks.new(f"B{level}").add_blockref(f"B{level - 1}", (0, 0))
    space.add_blockref("B19", (0, 0))
    return drawing


@pytest.mark.parametrize(
    ("make", "said"),
    [
        (huge_array, "more than 300,000 entities"),
        (mutual, "cycle"),
        (deep, "nested more than 16 deep"),
    ],
)
def test_blocks_without_end_are_refused(read, make, said):
    assert said in fault_of(read, make())


def test_a_bomb_of_blocks_is_refused(read, monkeypatch):
    monkeypatch.setattr("layoutopt.plans.dxf._MOST_ENTITIES", 3000)
    assert "more than 3,000 entities" in fault_of(read, bomb())


def test_blocks_within_themselves_are_refused_even_if_damage_is_accepted(read):
    assert "nested more than 16 deep" in fault_of(read, mutual(), accept_recovered=True)


def damaged(tmp_path):
    """A drawing in which one number cannot be read, which ezdxf would replace by another."""
    path = tmp_path / "sound.dxf"
    ward().saveas(path)
    content = path.read_bytes()
    return content.replace(b"\n3200.0\n", b"\n3200.0x\n", 1)


def test_damage_is_refused_with_what_ezdxf_says_and_read_only_when_allowed(read, tmp_path):
    content = damaged(tmp_path)
    assert "is damaged" in fault_of(read, content)
    assert "accept_recovered = true" in fault_of(read, content)
    floor = read(content, accept_recovered=True)
    assert any(note.startswith("repaired ward.dxf:") for note in floor.notes)


def test_what_ezdxf_mends_of_what_is_drawn_counts_as_damage(read, tmp_path):
    """An arc without a direction of its own is given one, which is refused unless it is allowed."""
    drawing = ward()
    drawing.modelspace().add_arc((0, 0), 500, 0, 90, dxfattribs={"layer": "WALLS", "extrusion": (0, 0, -1)})
    path = tmp_path / "sound.dxf"
    drawing.saveas(path)
    content = path.read_bytes().replace(b"230\n-1.0\n", b"230\n0.0\n")
    assert "is damaged" in fault_of(read, content)


def test_a_tolerance_of_nothing_is_refused(read):
    assert "at least 0.01 mm" in fault_of(read, ward(), tolerance_m=0.0)


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (b"AC1027\x00\x00", "a DWG drawing"),
        (b"%PDF-1.7", "a PDF document"),
        (b"\x89PNG\r\n", "a PNG image"),
        (b"just words", "is no DXF drawing: it begins with b'just words'"),
        (b"0\nSECTION\n", "damaged"),
        (b"\x00" * 100, "is no DXF drawing"),
        (b"", "is empty"),
    ],
)
def test_files_that_are_no_drawing_are_told_apart(read, content, said):
    assert said in fault_of(read, content)


def test_a_drawing_in_paper_space_only_is_refused_with_the_place_of_its_lines(read):
    drawing, _ = new()
    lines(drawing.layout("Layout1"), two_rooms())
    assert "paper space holds 1" in fault_of(read, drawing)


def test_numbers_that_are_no_numbers_are_refused(read):
    drawing = ward()
    drawing.modelspace().add_line((0, 0), (math.nan, 0), dxfattribs={"layer": "WALLS"})
    assert "no numbers" in fault_of(read, drawing)


def test_a_stray_line_far_off_is_refused(read):
    drawing = ward()
    lines(drawing.modelspace(), [(0, 0, 5e12, 0)])
    assert "km apart" in fault_of(read, drawing)
