"""Rows and columns in which tags stand: found, drawn as a grid, and dimensioned from the datum."""

from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import Final, Literal

import numpy as np

from layoutopt.drawings.dimensions import grid_lines, running_dimensions
from layoutopt.drawings.lettering import fit_text, width_mm
from layoutopt.drawings.sheet import Box, Entity, Text
from layoutopt.drawings.symbols import Point
from layoutopt.identity import BoolArray, FloatArray, IntArray
from layoutopt.layout import WHOLE_FLOOR, Layout, TagMap
from layoutopt.site import Site

FLOOR: Final = "floor"
"""Name of the group with the pattern of the whole floor, also if zones have it too."""
LINE_OFFSET_MM: Final = 6.0
"""From the floor to the first dimension line, on paper."""
MOST_LINES: Final = 4
"""Dimension lines along one axis; groups beyond that are not dimensioned."""
CLOSEST_LINES_MM: Final = 4.0
"""Grid lines closer than this on paper would hide the tags: only the labelled ones are drawn."""

_MOST_SINGLE_LINES: Final = 60
_LEAST_TAGS_A_LINE: Final = 3
_LABEL_MM: Final = 2.5
_NAME_MM: Final = 30.0
_ROUNDING_DIGITS: Final = 4
_SAME_MM: Final = 1e-6


@dataclass(frozen=True, slots=True, kw_only=True)
class TagGroup:
    """Tags that one pattern, in one place and turn, puts on the floor.

    Attributes
    ----------
    name
        Zones that have the pattern, `FLOOR` for the whole floor.
    index
        Rows of the tag map, shape (n,).
    columns_mm, rows_mm
        Distinct x and y of the tags, ascending, in the floor frame; empty if the tags stand in no columns or
        rows along the axes.
    spacing_mm
        Distance of a tag to its nearest neighbour, median; infinite for a single tag.
    first_column, first_row
        How many columns and rows of the whole floor come before those here: a part of a floor keeps its labels.
    """

    name: str
    index: np.ndarray[tuple[int, ...], np.dtype[np.int64]]
    columns_mm: tuple[float, ...]
    rows_mm: tuple[float, ...]
    spacing_mm: float
    first_column: int = 0
    first_row: int = 0

    def within(self, kept: IntArray, bounds_mm: Box) -> "TagGroup":
        """Return the part of the group in a box; ``kept`` are the rows of the tag map that make the part's own."""
        place = np.searchsorted(kept, self.index)
        here = (place < len(kept)) & (kept[np.minimum(place, len(kept) - 1)] == self.index)
        columns = [x for x in self.columns_mm if bounds_mm.xmin <= x <= bounds_mm.xmax]
        rows = [y for y in self.rows_mm if bounds_mm.ymin <= y <= bounds_mm.ymax]
        return replace(
            self,
            index=place[here],
            columns_mm=tuple(columns),
            rows_mm=tuple(rows),
            first_column=self.first_column + sum(x < bounds_mm.xmin for x in self.columns_mm),
            first_row=self.first_row + sum(y < bounds_mm.ymin for y in self.rows_mm),
        )


def tag_groups(layout: Layout, site: Site, tag_map: TagMap) -> tuple[TagGroup, ...]:
    """Return the tags by pattern: the whole floor first, then by number, none without a tag."""
    entries = layout.floor_tags.zones
    own = {entry.zone for entry in entries}
    zone = site.zone_of(tag_map.xy_m, own)
    members: dict[object, list[str]] = {}
    chosen: dict[object, BoolArray] = {}
    for entry in entries:
        where = zone == (-1 if entry.zone == WHOLE_FLOOR else site.zone_names.index(entry.zone))
        same = (entry.pattern.key, entry.origin_m, entry.angle_rad)
        members.setdefault(same, []).append(FLOOR if entry.zone == WHOLE_FLOOR else entry.zone)
        chosen[same] = chosen[same] | where if same in chosen else where
    groups = [
        _group(FLOOR if FLOOR in names else ", ".join(names), np.flatnonzero(chosen[same]), tag_map.xy_m * 1000.0)
        for same, names in members.items()
        if chosen[same].any()
    ]
    return tuple(sorted(groups, key=lambda group: (group.name != FLOOR, -len(group.index))))


def _group(name: str, index: np.ndarray[tuple[int, ...], np.dtype[np.int64]], places_mm: FloatArray) -> TagGroup:
    from scipy.spatial import cKDTree

    own_mm = places_mm[index]
    spacing_mm = np.inf
    if len(index) > 1:
        distance_mm, _ = cKDTree(own_mm).query(own_mm, k=2)
        spacing_mm = np.median(np.asarray(distance_mm)[:, 1])
    return TagGroup(
        name=name,
        index=index,
        columns_mm=_lines(own_mm[:, 0]),
        rows_mm=_lines(own_mm[:, 1]),
        spacing_mm=float(spacing_mm),
    )


