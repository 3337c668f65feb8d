"""Transponders at their places in the floor frame, for those who mount them and for robots that dock."""

from pathlib import Path
from typing import Final

from layoutopt.layout import Layout
from layoutopt.tables.cells import rounded, text_cell, write_csv
from layoutopt.tables.frames import MAP_FRAME

_COLUMNS: Final = ("name", "frame_id", "x_m", "y_m", "z_m")


def write_transponders_csv(path: Path | str, layout: Layout) -> None:
    """Write a row for each transponder: its name and its place in the frame of the tag map, m."""
    rows = [
        [text_cell(transponder.name), MAP_FRAME, *(f"{rounded(value):.4f}" for value in transponder.position_m)]
        for transponder in layout.transponders
    ]
    write_csv(path, _COLUMNS, rows)
