"""Short questions about a spec, a layout or a finished study, answered without a study folder of their own."""

import json
import math
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path

from layoutopt.spec.building import Spec
from layoutopt.spec.reading import read_spec

from layoutopt import feasibility
from layoutopt.errors import InvalidInput
from layoutopt.evaluate import Evaluator, outcomes_of
from layoutopt.feasibility import Violation
from layoutopt.journal import MANIFEST, read_evaluations
from layoutopt.layout import Layout
from layoutopt.parts import read_prices
from layoutopt.result import Evaluated
from layoutopt.scores import Score
from layoutopt.streams import Streams
from layoutopt.units import Dimension, parse_quantity
from solvers.exhaustive import exact_scores
from solvers.front import front_of
from studies import held_out
from studies.cost_vs_accuracy import CostVersusAccuracy
from studies.findings import Findings
from studies.progress import Progress
from studies.runner import run_rounds

REPRICED_TRIALS = 16
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

    def as_json(self) -> dict[str, object]:
        """Return the scores in plain types; what is not known is null."""
        return {
            "layout": self.layout.key,
            "label": self.layout.label,
            "seed": self.seed,
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
        }

    def as_text(self) -> str:
        """Return the scores as lines for people."""
        lines = [f"{self.layout.short_key}  {self.layout.label}  (seed {self.seed})"]
        lines += [f"cannot be built: {violation.message}" for violation in self.violations]
        lines += [f"  {name:28} {_readable(score)}" for name, score in self.exact.items()]
        for (scenario, estimator), scores in self.simulated.items():
            lines.append(f"{scenario}, {estimator}")
            lines += [f"  {name:28} {_readable(score)}" for name, score in scores.items()]
        lines += [f"{estimator} does not apply: {reason}" for estimator, reason in self.does_not_apply.items()]
        return "\n".join(lines)


def score(spec: Spec, layout: Layout, *, trials: int, jobs: int) -> Scored:
    """Return every score of a layout, on the design scenario and on the held-out ones."""
    problem = spec.problem()
    scenarios = (problem.design, *problem.held_out)
    tasks = held_out.tasks([layout], scenarios, problem.estimators, trials, {}, frozenset())
    evaluations = Evaluator(Streams(seed=spec.seed), jobs=jobs)(tasks)
    known = outcomes_of(evaluations)
    reasons = {estimator.name: estimator.applies(layout) for estimator in problem.estimators}
    return Scored(
        layout=layout,
        seed=spec.seed,
        violations=feasibility.check(layout, problem.design),
        exact=exact_scores(problem, layout),
        simulated={
            (scenario.name, estimator.name): held_out.simulated_scores(
                problem, layout, scenario, known[(layout.key, scenario.name, estimator.name)]
            )
            for scenario in scenarios
            for estimator in problem.estimators
            if (layout.key, scenario.name, estimator.name) in known
        },
        does_not_apply={name: reason for name, reason in reasons.items() if reason},
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


def solve(spec: Spec, *, jobs: int, quick: bool, progress: Progress) -> Findings:
    """Return the findings of the main study without a folder and without reference marks."""
    question = replace(CostVersusAccuracy.for_spec(spec, quick=quick), reference_trials=0)
    if not question.contenders:
        return question.findings(())
    evaluations = run_rounds(question, streams=Streams(seed=spec.seed), jobs=jobs, journal=None, progress=progress)
    return question.findings(evaluations)


def chosen(findings: Findings, *, by_budget: bool) -> Evaluated | None:
    """Return the layout that answers: the most accurate where only a budget was given, else the cheapest."""
    return findings.result.recommended.get("most accurate" if by_budget else "cheapest")


def reprice(folder: Path, prices_file: Path) -> Findings:
    """Return the findings of a finished study with its front made anew under other prices.

    Only layouts with at least `REPRICED_TRIALS` trials enter the front; nothing is simulated.

    Raises
    ------
    StudyDamaged, InvalidInput
        If the folder holds no readable study, or the price list is faulty.
    """
    if not (folder / MANIFEST).exists():
        raise InvalidInput.at(str(folder), "holds no study", "Give the --out folder of a finished study.")
    quick = bool(json.loads((folder / MANIFEST).read_text(encoding="utf-8"))["quick"])
    spec = read_spec(folder / "spec.toml")
    evaluations = read_evaluations(folder)
    before = CostVersusAccuracy.for_spec(spec, quick=quick).findings(evaluations)
    new_spec = replace(spec, prices=read_prices(prices_file, place=str(prices_file)))
    problem = new_spec.problem()
    designs = []
    for design in before.designs:
        layout = design.evaluated.layout
        scores = {**design.evaluated.scores, **exact_scores(problem, layout)}
        designs.append(replace(design, evaluated=Evaluated(layout=layout, scores=scores), on_front=False))
    judged = [design.evaluated for design in designs if design.trials >= REPRICED_TRIALS]
    front = front_of(judged, problem.goals)
    on_front = {item.layout.key for item in front.members}
    return replace(
        before,
        problem=problem,
        designs=tuple(replace(item, on_front=item.evaluated.layout.key in on_front) for item in designs),
        result=replace(before.result, front=front),
    )


def _positive(place: str, text: str, dimension: Dimension) -> float:
    try:
        value = parse_quantity(float(text) if text.replace(".", "", 1).isdigit() else text, dimension)
    except ValueError as error:
        raise InvalidInput.at(place, str(error)) from None
    if not value > 0.0:
        raise InvalidInput.at(place, f"{text!r} is not positive", "Give a value above zero.")
    return value


def _plain(score: Score) -> dict[str, object]:
    return {
        "value": score.value if math.isfinite(score.value) else None,
        "unit": score.unit,
        "standard_error": score.standard_error if math.isfinite(score.standard_error) else None,
        "count": score.count,
    }


def _readable(score: Score) -> str:
    if score.exact:
        return f"{score.value:.6g} {score.unit} (exact)"
    if not math.isfinite(score.value):
        return "not known"
    return f"{score.value:.4g} ± {score.standard_error:.2g} {score.unit} (n = {score.count})"
