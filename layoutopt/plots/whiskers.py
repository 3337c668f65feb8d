"""Values by category with whiskers that need not be even, some series side by side, in panels."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

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
_HEIGHT_MM: Final = 80.0
_SPREAD: Final = 0.5
"""Share of the room of a category over which its series stand."""
_MOST_IN_A_ROW: Final = 4
"""Names that fit side by side under the panels."""


@dataclass(frozen=True, slots=True, kw_only=True)
class WhiskerSeries:
    """One named series.

    Attributes
    ----------
    values, low, high
        Values and both ends of their whiskers by category, shape (n,), NaN where unknown.
    printed
        Whether it is what others printed, with which the rest is compared: in ink, with open marks.
    """

    name: str
    values: FloatArray
    low: FloatArray
    high: FloatArray
    printed: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class WhiskerPanel:
    """Axes with the series over some categories."""

    title: str
    categories: tuple[str, ...]
    series: tuple[WhiskerSeries, ...]


def draw_whiskers(
    panels: Sequence[WhiskerPanel],
    *,
    x_label: str,
    y_label: str,
    joined: bool,
    axes: "Sequence[Axes] | None" = None,
) -> "Figure":
    """Draw panels side by side on one scale from zero; a series of one name looks the same in all of them.

    A legend names the series, unless there is only one.

    Parameters
    ----------
    joined
        Whether a line leads from each value to the next, as where categories are numbers that rise.
    axes
        Axes to draw into, one for each panel; by default those of a new figure.

    Raises
    ------
    ValueError
        If there is no panel, not one axes for each, or a series has not one value for each category.
    """
    if not panels:
        raise ValueError("a figure needs at least one panel")
    every = [series for panel in panels for series in panel.series]
    names = list(dict.fromkeys(series.name for series in every))
    styles = {
        series.name: number
        for printed in (False, True)
        for number, series in enumerate({item.name: item for item in every if item.printed is printed}.values())
    }
    ends = np.concatenate([series.high for series in every])
    highest = float(ends[np.isfinite(ends)].max(initial=0.0)) or 1.0
    given = axes is not None
    axes = panel_axes(axes, len(panels), columns=len(panels), width_mm=_WIDTH_MM, height_mm=_HEIGHT_MM)
    for place, (ax, panel) in enumerate(zip(axes, panels, strict=True)):
        middle = np.arange(len(panel.categories), dtype=np.float64)
        for series in panel.series:
            if not len(series.values) == len(series.low) == len(series.high) == len(middle):
                raise ValueError(f"series '{series.name}' needs a value and two ends for each category")
            number = styles[series.name]
            colour = INK if series.printed else SERIES[number % len(SERIES)]
            ax.errorbar(
                middle + _SPREAD * ((names.index(series.name) + 0.5) / len(names) - 0.5),
                series.values,
                yerr=np.maximum(0.0, np.stack([series.values - series.low, series.high - series.values])),
                color=colour,
                linestyle=DASHES[number % len(DASHES)] if joined else "",
                linewidth=0.9,
                marker=MARKERS[number % len(MARKERS)],
                markersize=4.5,
                markerfacecolor=PAPER if series.printed else colour,
                markeredgecolor=colour if series.printed else PAPER,
                markeredgewidth=0.9 if series.printed else 0.5,
                elinewidth=0.8,
                capsize=1.5,
                label=series.name,
                zorder=3,
            )
        ax.set_xticks(middle, panel.categories)
        ax.set_xlim(-0.6, len(middle) - 0.4)
        ax.set_ylim(0.0, 1.05 * highest)
        ax.set_title(panel.title, loc="left", color=INK, fontsize=TEXT_PT)
        ax.set_xlabel(x_label, fontsize=TEXT_PT)
        if given or place == 0:
            ax.set_ylabel(y_label, fontsize=TEXT_PT)
        ax.grid(visible=True, axis="y", color=FAINT, alpha=0.35, linewidth=0.4)
    if len(names) > 1:
        legend_below(axes, names, columns=len(names) if len(names) <= _MOST_IN_A_ROW else 3)
    return figure_of(axes[0])
