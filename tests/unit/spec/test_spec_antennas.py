"""Antennas of a spec: models with parameters, what is told of them, and what is refused."""

import math

import pytest

from layoutopt.antennas.biot_savart import BiotSavartAntenna
from layoutopt.antennas.measured import MeasuredAntenna
from layoutopt.errors import InvalidInput
from layoutopt.spec.layout_file import read_layout, write_layout
from layoutopt.spec.writing import write_spec

HALL = """
[site]
floor = [[0, 0], [8, 0], [8, 5], [0, 5]]
[space]
readers = [{ family = "ring", count = 4, radius = "0.15 m" }]
"""
LOOP = """
antenna = { model = "biot_savart", ampere_turns = "60 mA", least_field = "85 mA/m", tag_tilt = "5 deg", \
metal_depth = "80 mm", covering_loss_share = "3 %", disc = "equal_area" }
antenna_side = ["40 mm", "60 mm"]
"""
TABLE = """
antenna = { model = "measured", table = [["40 mm", "10 mm", "21 mm"], ["40 mm", "30 mm", "12 mm"], \
[0.06, 0.01, 0.03], [0.06, 0.04, 0.0305]] }
antenna_side = ["40 mm", "60 mm"]
"""
MODELS = {"plain loop": 'antenna = "biot_savart"\n', "loop": LOOP, "table": TABLE}


def antennas(spec):
    """Return the antennas of all mounts."""
    return {mount.antenna for mounts in spec.mounts for mount in mounts}


def test_a_loop_with_everything_stated(read):
    """Every parameter arrives in SI, with the unit that its name carries."""
    expected = {
        BiotSavartAntenna(
            side_m=side_m,
            ampere_turns_a=0.06,
            least_field_a_m=0.085,
            tag_tilt_rad=math.radians(5.0),
            metal_depth_m=0.08,
            covering_loss_share=0.03,
            disc="equal_area",
        )
        for side_m in (0.04, 0.06)
    }
    assert antennas(read(HALL + LOOP)) == expected


def test_a_table_of_measured_discs(read):
    """Rows with and without units."""
    table_m = [(0.04, 0.01, 0.021), (0.04, 0.03, 0.012), (0.06, 0.01, 0.03), (0.06, 0.04, 0.0305)]
    found = antennas(read(HALL + TABLE))
    assert found == {MeasuredAntenna(side_m=side_m, table_m=table_m) for side_m in (0.04, 0.06)}


@pytest.mark.parametrize("model", MODELS)
def test_antennas_survive_the_frozen_copy(read, tmp_path, model):
    """The copy of the spec has the same problem, and a layout file the same layout."""
    spec = read(HALL + MODELS[model])
    write_spec(spec, tmp_path / "copy.toml")
    assert read((tmp_path / "copy.toml").read_text(encoding="utf-8")).problem() == spec.problem()
    layout = next(iter(spec.space.layouts()))
    write_layout(layout, spec, tmp_path / "layout.toml")
    assert read_layout(tmp_path / "layout.toml")[1] == layout


def test_what_the_disc_leaves_out_is_told(read):
    """The greatest error of a disc, and rings beside it; a model that is a disc has nothing to tell."""
    near = 'antenna = "biot_savart"\nantenna_side = ["30 mm", "60 mm"]\nantenna_height = ["5 mm", "20 mm"]'
    notes = "\n".join(read(HALL + near).notes)
    worst_m = BiotSavartAntenna(side_m=0.06).disc_error_m(0.005)
    assert f"by up to {1000 * worst_m:.4g} mm (60 mm antenna, 5 mm high)" in notes
    assert "beside their disc, which is left out: 30 mm at 5 mm, 60 mm at 5 mm" in notes
    for quiet in (TABLE, 'antenna_height = "5 mm"'):
        assert not any("disc" in note for note in read(HALL + quiet).notes)


def test_sides_beyond_both_measured_antennas_are_told(read):
    """Unless the drive is the user's own."""
    large = 'antenna_side = "100 mm"\nantenna = '
    assert any("extrapolates for sides of 100 mm" in note for note in read(HALL + large + '"biot_savart"').notes)
    stated = read(HALL + large + '{ model = "biot_savart", ampere_turns = "100 mA" }')
    assert not any("extrapolates" in note for note in stated.notes)


@pytest.mark.parametrize(
    ("text", "place", "words"),
    [
        (
            'antenna = { model = "sphere", metal_depth = "60 mm" }',
            "space.antenna.metal_depth",
            "no such parameter",
        ),
        (
            'antenna = { model = "biot_savart", metal_dept = "60 mm" }',
            "antenna.metal_dept",
            "Did you mean 'metal_depth'",
        ),
        ('antenna = { model = "biot_savart", least_field = "0.1 A/m" }', "space.antenna", "state both or neither"),
        ('antenna = { model = "biot_savart", ampere_turns = "60 mm" }', "ampere_turns", "current"),
        (
            'antenna = { model = "biot_savart", metal_depth = { from = 0.01, to = 0.1 } }',
            "space.antenna.metal_depth",
            "takes one value",
        ),
        (
            'antenna_side = "60 mm"\nantenna = { model = "measured", table = [[0.06, 0.01, 0.03], '
            "[0.06, { from = 0.02, to = 0.04 }, 0.03]] }",
            "space.antenna.table",
            "takes one value",
        ),
        (TABLE.replace('["40 mm", "60 mm"]', '"50 mm"'), "space.antenna", "sides in the table: 40 mm, 60 mm"),
        (TABLE + 'antenna_height = "50 mm"', "space.antenna_height", "40 mm reads from 10 mm to 30 mm"),
        (
            'antenna = { model = "biot_savart", metal_depth = "0 mm" }',
            "space.antenna_height",
            "40 mm reads from no height",
        ),
    ],
)
def test_antennas_that_cannot_be_are_refused(read, text, place, words):
    """With the place in the spec and what would be right."""
    with pytest.raises(InvalidInput) as caught:
        read(HALL + text)
    assert place in str(caught.value)
    assert words in str(caught.value)


def test_thousands_of_sides_and_heights_are_told_of_at_once(read):
    """Only the ends and some between are looked at: the worst disc has the largest side and lowest height."""
    many = (
        'antenna = "biot_savart"\nantennas_per_module = 1\n'
        'antenna_side = { from = "30 mm", to = "80 mm", steps = 40 }\n'
        'antenna_height = { from = "5 mm", to = "20 mm", steps = 50 }'
    )
    notes = "\n".join(read(HALL + many).notes)
    assert "(80 mm antenna, 5 mm high)" in notes
    with pytest.raises(InvalidInput, match="200000 ways to build an antenna"):
        read(HALL + many.replace("steps = 50", "steps = 5000"))
