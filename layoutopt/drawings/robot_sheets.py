"""Sheets of the robot: its sides with dimensions and a table of antennas, and how these are wired."""

from collections import Counter
from dataclasses import replace
from typing import Final

from layoutopt.drawings.arrangement import place_robot
from layoutopt.drawings.frame import TitleBlock, frame_entities, notes, title_block_entities
from layoutopt.drawings.robot_view import Level, antenna_table, groups_shown, robot_view, sides
from layoutopt.drawings.sheet import Entity, PaperName, Sheet, drawing_room, place_view
from layoutopt.drawings.text_space import view_title
from layoutopt.errors import InvalidInput
from layoutopt.layout import Layout
from layoutopt.robot import Robot
from layoutopt.tables.readers import AntennaRow, antenna_rows

_AXES: Final = ("x", "y", "x forward, y left", "seen from above")
_FIRST_NUMBER: Final = 101
_SIDES: Final[dict[Level, tuple[str, tuple[str, ...]]]] = {
    "below": (
        "Robot underside",
        ("Seen from above through the chassis; seen from below, left and right change places.",),
    ),
    "top": (
        "Robot top",
        ("A UHF antenna is a line, its housing edge-on, with an arrow where it looks.",
         "A ring is the crossed antennas for docking, which turn."),
    ),
}  # fmt: skip
"""Name of the sheet of a side, and what it says of its drawing."""
_DIMENSIONS: Final = "Dimensions in mm from base_link; z is the height above the floor."
_COUNTED: Final = "Antennas, modules and slots are counted from 0, as in readers.yaml."
_MODULES: Final = {"tag_read": "HF reader", "signal": "UHF reader", "direction": "docking receiver"}


def robot_sheets(layout: Layout, robot: Robot, *, paper: PaperName, block: TitleBlock) -> tuple[Sheet, ...]:
    """Return underside and top of the robot, as far as they carry antennas, as large as the paper allows.

    All antennas are dimensioned. Sheets are numbered from R-101.

    Raises
    ------
    InvalidInput
        If the robot fits the paper at no scale.
    """
    return tuple(
        _sheet(layout, robot, level, paper, replace(block, sheet_number=f"R-{number}"))
        for number, level in enumerate(sides(layout), start=_FIRST_NUMBER)
    )


def _sheet(layout: Layout, robot: Robot, level: Level, paper: PaperName, block: TitleBlock) -> Sheet:
    room = drawing_room(paper, 10.0)
    name, told = _SIDES[level]
    count = sum(group.count for _, group in groups_shown(layout, level))
    place = place_robot(
        lambda scale: robot_view(layout=layout, robot=robot, scale=scale, level=level), count, room
    )
    if place is None:
        raise InvalidInput.at(
            "robot", f"it fits no sheet of {paper} at any scale", "Check the unit of its outline."
        )
    shown = robot_view(layout=layout, robot=robot, scale=place.scale, level=level)
    view = place_view(name, shown.entities, scale=place.scale, room_mm=place.room, extent_mm=shown.box_mm)
    block = replace(block, title=f"{name}: {block.title}", scale=f"1:{place.scale}")
    entities: list[Entity] = [
        *frame_entities(paper),
        *title_block_entities(block, paper),
        *view_title(1, name, place.scale, (room.xmin, room.ymax), _AXES, bar_mm=60.0),
        *notes((room.xmin, room.ymin - 14.0), (_DIMENSIONS, *told, _COUNTED), room.width - 190.0),
    ]
    if place.table_at_mm is not None:
        entities += antenna_table(layout, place.table_at_mm, place.blocks, level)
    return Sheet(
        title=block.title, paper=paper, views=(view,), entities=tuple(entities), number=block.sheet_number
    )


def wiring_rows(layout: Layout) -> list[list[str]]:
    """Return a row for each antenna, by module and port.

    It holds module, what the module is, port, antenna, where that is, side, place, and name of the link.
    """
    rows = sorted(antenna_rows(layout), key=lambda row: (row.module, row.slot, row.antenna))
    ports = Counter(row.module for row in rows)
    return [
        [
            str(row.module),
            _module_text(row, ports[row.module]),
            str(row.slot),
            str(row.antenna),
            "below" if row.kind == "tag_read" else "on top",
            f"{1000.0 * row.side_m:g}",
            f"{1000.0 * row.x_m + 0.0:.1f}",
            f"{1000.0 * row.y_m + 0.0:.1f}",
            f"rfid_antenna_{row.antenna}_link",
        ]
        for row in rows
    ]


def _module_text(row: AntennaRow, antenna_count: int) -> str:
    """Return what a module is: a reader of floor tags drives more antennas than one through a multiplexer."""
    name = _MODULES[row.kind]
    return f"{name} + multiplexer" if row.kind == "tag_read" and antenna_count > 1 else name
