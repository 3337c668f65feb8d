"""The cheapest floor for a further area, where what is installed stays and costs nothing."""

import math
from dataclasses import dataclass, replace
from typing import Final

from layoutopt.commissioning.expansion import Expansion, equipped_parts, expanded_space
from layoutopt.evaluate import outcomes_of
from layoutopt.layout import Layout
from layoutopt.problem import Problem
from layoutopt.progress import Progress
from layoutopt.protocols import group_of
from layoutopt.result import Evaluated
from layoutopt.scenario import Scenario
from layoutopt.scores import Score
from layoutopt.simulation.outcomes import ZONE_COLUMNS
from layoutopt.site import Site, Zone
from layoutopt.spec.building import Spec
from layoutopt.stopping import StopRequest
from layoutopt.workers import Workers
from objectives.cost import Cost
from studies import answers, held_out
from studies.cost_vs_accuracy import QUICK_SHARE
from studies.findings import Findings
from studies.fresh_drives import fresh_drives

PLAIN_SCORE: Final = "position_error_mean"
"""What is compared in the installed area where the goal is nothing that is known of a zone."""
MOST_ACCURATE: Final = "most accurate"
"""Role of the layout on which the installed area is judged if none answers the demand."""


@dataclass(frozen=True, slots=True, kw_only=True)
class OldPart:
    """A connected part of the installed area: the score there before and after, from different drives.

    ``zone`` is the name of the part in the outcomes; a score is ``None`` if a task failed or no drive came by.
    """

    zone: str
    area_m2: float
    before: Score | None
    after: Score | None

    @property
    def change(self) -> Score | None:
        """After less before; the variances add, because the drives are not the same."""
        if self.before is None or self.after is None:
            return None
        return held_out.difference(self.after, self.before)


