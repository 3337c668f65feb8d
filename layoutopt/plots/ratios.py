"""Ratios of ours to printed numbers, a row a number, with intervals and a band that counts as agreement."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

from layoutopt.plots.figures import FAINT, INK, MARKERS, PAPER, SERIES, SMALL_PT, TEXT_PT, label_log_axis, new_axes

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_WIDTH_MM: Final = 170.0
_ROW_MM: Final = 5.2
_FRAME_MM: Final = 26.0
_SPREAD: Final = 0.22
_NARROW: Final = 4.0
"""A span below this factor gets more numbers on its axis."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RatioRow:
    """One row: a label, and for each series the ratio with the ends of its interval."""

    label: str
    ratios: Mapping[str, tuple[float, float, float]]


def draw_ratios(
    rows: Sequence[RatioRow], *, bands: Sequence[float] = (1.5, 2.0), x_label: str, ax: "Axes | None" = None
) -> "Axes":
    """Draw rows from top to bottom on a logarithmic axis, with bands from 1 / factor to factor.

    Parameters
    ----------
    ax
        Axes to draw into; by default those of a new figure.

    Raises
    ------
    ValueError
        If there is no row.
    """
    if not rows:
        raise ValueError("a figure needs at least one row")
    names = list(dict.fromkeys(name for row in rows for name in row.ratios))
    ax = new_axes(_WIDTH_MM, _FRAME_MM + _ROW_MM * len(rows)) if ax is None else ax
    label_log_axis(ax, x=True)
    for factor in sorted(bands, reverse=True):
        ax.axvspan(1.0 / factor, factor, color=FAINT, alpha=0.16, linewidth=0.0, zorder=0)
    ax.axvline(1.0, color=INK, linewidth=0.7, zorder=1)
    for number, name in enumerate(names):
        shift = (number - (len(names) - 1) / 2.0) * 2.0 * _SPREAD / max(1, len(names) - 1)
        found = [(place + shift, row.ratios[name]) for place, row in enumerate(rows) if name in row.ratios]
        middle = [ratio for _, (ratio, _, _) in found]
        ax.errorbar(
            middle,
            [place for place, _ in found],
            xerr=[
                [max(0.0, ratio - low) for _, (ratio, low, _) in found],
                [max(0.0, high - ratio) for _, (ratio, _, high) in found],
            ],
            color=SERIES[number % len(SERIES)],
            linestyle="",
            marker=MARKERS[number % len(MARKERS)],
            markersize=4.5,
            markeredgecolor=PAPER,
            markeredgewidth=0.5,
            elinewidth=0.8,
            label=name,
            zorder=3,
        )
    low, high = ax.get_xlim()
    if high / low < _NARROW:
        label_log_axis(ax, x=True, marks=(1.0, 1.2, 1.5, 2.0, 3.0, 4.0, 5.0, 6.0, 8.0))
    ax.set_yticks(range(len(rows)), [row.label for row in rows], fontsize=SMALL_PT)
    ax.set_ylim(len(rows) - 0.4, -0.6)
    ax.set_xlabel(x_label, fontsize=TEXT_PT)
    ax.legend(
        loc="lower left",
        bbox_to_anchor=(0.0, 1.0),
        ncols=len(names),
        frameon=False,
        fontsize=SMALL_PT,
        labelcolor=INK,
    )
    return ax
