"""The page of antennas and their yaw: error by yaw, reach of the recommended ones, cost, exact scores, limits."""

import math
from typing import Final

import numpy as np

from layoutopt.identity import FloatArray
from layoutopt.plots.detection_reach import draw_detection_reach
from layoutopt.plots.error_by_yaw import YawCurve, draw_error_by_yaw
from layoutopt.result import Status
from layoutopt.score_text import euros, limit_text, score_name, score_text
from layoutopt.scores import TRACKING_UNITS, Score
from layoutopt.tracking_world import TrackingWorld
from objectives.uhf_coverage import chance_somewhere, hearing_chance
from studies import columns
from studies.antenna_yaw_results import Driven, cost_error_front, cost_eur, error_m, fresh_scores, rivals_of
from studies.antenna_yaw_setting import CHEAP, COST, ERROR
from studies.antenna_yaw_words import (
    Told,
    agreement,
    correlation_words,
    ends_mm,
    median_of,
    mm_text,
    summary,
)
from studies.page import Data, Page, Picture, Section, Table
from studies.published.comparison import scaled, with_interval

_MM: Final = 1000.0
_PLAN_POINTS: Final = 160
"""Lattice points along the longer side of the plan: a line of equal chance then looks smooth."""


def page_of(told: Told) -> Page:
    """Return the whole page."""
    chosen = told.verdict.recommended
    world = told.problem.design.tracking
    assert world is not None
    sections = [_yaw_section(told)] if told.driven else []
    if chosen is not None:
        sections += [_chosen_section(told, chosen, world), _cost_section(told), _cheap_section(told)]
    return Page(
        study="antenna_yaw",
        title="UHF antennas and their yaw",
        summary=tuple(summary(told)),
        found=told.verdict.status.exit_code == 0,
        sections=tuple(sections),
        facts={
            "World": world_text(world),
            "Tracker": told.tracker,
            "Trials": f"{told.trials} of {told.problem.design.duration_s:g} s for each choice, the same random "
            "numbers for all; as many fresh ones for candidates",
            "Seed": str(told.seed),
            "Prices": told.prices,
            "Failed tasks": str(told.failed),
            "Intervals": "two-sided 95 %: Student for means, order statistics for medians, paired by trial for "
            "differences, bootstrap over trials for rank correlations; limits hold at one-sided 95 %",
        },
        data=(_choices_data(told), _differences_data(told), _agreement_data(told)),
    )


def world_text(world: TrackingWorld) -> str:
    """Return a world of tracking in words."""
    return (
        f"a person who walks at {world.walking_speed_m_s:g} m/s round {len(world.walk_m)} corners, "
        f"{world.clutter_count} round things and {world.bystanders} bystanders about, a robot that stands; "
        f"half of the readings succeed {world.signal.half_range_m:g} m ahead"
    )


def _yaw_section(told: Told) -> Section:
    chosen = told.verdict.recommended
    limit = next((item.upper for item in told.problem.limits if item.score == ERROR), None)
    counts = sorted({entry.choice.count for entry in told.driven})
    marked = None
    if chosen is not None:
        word = "nearest" if told.verdict.status is Status.TARGET_NOT_MET else "recommended"
        number = counts.index(chosen.choice.count)
        point = _of_count(told, chosen.choice.count).index(chosen)
        marked = (number, point, f"{word}:\n{chosen.choice.label}")
    picture = Picture(
        name="error_by_yaw",
        caption="Mean tracking error of each choice over the same trials, with 95 % intervals.",
        drawn=draw_error_by_yaw(
            [_curve(told, count) for count in counts],
            marked=marked,
            limit_mm=None if limit is None else _MM * limit,
        ),
    )
    rows = tuple(_choice_row(entry) for entry in told.driven)
    head = (
        "choice",
        "cost, EUR",
        "mean error, mm",
        "median, mm",
        "95 %, mm",
        "lost, %",
        "heard, %",
        "laser match, %",
    )
    return Section(
        heading="Error against yaw",
        paragraphs=(
            "With n antennas the outer ones look aside by the yaw to the left and to the right, the others evenly "
            "between; one antenna alone looks aside by it. All choices met the same random numbers, so paired "
            "differences are sharper than bars that overlap.",
        ),
        parts=(
            picture,
            Table(
                caption="Every choice; coverage is exact, all else over trials",
                head=(*head, "walk covered, %", "area covered, %", "ambiguous pairs, %"),
                rows=rows,
            ),
        ),
    )


