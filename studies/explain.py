"""What a layout's parts are worth: limits that bind, layouts one step away on the same drives, conflicts."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final

from layoutopt import feasibility
from layoutopt.evaluate import outcomes_of
from layoutopt.layout import Layout
from layoutopt.problem import Limit, Problem
from layoutopt.progress import Progress, Silent
from layoutopt.protocols import Evaluation, Failure, Group, group_of
from layoutopt.result import Evaluated
from layoutopt.scenario import Scenario
from layoutopt.scores import OUTCOME_UNITS, Score, TrialOutcomes, paired_difference
from layoutopt.spec.building import Spec
from layoutopt.workers import Workers
from solvers.conflicts import Conflicts, conflicts_of
from solvers.judging import exact_scores
from studies.explain_limits import LimitUse, limit_uses
from studies.explain_variants import Variant, places_for_one_more, variants_of
from studies.fresh_drives import fresh_drives
from studies.held_out import failures_of
from studies.shortfall import worst_held_out

CONFIDENCE: Final = 0.95
"""Of all intervals of differences together."""
PLACE_TRIALS: Final = 24
"""Drives, used for nothing else, on which the place of one antenna more is chosen."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Step:
    """A layout one step away, judged beside the one it differs from.

    Attributes
    ----------
    refusal
        Why it cannot be built or judged; then there is nothing else.
    cost_eur
        Exact difference of cost.
    differences
        Paired difference of the goal on each held-out scenario by name, this less the layout explained.
    interval
        Interval of the difference on the scenario of `Explained.scenario`; all together hold at `CONFIDENCE`.
    misses
        Limits that its confidence bounds do not meet.
    evaluated
        Its scores: exact ones, and the simulated ones with a limit on their worst held-out scenario.
    """

    variant: Variant
    refusal: str = ""
    cost_eur: float = math.nan
    differences: Mapping[str, Score]
    interval: tuple[float, float] = (math.nan, math.nan)
    misses: tuple[Limit, ...] = ()
    evaluated: Evaluated | None = None

    @property
    def better(self) -> bool:
        """Whether the goal is lower for certain."""
        return self.interval[1] < 0.0

    @property
    def worse(self) -> bool:
        """Whether the goal is higher for certain."""
        return self.interval[0] > 0.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Explained:
    """A layout with its limits and what lies one step away.

    Attributes
    ----------
    scenario
        Name of the held-out scenario on which the goal is worst; differences are told of it.
    scores
        The layout's goal on each held-out scenario by name.
    first, trials
        Number of the first replication, and how many there are of each layout and scenario.
    refusal
        Why the layout itself cannot be built or judged.
    conflicts
        Among the layout and those one step away, if none of them meets all limits.
    """

    layout: Layout
    problem: Problem
    seed: int
    first: int
    trials: int
    cost_eur: float
    scenario: str
    scores: Mapping[str, Score]
    refusal: str
    limits: tuple[LimitUse, ...]
    steps: tuple[Step, ...]
    conflicts: Conflicts
    failures: Mapping[Group, str]

    @property
    def exit_code(self) -> int:
        """One if the layout cannot be built or judged, misses a limit, or a task failed."""
        return int(bool(self.refusal or self.failures) or not all(use.met for use in self.limits))

    @property
    def judged(self) -> tuple[Step, ...]:
        """The steps that can be built and judged."""
        return tuple(step for step in self.steps if not step.refusal)

    def rate(self, step: Step) -> float:
        """Return EUR per unit of the goal that a step pays or saves; NaN where no change of the goal is certain.

        Positive for one that buys accuracy or sells it; negative where both get better or both get worse.
        """
        if not (step.better or step.worse):
            return math.nan
        return -step.cost_eur / step.differences[self.scenario].value

    def rate_interval(self, step: Step) -> tuple[float, float]:
        """Return the ends of the interval of a rate: the cost is exact, the change has its interval."""
        if not (step.better or step.worse):
            return math.nan, math.nan
        low, high = sorted(-step.cost_eur / end for end in step.interval)
        return low, high

    @property
    def bought(self) -> tuple[Step, ...]:
        """What the next euro buys: steps that lower the goal for certain, the cheapest rate first."""
        return tuple(sorted((step for step in self.judged if step.better), key=self.rate))

    @property
    def saved(self) -> tuple[Step, ...]:
        """What could be saved: cheaper steps that meet all limits, first those that lose nothing for certain.

        Those go by what they save, the others by EUR saved for a unit of the goal.
        """
        found = [step for step in self.judged if step.cost_eur < 0.0 and not step.misses]

        def rank(step: Step) -> tuple[bool, float]:
            return step.worse, -self.rate(step) if step.worse else step.cost_eur

        return tuple(sorted(found, key=rank))


