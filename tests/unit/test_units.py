"""Numbers with units as people write them."""

import contextlib
import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from layoutopt.units import dimension_of, format_length, parse_quantity, without_unit


@pytest.mark.parametrize(
    ("text", "dimension", "value"),
    [
        ("30 mm", "length", 0.03),
        ("30mm", "length", 0.03),
        (" 1.5 cm ", "length", 0.015),
        ("2 km", "length", 2000.0),
        ("1 in", "length", 0.0254),
        ("-1e-3 m", "length", -0.001),
        (".5 m", "length", 0.5),
        ("180 deg", "angle", math.pi),
        ("36 km/h", "speed", 10.0),
        ("50 ms", "time", 0.05),
        ("1.5 min", "time", 90.0),
        ("2 %", "share", 0.02),
        ("0.02", "share", 0.02),
        ("25 €", "price", 25.0),
        ("1 deg/m", "angle_per_length", math.pi / 180),
        ("5 cm2", "area", 5e-4),
        ("69 mA", "current", 0.069),
        ("85 mA/m", "magnetic_field", 0.085),
        (3, "length", 3.0),
    ],
)
def test_known_quantities(text, dimension, value):
    """A quantity is its number times its unit in SI."""
    assert parse_quantity(text, dimension) == pytest.approx(value, rel=1e-15)


@pytest.mark.parametrize("value", ["15,5 mm", "0,60 m", "1,000.5 m"])
def test_a_comma_in_a_number_is_told_as_one(value):
    """The unit is right, so the message is not about it."""
    with pytest.raises(ValueError, match="has a comma: decimals take a point"):
        parse_quantity(value, "length")


@given(st.integers(0, 10**6))
def test_millimetres_are_exact(number):
    """So many millimetres are the float nearest to that many thousandths: no digit is lost on the way."""
    assert parse_quantity(f"{number} mm", "length") == number / 1000


@pytest.mark.parametrize(
    "value",
    [
        "30 s",
        "30",
        "mm",
        "",
        "1 m m",
        "1e400 m",
        "1e306 km",
        "nan m",
        "0x10 m",
        "1_0 m",
        math.nan,
        math.inf,
        10**400,
        True,
        None,
        [1],
        {"a": 1},
    ],
    ids=lambda value: repr(value)[:20],
)
def test_what_is_no_length_is_refused(value):
    """Other units, no unit, no number and what is not finite end in a ValueError and nothing else."""
    with pytest.raises(ValueError, match=r"'|finite|no length"):
        parse_quantity(value, "length")


@given(st.text(max_size=20))
def test_any_text_is_a_number_or_a_value_error(text):
    """No text brings anything but a finite number or a ValueError."""
    with contextlib.suppress(ValueError):
        assert math.isfinite(parse_quantity(text, "speed"))


def test_names_carry_their_dimension():
    """The longest suffix counts: m/s is no length, and a count has no unit."""
    assert dimension_of("speed_m_s") == "speed"
    assert dimension_of("pitch_m") == "length"
    assert dimension_of("dead_tag_share") == "share"
    assert dimension_of("ampere_turns_a") == "current"
    assert dimension_of("least_field_a_m") == "magnetic_field"
    assert dimension_of("count") is None
    assert [
        without_unit(name) for name in ("speed_m_s", "pitch_m", "least_field_a_m", "dead_tag_share", "count")
    ] == [
        "speed",
        "pitch",
        "least_field",
        "dead_tag_share",
        "count",
    ]


def test_lengths_are_shown_in_millimetres_below_a_metre():
    """People read 12.5 mm and 12 m."""
    assert [format_length(value_m) for value_m in (0.0125, 0.9999, 1.0, -0.03)] == [
        "12.5 mm",
        "999.9 mm",
        "1 m",
        "-30 mm",
    ]
