"""Honesty: recommended layouts judged again on seeds, routes and faults that no search has seen."""

import math
import statistics
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import replace

from layoutopt.layout import Layout
from layoutopt.problem import Problem
from layoutopt.protocols import AnyEstimator, Evaluation, Failure, Group, Task, group_of
from layoutopt.result import Evaluated, Validation
from layoutopt.scenario import Scenario
from layoutopt.score_text import counted_text, limit_text, percent_text, rough_text, score_text
from layoutopt.scores import OUTCOME_UNITS, Score, TrialOutcomes
from solvers.judging import miss_text, simulated_scores, worst_ratio

_BLOCK = 20
"""Replications that go into one task, so that two workers share even a single layout."""


def tasks(
    layouts: Sequence[Layout],
    scenarios: Sequence[Scenario],
    estimators: Sequence[AnyEstimator],
    replications: int,
    known: Mapping[Group, TrialOutcomes],
    failed: Mapping[Group, str],
) -> tuple[Task, ...]:
    """Return what is still to be run for every layout to have so many replications everywhere it applies.

    ``failed`` holds the groups in which a task raised; they are left alone.
    """
    wanted = []
    for layout in layouts:
        for scenario in scenarios:
            for estimator in estimators:
                group = group_of(layout, scenario, estimator)
                if estimator.applies(layout) or group in failed:
                    continue
                table = known.get(group)
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


def failures_of(evaluations: Iterable[Evaluation | Failure]) -> dict[Group, str]:
    """Return why the first task of each group failed that had a failed one."""
    found: dict[Group, str] = {}
    for item in evaluations:
        if isinstance(item, Failure):
            found.setdefault(item.group, item.text)
    return found


