"""Honesty: recommended layouts judged again on seeds, routes and faults that no search has seen."""

import math
import statistics
from collections.abc import Mapping, Sequence
from dataclasses import replace

from layoutopt.evaluate import Group
from layoutopt.layout import Layout
from layoutopt.problem import Problem
from layoutopt.protocols import Estimator, Task
from layoutopt.result import Evaluated, Validation
from layoutopt.scenario import Scenario
from layoutopt.scores import Score, Scores, TrialOutcomes

_BLOCK = 20
"""Replications that go into one task, so that two workers share even a single layout."""


def tasks(
    layouts: Sequence[Layout],
    scenarios: Sequence[Scenario],
    estimators: Sequence[Estimator],
    replications: int,
    known: Mapping[Group, TrialOutcomes],
    failed: frozenset[str],
) -> tuple[Task, ...]:
    """Return what is still to be run for every layout to have so many replications everywhere it applies."""
    wanted = []
    for layout in layouts:
        for scenario in scenarios:
            for estimator in estimators:
                if estimator.applies(layout) or layout.key in failed:
                    continue
                table = known.get((layout.key, scenario.name, estimator.name))
                have = 0 if table is None else len(table)
                wanted += [
                    Task(
                        layout=layout,
                        scenario=scenario,
                        estimator=estimator,
                        first=first,
                        count=min(_BLOCK, replications - first),
                    )
                    for first in range(have, replications, _BLOCK)
                ]
    return tuple(wanted)


def simulated_scores(
    problem: Problem, layout: Layout, scenario: Scenario, outcomes: TrialOutcomes | None
) -> Scores:
    """Return every simulated score that the outcomes give."""
    scores: dict[str, Score] = {}
    for objective in problem.objectives:
        if objective.card.fidelity == "simulated":
            scores.update(objective(layout, scenario, outcomes))
    return scores


def validate(
    problem: Problem, candidates: Sequence[Evaluated], known: Mapping[Group, TrialOutcomes]
) -> tuple[Validation, ...]:
    """Return a row for each candidate, held-out scenario and estimator.

    A row holds the held-out scores and, for the estimator that the search used, the optimism; or it says why
    the estimator does not apply.
    """
    rows = []
    for item in candidates:
        for scenario in problem.held_out:
            for estimator in problem.estimators:
                row = Validation(
                    layout_key=item.layout.key,
                    scenario=scenario.name,
                    estimator=estimator.name,
                    does_not_apply=estimator.applies(item.layout),
                )
                outcomes = known.get((item.layout.key, scenario.name, estimator.name))
                if outcomes is not None:
                    scores = simulated_scores(problem, item.layout, scenario, outcomes)
                    row = replace(row, scores=scores)
                    goal = problem.goals[1]
                    if estimator is problem.estimators[0] and goal in item.scores:
                        row = replace(row, optimism=difference(scores[goal], item.scores[goal]))
                if row.does_not_apply or row.scores is not None:
                    rows.append(row)
    return tuple(rows)


def difference(held_out: Score, search: Score) -> Score:
    """Return held-out less search score; the two come from different drives, so their variances add."""
    return Score(
        value=held_out.value - search.value,
        unit=held_out.unit,
        standard_error=math.hypot(held_out.standard_error, search.standard_error),
        count=min(held_out.count, search.count),
    )


def transfer(
    problem: Problem, front: Sequence[Evaluated], known: Mapping[Group, TrialOutcomes], replications: int
) -> dict[str, float]:
    """Return how much worse each limited score of a front is on held-out drives than in search.

    For each simulated score with a limit: the median ratio of held-out to search score over the members of the
    front, on the worse of the held-out scenarios, and never below 1. Only the first ``replications`` count, so
    that a ratio stays as it is when some members get more.
    """
    found: dict[str, float] = {}
    for limit in problem.limits:
        medians = [1.0]
        for scenario in problem.held_out:
            ratios = []
            for item in front:
                outcomes = known.get((item.layout.key, scenario.name, problem.estimators[0].name))
                before = item.scores.get(limit.score)
                if outcomes is None or before is None or before.exact or not before.value > 0.0:
                    continue
                after = outcomes.head(replications).score(limit.score).value
                if not math.isnan(after):
                    ratios.append(after / before.value)
            if ratios:
                medians.append(statistics.median(ratios))
        found[limit.score] = max(medians)
    return found


def promising(problem: Problem, candidates: Sequence[Evaluated], ratios: Mapping[str, float]) -> list[Evaluated]:
    """Return the candidates that would still meet their limits if each score grew by its ratio.

    If none would, the one that would miss by least is returned, so that the verdict rests on trials.
    """

    def worst(item: Evaluated) -> float:
        return max(
            (
                score.value * ratios[limit.score] / limit.upper
                for limit, score in problem.limits_on(item.scores)
                if not score.exact and limit.upper > 0.0
            ),
            default=0.0,
        )

    found = [item for item in candidates if worst(item) <= 1.0]
    return found or sorted(candidates, key=worst)[:1]


def shortfall(problem: Problem, tried: Sequence[Evaluated], known: Mapping[Group, TrialOutcomes]) -> str:
    """Return in words which of the layouts tried misses a limit by least on its worst held-out scenario."""
    worst = []
    for item in tried:
        misses = []
        for scenario in problem.held_out:
            outcomes = known.get((item.layout.key, scenario.name, problem.estimators[0].name))
            scores = simulated_scores(problem, item.layout, scenario, outcomes)
            for limit, score in problem.limits_on(scores):
                bound = score.upper(limit.confidence)
                misses.append((bound / limit.upper if limit.upper > 0.0 else bound, scenario, limit, score, bound))
        worst.append((item, max(misses, key=lambda miss: miss[0])))
    item, (_, scenario, limit, score, bound) = min(worst, key=lambda entry: entry[1][0])
    return (
        f"nearest is {item.layout.short_key} ({item.layout.label}): on {scenario.name} {limit.score} is "
        f"{score.value:.4g} {score.unit}, at most {bound:.4g} at {limit.confidence:.0%} confidence, where "
        f"{limit.upper:.4g} is allowed: {bound - limit.upper:.4g} {score.unit} short"
    )


def holds(
    problem: Problem, item: Evaluated, known: Mapping[Group, TrialOutcomes], replications: int
) -> bool | None:
    """Return whether every limit is met on every held-out scenario; ``None`` while trials are missing."""
    estimator = problem.estimators[0]
    for scenario in problem.held_out:
        outcomes = known.get((item.layout.key, scenario.name, estimator.name))
        if outcomes is None or len(outcomes) < replications:
            return None
        scores = {**item.scores, **simulated_scores(problem, item.layout, scenario, outcomes)}
        if not all(limit.score in scores and limit.met(scores[limit.score]) for limit in problem.limits):
            return False
    return True
