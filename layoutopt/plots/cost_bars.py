"""Costs of layouts side by side, each a bar of the parts that it is spent on."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Final

from layoutopt.plots.figures import HATCHES, INK, PAPER, SERIES, SMALL_PT, TEXT_PT, new_axes
from layoutopt.score_text import euros

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_WIDTH_MM: Final = 170.0
_BAR_MM: Final = 12.0
_FRAME_MM: Final = 26.0
_ROOM: Final = 1.16
"""Of the longest bar, for its sum to stand behind it."""


def draw_cost_bars(costs_eur: Mapping[str, Mapping[str, float]], *, ax: "Axes | None" = None) -> "Axes":
    """Draw a bar for each layout from top to bottom, its parts in the order of their first mention.

    Parameters
    ----------
    costs_eur
        By label of the layout, the cost of each part by its name, EUR, none negative.
    ax
        Axes to draw into; by default those of a new figure.

    Raises
    ------
    ValueError
        If there is no bar.
    """
    if not costs_eur:
        raise ValueError("a figure of costs needs at least one layout")
    parts = list(dict.fromkeys(part for costs in costs_eur.values() for part in costs))
    rows = range(len(costs_eur))
    ax = new_axes(_WIDTH_MM, _FRAME_MM + _BAR_MM * len(costs_eur)) if ax is None else ax
    ends = [0.0] * len(costs_eur)
    for number, part in enumerate(parts):
        widths = [costs.get(part, 0.0) for costs in costs_eur.values()]
        ax.barh(
            rows,
            widths,
            left=ends,
            height=0.62,
            color=SERIES[number % len(SERIES)],
            hatch=HATCHES[number % len(HATCHES)],
            edgecolor=PAPER,
            linewidth=0.8,
            label=part,
        )
        ends = [end + width for end, width in zip(ends, widths, strict=True)]
    for row, end in zip(rows, ends, strict=True):
        ax.annotate(
            euros(end),
            (end, row),
            xytext=(4, 0),
            textcoords="offset points",
            va="center",
            fontsize=TEXT_PT,
            color=INK,
        )
    ax.set_yticks(rows, list(costs_eur), fontsize=TEXT_PT)
    ax.set_ylim(len(costs_eur) - 0.5, -0.5)
    ax.set_xlim(0.0, _ROOM * max(ends))
    ax.set_xlabel("cost (EUR)", fontsize=TEXT_PT)
    ax.legend(
        loc="lower left",
        bbox_to_anchor=(0.0, 1.0),
        ncols=len(parts),
        frameon=False,
        fontsize=SMALL_PT,
        labelcolor=INK,
    )
    return ax
