"""Why no layout meets all limits, told from what was judged: limits in conflict, and what would have to give."""

from collections.abc import Mapping, Sequence
from dataclasses import replace

from layoutopt.layout import Layout
from layoutopt.problem import Limit, Problem
from layoutopt.protocols import Group, group_of
from layoutopt.result import Evaluated, Status
from layoutopt.score_text import euros
from layoutopt.scores import Score, Scores, TrialOutcomes
from solvers.conflicts import Met, conflict_text, conflicts_of
from solvers.exhaustive import Screened
from solvers.judging import met_in_search, simulated_scores
from studies.findings import Design


def refused(problem: Problem, screened: Sequence[Screened]) -> tuple[Status, str]:
    """Return why no layout may race: a limit on an exact score such as the budget, or physics."""
    cost = problem.goals[0]
    for limit in problem.limits:
        values = [
            item.evaluated.scores[limit.score].value for item in screened if limit.score == cost == item.rule
        ]
        if values:
            least = min(values)
            return Status.BUDGET_TOO_SMALL, (
                f"the cheapest layout that can be built costs {euros(least)}, "
                f"{euros(limit.excess(least))} more than the budget of {euros(limit.end)}"
            )
    reason = screened[0].refusal if screened else "the design space is empty"
    text = f"none of {len(screened)} layouts can be built and judged; the cheapest: {reason}"
    return Status.INFEASIBLE, sentences(text, exact_conflict(problem, screened))


def search_conflict(problem: Problem, finalists: Sequence[Evaluated], screened: Sequence[Screened]) -> str:
    """Return in words which limits are in conflict among the finalists of a search; empty if none are.

    Layouts that an exact score keeps out of the race were not simulated, so nothing can be said of them; the
    sentence says how many the budget kept out.
    """
    text = _text(problem, finalists, met_in_search, "that the search compared")
    cost = problem.goals[0]
    beyond = sum(item.rule == cost for item in screened)
    layouts = "1 layout above the budget was" if beyond == 1 else f"{beyond} layouts above the budget were"
    kept_out = f"{layouts} not simulated" if beyond else ""
    return sentences(text, kept_out)


def sentences(*parts: str) -> str:
    """Return parts as sentences, the first as it is and the last without its full stop; empty parts are left out.

    >>> sentences("one; two", "", "three")
    'one; two. Three'
    """
    first, *rest = [part for part in parts if part] or [""]
    return ". ".join([first, *(part[0].upper() + part[1:] for part in rest)])


def widened_conflict(problem: Problem, designs: Sequence[Design]) -> str:
    """Return in words which limits are in conflict among layouts of searches with and without a budget.

    A layout that both searches simulated counts with the drives of the one that gave it more.
    """
    best: dict[str, Design] = {}
    for design in designs:
        key = design.evaluated.layout.key
        if design.trials and (key not in best or design.trials > best[key].trials):
            best[key] = design
    items = [design.evaluated for design in best.values()]
    return _text(problem, items, met_in_search, "searched with and without the budget")


def held_out_conflict(problem: Problem, items: Sequence[Evaluated], known: Mapping[Group, TrialOutcomes]) -> str:
    """Return in words which limits are in conflict on held-out drives, among items that have some everywhere."""
    judged = []
    for item in {item.layout.key: item for item in items}.values():
        scores = worst_held_out(problem, item.layout, known)
        if scores is not None:
            judged.append(replace(item, scores={**item.scores, **scores}))
    return _text(problem, judged, Limit.met, "that held-out drives judged")


def exact_conflict(problem: Problem, screened: Sequence[Screened]) -> str:
    """Return in words which limits on exact scores are in conflict among layouts that such a limit refused."""
    names = {limit.score for limit in problem.limits}
    judged = [item.evaluated for item in screened if item.rule in names]
    known = {name for item in judged for name in item.scores}
    limits = tuple(limit for limit in problem.limits if limit.score in known)
    return _text(replace(problem, limits=limits), judged, _not_broken, "that can be built")


def worst_held_out(problem: Problem, layout: Layout, known: Mapping[Group, TrialOutcomes]) -> Scores | None:
    """Return for each simulated score with a limit the one of the worst held-out scenario.

    ``None`` if the layout has no held-out trials in some scenario. A score without any value is the worst.
    """
    found: dict[str, tuple[float, Score]] = {}
    for scenario in problem.held_out:
        outcomes = known.get(group_of(layout, scenario, problem.estimators[0]))
        if outcomes is None:
            return None
        for limit, score in problem.limits_on(simulated_scores(problem, layout, scenario, outcomes)):
            ratio = limit.ratio(limit.bound(score))
            if limit.score not in found or ratio > found[limit.score][0]:
                found[limit.score] = ratio, score
    return {name: score for name, (_, score) in found.items()}


def _not_broken(limit: Limit, score: Score) -> bool:
    # What the screen lets race; a sampled score need not yet show that it meets its limit.
    return not limit.broken(score)


def _text(problem: Problem, judged: Sequence[Evaluated], met: Met, among: str) -> str:
    return conflict_text(conflicts_of(problem.limits, judged, met), among)
