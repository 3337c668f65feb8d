"""Replay of a drive: where the robot was and was believed to be, what it read, and its errors over time."""

from typing import TYPE_CHECKING, Final

import numpy as np

from layoutopt.geometry import Bounds, wrapped
from layoutopt.identity import FloatArray, IntArray
from layoutopt.layout import Layout, TagMap
from layoutopt.plots.drive_plan import ELLIPSE, RADIUS_95, draw_drive
from layoutopt.plots.error_over_time import draw_error_over_time
from layoutopt.plots.figures import INK, SMALL_PT, add_axes, figure_of, new_figure, parent_of
from layoutopt.plots.floor_plan import WIDTH_MM, frame_plan, frame_site
from layoutopt.readings import UNKNOWN_TAG, Trajectory
from layoutopt.site import Site

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.lines import Line2D

_PANELS: Final = 4
_LEGEND_COLUMNS: Final = 3
_ERRORS_MM: Final = 34.0
"""Height of each of the two axes of errors."""
_FRAME_MM: Final = 44.0
_TALLEST_PLAN_MM: Final = 150.0
_SHARES: Final = (1.7, 1.0)
"""Widths of the plan and of the piece of it that is shown larger."""
_HALF_M: Final = 0.4
"""Half of the side of that piece, unless the error itself is larger than a quarter of it."""


def draw_replay(
    *,
    layout: Layout,
    site: Site,
    tag_map: TagMap,
    step_s: float,
    trajectory: Trajectory,
    true_poses: FloatArray,
    read_tags: IntArray,
    name: str = "estimate",
    axes: "Sequence[Axes] | None" = None,
) -> "Figure":
    """Draw a simulated trial or a logged drive: the plan, the piece of it where the error is largest, and errors.

    Both paths, the tags that were read and the uncertainty that the estimator states stand on the plan; below are
    the errors of position and heading over time. Where the truth is not known there is no error, and the piece
    shown is that where the stated uncertainty is largest.

    Parameters
    ----------
    tag_map
        The tags, from ``layout.floor_tags.lay_on(site)``.
    step_s
        Time step of the drive, s.
    true_poses
        True x, y and heading after each step, shape (n, 3), NaN where they are not known; of a trial that is
        ``record.drive.poses[1:]``.
    read_tags
        Index in the tag map of each read, such as ``record.observations.read_tag``; unknown ones are left out.
    name
        Of the estimator.
    axes
        Four axes to draw into: plan, piece of it, position error, heading error; by default those of a new figure.

    Raises
    ------
    ValueError
        If there is no step, truth and estimate differ in length, or not four axes were given.
    """
    poses = trajectory.poses
    if not len(poses) or len(true_poses) != len(poses):
        raise ValueError(
            f"a replay needs as many true poses as estimated ones, not {len(true_poses)} and {len(poses)}"
        )
    if axes is None:
        axes = _four_axes(site)
    elif len(axes) != _PANELS:
        raise ValueError(
            f"{len(axes)} axes; a replay needs {_PANELS}: plan, piece of it, position and heading error"
        )
    plan, piece, position, heading = axes
    off = poses - true_poses
    error_m = np.hypot(off[:, 0], off[:, 1])
    spread_m = _spread_m(trajectory)
    worst, words = _worst(error_m, spread_m)
    lost = np.zeros(len(poses), dtype=np.bool_) if trajectory.lost is None else trajectory.lost
    frame_site(plan, site)
    frame_plan(piece, _window_m(poses[worst, :2], true_poses[worst, :2], error_m[worst]))
    entries, entries_of_piece = (
        draw_drive(
            ax,
            layout=layout,
            site=site,
            tag_map=tag_map,
            path_m=poses[:, :2],
            true_m=true_poses[:, :2],
            read_tags=read_tags[read_tags != UNKNOWN_TAG],
            lost=lost,
            covariance_m2=trajectory.covariance,
        )
        for ax in (plan, piece)
    )
    _box(plan, piece)
    # The ellipses have a scale of their own in each of the two.
    told = [
        f"{words} at {(worst + 1) * step_s:.1f} s (box in the plan)",
        *(text for _, text in entries_of_piece if ELLIPSE in text),
    ]
    piece.set_title("\n".join(told), loc="left", fontsize=SMALL_PT, color=INK)
    _legend(plan, entries)
    draw_error_over_time(
        time_s=np.asarray(step_s * np.arange(1, len(poses) + 1), dtype=np.float64),
        position_error_m={name: error_m},
        heading_error_rad={name: wrapped(off[:, 2])},
        stated_m={} if spread_m is None else {name: RADIUS_95 * spread_m},
        ax=position,
        heading_ax=heading,
    )
    if not np.isfinite(error_m).any():
        for ax in (position, heading):
            ax.annotate("truth not known", (0.02, 0.9), xycoords="axes fraction", fontsize=SMALL_PT, color=INK)
    return figure_of(plan)


