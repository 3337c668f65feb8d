"""Objectives: what makes named scores of a layout, each a `layoutopt.protocols.Objective`."""

from typing import Final

EXTENSION_POINT: Final = "objectives"
ROWS: Final = {
    "cost": "objectives.cost:Cost",
    "position_bound": "objectives.position_bound:PositionBound",
    "coverage": "objectives.coverage:Coverage",
    "localization": "objectives.localization:Localization",
}
