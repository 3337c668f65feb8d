"""The place: a floor with obstacles and zones, all in one floor frame (x right, y up, metres)."""

from collections.abc import Collection, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from typing import Final

import numpy as np
import shapely
from numpy.typing import NDArray
from shapely.geometry import MultiPolygon, Polygon
from shapely.geometry.base import BaseGeometry

from layoutopt.geometry import covers
from layoutopt.identity import LATER, FloatArray, IntArray, by_content
from layoutopt.layout import PLAIN_TAG, WHOLE_FLOOR
from layoutopt.shown import Shown

INLINE: Final = "inline"
"""Source of a floor whose corners stand in the spec, or come from Python."""
CORNERS: Final = "corners in the spec"
"""How such a source is told to people."""
DRILLED_PARTS: Final = frozenset({"puck"})
"""Tags of a price list that are set into a drilled hole."""
METAL_PARTS: Final = frozenset({"on_metal"})
"""Tags with a ferrite back, the only ones that are read on a metal plate."""
_ROUNDING_M: Final = 1e-9
Points = NDArray[np.object_]
"""Points as shapely has them, shape (n,)."""


@by_content
@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Zone:
    """A named part of the floor with rules or a demand of its own.

    ``tags`` is false where no tag may be laid, ``metal`` true over a metal plate (which bars all tags but
    `METAL_PARTS`), ``drill`` false where no hole may be made (which bars `DRILLED_PARTS`), and
    ``target_error_m`` is the zone's own accuracy target.
    """

    name: str
    region: Polygon
    tags: bool = True
    metal: bool = False
    drill: bool = field(default=True, metadata=LATER)
    target_error_m: float | None = None
    key: str = field(init=False, repr=False, default="")

    def __post_init__(self) -> None:
        """Check the name, which the whole floor keeps for itself."""
        if self.name == WHOLE_FLOOR:
            raise ValueError("a zone needs a name")

    @property
    def taggable(self) -> bool:
        """Whether plain tags may be laid in the zone: `PLAIN_TAG` and all that need neither metal nor a hole."""
        return not self.rule_against(PLAIN_TAG)

    def rule_against(self, tag_part: str) -> str:
        """Return the rule that bars tags of a part from the zone, as a spec writes it; empty if none does."""
        if not self.tags:
            return "tags = false"
        if self.metal and tag_part not in METAL_PARTS:
            return "metal = true"
        return "drill = false" if not self.drill and tag_part in DRILLED_PARTS else ""


@dataclass(frozen=True, slots=True, kw_only=True)
class Tiling:
    """The grid of floor tiles (slabs): one tile's size, a corner, and the turn of its rows."""

    size_m: float
    origin_m: tuple[float, float] = (0.0, 0.0)
    angle_rad: float = 0.0


