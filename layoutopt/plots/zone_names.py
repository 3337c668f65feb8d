"""Names of zones on a plan, where they cover least of what stands there and of each other."""

from typing import TYPE_CHECKING, Final

import numpy as np
import shapely

from layoutopt.geometry import Bounds
from layoutopt.identity import FloatArray
from layoutopt.plots.figures import INK, PAPER, SMALL_PT, figure_of
from layoutopt.site import Site, Zone

if TYPE_CHECKING:
    from collections.abc import Sequence

    from matplotlib.axes import Axes
    from shapely.geometry.base import BaseGeometry

_LABEL_STEPS: Final = 61
_NEAREST: Final = 0.5
_FARTHEST: Final = 6.0
"""Distances of a name from a zone beside which it stands, in halves of its height; a line leads over them."""
_PAD: Final = 0.2
"""Paper round a name, in heights of its letters."""
_HEIGHTS_FOR_ALL: Final = 60.0
"""So many of its own heights farther off is as bad for a name as to cover something with the whole of it."""
_HIDDEN_SHARE: Final = 1.0 / 3.0
"""A name that would cover more of its zone, and the tags there, stands beside it."""


def name_zones(ax: "Axes", site: Site, standing: "Sequence[BaseGeometry]") -> None:
    """Write the names of zones in, at or beside them, where they cover least of what stands there.

    Call it last: what a name covers depends on the final size of the plan.
    """
    if not site.zones:
        return
    figure_of(ax).draw_without_rendering()
    taken: BaseGeometry = shapely.union_all(standing)
    regions = [zone.region for zone in site.zones]
    for number, zone in enumerate(site.zones):
        middle = zone.region.representative_point()
        name = ax.text(
            middle.x,
            middle.y,
            _zone_text(zone),
            ha="center",
            va="center",
            fontsize=SMALL_PT,
            color=INK,
            parse_math=False,
            bbox={"boxstyle": f"square,pad={_PAD}", "facecolor": PAPER, "edgecolor": "none", "alpha": 0.7},
            zorder=8,
        )
        # The axes must keep their size, or every name would be where it was not measured.
        name.set_in_layout(False)
        extent = name.get_window_extent().padded(_PAD * SMALL_PT / 72.0 * figure_of(ax).dpi)
        low, high = ax.transData.inverted().transform([(extent.x0, extent.y0), (extent.x1, extent.y1)])
        half_m = (high - low) / 2.0
        places_m = _label_places(zone, half_m, site.bounds_m)
        boxes = shapely.box(*(places_m - half_m).T, *(places_m + half_m).T)
        hidden = shapely.union_all([taken, *regions[:number], *regions[number + 1 :]])
        covered_share = shapely.area(shapely.intersection(boxes, hidden)) / shapely.area(boxes)
        away_m = np.linalg.norm(places_m - (middle.x, middle.y), axis=1)
        badness = covered_share + away_m / (2.0 * half_m[1] * _HEIGHTS_FOR_ALL)
        # Rounded, so that of equally good places the same one is taken on every computer.
        best = int(np.argmin(np.round(badness, 6)))
        name.set_position((float(places_m[best, 0]), float(places_m[best, 1])))
        if not boxes[best].intersects(zone.region):
            ends = shapely.shortest_line(boxes[best], zone.region).coords
            ax.plot(*np.asarray(ends).T, color=INK, linewidth=0.6, scalex=False, scaley=False, zorder=7.5)
        taken = taken.union(boxes[best])


def _label_places(zone: Zone, half_m: FloatArray, bounds_m: Bounds) -> FloatArray:
    """Return where the middle of a zone's name may be, shape (n, 2): well inside first, then in or at it.

    ``half_m`` is half of its width and height; the name stays within the bounds of the floor if it has room. A
    name that would hide much of its zone may only be beside it, if there is room.
    """
    if 4.0 * half_m.prod() > _HIDDEN_SHARE * zone.region.area:
        beside_m = _beside(zone, half_m, bounds_m)
        if len(beside_m):
            return beside_m
    middle = zone.region.representative_point()
    # A quarter of the name still lies in the zone, so that nobody takes it for another's.
    edges_m = np.array(zone.region.bounds)
    low, high = edges_m[:2] - 0.5 * half_m, edges_m[2:] + 0.5 * half_m
    inner_low, inner_high = np.array(bounds_m[:2]) + half_m, np.array(bounds_m[2:]) - half_m
    low = np.where(inner_low <= inner_high, np.clip(low, inner_low, inner_high), low)
    high = np.where(inner_low <= inner_high, np.clip(high, inner_low, inner_high), high)
    x_m, y_m = (np.linspace(low[axis], high[axis], _LABEL_STEPS) for axis in (0, 1))
    grid_m = np.stack(np.meshgrid(x_m, y_m), axis=-1).reshape(-1, 2)
    return np.concatenate([[(middle.x, middle.y)], grid_m])


def _beside(zone: Zone, half_m: FloatArray, bounds_m: Bounds) -> FloatArray:
    """Return places round a zone, shape (n, 2), at which the name touches neither it nor the end of the floor."""
    edges_m, floor_m = np.array(zone.region.bounds), np.array(bounds_m)
    reach_m = half_m + _FARTHEST * half_m[1]
    axes_m = [
        np.linspace(edges_m[axis] - reach_m[axis], edges_m[axis + 2] + reach_m[axis], _LABEL_STEPS)
        for axis in (0, 1)
    ]
    places_m = np.stack(np.meshgrid(*axes_m), axis=-1).reshape(-1, 2)
    boxes = shapely.box(*(places_m - half_m).T, *(places_m + half_m).T)
    apart = shapely.distance(boxes, zone.region) >= _NEAREST * half_m[1]
    free = apart & shapely.covered_by(boxes, shapely.box(*floor_m))
    return np.asarray(places_m[free], dtype=np.float64)


def _zone_text(zone: Zone) -> str:
    lines = [zone.name]
    if zone.target_error_m is not None:
        lines.append(f"target {zone.target_error_m * 1000.0:g} mm")
    if not zone.taggable:
        lines.append(("metal, " if zone.metal else "") + ("on-metal tags only" if zone.tags else "no tags"))
    if not zone.drill:
        lines.append("no drilling")
    return "\n".join(lines)
