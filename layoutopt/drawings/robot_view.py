"""The antennas below and on top of a robot, drawn in ``base_link`` as seen from above."""

from dataclasses import dataclass
from typing import Final, Literal

import numpy as np

from layoutopt.drawings.dimensions import running_dimensions
from layoutopt.drawings.layers import PENS, Layer
from layoutopt.drawings.lettering import width_mm
from layoutopt.drawings.sheet import Anchor, Box, Circle, Entity, Line, Marks, Polyline, Text
from layoutopt.drawings.text_boxes import full_extent, text_box
from layoutopt.geometry import turned
from layoutopt.identity import FloatArray
from layoutopt.layout import Layout, ReaderGroup
from layoutopt.robot import Robot
from layoutopt.tables.readers import AntennaRow, antenna_rows

Level = Literal["both", "below", "top"]
"""Antennas that a drawing shows: on a drawing of both, those on top of the robot have a layer of their own."""

TABLE_BLOCK_MM: Final = 78.0
"""Width of one block of the antenna table."""

_TABLE_ROW_MM: Final = 4.1
_CELL_MM: Final = 2.5
_LINE_OFFSET_MM: Final = 7.0
_NUMBER_MM: Final = (3.5, 2.5, 1.8)
_SQUARE: Final = np.array([(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)])
_ARROW: Final = np.array([(0.0, 0.0), (0.72, 0.0), (0.72, -0.11), (1.0, 0.0), (0.72, 0.11)])
"""Shaft and head of the arrow of a UHF antenna, in sides of its housing."""
_PANEL: Final = np.array([(0.0, -0.5), (0.0, 0.5)])
"""Its housing from above, edge-on."""
_BY_ARROW: Final = np.array([(0.86, 0.22), (0.86, -0.22), (1.14, 0.0), (1.3, 0.0)])
"""Where the number of a UHF antenna may stand, from its middle along its arrow and to the left of it, in sides."""
_ROUND_RING_DEG: Final = (180.0, 135.0, 225.0, 157.5, 202.5, 90.0, 270.0)
_BESIDE_SHARE: Final = 0.62
"""Where the number of a ring may stand: at these turns from its yaw, so far from its middle, in its diameters."""
_NUMBER_SHARE: Final = 0.27  # of the side: number above the centre, which its cross keeps free
_COLUMNS: Final[tuple[tuple[str, float], ...]] = (
    ("No.", 6.0),
    ("x", 19.0),
    ("y", 32.0),
    ("z", 41.0),
    ("yaw °", 52.2),
    ("module", 66.8),
    ("slot", 75.5),
)


@dataclass(frozen=True, slots=True, kw_only=True)
class RobotView:
    """What is drawn of a robot at one scale, and the box around it in ``base_link``."""

    entities: tuple[Entity, ...]
    box_mm: Box


def groups_shown(layout: Layout, level: Level) -> list[tuple[int, ReaderGroup]]:
    """Return the reader groups of a level, each with the number of its first antenna."""
    first = 0
    shown: list[tuple[int, ReaderGroup]] = []
    for group in layout.readers:
        if level == "both" or (level == "below") == (group.kind == "tag_read"):
            shown.append((first, group))
        first += group.count
    return shown


def sides(layout: Layout) -> tuple[Level, ...]:
    """Return the sides of the robot that carry antennas, the underside first."""
    levels: tuple[Level, ...] = ("below", "top")
    return tuple(level for level in levels if groups_shown(layout, level))


def robot_view(*, layout: Layout, robot: Robot, scale: int, level: Level = "both") -> RobotView:
    """Return chassis, antennas, read discs and dimensions from ``base_link`` for a scale of 1:``scale``."""
    outline_mm = robot.outline_m * 1000.0
    chassis, *antennas = robot_shapes(layout, robot, level)
    numbers = antenna_numbers(layout, scale, level)
    shown = full_extent([chassis, *antennas], scale)
    places_mm = np.concatenate([group.poses[:, :2] for _, group in groups_shown(layout, level)]) * 1000.0
    offset_mm = _LINE_OFFSET_MM * scale
    entities: tuple[Entity, ...] = (
        chassis,
        *antennas,
        *numbers,
        *running_dimensions(
            places_mm[:, 0], datum_mm=0.0, axis="x", line_mm=shown.ymin - offset_mm, scale=scale,
            witness_mm=shown.ymin,
        ),
        *running_dimensions(
            places_mm[:, 1], datum_mm=0.0, axis="y", line_mm=shown.xmin - offset_mm, scale=scale,
            witness_mm=shown.xmin,
        ),
        *running_dimensions(
            (outline_mm[:, 0].min(), outline_mm[:, 0].max()), datum_mm=0.0, axis="x",
            line_mm=shown.ymax + offset_mm, scale=scale, side=1,
        ),
        *running_dimensions(
            (outline_mm[:, 1].min(), outline_mm[:, 1].max()), datum_mm=0.0, axis="y",
            line_mm=shown.xmax + offset_mm, scale=scale, side=1,
        ),
        *_forward(shown.xmax, scale),
        Marks(
            layer="A-DATUM", points_mm=np.zeros((1, 2)), symbol="datum", size_mm=6.0 * scale, kind="base_link"
        ),
    )  # fmt: skip
    if not numbers:
        below = full_extent(entities, scale)
        missing = Text(
            layer="A-READERS",
            text="Antennas too close to be numbered here: see readers.yaml",
            position_mm=((below.xmin + below.xmax) / 2.0, below.ymin - 2.0 * scale),
            height_mm=2.5,
            anchor="top",
        )
        entities = (*entities, missing)
    return RobotView(entities=entities, box_mm=full_extent(entities, scale))


