"""Names of the coordinate frames in files for robots, after REP-105."""

from typing import Final

MAP_FRAME: Final = "map"
ROBOT_FRAME: Final = "base_link"
