"""A plan as it was read: floor, rooms with their areas, obstacles, zones, and where the robot can drive."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Final

import shapely
from shapely.geometry import Polygon
from shapely.geometry.base import BaseGeometry

from layoutopt.plots.figures import INK, PAPER, SERIES, SMALL_PT, legend_above
from layoutopt.plots.floor_plan import draw_floor, frame_site, plan_axes, region_path
from layoutopt.site import Site

if TYPE_CHECKING:
    from matplotlib.axes import Axes

_MOST_NAMED: Final = 60  # more names than this would hide the plan


def draw_floor_rooms(
    *, site: Site, rooms: Sequence[Polygon], reachable: BaseGeometry, ax: "Axes | None" = None
) -> "Axes":
    """Draw a site to scale with its rooms numbered and return the axes.

    Parameters
    ----------
    rooms
        Largest first; the first 60 are named by number and area.
    reachable
        Where the robot's centre can be, drawn filled.
    """
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch, PathPatch

    ax = plan_axes(site, ax)
    if not reachable.is_empty:
        ax.add_patch(
            PathPatch(region_path(reachable), facecolor=SERIES[5], edgecolor="none", alpha=0.35, zorder=0.5)
        )
    draw_floor(ax, site)
    for number, room in enumerate(rooms, 1):
        ax.add_patch(
            PathPatch(
                region_path(room), facecolor="none", edgecolor=SERIES[0], linestyle=(0, (2, 1.5)), linewidth=0.9,
                zorder=4.5,
            )
        )  # fmt: skip
        if number <= _MOST_NAMED:
            # The middle of the widest place, so that the name fits in if anything does.
            x_m, y_m = shapely.maximum_inscribed_circle(room, tolerance=0.05).coords[0]
            ax.text(
                x_m, y_m, f"{number}\n{room.area:.1f} m²", ha="center", va="center", fontsize=SMALL_PT, color=INK,
                bbox={"boxstyle": "square,pad=0.15", "facecolor": PAPER, "edgecolor": "none", "alpha": 0.8},
                zorder=9,
            )  # fmt: skip
    frame_site(ax, site)
    entries = [
        (
            Patch(facecolor=SERIES[5], alpha=0.35, linewidth=0),
            f"where the robot's centre can drive ({reachable.area:.1f} m²)",
        ),
        (Line2D([], [], color=SERIES[0], linestyle=(0, (2, 1.5)), linewidth=0.9), f"rooms ({len(rooms)})"),
    ]
    legend_above(ax, entries, columns=2)
    return ax
