"""Layers and their pens: what is drawn how (ISO 128 line widths and types).

A layer alone decides width, dash pattern and colour, so that PDF, SVG and DXF cannot differ. All lengths are
millimetres on paper.
"""

from dataclasses import dataclass
from typing import Literal, get_args

Layer = Literal[
    "A-FILL",
    "A-OUTLINE",
    "A-OBSTACLE",
    "A-NOTAG",
    "A-ZONE",
    "A-TILES",
    "A-TAGS",
    "A-TAGS-ID",
    "A-READERS",
    "A-READERS-TOP",
    "A-READ-DISC",
    "A-ROBOT",
    "A-DATUM",
    "A-GRID",
    "A-DIMS",
    "A-TITLE",
    "A-FRAME",
]

DASHED = (3.0, 1.5)  # ISO 128 type 02: 12 and 3 pen widths, gaps widened so that copies keep them apart
FINE_DASHED = (1.5, 0.8)  # the same for outlines of a few millimetres
LONG_DASH_DOT = (6.0, 1.5, 0.5, 1.5)  # type 04: grid and centre lines
LONG_DASH_DOUBLE_DOT = (6.0, 1.5, 0.5, 1.5, 0.5, 1.5)  # type 05: zones, which no wall bounds
FINE_DOUBLE_DOT = (3.0, 0.8, 0.4, 0.8, 0.4, 0.8)  # type 05: what lies before the plane that is shown


@dataclass(frozen=True, slots=True, kw_only=True)
class Pen:
    """How the lines and texts of one layer look.

    Attributes
    ----------
    width_mm
        Line width on paper.
    colour
        ``#rrggbb``; every colour is dark enough to survive a black and white copy.
    dash_mm
        Alternating lengths of dash and gap on paper; empty for a continuous line.
    """

    width_mm: float
    colour: str
    dash_mm: tuple[float, ...] = ()


# In drawing order: a later layer covers an earlier one.
PENS: dict[Layer, Pen] = {
    "A-FILL": Pen(width_mm=0.05, colour="#dcdcdc"),
    "A-TILES": Pen(width_mm=0.13, colour="#9a9a9a"),
    "A-ZONE": Pen(width_mm=0.25, colour="#1f4e9c", dash_mm=LONG_DASH_DOUBLE_DOT),
    "A-NOTAG": Pen(width_mm=0.25, colour="#a02020", dash_mm=DASHED),
    "A-GRID": Pen(width_mm=0.18, colour="#8c8c8c", dash_mm=LONG_DASH_DOT),
    "A-OBSTACLE": Pen(width_mm=0.35, colour="#000000"),
    "A-OUTLINE": Pen(width_mm=0.5, colour="#000000"),
    "A-DIMS": Pen(width_mm=0.25, colour="#000000"),
    "A-ROBOT": Pen(width_mm=0.5, colour="#000000"),
    "A-READ-DISC": Pen(width_mm=0.18, colour="#a02020", dash_mm=FINE_DASHED),
    "A-READERS": Pen(width_mm=0.35, colour="#1f4e9c"),
    "A-READERS-TOP": Pen(width_mm=0.25, colour="#6a3d9a", dash_mm=FINE_DOUBLE_DOT),
    "A-TAGS": Pen(width_mm=0.25, colour="#000000"),
    "A-TAGS-ID": Pen(width_mm=0.18, colour="#404040"),
    "A-DATUM": Pen(width_mm=0.5, colour="#a02020"),
    "A-TITLE": Pen(width_mm=0.25, colour="#000000"),
    "A-FRAME": Pen(width_mm=0.7, colour="#000000"),
}


def known_layer(name: str) -> None:
    """Refuse a layer that has no pen.

    Raises
    ------
    ValueError
        If ``name`` is not one of the layers.
    """
    if name not in PENS:
        raise ValueError(f"no layer {name!r}; the layers are {', '.join(get_args(Layer))}")
