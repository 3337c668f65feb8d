"""Runs a study round by round, with or without a folder, until it wants nothing more or is to stop."""

from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from typing import Final

from layoutopt.errors import StudyDamaged
from layoutopt.evaluate import Evaluator
from layoutopt.journal import Journal, task_key
from layoutopt.progress import Progress
from layoutopt.protocols import Evaluation, Failure, Group, Round, Study, Task
from layoutopt.simulation.outcomes import trial_columns
from layoutopt.stopping import StopReason, StopRequest
from layoutopt.streams import Streams
from layoutopt.workers import Workers

Evaluations = tuple[Evaluation | Failure, ...]
_MISFILED: Final = "the journal holds outcomes of one task under the key of another; choose another folder"


@dataclass(frozen=True, slots=True, kw_only=True)
class Ran:
    """What rounds gave: all evaluations, sorted, and why they ended before the study was done, if they did."""

    evaluations: Evaluations
    stopped: StopReason = StopReason.NONE


def run_rounds(
    study: Study,
    *,
    streams: Streams,
    journal: Journal | None,
    progress: Progress,
    workers: Workers | None = None,
    stop: StopRequest | None = None,
    most_trials: int | None = None,
) -> Ran:
    """Return all evaluations of a study, sorted so that they do not depend on who worked.

    What the journal already holds is not run again: a study that was killed goes on where it stopped.

    Parameters
    ----------
    stop
        The same request that the workers ask.
    most_trials
        Budget of all rounds together, those in the journal included. Tasks count in their order, so that the same
        ones run whoever works; the first that goes beyond the budget is where the study ends.
    """
    evaluate = Evaluator(streams, workers=workers, journal=journal, on_result=progress.result)

    def run(batch: Round) -> Evaluations:
        missing = evaluate.missing(batch.tasks)
        if missing:
            progress.round(batch.name, len(missing), sum(task.count for task in missing))
        return evaluate(batch.tasks)

    return _rounds(
        study, run, lambda found: progress.best(study.best_so_far(found)), stop=stop, most_trials=most_trials
    )


def replay(study: Study, *, streams: Streams, recorded: Mapping[str, Evaluation | Failure]) -> Evaluations:
    """Return the evaluations of a finished study from its journal, and only those that it asks for.

    Raises
    ------
    StudyDamaged
        If the journal lacks a task, because the study was not finished or its settings have changed.
    """
    evaluations, batch = recorded_rounds(study, streams=streams, recorded=recorded)
    if batch.tasks:
        raise StudyDamaged("the study is not finished; go on with layoutopt study ... --resume first")
    return evaluations


def recorded_rounds(
    study: Study, *, streams: Streams, recorded: Mapping[str, Evaluation | Failure]
) -> tuple[Evaluations, Round]:
    """Return the evaluations of all rounds that a journal holds in full, and the first round that it does not.

    That round has no tasks if the study is done.
    """
    found: dict[tuple[Group, int], Evaluation | Failure] = {}
    while True:
        evaluations = _ordered(found.values())
        batch = study.next_batch(evaluations)
        keys = [task_key(task, streams) for task in batch.tasks]
        if not batch.tasks or any(key not in recorded for key in keys):
            return evaluations, batch
        for task, key in zip(batch.tasks, keys, strict=True):
            place = task.group, task.first
            _check_filed(task, place, recorded[key])
            found[place] = recorded[key]


def _rounds(
    study: Study,
    run: Callable[[Round], Evaluations],
    after: Callable[[Evaluations], None],
    *,
    stop: StopRequest | None,
    most_trials: int | None,
) -> Ran:
    found: dict[tuple[Group, int], Evaluation | Failure] = {}
    evaluations: Evaluations = ()
    left = most_trials
    while True:
        batch = study.next_batch(evaluations)
        if not batch.tasks:
            return Ran(evaluations=evaluations)
        if stop is not None and stop():
            return Ran(evaluations=evaluations, stopped=stop.reason)
        tasks = batch.tasks if left is None else _within(batch.tasks, left)
        results = {(item.group, item.first): item for item in run(Round(name=batch.name, tasks=tasks))}
        complete = True
        for task in tasks:
            place = task.group, task.first
            item = results.pop(place, None)
            if item is None:
                complete = False
            else:
                _check_filed(task, place, item)
                found[place] = item
        if results:
            raise StudyDamaged(_MISFILED)
        evaluations = _ordered(found.values())
        after(evaluations)
        if stop is not None and not complete:
            return Ran(evaluations=evaluations, stopped=stop.reason)
        if len(tasks) < len(batch.tasks):
            return Ran(evaluations=evaluations, stopped=StopReason.TRIALS)
        if left is not None:
            left -= sum(task.count for task in tasks)


def _within(tasks: Sequence[Task], trials: int) -> tuple[Task, ...]:
    """Return the tasks from the first on whose trials fit into a budget."""
    found: list[Task] = []
    for task in tasks:
        trials -= task.count
        if trials < 0:
            break
        found.append(task)
    return tuple(found)


def _check_filed(task: Task, place: tuple[Group, int], item: Evaluation | Failure) -> None:
    """Check that what the key of a task led to is of that task, whose group and first replication are its place.

    Raises
    ------
    StudyDamaged
        If it is of another one: rounds that are replayed would ask for the task for ever. Or if a version of
        layoutopt recorded it that had fewer columns.
    """
    fits = (item.group, item.first) == place
    if fits and isinstance(item, Evaluation):
        columns = trial_columns(task.scenario, task.estimator)
        if lacking := [column for column in columns if column not in item.outcomes.columns]:
            raise StudyDamaged(
                f"the journal is of another version of layoutopt, whose trials lack {', '.join(lacking)}; choose "
                "another folder"
            )
        fits = len(item.outcomes) == task.count and item.outcomes.columns == columns
    if not fits:
        raise StudyDamaged(_MISFILED)


def _ordered(evaluations: Iterable[Evaluation | Failure]) -> Evaluations:
    return tuple(sorted(evaluations, key=lambda item: (item.group, item.first)))
