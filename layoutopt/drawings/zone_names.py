"""Names of zones written on the plan, where they hide as few tags as possible and touch no other text."""

from collections.abc import Sequence
from typing import Final

import numpy as np
from shapely.geometry import box

from layoutopt.drawings.layers import Layer
from layoutopt.drawings.lettering import fit_text
from layoutopt.drawings.sheet import Box, Text
from layoutopt.drawings.symbols import Point
from layoutopt.drawings.text_boxes import text_box
from layoutopt.geometry import covers
from layoutopt.identity import FloatArray
from layoutopt.site import Site, Zone

_HEIGHTS_MM: Final = (3.5, 2.5, 1.8)
_LONGEST_MM: Final = 70.0
_STEPS: Final = 13
_MOST_LINES: Final = 24
_GAP_MM: Final = 0.6


def zone_text(zone: Zone) -> str:
    """Return the name of a zone and what holds there, in one line."""
    parts = [zone.name]
    if zone.metal:
        parts.append("metal")
    if not zone.taggable:
        parts.append("no tags")
    if zone.target_error_m is not None:
        parts.append(f"target {zone.target_error_m * 1000.0:g} mm")
    return ", ".join(parts)


def zone_names(
    site: Site, *, tags_mm: FloatArray, mark_mm: float, scale: int
) -> tuple[tuple[Text, ...], tuple[str, ...]]:
    """Return a text for each zone, and the words of those for which there is no free place.

    Parameters
    ----------
    tags_mm
        Tag centres, shape (n, 2), in the millimetres of the floor frame.
    mark_mm
        Size of a drawn tag, likewise.

    Returns
    -------
        Texts that touch neither each other nor the border of the floor's bounds; large letters off all tags
        are best, then smaller ones, then those over the fewest tags.
    """
    floor_mm = Box(*(1000.0 * edge for edge in site.bounds_m))
    texts: list[Text] = []
    taken: list[Box] = []
    missing = []
    for zone in site.zones:
        found = _best(zone, floor_mm, tags_mm, mark_mm, scale, taken)
        if found is None:
            missing.append(zone_text(zone))
        else:
            texts.append(found)
            taken.append(_around(found, scale))
    return tuple(texts), tuple(missing)


def _around(text: Text, scale: int) -> Box:
    """Return the box of a text with some air, in the millimetres of the view."""
    xmin, ymin, xmax, ymax = text_box(text, scale)
    return Box(*(scale * edge for edge in (xmin - _GAP_MM, ymin - _GAP_MM, xmax + _GAP_MM, ymax + _GAP_MM)))


def _best(
    zone: Zone, floor_mm: Box, tags_mm: FloatArray, mark_mm: float, scale: int, taken: Sequence[Box]
) -> Text | None:
    xmin, ymin, xmax, ymax = (1000.0 * edge for edge in zone.region.bounds)
    reach_mm = _LONGEST_MM * scale + mark_mm
    low, high = (xmin - reach_mm, ymin - reach_mm), (xmax + reach_mm, ymax + reach_mm)
    tags_mm = tags_mm[((tags_mm > low) & (tags_mm < high)).all(axis=1)]
    middle = zone.region.representative_point()
    places = _places(zone, tags_mm, (1000.0 * middle.x, 1000.0 * middle.y))
    best: tuple[tuple[int, int], Text] | None = None
    for height in _HEIGHTS_MM:
        words, fitted = fit_text(zone_text(zone), _LONGEST_MM, height)
        for place in places if fitted == height or height == _HEIGHTS_MM[-1] else ():
            text = Text(layer=_layer(zone), text=words, position_mm=place, height_mm=fitted, anchor="middle")
            around = _around(text, scale)
            if not around.inside(floor_mm) or any(around.overlaps(other) for other in taken):
                continue
            inside = zone.region.covers(box(*(edge / 1000.0 for edge in around)))
            worth = (_hidden(around, tags_mm, mark_mm, scale), int(not inside))
            if worth == (0, 0):
                return text
            if best is None or worth < best[0]:
                best = (worth, text)
    return None if best is None else best[1]


def _hidden(around: Box, tags_mm: FloatArray, mark_mm: float, scale: int) -> int:
    """Return how many drawn tags a text touches; its air does not count."""
    half_mm = mark_mm / 2.0 - _GAP_MM * scale
    inside = (tags_mm > (around.xmin - half_mm, around.ymin - half_mm)) & (
        tags_mm < (around.xmax + half_mm, around.ymax + half_mm)
    )
    return int(inside.all(axis=1).sum())


def _places(zone: Zone, tags_mm: FloatArray, middle_mm: Point) -> list[Point]:
    """Return points to try, nearest to the middle first: a grid, and the middles between rows of tags."""
    xmin, ymin, xmax, ymax = (1000.0 * edge for edge in zone.region.bounds)
    share = (np.arange(_STEPS) + 0.5) / _STEPS
    columns = [middle_mm[0], *(xmin + share * (xmax - xmin))]
    rows = [middle_mm[1], *(ymin + share * (ymax - ymin))]
    in_zone = tags_mm[covers(zone.region, tags_mm / 1000.0)] if len(tags_mm) else tags_mm
    levels = np.unique(np.round(in_zone[:, 1], 3))
    between = (levels[1:] + levels[:-1]) / 2.0
    rows += between[:: max(1, len(between) // _MOST_LINES)].tolist()
    places = [(float(x), float(y)) for y in rows for x in columns]
    return sorted(places, key=lambda place: (abs(place[0] - middle_mm[0]) + abs(place[1] - middle_mm[1]), place))


def _layer(zone: Zone) -> Layer:
    return "A-ZONE" if zone.taggable else "A-NOTAG"
