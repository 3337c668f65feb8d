"""Roses: the chance that a straight run is blind, by its direction."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from layoutopt.identity import FloatArray
from layoutopt.plots.figures import DASHES, FAINT, INK, PAPER, SERIES, SMALL_PT, add_axes, new_figure

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_WIDTH_MM: Final = 170.0
_HEIGHT_MM: Final = 88.0
_TICKS: Final = (0.01, 0.05, 0.1, 0.2, 0.4, 0.6, 0.8)
_OVER: Final = 1.05
"""A ring may lie this much beyond the largest chance."""
_APART: Final = 0.15
"""Least distance of two rings with numbers, as a share of the radius, for the numbers to stand side by side."""


@dataclass(frozen=True, slots=True, kw_only=True)
class RoseCurve:
    """One named curve: blind probability over the direction of travel, shape (n,) each, over a full turn."""

    label: str
    direction_rad: FloatArray
    probability: FloatArray


def draw_blind_rose(curves: Sequence[RoseCurve], *, ax: "Axes | None" = None) -> "Axes":
    """Draw curves about one centre and return the axes.

    The radius is the root of the probability, so that areas compare.

    Parameters
    ----------
    ax
        Polar axes to draw into; by default those of a new figure.

    Raises
    ------
    ValueError
        If there is no curve, the arrays of one differ in length, or the axes are not polar.
    """
    if not curves:
        raise ValueError("a rose needs at least one curve")
    ax = add_axes(new_figure(_WIDTH_MM, _HEIGHT_MM), projection="polar") if ax is None else ax
    if ax.name != "polar":
        raise ValueError(f"a rose needs polar axes, not {ax.name} ones; make them with projection='polar'")
    for number, curve in enumerate(curves):
        if len(curve.direction_rad) != len(curve.probability):
            raise ValueError(f"curve '{curve.label}' has arrays of different lengths")
        closed_rad = np.append(curve.direction_rad, curve.direction_rad[0] + 2.0 * np.pi)
        root = np.sqrt(np.append(curve.probability, curve.probability[0]))
        ax.plot(
            closed_rad,
            root,
            color=SERIES[number % len(SERIES)],
            linestyle=DASHES[number % len(DASHES)],
            linewidth=1.1,
            label=curve.label,
        )
    top = max(float(curve.probability.max()) for curve in curves)
    ticks = _ticks(top)
    ax.set_yticks(
        np.sqrt(ticks),
        [f"{100.0 * tick:g} %" for tick in ticks],
        fontsize=SMALL_PT,
        color=INK,
        zorder=4,
        bbox={"boxstyle": "square,pad=0.1", "facecolor": PAPER, "edgecolor": "none", "alpha": 0.8},
    )
    ax.set_rlabel_position(22.5)  # type: ignore[attr-defined]
    ax.set_rmin(0.0)  # type: ignore[attr-defined]
    ax.set_axisbelow(False)
    ax.spines["polar"].set(color=FAINT, linewidth=0.7)
    ax.tick_params(axis="x", labelsize=SMALL_PT, colors=INK, pad=1.0)
    ax.set_xlabel("direction of travel (°), 0 along x; radius: blind runs (%)", fontsize=SMALL_PT, color=INK)
    ax.grid(visible=True, color=FAINT, alpha=0.5, linewidth=0.4)
    ax.legend(loc="center left", bbox_to_anchor=(1.18, 0.5), frameon=False, fontsize=SMALL_PT, labelcolor=INK)
    return ax


def _ticks(top: float) -> list[float]:
    """Return the chances at which rings are drawn, from the outermost in, so that their numbers have room."""
    ticks: list[float] = []
    for tick in reversed(_TICKS):
        fits = not ticks or math.sqrt(ticks[-1]) - math.sqrt(tick) >= _APART * math.sqrt(top)
        if tick <= _OVER * top and fits:
            ticks.append(tick)
    return ticks[::-1] or [top]