def validate(
    problem: Problem,
    candidates: Sequence[Evaluated],
    known: Mapping[Group, TrialOutcomes],
    failed: Mapping[Group, str],
) -> tuple[Validation, ...]:
    """Return a row for each candidate, held-out scenario and estimator.

    A row holds the held-out scores and, for the estimator that the search used, the optimism; or it says why
    the estimator does not apply or failed.
    """
    rows = []
    for item in candidates:
        for scenario in problem.held_out:
            for estimator in problem.estimators:
                group = group_of(item.layout, scenario, estimator)
                failure = f"failed: {failed[group]}" if group in failed else ""
                row = Validation(
                    layout_key=item.layout.key,
                    scenario=scenario.name,
                    estimator=estimator.name,
                    does_not_apply=estimator.applies(item.layout) or failure,
                )
                outcomes = known.get(group)
                if outcomes is not None and not failure:
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
    front (the inverse, where more of the score is better), on the worse of the held-out scenarios, and never below
    1. Only the first ``replications`` count, so that a ratio stays as it is when some members get more.
    """
    found: dict[str, float] = {}
    simulated = [limit for limit in problem.limits if limit.score.rpartition(".")[2] in OUTCOME_UNITS]
    for limit in simulated:
        medians = [1.0]
        for scenario in problem.held_out:
            ratios = []
            for item in front:
                outcomes = known.get(group_of(item.layout, scenario, problem.estimators[0]))
                before = item.scores.get(limit.score)
                if outcomes is None or before is None or before.exact or not before.value > 0.0:
                    continue
                after = outcomes.head(replications).score(limit.score).value
                if not math.isnan(after):
                    least = limit.lower is not None
                    ratios.append(_ratio(before.value, after) if least else _ratio(after, before.value))
            if ratios:
                medians.append(statistics.median(ratios))
        found[limit.score] = max(medians)
    return found


def _ratio(value: float, reference: float) -> float:
    return value / reference if reference > 0.0 else math.inf


def promising(problem: Problem, candidates: Sequence[Evaluated], ratios: Mapping[str, float]) -> list[Evaluated]:
    """Return the candidates that would still meet their limits if each score got worse by its ratio.

    If none would, the one that would miss by least is returned, so that the verdict rests on trials.
    """

    def worst(item: Evaluated) -> float:
        return max(
            (
                limit.ratio(score.value) * ratios[limit.score]
                for limit, score in problem.limits_on(item.scores)
                if limit.score in ratios
            ),
            default=0.0,
        )

    found = [item for item in candidates if worst(item) <= 1.0]
    return found or sorted(candidates, key=worst)[:1]


def shortfall(problem: Problem, tried: Sequence[Evaluated], known: Mapping[Group, TrialOutcomes]) -> str:
    """Return in words which of the layouts tried misses a limit by least on its worst held-out scenario."""
    misses = []
    for item in tried:
        worst = []
        for scenario in problem.held_out:
            outcomes = known.get(group_of(item.layout, scenario, problem.estimators[0]))
            found = worst_ratio(problem, simulated_scores(problem, item.layout, scenario, outcomes))
            if found is not None:
                worst.append((*found, scenario.name))
        if worst:
            misses.append((item, max(worst, key=lambda entry: entry[0])))
    if not misses:
        return "no held-out drive could be judged"
    item, (_, limit, score, name) = min(misses, key=lambda entry: entry[1][0])
    return miss_text(item, limit, score, where=f"on {name} ")


def own_rows(problem: Problem, validations: Sequence[Validation], layout: Layout) -> list[Validation]:
    """Return the held-out rows of a layout with the estimator of the search."""
    own = problem.estimators[0].name if problem.estimators else ""
    return [row for row in validations if (row.layout_key, row.estimator) == (layout.key, own)]


def verdict_text(problem: Problem, validations: Sequence[Validation], item: Evaluated) -> str:
    """Return in words, from the verb on, what its held-out drives say of a layout; empty if it has none.

    Told is the limit that it misses by most, on the scenario where it does, judged with the search's estimator.
    """
    drives, missed = [], []
    for row in own_rows(problem, validations, item.layout):
        if row.scores is None:
            return f"was not judged in {row.scenario}: {row.does_not_apply}"
        drives.append(row.scores[problem.goals[1]].count)
        missed += [
            (limit.ratio(limit.bound(score)), limit, score, row.scenario)
            for limit, score in problem.limits_on(row.scores)
            if not limit.met(score)
        ]
    if not drives:
        return ""
    if not missed and len(drives) < len(problem.held_out):
        return f"was driven in {len(drives)} of {len(problem.held_out)} held-out scenarios"
    if not missed:
        return f"met every limit on {counted_text(min(drives), 'held-out drive')} of each kind"
    _, limit, score, scenario = max(missed, key=lambda entry: entry[0])
    verb = "missed" if limit.broken(score) else "was not shown to meet"
    told = f"{verb} “{limit_text(limit)}” in {scenario}: {score_text(score, limit.score)}"
    excess = limit.excess(limit.bound(score))
    if math.isnan(score.value):
        return f"{verb} “{limit_text(limit)}” in {scenario}: no drive gave it a value"
    if not math.isfinite(excess):
        return f"{told}, from too few drives to tell a bound"
    return f"{told}, {rough_text(excess, score, limit.score)} short at {percent_text(limit.confidence)} confidence"


def holds(
    problem: Problem,
    item: Evaluated,
    known: Mapping[Group, TrialOutcomes],
    failed: Mapping[Group, str],
    replications: int,
) -> bool | None:
    """Return whether every limit is met on every held-out scenario; ``None`` while trials are missing.

    A layout on which the estimator failed does not hold.
    """
    estimator = problem.estimators[0]
    for scenario in problem.held_out:
        group = group_of(item.layout, scenario, estimator)
        if group in failed:
            return False
        outcomes = known.get(group)
        if outcomes is None or len(outcomes) < replications:
            return None
        scores = {**item.scores, **simulated_scores(problem, item.layout, scenario, outcomes)}
        if not all(limit.score in scores and limit.met(scores[limit.score]) for limit in problem.limits):
            return False
    return True
