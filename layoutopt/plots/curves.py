"""Curves over one quantity, with their intervals, in panels side by side."""

from collections.abc import Sequence
from dataclasses import dataclass, field
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
    SMALL_PT,
    TEXT_PT,
    add_axes,
    figure_of,
    legend_below,
    new_figure,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_WIDTH_MM: Final = 170.0
_HEIGHT_MM: Final = 75.0
_MARK_HEIGHT: Final = 0.48
_MOST_MARKED: Final = 30
"""Curves with more points than this are lines without marks."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Curve:
    """One named curve, shape (n,) each, broken where y is NaN; ``half_width`` of its interval, or nothing."""

    name: str
    x: FloatArray
    y: FloatArray
    half_width: FloatArray = field(default_factory=lambda: np.empty(0))


@dataclass(frozen=True, slots=True, kw_only=True)
class Panel:
    """Axes with curves; ``marks`` are values of x with a word, drawn as thin lines.

    ``log`` is for values of y that fall by powers of ten; what is not positive then has no place.
    """

    title: str
    x_label: str
    y_label: str
    curves: tuple[Curve, ...]
    marks: tuple[tuple[float, str], ...] = ()
    log: bool = False


def draw_curves(panels: Sequence[Panel]) -> "Figure":
    """Draw panels side by side; a curve of one name looks the same in all of them, and one label has one scale.

    Raises
    ------
    ValueError
        If there is no panel, or a curve's arrays differ in length.
    """
    if not panels:
        raise ValueError("a figure needs at least one panel")
    names = list(dict.fromkeys(curve.name for panel in panels for curve in panel.curves))
    figure = new_figure(_WIDTH_MM, _HEIGHT_MM)
    alike = len({panel.y_label for panel in panels}) == 1
    top = max(float(np.nanmax(_upper_ends(curve))) for panel in panels for curve in panel.curves)
    for number, panel in enumerate(panels):
        ax = add_axes(figure, 1, len(panels), number + 1)
        for curve in panel.curves:
            _draw(ax, curve, names.index(curve.name))
        if panel.log:
            ax.set_yscale("log", nonpositive="mask")
        else:
            ax.set_ylim(0.0, 1.1 * top if alike else None)
        for value, word in panel.marks:
            ax.axvline(value, color=FAINT, linewidth=0.7, linestyle=(0, (3, 3)), zorder=1)
            ax.annotate(
                word,
                (value, _MARK_HEIGHT),
                xycoords=("data", "axes fraction"),
                xytext=(4.0, 0.0),
                textcoords="offset points",
                va="bottom",
                rotation=90.0,
                fontsize=SMALL_PT,
                color=INK,
                bbox={"facecolor": PAPER, "edgecolor": "none", "alpha": 0.8, "pad": 0.6},
            )
        ax.set_xlabel(panel.x_label, fontsize=TEXT_PT)
        ax.set_ylabel(panel.y_label, fontsize=TEXT_PT)
        ax.set_title(panel.title, loc="left", color=INK, fontsize=TEXT_PT)
        ax.grid(visible=True, axis="y", color=FAINT, alpha=0.35, linewidth=0.4)
    legend_below(figure)
    return figure_of(figure.axes[0])


def _upper_ends(curve: Curve) -> FloatArray:
    return curve.y + curve.half_width if len(curve.half_width) else curve.y


def _draw(ax: "Axes", curve: Curve, number: int) -> None:
    sizes = {len(curve.x), len(curve.y)} | ({len(curve.half_width)} if len(curve.half_width) else set())
    if len(sizes) > 1:
        raise ValueError(f"curve '{curve.name}' has arrays of {sorted(sizes)} values")
    colour = SERIES[number % len(SERIES)]
    marked = len(curve.x) <= _MOST_MARKED
    ax.errorbar(
        curve.x,
        curve.y,
        yerr=curve.half_width if len(curve.half_width) else None,
        color=colour,
        linestyle=DASHES[number % len(DASHES)],
        marker=MARKERS[number % len(MARKERS)] if marked else "",
        markersize=4.5,
        markeredgecolor=PAPER,
        markeredgewidth=0.5,
        elinewidth=0.8,
        capsize=2.0,
        label=curve.name,
        zorder=3,
    )
