"""Plan files made to mislead or to cost time: each ends in one error that says where, or in a note."""

import json
import time

import ezdxf
import numpy as np
import pytest
from plan_drawings import lines, new, rectangle, two_rooms

from layoutopt.errors import InvalidInput
from layoutopt.spec.reading import read_spec

HALL = [[0, 0], [12, 0], [12, 8], [0, 8], [0, 0]]
LONGEST_S = 8.0  # of this process alone; two are needed
DRAWING = 'file = "plan.dxf"\nlayers = { walls = ["WALLS"] }\n'
GEOJSON = 'file = "plan.geojson"\nunits = "m"\n'
MAP = "resolution: 0.05\norigin: [0, 0, 0]\nimage: none.pgm\n"


@pytest.fixture
def read(tmp_path):
    def call(plan, settings):
        """Return the spec of a floor with that plan: a drawing, or the content of a file."""
        name = settings.split('"')[1]
        if isinstance(plan, ezdxf.document.Drawing):
            plan.saveas(tmp_path / name)
        else:
            (tmp_path / name).write_bytes(plan if isinstance(plan, bytes) else plan.encode())
        (tmp_path / "spec.toml").write_text("[site.plan]\n" + settings, encoding="utf-8")
        return read_spec(tmp_path / "spec.toml")

    return call


@pytest.fixture
def refused(read):
    def call(plan, settings):
        began = time.process_time()
        with pytest.raises(InvalidInput) as caught:
            read(plan, settings)
        assert time.process_time() - began < LONGEST_S
        return str(caught.value)

    return call


def feature(ring=HALL, properties=None):
    return {"type": "Feature", "properties": properties, "geometry": {"type": "Polygon", "coordinates": [ring]}}


def collection(*features):
    return json.dumps({"type": "FeatureCollection", "features": features})


def drawn(*pairs, layer="WALLS"):
    drawing, space = new()
    lines(space, [*two_rooms(), *pairs], layer)
    return drawing, space


@pytest.mark.parametrize(
    ("document", "said"),
    [
        (collection(feature([[0, 0], [True, 0], [12, 8], [0, 0]])), "no rings of at least three corners"),
        (collection(feature(properties=["metal"])), "its properties are no object"),
        (collection(feature(properties=True)), "its properties are no object"),
        ('{"type": "Polygon", "coordinates": [], "coordinates": []}', "holds the key 'coordinates' twice"),
    ],
)
def test_geojson_that_could_be_read_in_two_ways_is_refused(refused, document, said):
    assert said in refused(document, GEOJSON)


def test_corners_in_no_order_are_refused_before_they_are_mended(refused):
    """To mend a ring of 3,000 random corners, which crosses itself a million times, would take minutes."""
    ring = np.random.default_rng(1).uniform(0.0, 10.0, (3000, 2)).tolist()
    said = refused(collection(feature([*ring, ring[0]])), GEOJSON + "repair = true\n")
    assert "cross each other more than 100,000 times" in said
    assert "order in which one walks round" in said


def test_what_a_geojson_file_holds_for_nothing_is_told(read):
    """A feature without a geometry, and an obstacle that stands beyond the floor."""
    far = [[x + 50, y] for x, y in HALL]
    nothing = {"type": "Feature", "properties": None, "geometry": None}
    spec = read(collection(feature(), feature(far, {"kind": "obstacle"}), nothing), GEOJSON)
    assert not spec.site.obstacles
    notes = " ".join(spec.notes)
    assert "left out 1 obstacle(s) beyond the floor" in notes
    assert "passed over 1 geometries of type null" in notes


def test_a_plan_is_named_once_in_the_place_of_a_fault(refused):
    said = refused(collection(feature([[0, 0], [1, 1]])), GEOJSON)
    assert said.count("site.plan") == 1


