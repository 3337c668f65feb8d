"""Maps of cells about an antenna, each with a scale of its own: chances, densities or strengths."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from layoutopt.geometry import Bounds
from layoutopt.identity import FloatArray
from layoutopt.plots.figures import INK, SERIES, TEXT_PT, figure_of, panel_axes
from layoutopt.plots.shades import scale_beside, shades

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_WIDTH_MM: Final = 170.0
_COLUMNS: Final = 2
_FRAME_MM: Final = 14.0
_BAR_MM: Final = 26.0


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


def draw_cell_maps(maps: Sequence[CellMap], *, bounds_m: Bounds, axes: "Sequence[Axes] | None" = None) -> "Figure":
    """Draw maps in rows of two with the antenna in the origin; what is shown lies within xmin, ymin, xmax, ymax.

    Parameters
    ----------
    axes
        Axes to draw into, one for each map; by default those of a new figure.

    Raises
    ------
    ValueError
        If there is no map, not one axes for each, or nothing is known within the bounds of one.
    """
    if not maps:
        raise ValueError("a figure needs at least one map")
    xmin, ymin, xmax, ymax = bounds_m
    rows = -(-len(maps) // _COLUMNS)
    height_mm = (_WIDTH_MM / _COLUMNS - _BAR_MM) * (ymax - ymin) / (xmax - xmin)
    given = axes is not None
    axes = panel_axes(
        axes, len(maps), columns=_COLUMNS, width_mm=_WIDTH_MM, height_mm=rows * (height_mm + _FRAME_MM)
    )
    for number, (ax, item) in enumerate(zip(axes, maps, strict=True)):
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
            cmap=shades(),
            interpolation="nearest",
        )
        ax.plot(0.0, 0.0, marker=">", markersize=6.0, markerfacecolor=SERIES[1], markeredgecolor=INK, linestyle="")
        ax.locator_params(steps=(1, 2, 5, 10))
        ax.set_xlim(xmin, xmax)
        ax.set_ylim(ymin, ymax)
        ax.set_title(item.title, loc="left", color=INK, fontsize=TEXT_PT)
        if given or number % _COLUMNS == 0:
            ax.set_ylabel("y, to the left (m)", fontsize=TEXT_PT)
        if given or number >= len(maps) - _COLUMNS:
            ax.set_xlabel("x, ahead of the antenna (m)", fontsize=TEXT_PT)
        scale_beside(ax, image, item.label)
    return figure_of(axes[0])
