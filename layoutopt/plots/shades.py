"""The scale of all maps: the greater, the darker, in even steps of lightness, so that grey shows the same."""

from typing import TYPE_CHECKING, Final

from layoutopt.plots.figures import INK, SMALL_PT, figure_of

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.cm import ScalarMappable
    from matplotlib.colorbar import Colorbar
    from matplotlib.colors import Colormap

SHADES: Final = ("#d3e5f0", "#88bedb", "#4695c3", "#1c6fa2", "#004b78", "#00263f")
"""Lightness L* of CIE 1976 falls from 90 to 14 by about 15 each; the first still differs from paper, of 99.6."""
BEYOND: Final = "#000000"
"""Above the scale, which then ends a shade earlier."""


def shades(*, beyond: bool = False) -> "Colormap":
    """Return the scale; with ``beyond`` what lies above its end is black, and the end is told from that."""
    from matplotlib.colors import LinearSegmentedColormap

    if beyond:
        return LinearSegmentedColormap.from_list("shades", SHADES[:-1]).with_extremes(over=BEYOND)
    return LinearSegmentedColormap.from_list("shades", SHADES)


def scale_beside(ax: "Axes", drawn: "ScalarMappable", label: str) -> "Colorbar":
    """Draw the scale of a map to the right of it, as high as the map, and return it."""
    # A colour bar of the figure's own layout is as high as the room of the map, not as the map.
    bar = figure_of(ax).colorbar(drawn, cax=ax.inset_axes((1.03, 0.0, 0.03, 1.0)))
    bar.ax.tick_params(labelsize=SMALL_PT, colors=INK)
    bar.set_label(label, fontsize=SMALL_PT, color=INK)
    bar.outline.set_linewidth(0.5)
    return bar
