"""A hall in which robots dock, small enough for quick tests."""

import math
from dataclasses import replace

import numpy as np
from shapely.geometry import box

from layoutopt.antennas.crossed_loops import CrossedLoops
from layoutopt.docking_world import DockingWorld
from layoutopt.estimators.bearings import BearingKnowledge, BearingReadings
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


def random_obstacles(room, count, drives, clearance_m, seed):
    """Obstacles at random places of a rectangular room, shape (drives, count, 2), clear of start and transponder.

    The first obstacles of a drive are the same whatever ``count`` is, so rooms with few and many are paired.
    """
    keep_off = np.array([room.start_m, room.transponder_m])
    low, high = np.array(room.bounds_m[:2]), np.array(room.bounds_m[2:])
    obstacles = np.empty((drives, count, 2))
    for drive in range(drives):
        draws = np.random.Generator(np.random.Philox(np.random.SeedSequence(seed, spawn_key=(0, drive))))
        for number in range(count):
            place = low + (high - low) * draws.random(2)
            while (np.hypot(*(keep_off - place).T) < clearance_m).any():
                place = low + (high - low) * draws.random(2)
            obstacles[drive, number] = place
    return obstacles


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


KNOWLEDGE = BearingKnowledge(floor=HALL.floor)


def readings(*, steps, drives, heard=True):
    """What robots are told that drive through the hall with true bearings of a transponder at (5, 4)."""
    numbers = np.arange(drives)
    start_m = np.stack([1.0 + 0.2 * numbers, 3.5 - 0.5 * numbers], axis=1)
    heading_rad = -0.3 * numbers
    unit = np.stack([np.cos(heading_rad), np.sin(heading_rad)], axis=1)
    told = []
    for step in range(steps):
        places_m = start_m + 0.1 * step * unit
        away = np.array([5.0, 4.0]) - places_m
        range_m = np.hypot(away[:, 0], away[:, 1])
        told.append(
            BearingReadings(
                drives=numbers,
                places_m=places_m,
                headings_rad=heading_rad,
                moved_m=np.full(drives, 0.1 if step else 0.0),
                stopped=np.zeros(drives, dtype=np.bool_),
                heard=np.full(drives, heard),
                bearings_rad=np.arctan2(away[:, 1], away[:, 0]) if heard else np.zeros(drives),
                strength_range_m=range_m if heard else np.ones(drives),
                true_range_m=range_m if heard else np.ones(drives),
            )
        )
    return told


def of_drives(told, rows):
    """The readings of some of the drives."""
    return BearingReadings(**{name: getattr(told, name)[rows] for name in BearingReadings.__dataclass_fields__})
