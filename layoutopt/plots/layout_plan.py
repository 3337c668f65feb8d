"""The floor with its tags, and one robot on it: whole, and its underside enlarged."""

from typing import TYPE_CHECKING, Final

import numpy as np
import shapely
from shapely.geometry import Point, box

from layoutopt.geometry import covers, turned
from layoutopt.identity import FloatArray
from layoutopt.layout import Layout, TagMap
from layoutopt.plots.figures import (
    FAINT,
    INK,
    PAPER,
    SERIES,
    SMALL_PT,
    add_axes,
    legend_above,
    new_figure,
    rasterised,
)
from layoutopt.plots.finder_marks import draw_on_top, draw_transponders, finder_entries
from layoutopt.plots.floor_plan import (
    WIDTH_MM,
    closed_parts,
    draw_floor,
    draw_tags,
    frame_plan,
    frame_site,
    shows_tiles,
)
from layoutopt.plots.zone_names import name_zones
from layoutopt.robot import Robot
from layoutopt.site import Site
from layoutopt.units import format_length

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from shapely.geometry.base import BaseGeometry

_UNDERSIDE_MM: Final = 68.0
_PLACES_AT_ONCE: Final = 20_000
_SQUARE: Final = np.array([(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)])


def draw_layout_plan(
    *, layout: Layout, site: Site, robot: Robot, tag_map: TagMap, ax: "Axes | None" = None
) -> "Axes":
    """Draw a layout on its site, to scale, and return the axes of the plan.

    The plan shows floor, obstacles, zones, tiles, tags and one robot with its antennas and read discs; a second
    axes beside or below it enlarges the robot's underside over the tags. Tags that would be too small to be
    seen on the plan are drawn larger there, and the legend says so.

    Parameters
    ----------
    tag_map
        The tags, from ``layout.floor_tags.lay_on(site)``.
    ax
        Axes for the plan; the enlarged underside then goes to the right of it.
    """
    if ax is None:
        ax, underside = _two_axes(site)
    else:
        underside = ax.inset_axes((1.08, 0.0, 0.6, 1.0))
    centre_m = sample_place_m(layout=layout, site=site, robot=robot, tag_map=tag_map)
    draw_floor(ax, site)
    frame_site(ax, site)
    enlarged = draw_tags(ax, layout, tag_map)
    _draw_robot(ax, layout, robot, centre_m, detailed=False)
    draw_transponders(ax, layout)
    _legend(ax, layout, site, enlarged, 6 if _long(site) else 3)
    _draw_underside(underside, layout, robot, tag_map, centre_m)
    (left, right), (low, high) = underside.get_xlim(), underside.get_ylim()
    name_zones(ax, site, [*closed_parts(site), box(left, low, right, high)])
    zoom = ax.indicate_inset_zoom(underside, edgecolor=INK, linewidth=0.9, alpha=1.0, zorder=9)
    for line in zoom.connectors or ():
        line.set_visible(False)
    return ax


def sample_place_m(*, layout: Layout, site: Site, robot: Robot, tag_map: TagMap) -> tuple[float, float]:
    """Return where the robot is shown, looking along x: near the middle, with a tag in a read disc if it can be.

    Where it would read nothing at `robot_place_m`, it goes to the nearest place at which the centre of a tag
    lies below that of an antenna; if no such place can be reached, it stays.
    """
    centre_m = robot_place_m(site, robot)
    antennas_m = [group.poses[:, :2] for group in layout.floor_readers]
    region = _largest_room(site, robot)
    if region.is_empty or not antennas_m or not len(tag_map):
        return centre_m
    if in_read_disc(layout, tag_map.xy_m, centre_m).any():
        return centre_m
    places_m = (tag_map.xy_m[:, None, :] - np.concatenate(antennas_m)[None, :, :]).reshape(-1, 2)
    # Rounded, so that of equally near places the same one is taken on every computer.
    order = np.argsort(np.round(np.linalg.norm(places_m - centre_m, axis=1), 6), kind="stable")
    for first in range(0, len(order), _PLACES_AT_ONCE):
        some_m = places_m[order[first : first + _PLACES_AT_ONCE]]
        reached_m = some_m[covers(region, some_m)]
        if len(reached_m):
            return float(reached_m[0, 0]), float(reached_m[0, 1])
    return centre_m


