"""How floor plan, robot, legend and notes share a sheet: a text space at the right or along the lower edge."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Final

from layoutopt.drawings.frame import TITLE_BLOCK_MM, frame_box
from layoutopt.drawings.robot_view import TABLE_BLOCK_MM, RobotView, table_height_mm
from layoutopt.drawings.sheet import SCALES, Box, Entity, Line, PaperName
from layoutopt.drawings.symbols import Point
from layoutopt.drawings.text_space import VIEW_TITLE_ROOM_MM

CENTRING_MM: Final = 11.0
"""What keeps clear of the centring marks, which reach 10 mm into the drawing space."""
ROBOT_SCALES: Final = tuple(scale for scale in SCALES if scale >= 2)
LEGIBLE_ROBOT_SCALE: Final = 10

_GAP_MM: Final = 4.0
_LEAST_ROBOT_MM: Final = 70.0
_LEAST_BLOCK: Final = 4  # antennas in a block of the table, before there is a second block


@dataclass(frozen=True, slots=True, kw_only=True)
class Rooms:
    """Where things go on the paper; ``notes`` and ``legend`` are filled from their upper left corner."""

    plan: Box
    robot: Box
    notes: Box
    legend: Box
    separators: tuple[Entity, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class RobotPlace:
    """The room of the robot view below its title, its scale, and place and blocks of the antenna table.

    ``table_at_mm`` is ``None`` if the table has no room beside a legible view.
    """

    room: Box
    scale: int
    table_at_mm: Point | None
    blocks: int


def column_at_right(paper: PaperName, notes_mm: float, legend_mm: float, clearance_mm: float) -> Rooms | None:
    """Return rooms with a column as wide as the title block above it, or nothing if it is not high enough.

    Parameters
    ----------
    notes_mm, legend_mm
        Height of notes and legend at the width of `text_width_mm`.
    clearance_mm
        What the plan keeps from the frame at its sides.
    """
    frame = frame_box(paper)
    left, right = frame.xmax - TITLE_BLOCK_MM[0], frame.xmax - CENTRING_MM
    legend_foot = frame.ymin + TITLE_BLOCK_MM[1] + _GAP_MM
    notes_foot = legend_foot + legend_mm + 2.0 * _GAP_MM
    robot_foot = notes_foot + notes_mm + 2.0 * _GAP_MM
    if frame.ymax - robot_foot < _LEAST_ROBOT_MM:
        return None
    return Rooms(
        plan=Box(
            frame.xmin + clearance_mm, frame.ymin + clearance_mm, left - _GAP_MM, frame.ymax - VIEW_TITLE_ROOM_MM
        ),
        robot=Box(left + _GAP_MM, robot_foot, right, frame.ymax),
        notes=Box(left + _GAP_MM, notes_foot, right, notes_foot + notes_mm),
        legend=Box(left + _GAP_MM, legend_foot, right, legend_foot + legend_mm),
        separators=(
            _line((left, frame.ymin), (left, frame.ymax)),
            *(_line((left, foot - _GAP_MM), (frame.xmax, foot - _GAP_MM)) for foot in (notes_foot, robot_foot)),
        ),
    )


def strip_below(
    paper: PaperName, notes_mm: float, legend_mm: float, clearance_mm: float, *, strip_mm: float
) -> Rooms | None:
    """Return rooms with a strip along the lower edge, at least ``strip_mm`` high; otherwise as the column.

    Robot, notes, and legend above title block stand side by side in it.
    """
    frame = frame_box(paper)
    width, title_mm = TITLE_BLOCK_MM
    height = max(strip_mm, notes_mm + _GAP_MM + CENTRING_MM, title_mm + legend_mm + 2.0 * _GAP_MM)
    left, middle, top = frame.xmax - 2.0 * width, frame.xmax - width, frame.ymin + height
    if left - frame.xmin < _LEAST_ROBOT_MM or frame.ymax - top < _LEAST_ROBOT_MM:
        return None
    inner = top - _GAP_MM
    return Rooms(
        plan=Box(frame.xmin + clearance_mm, top + 1.0, frame.xmax - clearance_mm, frame.ymax - VIEW_TITLE_ROOM_MM),
        robot=Box(frame.xmin + _GAP_MM, frame.ymin + CENTRING_MM, left - _GAP_MM, top),
        notes=Box(left + _GAP_MM, inner - notes_mm, middle - CENTRING_MM, inner),
        legend=Box(middle + _GAP_MM, inner - legend_mm, frame.xmax - CENTRING_MM, inner),
        separators=(
            _line((frame.xmin, top), (frame.xmax, top)),
            _line((left, frame.ymin), (left, top)),
            _line((middle, frame.ymin), (middle, top)),
        ),
    )


Arrangement = Callable[[PaperName, float, float, float], Rooms | None]
ARRANGEMENTS: Final[tuple[Arrangement, ...]] = (
    column_at_right,
    *(partial(strip_below, strip_mm=strip_mm) for strip_mm in (100.0, 120.0, 150.0, 190.0)),
)
"""In the order in which they are preferred where scales are equal."""


def text_width_mm() -> float:
    """Return the width of notes and legend in either arrangement."""
    return TITLE_BLOCK_MM[0] - _GAP_MM - CENTRING_MM


def place_robot(robot: Callable[[int], RobotView], antenna_count: int, cell: Box) -> RobotPlace | None:
    """Return where robot view and antenna table go in ``cell``, at the largest scale, or nothing if nowhere.

    ``robot`` gives the view at a scale. The table stands beside or below the view; it gives way where the view
    would otherwise have to be smaller than 1:10.
    """
    inside = Box(cell.xmin, cell.ymin, cell.xmax, cell.ymax - VIEW_TITLE_ROOM_MM)
    alone = _largest(robot, inside)
    if alone is None:
        return None
    best = RobotPlace(room=inside, scale=alone, table_at_mm=None, blocks=0)
    for room, at_mm, blocks in _with_table(inside, antenna_count):
        scale = _largest(robot, room)
        if scale is None or scale > max(alone, LEGIBLE_ROBOT_SCALE):
            continue
        if best.table_at_mm is None or scale < best.scale:
            best = RobotPlace(room=room, scale=scale, table_at_mm=at_mm, blocks=blocks)
    return best


def fits(box_mm: Box, scale: int, room: Box) -> bool:
    """Tell whether a box of a view fits into a room on paper at 1:``scale``."""
    return box_mm.width <= room.width * scale and box_mm.height <= room.height * scale


def _with_table(inside: Box, antenna_count: int) -> Sequence[tuple[Box, Point, int]]:
    """Return ways to part a room: what is left for the view, corner of the table, blocks of the table."""
    found = []
    most = min(int(inside.width // TABLE_BLOCK_MM), -(-antenna_count // _LEAST_BLOCK))
    if most:
        foot = inside.ymin + table_height_mm(antenna_count, most)
        below = Box(inside.xmin, foot, inside.xmax, inside.ymax)
        found.append((below, (inside.xmin, foot - _GAP_MM / 2.0), most))
    for blocks in range(1, int(inside.width // TABLE_BLOCK_MM)):
        if table_height_mm(antenna_count, blocks) <= inside.height:
            edge = inside.xmax - blocks * TABLE_BLOCK_MM
            beside = Box(inside.xmin, inside.ymin, edge - _GAP_MM, inside.ymax)
            found.append((beside, (edge, inside.ymax), blocks))
            break
    return [(room, at_mm, blocks) for room, at_mm, blocks in found if room.width > 0.0 and room.height > 0.0]


def _largest(robot: Callable[[int], RobotView], room: Box) -> int | None:
    return next((scale for scale in ROBOT_SCALES if fits(robot(scale).box_mm, scale, room)), None)


def _line(start: Point, end: Point) -> Line:
    return Line(layer="A-TITLE", start_mm=start, end_mm=end)
