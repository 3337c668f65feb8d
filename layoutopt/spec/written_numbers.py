"""SI numbers back into the form that people read, without the loss of a bit."""

from typing import Final

from layoutopt.units import Dimension, parse_quantity

_PREFERRED: Final[dict[Dimension, tuple[tuple[str, float], ...]]] = {
    "length": (("mm", 1e3), ("m", 1.0)),
    "angle": (("deg", 57.29577951308232),),
    "speed": (("m/s", 1.0),),
    "time": (("ms", 1e3), ("s", 1.0)),
    "share": (("%", 100.0),),
    "price": (("EUR", 1.0),),
    "angle_per_length": (("deg/m", 57.29577951308232),),
    "angular_speed": (("deg/s", 57.29577951308232),),
    "area": (("m2", 1.0),),
    "current": (("mA", 1e3), ("A", 1.0)),
    "magnetic_field": (("A/m", 1.0),),
    "frequency": (("MHz", 1e-6),),
}


def as_written(value: float, dimension: Dimension | None) -> str | float | int:
    """Return a number with its unit if that reads back as exactly the same number, else the number in SI.

    >>> as_written(0.03, "length"), as_written(1.2, "length"), as_written(1 / 30, "length")
    ('30 mm', '1.2 m', 0.03333333333333333)
    """
    if dimension is None:
        return value
    for unit, factor in _PREFERRED[dimension]:
        text = f"{value * factor:.9g} {unit}"
        # Small units are for small numbers: 1.2 m and not 1200 mm.
        if (factor == 1e3 and abs(value) >= 1.0) or "e" in text.partition(" ")[0]:
            continue
        if parse_quantity(text, dimension) == value:
            return text
    return value
