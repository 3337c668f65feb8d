"""Rooms of a floor that draws none: what is left where narrow passages are closed.

References
----------
R. Bormann et al., *Room segmentation: survey, implementation, and analysis*, ICRA 2016: morphological
segmentation, here exact on polygons and with one width of passages instead of a search for it.
"""

from typing import Final

import shapely
from shapely.geometry import Polygon
from shapely.geometry.base import BaseGeometry

from layoutopt.plans.placing import parts_of

PASSAGE_M: Final = 1.3
"""Passages that are narrower divide rooms: a little more than the width of a wide door."""

_SMALLEST_ROOM_M2: Final = 1.0


def rooms_of(floor: BaseGeometry, passage_m: float = PASSAGE_M) -> tuple[Polygon, ...]:
    """Return the rooms of an open floor, largest first, without the passages between them.

    A room is what squares as wide as a passage can cover without leaving the floor, where they can get without
    passing one. What two of them cover belongs to the larger. Rooms below 1 m² do not count.

    Examples
    --------
    >>> two = shapely.union_all([shapely.box(0, 0, 4, 3), shapely.box(4, 1, 5, 2), shapely.box(5, 0, 8, 3)])
    >>> [round(room.area, 6) for room in rooms_of(two)]
    [12.0, 9.0]
    """
    half_m = passage_m / 2.0
    cores = parts_of(shapely.buffer(floor, -half_m, join_style="mitre"))
    grown = [shapely.buffer(core, half_m, join_style="mitre").intersection(floor) for core in cores]
    grown.sort(key=lambda region: -region.area)
    tree = shapely.STRtree(grown)
    rooms: list[Polygon] = []
    for number, region in enumerate(grown):
        larger = [grown[other] for other in tree.query(region, predicate="intersects") if other < number]
        own = region.difference(shapely.union_all(larger)) if larger else region
        rooms += [part for part in parts_of(own) if part.area >= _SMALLEST_ROOM_M2]
    return tuple(sorted(rooms, key=lambda room: -room.area))
