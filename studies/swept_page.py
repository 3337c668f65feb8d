"""The page of a sweep, and the sentences and curves that sweeps share."""

import math
from collections.abc import Mapping
from types import MappingProxyType
from typing import Final

import numpy as np

from layoutopt.plots.curves import Curve, Panel, draw_curves
from layoutopt.plots.front import known_interval
from layoutopt.score_text import euros, percent_text, score_name, shown_unit
from layoutopt.scores import Score
from studies import columns
from studies.cells import ENOUGH_TRIALS, shown_on
from studies.page import Data, Page, Picture, Section, Table
from studies.published.comparison import scaled, with_interval
from studies.swept import (
    ALLOWANCE,
    BASE_RULE,
    GOAL,
    Found,
    Place,
    Sweep,
    SweepStudy,
    change,
    cheapest_meeting,
    largest_meeting,
    largest_within,
)

SCORES: Final = (GOAL, "position_error_p95", "heading_error_mean", "lost_share")
NONE_POINTED_OUT: Final[Mapping[Place, str]] = MappingProxyType({})


def page_of(study: SweepStudy, found: Found, *, failed: int) -> Page:
    """Return the whole page of a sweep."""
    sweep = study.sweep
    counts = sorted({len(table) for table in found.values()})
    panels = [panel for panel in study.panels(found) if panel.curves]
    picture = [
        Picture(name=study.command, caption=_caption(study, counts), drawn=draw_curves(panels)) for _ in panels[:1]
    ]
    first = Section(
        heading="All points",
        paragraphs=study.words(),
        parts=(*picture, _table(sweep, found), *_refused(sweep)),
    )
    return Page(
        study=study.command,
        title=study.title,
        summary=tuple(study.summary(found)),
        sections=(first,),
        facts={
            "Layout": f"{sweep.layout}. {BASE_RULE}",
            "World": sweep.world,
            "Estimators": sweep.estimators,
            "Prices": sweep.prices,
            "Trials": f"{sum(map(len, found.values()))}; {' or '.join(map(str, counts)) or 'none'} a cell, the "
            "same drives for all cells",
            "Seed": str(sweep.seed),
            "Failed tasks": str(failed),
            "Intervals": "± is half the width of the two-sided 95 % interval over drives (Student); differences "
            "are paired by drive",
        },
        data=(_data(sweep, found, study.command),),
    )


def _caption(study: SweepStudy, counts: list[int]) -> str:
    """Return what the figure shows; intervals are not drawn of so few trials that they say nothing."""
    drives = " or ".join(map(str, counts))
    demand = "" if study.sweep.target_m is None else " The dotted level is the demand of the spec."
    return (
        f"{study.title}: means over {drives} drives a point, bars their 95 % intervals where there are enough "
        f"drives for them.{demand}"
    )


def curves_of(
    sweep: Sweep, found: Found, column: str, pointed_out: Mapping[Place, str] = NONE_POINTED_OUT
) -> tuple[Curve, ...]:
    """Return a curve a series of a simulated score, as it is shown, with its intervals where they are known.

    ``pointed_out`` are words of places that get a ring, where there are trials enough to point out anything.
    """
    factor, _ = shown_unit(column)
    made = []
    for series in sweep.series:
        places = [point.place for point in sweep.of(series) if point.place in found]
        if not places:
            continue
        scores = [found[place].score(column) for place in places]
        made.append(
            Curve(
                name=series,
                x=sweep.axis.factor * np.array([place.value for place in places]),
                y=factor * np.array([score.value for score in scores]),
                half_width=factor * np.array([_drawn_reach(score) for score in scores]).T,
                pointed_out=tuple(
                    (number, pointed_out[place])
                    for number, place in enumerate(places)
                    if place in pointed_out and len(found[place]) >= ENOUGH_TRIALS
                ),
            )
        )
    return tuple(made)


def _drawn_reach(score: Score) -> tuple[float, float]:
    """Return how far the interval goes down and up; nothing where too few trials give one worth drawing."""
    ends = known_interval(score)
    return (0.0, 0.0) if ends is None else (score.value - ends[0], ends[1] - score.value)


