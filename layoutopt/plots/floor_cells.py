"""Square cells of a floor, marked by how much falls into each."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Final

import numpy as np

from layoutopt.plots.floor_plan import draw_floor, frame_site, plan_axes
from layoutopt.plots.shades import scale_beside, shades
from layoutopt.site import Site

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_PLAN_SHARE: Final = 0.8


def draw_floor_cells(
    site: Site,
    corners_m: Sequence[tuple[float, float]],
    counts: Sequence[int],
    side_m: float,
    label: str,
    *,
    ax: "Axes | None" = None,
) -> "Axes":
    """Draw a site with squares of ``side_m`` on it, by their lower left corners; the darker, the more counted.

    Parameters
    ----------
    label
        What is counted, in words beside the scale.
    ax
        Axes to draw into; by default those of a new figure.

    Raises
    ------
    ValueError
        If there is no cell, or not one count for each.
    """
    from matplotlib.collections import PatchCollection
    from matplotlib.patches import Rectangle
    from matplotlib.ticker import MaxNLocator

    if not corners_m or len(corners_m) != len(counts):
        raise ValueError(f"{len(corners_m)} cells and {len(counts)} counts; give one count for each cell")
    ax = plan_axes(site, ax, share=_PLAN_SHARE)
    draw_floor(ax, site)
    cells = PatchCollection(
        [Rectangle(corner_m, side_m, side_m) for corner_m in corners_m], cmap=shades(), linewidth=0.0, zorder=5
    )
    cells.set_array(np.array(counts, dtype=np.float64))
    cells.set_clim(0.0, max(counts))
    ax.add_collection(cells, autolim=False)
    frame_site(ax, site)
    scale_beside(ax, cells, label).locator = MaxNLocator(nbins=5, integer=True)
    return ax
