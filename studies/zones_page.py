"""The page of the study of zones: the two layouts, where the money goes, and how well predictions held."""

import math
from collections.abc import Mapping
from typing import Final

from layoutopt.plots.cost_bars import draw_cost_bars
from layoutopt.plots.layout_plan import draw_layout_plan
from layoutopt.result import Evaluated
from layoutopt.score_text import NOT_KNOWN, euros, interval_text, limit_text, score_name, score_text
from layoutopt.scores import Score
from studies.page import Data, Page, Picture, Section, Table
from studies.zones_closing import OPEN, Closed
from studies.zones_results import WORDS, Results, agreement, summary
from studies.zones_search import COMPOSED, UNIFORM

TITLE: Final = "Patterns by zone"
_KINDS: Final = (COMPOSED, UNIFORM)
_MOST_ROWS: Final = 60
"""Rows of a long table that the page shows, the cheapest layouts first; all are in the table for programs."""


def page_of(results: Results, *, facts: Mapping[str, str]) -> Page:
    """Return the whole page."""
    return Page(
        study="zones",
        title=TITLE,
        summary=tuple(summary(results)),
        sections=tuple(
            part
            for part in (
                _layouts(results),
                _money(results),
                _verdicts(results),
                _closing(results),
                _predictions(results),
            )
            if part.parts
        ),
        facts=facts,
        found=results.status.exit_code == 0,
        data=tuple(
            data
            for data in (
                _layout_data(results),
                _money_data(results),
                _closing_data(results),
                _prediction_data(results),
            )
            if data.rows
        ),
    )


def _shown(results: Results) -> list[tuple[str, Evaluated]]:
    """Return the accepted layout of each kind, or of those that were tried the one that missed by least."""
    ratios = {one.item.layout.key: one.worst.ratio for one in results.verdicts()}
    found = []
    for kind in _KINDS:
        one = results.kinds.get(kind)
        if one is not None and one.tried:
            nearest = min(one.tried, key=lambda item: (ratios.get(item.layout.key, math.inf), item.layout.key))
            found.append((kind, one.accepted or nearest))
    return found


def _layouts(results: Results) -> Section:
    setting, shown = results.setting, _shown(results)
    rows = []
    for kind, item in shown:
        for limit in setting.simulated_limits:
            for scenario in setting.problem.held_out:
                score = results.held_out.get((item.layout.key, scenario.name), {}).get(limit.score)
                met = "–" if score is None else "yes" if limit.met(score) else "no"
                rows.append(
                    (kind, limit_text(limit), scenario.name, score_text(score, limit.score, bounded=False),
                     interval_text(score, limit.score), met)
                )  # fmt: skip
    parts: list[Table | Picture] = []
    if shown:
        parts.append(
            Table(
                caption="The layouts",
                head=("kind", "layout", "held", "cost"),
                rows=tuple(
                    (
                        WORDS[kind],
                        f"{item.layout.label} ({item.layout.short_key})",
                        "yes" if results.accepted(kind) is item else "no",
                        euros(item.scores["cost"].value),
                    )
                    for kind, item in shown
                ),
                words=3,
            )
        )
        parts += [
            Picture(
                name=f"plan_{kind}",
                caption=f"Floor, zones and tags of the {WORDS[kind]} {item.layout.short_key}",
                drawn=draw_layout_plan(
                    layout=item.layout,
                    site=setting.problem.design.site,
                    robot=setting.problem.design.robot,
                    tag_map=item.layout.floor_tags.lay_on(setting.problem.design.site),
                ),
            )
            for kind, item in shown
        ]
    if rows:
        parts.append(
            Table(
                caption="Every limit on held-out drives; interval of the mean at 95 %, met at 95 % one-sided",
                head=("kind", "limit", "scenario", "mean ± standard error", "interval", "met"),
                rows=tuple(rows),
                words=6,
            )
        )
    return Section(
        heading="The layouts",
        paragraphs=(
            "A layout has either one pattern everywhere or patterns by zone. Both were looked for among the same "
            "reader groups, raced on the same drives, and tried on held-out drives, cheapest first, until one met "
            "every limit there. Those that would miss a limit if all held-out drives went as the first ones did "
            "were left out.",
            *setting.notes,
        ),
        parts=tuple(parts),
    )


