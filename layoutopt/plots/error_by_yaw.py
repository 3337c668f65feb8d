"""Tracking error against the yaw of UHF antennas, a curve for each number of them, with intervals."""

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
    SMALL_PT,
    label_log_axis,
    new_axes,
)
from layoutopt.plots.labels import ALONG, PointLabel, place_labels, points_along

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_SIZE_MM: Final = (170.0, 105.0)
_LOG_FROM: Final = 4.0
"""Errors that differ by more than this factor stand on a logarithmic axis: the good ones lie close together."""
_ASIDE_DEG: Final = 0.5
"""Curves stand so far apart, so that bars at one yaw do not hide each other."""


@dataclass(frozen=True, slots=True, kw_only=True)
class YawCurve:
    """Errors of one number of antennas.

    Attributes
    ----------
    name
        Such as ``"2 antennas"``.
    yaw_deg
        How far the outer antennas look aside, shape (n,), degrees.
    error_mm, low_mm, high_mm
        Mean error and the ends of its interval, shape (n,), mm; ends are NaN where they are not known.
    """

    name: str
    yaw_deg: FloatArray
    error_mm: FloatArray
    low_mm: FloatArray
    high_mm: FloatArray


def draw_error_by_yaw(
    curves: Sequence[YawCurve],
    *,
    marked: tuple[int, int, str] | None = None,
    limit_mm: float | None = None,
    ax: "Axes | None" = None,
) -> "Axes":
    """Draw errors against yaw and return the axes.

    Parameters
    ----------
    marked
        Number of the curve, number of the point on it, both from 0, and words of the choice to point out.
    limit_mm
        Largest error that is allowed, drawn as a dashed line.

    Raises
    ------
    ValueError
        If there is no curve, or the columns of one differ in length.
    """
    if not curves:
        raise ValueError("a figure needs at least one curve")
    ax = new_axes(*_SIZE_MM) if ax is None else ax
    values: list[float] = [] if limit_mm is None else [limit_mm]
    for number, curve in enumerate(curves):
        columns = (curve.yaw_deg, curve.error_mm, curve.low_mm, curve.high_mm)
        if len({len(column) for column in columns}) > 1:
            raise ValueError(f"curve '{curve.name}' has columns of {[len(column) for column in columns]} values")
        values += [float(value) for value in np.concatenate(columns[1:]) if np.isfinite(value) and value > 0.0]
        _draw(ax, curve, number, _aside_deg(number, len(curves)))
    logarithmic = max(values) > _LOG_FROM * min(values)
    label_log_axis(ax, y=logarithmic)
    if not logarithmic:
        ax.set_ylim(bottom=0.0)
    if limit_mm is not None:
        ax.axhline(
            limit_mm, color=INK, linestyle=(0, (5, 3)), linewidth=0.9, label=f"limit, {limit_mm:g} mm", zorder=1
        )
    ax.set_xticks(sorted({float(yaw) for curve in curves for yaw in curve.yaw_deg}))
    ax.set_xlabel("yaw of the outer antennas, to either side (°); one antenna alone looks there")
    ax.set_ylabel("mean tracking error (mm)")
    ax.grid(visible=True, which="major", color=FAINT, alpha=0.3, linewidth=0.4)
    ax.legend(
        loc="lower left",
        bbox_to_anchor=(0.0, 1.0),
        ncols=len(curves) + (limit_mm is not None),
        frameon=False,
        fontsize=SMALL_PT,
        labelcolor=INK,
        handlelength=2.6,
        borderaxespad=0.2,
    )
    if marked is not None:
        number, point, words = marked
        x = float(curves[number].yaw_deg[point]) + _aside_deg(number, len(curves))
        y = float(curves[number].error_mm[point])
        ax.plot(x, y, marker="o", markersize=10.0, color="none", markeredgecolor=INK, zorder=5)
        ax.lines[-1].set_markeredgewidth(1.3)
        avoid = [
            place
            for other, curve in enumerate(curves)
            for place in points_along(ax, curve.yaw_deg + _aside_deg(other, len(curves)), curve.error_mm)
        ]
        if limit_mm is not None:
            avoid += points_along(ax, np.array(ax.get_xlim()), np.full(2, limit_mm), between=8 * ALONG)
        place_labels(ax, [PointLabel(x=x, y=y, text=words, bold=True)], avoid)
    return ax


def _aside_deg(number: int, count: int) -> float:
    return (number - (count - 1) / 2.0) * _ASIDE_DEG


def _draw(ax: "Axes", curve: YawCurve, number: int, aside_deg: float) -> None:
    ends = np.stack([curve.error_mm - curve.low_mm, curve.high_mm - curve.error_mm])
    ax.errorbar(
        curve.yaw_deg + aside_deg,
        curve.error_mm,
        yerr=np.where(np.isfinite(ends), np.maximum(ends, 0.0), 0.0),
        color=SERIES[number % len(SERIES)],
        linestyle=DASHES[number % len(DASHES)],
        marker=MARKERS[number % len(MARKERS)],
        markeredgecolor=PAPER,
        markeredgewidth=0.5,
        linewidth=1.0,
        elinewidth=0.9,
        capsize=2.0,
        label=curve.name,
        zorder=3,
    )
