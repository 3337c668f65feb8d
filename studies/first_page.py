"""The first page of the report, without statistics: asked, to buy, how exact, how sure, not shown."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Final

from layoutopt.parts import BillOfMaterial, Scope
from layoutopt.plots.front import known_interval
from layoutopt.problem import Limit
from layoutopt.result import Evaluated, Status
from layoutopt.score_text import NOT_KNOWN, euros, interval_text, quantity_text, score_name
from layoutopt.scores import Score
from layoutopt.simulation.routes import reachable_region
from layoutopt.units import format_length
from studies.effort import LITTLE_SHARE
from studies.findings import Design, Findings
from studies.layout_cards import cost_objective, held_out_of
from studies.report_words import (
    PLAIN,
    counted_words,
    number_text,
    plain_limit,
    verdict_of_all,
    with_exact,
    world_words,
    worst_verdict,
)
from studies.summary import too_few_drives

REFUSALS: Final = (Status.TARGET_NOT_MET, Status.BUDGET_TOO_SMALL, Status.INFEASIBLE, Status.STOPPED_BY_LIMIT)
"""Ways to end without a layout that is shown to do what was asked."""
_HEADLINES: Final[Mapping[Status, str]] = {
    Status.OPTIMAL: "This layout does what was asked, and it is proven that no cheaper one does.",
    Status.BOUNDED: "This is the best layout that was found; how much better one could be is stated below.",
    Status.TARGET_MET: "There is a layout that does all that was asked, on simulated drives.",
    Status.SEARCHED: "No target was set: this is what accuracy costs here.",
    Status.STOPPED_BY_LIMIT: "The search was stopped before every question was decided.",
    Status.TARGET_NOT_MET: "No layout was shown to do all that was asked.",
    Status.BUDGET_TOO_SMALL: "Every layout that can be built costs more than the budget.",
    Status.INFEASIBLE: "None of the layouts to choose from can be built and judged.",
}
_MOST_ZONES: Final = 2
"""More would push the picture off the first page; the table of demands has them all."""
_MOST_DEMANDS: Final = 6
"""More would push the picture off the first page; the table of demands has them all."""
_SCOPES: Final[Mapping[Scope, str]] = {
    Scope.FLOOR: "the floor",
    Scope.ROBOT: "the robots' readers",
    Scope.SPARES: "spares",
    Scope.LABOUR: "labour",
}


@dataclass(frozen=True, slots=True, kw_only=True)
class FirstPage:
    """What a customer reads first, in sentences.

    ``headline`` is the answer in one sentence. ``verdict`` is the worst one over all demands and held-out
    scenarios, ``"untried"`` without held-out drives, and empty if nothing was demanded or nothing is recommended.
    """

    headline: str
    asked: tuple[str, ...]
    buy: tuple[str, ...]
    exact: tuple[str, ...]
    sure: tuple[str, ...]
    verdict: str
    not_shown: tuple[str, ...]


def first_page(findings: Findings, *, quick: bool) -> FirstPage:
    """Return the first page; every number in it is one of the findings."""
    first = next(iter(findings.result.recommended.values()), None)
    headline = _headline(findings)
    if first is None:
        return FirstPage(
            headline=headline,
            asked=_asked(findings),
            buy=("No layout is recommended.",),
            exact=(),
            sure=(),
            verdict="",
            not_shown=_not_shown(findings, None, quick=quick),
        )
    verdict = _verdict(findings, first)
    return FirstPage(
        headline=headline,
        asked=_asked(findings),
        buy=_buy(findings, first),
        exact=_exact(findings, first),
        sure=_sure(findings, first, verdict),
        verdict=verdict,
        not_shown=_not_shown(findings, first, quick=quick),
    )


def _headline(findings: Findings) -> str:
    few = too_few_drives(findings)
    if few is None:
        return _HEADLINES[findings.result.status]
    drives = counted_words(few, "simulated drive")
    return f"There is a layout that did all that was asked on {drives}, too few to decide."


def _asked(findings: Findings) -> tuple[str, ...]:
    problem = findings.problem
    site, cost = problem.design.site, cost_objective(findings)
    robots = "robots" if cost is None else counted_words(cost.robot_count, "robot")
    their = "its" if cost is not None and cost.robot_count == 1 else "their"
    told = [
        f"On the site “{site.name}” ({site.open_floor.area:.4g} m² of open floor) {robots} should find {their} "
        "place by RFID tags in or on the floor, which readers under the chassis read.",
    ]
    reached_m2 = reachable_region(site, problem.design.robot).area
    if reached_m2 < LITTLE_SHARE * site.floor.area:
        told.append(
            f"The middle of a robot can get to {reached_m2:.2g} m² of it: all drives are there, and tags that are "
            "laid elsewhere are paid for as well."
        )
    if problem.limits:
        demands = [_demand_words(limit, problem.design.judgement.lost_beyond_m) for limit in problem.limits]
        if len(demands) > _MOST_DEMANDS:
            kept = _MOST_DEMANDS - 1
            demands[kept:] = [f"and {len(demands) - kept} more, which stand in the table of demands"]
        told.append(f"Demanded: {'; '.join(demands)}.")
    else:
        told.append("No target was set.")
    return tuple(told)


def _demand_words(limit: Limit, lost_beyond_m: float) -> str:
    of_the_lost = limit.score.rpartition(".")[2] == "lost_share"
    return plain_limit(limit) + (f" (lost: more than {format_length(lost_beyond_m)} off)" if of_the_lost else "")


def _buy(findings: Findings, item: Evaluated) -> tuple[str, ...]:
    layout, cost = item.layout, cost_objective(findings)
    tags = len(layout.floor_tags.lay_on(findings.problem.design.site).to_lay())
    antennas = sum(group.count for group in layout.readers)
    modules = sum(group.module_count for group in layout.readers)
    steps = [
        f"lay {counted_words(tags, 'tag')} on the floor",
        f"mount {counted_words(antennas, 'antenna')} with {counted_words(modules, 'reader module')} under each "
        "robot",
    ]
    if layout.transponders:
        steps.append(f"set up {counted_words(len(layout.transponders), 'transponder')}")
    if layout.target_tags:
        steps.append(f"give out {counted_words(layout.target_tags, 'UHF tag')}")
    order = f"{_listed(steps)}."
    if findings.result.status in REFUSALS:
        role = next(iter(findings.result.recommended))
        order = f"Nothing yet: no layout was shown to do what was asked. The best lead is “{role}”: {order}"
    told = [
        f"{order[0].upper()}{order[1:]}",
        f"In this report the layout is called “{layout.label}” (how the antennas are arranged, how many and how "
        f"wide; how the tags are arranged and how far apart); its files have the number {layout.short_key}.",
    ]
    part = layout.floor_tags.tag_part
    bare = [f"“{zone.name}”" for zone in findings.problem.design.site.zones if zone.rule_against(part)]
    if tags and bare:
        told.insert(1, f"No such tag goes into the zone{'s' if len(bare) > 1 else ''} {_listed(bare)}.")
    if cost is None:
        return tuple(told)
    bill = cost.bill(layout, findings.problem.design)
    parts = [
        f"{euros(bill.total_of(scope))} for {words}" for scope, words in _SCOPES.items() if bill.total_of(scope)
    ]
    told.insert(
        1,
        f"That costs {euros(bill.total_eur)} for {counted_words(cost.robot_count, 'robot')}, without tax: "
        f"{_listed(parts)}.",
    )
    if findings.result.status not in REFUSALS:
        told.insert(2, f"To order, spares included: {_order_words(bill)}.")
    return tuple(told)


def _order_words(bill: BillOfMaterial) -> str:
    """Return all goods of a bill with their numbers, those of one kind together."""
    quantities: dict[tuple[str, str], float] = {}
    for line in bill.lines:
        if line.scope is not Scope.LABOUR:
            goods = (line.description, line.unit)
            quantities[goods] = quantities.get(goods, 0.0) + line.quantity
    return "; ".join(
        f"{number_text(quantity)} {'×' if unit == 'piece' else f'{unit} of'} {description}"
        for (description, unit), quantity in quantities.items()
    )


def _exact(findings: Findings, item: Evaluated) -> tuple[str, ...]:
    """Return how exact a layout is on new drives, or on those by which it was chosen where there are no others."""
    problem, goal = findings.problem, findings.problem.goals[1]
    held_out = held_out_of(findings, item.layout)
    told = []
    for scenario in problem.held_out:
        score = held_out[scenario.name].get(goal)
        if score is not None:
            drives = counted_words(score.count, "new drive")
            told.append(f"On {drives} ({world_words(scenario)}) {_goal_words(score, goal)}.")
    for limit in _of_zones(problem.limits):
        known = [scores[limit.score] for scores in held_out.values() if limit.score in scores]
        if known:
            worst = max(known, key=lambda score: limit.ratio(limit.bound(score)))
            told.append(_zone_words(limit, worst, alone=len(known) == 1))
    if goal in item.scores and not told:
        drives = f"the {counted_words(item.scores[goal].count, 'drive')} by which it was chosen"
        told.append(f"On {drives} ({world_words(problem.design)}) {_goal_words(item.scores[goal], goal)}.")
    return tuple(told)


def _zone_words(limit: Limit, worst: Score, *, alone: bool) -> str:
    zone = limit.score.rpartition(".")[0]
    if math.isnan(worst.value):
        return f"How exact it is in the zone “{zone}” is not known: some new drives never came there."
    words = _goal_words(worst, limit.score)
    where = "the new drives" if alone else "those new drives that are harder there"
    return f"{words[0].upper()}{words[1:]}, on {where}."


def _of_zones(limits: Sequence[Limit]) -> list[Limit]:
    """Return the first few limits on position errors in zones, each of which somebody asked for by itself."""
    found = [limit for limit in limits if "." in limit.score and "position_error" in limit.score]
    return found[:_MOST_ZONES]


def _goal_words(score: Score, goal: str) -> str:
    zone, _, quantity = goal.rpartition(".")
    value = quantity_text(float(f"{score.value:.3g}"), score, goal)
    few = known_interval(score) is None
    sure = "too few to say how exactly" if few else f"95 % sure: {interval_text(score, goal)}"
    where = f"in the zone “{zone}” " if zone else ""
    words = PLAIN.get(quantity, f"the {score_name(quantity)} is {{}}")
    return f"{where}{words.format(value)} ({sure})"


def _verdict(findings: Findings, item: Evaluated) -> str:
    held_out = [scores for scores in held_out_of(findings, item.layout).values() if scores]
    if not findings.problem.limits:
        return ""
    if not held_out:
        return "untried"
    missing = len(held_out) < len(findings.problem.held_out)
    verdicts = [verdict_of_all(findings.problem.limits, with_exact(item.scores, scores)) for scores in held_out]
    return worst_verdict([*verdicts, *([NOT_KNOWN] if missing else [])])


def _sure(findings: Findings, item: Evaluated, verdict: str) -> tuple[str, ...]:
    held_out = held_out_of(findings, item.layout)
    goal = findings.problem.goals[1]
    drives = sum(scores[goal].count for scores in held_out.values() if goal in scores)
    risk = max((1.0 - limit.confidence for limit in findings.problem.limits), default=0.0)
    new = f"{counted_words(drives, 'simulated drive')} that had no part in choosing the layout"
    words = {
        "": f"No demand was set, so there was none to be shown; the figures above rest on {new}.",
        "met": f"Every demand was met on {new}. A layout that misses one would seem to meet it, by luck, in "
        f"at most {100.0 * risk:.3g} of 100 such tests.",
        "broken": f"A demand is missed: {new} show it. Do not build this for that demand.",
        "undecided": f"Not decided: {new} are too few to say whether every demand is met.",
        "untried": "Not tested: there are only the drives by which the layout was chosen, and these flatter it.",
        NOT_KNOWN: f"Not decided: a demand speaks of something that {new} did not tell.",
    }
    told = [words[verdict]]
    if findings.candidates_validated > 1 and verdict == "met":
        told.append(
            f"{findings.candidates_validated} layouts were tested, cheapest first, and this is the first that "
            "passed; with several tries the chance of a lucky pass grows."
        )
    return tuple(told)


def _not_shown(findings: Findings, item: Evaluated | None, *, quick: bool) -> tuple[str, ...]:
    problem, result = findings.problem, findings.result
    told = []
    if quick:
        told.append("Anything to build from: this is a quick look on few layouts and drives.")
    if item is not None:
        told += [
            "Anything measured: every figure is simulated. Lay a small part first and compare it with a log of a "
            "drive (layoutopt replay).",
            f"Longer drives than {problem.design.duration_s:g} s, places where no drive came, and other faults "
            "than those named above.",
            "Robots that work out their place otherwise than by the program that was simulated, "
            f"“{problem.estimators[0].name}”.",
            "That tags beat another system: none with laser scanners or cameras was compared.",
        ]
        if item.layout.extrapolated:
            told.append(
                "The reach of this antenna: it is extrapolated from antennas of other sizes. Measure one before "
                "buying."
            )
    if result.bound is None:
        raced, layouts = [design for design in findings.designs if not design.refusal], len(findings.designs)
        why = "; why others were left out stands further down" if len(raced) < layouts else ""
        told.append(
            f"That nothing cheaper would do: {number_text(len(raced))} of {counted_words(layouts, 'layout')} were "
            f"compared by simulation, which is no proof{why}.{_at_the_end_words(findings, item, raced)}"
        )
    cost = cost_objective(findings)
    if cost is not None:
        told.append(
            f"What a supplier asks today: prices are those of the list “{cost.prices.name}” of "
            f"{cost.prices.date}, and the bill says where each comes from. Robots and their computers are not in "
            "the sum."
        )
    if problem.elsewhere:
        told.append(f"Demands that other studies look at: {'; '.join(problem.elsewhere)}.")
    return tuple(told)


def _at_the_end_words(findings: Findings, item: Evaluated | None, raced: Sequence[Design]) -> str:
    """Return that no cheaper layout was compared; empty if one was, or if nothing is shown to be met."""
    exact = findings.problem.goals[0]
    if item is None or not findings.problem.limits or findings.result.status in REFUSALS:
        return ""
    if any(design.evaluated.scores[exact].value < item.scores[exact].value for design in raced):
        return ""
    return " Not one costs less than this one: sparser tags or fewer antennas than the spec offers may do too."


def _listed(parts: Sequence[str]) -> str:
    return " and ".join([", ".join(parts[:-1]), parts[-1]] if len(parts) > 1 else parts)