def _money(results: Results) -> Section:
    rows = []
    costs_eur: dict[str, dict[str, float]] = {}
    for kind, item in _shown(results):
        money = results.money(item)
        places = [zone or "floor elsewhere" for zone in results.setting.zones]
        rows.append((kind, "readers", "–", euros(money.readers_eur)))
        rows += [
            (kind, place, str(count), euros(cost))
            for place, count, cost in zip(places, money.tags, money.floor_eur, strict=True)
        ]
        rows.append((kind, "all", str(sum(money.tags)), euros(money.total_eur)))
        of_tags = {f"tags: {place}": cost for place, cost in zip(places, money.floor_eur, strict=True)}
        costs_eur[WORDS[kind].removeprefix("layout with ")] = {"readers": money.readers_eur, **of_tags}
    return Section(
        heading="Where the money goes",
        paragraphs=(
            "Costs of a layout are exact. What its tags cost, with labour, spares and survey, is divided by their "
            "number.",
        ),
        parts=(
            Picture(
                name="costs",
                caption="What readers and the tags of each place cost, with labour, survey and spares",
                drawn=draw_cost_bars(costs_eur),
            ),
            Table(
                caption="What readers and the tags of each place cost, with labour, survey and spares",
                head=("kind", "place", "tags", "cost"),
                rows=tuple(rows),
                words=2,
            ),
        )
        if rows
        else (),
    )


def _verdicts(results: Results) -> Section:
    rows = tuple(
        (
            one.kind,
            f"{one.item.layout.label} ({one.item.layout.short_key})",
            one.word,
            f"{score_name(one.worst.limit.score)}, {one.worst.scenario}",
            euros(one.item.scores["cost"].value),
            str(one.worst.score.count),
            f"{one.worst.ratio:.3f}",
        )
        for one in results.verdicts()
    )
    return Section(
        heading="What was tried",
        paragraphs=(
            "Every layout that had held-out drives, with the score whose 95 % bound is worst beside its demand: a "
            "layout holds if no bound is more than its demand. Those left out had a first look only; theirs is "
            "the bound if all drives went as the first ones did.",
        ),
        parts=(
            Table(
                caption="Held-out drives of each layout; the count is of drives that say something of the score",
                head=("kind", "layout", "verdict", "worst score", "cost", "drives", "bound over demand"),
                rows=rows,
                words=4,
            ),
        )
        if rows
        else (),
    )


def _closed(results: Results) -> list[tuple[str, Closed]]:
    """Return the layouts of the closing round with their kind, the open ones of each kind first."""
    closing = results.progress.closing
    if closing is None:
        return []
    return [
        (kind, one)
        for kind in _KINDS
        for one in sorted(closing.closed.get(kind, ()), key=lambda one: one.word != OPEN)
    ]


def _closing(results: Results) -> Section:
    rows = tuple(
        (
            kind,
            f"{one.item.layout.label} ({one.item.layout.short_key})",
            one.word,
            "–" if one.worst is None else f"{score_name(one.worst.limit.score)}, {one.worst.scenario}",
            euros(one.item.scores["cost"].value),
            " + ".join(map(str, one.drives.values())),
            "–" if one.worst is None else f"{one.worst.ratio:.2f}",
            f"{one.evidence:.2g}",
        )
        for kind, one in _closed(results)
    )
    return Section(
        heading="What remains open",
        paragraphs=(
            "Of the layouts below the accepted one of their kind that were neither shown to do nor to miss the "
            "cheapest had more held-out drives, in blocks that double, the shortest block first, until each was "
            "shown to miss a limit, or to hold, or the drives for this round were spent. A block is "
            "driven where the mean is most beyond its limit. All drives of a layout count together, those of the "
            "search too; the evidence that it misses reaches 1 with a small probability if it meets every limit, "
            "whatever the distribution of errors and however often it is looked at.",
            "Drives come in the order of their numbers, whether or not their route enters a zone. Routes are "
            "known before, and to leave out those that pass a zone by would save drives where that zone alone is "
            "in question, but all other scores would be of a selection of routes.",
        ),
        parts=(
            Table(
                caption="Layouts of the closing round, open ones first. Drives are those of each held-out "
                "scenario; evidence from 1 on shows a miss",
                head=("kind", "layout", "verdict", "worst mean", "cost", "drives", "mean over demand", "evidence"),
                rows=rows[:_MOST_ROWS],
                words=4,
            ),
        )
        if rows
        else (),
    )


