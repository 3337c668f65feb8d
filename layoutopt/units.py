"""Numbers with units as people write them, turned into SI once, at the border of the program."""

import math
import re
import unicodedata
from typing import Final, Literal, get_args

from layoutopt.errors import InvalidInput

Dimension = Literal[
    "length",
    "angle",
    "speed",
    "time",
    "share",
    "price",
    "angle_per_length",
    "angular_speed",
    "area",
    "current",
    "magnetic_field",
    "frequency",
]

_FACTORS: Final[dict[Dimension, dict[str, float]]] = {
    "length": {"m": 1.0, "cm": 0.01, "mm": 0.001, "km": 1000.0, "in": 0.0254, "ft": 0.3048},
    "angle": {"rad": 1.0, "deg": math.pi / 180.0, "°": math.pi / 180.0},
    "speed": {"m/s": 1.0, "mm/s": 0.001, "cm/s": 0.01, "km/h": 1.0 / 3.6},
    "time": {"s": 1.0, "ms": 0.001, "min": 60.0, "h": 3600.0},
    "share": {"": 1.0, "%": 0.01},
    "price": {"EUR": 1.0, "€": 1.0},
    "angle_per_length": {"rad/m": 1.0, "deg/m": math.pi / 180.0},
    "angular_speed": {"rad/s": 1.0, "deg/s": math.pi / 180.0},
    "area": {"m2": 1.0, "m²": 1.0, "cm2": 1e-4, "mm2": 1e-6},
    "current": {"A": 1.0, "mA": 0.001},
    "magnetic_field": {"A/m": 1.0, "mA/m": 0.001},
    "frequency": {"Hz": 1.0, "kHz": 1e3, "MHz": 1e6, "GHz": 1e9},
}
_SUFFIXES: Final[dict[str, Dimension]] = {
    "_m": "length",
    "_rad": "angle",
    "_m_s": "speed",
    "_rad_s": "angular_speed",
    "_s": "time",
    "_share": "share",
    "_eur": "price",
    "_a": "current",
    "_a_m": "magnetic_field",
    "_hz": "frequency",
}
_CONTROL: Final = frozenset({"Cc", "Cf", "Co", "Cs"})
_QUANTITY = re.compile(r"\s*([-+]?(?:\d+\.?\d*|\.\d+)(?:[eE][-+]?\d+)?)\s*(.*?)\s*")


def parse_quantity(value: str | float | int, dimension: Dimension) -> float:
    """Return ``value`` in SI; a bare number is taken to be in SI already.

    Raises
    ------
    ValueError
        If the number is not finite or has a comma in it, or the unit is none of the dimension's.

    Examples
    --------
    >>> parse_quantity("30 mm", "length")
    0.03
    >>> parse_quantity("90 deg", "angle") == math.pi / 2
    True
    """
    units = _FACTORS[dimension]
    if isinstance(value, bool) or not isinstance(value, (str, int, float)):
        shown = str(value).lower() if isinstance(value, bool) else repr(value)
        raise ValueError(f"{shown} is no {dimension.replace('_', ' ')}")
    if isinstance(value, (int, float)):
        # A whole number of 400 digits has no float, and is as infinite as 1e400.
        number, unit = float(value) if abs(value) < 1e300 else math.inf, si_unit(dimension)
    else:
        match = _QUANTITY.fullmatch(value)
        if re.match(r"\s*[-+]?\d+,\d", value):
            raise ValueError(f"{value!r} has a comma: decimals take a point, and thousands no sign")
        if match is None:
            raise ValueError(f"{value!r} is no number with a unit such as {_example(dimension)}")
        number, unit = float(match[1]), match[2]
    if unit not in units:
        wrong = (
            f"the unit of {value!r} is none of {dimension.replace('_', ' ')}" if unit else f"{value!r} has no unit"
        )
        raise ValueError(f"{wrong}; use {_example(dimension)}")
    # Division by the inverse keeps "30 mm" at exactly 0.03, which multiplication by 0.001 does not.
    factor = units[unit]
    inverse = round(1.0 / factor)
    result = number / inverse if math.isclose(inverse * factor, 1.0) else number * factor
    if not math.isfinite(result):
        raise ValueError(f"{value!r} is not a finite number")
    return result


