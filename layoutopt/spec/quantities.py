"""Types of the spec's values: what is written stays as it was written, once it has been found readable.

Keeping ``"30 mm"`` until the domain objects are built lets a frozen copy of a spec look like the spec.
"""

import math
from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Annotated, Any, Final

from pydantic import AfterValidator

from layoutopt.spec.lines import KeyPath
from layoutopt.units import Dimension, parse_quantity, si_unit

LONGEST_M = 1e5
MAXIMUM_CORNERS = 100_000
_LONGEST_TEXT = 64
_LARGEST_BARE: Final = 1e300
"""A larger number is no slip of the unit; a whole one of 400 digits has no float."""
LARGEST_TARGET_M: Final = 1.0
"""Dead reckoning alone keeps to less for a minute: a larger target is a forgotten unit."""
_EXAMPLES: dict[Dimension, str] = {
    "length": '"30 mm" or "0.5 m"',
    "angle": '"5 deg"',
    "speed": '"0.3 m/s"',
    "angular_speed": '"45 deg/s"',
    "time": '"50 ms"',
    "share": '"2 %"',
    "price": '"25 EUR"',
    "angle_per_length": '"1 deg/m"',
    "area": '"0.25 m2"',
    "current": '"69 mA"',
    "magnetic_field": '"0.15 A/m"',
    "frequency": '"920 MHz" or "303.2 MHz"',
}
_TURNS: Final[tuple[Dimension, ...]] = ("angle", "angular_speed", "angle_per_length")
"""Of these a bare whole number is refused: 5 would be radians, and means degrees. Frozen copies have fractions."""
_USUAL: Final[dict[Dimension, str]] = {
    "length": "mm",
    "speed": "mm/s",
    "time": "ms",
    "share": "%",
    "frequency": "MHz",
}
"""Units that are meant where a bare number, taken in SI, is out of reason."""


class Unfit(ValueError):
    """A value that does not fit, with what would; ``path`` leads from the value checked to the culprit."""

    def __init__(self, problem: str, repair: str, path: KeyPath = ()) -> None:
        self.problem = problem
        self.repair = repair
        self.path = path
        super().__init__(problem)


def in_si(value: Any, dimension: Dimension) -> float:
    """Return a written number with unit in SI; a bare number is in SI, a bare whole one of a turn is refused.

    Raises
    ------
    Unfit
        If it is no such number.
    """
    if dimension in _TURNS and isinstance(value, int) and not isinstance(value, bool) and value:
        unit = si_unit(dimension)
        right = f'"{value} {unit.replace("rad", "deg")}" or "{value} {unit}"'
        raise Unfit("a whole number without a unit may mean degrees or radians", f"Write {right}.")
    if isinstance(value, str) and len(value) > _LONGEST_TEXT:
        raise Unfit("this text is too long for a number with a unit", f"Write {_EXAMPLES[dimension]}.")
    try:
        return parse_quantity(value, dimension)
    except (ValueError, OverflowError) as error:
        message = str(error) if isinstance(value, (str, int, float)) else "this is no number with a unit"
        raise Unfit(message.partition("; use ")[0], _suggestion(value, dimension)) from None


def quantity(
    dimension: Dimension, *, above: float = -math.inf, least: float = -math.inf, most: float = math.inf
) -> Callable[[Any], Any]:
    """Return a check that a written number has the dimension and lies in the range, in SI."""

    def check(value: Any) -> Any:
        number, unit = in_si(value, dimension), si_unit(dimension)
        if not number > above:
            raise Unfit(f"this must be more than {above:g} {unit}".rstrip(), f"Write {_EXAMPLES[dimension]}.")
        if not least <= number <= most:
            wanted = f"at least {least:g} {unit}" if number < least else f"at most {most:g} {unit}"
            raise Unfit(f"this must be {wanted}".rstrip(), out_of_reason(value, dimension, least, most))
        return value

    return check


def out_of_reason(value: Any, dimension: Dimension, least: float, most: float) -> str:
    """Return what to write instead of a number that is out of reason.

    Of a bare one it is the unit that was forgotten, if the number then lies in the range.

    >>> out_of_reason(20, "length", 0.0, 10.0)
    'A bare number is in m. Did you mean "20 mm"?'
    >>> out_of_reason(200, "share", 0.0, 1.0)
    'Write "2 %".'
    """
    if _is_number(value) and value > 0 and dimension in _USUAL:
        meant = f"{value:g} {_USUAL[dimension]}"
        if least <= in_si(meant, dimension) <= most:
            unit = f"is in {si_unit(dimension)}" if si_unit(dimension) else "counts from 0 to 1"
            return f'A bare number {unit}. Did you mean "{meant}"?'
    return f"Write {_EXAMPLES[dimension]}."


def _is_number(value: Any) -> bool:
    return isinstance(value, (int, float)) and not isinstance(value, bool) and abs(value) < _LARGEST_BARE


