import dataclasses
import math
import tomllib

import pytest
from hypothesis import given
from hypothesis import strategies as st

from layoutopt.errors import InvalidInput
from layoutopt.prices import default_prices
from layoutopt.spec.reading import read_spec
from layoutopt.spec.template import built_in
from layoutopt.spec.writing import write_spec
from layoutopt.spec.written_numbers import as_written
from layoutopt.units import parse_quantity

ODD = """
seed = 3
[site]
name = "odd [hall], \\u2028 with \\"quotes\\""
floor = [
    [[[0.1, 0], [8, 0.3333333333333333], [8, 5], [0, 5]], [[1, 1], [2, 1], [2, 2]]],
    [[[9, 0], [12, 0], [12, 3]]],
]
obstacles = [[["301 mm", 2], [3.2, 2], [3.2, 2.7]]]
tiling = { size = "0.33 m", angle = "11 deg" }
[[site.zone]]
name = "dock"
region = [[3, 3], [5, 3], [5, 4.9]]
target_error = "7.5 mm"
[[site.zone]]
name = "plate"
region = [[5, 1], [6, 1], [6, 2]]
metal = true
tags = false
[robots]
count = 3
speed = "1 km/h"
drive = "omnidirectional"
odometry = { rotation = "0.7 deg/m", translation_after_1s = "0.1 in", rotation_after_1s = "0.33 deg" }
gyro = { random_walk_after_1s = "0.0071 deg", bias = "0.37 deg/s", fitted = true }
pause = "1.1 min"
heading = "-13 deg"
routes = [[5, 2], [6, "3000 mm"]]
[parts]
tag = "puck"
reader_profile = "mi2016"
[space]
antenna_side = { from = "30 mm", to = "70 mm", steps = 4 }
antenna_height = ["8 mm", "20 mm"]
antennas_per_module = [8, 1, 2]
origin = [0.1, 0.2]
placement_sigma = "1 mm"
readers = [
    { family = "grid", rows = [1, 2], columns = [2, 3, 4], spacing = "80 mm" },
    { family = "listed", points = [[0.1, 0], [-0.1, 0.0333]] },
    { family = "cross", count = 4 },
]
patterns = [
    { family = "square", pitch = { from = "60 mm", to = "300 mm", steps = 8 } },
    { family = "triangular", pitch = "4 in", row_gap = 0.1 },
    { family = "listed", points = [[0.1, 0], [0.2, 0.0333]], cell = ["0.4 m", 0.3] },
    { family = "square", pitch = "55 mm", zone = "dock" },
]
[goal]
minimise = ["cost", "dock.position_error_mean"]
limits = ["position_error_variance <= 1 cm2", "heading_error_variance <= 0.01", "heading_error_max <= 7 deg",
          "lost_share <= 3 %", "time_to_localise <= 2 s", "cost <= 9999.99 EUR",
          "run_coverage >= 97.5 %", "expected_reads_per_m >= 12.5"]
budget = "7000 EUR"
[study]
validate_with = ["midrange"]
step = "33 ms"
start_uncertainty = { heading = "1.1 deg" }
start_known = false
held_out_faults = { tag_offset = [0.001, 0], clock_error = "20 ms", antenna_height_error = "-1 mm" }
[study.design_faults]
slips_per_m = 3
slip_sigma = "0.1 in"
asynchronous = true
"""


def assert_equal_problems(first, second):
    problem, again = first.problem(), second.problem()
    assert again.design.site.key == problem.design.site.key
    assert again.design.key == problem.design.key
    assert [scenario.key for scenario in again.held_out] == [scenario.key for scenario in problem.held_out]
    assert [layout.key for layout in again.space.layouts()] == [layout.key for layout in problem.space.layouts()]
    assert again == problem
    assert second.prices.key == first.prices.key


@pytest.fixture
def odd_spec(tmp_path):
    path = tmp_path / "odd.toml"
    path.write_text(ODD, encoding="utf-8")
    return read_spec(path)


def test_frozen_copy_of_an_odd_spec_reads_back_to_an_equal_problem(odd_spec, tmp_path):
    """Holes, parts, foreign units, ranges, listed families and odd names survive without the loss of a bit."""
    write_spec(odd_spec, tmp_path / "frozen.toml")
    assert_equal_problems(odd_spec, read_spec(tmp_path / "frozen.toml"))


def test_frozen_copy_of_the_example_reads_back_to_an_equal_problem(tmp_path):
    """The built-in ward, written and read, asks the same question: same keys of site, scenarios and layouts."""
    spec = read_spec(built_in())
    write_spec(spec, tmp_path / "frozen.toml")
    assert_equal_problems(spec, read_spec(tmp_path / "frozen.toml"))


def test_a_start_that_is_told_wrongly_survives_the_copy(tmp_path):
    """Offsets in odd units, and a kidnapping, are read back to the last bit."""
    text = ODD.replace("start_known = false\n", "")
    text += 'start_offset = { x = "1 in", y = "-33 mm", heading = "86 deg" }\nkidnapped_at = "0.4 min"\n'
    path = tmp_path / "odd.toml"
    path.write_text(text, encoding="utf-8")
    spec = read_spec(path)
    assert spec.design.faults.start_offset == (0.0254, -0.033, math.radians(86.0))
    write_spec(spec, tmp_path / "frozen.toml")
    assert_equal_problems(spec, read_spec(tmp_path / "frozen.toml"))


