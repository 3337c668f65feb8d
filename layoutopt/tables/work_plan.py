"""The work to be done for a layout, step by step, with the hours that the bill of material counts."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Final

from layoutopt.layout import TagMap
from layoutopt.parts import TAG_ITEMS, Need, PriceList, Scope
from layoutopt.site import Site
from layoutopt.tables.cells import text_cell, write_csv

_COLUMNS: Final = ("step", "where", "what", "quantity", "unit", "hours")
_WHOLE_SITE: Final = "whole site"
_WORK_ON_SITE: Final = {"transponder": "mount, see transponders.csv", "uhf_tag": "encode and give out"}
_REST: Final = "floor outside all zones"


@dataclass(frozen=True, slots=True, kw_only=True)
class WorkStep:
    """One step of the work; ``hours`` is zero for what is part of another step."""

    where: str
    what: str
    quantity: int
    unit: str
    hours: float


def work_plan(
    found: Sequence[Need], tag_map: TagMap, site: Site, robot_count: int, prices: PriceList
) -> tuple[WorkStep, ...]:
    """Return the steps in the order in which they are done: floor, survey, each robot, acceptance.

    ``found`` is what `layoutopt.parts.needs` counts for the layout. The hours are those of the price list, so
    their sum is that of the labour in the bill of material.
    """
    names = Counter("" if zone < 0 else site.zone_names[zone] for zone in tag_map.zone.tolist())
    areas = [(name or (_REST if len(names) > 1 else _WHOLE_SITE), count) for name, count in sorted(names.items())]

    def hours(item: str, quantity: int) -> float:
        return prices.items[item].labour_s * quantity / 3600.0

    by_item = {need.item: need for need in found if need.scope is not Scope.ROBOT}
    steps: list[WorkStep] = []

    def add(where: str, what: str, quantity: int, unit: str, spent: float = 0.0) -> None:
        steps.append(WorkStep(where=where, what=what, quantity=quantity, unit=unit, hours=spent))

    if "survey" in by_item:
        add(
            _WHOLE_SITE,
            "set out datum and lines, survey and commission (fixed part)",
            1,
            "visit",
            hours("survey", 1),
        )
    for need in found:
        if need.item in TAG_ITEMS:
            what = f"place tags: {prices.items[need.item].description}"
            for name, count in areas:
                add(name, what, count, "tag", hours(need.item, count))
        elif need.scope is Scope.FLOOR:
            verb = _WORK_ON_SITE[need.item]
            what = f"{verb}: {prices.items[need.item].description}"
            add(_WHOLE_SITE, what, need.quantity, "piece", hours(need.item, need.quantity))
    if "survey_tag" in by_item:
        for name, count in areas:
            add(name, "scan and survey tags", count, "tag", hours("survey_tag", count))
    for robot in range(1, robot_count + 1):
        for need in found:
            if need.scope is Scope.ROBOT:
                side = "" if need.side_m is None else f", {need.side_m * 1000:g} mm"
                pieces = need.quantity // robot_count
                what = f"mount: {prices.items[need.item].description}{side}"
                add(f"robot {robot}", what, pieces, "piece", hours(need.item, pieces))
    if len(tag_map):
        add(_WHOLE_SITE, "read scans and survey in: layoutopt commission", 1, "time")
        add(_WHOLE_SITE, "drive a route and compare: layoutopt replay", 1, "time")
    return tuple(steps)


def write_work_plan_csv(path: Path | str, steps: Sequence[WorkStep]) -> None:
    """Write the steps as CSV, numbered from 1; the last row holds the sum of the hours."""
    rows = [
        [
            str(number),
            text_cell(step.where),
            text_cell(step.what),
            str(step.quantity),
            step.unit,
            f"{step.hours:.4f}",
        ]
        for number, step in enumerate(steps, start=1)
    ]
    rows.append(["", "", "all steps", "", "", f"{sum(step.hours for step in steps):.4f}"])
    write_csv(path, _COLUMNS, rows)
