"""Where texts lie on the paper, so that overlaps can be avoided and tested."""

import math
from collections.abc import Sequence

import numpy as np

from layoutopt.drawings.lettering import ink_mm, width_mm
from layoutopt.drawings.sheet import Box, Entity, Sheet, Text, extent
from layoutopt.drawings.symbols import Point

_SHARES = {"left": 0.0, "centre": 0.5, "right": 1.0, "middle": 0.5, "top": 0.5}


def base_line(text: Text, scale: int = 1) -> tuple[Point, float]:
    """Return the point of the text's base line that lies at its anchor, and the share of the width before it.

    The point is in the millimetres of the text's view, drawn at 1:``scale``; the share is 0 for a text that
    begins there, 0.5 for a centred one and 1 for one that ends there.
    """
    row, _, column = text.anchor.rpartition("-")
    share = _SHARES[column]
    if text.anchor in ("middle", "top"):
        row = text.anchor
    drop = {"": 0.0, "middle": 0.5, "top": 1.0}[row] * text.height_mm * scale
    angle = math.radians(text.angle_deg)
    return (text.position_mm[0] + drop * math.sin(angle), text.position_mm[1] - drop * math.cos(angle)), share


def text_box(text: Text, scale: int = 1) -> Box:
    """Return the upright box around the ink of ``text``, in paper millimetres from the origin of its view."""
    start, share = base_line(text, scale)
    width = width_mm(text.text, text.height_mm)
    low, high = ink_mm(text.text, text.height_mm)
    corners = np.array([(x, y) for x in (-share * width, (1 - share) * width) for y in (low, high)])
    angle = math.radians(text.angle_deg)
    turn = np.array([[math.cos(angle), math.sin(angle)], [-math.sin(angle), math.cos(angle)]])
    turned = corners @ turn + np.array(start) / scale
    return Box(*(float(value) for value in (*turned.min(axis=0), *turned.max(axis=0))))


def full_extent(entities: Sequence[Entity], scale: int) -> Box:
    """Return the box around geometry and texts of a view drawn at 1:``scale``, in the view's millimetres.

    Raises
    ------
    ValueError
        If there is no geometry.
    """
    boxes = [tuple(scale * edge for edge in text_box(item, scale)) for item in entities if isinstance(item, Text)]
    corners = np.array([extent(entities, scale), *boxes])
    low, high = corners[:, :2].min(axis=0), corners[:, 2:].max(axis=0)
    return Box(float(low[0]), float(low[1]), float(high[0]), float(high[1]))


def text_boxes(sheet: Sheet) -> list[tuple[str, float, float, float, float]]:
    """Return ``(text, xmin, ymin, xmax, ymax)`` in paper millimetres for every text of the sheet.

    The boxes follow from the metrics of the font; a text that is not upright gets the upright box around it.
    """
    boxes = []
    for view in sheet.views:
        ((dx, dy),) = view.on_paper(np.zeros((1, 2))).tolist()
        for entity in view.entities:
            if isinstance(entity, Text):
                xmin, ymin, xmax, ymax = text_box(entity, view.scale)
                boxes.append((entity.text, xmin + dx, ymin + dy, xmax + dx, ymax + dy))
    return boxes + [(entity.text, *text_box(entity)) for entity in sheet.entities if isinstance(entity, Text)]
