"""The sections of the page of placed tags: where nothing serves, ways out, stages, front, floor, drives."""

from typing import Final

import numpy as np

from layoutopt.plots.coverage_front import draw_coverage_front
from layoutopt.plots.floor_cells import draw_floor_cells
from layoutopt.plots.layout_plan import draw_layout_plan
from layoutopt.score_text import euros
from layoutopt.units import format_length
from objectives.cost import Cost
from solvers.placement_relaxation import unserved_cells
from studies.page import Picture, Section, Table
from studies.published.comparison import scaled, with_interval
from studies.tag_placement_rivals import PLACED, Rival
from studies.tag_placement_setting import tags_cost_eur
from studies.tag_placement_words import Told, check_of, looked_at, open_range

ERROR: Final = "position_error_mean"
CELL_M: Final = 0.5
"""Side of the cells in which runs that no slot serves are counted."""
_SHOWN_CELLS: Final = 12


_SERVED: Final = (
    "Runs are endless in number, so that samples of them are served. Tags are then added for what fresh runs "
    "miss, until a look misses so little that the check would hardly find it. A sample is a part of the demand: "
    "a bound for it holds for the whole."
)
_WITHIN_BUDGETS: Final = (
    "Runs are endless in number, so that a sample of them, drawn evenly, stands for them. Shares and bounds are "
    "of this sample; choices made for it fit it better than other runs."
)
_CHECK: Final = "The check at the end tries every tag with every antenna on runs that shaped nothing."


def asked(told: Told) -> Section:
    """Return what was asked."""
    rows = tuple(
        (
            demand.zone or "whole floor",
            format_length(demand.length_m) if demand.length_m else "pose",
            "routes" if demand.along_routes else "everywhere",
            ", ".join(demand.without) or "–",
            str(demand.tags),
        )
        for demand in told.asked.question.demands
    )
    return Section(
        heading="What was asked",
        paragraphs=(f"{_WITHIN_BUDGETS if told.within_budgets else _SERVED} {_CHECK}",),
        parts=(
            Table(
                caption="Demands",
                head=("zone", "straight run of", "along", "without", "tags in view"),
                rows=rows,
                words=4,
            ),
        ),
    )


def unserved(told: Told) -> Section:
    """Return where runs begin that no slot serves."""
    cells = unserved_cells(told.found.placed.lost, CELL_M)
    rows = tuple(
        (f"({cell.corner_m[0]:g}, {cell.corner_m[1]:g}) m", str(cell.runs)) for cell in cells[:_SHOWN_CELLS]
    )
    return Section(
        heading="Where no slot serves",
        paragraphs=(
            f"Runs that begin in {len(cells)} cells of {format_length(CELL_M)} see too few slots, whatever is "
            f"chosen. The table shows those with most of them, up to {_SHOWN_CELLS}; tables/cells.csv has all.",
        ),
        parts=(
            Picture(
                name="unserved",
                caption="Cells in which runs begin that no slot serves; the darker, the more of them.",
                drawn=draw_floor_cells(
                    told.problem.design.site,
                    [cell.corner_m for cell in cells],
                    [cell.runs for cell in cells],
                    CELL_M,
                    "runs that no slot serves",
                ),
            ),
            Table(caption="Cells by their lower left corner", head=("cell", "sampled runs"), rows=rows),
        ),
    )


def ways(told: Told) -> Section:
    """Return what could give."""
    share = told.asked.question.unserved_share
    rows = tuple(
        (
            way.text,
            "all" if way.left_out <= share else f"all but {way.left_out:.1%}",
            str(way.tags),
            told.euros_of(way.tags),
        )
        for way in told.found.ways
    )
    return Section(
        heading="Ways out",
        paragraphs=(
            "One thing that gives, alone, by as little as helps; what it costs comes from a short search on the "
            "sampled runs and is an estimate. Ways that serve every run asked for come first, the cheapest ahead; "
            "a larger disc or other readers cost more than the tags shown.",
        ),
        parts=(
            Table(
                caption="What could give",
                head=("way out", "runs served", "new tags", "tags with labour"),
                rows=rows,
                words=2,
            ),
        ),
    )


