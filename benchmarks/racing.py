"""What a race finds of the front of a full factorial run, for a fifth of its trials.

The space is that of the built-in ward, thinned. Every layout is simulated once, in more replications than a full
factorial run has; races look their trials up. A race reads a block of replications of its own, in an order of its
own, and the reference is the mean over all others, ten times as many as a full factorial run has. What a race
selects is scored anew with the reference, and its hypervolume divided by that of the reference.
"""

import argparse
import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import workload
from scipy.stats import t as student

from layoutopt.evaluate import Evaluator
from layoutopt.identity import FloatArray
from layoutopt.problem import Problem
from layoutopt.protocols import Evaluate, Evaluation, Failure, Task
from layoutopt.result import Evaluated
from layoutopt.scores import TrialOutcomes
from layoutopt.spec.reading import read_spec
from layoutopt.spec.template import built_in
from layoutopt.streams import Streams
from layoutopt.workers import Backend, Workers
from solvers.exhaustive import entered
from solvers.front import non_dominated
from solvers.front_measures import REFERENCE_MARGIN, hypervolume
from solvers.judging import exact_scores
from solvers.racing import Racing

SPEC = "hospital_ward"
THINNING = 4
REPLICATIONS = 12
REFERENCE_TIMES = 10
BLOCKS = 4
SHARE = 0.2
SEED = 7
TRIALS_A_TASK = 5


@dataclass(frozen=True, slots=True, kw_only=True)
class Reference:
    """Costs, shape (n,), and errors of all layouts in each replication, shape (n, r)."""

    costs: FloatArray
    errors: FloatArray

    @property
    def front(self) -> list[int]:
        """Rows of the front."""
        return non_dominated(np.stack([self.costs, self.errors.mean(axis=1)], axis=1)).tolist()

    def ratio(self, rows: Sequence[int], *, logarithmic: bool) -> float:
        """Return the hypervolume of rows, scored by the reference, over that of its own front."""
        goals = np.stack([self.costs, self.errors.mean(axis=1)], axis=1)
        point = REFERENCE_MARGIN * goals[self.front].max(axis=0)
        volumes = [
            hypervolume(goals[chosen], point, logarithmic=logarithmic) for chosen in (list(rows), self.front)
        ]
        return volumes[0] / volumes[1]


@dataclass(frozen=True, slots=True, kw_only=True)
class Race:
    """What one race selected: rows of the reference; its trials, and those of the selected layouts."""

    rows: list[int]
    trials: int
    trials_on_front: int


def question(thinning: int) -> tuple[Problem, list[Evaluated]]:
    """Return the ward's problem without limits, and every so many-th of the layouts that can be built.

    Of the exact scores the layouts have the cost alone; `with_exact_scores` adds the others.
    """
    problem = replace(read_spec(built_in(SPEC)).problem(), limits=())
    return problem, [item.evaluated for item in entered(problem) if not item.refusal][::thinning]


def with_exact_scores(problem: Problem, contenders: Sequence[Evaluated]) -> list[Evaluated]:
    """Return the layouts with all that is known of them without a trial, as a study's race gets them."""
    return [replace(item, scores=exact_scores(problem, item.layout)) for item in contenders]


def reference(
    problem: Problem, contenders: Sequence[Evaluated], replications: int, evaluate: Evaluator
) -> Reference:
    """Simulate every layout."""
    errors = np.empty((len(contenders), replications))
    for first in range(0, replications, TRIALS_A_TASK):
        count = min(TRIALS_A_TASK, replications - first)
        tasks = [_task(problem, item, first, count) for item in contenders]
        for row, item in enumerate(evaluate(tasks)):
            assert isinstance(item, Evaluation)
            errors[row, first : first + count] = item.outcomes.column(problem.goals[1])
    return Reference(costs=_costs(problem, contenders), errors=errors)


def looked_up(problem: Problem, contenders: Sequence[Evaluated], errors: FloatArray) -> Evaluate:
    """Return what looks tasks up in a table of errors, shape (n, replications), instead of running them."""
    rows = {item.layout.key: row for row, item in enumerate(contenders)}

    def evaluate(tasks: Iterable[Task]) -> list[Evaluation | Failure]:
        found: list[Evaluation | Failure] = []
        for task in tasks:
            replications = np.arange(task.first, task.first + task.count)
            values = errors[rows[task.layout.key], replications].reshape(-1, 1)
            outcomes = TrialOutcomes(replications=replications, columns=(problem.goals[1],), values=values)
            found.append(Evaluation(group=task.group, first=task.first, outcomes=outcomes, seconds=0.0))
        return found

    return evaluate


def race(problem: Problem, contenders: Sequence[Evaluated], solver: Racing, evaluate: Evaluate) -> Race:
    """Run one race to its end."""
    known: list[Evaluation | Failure] = []
    while (now := solver.standing(problem, contenders, known)).tasks:
        known += evaluate(now.tasks)
    spent = {item.layout.key: 0 for item in contenders}
    for item in known:
        assert isinstance(item, Evaluation)
        spent[item.group.layout_key] += len(item.outcomes)
    keys = [item.layout.key for item in contenders]
    return Race(
        rows=[keys.index(member.layout.key) for member in now.front],
        trials=now.trials,
        trials_on_front=sum(spent[member.layout.key] for member in now.front),
    )


