"""Drives that no study has used, for questions about finished layouts that keep nothing of their own."""

from collections.abc import Sequence
from dataclasses import replace

from layoutopt.errors import Interrupted
from layoutopt.evaluate import Evaluator
from layoutopt.layout import Layout
from layoutopt.progress import Progress
from layoutopt.protocols import Estimator, Evaluation, Failure
from layoutopt.scenario import Scenario
from layoutopt.streams import Streams
from layoutopt.workers import Workers
from studies import held_out


def fresh_drives(
    name: str,
    cells: Sequence[tuple[Layout, Scenario]],
    estimator: Estimator,
    *,
    first: int,
    trials: int,
    seed: int,
    workers: Workers,
    progress: Progress,
) -> tuple[Evaluation | Failure, ...]:
    """Return replications ``first`` to ``first + trials - 1`` of each layout in its scenario.

    A layout to which the estimator does not apply has none. ``name`` is what the round is called.

    Raises
    ------
    Interrupted
        If the workers were asked to stop: a part of the drives would answer nothing.
    """
    wanted = [
        replace(task, first=first + task.first)
        for layout, scenario in cells
        for task in held_out.tasks([layout], [scenario], [estimator], trials, {}, {})
    ]
    if wanted:
        progress.round(name, len(wanted), sum(task.count for task in wanted))
    found = Evaluator(Streams(seed=seed), workers=workers, on_result=progress.result)(wanted)
    if len(found) < len(wanted):
        raise Interrupted("stopped as asked; the drives of this question are not kept")
    return found
