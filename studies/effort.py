"""What a spec describes, in numbers, and what a study of it would take."""

import time
from collections import Counter
from dataclasses import dataclass
from typing import Final

from layoutopt.protocols import Task
from layoutopt.simulation.routes import reachable_region, unreachable_area_m2
from layoutopt.simulation.trials import run_trials, warm_up
from layoutopt.spec.building import Spec
from layoutopt.streams import Streams
from layoutopt.units import format_length
from studies.cost_vs_accuracy import CostVersusAccuracy

_PILOT_LAYOUTS: Final = 4
_LITTLE_SHARE: Final = 0.25


@dataclass(frozen=True, slots=True, kw_only=True)
class Effort:
    """Trials that a study plans, and the run time predicted from a pilot on this machine.

    ``refusals`` counts the layouts that cannot race by the rule that they break.
    """

    layouts: int
    refusals: tuple[tuple[str, int], ...]
    contenders: int
    search_trials: int
    validation_trials: int
    trial_s: float
    seconds: float


def describe(spec: Spec) -> list[str]:
    """Return the lines that ``layoutopt check`` prints of site, robots and design space."""
    site, robot = spec.site, spec.robot
    xmin, ymin, xmax, ymax = site.bounds_m
    reachable = reachable_region(site, robot)
    lines = [
        f"site: {site.name}, from {site.source}",
        f"extents: {xmax - xmin:.2f} m x {ymax - ymin:.2f} m, "
        f"from ({xmin:.2f}, {ymin:.2f}) to ({xmax:.2f}, {ymax:.2f})",
        f"floor: {site.floor.area:.1f} m², free of obstacles {site.open_floor.area:.1f} m², "
        f"for tags {site.taggable_region().area:.1f} m², for the robot's centre {reachable.area:.1f} m²",
        f"robots: {spec.robot_count}, {robot.drive.value}, turning circle {format_length(2 * robot.radius_m)}, "
        f"{robot.speed_m_s:g} m/s",
    ]
    if reachable.area < _LITTLE_SHARE * site.floor.area:
        lines.append(
            f"note: the robot's centre reaches only {reachable.area / site.floor.area:.0%} of the floor; "
            "check plan, map mode and outline"
        )
    missed_m2 = unreachable_area_m2(site, robot)
    if missed_m2 > 0.01:
        lines.append(
            f"note: {missed_m2:.1f} m² that would hold the robot's centre cannot be reached from the rest"
        )
    for zone in site.zones:
        rules = [
            f"target {format_length(zone.target_error_m)}" if zone.target_error_m is not None else "",
            "" if zone.tags else "no tags",
            "metal" if zone.metal else "",
        ]
        lines.append(
            f"zone {zone.name}: {zone.region.area:.2f} m² {', '.join(rule for rule in rules if rule)}".rstrip()
        )
    lines += [f"note: {note}" for note in spec.notes]
    lines.append(f"prices: {spec.prices.name} of {spec.prices.date}")
    return lines


def predict(question: CostVersusAccuracy, seed: int, jobs: int) -> Effort:
    """Return the effort of a study, with the time of a trial measured on a few layouts of its own.

    The number of validation trials assumes a front of twelve layouts and two candidates, which is typical.
    """
    problem, contenders = question.problem, question.contenders
    estimator = problem.estimators[0]
    plan = question.racing.rounds(len(contenders))
    # A race may end before its budget does; the first round may exceed it.
    search = max(question.racing.trials, plan[0][0] * plan[0][1]) if plan else 0
    worlds = len(problem.held_out) * len(problem.estimators)
    validation = worlds * (12 * question.front_trials + 4 * question.validation_trials) if contenders else 0
    trial_s = 0.0
    if contenders:
        warm_up()
        step = max(1, len(contenders) // _PILOT_LAYOUTS)
        tasks = [
            Task(layout=item.layout, scenario=problem.design, estimator=estimator, first=0, count=2)
            for item in contenders[::step][:_PILOT_LAYOUTS]
        ]
        run_trials(tasks[0].layout, problem.design, estimator, Streams(seed=seed), 0, 1)
        began = time.perf_counter()
        for task in tasks:
            run_trials(task.layout, task.scenario, estimator, Streams(seed=seed), task.first, task.count)
        trial_s = (time.perf_counter() - began) / (2 * len(tasks))
    # Of the validating estimators only the particle filter takes noticeable time.
    heavy = search + validation / len(problem.estimators) + 8 * 2 * question.reference_trials
    return Effort(
        layouts=len(question.screened),
        refusals=tuple(Counter(item.rule for item in question.screened if item.refusal).most_common()),
        contenders=len(contenders),
        search_trials=search,
        validation_trials=validation,
        trial_s=trial_s,
        seconds=heavy * trial_s / jobs,
    )
