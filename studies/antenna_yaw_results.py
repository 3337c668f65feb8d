"""Which antennas to take: from trials of every choice to candidates, and from fresh trials to one of them."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from layoutopt.identity import FloatArray
from layoutopt.problem import Problem
from layoutopt.protocols import Group
from layoutopt.result import Evaluated, Front, Status
from layoutopt.scores import TRACKING_UNITS, Score, TrialOutcomes, paired_difference
from solvers.front import front_of, knee
from solvers.judging import meeting_limits, miss_text, nearest_miss, simulated_scores, worst_ratio
from studies.antenna_yaw_setting import COST, ERROR, Choice

MOST_CANDIDATES: Final = 8
"""Choices that are tried on fresh trials before the study gives up, as in the main study."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Driven:
    """A choice with its trials.

    Attributes
    ----------
    outcomes
        The trials by which choices are compared.
    fresh
        Those after them, which only candidates have.
    item
        The layout with its exact scores and those of ``outcomes``.
    """

    choice: Choice
    outcomes: TrialOutcomes
    fresh: TrialOutcomes | None
    item: Evaluated

    @property
    def errors_m(self) -> FloatArray:
        """Mean error of each trial, shape (trials,), m."""
        return self.outcomes.column(ERROR)


@dataclass(frozen=True, slots=True, kw_only=True)
class Verdict:
    """What is recommended.

    Attributes
    ----------
    status
        Whether all limits are met on fresh trials.
    recommended
        The choice to take; where no choice meets the limits the one that misses them by least, ``None`` where
        nothing could be judged.
    shortfall
        By how much the limits are missed, in words; empty where they are met.
    tried
        Candidates that fresh trials were asked about.
    """

    status: Status
    recommended: Driven | None
    shortfall: str
    tried: int


def driven_of(
    problem: Problem, choices: Sequence[Choice], known: Mapping[str, TrialOutcomes], trials: int
) -> list[Driven]:
    """Return the choices that have all their trials, by what is known of each layout's key."""
    found = []
    for choice in choices:
        table = known.get(choice.layout.key)
        if table is None or len(table) < trials:
            continue
        outcomes = table.head(trials)
        simulated = simulated_scores(problem, choice.layout, problem.design, outcomes)
        item = replace(choice.evaluated, scores={**choice.evaluated.scores, **simulated})
        found.append(Driven(choice=choice, outcomes=outcomes, fresh=_after(table, trials), item=item))
    return found


def cost_error_front(driven: Sequence[Driven]) -> Front:
    """Return the front of cost against mean tracking error."""
    return front_of([entry.item for entry in driven], (COST, ERROR))


def candidates_of(problem: Problem, driven: Sequence[Driven]) -> list[Driven]:
    """Return the choices to be tried on fresh trials, the one to be taken if it holds first.

    With a limit on what trials show: all that meet the limits as far as the trials tell, the cheapest first, of
    equally dear ones the most accurate. Without one nobody has said how accurate is enough: the knee of the front
    of cost and error among those that meet the limits, then the other members by rising cost.
    """
    meeting = {item.layout.key for item in meeting_limits(problem, [entry.item for entry in driven])}
    fit = [entry for entry in driven if entry.item.layout.key in meeting]
    if any(limit.score in TRACKING_UNITS for limit in problem.limits):
        return sorted(fit, key=lambda entry: (cost_eur(entry), error_m(entry)))
    front = cost_error_front(fit)
    if not front.members:
        return []
    best = knee(front)
    members = [best, *(item for item in front.members if item is not best)]
    by_key = {entry.item.layout.key: entry for entry in fit}
    return [by_key[item.layout.key] for item in members]


def next_to_try(
    problem: Problem, driven: Sequence[Driven], trials: int, failed: Mapping[Group, str]
) -> Driven | None:
    """Return the first candidate whose fresh trials are missing, ``None`` once one of those before it held."""
    lost = {group.layout_key for group in failed}
    for entry in candidates_of(problem, driven)[:MOST_CANDIDATES]:
        if entry.item.layout.key in lost:
            continue
        if entry.fresh is None or len(entry.fresh) < trials:
            return entry
        if holds(problem, entry):
            return None
    return None


def holds(problem: Problem, entry: Driven) -> bool:
    """Return whether fresh trials show that a choice meets all limits."""
    return all(limit.met(score) for limit, score in problem.limits_on(fresh_scores(problem, entry)))


def fresh_scores(problem: Problem, entry: Driven) -> dict[str, Score]:
    """Return the scores of a choice with those of its fresh trials."""
    simulated = simulated_scores(problem, entry.choice.layout, problem.design, entry.fresh)
    return {**entry.choice.evaluated.scores, **simulated}


def verdict_of(problem: Problem, driven: Sequence[Driven]) -> Verdict:
    """Return the first candidate that holds on fresh trials; else the choice that misses the limits by least."""
    if not driven:
        return Verdict(status=Status.INFEASIBLE, recommended=None, shortfall="no choice could be judged", tried=0)
    tried = [entry for entry in candidates_of(problem, driven)[:MOST_CANDIDATES] if entry.fresh is not None]
    for number, entry in enumerate(tried):
        if holds(problem, entry):
            status = Status.TARGET_MET if problem.limits else Status.SEARCHED
            return Verdict(status=status, recommended=entry, shortfall="", tried=number + 1)
    judged = {
        entry.item.layout.key: (entry, replace(entry.item, scores=fresh_scores(problem, entry))) for entry in tried
    }
    pool = judged or {entry.item.layout.key: (entry, entry.item) for entry in driven}
    nearest, item = min(pool.values(), key=lambda pair: _missed_by(problem, pair[1]))
    worst = worst_ratio(problem, item.scores)
    where = "on fresh trials " if judged else ""
    shortfall = (
        nearest_miss(problem, [item]) if worst is None else miss_text(item, worst[1], worst[2], where=where)
    )
    return Verdict(status=Status.TARGET_NOT_MET, recommended=nearest, shortfall=shortfall, tried=len(tried))


def rivals_of(driven: Sequence[Driven], chosen: Driven) -> list[tuple[Driven, Score]]:
    """Return the choices to be told beside a chosen one, by rising cost: the most accurate other of each cost.

    With each comes the paired difference in mean error, its own less that of the chosen one.
    """
    best: dict[float, Driven] = {}
    for entry in driven:
        if entry is chosen:
            continue
        rival = best.get(cost_eur(entry))
        if rival is None or error_m(entry) < error_m(rival):
            best[cost_eur(entry)] = entry
    return [(best[cost], paired_difference(best[cost].outcomes, chosen.outcomes, ERROR)) for cost in sorted(best)]


def errors_of(driven: Sequence[Driven]) -> FloatArray:
    """Return the mean error of each choice in each replication, shape (choices, replications), m."""
    return np.stack([entry.errors_m for entry in driven])


def cost_eur(entry: Driven) -> float:
    """Return the cost of a choice, EUR."""
    return entry.item.scores[COST].value


def error_m(entry: Driven) -> float:
    """Return the mean tracking error of a choice over the trials that compare choices, m."""
    return entry.item.scores[ERROR].value


def _after(table: TrialOutcomes, trials: int) -> TrialOutcomes | None:
    if len(table) == trials:
        return None
    return TrialOutcomes(
        replications=table.replications[trials:], columns=table.columns, values=table.values[trials:]
    )


def _missed_by(problem: Problem, item: Evaluated) -> float:
    worst = worst_ratio(problem, item.scores)
    return 0.0 if worst is None else worst[0]
