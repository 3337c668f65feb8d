"""Square cells of a floor, marked by how much falls into each."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Final

from layoutopt.plots.figures import INK, SERIES, SMALL_PT, new_axes
from layoutopt.plots.layout_plan import WIDTH_MM, draw_floor, frame_plan
from layoutopt.site import Site

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_FAINTEST: Final = 0.25
_TALLEST_MM: Final = 200.0


def draw_floor_cells(
    site: Site, corners_m: Sequence[tuple[float, float]], counts: Sequence[int], side_m: float, label: str
) -> "Axes":
    """Draw a site with squares of ``side_m`` on it, by their lower left corners; the darker, the more counted.

    Raises
    ------
    ValueError
        If there is no cell, or not one count for each.
    """
    from matplotlib.patches import Patch, Rectangle

    if not corners_m or len(corners_m) != len(counts):
        raise ValueError(f"{len(corners_m)} cells and {len(counts)} counts; give one count for each cell")
    xmin, ymin, xmax, ymax = site.bounds_m
    ax = new_axes(WIDTH_MM, min(_TALLEST_MM, 30.0 + 0.9 * WIDTH_MM * (ymax - ymin) / (xmax - xmin)))
    draw_floor(ax, site)
    most = max(counts)
    for corner_m, count in zip(corners_m, counts, strict=True):
        alpha = _FAINTEST + (1.0 - _FAINTEST) * count / most
        ax.add_patch(Rectangle(corner_m, side_m, side_m, facecolor=SERIES[1], alpha=alpha, linewidth=0, zorder=5))
    margin_m = 0.03 * max(xmax - xmin, ymax - ymin)
    frame_plan(ax, (xmin - margin_m, ymin - margin_m, xmax + margin_m, ymax + margin_m))
    ax.legend(
        [Patch(facecolor=SERIES[1], linewidth=0)],
        [label],
        loc="lower left",
        bbox_to_anchor=(0.0, 1.0),
        frameon=False,
        fontsize=SMALL_PT,
        labelcolor=INK,
    )
    return ax
