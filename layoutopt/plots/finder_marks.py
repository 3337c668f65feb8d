"""What finds things off the floor, on plans: beams of UHF antennas, the ring of crossed antennas, transponders."""

import math
from typing import TYPE_CHECKING, Final

from layoutopt.identity import FloatArray
from layoutopt.layout import Layout, ReaderGroup
from layoutopt.plots.figures import INK, PAPER, SERIES, SMALL_PT
from layoutopt.robot import Robot

if TYPE_CHECKING:
    from matplotlib.artist import Artist
    from matplotlib.axes import Axes

_SECTOR_RADII: Final = 2.5
"""Length of a beam on a plan, in radii of the robot: it shows where the antenna looks, not how far."""
_SHARE_OF_CHASSIS: Final = 0.9
BEAM: Final = SERIES[2]
DOCK: Final = SERIES[3]
"""Colours of UHF antennas and of what docking takes, in every picture."""


def beam_of(group: ReaderGroup) -> float:
    """Return how wide the beam of a UHF antenna is drawn, rad: half the horizon if its model states none."""
    from layoutopt.antennas.uhf_patch import UhfPatch

    return group.antenna.beam_rad if isinstance(group.antenna, UhfPatch) else math.pi


def sector_radius_m(robot: Robot) -> float:
    """Return how long a beam is in a picture of the robot itself, m: it ends within the chassis."""
    return _SHARE_OF_CHASSIS * robot.inner_radius_m


def draw_on_top(ax: "Axes", layout: Layout, robot: Robot, centre: FloatArray, *, detailed: bool) -> None:
    """Draw a sector as wide as the beam of each UHF antenna, and the ring of crossed antennas.

    The robot stands at ``centre``, shape (2,), m, and looks along x.
    """
    from matplotlib.patches import Circle, Wedge

    radius_m = sector_radius_m(robot) if detailed else _SECTOR_RADII * robot.radius_m
    for group in layout.readers_of("signal"):
        half_deg = math.degrees(beam_of(group)) / 2.0
        for x_m, y_m, _, yaw_rad in group.poses.tolist():
            yaw_deg = math.degrees(yaw_rad)
            sector = Wedge(
                (centre[0] + x_m, centre[1] + y_m),
                radius_m,
                yaw_deg - half_deg,
                yaw_deg + half_deg,
                facecolor=BEAM,
                edgecolor=BEAM,
                linewidth=0.9,
                alpha=0.25,
                zorder=6.5,
            )
            ax.add_patch(sector)
    for group in layout.readers_of("direction"):
        for x_m, y_m in group.poses[:, :2].tolist():
            ring = Circle(
                (centre[0] + x_m, centre[1] + y_m),
                group.antenna.side_m / 2.0,
                facecolor="none",
                edgecolor=DOCK,
                linewidth=1.2 if detailed else 0.6,
                zorder=7,
            )
            ax.add_patch(ring)


def draw_transponders(ax: "Axes", layout: Layout) -> None:
    """Draw each transponder with its name."""
    for transponder in layout.transponders:
        x_m, y_m, _ = transponder.position_m
        ax.plot(
            [x_m], [y_m], linestyle="none", marker="D", markersize=5.0, color=DOCK, markeredgecolor=INK, zorder=9
        )
        ax.annotate(
            transponder.name,
            (x_m, y_m),
            xytext=(0.0, 6.0),
            textcoords="offset points",
            ha="center",
            fontsize=SMALL_PT,
            color=INK,
            bbox={"facecolor": PAPER, "edgecolor": "none", "pad": 0.8, "alpha": 0.85},
            zorder=9,
        )


def finder_entries(layout: Layout) -> "list[tuple[Artist, str]]":
    """Return the entries of a legend for what a layout has of these."""
    from matplotlib.lines import Line2D
    from matplotlib.patches import Patch

    entries: list[tuple[Artist, str]] = []
    if layout.readers_of("signal"):
        entries.append((Patch(facecolor=BEAM, edgecolor=BEAM, alpha=0.35), "UHF beam"))
    if layout.readers_of("direction"):
        ring = Line2D(
            [], [], linestyle="none", marker="o", markersize=6.0, markerfacecolor="none", markeredgecolor=DOCK
        )
        entries.append((ring, "for docking"))
    if layout.transponders:
        mark = Line2D([], [], linestyle="none", marker="D", markersize=5.0, color=DOCK, markeredgecolor=INK)
        entries.append((mark, "transponder"))
    return entries
