"""Position and heading error of one drive over time, a line an estimator."""

from collections.abc import Mapping
from types import MappingProxyType
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
    add_axes,
    label_log_axis,
    new_figure,
    rasterised,
    spans_decade,
)

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.lines import Line2D

_TYPICAL: Final = (2.0, 98.0)
_MARKS_PER_LINE: Final = 12
_SHORT: Final = 200
_WINDOWS_PER_DRIVE: Final = 60
_STATED_DASHES: Final = DASHES[1:]


def draw_error_over_time(
    *,
    time_s: FloatArray,
    position_error_m: Mapping[str, FloatArray],
    heading_error_rad: Mapping[str, FloatArray],
    stated_m: Mapping[str, FloatArray] = MappingProxyType({}),
    ax: "Axes | None" = None,
    heading_ax: "Axes | None" = None,
) -> "Axes":
    """Draw the errors of one drive and return the axes of the position error.

    Without ``ax`` the figure has two axes, position error above heading error; into an ``ax`` of the caller's goes
    the position error, and the heading error into ``heading_ax`` if there is one. An axis is logarithmic where the
    errors reach over more than a decade. A long drive shows its steps faintly below a running mean, as the legend
    says; unknown errors leave gaps.

    Parameters
    ----------
    time_s
        Times of the steps, shape (n,), s.
    position_error_m, heading_error_rad
        Errors by estimator, shape (n,), m and rad; signs are dropped.
    stated_m
        By estimator, how far off it states the position to be at most with a probability of 95 %, shape (n,), m:
        a thin line over the errors. None by default.

    Raises
    ------
    ValueError
        If an array has another shape than ``time_s``.
    """
    time_s = np.asarray(time_s, dtype=np.float64)
    position_mm = {name: _checked(time_s, error, name) * 1000.0 for name, error in position_error_m.items()}
    heading_deg = {name: np.rad2deg(_checked(time_s, error, name)) for name, error in heading_error_rad.items()}
    stated_mm = {name: _checked(time_s, radius_m, name) * 1000.0 for name, radius_m in stated_m.items()}
    duration_s = float(time_s[-1] - time_s[0]) if len(time_s) else 0.0
    names = list(dict.fromkeys([*position_mm, *heading_deg]))
    if ax is None:
        figure = new_figure(170.0, 110.0)
        ax = add_axes(figure, 2, 1, 1)
        heading_ax = add_axes(figure, 2, 1, 2, share_x=ax)
        ax.tick_params(labelbottom=False)
    else:
        ax.set_xlabel("time (s)")
    lines = _draw(ax, time_s, position_mm, names, "position error (mm)", stated_mm)
    if heading_ax is not None:
        lines += _draw(heading_ax, time_s, heading_deg, names, "heading error (degrees)", {})
        heading_ax.set_xlabel("time (s)")
    _legend(ax, lines, len(time_s), duration_s)
    return ax


def _checked(time_s: FloatArray, error: FloatArray, name: str) -> FloatArray:
    error = np.abs(np.asarray(error, dtype=np.float64))
    if error.shape != time_s.shape:
        raise ValueError(f"errors of '{name}' of shape {error.shape} for {time_s.shape} times")
    return error


