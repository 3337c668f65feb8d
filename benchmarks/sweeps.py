"""How much of the machine a sweep gets for its trials, what it keeps in memory, and how fast it goes on again.

Everything runs through `Evaluator`, workers and journal, as in a study.
"""

import argparse
import itertools
import os
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import workload
from scaling import spin

from layoutopt.estimators.mcl_adaptive import AdaptiveParticles
from layoutopt.estimators.odometry import OdometryAlone
from layoutopt.evaluate import Evaluator
from layoutopt.journal import JOURNAL, Journal, manifest
from layoutopt.protocols import Evaluation, Failure, Task
from layoutopt.simulation.trials import warm_up
from layoutopt.workers import Backend, Workers

JOBS = 2
TASKS = 200
TRIALS_A_TASK = 8
SPINS = 4_000_000
SPIN_CALLS = 16
EVALUATIONS = 100_000
_FIRSTS = itertools.count(10**6, TRIALS_A_TASK)


@dataclass(frozen=True, slots=True, kw_only=True)
class Stage:
    """One simulation stage: shares of what two processors could have done in its time.

    ``efficiency`` is the time that workers spent within tasks; ``parent`` the processor time of the process that
    sends tasks and keeps the journal.
    """

    efficiency: float
    parent: float


def stage(tasks: int, trials_a_task: int = TRIALS_A_TASK) -> Stage:
    """Run tasks on two workers into a journal."""
    busy_s: list[float] = []

    def count(item: Evaluation | Failure) -> None:
        assert isinstance(item, Evaluation)
        busy_s.append(item.seconds)

    proposal, world, estimator = workload.layout(), workload.scenario(), AdaptiveParticles()
    wanted = [
        Task(layout=proposal, scenario=world, estimator=estimator, first=next(_FIRSTS), count=trials_a_task)
        for _ in range(tasks)
    ]
    with (
        tempfile.TemporaryDirectory() as folder,
        Journal(Path(folder), facts=_facts()) as journal,
    ):
        evaluate = Evaluator(
            workload.STREAMS, workers=Workers(Backend.LOKY, jobs=JOBS), journal=journal, on_result=count
        )
        began, own = time.perf_counter(), time.process_time()
        evaluate(wanted)
        wall_s, own_s = time.perf_counter() - began, time.process_time() - own
    return Stage(efficiency=sum(busy_s) / (JOBS * wall_s), parent=own_s / (JOBS * wall_s))


def spinning(calls: int = SPIN_CALLS, spins: int = SPINS) -> float:
    """Return the efficiency of two workers that only count: what workers and machine cost by themselves."""
    workers = Workers(Backend.LOKY, jobs=JOBS)
    began = time.perf_counter()
    busy_s = sum(seconds for _, seconds in workers.map(_timed_spin, [spins] * calls))
    return busy_s / (JOBS * (time.perf_counter() - began))


def _timed_spin(count: int) -> float:
    return workload.seconds(lambda: spin(count))


def memory_and_resume(evaluations: int) -> list[str]:
    """Return rows of the memory of parent and workers over many evaluations, and of the time to go on then."""
    marks = {evaluations // 10: [0.0, 0.0], evaluations: [0.0, 0.0]}
    done = itertools.count(1)

    def look(item: Evaluation | Failure) -> None:
        number = next(done)
        if number in marks:
            marks[number] = [_resident_mb(os.getpid()), max(map(_resident_mb, _children()), default=0.0)]

    proposal, world, estimator = workload.layout(), workload.scenario(step_count=8), OdometryAlone()
    wanted = [
        Task(layout=proposal, scenario=world, estimator=estimator, first=2 * number, count=2)
        for number in range(evaluations)
    ]
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        with Journal(folder, facts=_facts()) as journal:
            workers = Workers(Backend.LOKY, jobs=JOBS)
            Evaluator(workload.STREAMS, workers=workers, journal=journal, on_result=look)(wanted)
        size_mb = (folder / JOURNAL).stat().st_size / 1e6
        began = time.perf_counter()
        with Journal(folder, facts=_facts()) as journal:
            read_s = time.perf_counter() - began
            missing = Evaluator(workload.STREAMS, journal=journal).missing(wanted)
            resume_s = time.perf_counter() - began
    assert not missing
    (early, late) = marks.values()
    return [
        f"| memory of the parent, MB | {early[0]:.0f} | {late[0]:.0f} |",
        f"| memory of the larger worker, MB | {early[1]:.0f} | {late[1]:.0f} |",
        f"| journal, MB | | {size_mb:.0f} |",
        f"| reading the journal, s | | {read_s:.2f} |",
        f"| until it is known which tasks are missing, s | | {resume_s:.2f} |",
    ]


def _facts() -> dict[str, object]:
    return {**manifest(workload.STREAMS, "benchmark"), "study": "benchmark", "quick": False}


def _children() -> list[int]:
    """Return the worker processes; needs the /proc of Linux."""
    found = []
    for path in Path("/proc").glob("[0-9]*/stat"):
        try:
            fields = path.read_text().rpartition(")")[2].split()
        except OSError:
            continue
        if int(fields[1]) == os.getpid():
            found.append(int(path.parent.name))
    return found


def _resident_mb(process: int) -> float:
    try:
        pages = int(Path(f"/proc/{process}/statm").read_text().split()[1])
    except OSError:
        return 0.0
    return pages * os.sysconf("SC_PAGE_SIZE") / 1e6


def main() -> None:
    """Print all tables."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("rounds", nargs="?", type=int, default=9)
    parser.add_argument("--evaluations", type=int, default=EVALUATIONS)
    arguments = parser.parse_args()
    print(f"{workload.machine()}; {arguments.rounds} rounds\n")
    warm_up()
    stage(4 * JOBS)
    stages, spins = [], []
    for _ in range(arguments.rounds):
        stages.append(stage(TASKS))
        spins.append(spinning())
    shown = {
        "efficiency of the simulation stage, %": [100.0 * item.efficiency for item in stages],
        "efficiency of bare counting, %": [100.0 * value for value in spins],
        "simulation against counting": [
            item.efficiency / value for item, value in zip(stages, spins, strict=True)
        ],
        "dispatch and journal, % of both processors": [100.0 * item.parent for item in stages],
    }
    print("| two workers | |", "| --- | --- |", sep="\n")
    for title, values in shown.items():
        print(f"| {title} | {workload.median_and_range(np.array(values))} |")
    print(
        f"\n| {arguments.evaluations} evaluations | after a tenth | after all |", "| --- | --- | --- |", sep="\n"
    )
    print("\n".join(memory_and_resume(arguments.evaluations)))


if __name__ == "__main__":
    main()
