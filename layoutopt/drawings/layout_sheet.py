"""The installation drawing of a layout: one sheet with floor plan, robot, legend and notes.

The paper is the smallest from A3 to A0 on which neighbouring tags lie at least 1.2 mm apart, the plan is drawn
at 1:50 or larger and the robot at 1:10 or larger, which is what installers work from; a layout for which no
paper is large enough takes the smallest one that shows it as large as any. Robot, legend and notes stand in a
text space after ISO 9431: a column at the right above the title block, or a strip along the lower edge,
whichever gives the plan the larger scale.
"""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import cache
from typing import Final

import numpy as np

from layoutopt.drawings.arrangement import (
    ARRANGEMENTS,
    CENTRING_MM,
    LEGIBLE_ROBOT_SCALE,
    RobotPlace,
    Rooms,
    fits,
    place_robot,
    text_width_mm,
)
from layoutopt.drawings.floor_view import FloorFrame, FloorView, floor_frame, floor_view
from layoutopt.drawings.frame import TitleBlock, frame_box, frame_entities, title_block_entities
from layoutopt.drawings.robot_view import Level, RobotView, antenna_table, robot_view, sides
from layoutopt.drawings.sheet import PAPERS_MM, SCALES, Entity, PaperName, Sheet, place_view
from layoutopt.drawings.sheet_notes import general_notes, legend_rows
from layoutopt.drawings.tag_grid import tag_groups
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
CLOSEST_TAGS_MM: Final = 1.2

_PAPERS: Final[tuple[PaperName, ...]] = ("A3", "A2", "A1", "A0")
_CLEARANCES_MM: Final = (CENTRING_MM, 4.0)
"""What the plan keeps from the frame at its sides; the second only where the first costs a scale."""
_LEGEND_COLUMNS: Final = 3
_FILL_IN: Final = "to be filled in"
_ROBOT_NAMES: Final[dict[tuple[Level, ...], str]] = {
    ("below",): "Robot underside",
    ("top",): "Robot top",
    ("below", "top"): "Robot, below and on top",
}


@dataclass(frozen=True, slots=True, kw_only=True)
class _Content:
    """What goes on the sheet, as functions of the scale it is drawn at."""

    site: Site
    antenna_count: int
    frame: Callable[[int], FloorFrame]
    floor: Callable[[int], FloorView]
    robot: Callable[[int], RobotView]
    notes: Callable[[int], tuple[str, ...]]
    legend: Callable[[int], tuple[LegendRow, ...]]


@dataclass(frozen=True, slots=True, kw_only=True)
class _Choice:
    """A paper, the scale of the plan on it, and where everything goes."""

    paper: PaperName
    scale: int
    rooms: Rooms
    robot: RobotPlace

    def worth(self, closest_mm: float) -> tuple[bool, int, int, int, int]:
        """Return whether it is too small to work from, then scales and paper as they matter; less is better."""
        legible = (
            self.scale <= COARSEST_SCALE
            and closest_mm >= CLOSEST_TAGS_MM * self.scale
            and self.robot.scale <= LEGIBLE_ROBOT_SCALE
        )
        robot = self.robot.scale
        return not legible, self.scale, max(robot, LEGIBLE_ROBOT_SCALE), _PAPERS.index(self.paper), robot


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
    running dimensions from the datum of the site; view 2 is the robot with its antennas in ``base_link`` as seen
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
    closest_mm = min((group.spacing_mm for group in groups), default=np.inf)
    own = general_notes(layout, site, tag_map)

    @cache
    def frame(scale: int) -> FloorFrame:
        return floor_frame(site=site, groups=groups, scale=scale)

    @cache
    def floor(scale: int) -> FloorView:
        return floor_view(
            layout=layout, site=site, tag_map=tag_map, groups=groups, frame=frame(scale), scale=scale
        )

    @cache
    def underside(scale: int) -> RobotView:
        return robot_view(layout=layout, robot=robot, scale=scale)

    content = _Content(
        site=site,
        antenna_count=sum(group.count for group in layout.readers),
        frame=frame,
        floor=floor,
        robot=underside,
        notes=lambda scale: (*own, *floor(scale).remarks, *notes),
        legend=lambda scale: legend_rows(layout, site, scale, tiles=floor(scale).tiles),
    )
    best: _Choice | None = None
    for paper in _PAPERS:
        for choice in _choices(content, paper):
            if best is None or choice.worth(closest_mm) < best.worth(closest_mm):
                best = choice
        if best is not None and not best.worth(closest_mm)[0]:
            break
    if best is None:
        raise _fits_nowhere(site, robot, len(notes))
    return _sheet(best, content, layout, title)


