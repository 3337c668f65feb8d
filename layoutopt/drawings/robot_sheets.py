"""Sheets of the robot: its underside with dimensions and a table of antennas, and how they are wired."""

from dataclasses import replace

from layoutopt.drawings.arrangement import place_robot
from layoutopt.drawings.frame import TitleBlock, frame_entities, notes, title_block_entities
from layoutopt.drawings.robot_view import antenna_table, robot_view
from layoutopt.drawings.sheet import Entity, PaperName, Sheet, drawing_room, place_view
from layoutopt.drawings.text_space import view_title
from layoutopt.errors import InvalidInput
from layoutopt.layout import Layout
from layoutopt.robot import Robot
from layoutopt.tables.readers import antenna_rows

_AXES = ("x", "y", "x forward, y left", "seen from above")


def robot_sheet(layout: Layout, robot: Robot, *, paper: PaperName, block: TitleBlock) -> Sheet:
    """Return the underside of the robot, as large as the paper allows, with all antennas dimensioned.

    Raises
    ------
    InvalidInput
        If the robot fits the paper at no scale.
    """
    room = drawing_room(paper, 10.0)
    count = sum(group.count for group in layout.readers)
    place = place_robot(lambda scale: robot_view(layout=layout, robot=robot, scale=scale), count, room)
    if place is None:
        raise InvalidInput.at(
            "robot", f"it fits no sheet of {paper} at any scale", "Check the unit of its outline."
        )
    shown = robot_view(layout=layout, robot=robot, scale=place.scale)
    view = place_view(
        "robot underside", shown.entities, scale=place.scale, room_mm=place.room, extent_mm=shown.box_mm
    )
    block = replace(block, title=f"Robot underside: {block.title}", scale=f"1:{place.scale}")
    entities: list[Entity] = [
        *frame_entities(paper),
        *title_block_entities(block, paper),
        *view_title(1, "Robot underside", place.scale, (room.xmin, room.ymax), _AXES, bar_mm=60.0),
        *notes(
            (room.xmin, room.ymin - 14.0),
            ("Dimensions in mm from base_link. Seen from below, left and right change places.",),
            room.width - 190.0,
        ),
    ]
    if place.table_at_mm is not None:
        entities += antenna_table(layout, place.table_at_mm, place.blocks)
    return Sheet(
        title=block.title, paper=paper, views=(view,), entities=tuple(entities), number=block.sheet_number
    )


def wiring_rows(layout: Layout) -> list[list[str]]:
    """Return module, port, antenna, its side and place, and the name of its link, by module and port."""
    rows = sorted(antenna_rows(layout), key=lambda row: (row.module, row.slot, row.antenna))
    return [
        [
            str(row.module),
            str(row.slot),
            str(row.antenna),
            f"{1000.0 * row.side_m:g}",
            f"{1000.0 * row.x_m + 0.0:.1f}",
            f"{1000.0 * row.y_m + 0.0:.1f}",
            f"rfid_antenna_{row.antenna}_link",
        ]
        for row in rows
    ]