def robot_place_m(site: Site, robot: Robot) -> tuple[float, float]:
    """Return the middle of the floor for a robot: the place nearest the middle of the floor where it can turn.

    It is in the largest room, where the drives are. If the robot can turn nowhere, a point of the open floor is
    used.
    """
    region = _largest_room(site, robot)
    if region.is_empty:
        inside = site.open_floor.representative_point()
        return float(inside.x), float(inside.y)
    xmin, ymin, xmax, ymax = site.bounds_m
    middle = Point((xmin + xmax) / 2.0, (ymin + ymax) / 2.0)
    if region.contains(middle):
        return float(middle.x), float(middle.y)
    inner = region.buffer(-0.05)
    near = region if inner.is_empty else inner
    nearest = near.boundary.interpolate(near.boundary.project(middle))
    return float(nearest.x), float(nearest.y)


def _largest_room(site: Site, robot: Robot) -> "BaseGeometry":
    """Return the largest connected part of the floor on which the robot can turn; empty if there is none."""
    region: BaseGeometry = site.robot_region(robot.radius_m)
    return max(shapely.get_parts(region), key=lambda part: float(part.area), default=region)


def _two_axes(site: Site) -> tuple["Axes", "Axes"]:
    """Return axes for the plan and for the underside: beside it, or below if the floor is long."""
    xmin, ymin, xmax, ymax = site.bounds_m
    ratio = (ymax - ymin) / (xmax - xmin)
    if _long(site):
        plan_mm = 0.92 * WIDTH_MM * ratio + 6.0
        figure = new_figure(WIDTH_MM, plan_mm + _UNDERSIDE_MM + 42.0)
        grid = figure.add_gridspec(2, 1, height_ratios=(plan_mm, _UNDERSIDE_MM))
    else:
        figure = new_figure(WIDTH_MM, min(240.0, max(22.0 + 0.52 * WIDTH_MM * ratio, 16.0 + _UNDERSIDE_MM)))
        grid = figure.add_gridspec(1, 2, width_ratios=(1.0, 0.66))
    return add_axes(figure, grid[0]), add_axes(figure, grid[1])


def _long(site: Site) -> bool:
    xmin, ymin, xmax, ymax = site.bounds_m
    return ymax - ymin < 0.45 * (xmax - xmin)


def _draw_robot(
    ax: "Axes", layout: Layout, robot: Robot, centre_m: tuple[float, float], *, detailed: bool
) -> None:
    """Draw the chassis with its antennas and read discs, the robot looking along x."""
    from matplotlib.collections import PatchCollection
    from matplotlib.patches import Circle
    from matplotlib.patches import Polygon as PolygonPatch

    centre = np.array(centre_m)
    ax.add_patch(
        PolygonPatch(
            robot.outline_m + centre,
            facecolor=SERIES[5],
            alpha=0.15 if detailed else 0.45,
            edgecolor="none",
            zorder=5,
        )
    )
    ax.add_patch(
        PolygonPatch(robot.outline_m + centre, facecolor="none", edgecolor=SERIES[0], linewidth=1.1, zorder=7)
    )
    squares, discs = [], []
    for group in layout.floor_readers:
        for x_m, y_m, z_m, yaw_rad in group.poses:
            place = centre + np.array([x_m, y_m])
            squares.append(PolygonPatch(turned(_SQUARE * group.antenna.side_m, float(yaw_rad)) + place))
            discs.append(Circle((place[0], place[1]), group.antenna.read_radius_m(float(z_m))))
    draw_on_top(ax, layout, robot, centre, detailed=detailed)
    ax.add_collection(
        PatchCollection(discs, facecolor=SERIES[1], edgecolor="none", alpha=0.4 if detailed else 0.9, zorder=6)
    )
    width = 0.9 if detailed else 0.3
    ax.add_collection(PatchCollection(squares, facecolor="none", edgecolor=INK, linewidth=width, zorder=7))
    if detailed:
        ahead_m = float(robot.outline_m[:, 0].max())
        ax.annotate(
            "",
            (centre[0] + 1.12 * ahead_m, centre[1]),
            xytext=(centre[0] + 0.86 * ahead_m, centre[1]),
            arrowprops={"arrowstyle": "-|>", "color": SERIES[0], "linewidth": 1.2},
            annotation_clip=False,
            zorder=8,
        )


