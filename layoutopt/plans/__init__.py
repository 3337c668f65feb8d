"""Readers of floor plans: functions that take a file and return the open floor.

A plan reader is called as ``reader(path, place=..., **settings)`` and returns a `layoutopt.plans.floor.Floor`;
its settings all have defaults and are the keys of ``[site.plan]``.
"""

from typing import Final

EXTENSION_POINT: Final = "plans"
ROWS: Final = {
    "occupancy_map": "layoutopt.plans.occupancy_map:read_occupancy_map",
    "dxf": "layoutopt.plans.dxf:read_dxf",
    "geojson": "layoutopt.plans.geojson:read_geojson",
    "image": "layoutopt.plans.image:read_image",
}
