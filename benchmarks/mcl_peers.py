"""Monte Carlo localisation of this project beside that of its peers, on one detection log and in one run.

Run with ``make benchmark-peers`` or ``python benchmarks/mcl_peers.py [ROUNDS] [--without-peers]``; the protocol is
in the README beside this file. Prints the rows of the table there.
"""

import argparse
import json
import subprocess
import tempfile
from collections.abc import Callable, Mapping
from contextlib import ExitStack
from dataclasses import dataclass, field
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import numpy as np
import workload

from layoutopt import registry
from layoutopt.estimators.mcl import MonteCarloLocalisation
from layoutopt.identity import FloatArray
from layoutopt.simulation.trials import warm_up

PARTICLES = 500
ERROR_FACTOR = 1.5
"""The same filter has the same error, whoever runs it; beyond this factor of the median something else ran."""

OTHER_ESTIMATORS = ("mcl_crossings", "mcl_negative_information", "mcl_adaptive")
PEERS = {
    "plain numpy": "plain_numpy.py",
    "particles": "particles_smc.py",
    "Stone Soup": "stone_soup.py",
}
KERNEL = "layoutopt mcl"
TWIN = "layoutopt mcl, plain twin"
HERE = Path(__file__).parent

Run = Callable[[int], tuple[float, float]]
"""Runs a whole drive with a seed; returns its seconds and its mean position error, m."""


@dataclass
class Worker:
    """A filter of the peers' environment: a process that waits while it is not asked."""

    command: list[str]
    version: str = field(init=False, default="")

    def __enter__(self) -> Self:
        """Start the process and wait until it has warmed up."""
        self._process = subprocess.Popen(self.command, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        self.version = str(self._answer()["ready"])
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """End the process by closing its input."""
        self._process.communicate()

    def __call__(self, seed: int) -> tuple[float, float]:
        """Run a whole drive."""
        assert self._process.stdin is not None
        self._process.stdin.write(f"{seed}\n")
        self._process.stdin.flush()
        answer = self._answer()
        return answer["seconds"], answer["error_m"]

    def _answer(self) -> dict[str, Any]:
        assert self._process.stdout is not None
        line = self._process.stdout.readline()
        if not line:
            raise SystemExit(f"{' '.join(self.command)} ended without an answer; its message is above")
        return dict(json.loads(line))


def own_runs(log: workload.Log, particles: int) -> dict[str, Run]:
    """Return the estimators of this project, those of other kinds only if the table of estimators has them."""

    def whole(name: str) -> Run:
        estimator = registry.load("estimators", name)(particles=particles)
        return timed(lambda seed: workload.run_whole(estimator, log, seed), log)

    plain = MonteCarloLocalisation(particles=particles)
    runs = {KERNEL: whole("mcl"), TWIN: timed(lambda seed: workload.run_by_steps(plain, log, seed), log)}
    known = registry.names("estimators")
    return runs | {f"layoutopt {name}": whole(name) for name in OTHER_ESTIMATORS if name in known}


def timed(poses_of: Callable[[int], FloatArray], log: workload.Log) -> Run:
    """Return a run that times itself and knows its error."""

    def run(seed: int) -> tuple[float, float]:
        kept: list[FloatArray] = []
        taken_s = workload.seconds(lambda: kept.append(poses_of(seed)))
        return taken_s, log.error_m(kept[0])

    return run


def in_turn(runs: Mapping[str, Run], rounds: int) -> tuple[dict[str, FloatArray], dict[str, float]]:
    """Return the seconds of every round, and the error, median of the rounds, by name."""
    names = list(runs)
    for name in names:
        runs[name](0)
    results: dict[str, list[tuple[float, float]]] = {name: [] for name in names}
    for number in range(rounds):
        for name in workload.order(names, number):
            results[name].append(runs[name](number + 1))
    times_s = {name: np.array([taken_s for taken_s, _ in results[name]]) for name in names}
    return times_s, {name: float(np.median([error_m for _, error_m in results[name]])) for name in names}


def table(times_s: Mapping[str, FloatArray], errors_m: Mapping[str, float], steps: int, particles: int) -> str:
    """Return the rows in Markdown: rate, error and how many times faster than each baseline."""
    baselines = [name for name in (TWIN, *PEERS) if name in times_s]
    rows = [
        ["filter", "million particle-steps/s", "mean error, mm"]
        + [f"times as fast as {name}" for name in baselines],
        ["---"] * (3 + len(baselines)),
    ]
    for name, taken_s in times_s.items():
        ratios = [
            "1" if name == base else workload.median_and_range(times_s[base] / taken_s) for base in baselines
        ]
        rate = particles * steps / float(np.median(taken_s)) / 1e6
        rows.append([name, f"{rate:.3g}", f"{1e3 * errors_m[name]:.2f}", *ratios])
    return "\n".join("| " + " | ".join(row) + " |" for row in rows)


def disagreements(errors_m: Mapping[str, float]) -> list[str]:
    """Return what is wrong with the errors: the same filter must have the same, and other kinds no larger ones."""
    same = {name: error_m for name, error_m in errors_m.items() if name in (KERNEL, TWIN, *PEERS)}
    middle_m = float(np.median(list(same.values())))
    return [
        f"{name}: mean error {1e3 * error_m:.2f} mm, others {1e3 * middle_m:.2f} mm"
        for name, error_m in errors_m.items()
        if error_m > ERROR_FACTOR * middle_m or (name in same and error_m < middle_m / ERROR_FACTOR)
    ]


def main() -> None:
    """Time everything in turn, print the table, and fail if the errors do not agree."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("rounds", nargs="?", type=int, default=15)
    parser.add_argument("--python", default=str(HERE.parent / ".venv-peers" / "bin" / "python"))
    parser.add_argument("--without-peers", action="store_true", help="only what needs no environment of its own")
    arguments = parser.parse_args()
    if not arguments.without_peers and not Path(arguments.python).exists():
        parser.error(f"no {arguments.python}: run 'make benchmark-peers' or give --without-peers")
    workload.use_one_core()
    machine = workload.machine()
    warm_up()
    log = workload.logged()
    steps = len(log.truth)
    with tempfile.TemporaryDirectory() as folder, ExitStack() as stack:
        drive = Path(folder) / "drive.npz"
        log.save(drive)
        workers = {
            name: stack.enter_context(
                Worker([arguments.python, str(HERE / "peers" / script), str(drive), str(PARTICLES)])
            )
            for name, script in PEERS.items()
            if not arguments.without_peers
        }
        times_s, errors_m = in_turn({**own_runs(log, PARTICLES), **workers}, arguments.rounds)
        peers = "; peers: " + ", ".join(worker.version for worker in workers.values()) if workers else ""
    print(f"{machine}{peers}")
    print(
        f"{PARTICLES} particles, {steps} steps, {len(log.observations.read_tag)} reads, "
        f"{len(log.knowledge.tags)} tags; {arguments.rounds} rounds\n"
    )
    print(table(times_s, errors_m, steps, PARTICLES))
    wrong = disagreements(errors_m)
    if wrong:
        raise SystemExit("the errors do not agree, so the ratios mean nothing: " + "; ".join(wrong))


if __name__ == "__main__":
    main()
