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
    figure_of,
    label_log_axis,
    legend_below,
    panel_axes,
)
from layoutopt.plots.labels import ALONG, PointLabel, place_labels, points_along

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_WIDTH_MM: Final = 170.0
_HEIGHT_MM: Final = 75.0
_MARK_HEIGHT: Final = 0.48
_DECADES: Final = 1000.0
"""A logarithmic axis over less than this factor has plain numbers."""
_MOST_MARKED: Final = 30
"""Curves with more points than this are lines without marks."""
_ASIDE: Final = 0.008
"""Curves with intervals stand so far apart, as a share of the width of the axis, so that bars do not hide bars."""
_RING_PT: Final = 10.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Curve:
    """One named curve, shape (n,) each, broken where y is NaN.

    ``half_width`` is that of its interval, shape (n,), or how far it goes down and up, shape (2, n), or nothing.
    ``pointed_out`` are numbers of points, from 0, that get a ring, with the words beside it.
    """

    name: str
    x: FloatArray
    y: FloatArray
    half_width: FloatArray = field(default_factory=lambda: np.empty(0))
    pointed_out: tuple[tuple[int, str], ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True)
class Panel:
    """Axes with curves; ``marks`` are values of x with a word, drawn as thin lines.

    ``log`` is for values of y that fall by powers of ten; what is not positive then has no place. ``log_x`` is for
    values of x, all positive, that grow by factors. ``levels`` are values of y with a word, such as a demand.
    """

    title: str
    x_label: str
    y_label: str
    curves: tuple[Curve, ...]
    marks: tuple[tuple[float, str], ...] = ()
    log: bool = False
    log_x: bool = False
    levels: tuple[tuple[float, str], ...] = ()


def draw_curves(panels: Sequence[Panel], *, axes: "Sequence[Axes] | None" = None) -> "Figure":
    """Draw panels side by side; a curve of one name looks the same in all of them, and one label has one scale.

    Where several curves of a panel have intervals, they stand a little aside of their x, so that all are seen.

    Parameters
    ----------
    axes
        Axes to draw into, one for each panel; by default those of a new figure.

    Raises
    ------
    ValueError
        If there is no panel, not one axes for each, or a curve's arrays differ in length.
    """
    if not panels:
        raise ValueError("a figure needs at least one panel")
    names = list(dict.fromkeys(curve.name for panel in panels for curve in panel.curves))
    axes = panel_axes(axes, len(panels), columns=len(panels), width_mm=_WIDTH_MM, height_mm=_HEIGHT_MM)
    alike = len({panel.y_label for panel in panels}) == 1
    top = max(float(np.nanmax(_upper_ends(curve))) for panel in panels for curve in panel.curves)
    top = max([top, *(value for panel in panels for value, _ in panel.levels)])
    for ax, panel in zip(axes, panels, strict=True):
        for curve, x in zip(panel.curves, _places(panel), strict=True):
            _draw(ax, curve, x, names.index(curve.name))
        # Before the limits are set, so that these have room for it.
        for value, word in panel.levels:
            _draw_level(ax, value, word)
        if panel.log:
            _make_logarithmic(ax, panel)
        else:
            ax.set_ylim(0.0, 1.1 * top if alike else None)
        if panel.log_x:
            label_log_axis(ax, x=True)
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
    if alike and all(panel.log for panel in panels):
        ends = [end for ax in axes for end in ax.get_ylim()]
        for ax in axes:
            ax.set_ylim(min(ends), max(ends))
    legend_below(axes)
    for ax, panel in zip(axes, panels, strict=True):
        _point_out(ax, panel)
    return figure_of(axes[0])


def _places(panel: Panel) -> list[FloatArray]:
    """Return where the points of each curve are drawn along x."""
    barred = [
        number
        for number, curve in enumerate(panel.curves)
        if len(curve.x) <= _MOST_MARKED and curve.half_width.any()
    ]
    places = [curve.x for curve in panel.curves]
    if len(barred) > 1:
        every = np.concatenate(places)
        step = _ASIDE * float(np.ptp(np.log(every) if panel.log_x else every))
        for rank, number in enumerate(barred):
            aside = (rank - (len(barred) - 1) / 2.0) * step
            places[number] = places[number] * np.exp(aside) if panel.log_x else places[number] + aside
    return places


def _point_out(ax: "Axes", panel: Panel) -> None:
    if not any(curve.pointed_out for curve in panel.curves):
        return
    labels, avoid = [], []
    for curve, x in zip(panel.curves, _places(panel), strict=True):
        avoid += points_along(ax, x, curve.y)
        for number, words in curve.pointed_out:
            at = float(x[number]), float(curve.y[number])
            ax.plot(*at, marker="o", markersize=_RING_PT, color="none", markeredgecolor=INK, zorder=5)
            ax.lines[-1].set_markeredgewidth(1.3)
            labels.append(PointLabel(x=at[0], y=at[1], text=words, bold=True))
    for value, _ in panel.levels:
        avoid += points_along(ax, np.array(ax.get_xlim()), np.full(2, value), between=8 * ALONG)
    place_labels(ax, labels, avoid)


def _make_logarithmic(ax: "Axes", panel: Panel) -> None:
    values = np.concatenate([curve.y for curve in panel.curves])
    positive = values[values > 0.0]
    if len(positive) and positive.max() < _DECADES * positive.min() and len(positive) == len(values):
        label_log_axis(ax, y=True)
    else:
        ax.set_yscale("log", nonpositive="mask")


def _draw_level(ax: "Axes", value: float, word: str) -> None:
    ax.axhline(value, color=INK, linewidth=0.7, linestyle=(0, (1, 2)), zorder=1)
    ax.annotate(
        word,
        (0.0, value),
        xycoords=("axes fraction", "data"),
        xytext=(3.0, 1.5),
        textcoords="offset points",
        fontsize=SMALL_PT,
        color=INK,
    )


def _upper_ends(curve: Curve) -> FloatArray:
    return curve.y + np.atleast_2d(curve.half_width)[-1] if len(curve.half_width) else curve.y


def _draw(ax: "Axes", curve: Curve, x: FloatArray, number: int) -> None:
    sizes = {len(curve.x), len(curve.y)} | ({curve.half_width.shape[-1]} if len(curve.half_width) else set())
    if len(sizes) > 1:
        raise ValueError(f"curve '{curve.name}' has arrays of {sorted(sizes)} values")
    colour = SERIES[number % len(SERIES)]
    marked = len(curve.x) <= _MOST_MARKED
    ax.errorbar(
        x,
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
