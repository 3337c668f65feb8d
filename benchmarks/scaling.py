"""How the cost of a trial grows: particles, floor area, the share of the simulation, two processes against one.

Run with ``make benchmark`` or ``python benchmarks/scaling.py [ROUNDS]``; the protocol is in the README beside this
file. Prints the rows of the tables there.
"""

import argparse
import itertools
import os
from collections.abc import Callable, Mapping

import numpy as np
import workload

from layoutopt.estimators.mcl import MonteCarloLocalisation
from layoutopt.estimators.mcl_adaptive import AdaptiveParticles
from layoutopt.evaluate import Evaluator
from layoutopt.identity import FloatArray
from layoutopt.protocols import Estimator, Task
from layoutopt.simulation.motion import drive
from layoutopt.simulation.outcomes import outcome_row
from layoutopt.simulation.sensing import observe
from layoutopt.simulation.trials import knowledge_of, record_trial, run_trials, warm_up
from layoutopt.workers import Backend, Workers

PAPERS = MonteCarloLocalisation()
PARTICLES = (500, 1000, 2000, 4000, 8000)
SIDES_M = (2.0, 4.0, 10.0, 20.0, 50.0)
TASKS = 24
TRIALS_A_TASK = 10
SPINS = 10_000_000


def in_turn(calls: Mapping[str, Callable[[], object]], rounds: int) -> dict[str, FloatArray]:
    """Return the seconds of every round by name; each call runs once before the first round."""
    for call in calls.values():
        call()
    times_s: dict[str, list[float]] = {name: [] for name in calls}
    for number in range(rounds):
        for name in workload.order(calls, number):
            times_s[name].append(workload.seconds(calls[name]))
    return {name: np.array(taken_s) for name, taken_s in times_s.items()}


def against_particles(rounds: int, particles: tuple[int, ...] = PARTICLES, step_count: int = 1200) -> list[str]:
    """Return rows of the compiled run's cost against the number of particles, relative to the first."""
    log = workload.logged(step_count=step_count)
    times_s = in_turn(
        {
            str(count): lambda count=count: workload.run_whole(MonteCarloLocalisation(particles=count), log, 1)
            for count in particles
        },
        rounds,
    )
    base = str(particles[0])
    return [
        f"| {count} | {workload.median_and_range(times_s[count] / times_s[base])} | "
        f"{workload.median_and_range(times_s[count] / times_s[base] * int(base) / int(count))} |"
        for count in times_s
    ]


def against_area(rounds: int, sides_m: tuple[float, ...] = SIDES_M, step_count: int = 1200) -> list[str]:
    """Return rows of a whole trial's cost against the floor area at one density, relative to the first.

    The tags are laid once for each floor, before the rounds; every trial takes a drive that was not made before.
    """
    proposal, estimator = workload.layout(), MonteCarloLocalisation()
    worlds = {side_m: workload.scenario(side_m, step_count) for side_m in sides_m}

    def trial(side_m: float) -> None:
        run_trials(proposal, worlds[side_m], estimator, workload.STREAMS, next(workload.NEW_REPLICATIONS), 1)

    times_s = in_turn({f"{side_m**2:g}": lambda side_m=side_m: trial(side_m) for side_m in sides_m}, rounds)
    base = times_s[f"{sides_m[0] ** 2:g}"]
    return [
        f"| {area} | {len(proposal.floor_tags.lay_on(worlds[side_m].site))} | "
        f"{workload.median_and_range(taken_s / base)} |"
        for side_m, (area, taken_s) in zip(sides_m, times_s.items(), strict=True)
    ]


def parts_of_a_trial(rounds: int, estimator: Estimator = PAPERS, step_count: int = 1200) -> dict[str, FloatArray]:
    """Return the seconds of every round that each part of a trial takes, by its name."""
    proposal, world = workload.layout(), workload.scenario(step_count=step_count)
    knowledge = knowledge_of(proposal, world, estimator)
    record = record_trial(proposal, world, estimator, workload.STREAMS, 0)
    log = workload.logged(step_count=step_count)
    return in_turn(
        {
            "drive": lambda: drive(world, workload.STREAMS, next(workload.NEW_REPLICATIONS)),
            "sensing": lambda: observe(record.drive, proposal, world, knowledge.tags, workload.STREAMS, 0),
            "estimator": lambda: workload.run_whole(estimator, log, 1),
            "outcomes": lambda: outcome_row(record.drive, record.observations, record.trajectory, world),
        },
        rounds,
    )