def exact_curves(sweep: Sweep, column: str, *, factor: float = 1.0) -> tuple[Curve, ...]:
    """Return a curve a series of an exact number of the points."""
    made = []
    for series in sweep.series:
        points = [point for point in sweep.of(series) if column in point.exact]
        if points:
            made.append(
                Curve(
                    name=series,
                    x=sweep.axis.factor * np.array([point.place.value for point in points]),
                    y=factor * np.array([point.exact[column] for point in points]),
                )
            )
    return tuple(made)


def panel_of(
    sweep: Sweep,
    found: Found,
    column: str,
    title: str,
    *,
    marks: tuple[tuple[float, str], ...] = (),
    log_x: bool = False,
    log: bool = False,
    pointed_out: Mapping[Place, str] = NONE_POINTED_OUT,
) -> Panel:
    """Return the panel of a simulated score over what is varied, with the demand on the mean error."""
    demand = () if sweep.target_m is None or column != GOAL else ((1000.0 * sweep.target_m, "demand"),)
    return Panel(
        title=title,
        x_label=sweep.axis.label,
        y_label=f"{score_name(column)} ({shown_unit(column)[1]})",
        curves=curves_of(sweep, found, column, pointed_out),
        marks=marks,
        log_x=log_x,
        log=log,
        levels=demand,
    )


def ends_shown(sweep: Sweep, found: Found) -> dict[Place, str]:
    """Return for each series the largest value that is shown to do, with words for a figure.

    To do is to meet the demand on the mean error or, without one, to keep the error of the base.
    """
    told = {}
    for series in sweep.base:
        if sweep.target_m is None:
            value, words = largest_within(sweep, found, series), f"within {percent_text(ALLOWANCE)} up to"
        else:
            value, words = largest_meeting(sweep, found, series), "meets the demand up to"
        if value is not None:
            told[Place(series, value)] = f"{words} {sweep.axis.text(value)}"
    return told


def shown(score: Score | None, column: str = GOAL) -> str:
    """Return a score as it is shown, with its interval, without unit; that of a share lies not evenly about it."""
    factor, unit = shown_unit(column)
    if score is not None and score.share and not math.isnan(score.value):
        low, high = (factor * end for end in score.interval())
        return f"{factor * score.value:.2g} ({low:.2g} to {high:.2g})"
    return with_interval(None if score is None else scaled(score, factor, unit=unit))


def error_text(found: Found, place: Place) -> str:
    """Return the mean position error of a point with its interval and unit."""
    return f"{shown(found[place].score(GOAL))} mm"


def change_text(difference: Score, column: str = GOAL) -> str:
    """Return a paired difference in words, with its interval, and whether it is shown at all."""
    factor, unit = shown_unit(column)
    low, high = (factor * end for end in difference.interval())
    value = factor * difference.value
    way = "more" if value > 0.0 else "less"
    if not (math.isfinite(low) and math.isfinite(high)):
        return f"{_figures(abs(value), 3)} {unit} {way}"
    if low <= 0.0 <= high:
        return f"no difference shown ({_figures(low, 2)} to {_figures(high, 2)} {unit}, paired)"
    ends = (low, high) if value > 0.0 else (-high, -low)
    return (
        f"{_figures(abs(value), 3)} {unit} {way} ({_figures(ends[0], 3)} to {_figures(ends[1], 3)} {unit}, paired)"
    )


def _figures(value: float, count: int) -> str:
    """Return a number with so many figures, and never as a power of ten.

    >>> _figures(-587.3, 2), _figures(0.4567, 2)
    ('-587', '0.46')
    """
    return f"{value:.0f}" if abs(value) >= 10.0**count else f"{value:.{count}g}"


def growth_lines(sweep: Sweep, found: Found, series: str) -> list[str]:
    """Return where a demand is met, up to which value the error stays as at the base, and what it ends at."""
    base, places = sweep.base[series], [point.place for point in sweep.of(series) if point.place in found]
    if base not in found or not places:
        return []
    axis, drives = sweep.axis, len(found[base])
    told = shown_on(drives)
    start = f"that at {axis.text(base.value)} ({error_text(found, base)}, {drives} drives)"
    within = largest_within(sweep, found, series)
    if within is None:
        line = f"{series}: no larger {axis.words} is {told} to keep the mean error within "
    else:
        line = f"{series}: up to a {axis.words} of {axis.text(within)} the mean error is {told} to stay within "
    line += f"{percent_text(ALLOWANCE)} of {start}"
    difference = change(sweep, found, places[-1])
    if difference is not None:
        line += (
            f"; at {axis.text(places[-1].value)} it is {error_text(found, places[-1])}, {change_text(difference)}"
        )
    lines = [f"{line}."]
    if sweep.target_m is not None:
        meeting = largest_meeting(sweep, found, series)
        demand = f"the demand of {1000.0 * sweep.target_m:g} mm on the mean error"
        met = (
            f"not even at the least {axis.words} tried is {demand} {told} to be met"
            if meeting is None
            else f"up to a {axis.words} of {axis.text(meeting)}, of those tried, {demand} is {told} to be met"
        )
        lines.insert(0, f"{series}: {met}.")
    return lines