def check_point(value: Any) -> Any:
    """Return a point, or raise what is wrong with it."""
    if not (isinstance(value, list) and len(value) == 2):
        raise Unfit("a point is a list of x and y", 'Write [1.5, 2] or ["1.5 m", "2 m"].')
    for number, coordinate in enumerate(value):
        with within(number):
            if abs(in_si(coordinate, "length")) > LONGEST_M:
                raise Unfit(f"no floor reaches {LONGEST_M:g} m from its origin", "Move the origin near the floor.")
    return value


def point_in_m(point: Sequence[Any]) -> tuple[float, float]:
    """Return a written point, which `check_point` has found readable, in metres."""
    x_m, y_m = (in_si(value, "length") for value in point)
    return x_m, y_m


def _pixel(value: Any) -> Any:
    if not (isinstance(value, list) and len(value) == 2):
        raise Unfit("a point of an image is a list of column and row", "Write [120, 460].")
    for number, coordinate in enumerate(value):
        if isinstance(coordinate, bool) or not isinstance(coordinate, (int, float)):
            raise Unfit("this is no number of pixels", "Write [120, 460].", (number,))
    return value


def _ring(value: Any) -> Any:
    if not (isinstance(value, list) and len(value) >= 3):
        raise Unfit("a polygon is a list of at least three points", "Write [[0, 0], [2, 0], [2, 2], [0, 2]].")
    if len(value) > MAXIMUM_CORNERS:
        raise Unfit(f"a polygon of {len(value)} corners", f"Simplify it to at most {MAXIMUM_CORNERS}.")
    for number, point in enumerate(value):
        with within(number):
            check_point(point)
    return value


def _floor(value: Any) -> Any:
    """Check a ring, a polygon (list of rings, holes after the outline) or a list of polygons."""
    depth, inner = 0, value
    while isinstance(inner, list) and inner:
        depth, inner = depth + 1, inner[0]
    if depth <= 2:
        return _ring(value)
    for number, part in enumerate(value):
        with within(number):
            if depth == 3:
                _ring(part)
            else:
                _floor(part)
    return value


@contextmanager
def within(number: int) -> Iterator[None]:
    """Lead the path of an error through the element of that number."""
    try:
        yield
    except Unfit as error:
        raise Unfit(error.problem, error.repair, (number, *error.path)) from None


def _suggestion(value: Any, dimension: Dimension) -> str:
    """Return the number that was probably meant, if a wrong unit hides one."""
    if isinstance(value, str):
        head = value.strip()
        for length in range(len(head) - 1, 0, -1):
            try:
                parse_quantity(head[:length], dimension)
            except ValueError:
                continue
            return f'Did you mean "{head[:length].strip()}"?'
    return f"Write {_EXAMPLES[dimension]}."


Length = Annotated[Any, AfterValidator(quantity("length", above=0.0, most=LONGEST_M))]
Distance = Annotated[Any, AfterValidator(quantity("length", least=0.0, most=LONGEST_M))]
SignedLength = Annotated[Any, AfterValidator(quantity("length", least=-LONGEST_M, most=LONGEST_M))]
Angle = Annotated[Any, AfterValidator(quantity("angle", least=-2.0 * math.pi, most=2.0 * math.pi))]
SmallAngle = Annotated[Any, AfterValidator(quantity("angle", least=0.0, most=math.pi))]
Drift = Annotated[Any, AfterValidator(quantity("angular_speed", least=0.0, most=50.0))]
TurnRate = Annotated[Any, AfterValidator(quantity("angular_speed", above=0.0, most=50.0))]
Speed = Annotated[Any, AfterValidator(quantity("speed", above=0.0, most=50.0))]
Duration = Annotated[Any, AfterValidator(quantity("time", above=0.0, most=1e6))]
Time = Annotated[Any, AfterValidator(quantity("time", least=0.0, most=1e6))]
Target = Annotated[Any, AfterValidator(quantity("length", above=0.0, most=LARGEST_TARGET_M))]
Share = Annotated[Any, AfterValidator(quantity("share", least=0.0, most=1.0))]
Price = Annotated[Any, AfterValidator(quantity("price", least=0.0, most=1e9))]
Budget = Annotated[Any, AfterValidator(quantity("price", above=0.0, most=1e12))]
TurnPerWay = Annotated[Any, AfterValidator(quantity("angle_per_length", least=0.0, most=100.0))]
Area = Annotated[Any, AfterValidator(quantity("area", least=0.0, most=1e6))]
Frequency = Annotated[Any, AfterValidator(quantity("frequency", least=1e4, most=1e12))]
"""From 10 kHz on: a bare 303.2 would be hertz, and means megahertz."""
Pixel = Annotated[Any, AfterValidator(_pixel)]
Point = Annotated[Any, AfterValidator(check_point)]
Ring = Annotated[Any, AfterValidator(_ring)]
FloorShape = Annotated[Any, AfterValidator(_floor)]