def robot_shapes(layout: Layout, robot: Robot, level: Level = "both") -> list[Entity]:
    """Return the outline of the chassis, then the antennas of a level.

    Floor antennas are squares with their centres and read discs, UHF antennas arrows, crossed antennas rings.
    """
    shapes: list[Entity] = [Polyline(layer="A-ROBOT", points_mm=robot.outline_m * 1000.0, closed=True)]
    for first, group in groups_shown(layout, level):
        shapes += _group(group, first) if group.kind == "tag_read" else _on_top(group, _layer(group, level))
    return shapes


def _layer(group: ReaderGroup, level: Level) -> Layer:
    return "A-READERS-TOP" if level == "both" and group.kind != "tag_read" else "A-READERS"


def _group(group: ReaderGroup, first: int) -> list[Entity]:
    """Return the squares of a group with a tick on their own x axis, centres as marks, and read discs."""
    side_mm = group.antenna.side_m * 1000.0
    entities: list[Entity] = []
    for x_m, y_m, z_m, yaw_rad in group.poses.tolist():
        centre_mm = np.array([x_m, y_m]) * 1000.0
        entities.append(
            Polyline(layer="A-READERS", points_mm=turned(_SQUARE * side_mm, yaw_rad) + centre_mm, closed=True)
        )
        tick = turned(np.array([(0.36, 0.0), (0.5, 0.0)]) * side_mm, yaw_rad) + centre_mm
        entities.append(
            Line(layer="A-READERS", start_mm=(tick[0, 0], tick[0, 1]), end_mm=(tick[1, 0], tick[1, 1]))
        )
        radius_mm = 1000.0 * group.antenna.read_radius_m(z_m)
        if radius_mm > 0.0:
            entities.append(
                Circle(layer="A-READ-DISC", centre_mm=(centre_mm[0], centre_mm[1]), radius_mm=radius_mm)
            )
    entities.append(
        Marks(
            layer="A-READERS",
            points_mm=group.poses[:, :2] * 1000.0,
            symbol="cross",
            size_mm=0.2 * side_mm,
            kind="antenna",
            ids=tuple(str(first + number) for number in range(group.count)),
        )
    )
    return entities


def _on_top(group: ReaderGroup, layer: Layer) -> list[Entity]:
    """Return what is on top of a robot: UHF antennas edge-on with an arrow along their yaw, or a ring."""
    side_mm = group.antenna.side_m * 1000.0
    entities: list[Entity] = []
    for x_m, y_m, _, yaw_rad in group.poses.tolist():
        centre_mm = np.array([x_m, y_m]) * 1000.0
        if group.kind == "direction":
            ring = Circle(layer=layer, centre_mm=(centre_mm[0], centre_mm[1]), radius_mm=side_mm / 2.0)
            entities.append(ring)
            continue
        arrow = turned(_ARROW * side_mm, yaw_rad) + centre_mm
        panel = turned(_PANEL * side_mm, yaw_rad) + centre_mm
        for start, end in ((arrow[0], arrow[1]), panel):
            entities.append(Line(layer=layer, start_mm=(start[0], start[1]), end_mm=(end[0], end[1])))
        entities.append(Polyline(layer=layer, points_mm=arrow[2:], closed=True, fill=PENS[layer].colour))
    return entities


def _number_places_mm(group: ReaderGroup, above_mm: float) -> FloatArray:
    """Return where each number of a group may stand, the best place first, shape (antennas, places, 2).

    That is above the centre of a square, beside or ahead of an arrow, and behind a ring or farther round it.
    """
    side_mm, centres_mm = group.antenna.side_m * 1000.0, group.poses[:, None, :2] * 1000.0
    if group.kind == "tag_read":
        return np.asarray(centres_mm + np.array([0.0, above_mm]))
    if group.kind == "signal":
        turns_rad, away_mm = np.arctan2(*_BY_ARROW.T[::-1]), side_mm * np.hypot(*_BY_ARROW.T)
    else:
        turns_rad, away_mm = np.radians(_ROUND_RING_DEG), np.full(len(_ROUND_RING_DEG), _BESIDE_SHARE * side_mm)
    angles_rad = group.poses[:, 3:] + turns_rad
    return np.asarray(centres_mm + away_mm[:, None] * np.stack([np.cos(angles_rad), np.sin(angles_rad)], axis=-1))


