"""What the report tells of each layout a user may choose: a card with picture, cost split, scores and files."""

import json
import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

from layoutopt.layout import Layout
from layoutopt.parts import READER_ITEMS, TAG_ITEMS, BillLine, Scope
from layoutopt.plots.figures import SvgAxis, SvgFrame
from layoutopt.plots.front import COST
from layoutopt.result import Evaluated
from layoutopt.score_text import score_name, shown_unit
from layoutopt.scores import Score
from objectives.cost import Cost
from studies.findings import Findings
from studies.held_out import own_rows

KINDS: Final = ("tags", "reader modules", "labour", "all else")
"""What the lines of a bill are grouped into to ask what prices do; the last group keeps its prices."""
LAYOUT_FILE: Final = "layout file"
"""Name of the link to a layout's own file; links beside it are of drawings and tables."""
_SCORES: Final = ("position_error_mean", "position_error_p95", "heading_error_mean", "lost_share")


@dataclass(frozen=True, slots=True, kw_only=True)
class CardScore:
    """A score of a layout in the search, and on each held-out scenario in their order; ``None``: not known."""

    name: str
    search: Score | None
    held_out: tuple[Score | None, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class LayoutCard:
    """One layout of the front, or a recommended one beside it.

    Attributes
    ----------
    anchor
        Name of its place on the page.
    bound
        The largest of the one-sided 95 % upper bounds of the goal in search and on held-out drives: infinite
        where one of them is not known.
    split, by_kind
        The cost by scope and by `KINDS`, EUR; empty without prices.
    lines
        The lines of its bill: index in `KINDS`, quantity, price.
    place
        Where its mark lies in the figure of the front; ``None`` without a figure.
    picture
        An ``<svg>`` element, or empty.
    files
        Name and link of what was made of it.
    draw
        Command that makes drawings, empty where there are some or no file to draw from.
    """

    anchor: str
    layout: Layout
    roles: tuple[str, ...]
    on_front: bool
    cost: Score
    error: Score
    bound: float
    split: Mapping[Scope, float]
    by_kind: Mapping[str, float]
    lines: tuple[tuple[int, float, float], ...]
    scores: tuple[CardScore, ...]
    place: tuple[float, float] | None
    picture: str
    files: Mapping[str, str]
    draw: str


def cards_of(
    findings: Findings,
    *,
    frame: SvgFrame | None,
    pictures: Mapping[str, str],
    files: Mapping[str, Mapping[str, str]],
) -> list[LayoutCard]:
    """Return a card for each member of the front and each recommended layout, by rising cost.

    Parameters
    ----------
    frame
        Where the axes of the figure of the front lie in it.
    pictures, files
        By key of a layout: its picture, and its files, name to link.
    """
    front = {item.layout.key for item in findings.result.front.members}
    chosen = [*findings.result.front.members, *findings.result.recommended.values()]
    cost, goal = findings.problem.goals[:2]
    unique = {item.layout.key: item for item in chosen if cost in item.scores and goal in item.scores}
    ordered = sorted(unique.values(), key=lambda item: (item.scores[cost].value, item.layout.key))
    return [
        _card(
            item,
            findings,
            on_front=item.layout.key in front,
            frame=frame,
            picture=pictures.get(item.layout.key, ""),
            files=files.get(item.layout.key, {}),
        )
        for item in ordered
    ]


def _card(
    item: Evaluated,
    findings: Findings,
    *,
    on_front: bool,
    frame: SvgFrame | None,
    picture: str,
    files: Mapping[str, str],
) -> LayoutCard:
    problem = findings.problem
    cost, goal = problem.goals[:2]
    objective = cost_objective(findings)
    bill = None if objective is None else objective.bill(item.layout, problem.design)
    lines = () if bill is None else bill.lines
    held_out = held_out_of(findings, item.layout)
    return LayoutCard(
        anchor=f"layout-{item.layout.short_key}",
        layout=item.layout,
        roles=tuple(
            role for role, other in findings.result.recommended.items() if other.layout.key == item.layout.key
        ),
        on_front=on_front,
        cost=item.scores[cost],
        error=item.scores[goal],
        bound=_bound([item.scores[goal], *(scores.get(goal) for scores in held_out.values())]),
        split={} if bill is None else {scope: bill.total_of(scope) for scope in Scope},
        by_kind={
            kind: sum(line.total_cents for line in lines if kind_of(line) == number) / 100
            for number, kind in enumerate(KINDS)
        },
        lines=tuple((kind_of(line), line.quantity, line.price_eur) for line in lines),
        scores=tuple(
            CardScore(
                name=name,
                search=item.scores.get(name),
                held_out=tuple(scores.get(name) for scores in held_out.values()),
            )
            for name in dict.fromkeys((goal, *_SCORES))
            if name in item.scores or any(name in scores for scores in held_out.values())
        ),
        place=_place(item, goal, frame),
        picture=picture,
        files=files,
        draw=f"layoutopt draw {files[LAYOUT_FILE]} --out drawings/{item.layout.short_key}"
        if set(files) == {LAYOUT_FILE}
        else "",
    )


def cost_objective(findings: Findings) -> Cost | None:
    """Return what prices the layouts of a study; nothing if its problem has no prices."""
    return next((one for one in findings.problem.objectives if isinstance(one, Cost)), None)


def held_out_of(findings: Findings, layout: Layout) -> dict[str, Mapping[str, Score]]:
    """Return the held-out scores of a layout with the estimator of the search, by scenario; empty if not tried."""
    found = {row.scenario: row.scores or {} for row in own_rows(findings.problem, findings.validations, layout)}
    return {scenario.name: found.get(scenario.name, {}) for scenario in findings.problem.held_out}


def kind_of(line: BillLine) -> int:
    """Return to which of `KINDS` a line of a bill belongs; spares follow the item, labour is any hour of work."""
    if line.item in TAG_ITEMS:
        return 0
    if line.item in READER_ITEMS:
        return 1
    return 2 if line.item == "labour" else 3


def page_data(findings: Findings, cards: Sequence[LayoutCard], frame: SvgFrame | None) -> str:
    """Return what the page's script knows, as JSON that may stand within ``<script>``: no name can end it."""
    goal = findings.problem.goals[1]
    factor, unit = shown_unit(goal)
    data = {
        "goal": score_name(goal),
        "unit": unit,
        "axes": None if frame is None else {"x": _axis(frame.x), "y": _axis(frame.y)},
        "layouts": [
            {
                "id": card.anchor,
                "label": card.layout.label,
                "cost": card.cost.value,
                "error": _number(card.error.value * factor),
                "bound": _number(card.bound * factor),
                "lines": card.lines,
            }
            for card in cards
        ],
    }
    text = json.dumps(data, ensure_ascii=True, allow_nan=False, separators=(",", ":"))
    return text.replace("<", "\\u003c").replace(">", "\\u003e").replace("&", "\\u0026")


def _bound(scores: Sequence[Score | None]) -> float:
    """Return the largest upper bound; infinite where a score or its bound is not known."""
    ends = [math.inf if score is None or math.isnan(score.value) else score.upper() for score in scores]
    return max((math.inf if math.isnan(end) else end for end in ends), default=math.inf)


def _place(item: Evaluated, goal: str, frame: SvgFrame | None) -> tuple[float, float] | None:
    cost = item.scores[COST].value if COST in item.scores else math.nan
    error = item.scores[goal].value * shown_unit(goal)[0]
    if frame is None or not (math.isfinite(cost) and math.isfinite(error)):
        return None
    return round(frame.x.place(cost), 2), round(frame.y.place(error), 2)


def _axis(axis: SvgAxis) -> dict[str, float | bool]:
    return {
        "low": axis.low,
        "high": axis.high,
        "start": axis.start,
        "end": axis.end,
        "logarithmic": axis.logarithmic,
    }


def _number(value: float) -> float | None:
    return value if math.isfinite(value) else None
