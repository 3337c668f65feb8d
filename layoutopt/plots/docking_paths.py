"""Ways of robots that dock: a room with what stands in it, the transponder, and the way of each robot."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from layoutopt.geometry import Bounds
from layoutopt.identity import FloatArray
from layoutopt.plots.figures import (
    DASHES,
    FAINT,
    INK,
    MARKERS,
    PAPER,
    SERIES,
    TEXT_PT,
    figure_of,
    legend_below,
    panel_axes,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_WIDTH_MM: Final = 170.0
_FRAME_MM: Final = 16.0
_SMALLEST_M: Final = 0.05
"""Radius at which a thing without a size is drawn, so that it is seen."""
_MARGIN_M: Final = 0.08
_WIDTHS_PT: Final = (2.6, 1.7, 0.9)


@dataclass(frozen=True, slots=True, kw_only=True)
class DockingPanel:
    """One room.

    Attributes
    ----------
    title
        Short, it stands above the room.
    bounds_m
        The walls, m.
    obstacles_m, radius_m
        Middles of what stands there, shape (k, 2), m, and its radius, zero for what only scatters.
    transponder_m, stop_m
        Where the robot goes, and how near it must come, m.
    paths_m
        Places of each robot by its name, shape (n, 2), m, the start first.
    """

    title: str
    bounds_m: Bounds
    obstacles_m: FloatArray
    radius_m: float
    transponder_m: tuple[float, float]
    stop_m: float
    paths_m: Mapping[str, FloatArray]


def draw_docking_paths(panels: Sequence[DockingPanel], *, axes: "Sequence[Axes] | None" = None) -> "Figure":
    """Draw rooms side by side, all to one scale along x and y; a name looks the same in all of them.

    Parameters
    ----------
    axes
        Axes to draw into, one for each room; by default those of a new figure.

    Raises
    ------
    ValueError
        If there is no room, or not one axes for each.
    """
    if not panels:
        raise ValueError("a figure needs at least one room")
    from matplotlib.patches import Circle, Rectangle

    names = list(dict.fromkeys(name for panel in panels for name in panel.paths_m))
    given = axes is not None
    axes = panel_axes(
        axes,
        len(panels),
        columns=len(panels),
        width_mm=_WIDTH_MM,
        height_mm=_FRAME_MM + _WIDTH_MM / len(panels),
    )
    for place, (ax, panel) in enumerate(zip(axes, panels, strict=True)):
        left, low, right, high = panel.bounds_m
        for spine in ax.spines.values():
            spine.set_visible(False)
        ax.add_patch(Rectangle((left, low), right - left, high - low, fill=False, edgecolor=INK, linewidth=1.2))
        for middle in panel.obstacles_m:
            ax.add_patch(
                Circle(
                    (float(middle[0]), float(middle[1])),
                    max(panel.radius_m, _SMALLEST_M),
                    facecolor=FAINT if panel.radius_m else PAPER,
                    edgecolor=INK,
                    linewidth=0.7,
                    zorder=2,
                )
            )
        ax.add_patch(
            Circle(panel.transponder_m, panel.stop_m, fill=False, edgecolor=FAINT, linestyle=(0, (2, 2)), zorder=1)
        )
        for name, path_m in panel.paths_m.items():
            number = names.index(name)
            ax.plot(
                path_m[:, 0],
                path_m[:, 1],
                color=SERIES[number % len(SERIES)],
                linestyle=DASHES[number % len(DASHES)],
                # Ways that are one show below each other.
                linewidth=_WIDTHS_PT[number % len(_WIDTHS_PT)],
                marker=MARKERS[number % len(MARKERS)],
                markersize=3.2,
                markeredgecolor=PAPER,
                markeredgewidth=0.3,
                label=name,
                zorder=4,
            )
            if np.hypot(*(path_m[-1] - np.array(panel.transponder_m))) > panel.stop_m:
                ax.plot(
                    *path_m[-1],
                    linestyle="",
                    marker="x",
                    markersize=8.0,
                    markeredgecolor=INK,
                    markeredgewidth=1.4,
                    label="failed here",
                    zorder=6,
                )
        start_m = next(iter(panel.paths_m.values()))[0]
        for spot, marker, face in ((start_m, "s", INK), (np.array(panel.transponder_m), "D", PAPER)):
            ax.plot(
                spot[0],
                spot[1],
                linestyle="",
                marker=marker,
                markersize=5.0,
                markerfacecolor=face,
                markeredgecolor=INK,
                label="start" if marker == "s" else "transponder",
                zorder=5,
            )
        ax.set_xlim(left - _MARGIN_M, right + _MARGIN_M)
        ax.set_ylim(low - _MARGIN_M, high + _MARGIN_M)
        ax.set_aspect("equal")
        ax.set_title(panel.title, loc="left", color=INK, fontsize=TEXT_PT)
        ax.set_xlabel("x (m)", fontsize=TEXT_PT)
        if given or place == 0:
            ax.set_ylabel("y (m)", fontsize=TEXT_PT)
    legend_below(axes)
    return figure_of(axes[0])
