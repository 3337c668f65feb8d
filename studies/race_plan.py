"""What the main study would run: layouts that race, those refused by rule, and the trials of each part."""

from collections import Counter
from collections.abc import Sequence
from typing import TYPE_CHECKING, Final

from layoutopt.layout import Layout
from layoutopt.protocols import Estimator, Plan, Task
from layoutopt.result import Status
from layoutopt.scenario import Scenario
from solvers.exhaustive import Screened
from studies import references
from studies.shortfall import refused

if TYPE_CHECKING:
    from studies.cost_vs_accuracy import CostVersusAccuracy

_PILOT_LAYOUTS: Final = 4
_WAYS_OUT: Final = {
    Status.BUDGET_TOO_SMALL: "larger pitches or fewer antennas in [space], which cost less, or a larger budget",
    Status.INFEASIBLE: "another [space], or other limits in [goal], by what the examples say",
}


def plan_of(question: "CostVersusAccuracy") -> Plan:
    """Return the plan of a study; the pilot is a few of its own layouts in each world, with each estimator.

    The number of validation trials assumes a front of twelve layouts and two candidates, which is typical. Where
    no layout may race there is no pilot, and the lines say what is missing and what helps.
    """
    problem, contenders = question.problem, question.contenders
    known = (
        f"layouts: {len(question.screened)}, of which {len(contenders)} can be built within the limits on exact "
        "scores",
        *_refusals(question.screened),
    )
    if not contenders:
        status, shortfall = refused(problem, question.screened)
        return Plan(lines=(*known, f"nothing to simulate: {shortfall}", f"what helps: {_WAYS_OUT[status]}"))
    rounds = question.racing.rounds(len(contenders))
    # A race may end before its budget does; the first round may exceed it.
    search = max(question.racing.trials, rounds[0][0] * rounds[0][1])
    worlds = len(problem.held_out) * len(problem.estimators)
    validation = worlds * (12 * question.front_trials + 4 * question.validation_trials)
    lines = (*known, f"search: up to {search} trials; validation: about {validation} trials")
    chosen = contenders[:: max(1, len(contenders) // _PILOT_LAYOUTS)][:_PILOT_LAYOUTS]
    pilot = [(_task(item.layout, problem.design, problem.estimators[0]), search // len(chosen)) for item in chosen]
    pilot += [
        (_task(item.layout, scenario, estimator), validation // worlds // len(chosen))
        for item in chosen
        for scenario in problem.held_out
        for estimator in problem.estimators
    ]
    references_in_space = references.layouts(problem.space) if question.reference_trials else ()
    published = [layout for _, layout in references_in_space]
    clear = references.scenario(problem)
    pilot += [(_task(layout, clear, problem.estimators[0]), question.reference_trials) for layout in published]
    return Plan(lines=lines, pilot=tuple((task, max(1, trials)) for task, trials in pilot))


def _refusals(screened: Sequence[Screened]) -> list[str]:
    """Return for each rule how many layouts it refused, with an example: the cheapest, or the first."""
    refusals = [item for item in screened if item.refusal]
    lines = []
    for rule, count in Counter(item.rule for item in refusals).most_common():
        first = next(item for item in refusals if item.rule == rule)
        lines += [
            f"  refused by the rule of {rule}: {count}",
            f"    such as {first.evaluated.layout.label}: {first.refusal}",
        ]
    return lines


def _task(layout: Layout, scenario: Scenario, estimator: Estimator) -> Task:
    return Task(layout=layout, scenario=scenario, estimator=estimator, first=0, count=1)
