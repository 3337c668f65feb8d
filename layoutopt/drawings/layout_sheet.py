"""The installation drawing of a layout: one sheet with floor plan, robot, legend and notes.

The paper is the smallest from A3 to A0 on which neighbouring tags lie at least 1.5 mm apart and the scale is
1:50 or larger, which is what installers work from; a plan too large for that takes the smallest paper that
shows it at the largest scale any paper allows. Robot, legend and notes stand in a text space after ISO 9431:
a column at the right above the title block, or a strip along the lower edge, whichever gives the plan the
larger scale.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache, partial
from typing import Final

import numpy as np

from layoutopt.drawings.arrangement import (
    CENTRING_MM,
    RobotPlace,
    Rooms,
    column_at_right,
    fits,
    place_robot,
    strip_below,
    text_width_mm,
)
from layoutopt.drawings.floor_view import FloorView, floor_view
from layoutopt.drawings.frame import TitleBlock, frame_entities, title_block_entities
from layoutopt.drawings.robot_view import RobotView, antenna_table, robot_view
from layoutopt.drawings.sheet import PAPERS_MM, SCALES, Box, Entity, PaperName, Sheet, place_view
from layoutopt.drawings.tag_grid import TagGroup, tag_groups
from layoutopt.drawings.text_space import (
    LegendRow,
    legend_entities,
    legend_height_mm,
    note_entities,
    notes_height_mm,
    view_title,
)
from layoutopt.errors import InvalidInput
from layoutopt.layout import Layout, TagMap
from layoutopt.robot import Robot
from layoutopt.site import Site

COARSEST_SCALE: Final = 50
CLOSEST_TAGS_MM: Final = 1.5
TAG_TOLERANCE_MM: Final = 5
ANTENNA_TOLERANCE_MM: Final = 1

_PAPERS: Final[tuple[PaperName, ...]] = ("A3", "A2", "A1", "A0")
_CLEARANCES_MM: Final = (CENTRING_MM, 4.0)
_LEGEND_COLUMNS: Final = 3
_FILL_IN: Final = "to be filled in"


@dataclass(frozen=True, slots=True, kw_only=True)
class _Choice:
    """A paper with everything placed on it."""

    paper: PaperName
    scale: int
    floor: FloorView
    rooms: Rooms
    robot: RobotPlace
    notes: tuple[str, ...]
    legend: tuple[LegendRow, ...]


def layout_sheet(
    *,
    layout: Layout,
    site: Site,
    robot: Robot,
    tag_map: TagMap,
    title: str,
    notes: Sequence[str] = (),
) -> Sheet:
    """Return the sheet from which tags are laid and antennas are mounted.

    View 1 is the floor plan in the floor frame (``map``, REP-103), with all tags, their rows and columns, and
    running dimensions from the datum of the site; view 2 is the underside of the robot in ``base_link`` as seen
    from above. The title block names no person and no date: they are filled in by hand, and equal layouts give
    equal sheets.

    Parameters
    ----------
    tag_map
        The tags, from ``layout.floor_tags.lay_on(site)``, or as they were surveyed.
    notes
        Further sentences for the notes of the sheet.

    Raises
    ------
    InvalidInput
        If floor, robot and notes fit no sheet up to A0 at any scale of ISO 5455.
    """
    groups = tag_groups(layout, site, tag_map)
    floor = cache(partial(_floor, layout, site, tag_map, groups))
    shown = cache(partial(_robot, layout, robot))
    own = _general_notes(layout, site, tag_map)
    choice: _Choice | None = None
    for paper in _PAPERS:
        for clearance_mm in _CLEARANCES_MM:
            for arrange in (column_at_right, strip_below):
                for scale in SCALES:
                    if choice is not None and scale >= choice.scale:
                        break
                    if not _may_fit(site, paper, scale):
                        continue
                    view = floor(scale)
                    lines = (*own, *view.remarks, *notes)
                    rows = _legend(layout, site, view, scale)
                    rooms = arrange(
                        paper,
                        notes_height_mm(lines, text_width_mm()),
                        legend_height_mm(rows, _LEGEND_COLUMNS),
                        clearance_mm,
                    )
                    if rooms is None or not fits(view.box_mm, scale, rooms.plan):
                        continue
                    placed = place_robot(shown, sum(group.count for group in layout.readers), rooms.robot)
                    if placed is not None:
                        choice = _Choice(
                            paper=paper, scale=scale, floor=view, rooms=rooms, robot=placed, notes=lines, legend=rows
                        )  # fmt: skip
                        break
        if choice is not None and _legible(choice.scale, groups):
            break
    if choice is None:
        raise _fits_nowhere(site, robot, len(notes))
    return _sheet(choice, layout, shown(choice.robot.scale), title)


def _floor(layout: Layout, site: Site, tag_map: TagMap, groups: Sequence[TagGroup], scale: int) -> FloorView:
    return floor_view(layout=layout, site=site, tag_map=tag_map, groups=groups, scale=scale)


def _robot(layout: Layout, robot: Robot, scale: int) -> RobotView:
    return robot_view(layout=layout, robot=robot, scale=scale)


def _may_fit(site: Site, paper: PaperName, scale: int) -> bool:
    """Tell whether the bare floor is smaller than the paper, before anything is drawn."""
    xmin, ymin, xmax, ymax = (1000.0 * edge / scale for edge in site.bounds_m)
    width_mm, height_mm = PAPERS_MM[paper]
    return xmax - xmin <= width_mm and ymax - ymin <= height_mm


def _legible(scale: int, groups: Sequence[TagGroup]) -> bool:
    closest_mm = min((group.spacing_mm for group in groups), default=np.inf)
    return scale <= COARSEST_SCALE and closest_mm >= CLOSEST_TAGS_MM * scale


def _fits_nowhere(site: Site, robot: Robot, note_count: int) -> InvalidInput:
    xmin, ymin, xmax, ymax = site.bounds_m
    length_m, width_m = np.ptp(robot.outline_m, axis=0)
    return InvalidInput.at(
        f"drawing of '{site.name}'",
        f"a floor of {xmax - xmin:g} m x {ymax - ymin:g} m, a robot of {length_m:g} m x {width_m:g} m and "
        f"{note_count} notes of your own fit no sheet up to A0, even at 1:{SCALES[-1]}",
        "Check the units of floor and robot, or draw the floor in parts.",
    )


def _sheet(choice: _Choice, layout: Layout, robot: RobotView, title: str) -> Sheet:
    paper, rooms = choice.paper, choice.rooms
    views = (
        place_view(
            "floor plan",
            choice.floor.entities,
            scale=choice.scale,
            room_mm=rooms.plan,
            extent_mm=choice.floor.box_mm,
        ),
        place_view(
            "robot underside",
            robot.entities,
            scale=choice.robot.scale,
            room_mm=choice.robot.room,
            extent_mm=robot.box_mm,
        ),
    )
    block = TitleBlock(
        legal_owner=_FILL_IN,
        identification_number=layout.short_key,
        date_of_issue="-",
        sheet_number="1 / 1",
        title=title,
        approval_person=_FILL_IN,
        creator="layoutopt",
        document_type="Installation drawing",
        scale=f"1:{choice.scale}, 1:{choice.robot.scale}",
    )
    band = Box(rooms.plan.xmin, rooms.plan.ymin, rooms.plan.xmax, rooms.robot.ymax)
    band = band._replace(ymax=PAPERS_MM[paper][1] - 10.0)
    entities: list[Entity] = [
        *frame_entities(paper),
        *rooms.separators,
        *title_block_entities(block, paper),
        *view_title(1, "Floor plan", choice.scale, band, ("x", "y", "map frame", "REP-103"), 60.0),
        *view_title(
            2,
            "Robot underside",
            choice.robot.scale,
            rooms.robot,
            ("x", "y", "x forward, y left", "seen from above"),
            35.0,
        ),
        *note_entities(choice.notes, (rooms.notes.xmin, rooms.notes.ymax), text_width_mm()),
        *legend_entities(choice.legend, (rooms.legend.xmin, rooms.legend.ymax), text_width_mm(), _LEGEND_COLUMNS),
    ]
    if choice.robot.table_at_mm is not None:
        entities += antenna_table(layout, choice.robot.table_at_mm, choice.robot.blocks)
    return Sheet(title=title, paper=paper, views=views, entities=tuple(entities))
