"""Short questions about a spec, a layout or a finished study, answered without a study folder of their own."""

import math
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from typing import TYPE_CHECKING, Final

from layoutopt import feasibility
from layoutopt.errors import Interrupted
from layoutopt.evaluate import Evaluator, outcomes_of
from layoutopt.feasibility import Violation
from layoutopt.layout import Layout
from layoutopt.problem import Problem
from layoutopt.progress import Progress
from layoutopt.protocols import AnyEstimator, Group, group_of
from layoutopt.result import Evaluated, Result, Status
from layoutopt.score_text import euros, score_text
from layoutopt.scores import Score
from layoutopt.spec.building import Spec
from layoutopt.stopping import StopRequest
from layoutopt.streams import Streams
from layoutopt.units import Dimension, positive_quantity
from layoutopt.workers import Workers
from solvers.judging import exact_scores, simulated_scores
from studies import held_out
from studies.cost_vs_accuracy import CostVersusAccuracy
from studies.finder_scores import exact_finder_scores, finder_trials
from studies.findings import Findings
from studies.runner import run_rounds
from studies.shortfall import sentences, widened_conflict

if TYPE_CHECKING:
    from layoutopt.scenario import Scenario

_EXAMPLES: Final = {"length": "10 mm", "price": "3000 EUR"}
_FREE: Final = Score(value=0.0, unit="EUR")
"""The cost of what has none, because it cannot be built."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Scored:
    """All scores of one layout: exact ones, and simulated ones by scenario and estimator."""

    layout: Layout
    seed: int
    violations: tuple[Violation, ...]
    exact: Mapping[str, Score]
    simulated: Mapping[tuple[str, str], Mapping[str, Score]]
    does_not_apply: Mapping[str, str]
    failures: Mapping[Group, str]

    def as_json(self) -> dict[str, object]:
        """Return the scores in plain types; what is not known is null."""
        return {
            "layout": self.layout.key,
            "label": self.layout.label,
            "seed": self.seed,
            "extrapolated": self.layout.extrapolated,
            "violations": [violation.message for violation in self.violations],
            "exact": {name: _plain(score) for name, score in self.exact.items()},
            "simulated": [
                {
                    "scenario": scenario,
                    "estimator": estimator,
                    "scores": {name: _plain(score) for name, score in scores.items()},
                }
                for (scenario, estimator), scores in self.simulated.items()
            ],
            "does_not_apply": dict(self.does_not_apply),
            "failures": [
                {"scenario": group.scenario, "estimator": group.estimator, "message": message}
                for group, message in self.failures.items()
            ],
        }

    def as_text(self) -> str:
        """Return the scores as lines for people."""
        lines = [f"{self.layout.short_key}  {self.layout.label}  (seed {self.seed})"]
        if self.layout.extrapolated:
            lines.append("the antenna model is extrapolated to such an antenna: measure one before buying")
        lines += [f"cannot be built: {violation.message}" for violation in self.violations]
        lines += [f"  {name:28} {score_text(score, name)}" for name, score in self.exact.items()]
        if self.layout.floor_tags.edits:
            lines.append("half-gaps, static errors and blind runs speak of the pattern, not of its edited tags")
        for (scenario, estimator), scores in self.simulated.items():
            lines.append(f"{scenario}, {estimator}")
            lines += [f"  {name:28} {score_text(score, name)}" for name, score in scores.items()]
        lines += [f"{estimator} does not apply: {reason}" for estimator, reason in self.does_not_apply.items()]
        lines += [f"{group.estimator} failed on {group.scenario}: {text}" for group, text in self.failures.items()]
        return "\n".join(lines)


def score(spec: Spec, layout: Layout, *, trials: int, workers: Workers) -> Scored:
    """Return every score of a layout, on the design scenario and on the held-out ones.

    A layout with UHF antennas or crossed antennas is judged at tracking and docking too, by the trials that the
    spec asks for, but by ``trials`` at most.

    Raises
    ------
    Interrupted
        If the workers were asked to stop.
    """
    problem = spec.problem()
    scenarios = (problem.design, *problem.held_out)
    tasks = held_out.tasks([layout], scenarios, problem.estimators, trials, {}, {})
    finding, reasons = finder_trials(spec, layout)
    for entry in finding:
        tasks += held_out.tasks([layout], [entry.scenario], [entry.estimator], min(trials, entry.trials), {}, {})
    evaluations = Evaluator(Streams(seed=spec.seed), workers=workers)(tasks)
    if len(evaluations) < len(tasks):
        raise Interrupted("stopped as asked; a score keeps nothing")
    known = outcomes_of(evaluations)
    reasons = {estimator.name: estimator.applies(layout) for estimator in problem.estimators} | reasons
    judged: list[tuple[Scenario, AnyEstimator]] = [
        (scenario, estimator) for scenario in scenarios for estimator in problem.estimators
    ]
    judged += [(entry.scenario, entry.estimator) for entry in finding]
    return Scored(
        layout=layout,
        seed=spec.seed,
        violations=feasibility.check(layout, problem.design),
        exact={**exact_scores(problem, layout), **exact_finder_scores(problem, layout, finding)},
        simulated={
            (scenario.name, estimator.name): simulated_scores(
                problem, layout, scenario, known[group_of(layout, scenario, estimator)]
            )
            for scenario, estimator in judged
            if group_of(layout, scenario, estimator) in known
        },
        does_not_apply={name: reason for name, reason in reasons.items() if reason},
        failures=held_out.failures_of(evaluations),
    )


def with_demand(spec: Spec, *, target_error: str | None, budget: str | None) -> Spec:
    """Return the spec with the demand of a command line in place of its own.

    Raises
    ------
    InvalidInput
        If a value cannot be read or is not positive.
    """
    if target_error is not None:
        spec = replace(spec, target_error_m=_positive("--target-error", target_error, "length"))
    if budget is not None:
        spec = replace(spec, budget_eur=_positive("--budget", budget, "price"))
    return spec


def solve(
    spec: Spec,
    *,
    workers: Workers,
    stop: StopRequest,
    quick: bool,
    progress: Progress,
    problem_of: Callable[[Spec], Problem] = Spec.problem,
) -> Findings:
    """Return the findings of the main study without a folder and without reference marks.

    Where a budget kept layouts out and none of the others meets the demand, the search is made once more without
    the budget, and the shortfall says how much more money meets the rest.

    Raises
    ------
    Interrupted
        If it was asked to stop.
    """

    def findings_of(asked: Spec) -> Findings:
        question = CostVersusAccuracy.for_spec(asked, quick=quick, problem=problem_of(asked))
        question = replace(question, reference_trials=0)
        if not question.contenders:
            return question.findings(())
        streams = Streams(seed=spec.seed)
        ran = run_rounds(question, streams=streams, journal=None, progress=progress, workers=workers, stop=stop)
        if ran.stopped:
            raise Interrupted("stopped as asked; solve keeps nothing, a study in a folder would")
        return question.findings(ran.evaluations)

    findings = findings_of(spec)
    result, cost = findings.result, findings.problem.goals[0]
    budget_eur = min((limit.end for limit in findings.problem.limits if limit.score == cost), default=math.inf)
    kept_out = any(
        item.refusal and item.evaluated.scores.get(cost, _FREE).value > budget_eur for item in findings.designs
    )
    if result.status is not Status.TARGET_NOT_MET or not kept_out:
        return findings
    rest = tuple(limit for limit in spec.own_limits if limit.score != cost)
    without = findings_of(replace(spec, budget_eur=None, own_limits=rest))
    conflict = widened_conflict(findings.problem, [*findings.designs, *without.designs])
    parts = (result.shortfall, conflict, _without_budget(without.result, cost, budget_eur))
    return replace(findings, result=replace(result, shortfall=sentences(*parts)))


def _without_budget(result: Result, cost: str, budget_eur: float) -> str:
    """Return in words how much more than the budget meets the other limits."""
    if result.status is not Status.TARGET_MET:
        return "without the budget no layout was shown to meet the other limits either"
    item = result.recommended["cheapest"]
    more = euros(item.scores[cost].value - budget_eur)
    return f"+{more} would meet the other limits on held-out drives: {item.layout.label} [{item.layout.short_key}]"


def chosen(findings: Findings, *, by_budget: bool) -> Evaluated | None:
    """Return the layout that answers: the most accurate where only a budget was given, else the cheapest."""
    return findings.result.recommended.get("most accurate" if by_budget else "cheapest")


def _positive(place: str, text: str, dimension: Dimension) -> float:
    # Ten what? A bare number means metres in a spec, but hardly on a command line; money has one unit.
    given = f"{text} EUR" if dimension == "price" and re.fullmatch(r"\s*\d+(\.\d+)?\s*", text, re.ASCII) else text
    return positive_quantity(place, given, dimension, _EXAMPLES[dimension])


def _plain(score: Score) -> dict[str, object]:
    return {
        "value": score.value if math.isfinite(score.value) else None,
        "unit": score.unit,
        "standard_error": score.standard_error if math.isfinite(score.standard_error) else None,
        "count": score.count,
    }
