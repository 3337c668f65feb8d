"""Floors on paper: outline, obstacles, zones, floor tiles and tags of a site, to scale, with a bar of length."""

import math
from typing import TYPE_CHECKING, Final

import numpy as np
import shapely
from shapely.geometry import MultiPolygon, Polygon
from shapely.geometry.base import BaseGeometry
from shapely.geometry.polygon import orient

from layoutopt.geometry import Bounds, turned
from layoutopt.identity import FloatArray
from layoutopt.layout import Layout, TagMap
from layoutopt.plots.figures import FAINT, INK, PAPER, SERIES, SMALL_PT, figure_of, new_axes, rasterised
from layoutopt.site import Site
from layoutopt.units import format_length

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.path import Path

WIDTH_MM: Final = 180.0
_TALLEST_MM: Final = 200.0
_FRAME_MM: Final = 30.0
"""Room above and below a plan, for legend and labels."""
_MARGIN: Final = 0.03
"""Room about the floor, as a share of its longer side."""
_SMALLEST_DOT_PT: Final = 0.7
_MOST_TILE_LINES: Final = 600
_BAR_BELOW_PT: Final = 23.0
"""The height of the label of an axis in metres."""
_BAR_SHARE: Final = 0.1
"""The bar of length is at least this share of the width shown."""
_MOST_STEPS: Final = 8
"""Steps of the axes, of one length, over the longer side."""


def plan_axes(site: Site, ax: "Axes | None", *, share: float = 0.9) -> "Axes":
    """Return the axes that were given, or those of a new figure; a plan takes that share of its width."""
    if ax is not None:
        return ax
    xmin, ymin, xmax, ymax = site.bounds_m
    height_mm = _FRAME_MM + share * WIDTH_MM * (ymax - ymin) / (xmax - xmin)
    return new_axes(WIDTH_MM, min(_TALLEST_MM, height_mm))


def draw_floor(ax: "Axes", site: Site) -> None:
    """Draw outline, obstacles, zones and floor tiles of a site."""
    from matplotlib.collections import LineCollection
    from matplotlib.patches import PathPatch

    outline = region_path(site.floor)
    ax.add_patch(PathPatch(outline, facecolor="none", edgecolor="none", zorder=0))
    tiles = _tile_lines(site)
    if shows_tiles(site):
        lines = LineCollection(
            list(tiles), colors=FAINT, linewidths=0.25, alpha=0.6, label="floor tiles", zorder=1
        )
        lines.set_clip_path(outline, ax.transData)
        # A path of its own replaces that of the axes, which may show a piece of the floor only.
        lines.set_clip_box(ax.bbox)
        ax.add_collection(lines, autolim=False)
    for obstacle in closed_parts(site):
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


def closed_parts(site: Site) -> list[BaseGeometry]:
    """Return what stands on the floor: its obstacles, and its holes, which maps have in their place."""
    parts = [part for part in shapely.get_parts(site.floor) if isinstance(part, Polygon)]
    holes = [Polygon(ring).difference(site.floor) for part in parts for ring in part.interiors]
    return [*site.obstacles, *(hole for hole in holes if not hole.is_empty)]


def shows_tiles(site: Site) -> bool:
    """Return whether the joints between floor tiles are drawn: those of a large floor would be a grey field."""
    return 0 < len(_tile_lines(site)) <= _MOST_TILE_LINES


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


def frame_site(ax: "Axes", site: Site) -> None:
    """Show a whole site to scale, in metres, with some room about it."""
    xmin, ymin, xmax, ymax = site.bounds_m
    margin_m = _MARGIN * max(xmax - xmin, ymax - ymin)
    frame_plan(ax, (xmin - margin_m, ymin - margin_m, xmax + margin_m, ymax + margin_m))


def frame_plan(ax: "Axes", bounds_m: Bounds) -> None:
    """Show these bounds to scale, in metres, with a bar of length below."""
    from matplotlib.ticker import MultipleLocator

    ax.set_aspect("equal")
    # A fixed step: where it follows the room, the room follows the width of the numbers, and neither settles.
    step_m = _round_up(max(bounds_m[2] - bounds_m[0], bounds_m[3] - bounds_m[1]) / _MOST_STEPS)
    for axis in (ax.xaxis, ax.yaxis):
        axis.set_major_locator(MultipleLocator(step_m))
    ax.set_xlim(bounds_m[0], bounds_m[2])
    ax.set_ylim(bounds_m[1], bounds_m[3])
    ax.set_xlabel("x (m)")
    ax.set_ylabel("y (m)")
    draw_scale_bar(ax, below_pt=_BAR_BELOW_PT)


def _round_up(length_m: float) -> float:
    """Return the next of 1, 2, 5, 10, 20 and so on, m, in any decade, that is not shorter."""
    decade_m = 10.0 ** math.floor(math.log10(length_m))
    return min(step * decade_m for step in (1.0, 2.0, 5.0, 10.0) if step * decade_m >= length_m * (1.0 - 1e-9))


def draw_scale_bar(ax: "Axes", *, below_pt: float) -> None:
    """Draw a bar of a round length at the right end of axes in metres, so far below them; limits come first."""
    from matplotlib.lines import Line2D
    from matplotlib.transforms import ScaledTranslation, blended_transform_factory

    low_m, high_m = ax.get_xlim()
    length_m = _round_up(_BAR_SHARE * (high_m - low_m))
    place = blended_transform_factory(ax.transData, ax.transAxes) + ScaledTranslation(
        0.0, -below_pt / 72.0, figure_of(ax).dpi_scale_trans
    )
    bar = Line2D([high_m - length_m, high_m], [0.0, 0.0], color=INK, linewidth=1.0, marker="|", markersize=4.0)
    bar.set(transform=place, clip_on=False)
    ax.add_artist(bar)
    ax.text(
        high_m - length_m,
        0.0,
        f"{format_length(length_m)} ",
        transform=place,
        ha="right",
        va="center",
        fontsize=SMALL_PT,
        color=INK,
        parse_math=False,
    )


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


def region_path(shape: BaseGeometry) -> "Path":
    """Return the outline of a shape with its holes."""
    from matplotlib.path import Path

    parts = shape.geoms if isinstance(shape, MultiPolygon) else [shape]
    # A hole stays bare only if its ring runs the other way round.
    polygons = [orient(part) for part in parts if isinstance(part, Polygon)]
    rings = [ring for part in polygons for ring in (part.exterior, *part.interiors)]
    return Path.make_compound_path(*(Path(np.asarray(ring.coords)[:, :2], closed=True) for ring in rings))
