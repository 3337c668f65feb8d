"""Runs a study round by round, with or without a folder, until it wants nothing more."""

from collections.abc import Iterable

from layoutopt.evaluate import Evaluator
from layoutopt.journal import Journal
from layoutopt.protocols import Evaluation, Failure, Study
from layoutopt.streams import Streams
from studies.progress import Progress


def run_rounds(
    study: Study, *, streams: Streams, jobs: int, journal: Journal | None, progress: Progress
) -> tuple[Evaluation | Failure, ...]:
    """Return all evaluations of a study, sorted so that they do not depend on who worked.

    What the journal already holds is not run again: a study that was killed goes on where it stopped.
    """
    evaluate = Evaluator(streams, jobs=jobs, journal=journal, on_result=progress.result)
    found: dict[tuple[str, str, str, int], Evaluation | Failure] = {}
    while True:
        evaluations = _ordered(found.values())
        batch = study.next_batch(evaluations)
        if not batch.tasks:
            return evaluations
        progress.round(batch.name, len(batch.tasks), sum(task.count for task in batch.tasks))
        for item in evaluate(batch.tasks):
            found[(item.layout_key, item.scenario, item.estimator, item.first)] = item
        progress.best(study.best_so_far(_ordered(found.values())))


def _ordered(evaluations: Iterable[Evaluation | Failure]) -> tuple[Evaluation | Failure, ...]:
    return tuple(
        sorted(evaluations, key=lambda item: (item.layout_key, item.scenario, item.estimator, item.first))
    )
