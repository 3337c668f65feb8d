"""What more tags serve: the front of tags and runs, and the line above which no choice reaches."""

from typing import TYPE_CHECKING

import numpy as np

from layoutopt.identity import FloatArray
from layoutopt.plots.figures import FAINT, INK, SERIES, SMALL_PT, new_axes

if TYPE_CHECKING:
    from matplotlib.axes import Axes


def draw_coverage_front(
    *, tags: FloatArray, served: FloatArray, asked: FloatArray, most: FloatArray, ax: "Axes | None" = None
) -> "Axes":
    """Draw the share of runs that numbers of new tags serve, and what no choice of as many exceeds.

    Parameters
    ----------
    tags, served
        The choices that were found, by rising number, shape (n,): new tags, and share of the runs served.
    asked, most
        No choice of up to ``asked`` tags serves more than ``most``, both rising, shape (n,).

    Raises
    ------
    ValueError
        If there is no choice.
    """
    if not len(tags):
        raise ValueError("a front needs at least one choice")
    ax = new_axes(170.0, 100.0) if ax is None else ax
    # Steps: a number of tags between two choices serves what the smaller does, and is bounded by the larger.
    places = np.unique(np.concatenate([tags, asked]))
    places = places[(places >= tags[0]) & (places <= asked[-1])]
    lower = np.array([served[tags <= place].max() for place in places])
    upper = np.array([most[asked >= place].min() for place in places])
    # Between two places what was found at the left one holds, and the bound of the right one.
    ends, below, above = np.repeat(places, 2)[1:-1], np.repeat(lower[:-1], 2), np.repeat(upper[1:], 2)
    ax.fill_between(ends, 100.0 * below, 100.0 * above, color=FAINT, alpha=0.25, linewidth=0.0, label="not known")
    ax.step(places, 100.0 * upper, where="pre", color=INK, linewidth=0.9, linestyle="--", label="none serves more")
    ax.step(places, 100.0 * lower, where="post", color=SERIES[0], linewidth=1.0)
    ax.plot(tags, 100.0 * served, linestyle="none", marker="s", markersize=4.0, color=SERIES[0], label="found")
    ax.set_xlabel("new tags")
    ax.set_ylabel("sampled runs served (%)")
    ax.set_xlim(left=0.0)
    ax.set_ylim(0.0, 103.0)
    ax.grid(visible=True, color=FAINT, alpha=0.3, linewidth=0.4)
    ax.legend(loc="lower right", frameon=False, fontsize=SMALL_PT)
    return ax