def _choices(content: _Content, paper: PaperName) -> Iterator[_Choice]:
    """Yield for each way to share the paper the largest scale at which the plan fits."""
    for clearance_mm in _CLEARANCES_MM:
        for arrange in ARRANGEMENTS:
            for scale in _scales(content.site, paper):
                box_mm = content.frame(scale).box_mm
                # Notes can only take room; what is too large without them is not drawn at all.
                rooms = arrange(paper, 0.0, 0.0, clearance_mm)
                if rooms is None or not fits(box_mm, scale, rooms.plan):
                    continue
                rooms = arrange(
                    paper,
                    notes_height_mm(content.notes(scale), text_width_mm()),
                    legend_height_mm(content.legend(scale), _LEGEND_COLUMNS),
                    clearance_mm,
                )
                if rooms is None or not fits(box_mm, scale, rooms.plan):
                    continue
                place = place_robot(content.robot, content.antenna_count, rooms.robot)
                if place is not None:
                    yield _Choice(paper=paper, scale=scale, rooms=rooms, robot=place)
                    break


def _scales(site: Site, paper: PaperName) -> tuple[int, ...]:
    """Return the scales at which the bare floor is smaller than the paper, before anything is drawn."""
    xmin, ymin, xmax, ymax = (1000.0 * edge for edge in site.bounds_m)
    width_mm, height_mm = PAPERS_MM[paper]
    return tuple(scale for scale in SCALES if xmax - xmin <= width_mm * scale and ymax - ymin <= height_mm * scale)


def _fits_nowhere(site: Site, robot: Robot, note_count: int) -> InvalidInput:
    xmin, ymin, xmax, ymax = site.bounds_m
    length_m, width_m = np.ptp(robot.outline_m, axis=0).tolist()
    return InvalidInput.at(
        f"drawing of site '{site.name}'",
        f"a floor of {xmax - xmin:g} m x {ymax - ymin:g} m, a robot of {length_m:g} m x {width_m:g} m and "
        f"{note_count} further notes fit no sheet up to A0, even at 1:{SCALES[-1]}",
        "Check the units of floor and robot and the length of the notes, or draw the floor in parts.",
    )


def _sheet(choice: _Choice, content: _Content, layout: Layout, title: str) -> Sheet:
    paper, rooms, place = choice.paper, choice.rooms, choice.robot
    robot = content.robot(place.scale)
    plan = place_view(
        "floor plan",
        content.floor(choice.scale).entities,
        scale=choice.scale,
        room_mm=rooms.plan,
        extent_mm=content.frame(choice.scale).box_mm,
    )
    underside = place_view("robot", robot.entities, scale=place.scale, room_mm=place.room, extent_mm=robot.box_mm)
    block = TitleBlock(
        legal_owner=_FILL_IN,
        identification_number=layout.short_key,
        date_of_issue="-",
        sheet_number="1 / 1",
        title=title,
        approval_person=_FILL_IN,
        creator="layoutopt",
        document_type="Installation drawing",
        scale=f"1:{choice.scale}, 1:{place.scale}",
    )
    plan_axes = ("x", "y", "map frame", "REP-103")
    robot_axes = ("x", "y", "x forward, y left", "seen from above")
    plan_corner = (rooms.plan.xmin, frame_box(paper).ymax)
    robot_corner = (rooms.robot.xmin, rooms.robot.ymax)
    entities: list[Entity] = [
        *frame_entities(paper),
        *rooms.separators,
        *title_block_entities(block, paper),
        *view_title(1, "Floor plan", choice.scale, plan_corner, plan_axes, bar_mm=60.0),
        *view_title(2, _ROBOT_NAMES[sides(layout)], place.scale, robot_corner, robot_axes, bar_mm=35.0),
        *note_entities(content.notes(choice.scale), (rooms.notes.xmin, rooms.notes.ymax), text_width_mm()),
        *legend_entities(
            content.legend(choice.scale),
            (rooms.legend.xmin, rooms.legend.ymax),
            text_width_mm(),
            _LEGEND_COLUMNS,
        ),
    ]
    if place.table_at_mm is not None:
        entities += antenna_table(layout, place.table_at_mm, place.blocks)
    return Sheet(title=title, paper=paper, views=(plan, underside), entities=tuple(entities))
