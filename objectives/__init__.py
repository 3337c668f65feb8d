"""Objectives: what makes named scores of a layout, each a `layoutopt.protocols.Objective`."""

from typing import Final

EXTENSION_POINT: Final = "objectives"
ROWS: Final = {
    "cost": "objectives.cost:Cost",
    "position_bound": "objectives.position_bound:PositionBound",
    "static_error": "objectives.static_error:StaticErrors",
    "heading_bound": "objectives.heading_bound:HeadingBound",
    "invisibility": "objectives.invisibility:Invisibility",
    "coverage": "objectives.coverage:Coverage",
    "expected_reads": "objectives.expected_reads:ExpectedReads",
    "speed_limit": "objectives.speed_limit:SpeedLimit",
    "direction_quality": "objectives.direction_quality:DirectionQuality",
    "uhf_coverage": "objectives.uhf_coverage:UhfCoverage",
    "localization": "objectives.localization:Localization",
    "docking": "objectives.docking:Docking",
    "tracking": "objectives.tracking:Tracking",
}
