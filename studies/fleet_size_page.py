"""The page of fleet sizes: the cheapest layout for each number of robots, its money, and where layouts change."""

import itertools
from collections.abc import Sequence
from typing import Final

import numpy as np

from layoutopt.layout import Layout
from layoutopt.parts import TAG_ITEMS
from layoutopt.plots.curves import Curve, Panel, draw_curves
from layoutopt.plots.fleet_shares import draw_fleet_shares
from layoutopt.score_text import counted_text, euros
from studies import columns
from studies.cells import shown_on
from studies.fleet_size import MOST_TRIED, Chosen, FleetSize, Priced
from studies.page import Data, Page, Picture, Section, Table
from studies.published.comparison import scaled, with_interval

_MOST_ROBOTS: Final = 50


def summary(study: FleetSize, chosen: Sequence[Chosen], demand_m: float | None) -> list[str]:
    """Return the answer in a few sentences."""
    held = [(item, item.priced) for item in chosen if item.priced is not None]
    if demand_m is None:
        return ["The first look is not finished."]
    demand = f"a mean error of {1000.0 * demand_m:.3g} mm"
    if not held:
        return [
            f"No layout was shown to reach {demand} for any number of robots; at most {MOST_TRIED} are tried for "
            "each."
        ]
    (first, first_layout), (last, last_layout) = held[0], held[-1]
    told = shown_on(study.deciding, what="fresh drive")
    different = len({priced.layout.key for _, priced in held})
    lines = [
        f"From {counted_text(first.robots, 'robot')} to {last.robots} the cheapest layout {told} to reach "
        f"{demand} " + ("stays the same." if different == 1 else f"changes: {different} layouts take turns."),
        f"For {counted_text(first.robots, 'robot')}: {_told(study, first, first_layout)}.",
    ]
    if last is not first:
        lines.append(f"For {counted_text(last.robots, 'robot')}: {_told(study, last, last_layout)}.")
    tags = tag_count(first_layout), tag_count(last_layout)
    antennas = antenna_count(first_layout.layout), antenna_count(last_layout.layout)
    moved = [f"the floor goes from {tags[0]} to {tags[1]} tags"] if tags[0] != tags[1] else []
    if antennas[0] != antennas[1]:
        moved.append(f"a robot goes from {antennas[0]} to {counted_text(antennas[1], 'antenna')}")
    if moved:
        lines.append(f"So from {first.robots} to {last.robots} robots {', and '.join(moved)}.")
    lines += [f"{text}." for text in crossover_texts(study, held)]
    lacking = [str(item.robots) for item in chosen if item.priced is None]
    if lacking:
        lines.append(
            f"None of the {MOST_TRIED} cheapest candidates was shown to do for {', '.join(lacking)} robots."
        )
    if study.target_m is None:
        lines.append("No accuracy target was set: the demand is the error that the first layout of the space has.")
    return lines


def _told(study: FleetSize, item: Chosen, priced: Priced) -> str:
    floor, readers = priced.split_eur(item.robots, study.prices)
    error = "" if item.error is None else with_interval(scaled(item.error, 1000.0, unit="mm"))
    share = 100.0 * readers / (floor + readers)
    return (
        f"{priced.layout.label}, {euros(floor + readers)} ({100.0 - share:.0f} % floor, {share:.0f} % readers), "
        f"{error} mm over {0 if item.error is None else item.error.count} fresh drives"
    )


def crossover_texts(study: FleetSize, held: Sequence[tuple[Chosen, Priced]]) -> list[str]:
    """Return from how many robots on each next layout is cheaper than the one before; costs are exact."""
    texts = []
    for (_, before), (_, after) in itertools.pairwise(held):
        if before.layout.key == after.layout.key:
            continue
        size = cheaper_from(study, before, after)
        if size is not None:
            labels = f"{after.layout.label} is cheaper than {before.layout.label}"
            texts.append(f"From {counted_text(size, 'robot')} on, {labels}")
    return texts


def cheaper_from(study: FleetSize, before: Priced, after: Priced) -> int | None:
    """Return the number of robots from which one layout is cheaper than another up to 50; ``None`` for none."""
    found = None
    for robots in range(_MOST_ROBOTS, 0, -1):
        if after.cost_eur(robots, study.prices) >= before.cost_eur(robots, study.prices):
            return found
        found = robots
    return found


def tag_count(priced: Priced) -> int:
    """Return how many tags a layout takes."""
    return sum(need.quantity for need in priced.needs if need.item in TAG_ITEMS)


def antenna_count(layout: Layout) -> int:
    """Return how many floor antennas a robot carries."""
    return sum(group.count for group in layout.floor_readers)


