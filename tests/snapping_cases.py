"""Small floors with turned tiles, and every mark on them, listed plainly."""

import numpy as np
from hypothesis import strategies as st
from shapely.geometry import Polygon, box

from layoutopt.layout import FloorTags, ZonePattern
from layoutopt.patterns.square import square
from layoutopt.site import Site, Tiling, Zone

SIZE_M = (0.04, 0.02)
MARGIN_M, LEAST_M = 0.02, 0.04
STEP_M = 0.002
KINDS = ("corners", "joints", "centres", "chalk")


@st.composite
def sites(draw):
    """Rooms with a slanting wall, an obstacle, a metal plate and turned tiles."""
    corner = st.integers(100, 900).map(lambda number: number / 1000)
    x_m, y_m = draw(corner), draw(corner)
    plate = box(u_m := draw(corner), v_m := draw(corner), u_m + 0.25, v_m + 0.2)
    return Site(
        name="room",
        floor=Polygon([(0, 0), (1.5, 0), (1.5, 0.8), (1.1, 1.2), (0, 1.2)]),
        obstacles=(box(x_m, y_m, x_m + 0.2, y_m + 0.15),),
        zones=(Zone(name="plate", region=plate.intersection(box(0, 0, 1.1, 1.1)), metal=True),),
        tiling=Tiling(
            size_m=draw(st.integers(120, 400)) / 1000,
            origin_m=(draw(corner), draw(corner)),
            angle_rad=draw(st.integers(-300, 300)) / 100,
        ),
    )


@st.composite
def tag_floors(draw):
    """Square patterns, turned or not, of tags of 40 mm by 20 mm."""
    origin_m = (draw(st.integers(0, 200)) / 1000, draw(st.integers(0, 200)) / 1000)
    entry = ZonePattern(
        zone="",
        pattern=square(pitch_m=draw(st.integers(60, 260)) / 1000),
        origin_m=origin_m,
        angle_rad=draw(st.sampled_from((0.0, 0.0, 0.4))),
    )
    return FloorTags(zones=(entry,), tag_size_m=SIZE_M)


def local(points_m, grid):
    """Return points in the frame of a grid."""
    cos, sin = np.cos(grid.angle_rad), np.sin(grid.angle_rad)
    x_m, y_m = (np.reshape(points_m, (-1, 2)) - grid.origin_m).T
    return np.stack([x_m * cos + y_m * sin, y_m * cos - x_m * sin], axis=1)


def on_floor(points_m, grid):
    """Return points of a grid's frame in that of the floor."""
    cos, sin = np.cos(grid.angle_rad), np.sin(grid.angle_rad)
    x_m, y_m = np.reshape(points_m, (-1, 2)).T
    return np.stack([x_m * cos - y_m * sin, x_m * sin + y_m * cos], axis=1) + grid.origin_m


def grid_of(site, kind):
    """Return the squares whose corners or centres are the marks."""
    return Tiling(size_m=0.07, origin_m=(0.0, 0.0)) if kind == "chalk" else site.tiling


def tile(grid, column, row):
    """Return one square of a grid as a polygon of the floor frame."""
    corners = [(column, row), (column + 1, row), (column + 1, row + 1), (column, row + 1)]
    return Polygon(on_floor(np.array(corners) * grid.size_m, grid))


def all_marks(site, kind, step_m=STEP_M):
    """Return every mark on or near the floor, shape (n, 2); points on joints in steps."""
    grid = grid_of(site, kind)
    reach = int(np.ceil(2.8 / grid.size_m))
    numbers = np.arange(-reach, reach + 1)
    if kind == "joints":
        along = np.arange(-3.0, 3.0, step_m)
        ways = [np.stack([np.full(len(along), number * grid.size_m), along], axis=1) for number in numbers]
        return near_floor(on_floor(np.concatenate([*ways, *(way[:, ::-1] for way in ways)]), grid))
    places = np.stack(np.meshgrid(numbers, numbers), axis=-1).reshape(-1, 2)
    if kind != "centres":
        return near_floor(on_floor(places * grid.size_m, grid))
    found = []
    for column, row in places.tolist():
        whole = tile(grid, column, row)
        if whole.intersects(site.floor):
            left = whole.intersection(site.floor)
            if left.area >= whole.area * (1 - 1e-6):
                found.append(np.array(whole.centroid.coords[0]))
            elif left.area >= 0.5 * whole.area:
                corners = local(left.exterior.coords, grid)
                found.append(on_floor((corners.min(axis=0) + corners.max(axis=0)) / 2, grid)[0])
    return near_floor(np.array(found))


def near_floor(points_m):
    """Return the points in a box about the room."""
    return points_m[((points_m > -0.5) & (points_m < (2.0, 1.7))).all(axis=1)]
