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


def building(widths_m, depths_m, wall_m=0.2, door_m=0.9):
    """Return the lines of a building of rooms in a grid, each joined to its neighbours by doors with jambs.

    Walls are drawn by two lines. Lines have shape (n, 2, 2), m; the lower left corner of the first room is (0, 0).
    """
    x = np.concatenate([[0.0], np.cumsum(np.add(widths_m, wall_m))])
    y = np.concatenate([[0.0], np.cumsum(np.add(depths_m, wall_m))])
    found = rectangle(-wall_m, -wall_m, x[-1] + wall_m, y[-1] + wall_m)
    for column, width in enumerate(widths_m):
        for row, depth in enumerate(depths_m):
            for along_x in (True, False):
                # The two walls of a room along one axis; in the other direction the room is as deep as it is.
                length, offset, start = (width, y[row], x[column]) if along_x else (depth, x[column], y[row])
                number, count = (row, len(depths_m)) if along_x else (column, len(widths_m))
                far = offset + (depth if along_x else width)
                for place, neighbour, step in ((offset, number > 0, -wall_m), (far, number < count - 1, wall_m)):
                    low, high = start + (length - door_m) / 2.0, start + (length + door_m) / 2.0
                    pieces = [(start, place, start + length, place)]
                    if neighbour:
                        pieces = [(start, place, low, place), (high, place, start + length, place)]
                        if step > 0.0:
                            pieces += [(end, place, end, place + step) for end in (low, high)]
                    found += pieces if along_x else [(y1, x1, y2, x2) for x1, y1, x2, y2 in pieces]
    return as_segments(found)


def shuffled(segments_m, draws, angle_rad):
    """Return lines turned, cut at random places, in random order and direction, some of them drawn twice."""
    cos, sin = np.cos(angle_rad), np.sin(angle_rad)
    turned = segments_m @ np.array([[cos, sin], [-sin, cos]])
    cut = turned[:, 0] + draws.uniform(0.1, 0.9, (len(turned), 1)) * (turned[:, 1] - turned[:, 0])
    pieces = np.concatenate([np.stack([turned[:, 0], cut], axis=1), np.stack([cut, turned[:, 1]], axis=1)])
    pieces = np.concatenate([pieces, turned[draws.random(len(turned)) < 0.1]])
    backwards = draws.random(len(pieces)) < 0.5
    pieces[backwards] = pieces[backwards, ::-1]
    return draws.permutation(pieces)
