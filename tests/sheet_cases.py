"""Layouts, sites and robots whose installation drawings are looked at."""

from functools import cache

import numpy as np
import shapely
from shapely.geometry import MultiPolygon, box

from layoutopt import registry
from layoutopt.antennas.sphere import SphereAntenna
from layoutopt.drawings.layout_sheet import layout_sheet
from layoutopt.drawings.sheet import Marks, Text
from layoutopt.drawings.text_boxes import text_boxes
from layoutopt.layout import FloorTags, Layout, ZonePattern
from layoutopt.protocols import Mount
from layoutopt.readers.profiles import COMMERCIAL, MI2016
from layoutopt.robot import Robot
from layoutopt.site import Site, Tiling, Zone
from layoutopt.spec.reading import read_spec
from layoutopt.spec.template import built_in

ROBOT = Robot(outline_m=np.array([(-0.3, -0.25), (0.3, -0.25), (0.3, 0.25), (-0.3, 0.25)]))
WARD = read_spec(built_in())
TINY = Site(
    name="tiny",
    floor=box(0, 0, 4, 3),
    zones=(
        Zone(name="dock", region=box(0, 0, 1.5, 1.5), target_error_m=0.04),
        Zone(name="plate", region=box(3, 2, 4, 3), metal=True),
    ),
    tiling=Tiling(size_m=0.5),
)


def pattern(family, **parameters):
    return registry.load("patterns", family)(**parameters)


def readers(family="cross", *, side_m=0.06, profile=COMMERCIAL, ports=1, **parameters):
    mount = Mount(antenna=SphereAntenna(side_m=side_m), height_m=0.02, profile=profile, antennas_per_module=ports)
    return registry.load("readers", family)(mount=mount, **parameters)


def make(base, *, zones=(), group=None, edits=(), **changes):
    """Return a layout with a pattern on the whole floor and patterns on zones."""
    entries = [ZonePattern(zone="", pattern=base, **changes)]
    entries += [ZonePattern(zone=zone, pattern=own) for zone, own in zones]
    floor_tags = FloorTags(zones=tuple(entries), edits=tuple(edits))
    return Layout(floor_tags=floor_tags, readers=(group or readers(count=4),))


def draw(layout, site, robot=ROBOT, notes=()):
    tag_map = layout.floor_tags.lay_on(site)
    return layout_sheet(layout=layout, site=site, robot=robot, tag_map=tag_map, title="Tag plan", notes=notes)


def walked_map(parts=1):
    """Return a floor as a map reader makes it: stairs of 5 cm, hundreds of corners, holes, several parts."""
    draws = np.random.default_rng(3)
    floors = []
    for part in range(parts):
        cells = [box(-20 + 14 * part + x, 3 + y, -19 + 14 * part + x, 4 + y) for x in range(12) for y in range(8)]
        bites = []
        for x, y in draws.uniform((-20 + 14 * part, 3), (-8 + 14 * part, 11), (180, 2)):
            left, low = round(x / 0.05) * 0.05, round(y / 0.05) * 0.05
            bites.append(box(left, low, left + 0.15, low + 0.1))
        floor = shapely.union_all(cells).difference(shapely.union_all(bites))
        floors += [piece for piece in shapely.get_parts(floor) if piece.area > 1.0]
    return floors[0] if len(floors) == 1 else MultiPolygon(floors)