def page_of(
    study: FleetSize, chosen: Sequence[Chosen], demand_m: float | None, *, drives: int, failed: int
) -> Page:
    """Return the whole page."""
    held = [(item, item.priced) for item in chosen if item.priced is not None]
    limits = "" if not study.left_out else f" {study.left_out} layouts were left out of this quick look."
    paragraphs = (
        "The floor is paid once, readers are paid for every robot; spares and labour count with what they are "
        "for. Costs are exact. Every layout of the space is driven once, because its error does not depend on the "
        f"number of robots: {study.look} drives of each, then {study.deciding} fresh ones of the cheapest that "
        "meet the demand so far, until one is shown to meet it (one-sided 95 %, each by itself). A layout whose "
        f"first look misses the demand by chance is left out.{limits}",
        "Only the mean position error over the whole floor is asked for; other limits of the spec are those of "
        "the study cost_vs_accuracy.",
    )
    return Page(
        study="fleet_size",
        title="The cheapest layout against the number of robots",
        summary=tuple(summary(study, chosen, demand_m)),
        found=bool(held),
        sections=(
            Section(
                heading="Where the money goes",
                paragraphs=paragraphs,
                parts=(*_pictures(study, held), _table(study, chosen)),
            ),
        ),
        facts={
            "Layouts": str(len(study.layouts)),
            "World": study.world,
            "Estimator": study.problem.estimators[0].name,
            "Prices": f"{study.prices.name}, {study.prices.date}",
            "Trials": str(drives),
            "Seed": str(study.seed),
            "Failed tasks": str(failed),
            "Intervals": "± is half the width of the two-sided 95 % interval over fresh drives (Student)",
        },
        data=(_data(study, chosen),),
    )


def _pictures(study: FleetSize, held: Sequence[tuple[Chosen, Priced]]) -> list[Picture]:
    if not held:
        return []
    splits = [priced.split_eur(item.robots, study.prices) for item, priced in held]
    robots = [item.robots for item, _ in held]
    counts = {
        "tags on the floor": [float(tag_count(priced)) for _, priced in held],
        "antennas of a robot": [float(antenna_count(priced.layout)) for _, priced in held],
    }
    panels = [
        Panel(
            title="",
            x_label="robots",
            y_label=name,
            curves=(Curve(name=name, x=np.array(robots, dtype=np.float64), y=np.array(values)),),
            log_x=max(robots) > min(robots),
        )
        for name, values in counts.items()
    ]
    return [
        Picture(
            name="fleet_size",
            caption="Shares of floor and readers in the cost of the cheapest layout; exact.",
            drawn=draw_fleet_shares(
                robots,
                [floor for floor, _ in splits],
                [readers for _, readers in splits],
                bought=[
                    f"{tag_count(priced)} tags,\n{counted_text(antenna_count(priced.layout), 'antenna')} a robot"
                    for _, priced in held
                ],
            ),
        ),
        Picture(
            name="fleet_layouts",
            caption="Tags and antennas of the cheapest layout.",
            drawn=draw_curves(panels),
        ),
    ]


def _table(study: FleetSize, chosen: Sequence[Chosen]) -> Table:
    rows = []
    for item in chosen:
        if item.priced is None:
            rows.append((str(item.robots), "none shown", *["–"] * 6, str(item.tried)))
            continue
        floor, readers = item.priced.split_eur(item.robots, study.prices)
        error = None if item.error is None else scaled(item.error, 1000.0, unit="mm")
        rows.append(
            (
                str(item.robots),
                item.priced.layout.label,
                f"{floor + readers:,.2f}",
                f"{floor:,.2f}",
                f"{readers:,.2f}",
                str(tag_count(item.priced)),
                str(antenna_count(item.priced.layout)),
                with_interval(error),
                str(item.tried),
            )
        )
    head = ("robots", "layout", "cost, EUR", "floor, EUR", "readers, EUR", "tags", "antennas a robot")
    return Table(
        caption="The cheapest layout shown to meet the demand, by number of robots",
        head=(*head, "mean error, mm", "decided"),
        rows=tuple(rows),
        words=2,
    )


def _data(study: FleetSize, chosen: Sequence[Chosen]) -> Data:
    rows = []
    for item in chosen:
        cells = [str(item.robots)]
        if item.priced is None:
            cells += [""] * 8
        else:
            floor, readers = item.priced.split_eur(item.robots, study.prices)
            cells += [item.priced.layout.short_key, item.priced.layout.label]
            cells += [columns.number(floor), columns.number(readers)]
            cells += [str(tag_count(item.priced)), str(antenna_count(item.priced.layout))]
            cells += ["", ""] if item.error is None else columns.pair(item.error)
        rows.append((*cells, str(item.tried)))
    head = ("robots", "layout", "label", "floor_eur", "readers_eur", "tags", "antennas")
    return Data(
        name="fleet_size", head=(*head, *columns.named("position_error_mean", "m"), "decided"), rows=tuple(rows)
    )
