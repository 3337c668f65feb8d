"""Small drawings that several tests read."""

import ezdxf
import numpy as np

MM = 4  # code of $INSUNITS


def new(units=MM, version="R2010"):
    """Return an empty drawing and its model space."""
    drawing = ezdxf.new(version)
    drawing.header["$INSUNITS"] = units
    return drawing, drawing.modelspace()


def lines(space, pairs, layer="WALLS"):
    """Draw a line for each x1, y1, x2, y2."""
    for x1, y1, x2, y2 in pairs:
        space.add_line((x1, y1), (x2, y2), dxfattribs={"layer": layer})


def rectangle(x, y, width, height):
    """Return the four sides of a rectangle as x1, y1, x2, y2."""
    return [
        (x, y, x + width, y),
        (x + width, y, x + width, y + height),
        (x + width, y + height, x, y + height),
        (x, y + height, x, y),
    ]


def as_segments(pairs):
    """Return x1, y1, x2, y2 of each as segments, shape (n, 2, 2)."""
    return np.array(pairs, dtype=np.float64).reshape(-1, 2, 2)


def two_rooms(door=900.0, thick=200.0):
    """Two rooms of 4 m x 3 m beside each other: walls of two lines, a door with jambs between them, mm."""
    low, high = (3000.0 - door) / 2.0, (3000.0 + door) / 2.0
    outer = rectangle(-thick, -thick, 8000.0 + 3.0 * thick, 3000.0 + 2.0 * thick)
    left, right = 4000.0, 4000.0 + thick
    inner = [
        (0.0, 0.0, left, 0.0),
        (left, 0.0, left, low),
        (left, low, right, low),
        (right, low, right, 0.0),
        (right, 0.0, 8000.0 + thick, 0.0),
        (8000.0 + thick, 0.0, 8000.0 + thick, 3000.0),
        (8000.0 + thick, 3000.0, right, 3000.0),
        (right, 3000.0, right, high),
        (right, high, left, high),
        (left, high, left, 3000.0),
        (left, 3000.0, 0.0, 3000.0),
        (0.0, 3000.0, 0.0, 0.0),
    ]
    return outer + inner
