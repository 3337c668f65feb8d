"""Drives that no study has used, for questions about finished layouts that keep nothing of their own."""

from collections.abc import Sequence
from dataclasses import replace

from layoutopt.errors import Interrupted
from layoutopt.evaluate import Evaluator
from layoutopt.layout import Layout
from layoutopt.progress import Progress
from layoutopt.protocols import Evaluation, Failure
from layoutopt.scenario import Scenario
from layoutopt.spec.building import Spec
from layoutopt.streams import Streams
from layoutopt.workers import Workers
from studies import held_out


def fresh_drives(
    spec: Spec,
    name: str,
    cells: Sequence[tuple[Layout, Scenario]],
    *,
    trials: int,
    workers: Workers,
    progress: Progress,
    first: int | None = None,
) -> tuple[Evaluation | Failure, ...]:
    """Return drives of each layout in its scenario, judged with the estimator of the spec's search.

    A layout to which the estimator does not apply has none.

    Parameters
    ----------
    spec
        Whose seed and estimator count.
    name
        What the round is called.
    cells
        What is driven, and where.
    trials
        Drives of each cell.
    workers, progress
        What runs the drives, and who is told.
    first
        Number of the first drive; by default the first that no study of the spec has used.

    Raises
    ------
    Interrupted
        If the workers were asked to stop: a part of the drives would answer nothing.
    """
    start = spec.study.validation_trials if first is None else first
    estimator = spec.problem().estimators[0]
    wanted = [
        replace(task, first=start + task.first)
        for layout, scenario in cells
        for task in held_out.tasks([layout], [scenario], [estimator], trials, {}, {})
    ]
    if wanted:
        progress.round(name, len(wanted), sum(task.count for task in wanted))
    found = Evaluator(Streams(seed=spec.seed), workers=workers, on_result=progress.result)(wanted)
    if len(found) < len(wanted):
        raise Interrupted("stopped as asked; the drives of this question are not kept")
    return found