def many_zones():
    """Return a site with 20 zones, some without tags, some too small for their names."""
    zones = []
    for number in range(20):
        x, y, side = 0.2 + 2.3 * (number % 5), 0.2 + 1.9 * (number // 5), 0.1 if number % 7 == 3 else 1.5
        region = box(x, y, x + side, y + side)
        zones.append(Zone(name=f"zone_with_a_long_name_{number}", region=region, tags=number % 3 > 0))
    return Site(name="many zones", floor=box(0, 0, 12, 8), zones=tuple(zones))


def island():
    """Return a floor in a hole of another one, and an obstacle with a hole."""
    ring = box(0, 0, 10, 8).difference(box(3, 2, 7, 6))
    wall = box(0.5, 0.5, 2.5, 2.5).difference(box(1, 1, 2, 2))
    return Site(name="island", floor=MultiPolygon([ring, box(4, 3, 6, 5)]), obstacles=(wall,))


def random_points(count, width_m, height_m):
    points = np.random.default_rng(5).uniform((0.1, 0.1), (width_m - 0.1, height_m - 0.1), (count, 2))
    return pattern("listed", points_m=points.tolist())


ward_layouts = list(WARD.space.layouts())
CASES = {
    "ward, first": (ward_layouts[0], WARD.site, WARD.robot),
    "ward, middle": (ward_layouts[len(ward_layouts) // 2], WARD.site, WARD.robot),
    "ward, last": (ward_layouts[-1], WARD.site, WARD.robot),
    "ward, 60 mm": (make(pattern("square", pitch_m=0.06)), WARD.site, ROBOT),
    "ward, 270 mm": (
        make(pattern("square", pitch_m=0.27), zones=[("dock", pattern("square", pitch_m=0.12))]), WARD.site, ROBOT,
    ),
    "tiny": (make(pattern("square", pitch_m=0.1)), TINY, ROBOT),
    "tiny, sparse": (make(pattern("square", pitch_m=0.5)), TINY, ROBOT),
    "one tag": (make(pattern("square", pitch_m=3.0), origin_m=(1.0, 1.0)), TINY, ROBOT),
    "no tag": (make(pattern("listed", points_m=[(50.0, 50.0)])), TINY, ROBOT),
    "triangular": (make(pattern("triangular", pitch_m=0.15)), TINY, ROBOT),
    "turned": (make(pattern("square", pitch_m=0.1), angle_rad=0.3), TINY, ROBOT),
    "random": (make(random_points(300, 4, 3)), TINY, ROBOT),
    "zone patterns": (
        make(
            pattern("square", pitch_m=0.4),
            zones=[("dock", pattern("triangular", pitch_m=0.11)), ("plate", pattern("square", pitch_m=0.1))],
        ),
        TINY,
        ROBOT,
    ),
    "many zones": (
        make(
            pattern("square", pitch_m=0.2),
            zones=[(f"zone_with_a_long_name_{n}", pattern("square", pitch_m=0.05 + 0.013 * n)) for n in range(9)],
        ),
        many_zones(),
        ROBOT,
    ),
    "96 readers": (
        make(pattern("square", pitch_m=0.2), group=readers("mi2016_96", side_m=0.03, profile=MI2016)),
        TINY,
        Robot(outline_m=1.2 * np.array([(-0.6, -0.5), (0.6, -0.5), (0.6, 0.5), (-0.6, 0.5)])),
    ),
    "96 readers, 8 ports": (
        make(pattern("square", pitch_m=0.06), group=readers("mi2016_96", side_m=0.03, ports=8)), WARD.site, ROBOT,
    ),
    "one reader": (
        make(pattern("square", pitch_m=0.2), group=readers("listed", points_m=[(0.0, 0.0)])), TINY, ROBOT,
    ),
    "map": (make(pattern("square", pitch_m=0.15)), Site(name="map", floor=walked_map()), ROBOT),
    "map in parts": (
        make(pattern("square", pitch_m=0.3)),
        Site(name="map", floor=walked_map(3), tiling=Tiling(size_m=0.6, origin_m=(0.1, 0.2), angle_rad=0.2)),
        ROBOT,
    ),
    "island": (make(pattern("square", pitch_m=0.25)), island(), ROBOT),
    "corridor": (make(pattern("square", pitch_m=0.3)), Site(name="corridor", floor=box(0, 0, 60, 2.5)), ROBOT),
    "tower": (make(pattern("square", pitch_m=0.3)), Site(name="tower", floor=box(0, 0, 2.5, 60)), ROBOT),
    "hall": (make(pattern("square", pitch_m=2.0)), Site(name="hall", floor=box(-400, 90, 420, 700)), ROBOT),
    "far away": (
        make(pattern("square", pitch_m=0.2)),
        Site(name="far", floor=box(350_000, -580_000, 350_006, -579_996)),
        ROBOT,
    ),
}  # fmt: skip


@cache
def drawn(name):
    """Return the sheet of a case, drawn once for all tests that look at it."""
    return draw(*CASES[name])


def all_words(sheet):
    return [entry[0] for entry in text_boxes(sheet)]


def notes_of(sheet):
    """Return what the notes say, in one line."""
    return " ".join(item.text for item in sheet.entities if isinstance(item, Text))


def tags_of(sheet):
    (found,) = [item for item in sheet.views[0].entities if isinstance(item, Marks) and item.layer == "A-TAGS"]
    return found