@by_content
@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Site(Shown):
    """A floor with obstacles, zones and tiles.

    Attributes
    ----------
    floor
        Everything inside the walls; may have holes and several parts.
    obstacles
        Things that stand on the floor: no tag below them and no robot through them.
    zones
        Named regions, each within the floor.
    source
        Where the plan came from, for manifests and title blocks.
    """

    name: str
    floor: Polygon | MultiPolygon
    obstacles: tuple[Polygon, ...] = ()
    zones: tuple[Zone, ...] = ()
    tiling: Tiling | None = None
    source: str = INLINE
    key: str = field(init=False, repr=False, default="")

    def __post_init__(self) -> None:
        """Check what every later step relies on."""
        if self.floor.is_empty or self.floor.area <= 0.0:
            raise ValueError("a site needs a floor with a positive area")
        names = [zone.name for zone in self.zones]
        if len(set(names)) != len(names):
            raise ValueError(f"zone names must differ, got {names}")

    @property
    def bounds_m(self) -> tuple[float, float, float, float]:
        """Return xmin, ymin, xmax, ymax of the floor."""
        xmin, ymin, xmax, ymax = self.floor.bounds
        return (xmin, ymin, xmax, ymax)

    @property
    def datum_m(self) -> tuple[float, float]:
        """The point from which the installer measures: the lower left corner of the floor's bounds."""
        return self.bounds_m[:2]

    def zone(self, name: str) -> Zone:
        """Return the zone of that name.

        Raises
        ------
        KeyError
            If the site has no such zone.
        """
        found = next((zone for zone in self.zones if zone.name == name), None)
        if found is None:
            raise KeyError(name)
        return found

    @property
    def zone_names(self) -> tuple[str, ...]:
        """Names of all zones, in the order of the spec."""
        return tuple(zone.name for zone in self.zones)

    @property
    def open_floor(self) -> BaseGeometry:
        """Floor less obstacles."""
        return _open_floor(self)

    def taggable_region(
        self, zone: str = WHOLE_FLOOR, margin_m: float = 0.0, tag_part: str = PLAIN_TAG
    ) -> BaseGeometry:
        """Return where centres of tags of a part may lie within a zone (``""``: everywhere).

        Centres keep ``margin_m`` from walls, obstacles and zones that bar such tags.
        """
        region = _taggable(self, margin_m, self._barred(tag_part))
        return region if zone == WHOLE_FLOOR else region.intersection(_with_border(self.zone(zone)))

    def why_barred(self, xy_m: FloatArray, margin_m: float = 0.0, tag_part: str = PLAIN_TAG) -> tuple[str, ...]:
        """Return for each point, shape (n, 2), what keeps the centre of a tag from it; empty where it may lie.

        ``"obstacle 3"`` and ``"zone 'plate' (metal = true)"`` hold the point, with ``"near "`` before them they
        are within the margin; obstacles count from 1. Others are ``"near the wall"`` and ``"off the floor"``.
        """
        words = [""] * len(xy_m)
        wrong = np.flatnonzero(~covers(self.taggable_region(WHOLE_FLOOR, margin_m, tag_part), xy_m))
        barring = [self.zone(name) for name in self._barred(tag_part)]
        names = [f"obstacle {number}" for number in range(1, len(self.obstacles) + 1)]
        names += [f"zone '{zone.name}' ({zone.rule_against(tag_part)})" for zone in barring]
        points = np.asarray(shapely.points(xy_m[wrong]))
        nearest, away_m = _nearest([*self.obstacles, *(zone.region for zone in barring)], points)
        wall_m = np.asarray(shapely.distance(points, self.floor.boundary))
        inside = covers(self.floor, xy_m[wrong])
        for row, name, distance_m, to_wall_m, on_floor in zip(
            wrong.tolist(), nearest.tolist(), away_m.tolist(), wall_m.tolist(), inside.tolist(), strict=True
        ):
            if not on_floor:
                words[row] = "off the floor" if to_wall_m > _ROUNDING_M else "near the wall"
            elif distance_m <= to_wall_m + _ROUNDING_M:
                words[row] = names[name] if distance_m <= _ROUNDING_M else f"near {names[name]}"
            else:
                words[row] = "near the wall"
        return tuple(words)

    def _barred(self, tag_part: str) -> tuple[str, ...]:
        """Return the names of the zones that bar tags of a part."""
        return tuple(zone.name for zone in self.zones if zone.rule_against(tag_part))

    def robot_region(self, radius_m: float) -> BaseGeometry:
        """Return where the centre of a round robot of that radius may be."""
        return _robot_region(self, radius_m)

    def zone_of(self, xy_m: FloatArray, among: Collection[str] | None = None) -> IntArray:
        """Return for each point, shape (n, 2), the index of the last zone that holds it, or -1.

        ``among`` names the zones that count; by default all of them do.
        """
        index = np.full(len(xy_m), -1, dtype=np.int64)
        for number, zone in enumerate(self.zones):
            if among is None or zone.name in among:
                index[covers(_with_border(zone), xy_m)] = number
        return index

    def tile_of(self, xy_m: FloatArray) -> IntArray:
        """Return for each point, shape (n, 2), column and row of its floor tile; zeros without a tiling."""
        if self.tiling is None:
            return np.zeros((len(xy_m), 2), dtype=np.int64)
        cos, sin = np.cos(self.tiling.angle_rad), np.sin(self.tiling.angle_rad)
        local = (xy_m - self.tiling.origin_m) @ np.array([[cos, -sin], [sin, cos]])
        return np.asarray(np.floor(local / self.tiling.size_m + 1e-9), dtype=np.int64)


@lru_cache(maxsize=256)
def _with_border(zone: Zone) -> BaseGeometry:
    """Return a zone's region with its border, for points that carry the rounding of a sum."""
    return zone.region.buffer(_ROUNDING_M, join_style="mitre")


def _nearest(shapes: Sequence[BaseGeometry], points: Points) -> tuple[IntArray, FloatArray]:
    """Return for each point the first of the nearest shapes and how far it is; infinitely far without shapes."""
    first = np.full(len(points), len(shapes), dtype=np.int64)
    away_m = np.full(len(points), np.inf)
    if len(shapes) and len(points):
        (rows, found), distance_m = shapely.STRtree(shapes).query_nearest(points, return_distance=True)
        np.minimum.at(first, rows, found)
        away_m[rows] = distance_m
    return first, away_m


@lru_cache(maxsize=64)
def _open_floor(site: Site) -> BaseGeometry:
    return site.floor.difference(shapely.union_all(site.obstacles)) if site.obstacles else site.floor


@lru_cache(maxsize=64)
def _taggable(site: Site, margin_m: float, barring: tuple[str, ...]) -> BaseGeometry:
    barred = [site.zone(name).region for name in barring]
    region = _open_floor(site)
    if barred:
        region = region.difference(shapely.union_all(barred))
    # A row of tags that just keeps the margin must not come and go with the last bit of a sum.
    return region.buffer(_ROUNDING_M - margin_m, join_style="mitre") if margin_m > 0.0 else region


@lru_cache(maxsize=64)
def _robot_region(site: Site, radius_m: float) -> BaseGeometry:
    return _open_floor(site).buffer(-radius_m, quad_segs=8)