def stages(told: Told) -> Section:
    """Return one stage after the other."""
    rows, before = [], told.installed
    names = [", ".join(zone or "whole floor" for zone in stage) for stage in told.asked.settings.stages]
    # Stages after one without an answer were not asked.
    for name, stage in zip(names, told.found.stages, strict=False):
        placed = stage.placed
        if placed.xy_m is None:
            rows.append((name, "–", "–", f"{placed.bound:.0f}", "–", "–"))
            continue
        cost = euros(tags_cost_eur(told.spec, placed.new, before))
        rows.append((name, str(placed.new), str(len(placed.xy_m)), f"{placed.bound:.0f}", cost, check_of(placed)))
        before = len(placed.xy_m)
    return Section(
        heading="Stages",
        paragraphs=("Tags once laid stay; the bound of a stage counts them as given.",),
        parts=(
            Table(
                caption="One stage after the other",
                head=("zones", "new tags", "tags then", "at least", "cost of the stage", "fresh runs missed"),
                rows=tuple(rows),
            ),
        ),
    )


def front(told: Told) -> Section:
    """Return new tags against the share of runs that they serve."""
    found = told.found.front
    assert found is not None
    rows = tuple(
        (
            str(point.placed.new),
            told.euros_of(point.placed.new),
            f"{point.placed.met_share:.2%}",
            f"{point.placed.bound:.2%}",
            check_of(point.placed),
        )
        for point in found.points
    )
    if found.complete:
        left_open = "It is proven complete."
    else:
        ranges = "; ".join(open_range(item) for item in found.open_ranges)
        left_open = (
            "What lies between two budgets was not looked at, and answers that reach no bound may be beaten: "
            f"better choices may exist for {ranges}, and for fewer tags at most what the upper line shows."
        )
    numbers = np.array([(point.placed.new, point.placed.met_share) for point in found.points])
    bounds = np.array([(point.tags, point.placed.bound) for point in found.points])
    return Section(
        heading="Tags against runs served",
        paragraphs=(
            "One choice after another, each with the most runs served for its number of tags, by the "
            f"epsilon-constraint method. {left_open} Shares are of the runs that the choices were made for; fresh "
            "runs are the fair judge of each.",
        ),
        parts=(
            Picture(
                name="front",
                caption="Share of the sampled runs served by so many new tags; no choice reaches above the upper "
                "line.",
                drawn=draw_coverage_front(
                    tags=numbers[:, 0], served=numbers[:, 1], asked=bounds[:, 0], most=bounds[:, 1]
                ),
            ),
            Table(
                caption="The front",
                head=("new tags", "cost", "runs served", "none of as many serves more than", "fresh runs missed"),
                rows=rows,
                words=0,
            ),
        ),
    )


def floor(told: Told) -> list[Section]:
    """Return the floor with the placed tags, if there are any."""
    own = next((rival for rival in told.rivals if rival.label == PLACED), None)
    if own is None:
        return []
    scenario = told.problem.design
    return [
        Section(
            heading="The floor",
            paragraphs=(
                f"The layout is layouts/{own.layout.short_key}.toml; layoutopt draw makes the drawings and the "
                "tag map of it.",
            ),
            parts=(
                Picture(
                    name="floor",
                    caption="The placed tags with one robot.",
                    drawn=draw_layout_plan(
                        layout=own.layout,
                        site=scenario.site,
                        robot=scenario.robot,
                        tag_map=own.layout.floor_tags.lay_on(scenario.site),
                    ),
                ),
            ),
        )
    ]


def drives(told: Told) -> Section:
    """Return placed tags beside regular patterns on the same drives."""
    cost = Cost(prices=told.spec.prices, robot_count=told.spec.robot_count, reader_part=told.spec.reader_part)
    rows = []
    for rival in told.rivals:
        table = told.driven.get(rival.label)
        rows.append(
            (
                rival.label,
                rival.layout.short_key,
                str(rival.tags),
                euros(cost(rival.layout, told.problem.design, None)["cost"].value),
                _shares(rival),
                "–" if table is None else with_interval(scaled(table.score(ERROR), 1e3, unit="mm")),
            )
        )
    return Section(
        heading="Beside regular patterns",
        paragraphs=(
            "Of each family of the spec the pattern with about as many tags on the whole floor (without an answer "
            "the densest), and the sparsest square one that misses no more of the same fresh runs. Costs are the "
            "whole bill, readers included. The same drives for all; errors are means with 95 % intervals. Runs of "
            "one route are alike, so that the bounds of runs missed count routes.",
        ),
        parts=(
            Table(
                caption="Tags, cost, runs missed and errors on the drives",
                head=("tags", "layout", "number", "cost", "runs missed, at most at 95 %", "position error, mm"),
                rows=tuple(rows),
                words=2,
            ),
        ),
    )


def _shares(rival: Rival) -> str:
    return "; ".join(
        f"{looked_at(missed)} ({missed.upper:.2%})" if missed.runs else "no run" for missed in rival.missed
    )