def cheapest_line(sweep: Sweep, found: Found) -> list[str]:
    """Return the cheapest point that is shown to meet the demand on the mean error; nothing without a demand."""
    if sweep.target_m is None:
        return []
    demand = f"the demand of {1000.0 * sweep.target_m:g} mm on the mean error, each asked at one-sided 95 %"
    told = shown_on(min(map(len, found.values())))
    point = cheapest_meeting(sweep, found)
    if point is None:
        return [f"None of {len(found)} choices is {told} to meet {demand}."]
    return [
        f"The cheapest of {len(found)} choices that is {told} to meet {demand}: {point.place.series}, "
        f"{sweep.axis.words} {sweep.axis.text(point.place.value)}, {error_text(found, point.place)}, "
        f"{euros(point.exact['cost_eur'])}."
    ]


def _table(sweep: Sweep, found: Found) -> Table:
    exact = _exact_names(sweep)
    rows = []
    for point in sweep.points:
        table = found.get(point.place)
        difference = change(sweep, found, point.place)
        rows.append(
            (
                point.place.series,
                sweep.axis.text(point.place.value),
                *(shown(None if table is None else table.score(name), name) for name in SCORES),
                "–" if difference is None else shown(difference),
                *(_exact_text(point.exact.get(name), name) for name in exact),
            )
        )
    heads = [f"{score_name(name)}, {shown_unit(name)[1]}" for name in SCORES]
    return Table(
        caption="All points; what an error adds is against the base of its series, paired by drive",
        head=("series", sweep.axis.words, *heads, "mean error more, mm", *map(_exact_head, exact)),
        rows=tuple(rows),
        words=2,
    )


def _exact_names(sweep: Sweep) -> list[str]:
    return list(dict.fromkeys(name for point in sweep.points for name in point.exact))


_EXACT: Final = {"m": (1000.0, "mm"), "eur": (1.0, "EUR"), "share": (100.0, "%")}
"""By the end of a column's name: how an exact number is shown."""


def _exact_head(name: str) -> str:
    words, _, end = name.rpartition("_")
    if end not in _EXACT:
        return name.replace("_", " ")
    return f"{words.replace('_', ' ')}, {_EXACT[end][1]}"


def _exact_text(value: float | None, name: str) -> str:
    if value is None:
        return "–"
    if name.endswith("_eur"):
        return euros(value).removesuffix("EUR").strip()
    return f"{_EXACT.get(name.rpartition('_')[2], (1.0, ''))[0] * value:.4g}"


def _refused(sweep: Sweep) -> list[Table]:
    if not sweep.refused:
        return []
    return [Table(caption="Left out", head=("what", "why"), rows=sweep.refused, words=2)]


def _data(sweep: Sweep, found: Found, name: str) -> Data:
    exact = _exact_names(sweep)
    heads = [head for score in SCORES for head in columns.named(score, columns.unit_of(score))]
    rows = []
    for point in sweep.points:
        table, difference = found.get(point.place), change(sweep, found, point.place)
        unknown = [""] * len(heads)
        scores = unknown if table is None else [cell for s in SCORES for cell in columns.pair(table.score(s))]
        rows.append(
            (
                point.place.series,
                columns.number(point.place.value),
                "0" if table is None else str(len(table)),
                *scores,
                *(["", ""] if difference is None else columns.pair(difference)),
                *(columns.number(point.exact[e]) if e in point.exact else "" for e in exact),
            )
        )
    added = columns.named("position_error_more", "m")
    return Data(
        name=name,
        head=("series", sweep.axis.name, "trials", *heads, *added, *exact),
        rows=tuple(rows),
    )