def _draw_underside(
    ax: "Axes", layout: Layout, robot: Robot, tag_map: TagMap, centre_m: tuple[float, float]
) -> None:
    """Draw the robot's underside large over the tags there, those in a read disc filled."""
    from matplotlib.collections import PolyCollection

    shown_m = [robot.outline_m]
    for group in layout.floor_readers:
        shown_m += [
            group.poses[:, :2] - group.antenna.side_m / 2.0,
            group.poses[:, :2] + group.antenna.side_m / 2.0,
        ]
    low, high = np.concatenate(shown_m).min(axis=0), np.concatenate(shown_m).max(axis=0)
    half_m = 0.58 * float((high - low).max())
    middle = np.array(centre_m) + (low + high) / 2.0
    bounds_m = (middle[0] - half_m, middle[1] - half_m, middle[0] + half_m, middle[1] + half_m)
    near = np.abs(tag_map.xy_m - middle).max(axis=1, initial=0.0) <= half_m if len(tag_map) else np.zeros(0, bool)
    xy_m = tag_map.xy_m[near]
    read = in_read_disc(layout, xy_m, centre_m)
    size_m = np.array(layout.floor_tags.tag_size_m)
    for chosen, colour in ((~read, PAPER), (read, INK)):
        rectangles = (_SQUARE * size_m)[None, :, :] + xy_m[chosen][:, None, :]
        tags = PolyCollection(list(rectangles), facecolors=colour, edgecolors=INK, linewidths=0.5, zorder=5.5)
        tags.set_rasterized(rasterised(len(xy_m)))
        ax.add_collection(tags, autolim=False)
    _draw_robot(ax, layout, robot, centre_m, detailed=True)
    frame_plan(ax, (float(bounds_m[0]), float(bounds_m[1]), float(bounds_m[2]), float(bounds_m[3])))
    for spine in ax.spines.values():
        spine.set_visible(True)
    ax.set_title(
        f"robot underside from above (box in the plan);\ntags in a read disc are filled: {int(read.sum())} here",
        fontsize=SMALL_PT,
        color=INK,
        loc="left",
    )


def in_read_disc(layout: Layout, xy_m: FloatArray, centre_m: tuple[float, float]) -> np.ndarray:
    """Return for each tag centre, shape (n, 2), whether it lies in an open read disc of the robot."""
    read = np.zeros(len(xy_m), dtype=np.bool_)
    for group in layout.floor_readers:
        for x_m, y_m, z_m, _ in group.poses:
            radius_m = group.antenna.read_radius_m(float(z_m))
            read |= np.linalg.norm(xy_m - centre_m - (x_m, y_m), axis=1) < radius_m
    return read


def _legend(ax: "Axes", layout: Layout, site: Site, enlarged: bool, columns: int) -> None:
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    dot = Line2D([], [], linestyle="none", marker="o", markersize=2.5, color=INK)
    obstacle = Patch(facecolor=PAPER, edgecolor=INK, hatch="////")
    joint = Line2D([], [], color=FAINT, linewidth=0.5)
    chassis = Patch(facecolor=SERIES[5], edgecolor=SERIES[0], alpha=0.7)
    disc = Line2D([], [], linestyle="none", marker="o", markersize=5.0, color=SERIES[1], markeredgecolor="none")
    antenna = Line2D(
        [], [], linestyle="none", marker="s", markersize=6.0, markerfacecolor="none", markeredgecolor=INK
    )
    entries: list[tuple[Artist, str]] = [(dot, "tag (drawn larger than it is)" if enlarged else "tag")]
    entries += [(obstacle, "obstacle")] if closed_parts(site) else []
    if site.tiling is not None and shows_tiles(site):
        entries += [(joint, f"floor tile, {format_length(site.tiling.size_m)}")]
    entries += [(chassis, "robot"), (disc, "read disc"), (antenna, "antenna"), *finder_entries(layout)]
    legend_above(ax, entries, columns=columns)
