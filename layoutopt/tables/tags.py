"""The tag map as rows: one tag as an installer and a robot need it."""

from collections.abc import Iterator
from dataclasses import dataclass, fields
from typing import Final

import numpy as np

from layoutopt.identity import FloatArray
from layoutopt.layout import TagMap
from layoutopt.site import Site


@dataclass(frozen=True, slots=True, kw_only=True)
class TagRow:
    """One tag; the names of the fields are the columns of the tables.

    ``tile`` is column and row of the floor tile, such as ``c3r12``, empty without a tiling; ``uid`` is ``None``
    until the tag is scanned, and ``surveyed_x_m`` and ``surveyed_y_m`` are ``None`` until it is measured.
    """

    tag_id: int
    uid: str | None
    x_m: float
    y_m: float
    z_m: float
    yaw_rad: float
    type: str
    tile: str
    zone: str
    install_status: str
    surveyed_x_m: float | None
    surveyed_y_m: float | None
    sigma_m: float


TAG_COLUMNS: Final = tuple(entry.name for entry in fields(TagRow))


def tag_rows(tag_map: TagMap, site: Site, tag_part: str, surveyed_m: FloatArray | None = None) -> Iterator[TagRow]:
    """Yield a row for each tag, by rising identity, with lengths rounded to micrometres.

    ``surveyed_m``, shape (n, 2), holds measured places in the order of the map, NaN where there is none. Tags
    lie on the floor (z 0) with their longer side along x (yaw 0).
    """
    order = np.argsort(tag_map.ids, kind="stable")
    places_m = np.full((len(tag_map), 2), np.nan) if surveyed_m is None else surveyed_m
    x_m, y_m = _columns(tag_map.xy_m[order])
    surveyed_x_m, surveyed_y_m = (
        [None if place_m != place_m else place_m for place_m in column] for column in _columns(places_m[order])
    )
    tiles = [""] * len(order)
    if site.tiling is not None:
        tiles = [f"c{column}r{row}" for column, row in tag_map.tile[order].tolist()]
    zones = ["" if zone < 0 else site.zone_names[zone] for zone in tag_map.zone[order].tolist()]
    (sigma_m,) = _columns(tag_map.sigma_m[order, None])
    for number, (tag_id, index) in enumerate(zip(tag_map.ids[order].tolist(), order.tolist(), strict=True)):
        yield TagRow(
            tag_id=tag_id,
            uid=tag_map.uid[index],
            x_m=x_m[number],
            y_m=y_m[number],
            z_m=0.0,
            yaw_rad=0.0,
            type=tag_part,
            tile=tiles[number],
            zone=zones[number],
            install_status=tag_map.status[index],
            surveyed_x_m=surveyed_x_m[number],
            surveyed_y_m=surveyed_y_m[number],
            sigma_m=sigma_m[number],
        )


def _columns(values: FloatArray) -> list[list[float]]:
    """Return the columns of an array, rounded to six decimals, without a negative zero."""
    columns: list[list[float]] = (np.round(values, 6) + 0.0).T.tolist()
    return columns
