"""The floor with its tags, and one robot on it: whole, and its underside enlarged."""

from typing import TYPE_CHECKING, Final

import numpy as np
import shapely
from shapely.geometry import MultiPolygon, Point, Polygon
from shapely.geometry.base import BaseGeometry
from shapely.geometry.polygon import orient

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
    figure_of,
    new_figure,
    rasterised,
)
from layoutopt.plots.finder_marks import draw_on_top, draw_transponders, finder_entries
from layoutopt.robot import Robot
from layoutopt.site import Site, Zone
from layoutopt.units import format_length

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.path import Path

WIDTH_MM: Final = 180.0
_UNDERSIDE_MM: Final = 68.0
_SMALLEST_DOT_PT: Final = 0.7
_MOST_TILE_LINES: Final = 600
_PLACES_AT_ONCE: Final = 20_000
_LABEL_STEPS: Final = 15
_HIDDEN_SHARE: Final = 1.0 / 3.0
"""A name that would cover more of its zone, and the tags there, stands beside it."""
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
    xmin, ymin, xmax, ymax = site.bounds_m
    margin_m = 0.03 * max(xmax - xmin, ymax - ymin)
    frame_plan(ax, (xmin - margin_m, ymin - margin_m, xmax + margin_m, ymax + margin_m))
    enlarged = draw_tags(ax, layout, tag_map)
    _draw_robot(ax, layout, robot, centre_m, detailed=False)
    draw_transponders(ax, layout)
    _legend(ax, layout, site, enlarged, 6 if _long(site) else 3)
    _draw_underside(underside, layout, robot, tag_map, centre_m)
    # Last: what a name covers depends on the final size of the plan.
    _name_zones(ax, site)
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
    region: BaseGeometry = site.robot_region(robot.radius_m)
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

    If it can turn nowhere, a point of the open floor is used.
    """
    region: BaseGeometry = site.robot_region(robot.radius_m)
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


def draw_floor(ax: "Axes", site: Site) -> None:
    """Draw outline, obstacles, zones and floor tiles of a site."""
    from matplotlib.collections import LineCollection
    from matplotlib.patches import PathPatch

    outline = region_path(site.floor)
    ax.add_patch(PathPatch(outline, facecolor="none", edgecolor="none", zorder=0))
    tiles = _tile_lines(site)
    if 0 < len(tiles) <= _MOST_TILE_LINES:
        lines = LineCollection(
            list(tiles), colors=FAINT, linewidths=0.25, alpha=0.6, label="floor tiles", zorder=1
        )
        lines.set_clip_path(outline, ax.transData)
        ax.add_collection(lines, autolim=False)
    for obstacle in _closed_parts(site):
        ax.add_patch(
            PathPatch(region_path(obstacle), facecolor=PAPER, edgecolor=INK, hatch="////", linewidth=0.8, zorder=3)
        )
    for zone in site.zones:
        ax.add_patch(
            PathPatch(
                region_path(zone.region),
                facecolor="none",
                edgecolor=SERIES[2] if zone.taggable else SERIES[1],
                hatch="" if zone.taggable else "xx",
                linestyle=(0, (5, 2)),
                linewidth=1.0,
                zorder=3,
            )
        )
    ax.add_patch(PathPatch(outline, facecolor="none", edgecolor=INK, linewidth=1.4, zorder=4))


def _closed_parts(site: Site) -> list[BaseGeometry]:
    """Return what stands on the floor: its obstacles, and its holes, which maps have in their place."""
    parts = [part for part in shapely.get_parts(site.floor) if isinstance(part, Polygon)]
    holes = [Polygon(ring).difference(site.floor) for part in parts for ring in part.interiors]
    return [*site.obstacles, *(hole for hole in holes if not hole.is_empty)]


def _tile_lines(site: Site) -> FloatArray:
    """Return the joints between floor tiles over the floor's bounds, shape (n, 2, 2), m."""
    if site.tiling is None:
        return np.empty((0, 2, 2))
    tiling = site.tiling
    xmin, ymin, xmax, ymax = site.bounds_m
    corners = np.array([(xmin, ymin), (xmax, ymin), (xmax, ymax), (xmin, ymax)]) - tiling.origin_m
    local = turned(corners, -tiling.angle_rad)
    (left, bottom), (right, top) = local.min(axis=0), local.max(axis=0)
    first = np.floor(local.min(axis=0) / tiling.size_m) * tiling.size_m
    lines = [((x, bottom), (x, top)) for x in np.arange(first[0], right, tiling.size_m)]
    lines += [((left, y), (right, y)) for y in np.arange(first[1], top, tiling.size_m)]
    return np.asarray(turned(np.array(lines), tiling.angle_rad) + np.array(tiling.origin_m))


