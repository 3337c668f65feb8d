"""Held-out drives in the study of zones: which layouts of a kind are tried, in which order, which one holds."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace

from layoutopt.problem import Limit, Problem
from layoutopt.protocols import Group, Task, group_of
from layoutopt.result import Evaluated
from layoutopt.scores import Score, TrialOutcomes
from solvers.judging import simulated_scores
from solvers.racing import Standing
from studies import held_out
from studies.zones_candidates import Effort


@dataclass(frozen=True, slots=True, kw_only=True)
class Outlook:
    """What a first look lets expect: the bound that is worst beside its demand if all drives went as its own did.

    ``ratio`` is how many times the demand it would be, ``score`` what the first look itself gave.
    """

    ratio: float
    limit: Limit
    score: Score
    scenario: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Kind:
    """How the layouts of one kind stand: in the race, and on held-out drives.

    Attributes
    ----------
    candidates
        Those that no drives of the search show to miss a limit, by rising cost.
    looked
        Candidates that had a first look at held-out drives.
    outlooks
        What it lets expect of each of them, by key; ``None`` where the estimator failed.
    tried
        Those of them that had all held-out drives, or are having them, in the order in which they were tried.
    accepted
        The first that met every limit on all held-out drives.
    """

    race: Standing
    candidates: tuple[Evaluated, ...] = ()
    looked: tuple[Evaluated, ...] = ()
    outlooks: Mapping[str, Outlook | None] = field(default_factory=dict)
    tried: tuple[Evaluated, ...] = ()
    accepted: Evaluated | None = None


def kind_of(
    problem: Problem,
    effort: Effort,
    race: Standing,
    known: Mapping[Group, TrialOutcomes],
    failed: Mapping[Group, str],
) -> tuple[Kind, tuple[Task, ...]]:
    """Return how a kind stands on held-out drives, and what is to be run next; nothing is when it is decided.

    Candidates get a first look, cheapest first. One that would miss a limit if all its drives went as the first
    ones did is left for later, because to try what is bound to fail would use up the tries. If none of those tried
    holds, the candidates whose first look left most room are tried.

    Notes
    -----
    Leaving out after a first look makes no layout's acceptance more probable, so each verdict keeps its
    confidence. That of several verdicts together is less: the page says how many were tried.
    """
    # Not only those shown to meet the limits in search: held-out drives are the ones that must show it, and to ask
    # for it twice would leave out layouts that do.
    candidates = [
        item
        for item in race.finalists
        if not any(limit.broken(score) for limit, score in problem.limits_on(item.scores))
    ]
    estimators = problem.estimators[:1]
    outlooks: dict[str, Outlook | None] = {}
    tried: list[Evaluated] = []

    def kind(accepted: Evaluated | None = None) -> Kind:
        return Kind(
            race=race,
            candidates=tuple(candidates),
            looked=tuple(item for item in candidates if item.layout.key in outlooks),
            outlooks=outlooks,
            tried=tuple(tried),
            accepted=accepted,
        )

    def drives(items: Sequence[Evaluated], count: int) -> tuple[Task, ...]:
        layouts = [item.layout for item in items]
        return held_out.tasks(layouts, problem.held_out, estimators, count, known, failed)

    def ratio(item: Evaluated) -> float:
        outlook = outlooks[item.layout.key]
        return math.inf if outlook is None else outlook.ratio

    for number, item in enumerate(candidates):
        if drives([item], effort.look_trials):
            return kind(), drives(candidates[number : number + effort.looks], effort.look_trials)
        outlooks[item.layout.key] = outlook_of(problem, item, known, failed, effort)
        if ratio(item) > 1.0 or len(tried) >= effort.most_tried:
            continue
        tried.append(item)
        verdict = held_out.holds(problem, item, known, failed, effort.validation_trials)
        if verdict is not False:
            return kind(item if verdict else None), drives([item], effort.validation_trials)
    untried = [item for item in candidates if item not in tried]
    for item in sorted(untried, key=lambda item: (ratio(item), item.layout.key))[: effort.spare_tries]:
        tried.append(item)
        verdict = held_out.holds(problem, item, known, failed, effort.validation_trials)
        if verdict is not False:
            return kind(item if verdict else None), drives([item], effort.validation_trials)
    return kind(), ()


def first_held_out(
    problem: Problem, effort: Effort, known: Mapping[Group, TrialOutcomes]
) -> Mapping[Group, TrialOutcomes]:
    """Return the outcomes without the drives of the closing round, which must change no verdict here."""
    names = {scenario.name for scenario in problem.held_out}
    return {
        group: table.head(effort.validation_trials) if group.scenario in names else table
        for group, table in known.items()
    }


def outlook_of(
    problem: Problem,
    item: Evaluated,
    known: Mapping[Group, TrialOutcomes],
    failed: Mapping[Group, str],
    effort: Effort,
) -> Outlook | None:
    """Return the worst bound that all held-out drives would give; ``None`` where the estimator failed."""
    found = []
    for scenario in problem.held_out:
        group = group_of(item.layout, scenario, problem.estimators[0])
        if group in failed:
            return None
        table = known[group].head(effort.look_trials)
        more = effort.validation_trials / len(table)
        for limit, score in problem.limits_on(simulated_scores(problem, item.layout, scenario, table)):
            ratio = limit.ratio(_bound_of_more(limit, score, more))
            found.append(Outlook(ratio=ratio, limit=limit, score=score, scenario=scenario.name))
    return max(found, key=lambda one: one.ratio)


def _bound_of_more(limit: Limit, score: Score, more: float) -> float:
    """Return the bound of a limit on a score of the same mean and spread from so many times the drives."""
    count = round(score.count * more)
    return limit.bound(replace(score, standard_error=score.standard_error / math.sqrt(more), count=count))
