"""Reader groups under one robot, side by side at one scale: chassis, antennas, read discs."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from layoutopt.geometry import turned
from layoutopt.layout import ReaderGroup
from layoutopt.plots.figures import INK, SERIES, SMALL_PT, TEXT_PT, figure_of, panel_axes
from layoutopt.robot import Robot

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_WIDTH_MM: Final = 170.0
_COLUMNS: Final = 3
_MARGIN: Final = 0.2
"""Room about the chassis for the arrow ahead, as a share of its larger side."""
_FRAME_MM: Final = 12.0
_SQUARE: Final = np.array([(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)])


@dataclass(frozen=True, slots=True, kw_only=True)
class UndersidePicture:
    """A reader group with a name."""

    label: str
    group: ReaderGroup


def draw_undersides(
    robot: Robot, pictures: Sequence[UndersidePicture], *, axes: "Sequence[Axes] | None" = None
) -> "Figure":
    """Draw groups under a robot as seen from above, x to the right, each antenna with its scan slot's number.

    Parameters
    ----------
    axes
        Axes to draw into, one for each group; by default those of a new figure.

    Raises
    ------
    ValueError
        If there is no group, or not one axes for each.
    """
    if not pictures:
        raise ValueError("a figure needs at least one reader group")
    columns = min(_COLUMNS, len(pictures))
    rows = math.ceil(len(pictures) / columns)
    low, high = robot.outline_m.min(axis=0), robot.outline_m.max(axis=0)
    margin_m = _MARGIN * float((high - low).max())
    bounds_m = np.concatenate([low - margin_m / 2.0, high + np.array([margin_m, margin_m / 2.0])])
    ratio = float((bounds_m[3] - bounds_m[1]) / (bounds_m[2] - bounds_m[0]))
    panel_mm = _WIDTH_MM / max(columns, 2)  # a single panel is no larger than one of two
    given = axes is not None
    axes = panel_axes(
        axes,
        len(pictures),
        columns=columns,
        width_mm=panel_mm * columns,
        height_mm=rows * (panel_mm * ratio + _FRAME_MM),
    )
    for number, (ax, item) in enumerate(zip(axes, pictures, strict=True)):
        _draw(ax, robot, item)
        if given or number % columns == 0:
            ax.set_ylabel("y (m)", fontsize=SMALL_PT)
        ax.set_xlim(float(bounds_m[0]), float(bounds_m[2]))
        ax.set_ylim(float(bounds_m[1]), float(bounds_m[3]))
    return figure_of(axes[0])


def _draw(ax: "Axes", robot: Robot, item: UndersidePicture) -> None:
    from matplotlib.collections import PatchCollection
    from matplotlib.patches import Circle, Polygon

    ax.add_patch(Polygon(robot.outline_m, facecolor=SERIES[5], alpha=0.15, edgecolor="none", zorder=1))
    ax.add_patch(Polygon(robot.outline_m, facecolor="none", edgecolor=SERIES[0], linewidth=1.1, zorder=3))
    squares, discs = [], []
    for (x_m, y_m, z_m, yaw_rad), slot in zip(item.group.poses, item.group.slots, strict=True):
        squares.append(Polygon(turned(_SQUARE * item.group.antenna.side_m, float(yaw_rad)) + np.array([x_m, y_m])))
        discs.append(Circle((x_m, y_m), item.group.antenna.read_radius_m(float(z_m))))
        if item.group.antennas_per_module > 1:
            ax.annotate(
                f"{slot + 1}", (x_m, y_m), ha="center", va="center", fontsize=SMALL_PT, color=INK, zorder=5
            )
    ax.add_collection(PatchCollection(discs, facecolor=SERIES[1], edgecolor="none", alpha=0.4, zorder=2))
    ax.add_collection(PatchCollection(squares, facecolor="none", edgecolor=INK, linewidth=0.9, zorder=4))
    ax.plot([0.0], [0.0], marker="+", color=SERIES[0], markersize=6.0, zorder=4)
    ahead_m = float(robot.outline_m[:, 0].max())
    ax.annotate(
        "",
        (1.25 * ahead_m, 0.0),
        xytext=(1.02 * ahead_m, 0.0),
        arrowprops={"arrowstyle": "-|>", "color": SERIES[0], "linewidth": 1.2},
        zorder=5,
    )
    ax.set_aspect("equal")
    ax.set_xlabel("x (m)", fontsize=SMALL_PT)
    ax.locator_params(nbins=5)
    ax.set_title(item.label, loc="left", color=INK, fontsize=TEXT_PT)
