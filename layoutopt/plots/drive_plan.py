"""One drive on its floor: the estimated path, the true one where it is known, and the tags that were read."""

from typing import TYPE_CHECKING

import numpy as np

from layoutopt.identity import BoolArray, FloatArray, IntArray
from layoutopt.layout import Layout, TagMap
from layoutopt.plots.figures import INK, SERIES, legend_above, rasterised
from layoutopt.plots.floor_plan import draw_floor, draw_tags, frame_site, plan_axes
from layoutopt.site import Site

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def draw_drive_plan(
    *,
    layout: Layout,
    site: Site,
    tag_map: TagMap,
    path_m: FloatArray,
    true_m: FloatArray,
    read_tags: IntArray,
    lost: BoolArray,
    ax: "Axes | None" = None,
) -> "Axes":
    """Draw a drive to scale and return the axes.

    Parameters
    ----------
    path_m, true_m
        Estimated and true places after each step, shape (n, 2), m; gaps where they are not known (NaN).
    read_tags
        Indices in the tag map of the tags that were read, in any order and number.
    lost
        Steps in which the estimator says that it is lost, shape (n,).

    Raises
    ------
    ValueError
        If the columns differ in length.
    """
    if not len(path_m) == len(true_m) == len(lost):
        raise ValueError(f"columns of {len(path_m)}, {len(true_m)} and {len(lost)} steps")
    ax = plan_axes(site, ax)
    draw_floor(ax, site)
    frame_site(ax, site)
    draw_tags(ax, layout, tag_map)
    read_m = tag_map.xy_m[np.unique(read_tags)]
    dense = rasterised(max(len(path_m), len(read_m)))
    drawn = ax.plot(
        *read_m.T,
        linestyle="none",
        marker="o",
        markersize=2.6,
        markerfacecolor="none",
        markeredgecolor=SERIES[2],
        markeredgewidth=0.7,
        label=f"tag that was read ({len(read_m)} of {len(tag_map)})",
        rasterized=dense,
        zorder=5,
    )
    if np.isfinite(true_m).any():
        drawn += ax.plot(
            *true_m.T, color=INK, linewidth=2.2, alpha=0.35, label="true path", rasterized=dense, zorder=6
        )
    drawn += ax.plot(*path_m.T, color=SERIES[0], linewidth=0.9, label="estimated path", rasterized=dense, zorder=7)
    if len(path_m):
        drawn += ax.plot(
            *path_m[0], linestyle="none", marker="s", markersize=5.0, color=SERIES[0], label="first step", zorder=8
        )
    if lost.any():
        drawn += ax.plot(
            *path_m[lost].T,
            linestyle="none",
            marker="x",
            markersize=4.0,
            color=SERIES[1],
            label=f"lost ({int(lost.sum())} steps)",
            rasterized=dense,
            zorder=8,
        )
    legend_above(ax, [(line, str(line.get_label())) for line in drawn], columns=3)
    return ax
