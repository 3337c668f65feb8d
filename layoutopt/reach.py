"""Tags that no antenna can ever come near enough to read, and layouts without them."""

from dataclasses import dataclass, replace
from functools import lru_cache
from typing import Final

import numpy as np
import shapely
from shapely.geometry.base import BaseGeometry

from layoutopt.identity import BoolArray
from layoutopt.layout import WHOLE_FLOOR, Layout, ReaderGroup, TagPattern, ZonePattern
from layoutopt.site import Site

_GRID_M: Final = 0.001
"""Reaches are rounded up to it, so that many layouts share one outline."""


@dataclass(frozen=True, slots=True)
class OnlyInReach:
    """Leaves out the tags of a layout that are in reach of no antenna wherever the robot stands and looks.

    A robot whose centre keeps ``robot_radius_m`` from walls and obstacles, as it does on all simulated drives,
    never brings an antenna near the floor along the walls. What is left is a pattern that is laid once. No read
    is lost, and tags, labour and survey are saved.
    """

    site: Site
    robot_radius_m: float

    def __call__(self, layout: Layout) -> Layout:
        """Return the layout without those tags; the same layout if there are none, or if all are.

        Raises
        ------
        ValueError
            If tags of the layout have been edited or are installed: an edit names its tag by the pattern, and what
            is installed lies where it lies.
        """
        tags = layout.floor_tags
        if tags.edits or tags.installed is not None:
            raise ValueError("tags are left out before they are edited or laid, not after")
        xy_m = tags.lay_on(self.site).xy_m
        kept = in_reach(layout, self.site, self.robot_radius_m)
        if kept.all() or not kept.any():
            return layout
        base = tags.base.pattern
        pattern = TagPattern(name=base.name, points_m=xy_m[kept], parameters=base.parameters)
        return replace(layout, floor_tags=replace(tags, zones=(ZonePattern(zone=WHOLE_FLOOR, pattern=pattern),)))


def in_reach(layout: Layout, site: Site, robot_radius_m: float) -> BoolArray:
    """Return for each tag of a layout whether any antenna can come near enough to read it, shape (n,)."""
    reaches_m = [reach_m(group) for group in layout.floor_readers]
    xy_m = layout.floor_tags.lay_on(site).xy_m
    if not reaches_m:
        return np.zeros(len(xy_m), dtype=np.bool_)
    area = _area_in_reach(site, robot_radius_m, float(np.ceil(max(reaches_m) / _GRID_M)))
    return np.asarray(shapely.contains_xy(area, xy_m[:, 0], xy_m[:, 1]))


def reach_m(group: ReaderGroup) -> float:
    """Return how far from the robot's centre a group reads tags at most; zero without antennas."""
    return max(
        (float(np.hypot(x_m, y_m)) + group.antenna.read_radius_m(float(z_m)) for x_m, y_m, z_m, _ in group.poses),
        default=0.0,
    )


@lru_cache(maxsize=512)
def _area_in_reach(site: Site, robot_radius_m: float, reach_steps: float) -> BaseGeometry:
    """Return where a tag may be read: no farther than the reach from where the robot's centre may be."""
    # A circle of many corners lies within the true one by less than the last step.
    area = site.robot_region(robot_radius_m).buffer((reach_steps + 1.0) * _GRID_M, quad_segs=32)
    shapely.prepare(area)
    return area