def explain(
    spec: Spec, layout: Layout, *, trials: int, workers: Workers, progress: Progress | None = None
) -> Explained:
    """Return what the parts of a layout are worth, on held-out drives that no study has used.

    The layout and all that lie one step away meet the same drives: replications from the spec's number of
    validation trials on, of both held-out scenarios, with the estimator of the search.

    Raises
    ------
    Interrupted
        If the workers were asked to stop.
    """
    problem, watcher, first = spec.problem(), progress or Silent(), spec.study.validation_trials

    def driven(
        name: str, layouts: Sequence[Layout], scenarios: Sequence[Scenario], start: int, count: int
    ) -> tuple[Evaluation | Failure, ...]:
        cells = [(item, scenario) for item in layouts for scenario in scenarios]
        return fresh_drives(spec, name, cells, trials=count, workers=workers, progress=watcher, first=start)

    variants = list(variants_of(spec, layout))
    refusal = refusal_of(problem, layout)
    places = () if refusal else places_for_one_more(layout, problem.design)
    if places:
        hardest = problem.held_out[-1]
        layouts = [place.layout for place in places]
        found = driven("places of one antenna more", layouts, [hardest], first + trials, PLACE_TRIALS)
        variants.append(best_place(problem, places, hardest, outcomes_of(found)))
    refusals = [refusal_of(problem, variant.layout) for variant in variants]
    layouts = [variant.layout for variant, why in zip(variants, refusals, strict=True) if not why]
    layouts = [] if refusal else [layout, *layouts]
    found = driven("layouts one step away", layouts, problem.held_out, first, trials)
    return explained(
        problem,
        layout,
        [(variant, why) for variant, why in zip(variants, refusals, strict=True)],
        found,
        seed=spec.seed,
        first=first,
        trials=trials,
    )


def explained(
    problem: Problem,
    layout: Layout,
    variants: Sequence[tuple[Variant, str]],
    evaluations: Sequence[Evaluation | Failure],
    *,
    seed: int,
    first: int,
    trials: int,
) -> Explained:
    """Return what evaluations say of a layout and its variants, each with why it cannot be judged, or nothing."""
    known, failed = outcomes_of(evaluations), failures_of(evaluations)
    goal, refusal = problem.goals[1], refusal_of(problem, layout)
    base = _evaluated(problem, layout, known)
    tables = _tables(problem, layout, known)
    scores = {name: table.score(goal) for name, table in tables.items()}
    scenario = max(scores, key=lambda name: _or_least(scores[name].value), default="")
    judged = sum(not why for _, why in variants)
    steps = []
    for variant, why in variants:
        other = _tables(problem, variant.layout, known)
        if why or not tables or len(other) < len(tables):
            failures = [text for group, text in failed.items() if group.layout_key == variant.layout.key]
            reason = why or (f"failed: {failures[0]}" if failures else "the layout itself was not judged")
            steps.append(Step(variant=variant, refusal=reason, differences={}))
            continue
        differences = {name: paired_difference(other[name], tables[name], goal) for name in tables}
        item = _evaluated(problem, variant.layout, known)
        steps.append(
            Step(
                variant=variant,
                cost_eur=item.scores[problem.goals[0]].value - base.scores[problem.goals[0]].value,
                differences=differences,
                # Bonferroni: what is said of many layouts holds of all of them together.
                interval=differences[scenario].interval(1.0 - (1.0 - CONFIDENCE) / judged),
                misses=tuple(
                    limit
                    for limit in problem.limits
                    if limit.score not in item.scores or not limit.met(item.scores[limit.score])
                ),
                evaluated=item,
            )
        )
    items = [step.evaluated for step in steps if step.evaluated is not None]
    return Explained(
        layout=layout,
        problem=problem,
        seed=seed,
        first=first,
        trials=trials,
        cost_eur=base.scores[problem.goals[0]].value if problem.goals[0] in base.scores else math.nan,
        scenario=scenario,
        scores=scores,
        refusal=refusal,
        limits=limit_uses(problem.limits, base.scores, *_next_cheaper(steps)),
        steps=tuple(steps),
        conflicts=conflicts_of(problem.limits, [base, *items] if tables else []),
        failures=failed,
    )


