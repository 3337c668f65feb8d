"""Names of zones on the plan: inside with air around it, else beside with a leader, else over few tags."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
import shapely
from shapely.geometry import box

from layoutopt.drawings.layers import Layer
from layoutopt.drawings.lettering import fit_text
from layoutopt.drawings.sheet import Box, Entity, Line, Marks, Text
from layoutopt.drawings.text_boxes import text_box
from layoutopt.geometry import covers
from layoutopt.identity import BoolArray, FloatArray, IntArray
from layoutopt.site import Site, Zone

_HEIGHTS_MM: Final = (3.5, 2.5, 1.8)
_LONGEST_MM: Final = 70.0
_AROUND_MM: Final = 80.0  # how far from its zone a name may stand
_WINDOW_MM: Final = 150.0  # and how far from the middle of a large zone
_CELL_MM: Final = 0.25
_GAP_MM: Final = 0.5
_AIR: Final = 0.5  # between capitals and tags, in heights of a capital, for a name among many tags to be read
_STROKE_MM: Final = 2.5
_MOST_TRIED: Final = 20_000


def zone_text(zone: Zone) -> str:
    """Return the name of a zone and what holds there, in one line."""
    parts = [zone.name]
    if zone.metal:
        parts.append("metal")
    if not zone.taggable:
        parts.append("on-metal tags only" if zone.tags else "no tags")
    if not zone.drill:
        parts.append("no drilling")
    if zone.target_error_m is not None:
        parts.append(f"target {zone.target_error_m * 1000.0:g} mm")
    return ", ".join(parts)


def zone_names(
    site: Site, *, tags: Marks, scale: int, texts: Sequence[Text] = ()
) -> tuple[tuple[Entity, ...], tuple[str, ...]]:
    """Return texts and leaders for zones drawn at 1:``scale``, and the names of zones for which there is no room.

    Parameters
    ----------
    tags
        Tags in the millimetres of the floor frame.
    texts
        Numbers of tags: a name covers some only where it has no room otherwise.
    """
    tags_mm, mark_mm = tags.points_mm, tags.drawn_size_mm(scale)
    shapes = [zone.region for zone in site.zones]
    edges = shapely.union_all([shape.boundary for shape in (site.floor, *site.obstacles, *shapes)])
    edges_mm = shapely.get_coordinates(shapely.segmentize(edges, 0.5 * _CELL_MM * scale / 1000.0)) * 1000.0
    entities: list[Entity] = []
    named_mm = np.empty((0, 2))
    numbered_mm = _cells_mm([_box_mm(text, scale) for text in texts], _CELL_MM * scale)
    missing = []
    for zone in site.zones:
        found: list[Entity] = []
        for others_mm in (np.concatenate([named_mm, numbered_mm]), named_mm):
            found = _named(zone, _Paper.around(zone, site, scale, tags_mm, edges_mm, others_mm, mark_mm)) or found
            if any(isinstance(item, Text) and item.height_mm > _HEIGHTS_MM[-1] for item in found):
                break
        if not found:
            missing.append(zone.name)
        entities += found
        boxes = [_box_mm(item, scale) for item in found if isinstance(item, Text)]
        named_mm = np.concatenate([named_mm, _cells_mm(boxes, _CELL_MM * scale)])
    return tuple(entities), tuple(missing)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Paper:
    """The plan around a zone in cells of a quarter of a millimetre on paper.

    ``tags``, ``edges`` and ``texts`` are sums over all cells below and left of a corner, so that the content of
    any rectangle is known from four of them.
    """

    corner_mm: tuple[float, float]
    shape: tuple[int, int]
    cell_mm: float
    scale: int
    reach: int
    border: int
    tags: IntArray
    edges: IntArray
    texts: IntArray

    @classmethod
    def around(
        cls,
        zone: Zone,
        site: Site,
        scale: int,
        tags_mm: FloatArray,
        edges_mm: FloatArray,
        texts_mm: FloatArray,
        mark_mm: float,
    ) -> "_Paper":
        """Return the cells near the zone, within the bounds of the floor."""
        floor_mm, zone_mm = (1000.0 * np.array(bounds) for bounds in (site.bounds_m, zone.region.bounds))
        away_mm = _AROUND_MM * scale
        middle_mm, window_mm = _middle_mm(zone), _WINDOW_MM * scale
        low = np.max([floor_mm[:2], zone_mm[:2] - away_mm, middle_mm - window_mm], axis=0)
        high = np.min([floor_mm[2:], zone_mm[2:] + away_mm, middle_mm + window_mm], axis=0)
        cell_mm = _CELL_MM * scale
        columns, rows = (max(1, math.floor(side / cell_mm)) for side in high - low)
        reach = math.ceil(mark_mm / 2.0 / cell_mm)
        # Tags just beyond the plan are near enough to touch a name, or to leave it no air.
        margin = reach + math.ceil((0.5 + _AIR) * _HEIGHTS_MM[0] / _CELL_MM)

        def sums(points_mm: FloatArray, border: int) -> IntArray:
            cells = np.floor((points_mm - low) / cell_mm).astype(np.int64) + border
            sides = np.array([columns + 2 * border, rows + 2 * border])
            cells = cells[((cells >= 0) & (cells < sides)).all(axis=1)]
            count = np.bincount(cells[:, 0] * sides[1] + cells[:, 1], minlength=int(sides.prod()))
            table = np.zeros(sides + 1, dtype=np.int64)
            table[1:, 1:] = count.reshape(sides).cumsum(axis=0).cumsum(axis=1)
            return table

        return cls(
            corner_mm=(float(low[0]), float(low[1])),
            shape=(columns, rows),
            cell_mm=cell_mm,
            scale=scale,
            reach=reach,
            border=margin,
            tags=sums(tags_mm, margin),
            edges=sums(edges_mm, 0),
            texts=sums(texts_mm, 0),
        )

    def contents(self, text: Text) -> tuple[FloatArray, IntArray, BoolArray, BoolArray, BoolArray] | None:
        """Return what ``text`` would lie over at every place it can have, nothing if it is too large.

        Returns
        -------
            Middle of the text, shape (n, 2), in the millimetres of the floor frame; number of tags it touches;
            whether there is air between it and all tags; whether it crosses no edge; whether it touches no
            text; each of shape (n,).
        """
        xmin, ymin, xmax, ymax = text_box(text)
        # The middle of a text is that of its capitals, whatever hangs below them.
        wide = math.ceil((xmax - xmin + 2.0 * _GAP_MM) / _CELL_MM)
        high = math.ceil(2.0 * (max(-ymin, ymax) + _GAP_MM) / _CELL_MM)
        if wide > self.shape[0] or high > self.shape[1]:
            return None
        edges, texts = (_rectangles(table, wide, high) for table in (self.edges, self.texts))
        # Tails of letters may touch a tag: rows of tags are often just a capital apart.
        tags, near = (self._tags_in(text.height_mm * share, wide, high) for share in (1.0, 1.0 + 2.0 * _AIR))
        columns, rows = np.meshgrid(np.arange(edges.shape[0])[::4], np.arange(edges.shape[1]), indexing="ij")
        middle = np.stack([columns + wide / 2.0, rows + high / 2.0], axis=-1).reshape(-1, 2)
        return (
            middle * self.cell_mm + self.corner_mm,
            tags[::4].ravel(),
            near[::4].ravel() == 0,
            edges[::4].ravel() == 0,
            texts[::4].ravel() == 0,
        )

    def _tags_in(self, body_mm: float, wide: int, high: int) -> IntArray:
        """Return the tags within ``body_mm`` of height in the middle of every rectangle of that many cells."""
        body = math.ceil(body_mm / _CELL_MM)
        left, foot = self.border - self.reach, self.border - self.reach + round((high - body) / 2.0)
        tags = _rectangles(self.tags, wide + 2 * self.reach, body + 2 * self.reach)
        return tags[left : left + self.shape[0] - wide + 1, foot : foot + self.shape[1] - high + 1]


def _cells_mm(boxes: Sequence[Box], cell_mm: float) -> FloatArray:
    """Return points that fill the boxes, a cell apart, shape (n, 2)."""
    points = [np.empty((0, 2))]
    for xmin, ymin, xmax, ymax in boxes:
        across, along = np.arange(xmin, xmax + cell_mm, cell_mm), np.arange(ymin, ymax + cell_mm, cell_mm)
        points.append(np.stack(np.meshgrid(across, along), axis=-1).reshape(-1, 2))
    return np.concatenate(points)


def _rectangles(table: IntArray, wide: int, high: int) -> IntArray:
    """Return the content of every rectangle of that many cells, by its lower left cell."""
    return np.asarray(table[wide:, high:] - table[:-wide, high:] - table[wide:, :-high] + table[:-wide, :-high])


def _named(zone: Zone, paper: _Paper) -> list[Entity]:
    """Return the name of a zone, with its leader if it stands outside; nothing if there is no room."""
    middle_mm = _middle_mm(zone)
    xmin, ymin, xmax, ymax = (1000.0 * edge for edge in zone.region.bounds)
    tight: list[Text] = []
    beside: list[Text] = []
    squeezed: list[Text] = []
    hiding: list[tuple[int, Text]] = []
    for height_mm in _HEIGHTS_MM:
        words, fitted_mm = fit_text(zone_text(zone), _LONGEST_MM, height_mm)
        if fitted_mm < height_mm and height_mm != _HEIGHTS_MM[-1]:
            continue
        sample = Text(layer=_layer(zone), text=words, position_mm=(0, 0), height_mm=fitted_mm, anchor="middle")
        contents = paper.contents(sample)
        if contents is None:
            continue
        places_mm, hidden, airy, uncut, free = contents
        # A text that crosses no edge and has its middle in the zone lies in the zone.
        own = _nearest(places_mm, free & uncut, np.abs(places_mm - middle_mm).sum(axis=1))
        own = own[covers(zone.region, places_mm[own] / 1000.0)]
        open_places, clear = own[airy[own]], own[hidden[own] == 0]
        if len(open_places):
            return [_moved(sample, places_mm[open_places[0]])]
        if len(clear):
            tight.append(_moved(sample, places_mm[clear[0]]))
        elif len(own):
            best = own[np.argmin(hidden[own])]
            hiding.append((int(hidden[best]), _moved(sample, places_mm[best])))
        if height_mm == _HEIGHTS_MM[0]:
            continue
        away_mm = np.maximum(0.0, np.maximum((xmin, ymin) - places_mm, places_mm - (xmax, ymax))).sum(axis=1)
        outside = free & uncut & (hidden == 0) & (away_mm > 0.0)
        for found, allowed in ((beside, outside & airy), (squeezed, outside)):
            near = _nearest(places_mm, allowed, away_mm)
            if len(near):
                found.append(_moved(sample, places_mm[near[0]]))
    if not beside and tight:
        return [tight[-1]]
    if beside or squeezed:
        text = [*beside, *squeezed][0]
        return [text, *_leader(text, zone, paper.scale)]
    return [min(hiding, key=lambda found: found[0])[1]] if hiding else []


def _leader(text: Text, zone: Zone, scale: int) -> list[Entity]:
    """Return a line from the text to the nearest point of the zone's border, which gets an oblique stroke.

    Nothing that could be taken for a tag stands there.
    """
    xmin, ymin, xmax, ymax = (edge / 1000.0 for edge in _box_mm(text, scale))
    line = shapely.shortest_line(box(xmin, ymin, xmax, ymax), zone.region.boundary)
    (x0, y0), (x1, y1) = (1000.0 * shapely.get_coordinates(line)).tolist()
    angle = math.atan2(y1 - y0, x1 - x0) + math.pi / 4.0
    dx, dy = (0.5 * _STROKE_MM * scale * share for share in (math.cos(angle), math.sin(angle)))
    return [
        Line(layer="A-DIMS", start_mm=(x0, y0), end_mm=(x1, y1)),
        Line(layer="A-DIMS", start_mm=(x1 - dx, y1 - dy), end_mm=(x1 + dx, y1 + dy)),
    ]


def _nearest(places_mm: FloatArray, allowed: BoolArray, distance_mm: FloatArray) -> IntArray:
    """Return the indices of allowed places by rising distance, at most `_MOST_TRIED`."""
    index = np.flatnonzero(allowed)
    return index[np.argsort(distance_mm[index], kind="stable")[:_MOST_TRIED]]


def _moved(text: Text, middle_mm: FloatArray) -> Text:
    """Return ``text`` at ``middle_mm``."""
    return replace(text, position_mm=(float(middle_mm[0]), float(middle_mm[1])))


def _box_mm(text: Text, scale: int) -> Box:
    """Return the box of a text with some air, in the millimetres of the view."""
    xmin, ymin, xmax, ymax = text_box(text, scale)
    return Box(*(scale * edge for edge in (xmin - _GAP_MM, ymin - _GAP_MM, xmax + _GAP_MM, ymax + _GAP_MM)))


def _middle_mm(zone: Zone) -> FloatArray:
    """Return a point well inside the zone, shape (2,)."""
    inside = zone.region.representative_point()
    return np.array([inside.x, inside.y]) * 1000.0


def _layer(zone: Zone) -> Layer:
    return "A-ZONE" if zone.taggable else "A-NOTAG"