def frame_plan(ax: "Axes", bounds_m: tuple[float, float, float, float]) -> None:
    """Show these bounds to scale, in metres."""
    ax.set_aspect("equal")
    ax.set_xlim(bounds_m[0], bounds_m[2])
    ax.set_ylim(bounds_m[1], bounds_m[3])
    ax.set_xlabel("x (m)")
    ax.set_ylabel("y (m)")


def draw_tags(ax: "Axes", layout: Layout, tag_map: TagMap) -> bool:
    """Draw every tag as a dot of its longer side; return whether the dots had to be made larger."""
    from matplotlib.collections import EllipseCollection

    figure = figure_of(ax)
    figure.draw_without_rendering()
    pixels_per_m = float(ax.transData.transform((1.0, 0.0))[0] - ax.transData.transform((0.0, 0.0))[0])
    true_m = max(layout.floor_tags.tag_size_m)
    smallest_m = _SMALLEST_DOT_PT * figure.dpi / 72.0 / pixels_per_m
    # One size for all dots, so that an SVG holds one shape that is used many times.
    size_m = [max(true_m, smallest_m)]
    dots = EllipseCollection(
        size_m,
        size_m,
        [0.0],
        units="xy",
        offsets=tag_map.xy_m,
        offset_transform=ax.transData,
        facecolors=INK,
        edgecolors="none",
        zorder=2,
    )
    dots.set_rasterized(rasterised(len(tag_map)))
    ax.add_collection(dots, autolim=False)
    return smallest_m > true_m


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
    ax.locator_params(nbins=5)
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


def _name_zones(ax: "Axes", site: Site) -> None:
    """Write the names of zones in, at or beside them, where they cover least of obstacles and of each other."""
    if not site.zones:
        return
    figure_of(ax).draw_without_rendering()
    taken: BaseGeometry = shapely.union_all(_closed_parts(site))
    for zone in site.zones:
        middle = zone.region.representative_point()
        name = ax.text(
            middle.x,
            middle.y,
            _zone_text(zone),
            ha="center",
            va="center",
            fontsize=SMALL_PT,
            color=INK,
            parse_math=False,
            bbox={"boxstyle": "square,pad=0.2", "facecolor": PAPER, "edgecolor": "none", "alpha": 0.7},
            zorder=8,
        )
        # The axes must keep their size, or every name would be where it was not measured.
        name.set_in_layout(False)
        extent = name.get_window_extent()
        low, high = ax.transData.inverted().transform([(extent.x0, extent.y0), (extent.x1, extent.y1)])
        half_m = (high - low) / 2.0
        places_m = _label_places(zone, half_m, site.bounds_m)
        boxes = shapely.box(*(places_m - half_m).T, *(places_m + half_m).T)
        covered_m2 = np.round(shapely.area(shapely.intersection(boxes, taken)), 6)
        away_m = np.round(np.linalg.norm(places_m - (middle.x, middle.y), axis=1), 6)
        best = int(np.lexsort((away_m, covered_m2))[0])
        name.set_position((float(places_m[best, 0]), float(places_m[best, 1])))
        if not boxes[best].intersects(zone.region):
            ends = shapely.shortest_line(Point(places_m[best]), zone.region).coords
            ax.plot(*np.asarray(ends).T, color=INK, linewidth=0.6, scalex=False, scaley=False, zorder=7.5)
        taken = taken.union(boxes[best])


