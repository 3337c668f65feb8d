"""The installation drawing of a layout: one sheet with floor plan, robot, legend and notes.

The paper is the smallest from A3 to A0 on which neighbouring tags lie at least 1.5 mm apart and the scale is
1:50 or larger, which is what installers work from; a plan too large for that takes the smallest paper that
shows it at the largest scale any paper allows. Robot, legend and notes stand in a text space after ISO 9431:
a column at the right above the title block, or a strip along the lower edge, whichever gives the plan the
larger scale.
"""

from collections import Counter
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache
from typing import Final

import numpy as np

from layoutopt import registry
from layoutopt.drawings.floor_view import NO_TAGS_FILL, OBSTACLE_FILL, FloorView, floor_view, tag_symbol
from layoutopt.drawings.frame import (
    TITLE_BLOCK_MM,
    TitleBlock,
    frame_box,
    frame_entities,
    title_block_entities,
)
from layoutopt.drawings.robot_view import (
    TABLE_BLOCK_MM,
    TABLE_ROW_MM,
    RobotView,
    antenna_lines,
    antenna_table,
    robot_view,
    table_rows,
)
from layoutopt.drawings.sheet import PAPERS_MM, SCALES, Box, Entity, Line, PaperName, Sheet, place_view
from layoutopt.drawings.tag_grid import TagGroup, tag_groups
from layoutopt.drawings.text_space import (
    HEADING_ROOM_MM,
    VIEW_TITLE_ROOM_MM,
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
