"""The single door through which layouts are scored by simulation: workers, journal, failures as values."""

import itertools
import time
import traceback
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence

from layoutopt.errors import WorkerDied
from layoutopt.journal import Journal, task_key
from layoutopt.protocols import Evaluation, Failure, Group, Task
from layoutopt.scores import TrialOutcomes, joined
from layoutopt.simulation.trials import run_trials, warm_up
from layoutopt.streams import Streams

_BATCH_S = 0.5
_MOST_TASKS_A_BATCH = 64

OnResult = Callable[[Evaluation | Failure], None]


def outcomes_of(evaluations: Iterable[Evaluation | Failure]) -> Mapping[Group, TrialOutcomes]:
    """Return the outcomes of every group, each one table by replication."""
    parts: dict[Group, list[TrialOutcomes]] = {}
    for evaluation in evaluations:
        if isinstance(evaluation, Evaluation):
            parts.setdefault(evaluation.group, []).append(evaluation.outcomes)
    return {group: joined(tables) for group, tables in parts.items()}


def run_task(task: Task, streams: Streams) -> Evaluation | Failure:
    """Run one task; whatever it raises comes back as a value, so that one bad layout stops no study."""
    began = time.perf_counter()
    try:
        outcomes = run_trials(task.layout, task.scenario, task.estimator, streams, task.first, task.count)
    except Exception as error:  # a failure of any kind is a result here, and is reported as one
        if isinstance(error.__cause__, KeyboardInterrupt):
            raise error.__cause__ from error  # compiled code hides the key that was pressed meanwhile
        where = traceback.extract_tb(error.__traceback__)[-1]
        message = f"{type(error).__name__}: {error} (in {where.name}, line {where.lineno})"
        return Failure(group=task.group, first=task.first, message=message)
    seconds = time.perf_counter() - began
    return Evaluation(group=task.group, first=task.first, outcomes=outcomes, seconds=seconds)


class Evaluator:
    """Runs tasks on ``jobs`` processes, keeps what the journal already holds, and writes what is new.

    Results do not depend on ``jobs``: a task's random streams are keyed by its content, and results come back
    in the order of the tasks.
    """

    def __init__(
        self,
        streams: Streams,
        *,
        jobs: int = 1,
        journal: Journal | None = None,
        on_result: OnResult | None = None,
    ) -> None:
        self.streams = streams
        self.jobs = jobs
        self.on_result = on_result
        self._journal = journal
        self._memory: dict[str, Evaluation | Failure] = {}
        self._task_s = 0.1
        self._warm = False

    def __call__(self, tasks: Iterable[Task]) -> tuple[Evaluation | Failure, ...]:
        """Return the evaluations of the tasks, in their order."""
        wanted = [(task_key(task, self.streams), task) for task in tasks]
        missing = {key: task for key, task in wanted if self._known(key) is None}
        for key, evaluation in self._run(list(missing.items())):
            if self._journal is None:
                self._memory[key] = evaluation
            else:
                self._journal.append(key, evaluation)
            if self.on_result is not None:
                self.on_result(evaluation)
        found = [self._known(key) for key, _ in wanted]
        return tuple(evaluation for evaluation in found if evaluation is not None)

    def missing(self, tasks: Iterable[Task]) -> tuple[Task, ...]:
        """Return the tasks whose outcomes are not known yet."""
        return tuple(task for task in tasks if self._known(task_key(task, self.streams)) is None)

    def _known(self, key: str) -> Evaluation | Failure | None:
        return self._memory.get(key) if self._journal is None else self._journal.get(key)

    def _run(self, tasks: Sequence[tuple[str, Task]]) -> Iterator[tuple[str, Evaluation | Failure]]:
        if not tasks:
            return
        if not self._warm:
            # Compiled here once, so that workers find the machine code on disk and never compile.
            warm_up()
            self._warm = True
        if self.jobs == 1:
            for key, task in tasks:
                yield key, run_task(task, self.streams)
            return
        import joblib
        from joblib.externals.loky.process_executor import TerminatedWorkerError

        began, finished = time.perf_counter(), 0
        batches = list(_batches(tasks, self._tasks_a_batch(len(tasks))))
        parallel = joblib.Parallel(
            n_jobs=self.jobs, backend="loky", return_as="generator_unordered", pre_dispatch="2 * n_jobs"
        )
        try:
            for results in parallel(joblib.delayed(_run_batch)(batch, self.streams) for batch in batches):
                yield from results
                finished += len(results)
        except TerminatedWorkerError as error:
            raise WorkerDied(
                "a worker process was killed, perhaps for want of memory; what was finished is kept: "
                "go on with --resume and fewer --jobs"
            ) from error
        self._task_s = (time.perf_counter() - began) * self.jobs / max(finished, 1)

    def _tasks_a_batch(self, count: int) -> int:
        """Return how many tasks go out together: half a second of work, but every worker gets several."""
        by_time = int(_BATCH_S / self._task_s) + 1
        return max(1, min(by_time, _MOST_TASKS_A_BATCH, count // (4 * self.jobs) or 1))


def _batches(tasks: Sequence[tuple[str, Task]], size: int) -> Iterator[tuple[tuple[str, Task], ...]]:
    iterator = iter(tasks)
    while batch := tuple(itertools.islice(iterator, size)):
        yield batch


def _run_batch(batch: Sequence[tuple[str, Task]], streams: Streams) -> list[tuple[str, Evaluation | Failure]]:
    return [(key, run_task(task, streams)) for key, task in batch]
