"""One drive on its floor: the estimated path, the true one where it is known, and the tags that were read."""

from typing import TYPE_CHECKING, Final

import numpy as np

from layoutopt.identity import BoolArray, FloatArray, IntArray
from layoutopt.layout import Layout, TagMap
from layoutopt.plots.figures import INK, SERIES, rasterised
from layoutopt.plots.floor_plan import draw_floor, draw_tags
from layoutopt.site import Site

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.lines import Line2D

RADIUS_95: Final = float(np.sqrt(-2.0 * np.log(0.05)))
"""Standard deviations within which a place in the plane lies with a probability of 95 % (Rayleigh)."""
ELLIPSE: Final = "95 % ellipse as stated"
"""Its words in a legend."""
_ELLIPSES: Final = 12
"""In a picture, so that they do not hide the path."""
_SMALLEST: Final = 0.012
"""An ellipse is seen if its longer half-axis is at least this share of the width shown."""
_FACTORS: Final = (1, 2, 5, 10, 20, 50, 100, 200, 500, 1000)


def draw_drive(
    ax: "Axes",
    *,
    layout: Layout,
    site: Site,
    tag_map: TagMap,
    path_m: FloatArray,
    true_m: FloatArray,
    read_tags: IntArray,
    lost: BoolArray,
    covariance_m2: FloatArray | None,
) -> "list[tuple[Line2D, str]]":
    """Draw a drive on its floor within the limits of axes, and return the entries of a legend.

    Parameters
    ----------
    path_m, true_m
        Estimated and true places after each step, shape (n, 2), m; gaps where they are not known (NaN).
    read_tags
        Indices in the tag map of the tags that were read, in any order and number.
    lost
        Steps in which the estimator says that it is lost, shape (n,).
    covariance_m2
        That of x and y which the estimator states, shape (n, 2, 2), m²: ellipses that hold the place with a
        probability of 95 %, at some steps. They are drawn larger by a round factor if they would be too small to
        be seen, and the legend says so.

    Raises
    ------
    ValueError
        If the columns differ in length.
    """
    if not len(path_m) == len(true_m) == len(lost):
        raise ValueError(f"columns of {len(path_m)}, {len(true_m)} and {len(lost)} steps")
    if covariance_m2 is not None and len(covariance_m2) != len(path_m):
        raise ValueError(f"covariances of {len(covariance_m2)} steps for a path of {len(path_m)}")
    draw_floor(ax, site)
    draw_tags(ax, layout, tag_map)
    read_m = tag_map.xy_m[np.unique(read_tags)]
    dense = rasterised(max(len(path_m), len(read_m)))
    drawn = ax.plot(
        *read_m.T,
        linestyle="none",
        marker="D",
        markersize=2.6,
        markerfacecolor="none",
        markeredgecolor=SERIES[2],
        markeredgewidth=0.7,
        label=f"tag that was read ({len(read_m)} of {len(tag_map)})",
        rasterized=dense,
        zorder=5,
    )
    if np.isfinite(true_m).any():
        drawn += ax.plot(
            *true_m.T, color=INK, linewidth=2.2, alpha=0.35, label="true path", rasterized=dense, zorder=6
        )
    drawn += ax.plot(*path_m.T, color=SERIES[0], linewidth=0.9, label="estimated path", rasterized=dense, zorder=7)
    if len(path_m):
        drawn += ax.plot(
            *path_m[0], linestyle="none", marker="s", markersize=5.0, color=SERIES[0], label="first step", zorder=8
        )
    if covariance_m2 is not None:
        drawn += _draw_ellipses(ax, path_m, covariance_m2)
    if lost.any():
        drawn += ax.plot(
            *path_m[lost].T,
            linestyle="none",
            marker="x",
            markersize=4.0,
            color=SERIES[1],
            label=f"lost ({int(lost.sum())} steps)",
            rasterized=dense,
            zorder=8,
        )
    return [(line, str(line.get_label())) for line in drawn]


def _draw_ellipses(ax: "Axes", path_m: FloatArray, covariance_m2: FloatArray) -> "list[Line2D]":
    """Draw ellipses at evenly spaced steps of those that are shown, and return the entry of the legend."""
    from matplotlib.collections import EllipseCollection
    from matplotlib.lines import Line2D

    low_m, high_m = np.array([ax.get_xlim(), ax.get_ylim()]).T
    shown = np.flatnonzero(((path_m >= low_m) & (path_m <= high_m)).all(axis=1))
    if not len(shown):
        return []
    chosen = shown[np.unique(np.linspace(0, len(shown) - 1, _ELLIPSES).astype(np.int64))]
    variance_m2, directions = np.linalg.eigh(covariance_m2[chosen])
    halves_m = RADIUS_95 * np.sqrt(variance_m2.clip(0.0))
    wanted = _SMALLEST * float(high_m[0] - low_m[0]) / max(float(np.median(halves_m[:, 1])), 1e-9)
    factor = next((factor for factor in _FACTORS if factor >= wanted), _FACTORS[-1])
    ellipses = EllipseCollection(
        2.0 * factor * halves_m[:, 1],
        2.0 * factor * halves_m[:, 0],
        np.degrees(np.arctan2(directions[:, 1, 1], directions[:, 0, 1])),
        units="xy",
        offsets=path_m[chosen],
        offset_transform=ax.transData,
        facecolors="none",
        edgecolors=SERIES[3],
        linewidths=0.9,
        zorder=7.5,
    )
    ax.add_collection(ellipses, autolim=False)
    words = ELLIPSE + (f", {factor} times larger" if factor > 1 else "")
    entry = Line2D([], [], linestyle="none", marker="o", markersize=7.0, markerfacecolor="none", label=words)
    entry.set_markeredgecolor(SERIES[3])
    return [entry]
