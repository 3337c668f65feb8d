"""Where on the floor an estimator errs, and how many drives say so: two maps of the cells of a site."""

from typing import TYPE_CHECKING, Final

import numpy as np
import shapely

from layoutopt.error_map import LEAST_DRIVES, WIDEST_INTERVAL, ErrorMap
from layoutopt.identity import BoolArray, FloatArray
from layoutopt.plots.figures import FAINT, INK, SMALL_PT, add_axes, figure_of, legend_above, new_figure
from layoutopt.plots.floor_plan import WIDTH_MM, draw_floor, frame_site, region_path
from layoutopt.plots.shades import scale_beside, shades
from layoutopt.site import Site
from layoutopt.units import format_length

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure
    from matplotlib.image import AxesImage
    from matplotlib.path import Path

_SHARES: Final = (1.5, 1.0)
"""Widths of the two maps: the error is what is asked, the drives are what it rests on."""
_FRAME_MM: Final = 30.0
_PLAN_SHARE: Final = 0.46
_TALLEST_MM: Final = 200.0
_BARE_PT: Final = 4.0
_LEGEND_PT: Final = 16.0
"""Distance of the title from the map, without and with a legend between them."""
_HATCH: Final = "\\\\\\\\"
"""Leans the other way than that of obstacles."""


def draw_local_error(
    *, site: Site, errors: ErrorMap, title: str = "", axes: "Sequence[Axes] | None" = None
) -> "Figure":
    """Draw the mean position error by cell, and beside it the number of drives that came there.

    The scale of the errors begins at zero. Cells whose mean is not certain (`ErrorMap.certain`) are hatched and
    not coloured; cells into which no drive came are left empty.

    Parameters
    ----------
    errors
        From `layoutopt.error_map.error_map` or `layoutopt.simulation.local_error.simulated_error_map`.
    title
        Such as the names of estimator and scenario; the number of drives is told beside it.
    axes
        Two axes to draw into; by default those of a new figure.

    Raises
    ------
    ValueError
        If no drive came into any cell, or not two axes were given.
    """
    from matplotlib.ticker import MaxNLocator

    if not errors.drives.any():
        raise ValueError("no drive came into any cell; a map of errors needs at least one")
    if axes is None:
        axes = _two_axes(site)
    elif len(axes) != 2:
        raise ValueError(f"{len(axes)} axes; a map of local errors needs two, for errors and for drives")
    left, right = axes
    certain = errors.certain
    entries = []
    if certain.any():
        shown_mm = np.where(certain, 1000.0 * errors.mean_m, np.nan)
        image = _draw_cells(left, site, errors, shown_mm)
        scale_beside(left, image, "mean position error (mm)")
    doubtful = (errors.drives > 0) & ~certain
    if doubtful.any():
        entries.append(_hatch(left, site, errors, doubtful))
    drives = _draw_cells(right, site, errors, np.where(errors.drives > 0, errors.drives, np.nan))
    scale_beside(right, drives, "drives that came there").locator = MaxNLocator(nbins=5, integer=True)
    for ax in (left, right):
        draw_floor(ax, site)
        frame_site(ax, site)
    if entries:
        legend_above(left, entries, columns=1)
    words = f"{title}: " if title else ""
    pad_pt = _LEGEND_PT if entries else _BARE_PT
    left.set_title(words + _told(errors), loc="left", fontsize=SMALL_PT, color=INK, pad=pad_pt, parse_math=False)
    return figure_of(left)


def _two_axes(site: Site) -> "tuple[Axes, Axes]":
    xmin, ymin, xmax, ymax = site.bounds_m
    height_mm = _FRAME_MM + _PLAN_SHARE * WIDTH_MM * (ymax - ymin) / (xmax - xmin)
    figure = new_figure(WIDTH_MM, min(_TALLEST_MM, height_mm))
    grid = figure.add_gridspec(1, 2, width_ratios=_SHARES)
    return add_axes(figure, grid[0]), add_axes(figure, grid[1])


def _draw_cells(ax: "Axes", site: Site, errors: ErrorMap, values: FloatArray) -> "AxesImage":
    """Draw values of cells, shape (columns, rows), from zero to the largest; NaN is left empty."""
    from matplotlib.patches import PathPatch

    left_m, low_m = errors.origin_m
    columns, rows = values.shape
    image = ax.imshow(
        values.T,
        origin="lower",
        extent=(left_m, left_m + columns * errors.cell_m, low_m, low_m + rows * errors.cell_m),
        vmin=0.0,
        vmax=float(np.nanmax(values)),
        cmap=shades(),
        interpolation="nearest",
        zorder=2,
    )
    image.set_clip_path(region_path(site.floor), ax.transData)
    # On a dark page the darkest cells would be lost without a border.
    border = _region(site, errors, np.isfinite(values))
    ax.add_patch(PathPatch(border, facecolor="none", edgecolor=FAINT, linewidth=0.7, zorder=2.5))
    return image


def _region(site: Site, errors: ErrorMap, chosen: BoolArray) -> "Path":
    """Return the outline of cells, shape (columns, rows), as far as they lie on the floor."""
    columns, rows = np.nonzero(chosen)
    low_m = np.array(errors.origin_m) + np.stack([columns, rows], axis=1) * errors.cell_m
    cells = shapely.union_all(shapely.box(*low_m.T, *(low_m + errors.cell_m).T))
    return region_path(cells.intersection(site.floor))


def _hatch(ax: "Axes", site: Site, errors: ErrorMap, chosen: BoolArray) -> "tuple[Artist, str]":
    """Hatch cells, shape (columns, rows), and return the entry of the legend."""
    from matplotlib.patches import Patch, PathPatch

    region = PathPatch(_region(site, errors, chosen), zorder=2)
    entry = Patch()
    for patch in (region, entry):
        patch.set(facecolor="none", edgecolor=FAINT, hatch=_HATCH, linewidth=0.0)
    ax.add_patch(region)
    share = f"{100.0 * WIDEST_INTERVAL:g} %"
    return entry, f"not certain: fewer than {LEAST_DRIVES} drives, or 95 % interval beyond ± {share}"


def _told(errors: ErrorMap) -> str:
    """Return how many drives there were, and how far the coloured means may be off."""
    certain = errors.certain
    drives = f"{errors.drive_count} drives, cells of {format_length(errors.cell_m)}"
    if not certain.any():
        return f"{drives}; no cell is certain"
    spread_mm = 1000.0 * errors.standard_error_m[certain]
    return f"{drives}; standard error: median {np.median(spread_mm):.2g} mm, largest {spread_mm.max():.2g} mm"