def _lines(values_mm: FloatArray) -> tuple[float, ...]:
    """Return the distinct values, or none if they are too many to be lines on which tags are placed."""
    distinct = np.unique(np.round(values_mm, _ROUNDING_DIGITS))
    if len(distinct) > _MOST_SINGLE_LINES and len(distinct) * _LEAST_TAGS_A_LINE > len(values_mm):
        return ()
    return tuple(distinct.tolist())


def grid_and_dimensions(
    groups: Sequence[TagGroup], *, floor_mm: Box, scale: int, datum_mm: Point | None = None
) -> tuple[tuple[Entity, ...], tuple[str, ...]]:
    """Return grid lines of the first group, running dimensions of all, and remarks for the sheet.

    All dimensions are from ``datum_mm``, by default the lower left corner of ``floor_mm``. Dimension lines lie
    below and left of the floor: first that of the first group, then one for each other group that has lines of
    its own, each with its name.
    """
    if not groups:
        return (), ()
    base = groups[0]
    entities = list(
        grid_lines(
            base.columns_mm,
            base.rows_mm,
            extent_mm=floor_mm,
            scale=scale,
            closest_mm=CLOSEST_LINES_MM,
            first_column=base.first_column,
            first_row=base.first_row,
        )
    )
    remarks = []
    for lines, word in ((base.columns_mm, "columns"), (base.rows_mm, "rows")):
        if len(lines) > 1 and min(np.diff(lines)) < CLOSEST_LINES_MM * scale:
            remarks.append(f"All {word} of tags are counted, but only those with a label have a grid line.")
    axes: tuple[tuple[Literal["x", "y"], list[tuple[str, tuple[float, ...]]]], ...] = (
        ("x", [(group.name, group.columns_mm) for group in groups]),
        ("y", [(group.name, group.rows_mm) for group in groups]),
    )
    for axis, named in axes:
        drawn, left_out = _dimension_lines(named, axis, floor_mm, scale, datum_mm or floor_mm[:2])
        entities += drawn
        if left_out:
            what = "columns" if axis == "x" else "rows"
            remarks.append(f"Tag {what} of {', '.join(left_out)} are not dimensioned: see tags.csv.")
    return tuple(entities), tuple(remarks)


def _dimension_lines(
    named: Sequence[tuple[str, tuple[float, ...]]],
    axis: Literal["x", "y"],
    floor_mm: Box,
    scale: int,
    datum: Point,
) -> tuple[list[Entity], list[str]]:
    """Return the dimension lines of one axis, and the names of groups for which there is none."""
    datum_mm, wall_mm, begin_mm, far_mm = (
        (datum[0], floor_mm.ymin, floor_mm.xmin, floor_mm.xmax)
        if axis == "x"
        else (datum[1], floor_mm.xmin, floor_mm.ymin, floor_mm.ymax)
    )
    wanted: list[tuple[str, tuple[float, ...]]] = []
    left_out = [name for name, values in named if not values]
    for name, values in named:
        told = {round(value, 3) for _, before in wanted for value in before}
        if not values or told.issuperset(round(value, 3) for value in values):
            continue
        if len(wanted) == MOST_LINES:
            left_out.append(name)
        else:
            wanted.append((name, values))
    entities: list[Entity] = []
    line_mm = wall_mm - LINE_OFFSET_MM * scale
    for number, (name, values) in enumerate(wanted):
        entities += running_dimensions(
            values,
            datum_mm=datum_mm,
            axis=axis,
            line_mm=line_mm,
            scale=scale,
            cut_mm=None if begin_mm - _SAME_MM <= datum_mm <= far_mm + _SAME_MM else begin_mm,
            # Witness lines of a later dimension line would cross the labels of those before it.
            witness_mm=wall_mm if number == 0 else None,
            height_mm=_LABEL_MM,
        )
        if len(wanted) > 1:
            fitted, height = fit_text(name, _NAME_MM, _LABEL_MM)
            end_mm = max(*values, begin_mm) + 3.0 * scale
            place = (end_mm, line_mm) if axis == "x" else (line_mm, end_mm)
            entities.append(
                Text(
                    layer="A-DIMS",
                    text=fitted,
                    position_mm=place,
                    height_mm=height,
                    anchor="middle-left",
                    angle_deg=0.0 if axis == "x" else 90.0,
                )
            )
        longest = max(width_mm(f"{value - datum_mm:.1f}", _LABEL_MM) for value in (values[0], values[-1]))
        line_mm -= (longest + 6.0) * scale
    return entities, left_out
