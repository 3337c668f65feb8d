"""Runs a study round by round, with or without a folder, until it wants nothing more."""

from collections.abc import Callable, Iterable, Mapping

from layoutopt.errors import StudyDamaged
from layoutopt.evaluate import Evaluator
from layoutopt.journal import Journal, task_key
from layoutopt.protocols import Evaluation, Failure, Group, Round, Study
from layoutopt.streams import Streams
from studies.progress import Progress

Evaluations = tuple[Evaluation | Failure, ...]


def run_rounds(
    study: Study, *, streams: Streams, jobs: int, journal: Journal | None, progress: Progress
) -> Evaluations:
    """Return all evaluations of a study, sorted so that they do not depend on who worked.

    What the journal already holds is not run again: a study that was killed goes on where it stopped.
    """
    evaluate = Evaluator(streams, jobs=jobs, journal=journal, on_result=progress.result)

    def run(batch: Round) -> Evaluations:
        missing = evaluate.missing(batch.tasks)
        if missing:
            progress.round(batch.name, len(missing), sum(task.count for task in missing))
        return evaluate(batch.tasks)

    return _rounds(study, run, lambda found: progress.best(study.best_so_far(found)))


def replay(study: Study, *, streams: Streams, recorded: Mapping[str, Evaluation | Failure]) -> Evaluations:
    """Return the evaluations of a finished study from its journal, and only those that it asks for.

    Raises
    ------
    StudyDamaged
        If the journal lacks a task, because the study was not finished or its settings have changed.
    """

    def look_up(batch: Round) -> Evaluations:
        keys = [task_key(task, streams) for task in batch.tasks]
        if any(key not in recorded for key in keys):
            raise StudyDamaged("the study is not finished; go on with layoutopt study ... --resume first")
        return tuple(recorded[key] for key in keys)

    return _rounds(study, look_up, lambda _: None)


def _rounds(
    study: Study, run: Callable[[Round], Evaluations], after: Callable[[Evaluations], None]
) -> Evaluations:
    found: dict[tuple[Group, int], Evaluation | Failure] = {}
    while True:
        evaluations = _ordered(found.values())
        batch = study.next_batch(evaluations)
        if not batch.tasks:
            return evaluations
        for item in run(batch):
            found[(item.group, item.first)] = item
        after(_ordered(found.values()))


def _ordered(evaluations: Iterable[Evaluation | Failure]) -> Evaluations:
    return tuple(sorted(evaluations, key=lambda item: (item.group, item.first)))
