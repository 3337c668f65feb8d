"""The single door through which layouts are scored by simulation: workers, journal, failures as values."""

import contextlib
import functools
import sys
import time
from collections.abc import Callable, Iterable, Mapping

from layoutopt.journal import Journal, task_key
from layoutopt.protocols import Evaluation, Failure, Group, Task
from layoutopt.scores import TrialOutcomes, joined
from layoutopt.simulation.trials import run_trials, warm_up
from layoutopt.streams import Streams
from layoutopt.workers import Lost, Workers

OnResult = Callable[[Evaluation | Failure], None]


def outcomes_of(evaluations: Iterable[Evaluation | Failure]) -> Mapping[Group, TrialOutcomes]:
    """Return the outcomes of every group, each one table by replication."""
    parts: dict[Group, list[TrialOutcomes]] = {}
    for evaluation in evaluations:
        if isinstance(evaluation, Evaluation):
            parts.setdefault(evaluation.group, []).append(evaluation.outcomes)
    return {group: joined(tables) for group, tables in parts.items()}


def run_task(task: Task, streams: Streams) -> Evaluation:
    """Run one task; whatever it raises is the business of the workers."""
    began = time.perf_counter()
    outcomes = run_trials(task.layout, task.scenario, task.estimator, streams, task.first, task.count)
    seconds = time.perf_counter() - began
    return Evaluation(group=task.group, first=task.first, outcomes=outcomes, seconds=seconds)


class Evaluator:
    """Runs tasks on workers, keeps what the journal already holds, and writes what is new.

    Results do not depend on the workers: a task's random streams are keyed by its content, and results come back
    in the order of the tasks. A task without outcomes comes back as a `Failure`. After the workers were asked to
    stop, tasks that were not begun are missing from the results.
    """

    def __init__(
        self,
        streams: Streams,
        *,
        workers: Workers | None = None,
        journal: Journal | None = None,
        on_result: OnResult | None = None,
    ) -> None:
        self.streams = streams
        self.workers = Workers() if workers is None else workers
        self.on_result = on_result
        self._journal = journal
        self._memory: dict[str, Evaluation | Failure] = {}
        self._warm: set[str] = set()

    def __call__(self, tasks: Iterable[Task]) -> tuple[Evaluation | Failure, ...]:
        """Return the evaluations of the tasks, in their order."""
        wanted = [(task_key(task, self.streams), task) for task in tasks]
        self._run({key: task for key, task in wanted if self._known(key) is None})
        found = [self._known(key) for key, _ in wanted]
        return tuple(evaluation for evaluation in found if evaluation is not None)

    def missing(self, tasks: Iterable[Task]) -> tuple[Task, ...]:
        """Return the tasks whose outcomes are not known yet."""
        return tuple(task for task in tasks if self._known(task_key(task, self.streams)) is None)

    def _known(self, key: str) -> Evaluation | Failure | None:
        return self._memory.get(key) if self._journal is None else self._journal.get(key)

    def _run(self, missing: Mapping[str, Task]) -> None:
        if not missing:
            return
        # Compiled here once, so that workers find the machine code on disk and never compile.
        cold = {task.estimator.card.estimates for task in missing.values()} - self._warm
        warm_up(sorted(cold))
        self._warm |= cold
        keys, tasks = list(missing), list(missing.values())
        run = functools.partial(run_task, streams=self.streams)
        # Closed at once if the journal cannot be written, so that no worker goes on for nobody.
        with contextlib.closing(self.workers.map(run, tasks)) as results:
            for number, result in results:
                evaluation = _evaluation(tasks[number], result)
                if self._journal is None:
                    self._memory[keys[number]] = evaluation
                else:
                    self._journal.append(keys[number], evaluation)
                if self.on_result is not None:
                    self.on_result(evaluation)


def _evaluation(task: Task, result: Evaluation | Lost) -> Evaluation | Failure:
    # Names that many tasks share come from each worker anew; a hundred thousand of them would fill the memory.
    group = Group(*map(sys.intern, task.group))
    if isinstance(result, Lost):
        return Failure(group=group, first=task.first, message=result.message, kind=result.kind)
    return Evaluation(group=group, first=result.first, outcomes=result.outcomes, seconds=result.seconds)