def si_unit(dimension: Dimension) -> str:
    """Return the unit in which a bare number of a dimension is taken; a share has none.

    >>> si_unit("length"), si_unit("angular_speed")
    ('m', 'rad/s')
    """
    return next(iter(_FACTORS[dimension]))


def positive_quantity(place: str, text: str, dimension: Dimension, example: str) -> float:
    """Return in SI what an option of the command line gives, which must be above zero.

    Raises
    ------
    InvalidInput
        If it cannot be read or is not positive; ``place`` names the option, ``example`` is what would be right.
    """
    try:
        value = parse_quantity(text, dimension)
    except ValueError as error:
        raise InvalidInput.at(place, str(error), f"Write {place} '{example}'.") from None
    if not value > 0.0:
        raise InvalidInput.at(place, f"{text!r} is not positive", "Give a value above zero.")
    return value


def dimension_of(parameter: str) -> Dimension | None:
    """Return the dimension that a parameter's name carries, ``None`` for a bare number such as a count.

    >>> dimension_of("pitch_m"), dimension_of("count")
    ('length', None)
    """
    for suffix in sorted(_SUFFIXES, key=len, reverse=True):
        if parameter.endswith(suffix):
            return _SUFFIXES[suffix]
    return None


def without_unit(parameter: str) -> str:
    """Return the word that a spec uses for a parameter: ``pitch_m`` is written ``pitch``.

    >>> without_unit("speed_m_s")
    'speed'
    """
    for suffix in sorted(_SUFFIXES, key=len, reverse=True):
        if parameter.endswith(suffix) and suffix != "_share":
            return parameter.removesuffix(suffix)
    return parameter


def format_length(value_m: float) -> str:
    """Return a length as people read it: millimetres below a metre.

    >>> format_length(0.0125), format_length(12.0)
    ('12.5 mm', '12 m')
    """
    return f"{value_m * 1000:.4g} mm" if abs(value_m) < 1.0 else f"{value_m:.4g} m"


def printable(text: str) -> str:
    """Return a text without characters that control a terminal or turn the direction of writing; lines stay.

    What is quoted within a line goes through `one_line` before.

    >>> printable("a" + chr(27) + "[31m")
    'a?[31m'
    """
    return "".join(
        "?" if unicodedata.category(character) in _CONTROL and character not in "\n\t" else character
        for character in text
    )


def one_line(text: str, most: int) -> str:
    """Return a text from elsewhere as messages quote it: printable, on one line, of at most ``most`` characters.

    Spaces of other widths, as our own numbers have them between thousands, become plain ones.

    >>> one_line("two" + chr(10) + "lines", 80), one_line("a long story", 9), one_line(f"2{chr(0x202f)}231", 80)
    ('two?lines', 'a long...', '2 231')
    """
    cut = text if len(text) <= most else f"{text[: most - 3]}..."
    spaced = (" " if unicodedata.category(character) == "Zs" else character for character in cut)
    return "".join(character if character.isprintable() else "?" for character in spaced)


def format_duration(value_s: float) -> str:
    """Return a time span as people read it.

    >>> format_duration(0.4), format_duration(75.0), format_duration(5400.0), format_duration(200000.0)
    ('0.4 s', '75 s', '90 min', '55.6 h')
    """
    if abs(value_s) < 120.0:
        return f"{value_s:.3g} s" if abs(value_s) < 10.0 else f"{value_s:.0f} s"
    return f"{value_s / 60.0:.0f} min" if abs(value_s) < 7200.0 else f"{value_s / 3600.0:.3g} h"


def _example(dimension: Dimension) -> str:
    return ", ".join(f"'1 {unit}'".replace(" '", "'") for unit in _FACTORS[dimension])


assert set(_FACTORS) == set(get_args(Dimension))
