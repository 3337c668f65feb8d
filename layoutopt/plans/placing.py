"""What readers of drawn plans share: units, far origins, and zones that a plan draws."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np
import shapely
from shapely.geometry import MultiPolygon, Polygon
from shapely.geometry.base import BaseGeometry

from layoutopt.errors import InvalidInput, did_you_mean
from layoutopt.identity import FloatArray
from layoutopt.plans.floor import SMALLEST_AREA_M2
from layoutopt.site import Zone

LENGTH_UNITS: Final[Mapping[str, float]] = {"m": 1.0, "mm": 0.001, "cm": 0.01, "in": 0.0254, "ft": 0.3048}
"""Units in which a plan may be drawn, and their length in metres."""


_FAR_M: Final = 10_000.0  # no building reaches this far from an origin of its own; grids of a country begin here

_FARTHEST_M: Final = 1e8  # beyond the coordinates of any grid of a country


@dataclass(frozen=True, slots=True, kw_only=True)
class Layers:
    """Names of the layers of a drawing that show walls, doors, obstacles and zones."""

    walls: tuple[str, ...]
    doors: tuple[str, ...] = ()
    obstacles: tuple[str, ...] = ()
    no_tags: tuple[str, ...] = ()
    metal: tuple[str, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class Scale:
    """Two points of an image, pixels to the right of and below its upper left corner, and their distance."""

    first_px: tuple[float, float]
    second_px: tuple[float, float]
    distance_m: float


def length_unit_m(units: str, place: str) -> float:
    """Return the length of a unit of drawings in metres.

    Raises
    ------
    InvalidInput
        If there is no such unit.
    """
    if units not in LENGTH_UNITS:
        raise InvalidInput.at(place, f"units = {units!r} is no unit of length", did_you_mean(units, LENGTH_UNITS))
    return LENGTH_UNITS[units]


def listed(texts: Sequence[str], most: int = 10, separator: str = ", ") -> str:
    """Return texts as one, the first of them only if there are more than ``most``.

    >>> listed(["a", "b", "c"], 2)
    'a, b and 1 more'
    """
    more = f" and {len(texts) - most} more" if len(texts) > most else ""
    return separator.join(texts[:most]) + more


def shift_of(corners_m: FloatArray) -> FloatArray:
    """Return by what whole metres to move a plan towards its origin, shape (2,); zero unless it lies far off.

    Corners that are no place on Earth do not count.
    """
    usable_m = corners_m[(np.abs(corners_m) < _FARTHEST_M).all(axis=1)]
    if not len(usable_m) or np.abs(usable_m).max() < _FAR_M:
        return np.zeros(2)
    return np.asarray(np.floor(usable_m.min(axis=0)))


def shifted_source(name: str, shift_m: FloatArray, notes: list[str]) -> str:
    """Return the name of a plan with the shift that it was given, and note that shift."""
    if not shift_m.any():
        return name
    at = f"({shift_m[0]:.0f}, {shift_m[1]:.0f}) m"
    notes.append(f"the plan lies far from its origin: its point {at} is (0, 0) here")
    return f"{name}, from {at}"


def parts_of(region: BaseGeometry) -> list[Polygon]:
    """Return the polygons of a region that have an area, largest first."""
    parts = [part for part in shapely.get_parts(region) if isinstance(part, Polygon)]
    return sorted((part for part in parts if part.area >= SMALLEST_AREA_M2), key=lambda part: -part.area)


def region_of(region: BaseGeometry) -> Polygon | MultiPolygon:
    """Return the parts of a region that have an area: one polygon, or several as one region."""
    parts = parts_of(region)
    return parts[0] if len(parts) == 1 else MultiPolygon(parts)


def on_floor(obstacles: Sequence[Polygon], floor: BaseGeometry, notes: list[str]) -> tuple[Polygon, ...]:
    """Return the obstacles of a plan that stand on the floor; others are noted."""
    kept = tuple(obstacle for obstacle in obstacles if obstacle.intersects(floor))
    if len(kept) < len(obstacles):
        notes.append(f"left out {len(obstacles) - len(kept)} obstacle(s) beyond the floor")
    return kept


def zones_of(polygons: Mapping[str, Sequence[Polygon]], floor: BaseGeometry, notes: list[str]) -> tuple[Zone, ...]:
    """Return the zones of a plan, cut to the floor: keys are ``"no_tags"`` and ``"metal"``.

    What lies beyond the floor is cut off and noted.
    """
    zones = []
    for kind, regions in polygons.items():
        if not regions:
            continue
        drawn = shapely.union_all(list(regions))
        kept = parts_of(drawn.intersection(floor))
        beyond_m2 = drawn.area - sum(part.area for part in kept)
        if beyond_m2 > SMALLEST_AREA_M2:
            notes.append(f"cut {beyond_m2:.4g} m² of {kind} that lie beyond the floor")
        zones += [
            Zone(name=f"{kind}_{number}", region=part, tags=kind != "no_tags", metal=kind == "metal")
            for number, part in enumerate(kept, 1)
        ]
    return tuple(zones)
