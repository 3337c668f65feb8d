"""Rose plots: the chance that a straight run is blind, by its direction."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from layoutopt.identity import FloatArray
from layoutopt.plots.figures import DASHES, FAINT, INK, SERIES, SMALL_PT, figure_of, new_figure

if TYPE_CHECKING:
    from matplotlib.figure import Figure

_WIDTH_MM: Final = 170.0
_HEIGHT_MM: Final = 88.0
_ROOT_TICKS: Final = (0.01, 0.05, 0.1, 0.2, 0.4, 0.6, 0.8)


@dataclass(frozen=True, slots=True, kw_only=True)
class RoseCurve:
    """One named curve: blind probability over the direction of travel, shape (n,) each, over a full turn."""

    label: str
    direction_rad: FloatArray
    probability: FloatArray


def draw_blind_rose(curves: Sequence[RoseCurve]) -> "Figure":
    """Draw curves about one centre; the radius is the root of the probability, so that areas compare.

    Raises
    ------
    ValueError
        If there is no curve, or the arrays of one differ in length.
    """
    if not curves:
        raise ValueError("a rose needs at least one curve")
    figure = new_figure(_WIDTH_MM, _HEIGHT_MM)
    ax = figure.add_subplot(1, 1, 1, projection="polar")
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
    ticks = [tick for tick in _ROOT_TICKS if tick <= 1.05 * top] or [top]
    ax.set_yticks(np.sqrt(ticks), [f"{100.0 * tick:g} %" for tick in ticks], fontsize=SMALL_PT, color=INK)
    ax.set_rlabel_position(22.5)  # type: ignore[attr-defined]
    ax.set_rmin(0.0)  # type: ignore[attr-defined]
    ax.tick_params(axis="x", labelsize=SMALL_PT, colors=INK)
    ax.grid(visible=True, color=FAINT, alpha=0.5, linewidth=0.4)
    ax.legend(loc="center left", bbox_to_anchor=(1.18, 0.5), frameon=False, fontsize=SMALL_PT, labelcolor=INK)
    return figure_of(figure.axes[0])
