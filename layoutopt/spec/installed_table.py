"""The table ``[layout.installed]``: tags that lie on the floor already, and the area that they equip."""

from collections.abc import Mapping
from typing import Annotated, Any, Final

import numpy as np
import shapely
from pydantic import Field
from shapely.geometry import MultiPolygon, Polygon

from layoutopt.identity import read_only
from layoutopt.layout import InstalledTags
from layoutopt.spec.findings import Findings
from layoutopt.spec.lines import KeyPath
from layoutopt.spec.quantities import Point, in_si
from layoutopt.spec.schema import Table
from layoutopt.spec.validation import validated

_LARGEST_NUMBER: Final = 1_000_000_000
"""Of a tag, as in `layoutopt.commissioning.site_records`."""
_MOST_TAGS: Final = 1_000_000
_COPY: Final = "Copy the table from a layout file that layoutopt expand wrote."


class InstalledTable(Table):
    """``[layout.installed]``: number and centre of each tag, and the rings of each part of the area."""

    numbers: list[Annotated[int, Field(ge=1, lt=_LARGEST_NUMBER)]] = Field(min_length=1, max_length=_MOST_TAGS)
    places: list[Point] = Field(max_length=_MOST_TAGS)
    area: list[list[list[Point]]] = Field(min_length=1)


def installed_of(given: Mapping[str, Any], path: KeyPath, findings: Findings) -> InstalledTags | None:
    """Return the installed tags of a table, ``None`` after a fault."""
    table = validated(InstalledTable, given, path, findings)
    if table is None:
        return None
    try:
        parts = [_polygon([[_in_m(corner) for corner in ring] for ring in rings]) for rings in table.area]
        area = parts[0] if len(parts) == 1 else MultiPolygon(parts)
        if not area.is_valid or not area.area > 0.0:
            raise ValueError(f"these rings bound no area ({shapely.is_valid_reason(area)})")
    except ValueError as error:
        findings.add((*path, "area"), str(error), _COPY)
        return None
    xy_m = read_only([_in_m(place) for place in table.places], (-1, 2))
    try:
        return InstalledTags(ids=np.array(table.numbers), xy_m=xy_m, area=area)
    except ValueError as error:
        findings.add((*path, "numbers"), str(error), _COPY)
        return None


def installed_table(installed: InstalledTags) -> dict[str, Any]:
    """Return installed tags as a table, from which they read back to the last bit."""
    area = installed.area
    return {
        "numbers": installed.ids.tolist(),
        "places": installed.xy_m.tolist(),
        "area": [
            [[list(corner) for corner in list(ring.coords)[:-1]] for ring in (part.exterior, *part.interiors)]
            for part in (area.geoms if isinstance(area, MultiPolygon) else (area,))
        ],
    }


def _polygon(rings: list[list[tuple[float, float]]]) -> Polygon:
    if not rings:
        raise ValueError("a part of the area has no ring")
    return Polygon(rings[0], rings[1:])


def _in_m(point: Any) -> tuple[float, float]:
    return in_si(point[0], "length"), in_si(point[1], "length")
