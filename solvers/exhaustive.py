"""Every layout of the space, judged by what can be had without simulation."""

import functools
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import ClassVar, Final

from layoutopt import feasibility
from layoutopt.errors import StudyStopped
from layoutopt.layout import Layout
from layoutopt.problem import Limit, Problem
from layoutopt.protocols import Evaluate, SolverCard, Stop
from layoutopt.result import Evaluated, Result, Status
from layoutopt.scores import OUTCOME_UNITS, Score, Scores
from layoutopt.workers import Lost, Workers
from solvers.front import front_of
from solvers.judging import exact_scores, miss_text, worst_ratio

CARD: Final = SolverCard(
    summary="Enumerates the design space; proven optimal for goals that are exact.",
    reference="complete enumeration",
    exact=True,
    multi_objective=True,
    handles_noise=False,
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Screened:
    """A layout with its exact scores; ``rule`` and ``refusal`` say why it is out, both empty if it may race."""

    evaluated: Evaluated
    refusal: str = ""
    rule: str = ""


def screen(problem: Problem, *, workers: Workers | None = None) -> tuple[Screened, ...]:
    """Return every layout of the space with its exact scores, by cost, then key.

    A layout is refused if it cannot be built, if the estimator of the search does not apply to it, if an exact
    score breaks a limit, such as the budget, or if it cannot be scored at all. A layout that the space lists twice
    comes once; those that cannot be built come last and have no scores.
    """
    return scored(problem, entered(problem), workers=workers)


def entered(problem: Problem) -> tuple[Screened, ...]:
    """Return every layout of the space with its first goal alone, which is quick, by that and key.

    Refused is what cannot be built or judged, or breaks a limit on the first goal.
    """
    layouts = list({layout.key: layout for layout in problem.space.layouts()}.values())
    answers = dict(Workers().map(functools.partial(_entered, problem), layouts))
    found = [_screened(problem, layout, answers[number]) for number, layout in enumerate(layouts)]
    return tuple(sorted(found, key=lambda item: (_value(item, problem.goals[0]), item.evaluated.layout.key)))


def scored(
    problem: Problem, entries: Sequence[Screened], *, workers: Workers | None = None
) -> tuple[Screened, ...]:
    """Return the entries in their order, those that were not refused with all their exact scores.

    Raises
    ------
    StudyStopped
        If the workers were asked to stop.
    """
    open_entries = [number for number, item in enumerate(entries) if not item.refusal]
    layouts = [entries[number].evaluated.layout for number in open_entries]
    answers = dict((workers or Workers()).map(functools.partial(_scored, problem), layouts))
    if len(answers) < len(layouts):
        raise StudyStopped("stopped before the first trial")
    found = list(entries)
    for place, number in enumerate(open_entries):
        found[number] = _screened(problem, layouts[place], answers[place])
    return tuple(found)


_Answer = tuple[Mapping[str, Score], list[tuple[str, str]]]
"""Scores of a layout, and the rules that refuse it, each with its reason."""


def _entered(problem: Problem, layout: Layout) -> _Answer:
    violations = feasibility.check(layout, problem.design)
    if violations:
        # What cannot be built is not priced either: a price list knows no part for it.
        return {}, [(violation.rule, violation.message) for violation in violations]
    scores = exact_scores(problem, layout, only=problem.goals[0])
    reasons = _not_judged(problem, layout)
    for limit in problem.limits:
        if limit.score in scores:
            reasons += [reason] if (reason := exceeds(limit, scores, problem)) else []
    return scores, reasons


def _scored(problem: Problem, layout: Layout) -> _Answer:
    scores = exact_scores(problem, layout)
    return scores, [reason for limit in problem.limits if (reason := exceeds(limit, scores, problem))]


def _screened(problem: Problem, layout: Layout, answer: _Answer | Lost) -> Screened:
    if isinstance(answer, Lost):
        answer = {}, [("scoring", f"cannot be scored: {answer.kind.value}: {answer.message}")]
    scores, reasons = answer
    rule, refusal = reasons[0] if reasons else ("", "")
    return Screened(evaluated=Evaluated(layout=layout, scores=scores), refusal=refusal, rule=rule)


def _not_judged(problem: Problem, layout: Layout) -> list[tuple[str, str]]:
    """Return rule and reason if a goal is simulated and the estimator of the search does not apply."""
    if not any(goal.rpartition(".")[2] in OUTCOME_UNITS for goal in problem.goals):
        return []
    estimator = problem.estimators[0]
    reason = estimator.applies(layout)
    return [("estimator", f"estimator '{estimator.name}' does not apply: {reason}")] if reason else []


def exceeds(limit: Limit, scores: Scores, problem: Problem) -> tuple[str, str] | None:
    """Return rule and reason if an exact score breaks a limit, or the layout has no such exact score."""
    exact = any(
        limit.score.rpartition(".")[2] in objective.card.scores
        for objective in problem.objectives
        if objective.card.fidelity != "simulated"
    )
    if not exact:
        return None
    score = scores.get(limit.score)
    if score is None:
        return limit.score, f"{limit.score} does not apply to this layout, but is limited"
    if limit.broken(score):
        passes = "exceeds" if limit.upper is not None else "is below"
        return limit.score, (
            f"{limit.score} of {score.value:.6g} {score.unit} {passes} {limit.end:.6g} {score.unit}"
        )
    return None


@dataclass(frozen=True, slots=True, kw_only=True)
class Exhaustive:
    """Solver for problems whose goals are all exact; it never simulates."""

    card: ClassVar[SolverCard] = CARD

    def __call__(self, problem: Problem, evaluate: Evaluate, stop: Stop) -> Result:
        """Return the proven front of the layouts that have all goals and meet all limits.

        A limit may also be on a sampled score; it is met as every limit is, at its confidence.

        Raises
        ------
        ValueError
            If a goal is simulated or sampled, or a limit simulated.
        """
        limited = tuple(limit.score for limit in problem.limits)
        for objective in problem.objectives:
            fidelity = objective.card.fidelity
            names = {"simulated": (*problem.goals, *limited), "sampled": problem.goals}.get(fidelity, ())
            inexact = [name for name in names if name.rpartition(".")[2] in objective.card.scores]
            if inexact:
                raise ValueError(f"exhaustive search needs exact scores; {inexact[0]} is {fidelity}")
        screened = screen(problem)
        judged = [item.evaluated for item in screened if not item.refusal]
        judged = [item for item in judged if all(goal in item.scores for goal in problem.goals)]
        meeting = [
            item for item in judged if all(limit.met(score) for limit, score in problem.limits_on(item.scores))
        ]
        front = front_of(meeting, problem.goals)
        if not front.members:
            status, shortfall = _refused(problem, screened, judged)
            return Result(status=status, front=front, recommended={}, trials=0, shortfall=shortfall)
        best = front.members[0]
        return Result(
            status=Status.OPTIMAL,
            front=front,
            recommended={"cheapest": best},
            trials=0,
            bound=best.scores[problem.goals[0]].value,
            gap=0.0,
        )


def _refused(problem: Problem, screened: Sequence[Screened], judged: Sequence[Evaluated]) -> tuple[Status, str]:
    """Return why there is no answer, and in words what is missing."""
    if judged:
        # Not as a search sees it: samples are not added, so a share counts with what they may have missed.
        missed = [(worst, item) for item in judged if (worst := worst_ratio(problem, item.scores)) is not None]
        (_, limit, score), item = min(missed, key=lambda entry: entry[0][0])
        return Status.TARGET_NOT_MET, miss_text(item, limit, score)
    # By rising cost: the first that costs too much is the cheapest that can be built.
    refused = [item for item in screened if item.refusal]
    too_dear = next((item for item in refused if item.rule == problem.goals[0]), None)
    if too_dear is not None and all(item.rule == too_dear.rule for item in refused if item.evaluated.scores):
        return Status.BUDGET_TOO_SMALL, f"the cheapest layout that can be built: {too_dear.refusal}"
    if not refused:
        return Status.INFEASIBLE, "no layout of the design space has a score for every goal"
    return Status.INFEASIBLE, f"none of {len(screened)} layouts is left; the first: {refused[0].refusal}"


def _value(item: Screened, name: str) -> float:
    score = item.evaluated.scores.get(name)
    return score.value if score is not None else float("inf")