@dataclass(frozen=True, slots=True, kw_only=True)
class OldArea:
    """What the extension does to the installed area.

    ``before`` is of robots that drive the old floor with its tags alone, ``after`` of robots that drive the whole
    new floor and pass here. Both meet the faults of the same held-out scenario, on drives ``first`` and later.
    ``role`` says which layout of the whole floor this is.
    """

    role: str
    score: str
    scenario: str
    estimator: str
    first: int
    trials: int
    parts: tuple[OldPart, ...]
    failures: tuple[str, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Expanded:
    """The answer: findings about the extension, and the layout of the whole floor that answers the demand.

    ``chosen`` is ``None`` where no layout does; ``old_area`` is then that of the most accurate layout of the
    front, and ``None`` without a front.
    """

    expansion: Expansion
    spec: Spec
    findings: Findings
    chosen: Evaluated | None
    old_area: OldArea | None

    @property
    def exit_code(self) -> int:
        """That of the search, and one if the installed area could not be judged."""
        failed = self.old_area is not None and bool(self.old_area.failures)
        return self.findings.result.status.exit_code or int(failed)

    @property
    def cost(self) -> Cost:
        """What the extension is priced with."""
        return next(item for item in self.findings.problem.objectives if isinstance(item, Cost))


def expand(
    expansion: Expansion,
    installed: tuple[Spec, Layout],
    spec: Spec,
    *,
    by_budget: bool = False,
    new_readers: bool = False,
    workers: Workers,
    stop: StopRequest,
    quick: bool,
    progress: Progress,
) -> Expanded:
    """Return the cheapest floor for the area that a spec adds to an installed one.

    The search is that of `studies.answers.solve`: target, limits and held-out drives are of the whole new floor,
    cost is of what is not there yet.

    Parameters
    ----------
    installed
        Spec and layout of the installed floor.
    by_budget
        Whether the most accurate layout within the budget answers, and not the cheapest that meets the target.
    new_readers
        Whether readers of the spec compete with those that the robots carry.

    Raises
    ------
    InvalidInput
        If the spec leaves no pattern for the new area.
    Interrupted
        If it was asked to stop.
    """

    def problem_of(asked: Spec) -> Problem:
        return expanded_problem(expansion, asked, new_readers=new_readers)

    findings = answers.solve(
        spec, workers=workers, stop=stop, quick=quick, progress=progress, problem_of=problem_of
    )
    chosen = answers.chosen(findings, by_budget=by_budget)
    if findings.result.status.exit_code:
        chosen = None
    role = next((role for role, item in findings.result.recommended.items() if item is chosen), MOST_ACCURATE)
    judged = findings.result.recommended.get(role)
    old_area = None
    if judged is not None:
        trials = max(2, spec.study.validation_trials // (QUICK_SHARE if quick else 1))
        old_area = judge_old_area(
            expansion,
            installed,
            findings.problem,
            judged.layout,
            spec,
            role=role,
            trials=trials,
            workers=workers,
            progress=progress,
        )
    return Expanded(expansion=expansion, spec=spec, findings=findings, chosen=chosen, old_area=old_area)


def expanded_problem(expansion: Expansion, spec: Spec, *, new_readers: bool = False) -> Problem:
    """Return the question of a spec about the new area alone: its layouts, and what is paid for them.

    Raises
    ------
    InvalidInput
        If the spec leaves no pattern for the new area.
    """
    problem = spec.problem()
    objectives = tuple(
        replace(
            item,
            equipped_count=expansion.equipped_count,
            equipped_with=expansion.readers,
            standing=expansion.transponders,
            given_out=expansion.target_tags,
        )
        if isinstance(item, Cost)
        else item
        for item in problem.objectives
    )
    space = expanded_space(expansion, spec, new_readers=new_readers)
    return replace(problem, space=space, objectives=objectives)


def judge_old_area(
    expansion: Expansion,
    installed: tuple[Spec, Layout],
    problem: Problem,
    layout: Layout,
    spec: Spec,
    *,
    role: str,
    trials: int,
    workers: Workers,
    progress: Progress,
) -> OldArea:
    """Return how good the installed area is before and after, on drives that no search has used.

    Every part of the area is made a zone with a target, so that routes lead there and errors are told by it.

    Raises
    ------
    Interrupted
        If the workers were asked to stop.
    """
    (old, old_layout), world, estimator = installed, problem.held_out[-1], problem.estimators[0]
    quantity = problem.goals[1].rpartition(".")[2]
    score = quantity if quantity in ZONE_COLUMNS else PLAIN_SCORE
    zones = _zones(expansion, (*old.site.zone_names, *spec.site.zone_names))
    cells = [
        (old_layout, replace(world, site=_with_zones(old.site, zones))),
        (layout, replace(world, site=_with_zones(spec.site, zones))),
    ]
    results = fresh_drives(
        spec, "the installed area, before and after", cells, trials=trials, workers=workers, progress=progress
    )
    known = outcomes_of(results)

    def scored(cell: tuple[Layout, Scenario], zone: Zone) -> Score | None:
        outcomes = known.get(group_of(*cell, estimator))
        found = None if outcomes is None else outcomes.score(f"{zone.name}.{score}")
        return None if found is None or math.isnan(found.value) else found

    return OldArea(
        role=role,
        score=score,
        scenario=world.name,
        estimator=estimator.name,
        first=spec.study.validation_trials,
        trials=trials,
        parts=tuple(
            OldPart(
                zone=zone.name,
                area_m2=float(zone.region.area),
                before=scored(cells[0], zone),
                after=scored(cells[1], zone),
            )
            for zone in zones
        ),
        failures=tuple(sorted(set(held_out.failures_of(results).values()))),
    )


def _zones(expansion: Expansion, taken: tuple[str, ...]) -> tuple[Zone, ...]:
    """Return the parts of the installed area as zones whose names no plan uses."""
    parts, name = equipped_parts(expansion), "installed"
    names = [name] if len(parts) == 1 else [f"{name}_{number}" for number in range(1, len(parts) + 1)]
    while set(names) & set(taken):
        names = [f"{name}_" for name in names]
    # Any target will do: it is not among the limits of the problem, which were made before.
    return tuple(Zone(name=name, region=part, target_error_m=1.0) for name, part in zip(names, parts, strict=True))


def _with_zones(site: Site, zones: tuple[Zone, ...]) -> Site:
    return replace(site, zones=(*site.zones, *zones))