def _legend(plan: "Axes", entries: "Sequence[tuple[Line2D, str]]") -> None:
    parent_of(plan).legend(
        [handle for handle, _ in entries],
        [words for _, words in entries],
        loc="outside upper left",
        ncols=_LEGEND_COLUMNS,
        frameon=False,
        fontsize=SMALL_PT,
        labelcolor=INK,
    )


def _four_axes(site: Site) -> "tuple[Axes, Axes, Axes, Axes]":
    xmin, ymin, xmax, ymax = site.bounds_m
    share = _SHARES[0] / sum(_SHARES)
    plan_mm = min(
        _TALLEST_PLAN_MM, max(WIDTH_MM * (1.0 - share), share * WIDTH_MM * (ymax - ymin) / (xmax - xmin))
    )
    figure = new_figure(WIDTH_MM, _FRAME_MM + plan_mm + 2.0 * _ERRORS_MM)
    grid = figure.add_gridspec(3, 2, height_ratios=(plan_mm, _ERRORS_MM, _ERRORS_MM), width_ratios=_SHARES)
    plan, piece = add_axes(figure, grid[0, 0]), add_axes(figure, grid[0, 1])
    position = add_axes(figure, grid[1, :])
    return plan, piece, position, add_axes(figure, grid[2, :], share_x=position)


def _spread_m(trajectory: Trajectory) -> FloatArray | None:
    """Return the deviation of the position that is stated, along its worst axis, shape (n,), m."""
    if trajectory.covariance is None:
        return None
    return np.asarray(np.sqrt(np.linalg.eigvalsh(trajectory.covariance)[:, -1].clip(0.0)))


def _worst(error_m: FloatArray, spread_m: FloatArray | None) -> tuple[int, str]:
    """Return the step to be shown larger, and why it is that one."""
    if np.isfinite(error_m).any():
        worst = int(np.nanargmax(error_m))
        return worst, f"largest error, {1000.0 * error_m[worst]:.3g} mm,"
    if spread_m is not None:
        return int(np.argmax(spread_m)), "largest stated uncertainty"
    return len(error_m) - 1, "last step"


def _window_m(estimated_m: FloatArray, true_m: FloatArray, error_m: float) -> Bounds:
    """Return the square about true and estimated place of a step; only the estimated one if no truth is known."""
    known = np.isfinite(error_m)
    x_m, y_m = ((estimated_m + true_m) / 2.0 if known else estimated_m).tolist()
    half_m = max(_HALF_M, 2.0 * float(error_m)) if known else _HALF_M
    return x_m - half_m, y_m - half_m, x_m + half_m, y_m + half_m


def _box(plan: "Axes", piece: "Axes") -> None:
    """Draw on the plan which piece is shown larger."""
    from matplotlib.patches import Rectangle

    (left, right), (low, high) = piece.get_xlim(), piece.get_ylim()
    frame = Rectangle(
        (left, low), right - left, high - low, facecolor="none", edgecolor=INK, linewidth=0.9, zorder=9
    )
    plan.add_patch(frame)
    for spine in piece.spines.values():
        spine.set_visible(True)
