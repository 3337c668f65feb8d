"""What a floor is worth as it was built: with the map of the plan, with the corrected one, and tag by tag."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from layoutopt.commissioning.as_built import AsBuilt, corrected, true_places
from layoutopt.detection import antennas_of
from layoutopt.evaluate import outcomes_of
from layoutopt.identity import read_only
from layoutopt.layout import Layout
from layoutopt.problem import Limit, Problem
from layoutopt.progress import Progress
from layoutopt.protocols import Group, group_of
from layoutopt.scenario import Scenario
from layoutopt.scores import Score, TrialOutcomes, paired_difference
from layoutopt.simulation.tag_use import TagUse, tag_use
from layoutopt.spec.building import Spec
from layoutopt.streams import Streams
from layoutopt.workers import Workers
from solvers.judging import simulated_scores
from studies import held_out
from studies.fresh_drives import fresh_drives

CONFIDENCE: Final = 0.95
"""Of all intervals of repairs together."""
USE_DRIVES: Final = 40
"""Drives on which the use of each tag is counted."""
MOST_REPAIRS: Final = 8
"""Repairs that are simulated: those of the tags that robots use most."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Repair:
    """What it would bring to put one tag right: the goal's paired difference, this less the floor as built.

    ``interval`` holds together with those of all other repairs at `CONFIDENCE`.
    """

    tag_id: int
    status: str
    difference: Score
    interval: tuple[float, float]


@dataclass(frozen=True, slots=True, kw_only=True)
class BuiltFloor:
    """A floor as built, judged on held-out drives.

    Attributes
    ----------
    layout, built
        The layout as planned, and the one that was found.
    scenario
        Name of the held-out scenario of all scores: the harder one.
    planned, old_map, new_map
        Outcomes of the plan; of the floor as built for robots with the map of the plan; and for robots with the
        corrected map; ``None`` where a task failed.
    limits
        Each limit on a simulated score with the score of the corrected map, and whether its bound meets it.
    use
        Use of each tag of the plan, in the order of the map.
    repairs
        Of the deviating tags that are used most, those first that bring most.
    """

    layout: Layout
    built: Layout
    found: AsBuilt
    problem: Problem
    scenario: str
    seed: int
    first: int
    trials: int
    planned: TrialOutcomes | None
    old_map: TrialOutcomes | None
    new_map: TrialOutcomes | None
    limits: tuple[tuple[Limit, Score, bool], ...]
    use: TagUse
    repairs: tuple[Repair, ...]
    failures: Mapping[Group, str]

    @property
    def exit_code(self) -> int:
        """One if the floor as built misses a limit, or a task failed."""
        return int(bool(self.failures) or not all(met for _, _, met in self.limits))


def judge(
    spec: Spec, layout: Layout, found: AsBuilt, *, trials: int, workers: Workers, progress: Progress
) -> BuiltFloor:
    """Return what the floor as built is worth, on drives that no study has used.

    The faults are those of the harder held-out scenario, but what was measured replaces what was expected: no tag
    is dead but those that were not scanned, and on a floor that was measured whole the places are off by the
    survey's error only.

    Raises
    ------
    Interrupted
        If the workers were asked to stop.
    InvalidInput
        If the estimator of the search does not apply to the layout.
    """
    problem, first = spec.problem(), spec.study.validation_trials
    expected, estimator = problem.held_out[-1], problem.estimators[0]
    real = _measured(expected, found)
    old_map = replace(real, faults=replace(real.faults, true_places=true_places(found)))
    built = corrected(layout, spec.site, found)
    use = tag_use(layout, expected, Streams(seed=spec.seed), first, USE_DRIVES)
    repaired = {
        tag_id: corrected(layout, spec.site, _with_repaired(found, tag_id)) for tag_id in _worth_repair(found, use)
    }
    cells = [(layout, expected), (layout, old_map), (built, real), *((item, real) for item in repaired.values())]
    results = fresh_drives(spec, "the floor as built", cells, trials=trials, workers=workers, progress=progress)
    known = outcomes_of(results)

    def table(item: Layout, scenario: Scenario) -> TrialOutcomes | None:
        return known.get(group_of(item, scenario, estimator))

    return BuiltFloor(
        layout=layout,
        built=built,
        found=found,
        problem=problem,
        scenario=expected.name,
        seed=spec.seed,
        first=first,
        trials=trials,
        planned=table(layout, expected),
        old_map=table(layout, old_map),
        new_map=table(built, real),
        limits=_limits(problem, built, real, table(built, real)),
        use=use,
        repairs=_repairs(
            problem.goals[1],
            found,
            table(built, real),
            {tag_id: table(item, real) for tag_id, item in repaired.items()},
        ),
        failures=held_out.failures_of(results),
    )


def reach_of_several_m(layout: Layout) -> float:
    """Return the largest read radius of antennas that take several tags a scan; zero if none does."""
    periods_s = [group.profile.scan_period_s for group in layout.floor_readers]
    if not periods_s:
        return 0.0
    antennas = antennas_of(layout, min(periods_s))
    return float(antennas.radius_m[~antennas.one_tag].max(initial=0.0))


def _measured(expected: Scenario, found: AsBuilt) -> Scenario:
    """Return the scenario with what was measured in place of what was expected."""
    faults = replace(expected.faults, dead_tag_share=0.0)
    if np.isfinite(found.surveyed_m).all():
        # Only a floor that was measured whole is free of the expected error.
        faults = replace(faults, tag_placement_sigma_m=float(found.tag_map.sigma_m.max(initial=0.0)))
    return replace(expected, faults=faults)


def _worth_repair(found: AsBuilt, use: TagUse) -> list[int]:
    """Return the tags that are missing or moved and are used at all, those first that are alone most often."""
    order = np.lexsort((-use.reads, -use.alone))
    return [
        int(found.tag_map.ids[row])
        for row in order.tolist()
        if found.tag_map.status[row] in ("missing", "moved") and use.reads[row] > 0.0
    ][:MOST_REPAIRS]


def _with_repaired(found: AsBuilt, tag_id: int) -> AsBuilt:
    """Return the floor as it would be with one tag in its planned place, answering."""
    row = int(np.searchsorted(found.tag_map.ids, tag_id))
    xy_m, status = found.tag_map.xy_m.copy(), list(found.tag_map.status)
    xy_m[row], status[row] = found.planned_m[row], "installed"
    return replace(found, tag_map=replace(found.tag_map, xy_m=read_only(xy_m), status=tuple(status)))


def _limits(
    problem: Problem, built: Layout, real: Scenario, outcomes: TrialOutcomes | None
) -> tuple[tuple[Limit, Score, bool], ...]:
    found = problem.limits_on(simulated_scores(problem, built, real, outcomes)) if outcomes is not None else ()
    return tuple((limit, score, limit.met(score)) for limit, score in found)


def _repairs(
    goal: str, found: AsBuilt, base: TrialOutcomes | None, tables: Mapping[int, TrialOutcomes | None]
) -> tuple[Repair, ...]:
    repairs = []
    for tag_id, outcomes in tables.items():
        if base is None or outcomes is None:
            continue
        difference = paired_difference(outcomes, base, goal)
        row = int(np.searchsorted(found.tag_map.ids, tag_id))
        repairs.append(
            Repair(
                tag_id=tag_id,
                status=found.tag_map.status[row],
                difference=difference,
                # Bonferroni: what is said of several tags holds of all of them together.
                interval=difference.interval(1.0 - (1.0 - CONFIDENCE) / len(tables)),
            )
        )
    return tuple(sorted(repairs, key=lambda repair: (repair.difference.value, repair.tag_id)))
