"""Where a robot stands and a person walks in trials of tracking, on a site of which nobody said it."""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np
import shapely

from layoutopt.geometry import turned
from layoutopt.identity import FloatArray
from layoutopt.robot import Robot
from layoutopt.site import Site

WALKS_M: Final = ((2.0, 4.0), (2.0, 3.0), (2.0, 2.0), (4.0, 1.0), (2.0, 1.0), (1.0, 1.0), (1.0, 0.5), (0.5, 0.3))
"""Sizes of the rectangle that is walked round, ahead and aside, in the order in which they are tried: that of
liang2020 (Section 4.1), narrower ones, one for a corridor, and what a small room still has."""
AHEAD_M: Final = 1.0
"""From the robot to the near side of the rectangle, as in liang2020; the outline of a large robot comes on top."""
HEADINGS: Final = 16
"""Headings of the robot that are tried, evenly over a turn, the x axis of the floor first."""
_TOLERANCE_M: Final = 0.01
"""Of the place that is farthest from all walls: far finer than the place matters."""
_DECIMALS: Final = 3
"""Of coordinates: a millimetre."""


@dataclass(frozen=True, slots=True, kw_only=True)
class FinderPlace:
    """Pose of the robot (x m, y m, rad), corners of the walk, and what the site lacks, empty if nothing."""

    robot_pose: tuple[float, float, float]
    walk_m: FloatArray
    lack: str = ""


def standing_place(site: Site, robot: Robot) -> tuple[float, float]:
    """Return where the robot stands unless told: as far from walls and obstacles as it can drive.

    That is the centre of the largest circle in the region where its centre can be driven, to a centimetre.

    Raises
    ------
    InvalidInput
        If the robot fits nowhere.
    """
    # Imported here: it brings scipy's graphs, and a spec that says where the robot stands has no need of them.
    from layoutopt.simulation.routes import reachable_region

    circle = shapely.maximum_inscribed_circle(reachable_region(site, robot), _TOLERANCE_M)
    x_m, y_m = np.round(shapely.get_coordinates(circle)[0], _DECIMALS).tolist()
    return float(x_m), float(y_m)


def default_place(
    site: Site,
    robot: Robot,
    person_radius_m: float,
    robot_pose: tuple[float, float, float] | None = None,
) -> FinderPlace:
    """Return where the robot stands and the target walks unless a spec says it.

    The robot stands at the `standing_place`, or at ``robot_pose``. The walk is the first rectangle of `WALKS_M`
    that fits ahead of the robot at any of the `HEADINGS`, and the first heading at which it does: the hull of
    robot and rectangle, a person's radius wider, holds no wall and no obstacle, so the robot sees the whole walk.
    Where none fits the smallest lies ahead of the robot all the same and ``lack`` says what there is no room for.
    """
    x_m, y_m = standing_place(site, robot) if robot_pose is None else robot_pose[:2]
    headings_rad = (
        np.arange(HEADINGS) * (2.0 * math.pi / HEADINGS) if robot_pose is None else np.array(robot_pose[2:])
    )
    room = site.open_floor.buffer(-person_radius_m)
    shapely.prepare(room)
    near_m = max(AHEAD_M, robot.radius_m + 2.0 * person_radius_m)
    for size_m in WALKS_M:
        for heading_rad in headings_rad.tolist():
            corners_m = _rectangle((x_m, y_m, heading_rad), near_m, size_m)
            if room.covers(shapely.convex_hull(shapely.multipoints([(x_m, y_m), *corners_m]))):
                return FinderPlace(robot_pose=(x_m, y_m, heading_rad), walk_m=corners_m)
    pose = (x_m, y_m, float(headings_rad[0]))
    ahead_m, aside_m = WALKS_M[-1]
    return FinderPlace(
        robot_pose=pose,
        walk_m=_rectangle(pose, near_m, WALKS_M[-1]),
        lack=(
            f"from ({x_m:.2f}, {y_m:.2f}) m a robot sees no {ahead_m:g} m by {aside_m:g} m of open floor "
            f"{near_m:.2g} m ahead on which a person could walk"
        ),
    )


def _rectangle(pose: tuple[float, float, float], near_m: float, size_m: tuple[float, float]) -> FloatArray:
    """Return the corners of a rectangle ahead of a pose, shape (4, 2), m, on a grid of a millimetre."""
    ahead_m, aside_m = size_m
    far_m, half_m = near_m + ahead_m, aside_m / 2.0
    corners_m = np.array([(near_m, -half_m), (far_m, -half_m), (far_m, half_m), (near_m, half_m)])
    return np.asarray(np.round(turned(corners_m, pose[2]) + np.array(pose[:2]), _DECIMALS))
