"""Tag patterns: functions that return a `layoutopt.layout.TagPattern`.

A pattern family takes keyword parameters whose names carry their unit (``pitch_m``, ``angle_rad``) and raises
ValueError for values that make no pattern. A spec writes the parameters without the unit: ``pitch = "100 mm"``.
A new pattern is one file with a function and a ``CARD``, and one row below; spec, axes, drawings and contract
tests pick it up by themselves.
"""

from typing import Final

EXTENSION_POINT: Final = "patterns"
ROWS: Final = {
    "square": "layoutopt.patterns.square:square",
    "triangular": "layoutopt.patterns.triangular:triangular",
    "equilateral": "layoutopt.patterns.equilateral:equilateral",
    "parallelogram": "layoutopt.patterns.parallelogram:parallelogram",
    "line": "layoutopt.patterns.line:line",
    "tilted": "layoutopt.patterns.tilted:tilted",
    "sudoku": "layoutopt.patterns.sudoku:sudoku",
    "random": "layoutopt.patterns.random:random",
    "listed": "layoutopt.patterns.listed:listed",
}
