"""Floors, zones, obstacles and robot outlines written as corners, in a spec or in Python."""

import reprlib
from collections.abc import Sequence
from typing import Final, TypeGuard

import numpy as np
from shapely.geometry import Polygon

from layoutopt.errors import Fault, InvalidInput
from layoutopt.plans.floor import Floor, check_extents, checked_polygon
from layoutopt.units import parse_quantity

_EXAMPLE: Final = "[[0, 0], [12, 0], [12, 8], [0, 8]]"
_MOST_CORNERS: Final = 100_000
_MOST_FAULTS: Final = 20


def polygon_from(points: object, place: str) -> Polygon:
    """Return the polygon with these corners, counter-clockwise.

    Each corner is a pair of lengths, bare numbers in metres or strings such as ``"300 mm"``; the first corner
    may be repeated at the end. ``place`` is where the corners stand, for messages: corner three of
    ``site.floor`` is ``site.floor[2]``.

    Raises
    ------
    InvalidInput
        With one fault for each corner that cannot be read; or if the outline has fewer than three different
        corners, crosses itself, or holds no area.

    Examples
    --------
    >>> polygon_from([[0, 0], ["2 m", 0], ["2 m", "500 mm"], [0, 0.5]], "site.floor").area
    1.0
    """
    if isinstance(points, np.ndarray):
        points = points.tolist()
    if not _is_list(points) or not points:
        raise InvalidInput.at(place, f"{reprlib.repr(points)} is no list of corners", f"Write {_EXAMPLE}.")
    if len(points) > _MOST_CORNERS:
        raise InvalidInput.at(
            place, f"the outline has {len(points)} corners", f"At most {_MOST_CORNERS} are read."
        )
    corners_m: list[tuple[float, float]] = []
    faults: list[Fault] = []
    for number, point in enumerate(points):
        try:
            corners_m.append(_corner(point))
        except ValueError as error:
            faults.append(
                Fault(
                    place=f"{place}[{number}]",
                    problem=_shortened(str(error)),
                    repair="A corner is [x, y] in metres.",
                )
            )
    if faults:
        raise InvalidInput(faults[:_MOST_FAULTS])
    return checked_polygon(corners_m, place)


def floor_from(points: object, place: str) -> Floor:
    """Return the floor with these corners, which must also have the extents of a floor.

    Raises
    ------
    InvalidInput
        As `polygon_from` does, or if a side is below 0.5 m or beyond 1000 m.
    """
    polygon = polygon_from(points, place)
    check_extents(polygon.bounds, place)
    return Floor(polygon=polygon)


def _is_list(points: object) -> TypeGuard[Sequence[object]]:
    return isinstance(points, Sequence) and not isinstance(points, (str, bytes))


def _corner(point: object) -> tuple[float, float]:
    if not _is_list(point) or len(point) != 2:
        raise ValueError(f"{reprlib.repr(point)} is no pair of lengths")
    try:
        x_m, y_m = (parse_quantity(value, "length") for value in point)  # type: ignore[arg-type]
    except OverflowError as error:
        raise ValueError(f"{reprlib.repr(point)} is beyond any floor") from error
    return x_m, y_m


def _shortened(message: str) -> str:
    return message if len(message) <= 200 else f"{message[:100]}...{message[-97:]}"