def _label_places(zone: Zone, half_m: FloatArray, bounds_m: tuple[float, float, float, float]) -> FloatArray:
    """Return where the middle of a zone's name may be, shape (n, 2): well inside first, then in or at it.

    ``half_m`` is half of its width and height; the name stays within the bounds of the floor if it has room. A
    name that would hide much of its zone may only be beside it, if there is room.
    """
    if 4.0 * half_m.prod() > _HIDDEN_SHARE * zone.region.area:
        beside_m = _beside(zone, half_m, bounds_m)
        if len(beside_m):
            return beside_m
    middle = zone.region.representative_point()
    # A quarter of the name still lies in the zone, so that nobody takes it for another's.
    edges_m = np.array(zone.region.bounds)
    low, high = edges_m[:2] - 0.5 * half_m, edges_m[2:] + 0.5 * half_m
    inner_low, inner_high = np.array(bounds_m[:2]) + half_m, np.array(bounds_m[2:]) - half_m
    low = np.where(inner_low <= inner_high, np.clip(low, inner_low, inner_high), low)
    high = np.where(inner_low <= inner_high, np.clip(high, inner_low, inner_high), high)
    x_m, y_m = (np.linspace(low[axis], high[axis], _LABEL_STEPS) for axis in (0, 1))
    grid_m = np.stack(np.meshgrid(x_m, y_m), axis=-1).reshape(-1, 2)
    return np.concatenate([[(middle.x, middle.y)], grid_m])


def _beside(zone: Zone, half_m: FloatArray, bounds_m: tuple[float, float, float, float]) -> FloatArray:
    """Return places round a zone, shape (n, 2), at which the name touches neither it nor the end of the floor."""
    edges_m, floor_m = np.array(zone.region.bounds), np.array(bounds_m)
    # A quarter of the name's height is left free, for the line to the zone to be seen.
    reach_m = half_m + 0.5 * half_m[1]
    axes_m = [
        np.linspace(edges_m[axis] - reach_m[axis], edges_m[axis + 2] + reach_m[axis], _LABEL_STEPS)
        for axis in (0, 1)
    ]
    places_m = np.stack(np.meshgrid(*axes_m), axis=-1).reshape(-1, 2)
    boxes = shapely.box(*(places_m - half_m).T, *(places_m + half_m).T)
    free = ~shapely.intersects(boxes, zone.region) & shapely.covered_by(boxes, shapely.box(*floor_m))
    return np.asarray(places_m[free], dtype=np.float64)


def _zone_text(zone: Zone) -> str:
    lines = [zone.name]
    if zone.target_error_m is not None:
        lines.append(f"target {zone.target_error_m * 1000.0:g} mm")
    if not zone.taggable:
        lines.append(("metal, " if zone.metal else "") + ("on-metal tags only" if zone.tags else "no tags"))
    if not zone.drill:
        lines.append("no drilling")
    return "\n".join(lines)


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
    entries += [(obstacle, "obstacle")] if _closed_parts(site) else []
    if site.tiling is not None and 0 < len(_tile_lines(site)) <= _MOST_TILE_LINES:
        entries += [(joint, f"floor tile, {format_length(site.tiling.size_m)}")]
    entries += [(chassis, "robot"), (disc, "read disc"), (antenna, "antenna"), *finder_entries(layout)]
    ax.legend(
        [handle for handle, _ in entries],
        [name for _, name in entries],
        loc="lower left",
        bbox_to_anchor=(0.0, 1.0),
        ncols=columns,
        frameon=False,
        fontsize=SMALL_PT,
        labelcolor=INK,
        columnspacing=1.2,
        handletextpad=0.5,
        borderaxespad=0.2,
    )


def region_path(shape: BaseGeometry) -> "Path":
    """Return the outline of a shape with its holes."""
    from matplotlib.path import Path

    parts = shape.geoms if isinstance(shape, MultiPolygon) else [shape]
    # A hole stays bare only if its ring runs the other way round.
    polygons = [orient(part) for part in parts if isinstance(part, Polygon)]
    rings = [ring for part in polygons for ring in (part.exterior, *part.interiors)]
    return Path.make_compound_path(*(Path(np.asarray(ring.coords)[:, :2], closed=True) for ring in rings))
