"""The answer of the study of single tags in sentences."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

from layoutopt.problem import Problem
from layoutopt.result import Status
from layoutopt.score_text import euros
from layoutopt.scores import TrialOutcomes
from layoutopt.spec.building import Spec
from layoutopt.units import format_length
from solvers.epsilon_constraint import OpenRange
from solvers.placement_answer import Placed, in_words
from solvers.placement_check import Missed
from studies.tag_placement_rivals import Rival
from studies.tag_placement_setting import Asked, Found, tags_cost_eur

_STATUS_WORDS: Final = {
    Status.OPTIMAL: "Proven optimal for the sampled runs and among these slots.",
    Status.BOUNDED: Status.BOUNDED.value,
    Status.STOPPED_BY_LIMIT: "Stopped before the question was decided.",
    Status.TARGET_NOT_MET: "No choice within the budget was found, and none was shown to be impossible.",
    Status.BUDGET_TOO_SMALL: "No choice keeps the budget and does what is asked for.",
    Status.INFEASIBLE: "No choice of these slots does what is asked for.",
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

    @property
    def within_budgets(self) -> bool:
        """Whether most runs were to be served within budgets, and not all."""
        return self.asked.settings.aim in ("coverage", "front")

    def euros_of(self, new: float) -> str:
        """Return what so many new tags cost by the bill."""
        return euros(tags_cost_eur(self.spec, math.ceil(new - 1e-9), self.installed))


def summary(told: Told) -> list[str]:
    """Return the answer in a few sentences."""
    placed, found = told.found.placed, told.found
    status = _STATUS_WORDS[placed.status]
    if placed.xy_m is None:
        return [status, *_refusal(told)]
    beside = f" beside {told.installed} installed" if told.installed else ""
    lines = [
        f"{tags(found.new)} to lay{beside}, {told.euros_of(found.new)} with labour, survey and spares.",
        status,
    ]
    if found.front is not None:
        lines += _front(told)
    elif placed.within_budget:
        lines.append(
            f"{placed.met_share:.2%} of the {placed.samples} sampled runs are served; no choice within the budget "
            f"serves more than {min(placed.bound, 1.0):.2%}."
        )
    elif found.stages:
        once = found.at_once
        if once is not None and once.xy_m is not None:
            lines.append(f"All stages at once would take {tags(once.new)}.")
    else:
        lines.append(
            f"No choice of these slots needs fewer than {tags(math.ceil(placed.bound - 1e-9))} "
            f"({placed.gap:.1%} fewer at most)."
        )
    if told.asked.settings.budget_eur is not None:
        lines.append(_budget(told))
    if found.gap is not None:
        lines.append(_gap(told))
    lines += [_check(missed) for missed in placed.missed]
    if len(placed.lost) and not placed.within_budget:
        lines.append(f"{len(placed.lost)} of the runs looked at were left out: no slot serves them.")
    return [*lines, _sentence(placed.message)] if placed.message else lines


def tags(count: float) -> str:
    """Return a number of tags in words."""
    return f"{count:g} tag" + ("" if count == 1 else "s")


def check_of(placed: Placed) -> str:
    """Return what the check on fresh runs found, in a cell of a table."""
    return (
        "; ".join(f"{looked_at(missed)} (≤ {missed.upper:.2%})" for missed in placed.missed if missed.runs) or "–"
    )


def looked_at(missed: Missed) -> str:
    """Return how many of how many runs miss a demand, and of how many routes these are."""
    routes = f" of {missed.draws} routes" if missed.demand.along_routes else ""
    return f"{missed.count} of {missed.runs}{routes}"


def open_range(item: OpenRange) -> str:
    """Return for which numbers of tags better choices may exist, and how good these can be at most."""
    numbers = (
        f"{item.low_cost:g} to {item.high_cost:g}" if item.high_cost > item.low_cost else f"{item.low_cost:g}"
    )
    most = "" if item.bound is None else f", serving {1.0 - item.bound:.2%} at most"
    return f"{numbers} new tags{most}"


def _refusal(told: Told) -> list[str]:
    """Return why there is no answer, and the cheapest way out."""
    placed = told.found.placed
    lines = [_sentence(placed.message)] if placed.message else []
    if placed.bound > 0.0:
        lines.append(f"At least {tags(placed.bound)} are needed, {told.euros_of(placed.bound)}.")
    if told.asked.settings.budget_eur is not None:
        lines.append(_budget(told))
    best = next((way for way in told.found.ways if way.left_out <= told.asked.question.unserved_share), None)
    if best is not None:
        lines.append(
            f"The cheapest way out found that serves all: {best.text}, about {tags(best.tags)}, "
            f"{told.euros_of(best.tags)}."
        )
    return lines


def _check(missed: Missed) -> str:
    demand = in_words(missed.demand)
    if not missed.runs:
        return f"There is no run to check {demand} on."
    routes = f" of {missed.draws} routes" if missed.demand.along_routes else ""
    by_routes = ", counted by routes" if missed.demand.along_routes else ""
    return (
        f"Checked on {missed.runs} fresh random runs{routes} ({demand}): {missed.count} miss it, at most "
        f"{missed.upper:.2%} of all at 95 %{by_routes}."
    )


def _gap(told: Told) -> str:
    gap = told.found.gap
    assert gap is not None
    if gap.length_m is None:
        return "Not even the longest run that was looked at is served within the budget."
    below = (
        f"no choice within the budget serves runs of {format_length(gap.impossible_m)}"
        if gap.impossible_m > 0.0
        else "no shorter length was shown to be impossible"
    )
    return (
        f"Runs of {format_length(gap.length_m)} are served within the budget; {below}. Lengths were looked at in "
        f"steps of {format_length(gap.step_m)}."
    )


def _front(told: Told) -> list[str]:
    front = told.found.front
    assert front is not None
    first, last = front.points[0].placed, front.points[-1].placed
    lines = [
        f"They serve {last.met_share:.2%} of the {last.samples} sampled runs. The front has {len(front.points)} "
        f"choices, from {tags(first.new)} that serve {first.met_share:.2%} on."
    ]
    if front.complete:
        return [*lines, "The front is proven complete: with no other number of tags can more be served."]
    ranges = "; ".join(open_range(item) for item in front.open_ranges)
    return [*lines, f"Better choices than those shown may exist for {ranges}."]


def _budget(told: Told) -> str:
    asked = told.asked
    survey = f", of which {euros(asked.survey_cents / 100)} go to the survey as such" if asked.survey_cents else ""
    budget = euros(asked.settings.budget_eur or 0.0)
    return f"The budget for new tags is {budget}{survey}; it pays for {tags(asked.budget_tags or 0)}."


def _sentence(text: str) -> str:
    return f"{text[0].upper()}{text[1:]}."
