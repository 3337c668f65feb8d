"""The floor with places for a transponder, the darker the more robots dock there."""

import math
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np
import shapely
from shapely.geometry import Polygon

from layoutopt.identity import FloatArray
from layoutopt.plots.figures import FAINT, PAPER, SERIES, figure_of, legend_above
from layoutopt.plots.floor_plan import draw_floor, frame_site, plan_axes, region_path
from layoutopt.plots.shades import scale_beside, shades
from layoutopt.site import Site
from layoutopt.units import format_length

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes
    from shapely.geometry.base import BaseGeometry

_LEAST_SIDE: Final = 0.3
_STEP: Final = 0.1
"""The scale begins at a multiple of this below the smallest share."""
_PLAN_SHARE: Final = 0.8


@dataclass(frozen=True, slots=True, kw_only=True)
class DockingMap:
    """What is drawn on the floor.

    Attributes
    ----------
    places_m, success
        Places to which robots drove, shape (n, 2), m, and the share that docked, shape (n,).
    refused_m
        Places to which none drove, shape (r, 2), m.
    side_m
        Side of the square that stands for a place; smaller where places lie closer.
    scatterers_m, clearance_m
        What scatters, shape (k, 2), m, and what the transponder keeps from it and from walls.
    best_m, given_m
        The best place, and the one that was given; ``None`` for none.
    """

    places_m: FloatArray
    success: FloatArray
    refused_m: FloatArray
    side_m: float
    scatterers_m: FloatArray
    clearance_m: float
    best_m: tuple[float, float] | None = None
    given_m: tuple[float, float] | None = None


def draw_docking_map(site: Site, shown: DockingMap, *, ax: "Axes | None" = None) -> "Axes":
    """Draw a site with places for a transponder, and return the axes.

    Parameters
    ----------
    ax
        Axes to draw into; by default those of a new figure.

    Raises
    ------
    ValueError
        If there is not one share for each place.
    """
    if len(shown.places_m) != len(shown.success):
        raise ValueError(
            f"{len(shown.places_m)} places and {len(shown.success)} shares; give one share for each place"
        )
    from matplotlib.collections import PatchCollection
    from matplotlib.lines import Line2D
    from matplotlib.patches import PathPatch, Rectangle

    ax = plan_axes(site, ax, share=_PLAN_SHARE)
    draw_floor(ax, site)
    entries: list[tuple[Artist, str]] = []
    if len(shown.places_m):
        sides_m = _sides_m(shown.places_m, shown.side_m)
        least = min(1.0 - _STEP, math.floor(shown.success.min() / _STEP + 1e-9) * _STEP)
        corners_m = shown.places_m - sides_m[:, None] / 2.0
        squares = PatchCollection(
            [Rectangle(corner_m, side_m, side_m) for corner_m, side_m in zip(corners_m, sides_m, strict=True)],
            cmap=shades(),
            edgecolor=FAINT,
            linewidth=0.3,
            zorder=2,
        )
        squares.set_array(100.0 * shown.success)
        squares.set_clim(100.0 * least, 100.0)
        squares.set_clip_path(region_path(site.floor), ax.transData)
        ax.add_collection(squares, autolim=False)
        scale_beside(ax, squares, "drives that dock (%)")
    if len(shown.refused_m):
        crosses = ax.plot(
            *shown.refused_m.T, linestyle="none", marker="x", markersize=3.0, color=FAINT, zorder=3.5
        )
        entries.append((crosses[0], "refused"))
    inside = [Polygon(ring) for ring in shapely.get_exterior_ring(shapely.get_parts(site.floor))]
    kept: BaseGeometry = shapely.union_all(inside).buffer(-shown.clearance_m)
    for scatterer_m in shown.scatterers_m:
        kept = kept.difference(shapely.Point(scatterer_m).buffer(shown.clearance_m, quad_segs=32))
    if not kept.is_empty:
        style = {"edgecolor": SERIES[1], "linestyle": (0, (4, 2)), "linewidth": 0.9}
        ax.add_patch(PathPatch(region_path(kept), facecolor="none", zorder=5, **style))
        entries.append((Line2D([], [], color=SERIES[1], linestyle=(0, (4, 2)), linewidth=0.9), _clear(shown)))
    for places_m, marker, size, colour, label in (
        (shown.scatterers_m, "o", 4.0, SERIES[1], "scatterer"),
        (_one(shown.given_m), "D", 6.0, SERIES[4], "given place"),
        (_one(shown.best_m), "*", 11.0, SERIES[2], "best place"),
    ):
        if len(places_m):
            entries += _marked(ax, places_m, marker, size, colour, label)
    frame_site(ax, site)
    legend_above(ax, entries, columns=3)
    # The room for legend and scale is only found once they were drawn.
    figure_of(ax).draw_without_rendering()
    return ax


def _sides_m(places_m: FloatArray, most_m: float) -> FloatArray:
    """Return the side of each place's square, shape (n,): the distance in x or y to the nearest other place.

    So no two squares overlap, but where places lie closer than can be seen.
    """
    away_m = np.abs(places_m[:, None] - places_m).max(axis=2)
    np.fill_diagonal(away_m, np.inf)
    return np.asarray(np.clip(away_m.min(axis=1), _LEAST_SIDE * most_m, most_m))


def _clear(shown: DockingMap) -> str:
    return f"clearance of {format_length(shown.clearance_m)}"


def _one(place_m: tuple[float, float] | None) -> FloatArray:
    """Return a place as rows, shape (1, 2), or none, shape (0, 2)."""
    return np.array([] if place_m is None else [place_m], dtype=np.float64).reshape(-1, 2)


def _marked(
    ax: "Axes", places_m: FloatArray, marker: str, size: float, colour: str, label: str
) -> "list[tuple[Artist, str]]":
    """Draw marks with an edge that shows on light and dark, and return them with their words."""
    marks = ax.plot(
        *places_m.T,
        linestyle="none",
        marker=marker,
        markersize=size,
        color=colour,
        markeredgecolor=PAPER,
        markeredgewidth=0.8,
        zorder=7,
    )
    return [(marks[0], label)]