def blocks(table: Reference, count: int) -> list[tuple[FloatArray, Reference]]:
    """Return disjoint blocks of replications, each with the reference that all others make."""
    found = []
    for places in np.array_split(np.arange(table.errors.shape[1]), count):
        others = np.delete(table.errors, places, axis=1)
        found.append((table.errors[:, places], Reference(costs=table.costs, errors=others)))
    return found


def figures(truth: Reference, rows: Sequence[int], trials: int, trials_on_front: int, full: int) -> list[float]:
    """Return what the columns of the table show of one selection, in %."""
    return [
        100.0 * trials / full,
        100.0 * truth.ratio(rows, logarithmic=True),
        100.0 * truth.ratio(rows, logarithmic=False),
        100.0 * len(set(truth.front) & set(rows)) / len(rows),
        100.0 * (1.0 - trials_on_front / trials),
    ]


def compared(
    problem: Problem, contenders: Sequence[Evaluated], table: Reference, replications: int, orders: int
) -> list[str]:
    """Return the rows of the table: races in several orders on each block, and the full factorial run."""
    full = replications * len(contenders)
    found: list[list[FloatArray]] = [[], [], []]
    for number, (block, truth) in enumerate(blocks(table, BLOCKS)):
        for column, borrowing in enumerate((False, True)):
            solver = Racing(trials=int(SHARE * full), borrowing=borrowing)
            own = []
            for order in range(orders):
                places = np.random.default_rng((number, order)).permutation(block.shape[1])
                run = race(problem, contenders, solver, looked_up(problem, contenders, block[:, places]))
                own.append(figures(truth, run.rows, run.trials, run.trials_on_front, full))
            found[column].append(np.array(own))
        means = block[:, :replications].mean(axis=1)
        rows = non_dominated(np.stack([table.costs, means], axis=1)).tolist()
        found[2].append(np.array([figures(truth, rows, full, replications * len(rows), full)]))
    titles = (
        "trials, % of the full factorial run",
        "hypervolume in logarithms, % of the reference",
        "hypervolume in EUR m, % of the reference",
        "selected layouts that are on the reference front, %",
        "trials of layouts that were not selected, %",
    )
    return [
        f"| {title} | " + " | ".join(_interval([part[:, row] for part in parts]) for parts in found) + " |"
        for row, title in enumerate(titles)
    ]


def _interval(parts: Sequence[FloatArray]) -> str:
    """Return mean, its 95 % interval by the means of the blocks, and the least value."""
    means = np.array([part.mean() for part in parts])
    half = float(student.ppf(0.975, len(means) - 1)) * float(means.std(ddof=1)) / math.sqrt(len(means))
    return f"{means.mean():.2f} ± {half:.2f} (least {min(part.min() for part in parts):.2f})"


def _task(problem: Problem, item: Evaluated, first: int, count: int) -> Task:
    return Task(
        layout=item.layout, scenario=problem.design, estimator=problem.estimators[0], first=first, count=count
    )


def _costs(problem: Problem, contenders: Sequence[Evaluated]) -> FloatArray:
    return np.array([item.scores[problem.goals[0]].value for item in contenders])


def main() -> None:
    """Print the table."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("orders", nargs="?", type=int, default=10, help="races in each block of replications")
    parser.add_argument("--thinning", type=int, default=THINNING)
    parser.add_argument("--replications", type=int, default=REPLICATIONS, help="of the full factorial run")
    parser.add_argument("--table", type=Path, help="file that keeps the errors of all layouts, made if absent")
    arguments = parser.parse_args()
    print(f"{workload.machine()}\n")
    problem, contenders = question(arguments.thinning)
    contenders = with_exact_scores(problem, contenders)
    # The reference is all but one block.
    count = REFERENCE_TIMES * arguments.replications * BLOCKS // (BLOCKS - 1)
    if arguments.table is not None and arguments.table.exists():
        table = Reference(costs=_costs(problem, contenders), errors=np.load(arguments.table))
    else:
        evaluate = Evaluator(Streams(seed=SEED), workers=Workers(Backend.LOKY))
        table = reference(problem, contenders, count, evaluate)
        if arguments.table is not None:
            np.save(arguments.table, table.errors)
    if table.errors.shape != (len(contenders), count):
        parser.error(f"{arguments.table} holds other layouts or replications than those asked for")
    print(
        f"{len(contenders)} layouts, {arguments.replications} replications; reference {count - count // BLOCKS} "
        f"of {count} (seed {SEED}), {len(table.front)} layouts on the front of all; {BLOCKS} blocks, "
        f"{arguments.orders} races each\n"
    )
    print("| | race | race that borrows | full factorial run |", "| --- | --- | --- | --- |", sep="\n")
    print("\n".join(compared(problem, contenders, table, arguments.replications, arguments.orders)))


if __name__ == "__main__":
    main()