def shares(times_s: Mapping[str, FloatArray]) -> list[str]:
    """Return rows of the time that each part of a trial takes, and of its share of them all."""
    whole_s = np.sum(list(times_s.values()), axis=0)
    both = {"drive and sensing": times_s["drive"] + times_s["sensing"]}
    return [
        f"| {name} | {1e3 * np.median(taken_s):.3g} | {workload.median_and_range(100.0 * taken_s / whole_s)} |"
        for name, taken_s in {**times_s, **both}.items()
    ]


def spin(count: int) -> int:
    """Count, and nothing else: what the machine gives to two processes of any kind."""
    total = 0
    for number in range(count):
        total += number
    return total


def two_processes(
    rounds: int, tasks: int = TASKS, trials_a_task: int = TRIALS_A_TASK, spins: int = SPINS
) -> list[str]:
    """Return rows of the time of one process over that of two, for trials and, beside them, for bare counting."""
    import joblib

    proposal, world, estimator = workload.layout(), workload.scenario(), MonteCarloLocalisation()
    backends = {1: Workers(Backend.SERIAL), 2: Workers(Backend.LOKY, jobs=2)}
    evaluators = {jobs: Evaluator(workload.STREAMS, workers=workers) for jobs, workers in backends.items()}
    # Far beyond the replications of the other tables.
    firsts = itertools.count(10**6, trials_a_task)
    two = joblib.Parallel(n_jobs=2)

    def trials(jobs: int) -> None:
        evaluators[jobs](
            Task(layout=proposal, scenario=world, estimator=estimator, first=next(firsts), count=trials_a_task)
            for _ in range(tasks)
        )

    def counting(jobs: int) -> None:
        # Two counts, one after the other in a process of the same pool, or both at once.
        for _ in range(2 // jobs):
            two(joblib.delayed(spin)(spins) for _ in range(jobs))

    calls = {
        f"{name} {jobs}": lambda call=call, jobs=jobs: call(jobs)
        for name, call in (("trials", trials), ("bare counting", counting))
        for jobs in (1, 2)
    }
    times_s = in_turn(calls, rounds)
    gains = {name: times_s[f"{name} 1"] / times_s[f"{name} 2"] for name in ("trials", "bare counting")}
    gains["trials against bare counting"] = gains["trials"] / gains["bare counting"]
    return [f"| {name} | {workload.median_and_range(gain)} |" for name, gain in gains.items()]


def main() -> None:
    """Print all tables."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("rounds", nargs="?", type=int, default=15)
    rounds = parser.parse_args().rounds
    cores = os.sched_getaffinity(0) if hasattr(os, "sched_getaffinity") else set(range(os.cpu_count() or 1))
    workload.use_one_core()
    print(f"{workload.machine()}; {rounds} rounds\n")
    warm_up()
    print("| particles | cost | cost of one particle |", "| --- | --- | --- |", sep="\n")
    print(*against_particles(rounds), sep="\n")
    print("\n| floor, m² | tags | cost of a trial |", "| --- | --- | --- |", sep="\n")
    print(*against_area(rounds), sep="\n")
    for estimator in (PAPERS, AdaptiveParticles()):
        print(f"\n| part of a trial, {estimator.name} | ms | share, % |", "| --- | --- | --- |", sep="\n")
        print(*shares(parts_of_a_trial(rounds, estimator)), sep="\n")
    if len(cores) < 2:
        print("\nTwo processes need two cores; this process may use one.")
        return
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, cores)
    print("\n| work | one process / two |", "| --- | --- |", sep="\n")
    print(*two_processes(rounds), sep="\n")


if __name__ == "__main__":
    main()
