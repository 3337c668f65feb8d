"""Paths on the floor: where the robot went, and where estimators believed it, over the tags."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Final

import numpy as np

from layoutopt.identity import FloatArray
from layoutopt.plots.figures import DASHES, FAINT, INK, SERIES, TEXT_PT, figure_of, legend_below, panel_axes

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_WIDTH_MM: Final = 170.0
_MOST_COLUMNS: Final = 3
_MARGIN_M: Final = 0.06
_TITLE_MM: Final = 3.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Paths:
    """One panel.

    Attributes
    ----------
    true_m
        True path, shape (n, 2), m.
    estimated_m
        Paths by estimator, shape (n, 2) each, m.
    tags_m
        Tags below, shape (k, 2), m.
    window_m
        What is shown: xmin, ymin, xmax, ymax; by default the whole true path.
    """

    title: str
    true_m: FloatArray
    estimated_m: Mapping[str, FloatArray]
    tags_m: FloatArray = field(default_factory=lambda: np.empty((0, 2)))
    window_m: tuple[float, float, float, float] | None = None


def draw_trajectories(panels: Sequence[Paths], *, axes: "Sequence[Axes] | None" = None) -> "Figure":
    """Draw panels in rows of at most three, all to one scale along x and y.

    Parameters
    ----------
    axes
        Axes to draw into, one for each panel; by default those of a new figure.

    Raises
    ------
    ValueError
        If there is no panel, or not one axes for each.
    """
    if not panels:
        raise ValueError("a figure needs at least one panel")
    columns = min(_MOST_COLUMNS, len(panels))
    rows = -(-len(panels) // columns)
    side_mm = _WIDTH_MM / columns
    axes = panel_axes(
        axes, len(panels), columns=columns, width_mm=_WIDTH_MM, height_mm=rows * (side_mm + _TITLE_MM)
    )
    names = list(dict.fromkeys(name for panel in panels for name in panel.estimated_m))
    for ax, panel in zip(axes, panels, strict=True):
        low_m, high_m = panel.true_m.min(axis=0) - _MARGIN_M, panel.true_m.max(axis=0) + _MARGIN_M
        if panel.window_m is not None:
            low_m, high_m = np.array(panel.window_m[:2]), np.array(panel.window_m[2:])
        if len(panel.tags_m):
            ax.scatter(
                panel.tags_m[:, 0], panel.tags_m[:, 1], s=4.0, color=FAINT, linewidths=0.0, zorder=1, label="tags"
            )
        ax.plot(panel.true_m[:, 0], panel.true_m[:, 1], color=INK, linewidth=0.8, zorder=2, label="true path")
        for name, path_m in panel.estimated_m.items():
            order = names.index(name)
            ax.plot(
                path_m[:, 0],
                path_m[:, 1],
                color=SERIES[order % len(SERIES)],
                linestyle=DASHES[order % len(DASHES)],
                linewidth=0.9,
                zorder=3,
                label=name,
            )
        ax.set_xlim(float(low_m[0]), float(high_m[0]))
        ax.set_ylim(float(low_m[1]), float(high_m[1]))
        ax.set_aspect("equal")
        ax.set_xlabel("x (m)", fontsize=TEXT_PT)
        ax.set_ylabel("y (m)", fontsize=TEXT_PT)
        ax.set_title(panel.title, loc="left", color=INK, fontsize=TEXT_PT)
    legend_below(axes)
    return figure_of(axes[0])
