"""Tag patterns side by side at one scale: tags, read discs, tiles."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Final

import numpy as np

from layoutopt.geometry import lattice_points
from layoutopt.layout import TagPattern
from layoutopt.patterns.tiles import tile_schedule
from layoutopt.plots.figures import FAINT, INK, SERIES, TEXT_PT, figure_of, panel_axes
from layoutopt.plots.floor_plan import draw_scale_bar

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.figure import Figure

_WIDTH_MM: Final = 170.0
_COLUMNS: Final = 5
_BAR_BELOW_PT: Final = 7.0
_TILES: Final = 3.2
"""Tiles of the largest pattern that a panel shows."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PatternPicture:
    """A periodic pattern with a name and the radius of the discs to draw, m."""

    label: str
    pattern: TagPattern
    radius_m: float


def draw_patterns(pictures: Sequence[PatternPicture], *, axes: "Sequence[Axes] | None" = None) -> "Figure":
    """Draw patterns at one scale, each in a square window.

    Parameters
    ----------
    axes
        Axes to draw into, one for each pattern; by default those of a new figure.

    Raises
    ------
    ValueError
        If there is no pattern, not one axes for each, or one is laid once.
    """
    if not pictures:
        raise ValueError("a figure needs at least one pattern")
    columns = min(_COLUMNS, len(pictures))
    rows = math.ceil(len(pictures) / columns)
    side_m = _TILES * max(
        min(max(tile_schedule(item.pattern).size_m), 1.5 * _scale_m(item.pattern)) for item in pictures
    )
    axes = panel_axes(
        axes, len(pictures), columns=columns, width_mm=_WIDTH_MM, height_mm=_WIDTH_MM / columns * rows * 1.18
    )
    for ax, item in zip(axes, pictures, strict=True):
        _draw(ax, item, side_m)
    return figure_of(axes[0])


def _scale_m(pattern: TagPattern) -> float:
    """Return twice the pitch of the square lattice of a pattern's density: the tile of four tags."""
    return 2.0 / math.sqrt(pattern.density_per_m2)


def _draw(ax: "Axes", item: PatternPicture, side_m: float) -> None:
    from matplotlib.collections import LineCollection, PatchCollection
    from matplotlib.patches import Circle

    reach_m = side_m + item.radius_m
    tags_m = lattice_points(
        item.pattern.points_m, item.pattern.cell_m, (-item.radius_m, -item.radius_m, reach_m, reach_m)
    )
    ax.add_collection(
        PatchCollection(
            [Circle((x, y), item.radius_m) for x, y in tags_m],
            facecolor=SERIES[0],
            edgecolor=SERIES[0],
            alpha=0.22,
            linewidth=0.4,
        )
    )
    ax.scatter(tags_m[:, 0], tags_m[:, 1], s=3.0, color=INK, linewidths=0.0, zorder=3)
    schedule = tile_schedule(item.pattern)
    (width_m, height_m), offsets_m = schedule.size_m, schedule.row_offset_m
    lines = []
    for row in range(math.ceil(side_m / height_m)):
        turns, within = divmod(row, len(offsets_m))
        start_m = (float(offsets_m[within]) + turns * schedule.shift_m) % width_m - width_m
        low, high = row * height_m, min((row + 1) * height_m, side_m)
        lines += [[(0.0, low), (side_m, low)]]
        lines += [[(x, low), (x, high)] for x in np.arange(start_m, side_m, width_m) if x > 0.0]
    ax.add_collection(LineCollection(lines, colors=FAINT, linewidths=0.5, zorder=1))
    ax.set_xlim(0.0, side_m)
    ax.set_ylim(0.0, side_m)
    ax.set_aspect("equal")
    ax.set_xticks([])
    ax.set_yticks([])
    draw_scale_bar(ax, below_pt=_BAR_BELOW_PT)
    ax.set_title(item.label, loc="left", color=INK, fontsize=TEXT_PT)
