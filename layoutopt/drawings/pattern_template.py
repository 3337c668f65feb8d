"""What a placing template at 1:1 shows: the tags of a pattern, or the underside of the robot."""

from dataclasses import replace
from typing import Final

import numpy as np

from layoutopt.drawings.robot_view import antenna_numbers, robot_shapes
from layoutopt.drawings.sheet import Entity, Line, Marks, Polyline
from layoutopt.geometry import turned
from layoutopt.identity import FloatArray
from layoutopt.layout import FloorTags, Layout, TagPattern
from layoutopt.robot import Robot

_ROUNDING_MM: Final = 1e-6


def pattern_template(
    pattern: TagPattern, floor_tags: FloorTags, *, angle_rad: float, page_mm: tuple[float, float]
) -> list[Entity]:
    """Return tags at true size in the frame of the pattern, with its axes and its two periods from one tag.

    The part that is shown holds a whole period; where that is smaller than a page, of which ``page_mm`` is what
    fits on it, as many as fill one. The lower left tag of it is the one from which the periods start. The pattern
    lies on the floor turned by ``angle_rad``, the tags do not.
    """
    width_mm, height_mm = (1000.0 * side_m for side_m in floor_tags.tag_size_m)
    # The axes reach beyond the outermost tags by the longer side of a tag.
    points_mm, corner_mm = _shown(pattern, np.maximum(np.array(page_mm) - 2.0 * max(width_mm, height_mm), 0.0))
    half = np.array(
        [(-width_mm, -height_mm), (width_mm, -height_mm), (width_mm, height_mm), (-width_mm, height_mm)]
    )
    entities: list[Entity] = [
        Polyline(layer="A-TAGS", points_mm=point + turned(half / 2.0, -angle_rad), closed=True)
        for point in points_mm
    ]
    entities.append(Marks(layer="A-TAGS", points_mm=points_mm, symbol="cross", size_mm=max(width_mm, height_mm)))
    if pattern.cell_m is not None:
        for period in pattern.cell_m * 1000.0:
            end = (float(corner_mm[0] + period[0]), float(corner_mm[1] + period[1]))
            start = (float(corner_mm[0]), float(corner_mm[1]))
            entities.append(Line(layer="A-GRID", start_mm=start, end_mm=end))
    low, high = points_mm.min(axis=0), points_mm.max(axis=0)
    reach = max(width_mm, height_mm)
    # Lines through the first tag along the axes of the pattern, by which the template is laid along chalk lines.
    for start, end in (
        ((low[0] - reach, corner_mm[1]), (high[0] + reach, corner_mm[1])),
        ((corner_mm[0], low[1] - reach), (corner_mm[0], high[1] + reach)),
    ):
        entities.append(
            Line(
                layer="A-DATUM", start_mm=(float(start[0]), float(start[1])), end_mm=(float(end[0]), float(end[1]))
            )
        )
    return entities


def robot_template(layout: Layout, robot: Robot) -> list[Entity]:
    """Return chassis, antennas with their centres, numbers, and the axes of ``base_link``, at true size.

    All is seen from below, x to the right and y down, as it is held against the underside of the robot. What is on
    top of the robot is left out.
    """
    layout, robot = _from_below(layout, robot)
    low, high = robot.outline_m.min(axis=0) * 1000.0, robot.outline_m.max(axis=0) * 1000.0
    axes = (
        Line(layer="A-DATUM", start_mm=(float(low[0]), 0.0), end_mm=(float(high[0]), 0.0)),
        Line(layer="A-DATUM", start_mm=(0.0, float(low[1])), end_mm=(0.0, float(high[1]))),
    )
    return [*robot_shapes(layout, robot, "below"), *antenna_numbers(layout, 1, "below"), *axes]


def _from_below(layout: Layout, robot: Robot) -> tuple[Layout, Robot]:
    """Return antennas and chassis mirrored at the x axis of ``base_link``."""
    flip = np.array([1.0, -1.0])
    readers = tuple(
        replace(group, poses=group.poses * np.array([1.0, -1.0, 1.0, -1.0])) for group in layout.readers
    )
    return layout.replace(readers=readers), replace(robot, outline_m=robot.outline_m[::-1] * flip)


def _shown(pattern: TagPattern, page_mm: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the tags that are shown and the one from which the periods start, in millimetres."""
    if pattern.cell_m is None:
        points_mm = pattern.points_m * 1000.0
    else:
        corners = np.array([(0, 0), (1, 0), (0, 1), (1, 1)]) @ pattern.cell_m * 1000.0
        corner = pattern.points_m[np.lexsort((pattern.points_m[:, 0], pattern.points_m[:, 1]))[0]] * 1000.0
        size = np.maximum(np.ptp(corners, axis=0), page_mm)
        low = corner + np.minimum(corners.min(axis=0), 0.0) - _ROUNDING_MM
        bounds = (*(low / 1000.0).tolist(), *((low + size) / 1000.0 + 2e-9).tolist())
        points_mm = pattern.points_in(bounds) * 1000.0
    first = np.lexsort((np.round(points_mm[:, 0], 6), np.round(points_mm[:, 1], 6)))[0]
    return points_mm, points_mm[first]
