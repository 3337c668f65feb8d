"""A hall in which robots dock, small enough for quick tests."""

import math
from dataclasses import replace

import numpy as np
from shapely.geometry import box

from layoutopt.antennas.crossed_loops import CrossedLoops
from layoutopt.docking_world import DockingWorld
from layoutopt.layout import FloorTags, Layout, Transponder
from layoutopt.readers.finders import docking_antennas
from layoutopt.robot import Robot
from layoutopt.scenario import Faults, Role, Scenario
from layoutopt.site import Site

ROBOT = Robot(outline_m=np.array([(-0.2, -0.2), (0.2, -0.2), (0.2, 0.2), (-0.2, 0.2)]))
HALL = Site(name="hall", floor=box(0.0, 0.0, 6.0, 5.0))
SCENARIO = Scenario(
    name="docking",
    role=Role.HELD_OUT,
    site=HALL,
    robot=ROBOT,
    faults=Faults(direction_noise_rad=math.radians(2.0)),
    docking=DockingWorld(),
)


def layout(*places_m, names=("dock",)):
    """A robot with crossed antennas, and transponders at places."""
    transponders = (
        Transponder(name=name, position_m=(x_m, y_m, 0.5))
        for name, (x_m, y_m) in zip(names, places_m, strict=True)
    )
    return Layout(
        floor_tags=FloorTags(zones=()),
        readers=(docking_antennas(antenna=CrossedLoops()),),
        transponders=tuple(transponders),
    )


def scenario(site=HALL, scatterers_m=(), **world):
    """The scenario on another site, among scatterers, in another world."""
    scatterers = np.array(scatterers_m, dtype=np.float64).reshape(-1, 2)
    return replace(SCENARIO, site=site, scatterers_m=scatterers, docking=replace(SCENARIO.docking, **world))
