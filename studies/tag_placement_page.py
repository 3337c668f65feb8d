"""The page of placed tags: the answer with its bound, the check, the floor, ways out, and drives over it."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

from layoutopt.plots.floor_cells import draw_floor_cells
from layoutopt.plots.layout_plan import draw_layout_plan
from layoutopt.problem import Problem
from layoutopt.result import Status
from layoutopt.score_text import euros
from layoutopt.scores import TrialOutcomes
from layoutopt.spec.building import Spec
from layoutopt.units import format_length
from objectives.cost import Cost
from solvers.demands import Demand
from solvers.placement import Placed
from solvers.placement_relaxation import unserved_cells
from studies.page import Data, Page, Picture, Section, Table
from studies.published.comparison import scaled, with_interval
from studies.tag_placement_setting import Asked, Found, Rival, tags_cost_eur

ERROR: Final = "position_error_mean"
CELL_M: Final = 0.5
"""Side of the cells in which runs that no slot serves are counted."""
_SHOWN_CELLS: Final = 12
_STATUS_WORDS: Final = {
    Status.OPTIMAL: "Proven optimal for the sampled runs and among these slots.",
    Status.BOUNDED: "The best that was found; how much better another could be at most is stated beside it.",
    Status.STOPPED_BY_LIMIT: "Stopped before the question was decided.",
    Status.TARGET_NOT_MET: "No choice within the budget was found, and none was shown to be impossible.",
    Status.BUDGET_TOO_SMALL: "No choice that serves every run keeps the budget.",
    Status.INFEASIBLE: "No choice of these slots serves every run that is asked for.",
}


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Told:
    """All that the page is made of."""

    spec: Spec
    problem: Problem
    asked: Asked
    found: Found
    rivals: tuple[Rival, ...]
    driven: Mapping[str, TrialOutcomes]
    trials: int
    failed: int

    @property
    def installed(self) -> int:
        """Tags that lay there before."""
        return len(self.asked.settings.installed_m)

    def euros_of(self, new: float) -> str:
        """Return what so many new tags cost by the bill."""
        return euros(tags_cost_eur(self.spec, math.ceil(new - 1e-9), self.installed))


def summary(told: Told) -> list[str]:
    """Return the answer in a few sentences."""
    placed = told.found.placed
    lines = [_STATUS_WORDS[placed.status]]
    if placed.xy_m is None:
        lines += [_sentence(placed.message)] if placed.message else []
        if placed.bound > 0.0:
            lines.append(f"At least {_tags(placed.bound)} are needed, {told.euros_of(placed.bound)}.")
        if told.asked.settings.budget_eur is not None:
            lines.append(_budget(told))
        best = next((way for way in told.found.ways if way.left_out <= told.asked.question.unserved_share), None)
        if best is not None:
            lines.append(
                f"The cheapest way out found that serves all: {best.text}, about {_tags(best.tags)}, "
                f"{told.euros_of(best.tags)}."
            )
        return lines
    beside = f" beside {told.installed} installed" if told.installed else ""
    lines.append(
        f"{_tags(placed.new)} to lay{beside}, {told.euros_of(placed.new)} with labour, survey and spares."
    )
    if placed.within_budget:
        lines.append(
            f"{placed.met_share:.2%} of the {placed.samples} sampled runs are served; no choice within the budget "
            f"serves more than {min(placed.bound, 1.0):.2%}."
        )
    elif told.found.stages:
        once = told.found.at_once
        if once is not None and once.xy_m is not None:
            lines.append(f"All stages at once would take {_tags(once.new)}.")
    else:
        lines.append(
            f"No choice of these slots needs fewer than {_tags(math.ceil(placed.bound - 1e-9))} "
            f"({placed.gap:.1%} fewer at most)."
        )
    if told.asked.settings.budget_eur is not None:
        lines.append(_budget(told))
    if told.found.gap is not None:
        lines.append(_gap(told))
    for missed in placed.missed:
        lines.append(
            f"Checked on {missed.runs} fresh random runs ({_demand(missed.demand)}): {missed.count} miss it, "
            f"at most {missed.upper:.2%} of all at 95 %."
            if missed.runs
            else f"There is no run to check {_demand(missed.demand)} on."
        )
    if len(placed.lost) and not placed.within_budget:
        lines.append(f"{len(placed.lost)} of the runs looked at were left out: no slot serves them.")
    return [*lines, _sentence(placed.message)] if placed.message else lines


def page_of(told: Told) -> Page:
    """Return the whole page."""
    placed, question = told.found.placed, told.asked.question
    sections = [_asked(told)]
    if len(placed.lost):
        sections.append(_unserved(told))
    if told.found.ways:
        sections.append(_ways(told))
    if told.found.stages:
        sections.append(_stages(told))
    sections += _floor(told)
    if told.rivals:
        sections.append(_drives(told))
    effort = told.asked.effort
    return Page(
        title="Single tags on the floor",
        question="Where do the tags go on my floor?",
        summary=tuple(summary(told)),
        sections=tuple(sections),
        facts={
            "Command": "layoutopt study tag_placement",
            "Seed": str(told.spec.seed),
            "Slots": f"{len(question.slots)}, {question.slots.kind}"
            + ("" if question.slots.pitch_m is None else f" of {format_length(question.slots.pitch_m)}"),
            "Sampled runs": f"{placed.samples} after {placed.rounds} rounds; {effort.trial_runs} fresh a round",
            "One tag more": f"{euros(question.tag_price_cents / 100)} with labour, survey and spares",
            "Prices": f"{told.spec.prices.name}, {told.spec.prices.date}",
            "Drives": f"{told.trials} of each layout in scenario '{told.problem.design.name}' with "
            f"{told.problem.estimators[0].name}",
            "Failed tasks": str(told.failed),
        },
        data=_data(told),
    )


def _asked(told: Told) -> Section:
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
        paragraphs=(
            "Runs are endless in number, so that samples of them are served; what the choice misses among fresh "
            "ones is added, and the search goes on. A sample is a part of the demand, so that a bound "
            "for it holds for the whole. The check at the end tries every tag with every antenna on runs that "
            "shaped nothing.",
        ),
        parts=(
            Table(
                caption="Demands",
                head=("zone", "straight run of", "along", "without", "tags in view"),
                rows=rows,
                words=4,
            ),
        ),
    )


def _unserved(told: Told) -> Section:
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


def _ways(told: Told) -> Section:
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


def _stages(told: Told) -> Section:
    rows, before = [], told.installed
    names = [", ".join(zone or "whole floor" for zone in stage) for stage in told.asked.settings.stages]
    for name, placed in zip(names, told.found.stages, strict=False):
        cost = tags_cost_eur(told.spec, placed.new, before) if placed.xy_m is not None else math.nan
        rows.append(
            (
                name,
                "–" if placed.xy_m is None else str(placed.new),
                "–" if placed.xy_m is None else str(len(placed.xy_m)),
                f"{placed.bound:.0f}",
                "–" if placed.xy_m is None else euros(cost),
                _missed(placed),
            )
        )
        before = before if placed.xy_m is None else len(placed.xy_m)
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


def _floor(told: Told) -> list[Section]:
    own = next((rival for rival in told.rivals if rival.label == "placed"), None)
    if own is None:
        return []
    scenario = told.problem.design
    return [
        Section(
            heading="The floor",
            paragraphs=(
                f"The layout is layouts/{own.layout.short_key}.toml; `layoutopt draw` makes the drawings and the "
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


def _drives(told: Told) -> Section:
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
            "whole bill, readers included. The same drives for all; errors are means with 95 % intervals.",
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
        f"{missed.share:.2%} ({missed.upper:.2%})" if missed.runs else "no run" for missed in rival.missed
    )


def _missed(placed: Placed) -> str:
    shares = [f"{missed.count} of {missed.runs} (≤ {missed.upper:.2%})" for missed in placed.missed if missed.runs]
    return "; ".join(shares) or "–"


def _gap(told: Told) -> str:
    gap = told.found.gap
    assert gap is not None
    below = (
        f"no choice within the budget serves runs of {format_length(gap.impossible_m)}"
        if gap.impossible_m > 0.0
        else "no shorter length was shown to be impossible"
    )
    return f"Runs of {format_length(gap.length_m)} are served within the budget; {below}."


def _budget(told: Told) -> str:
    asked = told.asked
    survey = f", of which {euros(asked.survey_cents / 100)} go to the survey as such" if asked.survey_cents else ""
    return f"The budget for new tags is {euros(asked.settings.budget_eur or 0.0)}{survey}."


def _demand(demand: Demand) -> str:
    what = f"runs of {format_length(demand.length_m)}" if demand.length_m else "poses"
    where = f" from zone '{demand.zone}'" if demand.zone else ""
    along = " along routes" if demand.along_routes else ""
    return f"{what}{where}{along} see {_tags(demand.tags)}"


def _tags(count: float) -> str:
    return f"{count:g} tag" + ("" if count == 1 else "s")


def _sentence(text: str) -> str:
    return f"{text[0].upper()}{text[1:]}."


def _data(told: Told) -> tuple[Data, ...]:
    placed = told.found.placed
    found = [
        Data(
            name="answer",
            head=("status", "new_tags", "bound", "met_share", "sampled_runs", "rounds", "lost_runs"),
            rows=(
                (
                    placed.status.name,
                    "" if placed.xy_m is None else str(placed.new),
                    f"{placed.bound:.9g}",
                    "" if placed.xy_m is None else f"{placed.met_share:.9g}",
                    str(placed.samples),
                    str(placed.rounds),
                    str(len(placed.lost)),
                ),
            ),
        )
    ]
    if told.rivals:
        rows = [_rival_row(told, rival) for rival in told.rivals]
        head = ("label", "layout", "tags", "missed_runs", "runs", "position_error_m", "standard_error_m", "drives")
        found.append(Data(name="layouts", head=head, rows=tuple(rows)))
    if placed.xy_m is not None and len(placed.xy_m):
        found.append(
            Data(name="tags", head=("x_m", "y_m"), rows=tuple((f"{x:.6f}", f"{y:.6f}") for x, y in placed.xy_m))
        )
    if len(placed.lost):
        cells = unserved_cells(placed.lost, CELL_M)
        rows_of_cells = [(f"{cell.corner_m[0]:g}", f"{cell.corner_m[1]:g}", str(cell.runs)) for cell in cells]
        found.append(Data(name="cells", head=("x_m", "y_m", "runs"), rows=tuple(rows_of_cells)))
    return tuple(found)


def _rival_row(told: Told, rival: Rival) -> tuple[str, ...]:
    table = told.driven.get(rival.label)
    score = None if table is None else table.score(ERROR)
    return (
        rival.label,
        rival.layout.key,
        str(rival.tags),
        str(rival.missed_count),
        str(sum(missed.runs for missed in rival.missed)),
        "" if score is None else f"{score.value:.9g}",
        "" if score is None else f"{score.standard_error:.9g}",
        "" if table is None else str(len(table)),
    )