def test_ranges_without_steps_survive_the_copy(tmp_path):
    """Of sides, heights, parameters and numbers within a list; the copy has the same coordinates."""
    path = tmp_path / "free.toml"
    path.write_text(
        "schema = 1\n[site]\nfloor = [[0,0],[6,0],[6,5],[0,5]]\n[space]\n"
        'antenna_side = { from = "40 mm", to = "1.7 in" }\nantenna_height = { from = "9 mm", to = "21 mm" }\n'
        'readers = [{ family = "ring", count = { from = 4, to = 6 }, radius = { from = "8 cm", to = "11 cm" } },\n'
        '{ family = "listed", points = [[0.1, { from = -0.05, to = "33 mm" }], [0, -0.1], [0, 0.1], [0, 0.2]] }]\n'
        'patterns = [{ family = "square", pitch = { from = "99 mm", to = "300 mm" } }]\n',
        encoding="utf-8",
    )
    spec = read_spec(path)
    assert sum(axis.continuous for axis in spec.space.axes) == 5
    write_spec(spec, tmp_path / "frozen.toml")
    again = read_spec(tmp_path / "frozen.toml")
    assert_equal_problems(spec, again)
    assert again.space.axes == spec.space.axes


def test_a_copy_of_a_copy_is_the_same_file(odd_spec, tmp_path):
    """Writing is deterministic and settles at once: copy and copy of the copy are equal byte by byte."""
    write_spec(odd_spec, tmp_path / "one.toml")
    write_spec(read_spec(tmp_path / "one.toml"), tmp_path / "two.toml")
    assert (tmp_path / "one.toml").read_bytes() == (tmp_path / "two.toml").read_bytes()
    assert sorted(path.name for path in tmp_path.iterdir()) == ["odd.toml", "one.toml", "two.toml"]


def test_frozen_copy_needs_no_other_file(tmp_path):
    """Plan and prices lie inside the copy, so it can be read where their files are not; the source is noted."""
    (tmp_path / "map.pgm").write_text("\n".join(["P2", "40 20", "255", *["254 " * 40] * 20]))
    (tmp_path / "map.yaml").write_text(
        "image: map.pgm\nresolution: 0.1\norigin: [0, 0, 0]\noccupied_thresh: 0.65\nfree_thresh: 0.25\n"
    )
    (tmp_path / "own.toml").write_text('schema = 1\nname = "own"\ndate = "2026"\nbase = "default-2026"\n')
    (tmp_path / "spec.toml").write_text('[site]\nplan = "map.yaml"\n[parts]\nprices = "own.toml"\n')
    spec = read_spec(tmp_path / "spec.toml")
    other = tmp_path / "elsewhere"
    write_spec(spec, other / "spec.toml")
    again = read_spec(other / "spec.toml")
    assert_equal_problems(spec, again)
    assert again.site.source == "map.yaml"
    assert again.prices.name == "own"
    assert "plan" not in tomllib.loads((other / "spec.toml").read_text())["site"]


def test_what_was_changed_since_reading_is_written(odd_spec, tmp_path):
    """The copy holds the values of the Spec, not the text it came from: other prices, target and budget."""
    prices = default_prices().replace_item("label", price_eur=1 / 3, source="offer")
    changed = dataclasses.replace(odd_spec, prices=prices, target_error_m=1 / 300, budget_eur=None)
    write_spec(changed, tmp_path / "changed.toml")
    again = read_spec(tmp_path / "changed.toml")
    assert_equal_problems(changed, again)
    assert again.prices.items["label"].price_eur == 1 / 3
    assert (again.target_error_m, again.budget_eur) == (1 / 300, None)


def test_a_copy_too_large_to_be_read_is_not_written(odd_spec, tmp_path):
    """A spec may have 5 MB; a copy beyond that is refused when it is written, not when it is needed."""
    items = {name: dataclasses.replace(item, source="x" * 600_000) for name, item in odd_spec.prices.items.items()}
    huge = dataclasses.replace(odd_spec, prices=dataclasses.replace(odd_spec.prices, items=items))
    with pytest.raises(InvalidInput, match="more than a spec may have"):
        write_spec(huge, tmp_path / "huge.toml")
    assert not (tmp_path / "huge.toml").exists()


@given(
    value=st.floats(min_value=-1e6, max_value=1e6, allow_nan=False),
    dimension=st.sampled_from(["length", "angle", "speed", "time", "share", "price", "angle_per_length", "area"]),
)
def test_written_numbers_read_back_to_the_same_bits(value, dimension):
    """Whatever the number, its written form means exactly that number."""
    assert parse_quantity(as_written(value, dimension), dimension) == value


@pytest.mark.parametrize(
    ("value", "dimension", "text"),
    [
        (0.06, "length", "60 mm"),
        (1.25, "length", "1.25 m"),
        (math.radians(5), "angle", "5 deg"),
        (0.05, "time", "50 ms"),
        (90.0, "time", "90 s"),
        (0.02, "share", "2 %"),
        (1 / 3, "length", 1 / 3),
    ],
)
def test_ordinary_numbers_are_written_as_people_do(value, dimension, text):
    """Numbers get the unit that people would choose; what no short text gives exactly stays a bare number."""
    assert as_written(value, dimension) == text


def test_a_tolerance_survives_the_copy(tmp_path):
    """Ranges in odd units, a negative height and a quantile are read back to the last bit."""
    path = tmp_path / "odd.toml"
    text = '[study.tolerance]\nplacement = ["0.1 in", 0.0071]\nantenna_height = ["-0.7 mm", "1 mm"]\n'
    path.write_text(ODD + text + 'combine = "quantile"\nquantile = 0.85\n', encoding="utf-8")
    spec = read_spec(path)
    assert spec.study.tolerance.placement_m == (0.00254, 0.0071)
    assert spec.study.tolerance.combine == "quantile"
    write_spec(spec, tmp_path / "frozen.toml")
    assert read_spec(tmp_path / "frozen.toml").study.tolerance == spec.study.tolerance