def _curve(told: Told, count: int) -> YawCurve:
    own = _of_count(told, count)
    low, high = ends_mm([entry.item.scores[ERROR] for entry in own])
    return YawCurve(
        name=f"{count} antenna{'s' if count > 1 else ''}",
        yaw_deg=np.array([math.degrees(entry.choice.yaw_rad) for entry in own]),
        error_mm=_MM * np.array([error_m(entry) for entry in own]),
        low_mm=low,
        high_mm=high,
    )


def _of_count(told: Told, count: int) -> list[Driven]:
    return [entry for entry in told.driven if entry.choice.count == count]


def _choice_row(entry: Driven) -> tuple[str, ...]:
    middle = median_of(entry)
    ends = f" ({_MM * middle.low:.0f} to {_MM * middle.high:.0f})" if math.isfinite(middle.low) else ""
    scores = entry.item.scores
    return (
        entry.choice.label,
        f"{cost_eur(entry):.0f}",
        mm_text(entry.outcomes),
        f"{_MM * middle.value:.0f}{ends}",
        f"{_MM * scores['tracking_error_p95'].value:.0f}",
        _percent(scores.get("tracking_lost_share")),
        _percent(scores.get("detection_share")),
        _percent(scores.get("laser_match_share")),
        *(_percent(scores.get(name)) for name in CHEAP),
    )


def _percent(score: Score | None) -> str:
    return "–" if score is None else f"{100.0 * score.value:.1f}"


def _chosen_section(told: Told, chosen: Driven, world: TrackingWorld) -> Section:
    x_m, y_m, chance = reach_of(told, chosen, world)
    rows = [
        (
            rival.choice.label,
            f"{cost_eur(rival) - cost_eur(chosen):+.0f}",
            with_interval(scaled(difference, _MM, unit="mm")),
            difference_words(difference),
        )
        for rival, difference in rivals_of(told.driven, chosen)
    ]
    parts: list[Table | Picture] = [
        Picture(
            name="reach",
            caption=f"{chosen.choice.label}: chance that at least one antenna hears the tag in a reading. Walls "
            "and people do not weaken signals in this model.",
            drawn=draw_detection_reach(
                site=told.problem.design.site,
                robot=told.problem.design.robot,
                world=world,
                antennas=chosen.choice.layout.readers_of("signal")[0],
                x_m=x_m,
                y_m=y_m,
                chance=chance,
            ),
        ),
        Table(
            caption="Error of others less that of the recommended one, paired by trial: the next of its cost, and "
            "the most accurate of each other cost",
            head=("choice", "cost, EUR more", "error more, mm", "which errs more"),
            rows=tuple(rows),
        ),
    ]
    if told.problem.limits:
        parts.append(_limits_table(told, chosen))
    return Section(
        heading="The recommended antennas",
        paragraphs=(
            "The best of many means is mostly lucky as well. Fresh trials, on which nothing was chosen, judge the "
            "recommended choice again, and limits count there.",
        ),
        parts=tuple(parts),
    )


def difference_words(difference: Score) -> str:
    """Return which of two choices errs more, as far as the interval of their difference tells."""
    low, high = difference.interval()
    if low > 0.0:
        return "this one"
    return "the recommended one" if high < 0.0 else "open"


def _limits_table(told: Told, chosen: Driven) -> Table:
    scores = chosen.item.scores if chosen.fresh is None else fresh_scores(told.problem, chosen)
    rows = tuple(
        (
            limit_text(limit),
            score_text(score, limit.score, bounded=False),
            score_text(Score(value=limit.bound(score), unit=score.unit), limit.score),
            "yes" if limit.met(score) else "not shown",
        )
        for limit, score in told.problem.limits_on(scores)
    )
    where = "the trials of the comparison" if chosen.fresh is None else "fresh trials"
    return Table(caption=f"Limits, on {where}", head=("limit", "score", "95 % bound", "met"), rows=rows)