def _draw(
    ax: "Axes",
    time_s: FloatArray,
    errors: Mapping[str, FloatArray],
    names: list[str],
    label: str,
    stated: Mapping[str, FloatArray],
) -> list["Line2D"]:
    """Draw every step faintly, the running mean on top, and what is stated; return the lines for the legend."""
    every = [*errors.values(), *stated.values()]
    known = np.concatenate([np.empty(0), *(values[np.isfinite(values) & (values > 0.0)] for values in every)])
    typical = np.percentile(known, _TYPICAL) if len(known) else np.zeros(2)
    if spans_decade([float(value) for value in typical]):
        label_log_axis(ax, y=True)
        # Single steps of almost no error would stretch the axis by decades in which nothing is to be seen.
        ax.set_ylim(float(typical[0]) / 1.5, float(known.max()) * 1.3)
    elif len(known):
        ax.set_ylim(0.0, float(known.max()) * 1.08)
    window = _window(len(time_s))
    step = max(1, len(time_s) // _MARKS_PER_LINE)
    lines: list[Line2D] = []
    for number, name in enumerate(names):
        if name not in errors:
            continue
        colour = SERIES[number % len(SERIES)]
        if window > 1:
            ax.plot(
                time_s,
                np.where(errors[name] > 0.0, errors[name], np.nan),
                color=colour,
                alpha=0.3,
                linewidth=0.5,
                rasterized=rasterised(len(time_s)),
                zorder=2,
            )
        lines += ax.plot(
            time_s,
            running_mean(errors[name], window),
            color=colour,
            linestyle=DASHES[number // len(SERIES) % len(DASHES)],
            linewidth=1.3,
            marker=MARKERS[number % len(MARKERS)],
            markersize=4.5,
            markeredgecolor=PAPER,
            markeredgewidth=0.5,
            # Marks of different lines stand beside each other, not on top of each other.
            markevery=(number * step // max(1, len(names)) % step, step),
            label=name,
            rasterized=rasterised(len(time_s)),
            zorder=3,
        )
    for name, radius in stated.items():
        lines += ax.plot(
            time_s,
            radius,
            color=INK,
            linestyle=_STATED_DASHES[names.index(name) % len(_STATED_DASHES)],
            linewidth=0.8,
            label=f"{name} states: 95 % within",
            rasterized=rasterised(len(time_s)),
            zorder=2.5,
        )
    ax.grid(visible=True, axis="y", color=FAINT, alpha=0.35, linewidth=0.4)
    ax.set_ylabel(label)
    if len(time_s):
        ax.set_xlim(float(time_s.min()), float(time_s.max()) + 1e-9)
    return lines


def _window(count: int) -> int:
    """Return how many steps the running mean takes: an odd share of the drive, one for a short drive."""
    return 1 if count < _SHORT else 2 * (count // (2 * _WINDOWS_PER_DRIVE)) + 1


def running_mean(values: FloatArray, window: int) -> FloatArray:
    """Return the mean of the known values among ``window`` (odd) neighbours of each, shape (n,).

    At the ends the window is cut off; where nothing is known the mean is NaN.

    Examples
    --------
    >>> running_mean(np.array([1.0, 2.0, np.nan, 4.0]), 3).tolist()
    [1.5, 1.5, 3.0, 4.0]
    """
    known = np.isfinite(values)
    ones = np.ones(window)
    half = window // 2
    sums = np.convolve(np.where(known, values, 0.0), ones)[half : half + len(values)]
    counts = np.convolve(known.astype(np.float64), ones)[half : half + len(values)]
    means = np.full(len(values), np.nan)
    np.divide(sums, counts, out=means, where=counts > 0.5)
    return means


def _legend(ax: "Axes", lines: list["Line2D"], count: int, duration_s: float) -> None:
    """Name every line once, above the axes, and say what is averaged."""
    named: dict[str, Line2D] = {}
    for line in lines:
        named.setdefault(str(line.get_label()), line)
    if not named:
        return
    window = _window(count)
    note = f"faint: every step; strong: mean over {window * duration_s / count:.2g} s" if window > 1 else ""
    legend = ax.legend(
        list(named.values()),
        ["-"] * len(named),
        loc="lower left",
        bbox_to_anchor=(0.0, 1.0),
        ncols=min(4, len(named)),
        frameon=False,
        fontsize=SMALL_PT,
        labelcolor=INK,
        handlelength=2.6,
        title=note or None,
        title_fontsize=SMALL_PT,
        alignment="left",
    )
    legend.get_title().set_color(INK)
    # A legend leaves out names that start with an underscore, so each gets its text afterwards.
    for text, name in zip(legend.get_texts(), named, strict=True):
        text.set_parse_math(False)
        text.set_text(name)