def antenna_numbers(layout: Layout, scale: int, level: Level = "both") -> list[Text]:
    """Return the number of each antenna of a level: above its centre where the square is large enough, else on it.

    UHF antennas have theirs by their arrows, crossed antennas beside their ring, off the squares of others.
    There is none at all if the numbers would touch each other.
    """
    shown = groups_shown(layout, level)
    squares = [group for _, group in shown if group.kind == "tag_read"]
    widest = str(sum(group.count for group in layout.readers) - 1)
    sides_m = [group.antenna.side_m for group in squares or [group for _, group in shown]]
    side_mm = min(sides_m) * 1000.0 / scale
    fitting = [
        height for height in _NUMBER_MM if height <= 0.34 * side_mm and width_mm(widest, height) <= 0.8 * side_mm
    ]
    height_mm = fitting[0] if fitting else _NUMBER_MM[-1]
    texts: dict[int, Text] = {}
    taken = [
        Box(
            *(
                (place_mm + sign * 500.0 * group.antenna.side_m) / scale
                for sign in (-1.0, 1.0)
                for place_mm in pose
            )
        )
        for group in squares
        for pose in (1000.0 * group.poses[:, :2]).tolist()
    ]
    wanted: list[tuple[bool, int, Layer, FloatArray]] = []
    for first, group in shown:
        above_mm = _NUMBER_SHARE * group.antenna.side_m * 1000.0 if fitting else 0.0
        for number, places_mm in enumerate(_number_places_mm(group, above_mm), start=first):
            wanted.append((group.kind != "tag_read", number, _layer(group, level), places_mm))
    # Those on top give way to those below.
    for yields, number, layer, places_mm in sorted(wanted, key=lambda entry: entry[:2]):
        choices = [
            Text(
                layer=layer,
                text=str(number),
                position_mm=(x_mm, y_mm),
                height_mm=height_mm,
                anchor="middle",
            )
            for x_mm, y_mm in places_mm.tolist()
        ]
        free = (text for text in choices if not any(text_box(text, scale).overlaps(box) for box in taken))
        texts[number] = next(free, choices[0]) if yields else choices[0]
        taken.append(text_box(texts[number], scale))
    boxes = [text_box(text, scale) for text in texts.values()]
    touching = any(box.overlaps(other) for place, box in enumerate(boxes) for other in boxes[:place])
    return [] if touching else [texts[number] for number in sorted(texts)]


def _forward(front_mm: float, scale: int) -> list[Entity]:
    """Return an arrow ahead of the chassis."""
    start, neck, tip = (front_mm + step * scale for step in (1.0, 2.6, 5.4))
    head = [(neck, -1.2 * scale), (tip, 0.0), (neck, 1.2 * scale)]
    return [
        Line(layer="A-ROBOT", start_mm=(start, 0.0), end_mm=(neck, 0.0)),
        Polyline(layer="A-ROBOT", points_mm=np.array(head), closed=True, fill="#000000"),
    ]


def table_height_mm(count: int, blocks: int) -> float:
    """Return the height of `antenna_table` for that many antennas."""
    return (-(-count // blocks) + 2) * _TABLE_ROW_MM


def antenna_table(
    layout: Layout, at_mm: tuple[float, float], blocks: int, level: Level = "both"
) -> tuple[Entity, ...]:
    """Return the table of antennas, upper left corner at ``at_mm`` on the paper, in blocks side by side."""
    numbers = {
        number for first, group in groups_shown(layout, level) for number in range(first, first + group.count)
    }
    rows = [row for row in antenna_rows(layout) if row.antenna in numbers]
    deep = -(-len(rows) // blocks)
    entities: list[Entity] = []
    for block in range(-(-len(rows) // deep)):
        left, top = at_mm[0] + block * TABLE_BLOCK_MM, at_mm[1]
        entities += [_cell(name, left + right, top, "right") for name, right in _COLUMNS]
        entities.append(
            Line(
                layer="A-TITLE",
                start_mm=(left, top - _TABLE_ROW_MM),
                end_mm=(left + _COLUMNS[-1][1], top - _TABLE_ROW_MM),
            )
        )
        for number, row in enumerate(rows[block * deep : (block + 1) * deep], start=1):
            for word, (_, right) in zip(_words(row), _COLUMNS, strict=True):
                entities.append(_cell(word, left + right, top - number * _TABLE_ROW_MM, "right"))
    return tuple(entities)


def _cell(word: str, x: float, top: float, anchor: Anchor) -> Text:
    place = (x, top - _TABLE_ROW_MM + 1.0)
    return Text(layer="A-TITLE", text=word, position_mm=place, height_mm=_CELL_MM, anchor=anchor)


def _words(row: AntennaRow) -> tuple[str, ...]:
    millimetres = (f"{round(length * 1000.0, 1) + 0.0:g}" for length in (row.x_m, row.y_m, row.z_m))
    yaw = f"{round(float(np.rad2deg(row.yaw_rad)), 1) + 0.0:g}"
    return (str(row.antenna), *millimetres, yaw, str(row.module), str(row.slot))
