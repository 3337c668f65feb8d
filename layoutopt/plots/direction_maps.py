"""Maps of how far scattered waves turn a direction of arrival, the darker the farther."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TYPE_CHECKING, Final

import numpy as np

from layoutopt.geometry import Bounds
from layoutopt.identity import FloatArray, read_only
from layoutopt.plots.figures import INK, PAPER, SERIES, SMALL_PT, TEXT_PT, figure_of, legend_below, panel_axes
from layoutopt.plots.shades import shades

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_WIDTH_MM: Final = 170.0
_FRAME_MM: Final = 20.0
_BAR_MM: Final = 24.0
_LABELS_MM: Final = 9.0
"""Room of the numbers beside a map, and of title and numbers above and below it."""
_LINES: Final = ("i", "ii", "iii", "iv", "v")


@dataclass(frozen=True, slots=True, kw_only=True)
class DirectionMap:
    """One map.

    Attributes
    ----------
    title
        Short, it stands above the map.
    error_deg
        Size of the error in each cell, shape (rows, columns), rows from low y to high y.
    bounds_m
        Border of the map, m.
    transponder_m, scatterers_m
        Where the transponder and what scatters are, shapes (2,) and (k, 2), m.
    lines_m
        Straight lines to be drawn and numbered, shape (l, 2, 2), m: both ends of each.
    """

    title: str
    error_deg: FloatArray
    bounds_m: Bounds
    transponder_m: tuple[float, float]
    scatterers_m: FloatArray
    lines_m: FloatArray = field(default_factory=lambda: read_only([], (-1, 2, 2)))


def draw_direction_maps(
    maps: Sequence[DirectionMap], *, columns: int, limit_deg: float, axes: "Sequence[Axes] | None" = None
) -> "Figure":
    """Draw maps in rows of so many columns, all on one scale; cells at the limit or beyond are black.

    Parameters
    ----------
    axes
        Axes to draw into, one for each map; by default those of a new figure.

    Raises
    ------
    ValueError
        If there is no map, or not one axes for each.
    """
    if not maps:
        raise ValueError("a figure needs at least one map")
    rows = -(-len(maps) // columns)
    side_mm = (_WIDTH_MM - _BAR_MM) / columns - _LABELS_MM
    given = axes is not None
    axes = panel_axes(
        axes,
        len(maps),
        columns=columns,
        width_mm=_WIDTH_MM,
        height_mm=_FRAME_MM + rows * (side_mm + _LABELS_MM),
    )
    for number, (ax, item) in enumerate(zip(axes, maps, strict=True)):
        left, low, right, high = item.bounds_m
        image = ax.imshow(
            # The limit itself lies on the scale; what reaches it is to lie beyond.
            np.where(item.error_deg >= limit_deg, 2.0 * limit_deg, item.error_deg),
            origin="lower",
            extent=(left, right, low, high),
            vmin=0.0,
            vmax=limit_deg,
            cmap=shades(beyond=True),
            interpolation="nearest",
        )
        for name, ends in zip(_LINES, item.lines_m, strict=False):
            ax.plot(ends[:, 0], ends[:, 1], color=INK, linestyle=(0, (3, 2)), linewidth=0.8)
            ax.annotate(
                name,
                ends[1],
                xytext=(-6.0 if ends[1, 0] > ends[0, 0] else 6.0, 4.0),
                textcoords="offset points",
                ha="center",
                fontsize=SMALL_PT,
                color=INK,
                bbox={"facecolor": PAPER, "edgecolor": "none", "alpha": 0.8, "pad": 0.6},
            )
        ax.plot(
            item.scatterers_m[:, 0],
            item.scatterers_m[:, 1],
            linestyle="",
            marker="o",
            markersize=3.4,
            markerfacecolor=PAPER,
            markeredgecolor=INK,
            markeredgewidth=0.8,
            label="scatterer",
        )
        ax.plot(
            *item.transponder_m,
            linestyle="",
            marker="s",
            markersize=4.6,
            markerfacecolor=SERIES[1],
            markeredgecolor=INK,
            markeredgewidth=0.8,
            label="transponder",
        )
        ax.set_xlim(left, right)
        ax.set_ylim(low, high)
        ax.set_title(item.title, loc="left", color=INK, fontsize=TEXT_PT)
        if given or number % columns == 0:
            ax.set_ylabel("y (m)", fontsize=TEXT_PT)
        if given or number >= len(maps) - columns:
            ax.set_xlabel("x (m)", fontsize=TEXT_PT)
    bar = figure_of(axes[0]).colorbar(image, ax=axes, extend="max", shrink=0.8, pad=0.02)
    bar.ax.tick_params(labelsize=SMALL_PT)
    bar.set_label("error of the direction (°); black: leads no nearer", fontsize=TEXT_PT, color=INK)
    legend_below(axes)
    return figure_of(axes[0])
