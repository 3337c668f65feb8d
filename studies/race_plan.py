"""What the main study would run: layouts that race, those refused by rule, and the trials of each part."""

from collections import Counter
from typing import TYPE_CHECKING, Final

from layoutopt.protocols import Plan, Task

if TYPE_CHECKING:
    from studies.cost_vs_accuracy import CostVersusAccuracy

_PILOT_LAYOUTS: Final = 4


def plan_of(question: "CostVersusAccuracy") -> Plan:
    """Return the plan of a study; the pilot is a few of its own layouts.

    The number of validation trials assumes a front of twelve layouts and two candidates, which is typical.
    """
    problem, contenders = question.problem, question.contenders
    refusals = Counter(item.rule for item in question.screened if item.refusal).most_common()
    rounds = question.racing.rounds(len(contenders))
    # A race may end before its budget does; the first round may exceed it.
    search = max(question.racing.trials, rounds[0][0] * rounds[0][1]) if rounds else 0
    worlds = len(problem.held_out) * len(problem.estimators)
    validation = worlds * (12 * question.front_trials + 4 * question.validation_trials) if contenders else 0
    lines = (
        f"layouts: {len(question.screened)}, of which {len(contenders)} can be built within the limits on exact "
        "scores",
        *(f"  refused by the rule of {rule}: {count}" for rule, count in refusals),
        f"search: up to {search} trials; validation: about {validation} trials",
    )
    if not contenders:
        return Plan(lines=lines)
    # Of the validating estimators only the particle filter takes noticeable time.
    heavy = search + validation // len(problem.estimators) + 8 * 2 * question.reference_trials
    chosen = contenders[:: max(1, len(contenders) // _PILOT_LAYOUTS)][:_PILOT_LAYOUTS]
    estimator = problem.estimators[0]
    pilot = [
        Task(layout=item.layout, scenario=problem.design, estimator=estimator, first=0, count=2) for item in chosen
    ]
    return Plan(lines=lines, pilot=tuple((task, heavy // len(pilot)) for task in pilot))
