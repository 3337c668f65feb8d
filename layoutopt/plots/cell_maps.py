"""Maps of cells about an antenna, each with a scale of its own: chances, densities or strengths."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from layoutopt.identity import FloatArray
from layoutopt.plots.figures import INK, PAPER, SERIES, SMALL_PT, TEXT_PT, add_axes, new_figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_WIDTH_MM: Final = 170.0
_COLUMNS: Final = 2
_FRAME_MM: Final = 14.0
_BAR_MM: Final = 26.0
_MIDDLE: Final = (0.45, "#5aa2cc")
"""Share of the scale, and its shade."""
_DARKEST: Final = "#00263d"


@dataclass(frozen=True, slots=True, kw_only=True)
class CellMap:
    """One map.

    Attributes
    ----------
    title, label
        What stands above the map, and beside its scale.
    values
        Shape (columns, rows), NaN where nothing is known; the greater, the darker.
    origin_m, cell_m
        Lower corner, x and y, of the cell (0, 0), and side of a cell.
    """

    title: str
    label: str
    values: FloatArray
    origin_m: tuple[float, float]
    cell_m: float


def draw_cell_maps(maps: Sequence[CellMap], *, bounds_m: tuple[float, float, float, float]) -> "Figure":
    """Draw maps in rows of two with the antenna in the origin; what is shown lies within xmin, ymin, xmax, ymax.

    Raises
    ------
    ValueError
        If there is no map, or nothing is known within the bounds of one.
    """
    if not maps:
        raise ValueError("a figure needs at least one map")
    from matplotlib.colors import LinearSegmentedColormap

    shades = LinearSegmentedColormap.from_list("cells", [(0.0, PAPER), _MIDDLE, (1.0, _DARKEST)])
    xmin, ymin, xmax, ymax = bounds_m
    rows = -(-len(maps) // _COLUMNS)
    height_mm = (_WIDTH_MM / _COLUMNS - _BAR_MM) * (ymax - ymin) / (xmax - xmin)
    figure = new_figure(_WIDTH_MM, rows * (height_mm + _FRAME_MM))
    for number, item in enumerate(maps):
        ax = add_axes(figure, rows, _COLUMNS, number + 1)
        columns, lines = item.values.shape
        left, low = item.origin_m
        middles_x = left + (np.arange(columns) + 0.5) * item.cell_m
        middles_y = low + (np.arange(lines) + 0.5) * item.cell_m
        shown = item.values[(middles_x > xmin) & (middles_x < xmax)][:, (middles_y > ymin) & (middles_y < ymax)]
        if not np.isfinite(shown).any():
            raise ValueError(f"map '{item.title}': nothing is known within the bounds {bounds_m}")
        image = ax.imshow(
            item.values.T,
            origin="lower",
            extent=(left, left + columns * item.cell_m, low, low + lines * item.cell_m),
            vmin=float(np.nanmin(shown)),
            vmax=float(np.nanmax(shown)),
            cmap=shades,
            interpolation="nearest",
        )
        ax.plot(0.0, 0.0, marker=">", markersize=6.0, markerfacecolor=SERIES[1], markeredgecolor=INK, linestyle="")
        ax.locator_params(steps=(1, 2, 5, 10))
        ax.set_xlim(xmin, xmax)
        ax.set_ylim(ymin, ymax)
        ax.set_title(item.title, loc="left", color=INK, fontsize=TEXT_PT)
        if number % _COLUMNS == 0:
            ax.set_ylabel("y, to the left (m)", fontsize=TEXT_PT)
        if number >= len(maps) - _COLUMNS:
            ax.set_xlabel("x, ahead of the antenna (m)", fontsize=TEXT_PT)
        # Beside the map and as high as it is, which a colour bar of the figure's own layout is not.
        bar = figure.colorbar(image, cax=ax.inset_axes((1.03, 0.0, 0.04, 1.0)))
        bar.ax.tick_params(labelsize=SMALL_PT)
        bar.set_label(item.label, fontsize=SMALL_PT, color=INK)
    return figure
