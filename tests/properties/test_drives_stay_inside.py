"""Whatever the site, the robot and the kind of route, a drive keeps off walls and obstacles."""

import numpy as np
import pytest
import shapely
from shapely.geometry import LineString, MultiPolygon, Point, Polygon, box

from layoutopt.plans.occupancy_map import read_occupancy_map
from layoutopt.robot import Drive, Robot
from layoutopt.scenario import Role, Routes, Scenario
from layoutopt.simulation.motion import drive
from layoutopt.simulation.routes import unreachable_area_m2
from layoutopt.site import Site, Zone
from layoutopt.streams import Streams


def ros_map(folder):
    """Return the floor of a speckled map with slanted walls and table legs."""
    draws = np.random.default_rng(8)
    row, column = np.indices((160, 240))
    values = np.where((row + column // 4 > 30) & (row - column // 6 < 130) & (column < 236) & (column > 3), 254, 0)
    for y, x in zip(draws.integers(40, 120, 25), draws.integers(20, 220, 25), strict=True):
        values[y : y + draws.integers(1, 6), x : x + draws.integers(1, 6)] = 0
    values[70:90, 100:104] = 205
    (folder / "map.pgm").write_bytes(b"P5\n240 160\n255\n" + values.astype(np.uint8).tobytes())
    (folder / "map.yaml").write_text("image: map.pgm\nresolution: 0.05\norigin: [-3, -2, 0.4]\n")
    return read_occupancy_map(folder / "map.yaml", place="map").polygon


def sites(folder):
    pillars = tuple(Point(x, y).buffer(0.2) for x in (2, 4, 6) for y in (1.5, 3.5))
    comb = Polygon(
        [(0, 0), (9, 0), (9, 5), (8, 5), (8, 1), (6, 1), (6, 5), (5, 5), (5, 1), (3, 1), (3, 5), (0, 5)]
    )
    return {
        "pillars": Site(name="pillars", floor=box(0, 0, 8, 5), obstacles=pillars),
        "map": Site(name="map", floor=ros_map(folder)),
        "comb": Site(name="comb", floor=comb),
        "parts": Site(name="parts", floor=MultiPolygon([box(0, 0, 5, 2), box(5.05, 0, 9, 2)])),
        "far": Site(name="far", floor=box(400_000, 500_000, 400_008, 500_005)),
    }


@pytest.mark.parametrize("kind", ["patrol", "point_to_point"])
@pytest.mark.parametrize("name", ["pillars", "map", "comb", "parts", "far"])
def test_drive_stays_inside(tmp_path, name, kind):
    """Every pose and the line between successive poses lie in the room of the robot, for 15 drives each."""
    site = sites(tmp_path)[name]
    middle = site.floor.representative_point()
    zone = Zone(name="bay", region=middle.buffer(0.6).intersection(site.floor), target_error_m=0.01)
    site = Site(name=site.name, floor=site.floor, obstacles=site.obstacles, zones=(zone,))
    for number, drive_kind in enumerate(Drive):
        half_m = (0.25, 0.15)[number]
        outline_m = [(-half_m, -half_m), (half_m, -half_m), (half_m, half_m), (-half_m, half_m)]
        robot = Robot(outline_m=outline_m, drive=drive_kind)
        world = Scenario(name=name, role=Role.DESIGN, site=site, robot=robot, routes=Routes(kind=kind))
        room = site.robot_region(robot.radius_m)
        shapely.prepare(room)
        for replication in range(15):
            poses = drive(world, Streams(seed=1), replication).poses
            assert room.covers(LineString(poses[:, :2]))
            assert np.linalg.norm(np.diff(poses[:, :2], axis=0), axis=1).max() <= 0.3 * 0.05 * (1 + 1e-6)
        assert unreachable_area_m2(site, robot) >= 0.0