def reach_of(told: Told, chosen: Driven, world: TrackingWorld) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return a lattice over the site, x and y, and the chance there that at least one antenna hears a tag."""
    xmin, ymin, xmax, ymax = told.problem.design.site.bounds_m
    pitch_m = max(xmax - xmin, ymax - ymin) / _PLAN_POINTS
    x_m = np.linspace(xmin, xmax, max(2, math.ceil((xmax - xmin) / pitch_m) + 1))
    y_m = np.linspace(ymin, ymax, max(2, math.ceil((ymax - ymin) / pitch_m) + 1))
    places_m = np.stack(np.meshgrid(x_m, y_m), axis=-1).reshape(-1, 2)
    groups = chosen.choice.layout.readers_of("signal")
    chance = np.concatenate([hearing_chance(group, world, places_m) for group in groups], axis=1)
    return x_m, y_m, chance_somewhere(chance).reshape(len(y_m), len(x_m))


def _cost_section(told: Told) -> Section:
    labels = {entry.choice.layout.key: entry for entry in told.driven}
    rows = tuple(
        (
            labels[item.layout.key].choice.label,
            euros(item.scores[COST].value),
            mm_text(labels[item.layout.key].outcomes),
        )
        for item in cost_error_front(told.driven).members
    )
    return Section(
        heading="Cost and error",
        paragraphs=(
            "Cost is that of UHF readers, their antennas and the tags given out, for all robots, with spares and "
            "labour. Floor tags, their readers and laser scanners are not in it. Members of the front: no other "
            "choice is cheaper and more accurate by its mean error.",
        ),
        parts=(Table(caption="The front", head=("choice", "cost", "mean error, mm"), rows=rows),),
    )


def _cheap_section(told: Told) -> Section:
    rows = tuple((score_name(name), correlation_words(agreement(told, name))) for name in CHEAP)
    return Section(
        heading="What exact scores tell of the error",
        paragraphs=(
            "Exact scores take milliseconds. Spearman's rank correlation says how well each orders these choices "
            "as the simulated error does; coverage should go with less error, so near −1 is good. The interval is "
            "over trials: other choices may give another.",
        ),
        parts=(
            Table(
                caption=f"Rank correlation with the mean error over {len(told.driven)} choices",
                head=("score", "rank correlation (95 % interval)"),
                rows=rows,
            ),
        ),
    )


def _choices_data(told: Told) -> Data:
    rows = []
    for entry in told.driven:
        scores, middle = entry.item.scores, median_of(entry)
        cells = [entry.choice.layout.short_key, str(entry.choice.count), columns.number(entry.choice.yaw_rad)]
        cells += [str(len(entry.outcomes)), columns.number(cost_eur(entry))]
        cells += [columns.number(scores[name].value) if name in scores else "" for name in CHEAP]
        for name in TRACKING_UNITS:
            cells += columns.pair(scores[name])
        cells += [columns.number(value) for value in (middle.value, middle.low, middle.high)]
        rows.append(tuple(cells))
    head = ["layout", "antennas", "yaw_rad", "trials", "cost_eur", *CHEAP]
    for name in TRACKING_UNITS:
        head += columns.named(name, columns.unit_of(name))
    head += ["tracking_error_median_m", "tracking_error_median_low_m", "tracking_error_median_high_m"]
    return Data(name="choices", head=tuple(head), rows=tuple(rows))


def _differences_data(told: Told) -> Data:
    chosen = told.verdict.recommended
    found = [] if chosen is None else rivals_of(told.driven, chosen)
    rows = tuple(
        (
            rival.choice.layout.short_key,
            rival.choice.label,
            columns.number(cost_eur(rival)),
            columns.number(difference.value),
            *(columns.number(end) for end in difference.interval()),
        )
        for rival, difference in found
    )
    head = ("layout", "choice", "cost_eur", "error_more_m", "error_more_low_m", "error_more_high_m")
    return Data(name="differences", head=head, rows=rows)


def _agreement_data(told: Told) -> Data:
    rows = []
    for name in CHEAP:
        item = agreement(told, name)
        rows.append((name, *(columns.number(value) for value in (item.value, item.low, item.high))))
    return Data(name="rank_correlations", head=("score", "rank_correlation", "low", "high"), rows=tuple(rows))
