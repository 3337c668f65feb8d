"""The page of placed tags: the answer with its bound, the check, the floor, ways out, and drives over it."""

from typing import Final

from layoutopt.score_text import euros
from layoutopt.units import format_length
from solvers.placement_answer import Placed, in_words
from solvers.placement_check import Missed
from solvers.placement_relaxation import unserved_cells
from studies import tag_placement_sections as section
from studies.page import Data, Page
from studies.tag_placement_rivals import Rival
from studies.tag_placement_sections import CELL_M, ERROR
from studies.tag_placement_words import Told, summary

_HEAD: Final = ("status", "new_tags", "bound", "met_share", "sampled_runs", "missed_fresh_runs", "fresh_runs")
_CHECK_HEAD: Final = ("demand", "missed_runs", "runs", "draws", "missed_share", "upper_bound_95")
_OPEN_HEAD: Final = ("least_new_tags", "most_new_tags", "least_unserved_share")
_RIVAL_HEAD: Final = (
    "label",
    "layout",
    "tags",
    "missed_runs",
    "runs",
    "position_error_m",
    "standard_error_m",
    "drives",
)


def page_of(told: Told) -> Page:
    """Return the whole page."""
    placed, question = told.found.placed, told.asked.question
    sections = [section.asked(told)]
    if len(placed.lost):
        sections.append(section.unserved(told))
    if told.found.ways:
        sections.append(section.ways(told))
    if told.found.stages:
        sections.append(section.stages(told))
    if told.found.front is not None and told.found.front.points:
        sections.append(section.front(told))
    sections += section.floor(told)
    if told.rivals:
        sections.append(section.drives(told))
    return Page(
        study="tag_placement",
        title="Single tags on the floor",
        summary=tuple(summary(told)),
        sections=tuple(sections),
        facts={
            "Seed": str(told.spec.seed),
            "Slots": f"{len(question.slots)}, {question.slots.kind}"
            + ("" if question.slots.pitch_m is None else f" of {format_length(question.slots.pitch_m)}"),
            **_runs(told),
            "One tag more": f"{euros(question.tag_price_cents / 100)} with labour, survey and spares",
            "Prices": f"{told.spec.prices.name}, {told.spec.prices.date}",
            "Trials": f"{told.trials} drives of each layout in scenario '{told.problem.design.name}' with "
            f"{told.problem.estimators[0].name}",
            "Failed tasks": str(told.failed),
        },
        data=_data(told),
        found=placed.status.exit_code == 0,
    )


def _data(told: Told) -> tuple[Data, ...]:
    placed, found = told.found.placed, told.found
    tables = [_answer(told)]
    if found.stages:
        rows = [
            (str(number), *_numbers(stage.placed, stage.placed.new))
            for number, stage in enumerate(found.stages, 1)
        ]
        tables.append(Data(name="stages", head=("stage", *_HEAD), rows=tuple(rows)))
    if found.gap is not None:
        length_m = "" if found.gap.length_m is None else f"{found.gap.length_m:.9g}"
        lengths = (length_m, f"{found.gap.impossible_m:.9g}", f"{found.gap.step_m:.9g}")
        tables.append(Data(name="gap", head=("served_m", "impossible_m", "step_m"), rows=(lengths,)))
    if found.front is not None:
        points = [(str(point.tags), *_numbers(point.placed, point.placed.new)) for point in found.front.points]
        tables.append(Data(name="front", head=("most_new_tags", *_HEAD), rows=tuple(points)))
        ranges = [
            (f"{item.low_cost:g}", f"{item.high_cost:g}", "" if item.bound is None else f"{item.bound:.9g}")
            for item in found.front.open_ranges
        ]
        tables.append(Data(name="open_ranges", head=_OPEN_HEAD, rows=tuple(ranges)))
    if placed.missed:
        tables.append(
            Data(name="check", head=_CHECK_HEAD, rows=tuple(_check_row(missed) for missed in placed.missed))
        )
    if told.rivals:
        rivals = [_rival_row(told, rival) for rival in told.rivals]
        tables.append(Data(name="layouts", head=_RIVAL_HEAD, rows=tuple(rivals)))
    if placed.xy_m is not None and len(placed.xy_m):
        places = [(f"{x:.6f}", f"{y:.6f}") for x, y in placed.xy_m]
        tables.append(Data(name="tags", head=("x_m", "y_m"), rows=tuple(places)))
    if len(placed.lost):
        cells = unserved_cells(placed.lost, CELL_M)
        counts = [(f"{cell.corner_m[0]:g}", f"{cell.corner_m[1]:g}", str(cell.runs)) for cell in cells]
        tables.append(Data(name="cells", head=("x_m", "y_m", "runs"), rows=tuple(counts)))
    return tuple(tables)


def _answer(told: Told) -> Data:
    placed = told.found.placed
    row = (*_numbers(placed, told.found.new), str(placed.rounds), str(len(placed.lost)))
    return Data(name="answer", head=(*_HEAD, "rounds", "lost_runs"), rows=(row,))


def _numbers(placed: Placed, new: int) -> tuple[str, ...]:
    """Return the cells under `_HEAD`."""
    known = placed.xy_m is not None
    return (
        placed.status.name,
        str(new) if known else "",
        f"{placed.bound:.9g}",
        f"{placed.met_share:.9g}" if known else "",
        str(placed.samples),
        str(sum(missed.count for missed in placed.missed)) if known else "",
        str(sum(missed.runs for missed in placed.missed)) if known else "",
    )


def _runs(told: Told) -> dict[str, str]:
    """Return how many runs choices were made for, and what looked for missed ones."""
    effort, placed = told.asked.effort, told.found.placed
    along_routes = any(demand.along_routes for demand in told.asked.question.demands)
    if told.within_budgets:
        routes = f", along routes of {effort.budget_routes} routes" if along_routes else ""
        return {"Sampled runs": f"{placed.samples}, drawn evenly{routes}"}
    routes = f", along routes those of {effort.trial_routes} routes" if along_routes else ""
    return {
        "Sampled runs": f"{placed.samples} after {placed.rounds} rounds",
        "Fresh runs a round": f"up to {effort.trial_runs}{routes}",
    }


def _check_row(missed: Missed) -> tuple[str, ...]:
    known = (f"{missed.share:.9g}", f"{missed.upper:.9g}") if missed.runs else ("", "")
    return (in_words(missed.demand), str(missed.count), str(missed.runs), str(missed.draws), *known)


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
