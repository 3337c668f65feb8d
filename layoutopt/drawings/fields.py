"""A floor in fields: rectangles that each fit a sheet, and what of the site lies in one of them."""

import math
from dataclasses import dataclass, replace
from typing import Final

import numpy as np
import shapely
from shapely.geometry import LineString, MultiPolygon, Polygon, box
from shapely.geometry.base import BaseGeometry

from layoutopt.drawings.sheet import Box
from layoutopt.identity import IntArray
from layoutopt.layout import TagMap
from layoutopt.site import Site

_LEAST_AREA_M2: Final = 1e-6
_BORDER_M: Final = 1e-3
_ROUNDING_M: Final = 1e-9


@dataclass(frozen=True, slots=True, kw_only=True)
class Field:
    """A rectangle of the floor, in metres of the floor frame, with its column and row among all fields from 0."""

    bounds_m: tuple[float, float, float, float]
    column: int
    row: int

    @property
    def box_mm(self) -> Box:
        """The rectangle in millimetres."""
        return Box(*(1000.0 * edge for edge in self.bounds_m))


def fields_of(site: Site, size_m: tuple[float, float]) -> tuple[Field, ...]:
    """Return the fields that hold open floor, row by row from the datum.

    ``size_m`` is the largest width and height of a field. All fields are equally large and together just cover the
    floor's bounds, so that none is a sliver.
    """
    xmin, ymin, xmax, ymax = site.bounds_m
    columns, rows = (
        max(1, math.ceil((high - low) / size - 1e-9))
        for low, high, size in ((xmin, xmax, size_m[0]), (ymin, ymax, size_m[1]))
    )
    x_m, y_m = np.linspace(xmin, xmax, columns + 1).tolist(), np.linspace(ymin, ymax, rows + 1).tolist()
    fields = [
        Field(bounds_m=(x_m[column], y_m[row], x_m[column + 1], y_m[row + 1]), column=column, row=row)
        for row in range(rows)
        for column in range(columns)
    ]
    shapely.prepare(site.open_floor)
    rectangles = [box(*field.bounds_m) for field in fields]
    return tuple(
        field
        for field, rectangle, meets in zip(
            fields, rectangles, shapely.intersects(site.open_floor, rectangles), strict=True
        )
        if meets and site.open_floor.intersection(rectangle).area > _LEAST_AREA_M2
    )


def clipped(site: Site, bounds_m: tuple[float, float, float, float]) -> Site:
    """Return the part of a site within a rectangle that holds floor; its datum is not that of the site.

    Of a zone or an obstacle that the rectangle cuts into several parts, a zone keeps its largest.
    """
    zones = []
    for zone in site.zones:
        parts = parts_within(zone.region, bounds_m)
        if parts:
            zones.append(replace(zone, region=max(parts, key=lambda part: part.area)))
    return Site(
        name=site.name,
        floor=MultiPolygon(parts_within(site.floor, bounds_m)),
        obstacles=tuple(part for shape in site.obstacles for part in parts_within(shape, bounds_m)),
        zones=tuple(zones),
        tiling=site.tiling,
        source=site.source,
    )


def parts_within(shape: BaseGeometry, bounds_m: tuple[float, float, float, float]) -> list[Polygon]:
    """Return the polygons of a shape within a rectangle."""
    if not _meets(shape, bounds_m):
        return []
    parts = shapely.get_parts(shapely.clip_by_rect(shape, *bounds_m)).tolist()
    return [part for part in parts if isinstance(part, Polygon) and part.area > _LEAST_AREA_M2]


def lines_within(shape: BaseGeometry, bounds_m: tuple[float, float, float, float]) -> list[LineString]:
    """Return the outlines of a shape within a rectangle, those on its border too."""
    xmin, ymin, xmax, ymax = bounds_m
    wider = (xmin - _BORDER_M, ymin - _BORDER_M, xmax + _BORDER_M, ymax + _BORDER_M)
    if not _meets(shape, wider):
        return []
    lines = shapely.line_merge(shapely.clip_by_rect(shape.boundary, *wider))
    return [line for line in shapely.get_parts(lines).tolist() if line.length > 2.0 * _BORDER_M]


def tags_within(tag_map: TagMap, bounds_m: tuple[float, float, float, float], site: Site) -> IntArray:
    """Return the rows of the tags in a rectangle; one on a border belongs to the field right of or above it.

    At the floor's own right and upper border there is no such field, so that no tag is left out.
    """
    low, high = np.array(bounds_m[:2]), np.array(bounds_m[2:])
    last = np.array(site.bounds_m[2:])
    open_m = np.where(high >= last - _BORDER_M, high + _BORDER_M, high - _ROUNDING_M)
    inside = (tag_map.xy_m >= low - _ROUNDING_M) & (tag_map.xy_m < open_m)
    return np.flatnonzero(inside.all(axis=1))


def _meets(shape: BaseGeometry, bounds_m: tuple[float, float, float, float]) -> bool:
    xmin, ymin, xmax, ymax = shape.bounds
    return bool(xmin < bounds_m[2] and xmax > bounds_m[0] and ymin < bounds_m[3] and ymax > bounds_m[1])
