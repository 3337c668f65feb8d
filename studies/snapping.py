"""What it costs in accuracy to lay tags on marks that an installer finds: a snapped layout beside its original."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Final

import numpy as np

from layoutopt.detection import antennas_of
from layoutopt.evaluate import outcomes_of
from layoutopt.layout import Layout
from layoutopt.problem import Limit, Problem
from layoutopt.progress import Progress
from layoutopt.protocols import Group, group_of
from layoutopt.scores import OUTCOME_UNITS, Score, Scores, TrialOutcomes, paired_difference
from layoutopt.snapping.snapped import Snapped
from layoutopt.spec.building import Spec
from layoutopt.workers import Workers
from objectives.coverage import RUN_LENGTH_M, random_runs, tags_seen
from solvers.judging import exact_scores, simulated_scores
from studies import held_out
from studies.explain import refusal_of
from studies.fresh_drives import fresh_drives

RUNS: Final = 4000
"""Random poses, and as many random runs, on which coverage is compared."""
AS_LAID: Final = "the floor as laid"
"""Where scores hold that look at the tags and need no drive."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Change:
    """One score before and after snapping; ``difference`` is after less before, on the same drives or runs."""

    name: str
    before: Score
    after: Score
    difference: Score


@dataclass(frozen=True, slots=True, kw_only=True)
class LimitChange:
    """A limit with its score before and after snapping on one held-out scenario, or on the floor as laid."""

    limit: Limit
    where: str
    before: Score
    after: Score

    @property
    def lost(self) -> bool:
        """Whether the original meets the limit and the snapped layout does not."""
        return self.limit.met(self.before) and not self.limit.met(self.after)


@dataclass(frozen=True, slots=True, kw_only=True)
class SnappingPrice:
    """A layout and its snapped form, judged on the same held-out drives.

    Attributes
    ----------
    layout, snapped
        The two layouts.
    result
        What became of each tag.
    refusal
        Why one of them cannot be built, priced or judged, with its name; then nothing was simulated.
    first, trials, seed
        The drives: first replication, number, seed of all random numbers.
    by_scenario
        Changes of the goal and of every limited score that drives give, by held-out scenario.
    coverage
        Changes of the coverage of the floor as laid, on the same random poses and runs.
    cost
        The change of the cost; ``None`` after a refusal.
    limits
        Every limit that could be judged.
    unjudged
        Limits on scores of the pattern, which know nothing of single tags.
    failures
        Why tasks failed.
    """

    layout: Layout
    snapped: Layout
    result: Snapped
    problem: Problem
    refusal: str
    seed: int
    first: int
    trials: int
    by_scenario: Mapping[str, tuple[Change, ...]]
    coverage: tuple[Change, ...]
    cost: Change | None
    limits: tuple[LimitChange, ...]
    unjudged: tuple[Limit, ...]
    failures: Mapping[Group, str]

    @property
    def exit_code(self) -> int:
        """One if a limit is lost by snapping, one of the layouts cannot be judged, or a task failed."""
        return int(bool(self.refusal or self.failures) or any(item.lost for item in self.limits))


