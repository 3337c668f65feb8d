"""Short questions about a spec, a layout or a finished study, answered without a study folder of their own."""

import math
import re
from collections.abc import Callable, Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TYPE_CHECKING, Final

from layoutopt import feasibility
from layoutopt.errors import Interrupted, InvalidInput
from layoutopt.evaluate import Evaluator, outcomes_of
from layoutopt.feasibility import Violation
from layoutopt.journal import FROZEN_SPEC, MANIFEST, read_manifest, read_recorded
from layoutopt.layout import Layout
from layoutopt.parts import read_prices
from layoutopt.problem import Problem
from layoutopt.progress import Progress
from layoutopt.protocols import AnyEstimator, Group, group_of
from layoutopt.result import Evaluated, Result, Status
from layoutopt.score_text import euros, score_text
from layoutopt.scores import Score
from layoutopt.spec.building import Spec
from layoutopt.spec.reading import read_spec
from layoutopt.stopping import StopRequest
from layoutopt.streams import Streams
from layoutopt.units import Dimension, positive_quantity
from layoutopt.workers import Workers
from solvers.exhaustive import exceeds
from solvers.front import front_of
from solvers.judging import exact_scores, meeting_limits, pointed_out, simulated_scores
from studies import held_out
from studies.alternatives import alternatives_of, wish_of
from studies.cost_vs_accuracy import CostVersusAccuracy
from studies.finder_scores import exact_finder_scores, finder_trials
from studies.findings import Design, Findings
from studies.runner import replay, run_rounds
from studies.shortfall import sentences, widened_conflict
from studies.trade_off import trade_off_of

if TYPE_CHECKING:
    from layoutopt.scenario import Scenario

MAIN_STUDY: Final = "cost_vs_accuracy"
"""The study whose front can be priced anew."""
_EXAMPLES: Final = {"length": "10 mm", "price": "3000 EUR"}
_FREE: Final = Score(value=0.0, unit="EUR")
"""The cost of what has none, because it cannot be built."""
REPRICED_TRIALS: Final = 16
"""A layout needs that many trials to enter a repriced front: fewer would favour lucky ones."""


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


def reprice(folder: Path, prices_file: Path) -> tuple[Findings, int]:
    """Return the findings of a finished study with front and choices made anew under other prices.

    Nothing is simulated. The number says how many simulated layouts stayed out: those with fewer trials than
    any member of the old front, or than `REPRICED_TRIALS`, because few trials favour lucky ones. The choices rest
    on the search; no held-out drive was run for them.

    Raises
    ------
    StudyDamaged, InvalidInput
        If the folder holds no finished study, or the price list is faulty.
    """
    if not (folder / MANIFEST).exists():
        raise InvalidInput.at(str(folder), "holds no study", "Give the --out folder of a finished study.")
    facts = read_manifest(folder)
    if facts.get("study") != MAIN_STUDY:
        repair = f"Give the --out folder of a {MAIN_STUDY} study."
        raise InvalidInput.at(str(folder), f"the study {facts.get('study')!r} has no front of costs", repair)
    quick = bool(facts.get("quick"))
    spec = read_spec(folder / FROZEN_SPEC)
    question = CostVersusAccuracy.for_spec(spec, quick=quick)
    evaluations = replay(question, streams=Streams(seed=spec.seed), recorded=read_recorded(folder))
    before = question.findings(evaluations)
    problem = replace(spec, prices=read_prices(prices_file, place=str(prices_file))).problem()
    old_front = {item.layout.key for item in before.result.front.members}
    trials = [item.trials for item in before.designs if item.evaluated.layout.key in old_front]
    least = min([REPRICED_TRIALS, *trials])
    designs = [_repriced(design, problem) for design in before.designs]
    judged = [item.evaluated for item in designs if item.trials >= least and not item.refusal]
    front = front_of(judged, problem.goals)
    meeting = sorted(meeting_limits(problem, judged), key=lambda item: item.scores[problem.goals[0]].value)
    recommended = pointed_out(front, meeting[0] if meeting else None)
    on_front = {item.layout.key for item in front.members}
    known, wish = outcomes_of(evaluations), wish_of(spec.study)
    findings = replace(
        before,
        problem=problem,
        designs=tuple(replace(item, on_front=item.evaluated.layout.key in on_front) for item in designs),
        result=replace(before.result, status=Status.SEARCHED, front=front, recommended=recommended, shortfall=""),
        trade_off=trade_off_of(problem, judged, front, recommended, known, spec.seed),
        alternatives=alternatives_of(problem, judged, recommended, known, wish),
        reasons={role: "by the search, under the new prices; not validated anew" for role in recommended},
    )
    return findings, sum(0 < item.trials < least for item in designs)


def choice_lines(findings: Findings) -> list[str]:
    """Return a line for each recommended layout: role, label, key, cost and why it was chosen."""
    cost = findings.problem.goals[0]
    return [
        f"{role}: {item.layout.label} [{item.layout.short_key}], {euros(item.scores[cost].value)}, "
        f"{findings.reasons[role]}"
        for role, item in findings.result.recommended.items()
    ]


def _repriced(design: Design, problem: Problem) -> Design:
    """Return a design with its exact scores under the problem's prices, refused if one breaks a limit."""
    if design.refusal and not design.trials:
        return design
    layout = design.evaluated.layout
    scores = {**design.evaluated.scores, **exact_scores(problem, layout)}
    broken = [reason for limit in problem.limits if (reason := exceeds(limit, scores, problem))]
    return replace(
        design,
        evaluated=Evaluated(layout=layout, scores=scores),
        refusal=broken[0][1] if broken else design.refusal,
    )


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
