"""Where UHF antennas of a standing robot hear a tag: lines of equal chance over the site, with robot and walk."""

import math
from typing import TYPE_CHECKING, Final

import numpy as np

from layoutopt.geometry import turned
from layoutopt.identity import FloatArray
from layoutopt.layout import ReaderGroup
from layoutopt.plots.figures import INK, PAPER, SERIES, SMALL_PT, legend_above
from layoutopt.plots.floor_plan import draw_floor, frame_site, plan_axes, region_path
from layoutopt.robot import Robot
from layoutopt.site import Site
from layoutopt.tracking_world import TrackingWorld

if TYPE_CHECKING:
    from matplotlib.axes import Axes

LEVELS: Final = (0.1, 0.5, 0.9, 0.99)
"""Chances at which a line is drawn."""
_LINES: Final = ((0, (1, 1.5)), (0, (4, 1.5)), (0, (7, 2, 1.5, 2)), "-")
_TONES: Final = (0.06, 0.13, 0.22, 0.32)
_AXIS_M: Final = 1.2
"""Length of the line that shows where an antenna looks."""


def draw_detection_reach(
    *,
    site: Site,
    robot: Robot,
    world: TrackingWorld,
    antennas: ReaderGroup,
    x_m: FloatArray,
    y_m: FloatArray,
    chance: FloatArray,
    ax: "Axes | None" = None,
) -> "Axes":
    """Draw the chance that some antenna hears a tag, to scale, and return the axes.

    Parameters
    ----------
    x_m, y_m
        Lattice in the floor frame, shape (columns,) and (rows,), m.
    chance
        At each point of the lattice, shape (rows, columns); NaN where none is to be shown.

    Raises
    ------
    ValueError
        If the chances do not fit the lattice.
    """
    from matplotlib.lines import Line2D
    from matplotlib.patches import PathPatch, Polygon

    if chance.shape != (len(y_m), len(x_m)):
        raise ValueError(f"a lattice of {len(y_m)} by {len(x_m)} points, but chances of shape {chance.shape}")
    ax = plan_axes(site, ax)
    draw_floor(ax, site)
    clip = PathPatch(region_path(site.open_floor), transform=ax.transData, facecolor="none", edgecolor="none")
    ax.add_patch(clip)
    colour = SERIES[0]
    for level, tone in zip(LEVELS, _TONES, strict=True):
        filled = ax.contourf(x_m, y_m, chance, levels=[level, 2.0], colors=[colour], alpha=tone, zorder=1)
        filled.set_clip_path(clip)
    lines = ax.contour(
        x_m, y_m, chance, levels=list(LEVELS), colors=[colour], linestyles=list(_LINES), linewidths=1.1, zorder=5
    )
    lines.set_clip_path(clip)
    for label in ax.clabel(lines, fmt=lambda level: f"{100.0 * level:g} %", fontsize=SMALL_PT, colors=INK):
        label.set_bbox({"facecolor": PAPER, "edgecolor": "none", "alpha": 0.8, "pad": 0.5})
    walk_m = np.concatenate([world.walk_m, world.walk_m[:1]])
    ax.plot(*walk_m.T, color=INK, linewidth=1.6, linestyle=(0, (3, 1.2)), zorder=6)
    x_robot_m, y_robot_m, heading_rad = world.robot_pose
    place_m = np.array([x_robot_m, y_robot_m])
    outline_m = turned(robot.outline_m, heading_rad) + place_m
    ax.add_patch(Polygon(outline_m, facecolor=PAPER, edgecolor=INK, linewidth=1.1, zorder=7))
    for x, y, _, yaw_rad in antennas.poses:
        start_m = turned(np.array([[x, y]]), heading_rad)[0] + place_m
        aim_rad = heading_rad + float(yaw_rad)
        ax.annotate(
            "",
            (start_m[0] + _AXIS_M * math.cos(aim_rad), start_m[1] + _AXIS_M * math.sin(aim_rad)),
            xytext=(float(start_m[0]), float(start_m[1])),
            arrowprops={"arrowstyle": "-|>", "color": SERIES[1], "linewidth": 1.4, "shrinkA": 0.0},
            zorder=8,
        )
    frame_site(ax, site)
    entries = [
        (Line2D([], [], color=colour, linewidth=1.1), "chance that a reading hears the tag"),
        (Line2D([], [], color=INK, linewidth=1.6, linestyle=(0, (3, 1.2))), "walk"),
        (Line2D([], [], color=SERIES[1], marker=">", markersize=4.0, linewidth=1.4), "an antenna looks"),
    ]
    legend_above(ax, entries, columns=3)
    return ax