def refusal_of(problem: Problem, layout: Layout) -> str:
    """Return why a layout cannot be built, priced or judged; empty if it can."""
    try:
        violations = feasibility.check(layout, problem.design)
        if not violations:
            exact_scores(problem, layout, only=problem.goals[0])
    except (ValueError, KeyError) as error:
        # An edit of a tag that another pattern does not lay, or a part that no price list holds.
        return str(error)
    if violations:
        return "; ".join(violation.message for violation in violations)
    reason = problem.estimators[0].applies(layout)
    return f"estimator '{problem.estimators[0].name}' does not apply: {reason}" if reason else ""


def best_place(
    problem: Problem, places: Sequence[Variant], scenario: Scenario, known: Mapping[Group, TrialOutcomes]
) -> Variant:
    """Return the place of one antenna more with the lowest goal; the first where none has drives."""

    def goal(place: Variant) -> float:
        table = known.get(group_of(place.layout, scenario, problem.estimators[0]))
        value = math.nan if table is None else table.score(problem.goals[1]).value
        return math.inf if math.isnan(value) else value

    best = min(places, key=goal)
    chosen = f"the best of {len(places)} places" if len(places) > 1 else "the only place that was tried"
    return replace(best, change=f"{best.change}, {chosen}")


def _tables(problem: Problem, layout: Layout, known: Mapping[Group, TrialOutcomes]) -> dict[str, TrialOutcomes]:
    """Return the outcomes on each held-out scenario; nothing if those of one are missing."""
    groups = {scenario.name: group_of(layout, scenario, problem.estimators[0]) for scenario in problem.held_out}
    if any(group not in known for group in groups.values()):
        return {}
    return {name: known[group] for name, group in groups.items()}


def _evaluated(problem: Problem, layout: Layout, known: Mapping[Group, TrialOutcomes]) -> Evaluated:
    """Return cost, exact scores with a limit, and simulated ones with a limit on their worst held-out scenario."""
    if refusal_of(problem, layout):
        return Evaluated(layout=layout, scores={})
    exact: dict[str, Score] = {}
    for name in (problem.goals[0], *(limit.score for limit in problem.limits)):
        quantity = name.rpartition(".")[2]
        if quantity not in OUTCOME_UNITS:
            exact.update(exact_scores(problem, layout, only=quantity))
    return Evaluated(layout=layout, scores={**exact, **(worst_held_out(problem, layout, known) or {})})


def _next_cheaper(steps: Sequence[Step]) -> tuple[str, tuple[Limit, ...]]:
    """Return what the next cheaper layout changes, and the limits that it misses; nothing without one."""
    cheaper = [step for step in steps if not step.refusal and step.cost_eur < 0.0]
    following = max(cheaper, key=lambda step: step.cost_eur, default=None)
    return ("", ()) if following is None else (following.variant.change, following.misses)


def _or_least(value: float) -> float:
    return -math.inf if math.isnan(value) else value
