"""The layouts of mi2016 as marks beside a front: same robots' drive, but a chassis and a floor of their own."""

from dataclasses import replace
from typing import Final

import numpy as np
from shapely.geometry import box

from layoutopt import registry
from layoutopt.layout import WHOLE_FLOOR, FloorTags, Layout, ZonePattern
from layoutopt.problem import Problem
from layoutopt.protocols import Mount
from layoutopt.readers.profiles import PROFILES
from layoutopt.scenario import Role, Routes, Scenario
from layoutopt.site import Site
from layoutopt.space import DesignSpace

CHASSIS_M: Final = (1.2, 1.1)
FLOOR_SIDE_M: Final = 6.0
TAGS_PER_M2: Final = (100, 16)
_ARRAYS: Final = {
    "mi2016_96": (96, 0.030, 0.020),
    "mi2016_24": (24, 0.060, 0.024),
    "mi2016_20": (20, 0.060, 0.024),
    "mi2016_8": (8, 0.060, 0.024),
}
"""Array: number of readers, antenna side and antenna height, m (mi2016, Sections 5.3 and 5.4)."""


def scenario(problem: Problem) -> Scenario:
    """Return the clear floor on which the published layouts are judged.

    Drive, odometry, faults and duration are those of the problem's own design scenario; floor and chassis differ,
    because the arrays of the paper do not fit under a small robot, and the robot patrols, because way points of
    another floor may lie off this one.
    """
    length_m, width_m = CHASSIS_M[0] / 2.0, CHASSIS_M[1] / 2.0
    corners = [(-length_m, -width_m), (length_m, -width_m), (length_m, width_m), (-length_m, width_m)]
    return replace(
        problem.design,
        name="reference/clear_floor",
        role=Role.HELD_OUT,
        site=Site(name="clear floor", floor=box(0.0, 0.0, FLOOR_SIDE_M, FLOOR_SIDE_M)),
        robot=replace(problem.design.robot, outline_m=np.array(corners)),
        routes=Routes(),
    )


def layouts(space: DesignSpace) -> tuple[tuple[str, Layout], ...]:
    """Return label and layout of the paper's four arrays over its lattices of 100 and 16 tags per square metre.

    They carry what finds things off the floor in the space, so that their costs compare with those of its layouts.
    """
    antenna = registry.load("antennas", "sphere")
    square = registry.load("patterns", "square")
    found = []
    for name, (count, side_m, height_m) in _ARRAYS.items():
        mount = Mount(antenna=antenna(side_m=side_m), height_m=height_m, profile=PROFILES["mi2016"])
        group = registry.load("readers", name)(mount=mount)
        for density in TAGS_PER_M2:
            pattern = square(pitch_m=1.0 / np.sqrt(density))
            floor_tags = FloorTags(zones=(ZonePattern(zone=WHOLE_FLOOR, pattern=pattern),))
            label = f"{count} readers, {density} tags/m²"
            found.append((label, space.equipped(floor_tags, group)))
    return tuple(found)