def _predictions(results: Results) -> Section:
    rows = tuple(
        (
            one.layout.short_key,
            score_name(one.name),
            score_text(one.predicted, one.name),
            score_text(one.simulated, one.name),
            interval_text(one.off, one.name, signed=True),
        )
        for one in results.compared[:_MOST_ROWS]
    )
    return Section(
        heading="How well predictions held",
        paragraphs=(
            "What a composed layout would do was predicted zone by zone from uniform layouts on the same drives, "
            "to choose what to simulate; no prediction stands in the results above. A robot that leaves a coarse "
            "zone brings its error into the next, which predictions leave out.",
            agreement(results),
        ),
        parts=(
            Table(
                caption="Predicted and simulated on the same drives of the search; 95 % interval of the paired "
                "difference, simulated less predicted",
                head=("layout", "score", "predicted", "simulated", "difference"),
                rows=rows,
                words=2,
            ),
        )
        if rows
        else (),
    )


def _layout_data(results: Results) -> Data:
    rows = []
    for kind, one in results.kinds.items():
        for item in one.looked:
            for scenario in results.setting.problem.held_out:
                scores = results.held_out.get((item.layout.key, scenario.name), {})
                for limit in results.setting.simulated_limits:
                    rows.append(
                        (
                            kind,
                            item.layout.key,
                            item.layout.label,
                            f"{item.scores['cost'].value:.2f}",
                            scenario.name,
                            limit.score,
                            _number(limit.end),
                            *_cells(scores.get(limit.score)),
                            "yes" if item is one.accepted else "no",
                        )
                    )
    return Data(
        name="held_out",
        head=(
            "kind", "layout", "label", "cost_eur", "scenario",
            "score", "limit", "value", "standard_error", "count", "accepted",
        ),
        rows=tuple(rows),
    )  # fmt: skip


def _money_data(results: Results) -> Data:
    rows = []
    for kind, item in _shown(results):
        money = results.money(item)
        rows.append((kind, item.layout.key, "readers", "", f"{money.readers_eur:.2f}"))
        rows += [
            (kind, item.layout.key, zone or "floor elsewhere", str(count), f"{cost:.2f}")
            for zone, count, cost in zip(results.setting.zones, money.tags, money.floor_eur, strict=True)
        ]
    return Data(name="money", head=("kind", "layout", "place", "tags", "cost_eur"), rows=tuple(rows))


def _closing_data(results: Results) -> Data:
    rows = []
    for kind, one in _closed(results):
        for scenario, drives in one.drives.items():
            worst = one.worst
            rows.append(
                (
                    kind,
                    one.item.layout.key,
                    one.item.layout.label,
                    f"{one.item.scores['cost'].value:.2f}",
                    one.word,
                    scenario,
                    str(drives),
                    _number(one.evidence),
                    "" if worst is None else worst.scenario,
                    "" if worst is None else worst.limit.score,
                    NOT_KNOWN if worst is None else _number(worst.ratio),
                    *_cells(None if worst is None else worst.score),
                )
            )
    return Data(
        name="closing",
        head=(
            "kind", "layout", "label", "cost_eur", "verdict", "scenario", "drives",
            "evidence", "worst_scenario", "worst_score", "mean_over_demand", "value", "standard_error", "count",
        ),
        rows=tuple(rows),
    )  # fmt: skip


def _prediction_data(results: Results) -> Data:
    return Data(
        name="predictions",
        head=(
            "layout", "score",
            "predicted", "predicted_standard_error", "predicted_count",
            "simulated", "simulated_standard_error", "simulated_count",
            "difference", "difference_standard_error", "difference_count",
        ),
        rows=tuple(
            (one.layout.key, one.name, *_cells(one.predicted), *_cells(one.simulated), *_cells(one.off))
            for one in results.compared
        ),
    )  # fmt: skip


def _cells(score: Score | None) -> tuple[str, str, str]:
    if score is None or math.isnan(score.value):
        return NOT_KNOWN, NOT_KNOWN, "0"
    error = _number(score.standard_error) if math.isfinite(score.standard_error) else NOT_KNOWN
    return _number(score.value), error, str(score.count)


def _number(value: float) -> str:
    return f"{value:.9g}"