def judge(
    spec: Spec, layout: Layout, result: Snapped, *, trials: int, workers: Workers, progress: Progress
) -> SnappingPrice:
    """Return what snapping costs, on drives that no study has used, with the estimator of the search.

    Raises
    ------
    Interrupted
        If the workers were asked to stop.
    """
    problem, first = spec.problem(), spec.study.validation_trials
    snapped = layout.replace(floor_tags=result.floor_tags)
    pair, estimator = (layout, snapped), problem.estimators[0]
    refusals = {name: refusal_of(problem, item) for name, item in zip(("original", "snapped"), pair, strict=True)}
    refusal = "; ".join(f"the {name} layout: {why}" for name, why in refusals.items() if why)
    # A pattern that lies on the marks already is the same layout twice.
    driven = () if refusal else tuple(dict.fromkeys(pair))
    cells = [(item, scenario) for item in driven for scenario in problem.held_out]
    results = fresh_drives(
        spec, "original and snapped layout", cells, trials=trials, workers=workers, progress=progress
    )
    known = outcomes_of(results)
    by_scenario: dict[str, tuple[Change, ...]] = {}
    limits: list[LimitChange] = []
    for scenario in problem.held_out:
        tables = [known.get(group_of(item, scenario, estimator)) for item in pair]
        if tables[0] is None or tables[1] is None:
            continue
        by_scenario[scenario.name] = tuple(
            _change(name, tables[0], tables[1]) for name in _names(problem, tables[0])
        )
        scores = [
            simulated_scores(problem, item, scenario, table) for item, table in zip(pair, tables, strict=True)
        ]
        limits += _limits(problem, scenario.name, scores[0], scores[1])
    laid = [{} if refusal else _scores_as_laid(problem, item) for item in pair]
    limits += _limits(problem, AS_LAID, laid[0], laid[1])
    judged = {item.limit for item in limits}
    return SnappingPrice(
        layout=layout,
        snapped=snapped,
        result=result,
        problem=problem,
        refusal=refusal,
        seed=spec.seed,
        first=first,
        trials=trials,
        by_scenario=by_scenario,
        coverage=() if refusal else _coverage(problem, layout, snapped, spec.seed),
        cost=None if refusal else _exact_change(problem.goals[0], laid[0], laid[1]),
        limits=tuple(limits),
        unjudged=tuple(
            limit
            for limit in problem.limits
            if limit not in judged and limit.score.rpartition(".")[2] not in OUTCOME_UNITS and not refusal
        ),
        failures=held_out.failures_of(results),
    )


def _names(problem: Problem, table: TrialOutcomes) -> list[str]:
    """Return the simulated goal, then every limited score that the drives have, each once."""
    wanted = (*problem.goals[1:], *(limit.score for limit in problem.limits))
    return [name for name in dict.fromkeys(wanted) if name in table.columns]


def _change(name: str, before: TrialOutcomes, after: TrialOutcomes) -> Change:
    difference = paired_difference(after, before, name)
    return Change(name=name, before=before.score(name), after=after.score(name), difference=difference)


def _exact_change(name: str, before: Scores, after: Scores) -> Change:
    difference = Score(value=after[name].value - before[name].value, unit=before[name].unit)
    return Change(name=name, before=before[name], after=after[name], difference=difference)


def _limits(problem: Problem, where: str, before: Scores, after: Scores) -> list[LimitChange]:
    later = dict(problem.limits_on(after))
    return [
        LimitChange(limit=limit, where=where, before=score, after=later[limit])
        for limit, score in problem.limits_on(before)
        if limit in later
    ]


def _scores_as_laid(problem: Problem, layout: Layout) -> dict[str, Score]:
    """Return the scores that need no drive and look at the tags as they are laid.

    Half-gaps, static errors and blind runs of patterns know nothing of single tags, so they stay out.
    """
    scores: dict[str, Score] = {}
    for name in (problem.goals[0], "pose_coverage"):
        scores.update(exact_scores(problem, layout, only=name))
    return scores


def _coverage(problem: Problem, before: Layout, after: Layout, seed: int) -> tuple[Change, ...]:
    """Return the changes of the shares of poses and of runs that see a tag, on the same poses and runs."""
    scenario, found = problem.design, []
    if not len(antennas_of(before, scenario.step_s)):
        return ()
    for name, length_m in (("pose_coverage", 0.0), ("run_coverage", RUN_LENGTH_M)):
        poses = random_runs(scenario.site, scenario.robot, RUNS, length_m, seed)
        if not len(poses):
            continue
        tables = [
            TrialOutcomes(
                replications=np.arange(len(poses)),
                columns=(name,),
                values=(tags_seen(layout, scenario, poses, length_m, 1) >= 1).astype(np.float64)[:, None],
            )
            for layout in (before, after)
        ]
        found.append(_change(name, tables[0], tables[1]))
    return tuple(found)


def finite(score: Score) -> bool:
    """Return whether a score is known, with an interval."""
    return math.isfinite(score.value) and all(map(math.isfinite, score.interval()))