def test_lines_that_cross_everywhere_are_refused_before_they_are_cut(refused):
    """700 lines across 700 others among the walls, as hatching has them."""
    across = [(x, -200.0, x, 3200.0) for x in np.linspace(0.0, 8000.0, 700)]
    along = [(0.0, y, 8000.0, y) for y in np.linspace(0.0, 3000.0, 700)]
    assert "Leave layers of hatching" in refused(drawn(*across, *along)[0], DRAWING)


def test_blocks_of_blocks_without_number_are_refused_before_any_is_taken_apart(refused):
    """Twelve levels of ten insertions each would draw 10^12 lines."""
    drawing, space = drawn()
    lines(drawing.blocks.new("L0"), rectangle(0, 0, 10, 10), "0")
    for level in range(1, 12):
        block = drawing.blocks.new(f"L{level}")
        for place in range(10):
            block.add_blockref(f"L{level - 1}", (place, place))
    space.add_blockref("L11", (0, 0))
    assert "more than 300,000 entities" in refused(drawing, DRAWING)


def test_arrays_with_a_negative_count_do_not_make_room_for_others(refused):
    """The count of a damaged array must not be taken off that of the next one."""
    drawing, space = drawn()
    lines(drawing.blocks.new("G"), rectangle(0, 0, 10, 10), "0")
    space.add_blockref("G", (0, 0)).grid((30_000, 30_000), (20, 20)).dxf.row_count = -30_000
    space.add_blockref("G", (0, 0)).grid((3_000, 3_000), (20, 20))
    assert "more than 300,000 entities" in refused(drawing, DRAWING)


def test_a_block_that_is_missing_counts_as_damage(refused, read):
    """Its walls may be in it; with the damage accepted the loss stands in the notes."""
    drawing, space = drawn()
    space.add_blockref("LOST", (0, 0), dxfattribs={"layer": "WALLS"})
    assert "without required BLOCK" in refused(drawing, DRAWING)
    notes = read(drawing, DRAWING + "accept_recovered = true\n").notes
    assert any("without required BLOCK" in note for note in notes)


def test_a_layer_that_is_off_is_told_in_any_case_of_letters(read):
    drawing, _ = drawn()
    drawing.layers.add("walls").off()
    assert any("switched off or frozen: WALLS" in note for note in read(drawing, DRAWING).notes)


@pytest.mark.parametrize(
    ("content", "said"),
    [
        (b"ISO-10303-21;\nHEADER;", "an IFC or STEP model"),
        (b"\xff\xfe0\x00\n\x00", "is no DXF drawing"),
        (b"<html>", "is no DXF drawing"),
    ],
)
def test_other_formats_called_dxf_are_not_called_damaged(refused, content, said):
    """To accept what is left of them would be the wrong advice."""
    message = refused(content, DRAWING)
    assert said in message
    assert "accept_recovered" not in message


def test_references_within_a_key_of_a_map_are_not_followed(refused):
    """Written out, that key would be a list of 10^9 letters."""
    key = "&a0 [x, x, x, x, x, x, x, x, x, x]"
    for level in range(1, 9):
        key = f"&a{level} [{key}, {', '.join([f'*a{level - 1}'] * 9)}]"
    assert "none.pgm' does not exist" in refused(f"{MAP}? {key}\n: 1\n", 'file = "plan.yaml"\n')


def test_a_gap_wider_than_the_image_is_refused(refused, tmp_path):
    """The search for the outside would need memory for the gap around the image."""
    from PIL import Image

    values = np.full((200, 300), 255, dtype=np.uint8)
    values[20:180, 20:280] = 0
    values[24:176, 24:276] = 255
    Image.fromarray(values).save(tmp_path / "made.png")
    scale = 'scale = { first = [20, 20], second = [280, 20], distance = "10 m" }\n'
    said = refused((tmp_path / "made.png").read_bytes(), f'file = "plan.png"\ngap = "1 km"\n{scale}')
    assert "whose shorter side has" in said


def test_a_demand_on_the_length_of_a_list_reads_as_a_sentence(refused):
    assert "Write a value that has at least 1 character." in refused(
        drawn()[0], 'file = "plan.dxf"\nlayers = { walls = [""] }\n'
    )
