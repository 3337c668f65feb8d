"""A small world of tracking, and trackers that know the truth or nothing of it."""

import math
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np
from shapely.geometry import box

from layoutopt.antennas.uhf_patch import UhfPatch
from layoutopt.estimators.targets import TargetTrack
from layoutopt.layout import FloorTags, Layout
from layoutopt.protocols import EstimatorCard
from layoutopt.readers.finders import yawed_antennas
from layoutopt.robot import Robot
from layoutopt.scenario import Role, Scenario
from layoutopt.site import Site
from layoutopt.tracking_world import TrackingWorld

SITE = Site(name="room", floor=box(-1, -3, 5, 3))
ROBOT = Robot(outline_m=np.array([(-0.2, -0.2), (0.2, -0.2), (0.2, 0.2), (-0.2, 0.2)]))
WALK_M = np.array([(1, -2), (3, -2), (3, 2), (1, 2)], dtype=float)
WORLD = TrackingWorld(robot_pose=(0.0, 0.0, 0.0), walk_m=WALK_M)
SCENARIO = Scenario(name="tracking", role=Role.DESIGN, site=SITE, robot=ROBOT, step_count=3000, tracking=WORLD)


def world(**changes):
    """Return the scenario with another world of tracking."""
    return replace(SCENARIO, tracking=replace(WORLD, **changes))


def layout(count=2, yaw_deg=45.0, interval_s=0.4, antenna=None):
    """Return a layout of UHF antennas alone."""
    group = yawed_antennas(
        antenna=UhfPatch() if antenna is None else antenna,
        count=count,
        yaw_rad=math.radians(yaw_deg),
        interval_s=interval_s,
    )
    return Layout(floor_tags=FloorTags(zones=()), readers=(group,), target_tags=1)


@dataclass(frozen=True)
class Standing:
    """A tracker that always says the same place, and keeps nothing of what it is told."""

    place_m: tuple[float, float] = (2.0, 0.0)
    reason: str = ""
    rows: int = 0
    name: ClassVar[str] = "standing"
    key: ClassVar[str] = "standing"
    card: ClassVar[EstimatorCard] = EstimatorCard(
        summary="Says the same place.", reference="none", estimates="target", needs="signal"
    )

    def applies(self, layout):
        """Return the reason that it was given."""
        return self.reason

    def run(self, knowledge, observations, draws):
        """Return the place at every instant, or at so many rows more."""
        count = len(observations) + self.rows
        return TargetTrack(
            places_m=np.tile(self.place_m, (count, 1)),
            blind=np.zeros(count, dtype=bool),
            matched=np.zeros(count, dtype=bool),
        )
