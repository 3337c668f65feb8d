"""Covers of k x k grids within a time limit: this project's chain, its greedy start, HiGHS alone, and spopt.

Run with ``make benchmark-solver-peers`` or ``python benchmarks/covering.py [--without-peers] [SIDE ...]``; what is
covered and how is in the README beside this file. Prints the rows of the table there.
"""

import argparse
import json
import subprocess
import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import workload

from layoutopt.identity import BoolArray, IntArray
from solvers.covering.integer import cheapest_cover
from solvers.covering.local_search import searched
from solvers.covering.problem import CoverProblem, from_pairs
from solvers.covering.search import Effort, cheapest

RADIUS_CELLS = 2.5
AIMS = {20: 0.0, 40: 0.06, 60: 0.08, 100: 0.08, 200: 0.12}
"""Sides, and the gap that was aimed at."""
LONG_SIDE, LIMIT_S, LONG_LIMIT_S = 200, 30.0, 120.0
EXACT_SHARE = 0.8
"""Of the time limit, for branch and bound at the end; before it grids that get there take a few seconds."""
NO_NODE_LIMIT = 10**9
SPOPT_SIDE = 60
"""spopt keeps a dense matrix and loops over it in Python; on 100 x 100 it has 10^8 entries."""
HERE = Path(__file__).parent
OURS, GREEDY, HIGHS = "layoutopt", "greedy", "HiGHS through cvxpy"


@dataclass(frozen=True, slots=True, kw_only=True)
class Found:
    """What one solver found: cost of its cover, its bound if it has one, seconds on clock and processor."""

    value: int | None
    bound: float | None
    clock_s: float
    processor_s: float

    @property
    def gap(self) -> float | None:
        """Distance of cost and bound, rounded up to a whole number, as a share of the cost."""
        if self.value is None or self.bound is None or not np.isfinite(self.bound):
            return None
        return 1.0 - float(np.ceil(self.bound - 1e-6)) / self.value


def instance(side: int) -> tuple[CoverProblem, IntArray]:
    """Return the cover of a grid, with column and row of each place."""
    places = np.stack(np.divmod(np.arange(side * side), side)[::-1], axis=1).astype(np.int64)
    reach = np.arange(-int(RADIUS_CELLS), int(RADIUS_CELLS) + 1)
    steps = np.stack(np.meshgrid(reach, reach), axis=-1).reshape(-1, 2)
    steps = steps[(steps**2).sum(axis=1) <= RADIUS_CELLS**2]
    reached = places[:, None, :] + steps[None]
    inside = ((reached >= 0) & (reached < side)).all(axis=2)
    row = np.broadcast_to(np.arange(side * side)[:, None], inside.shape)[inside]
    slot = (reached[..., 1] * side + reached[..., 0])[inside]
    ones = np.ones(side * side, dtype=np.int64)
    return CoverProblem(sees=from_pairs(row, slot, len(ones), len(ones)), demand=ones, cost=ones), places


def limit_of(side: int) -> float:
    """Return the time limit for a grid, s."""
    return LONG_LIMIT_S if side >= LONG_SIDE else LIMIT_S


def measured(problem: CoverProblem, solve: Callable[[], tuple[BoolArray | None, float | None]]) -> Found:
    """Return what a solver found, after its cover was checked.

    Raises
    ------
    RuntimeError
        If the cover is none, or cheaper than its bound: then there is nothing to compare.
    """
    clock_s, processor_s = time.perf_counter(), time.process_time()
    chosen, bound = solve()
    clock_s, processor_s = time.perf_counter() - clock_s, time.process_time() - processor_s
    value = None
    if chosen is not None:
        value = problem.cost_of(chosen)
        if len(problem.unmet(chosen)):
            raise RuntimeError(f"{len(problem.unmet(chosen))} cells are not covered")
        if bound is not None and bound > value + 1e-6:
            raise RuntimeError(f"a cover of {value} is cheaper than its bound {bound}")
    return Found(value=value, bound=bound, clock_s=clock_s, processor_s=processor_s)


def own(side: int, limit_s: float) -> dict[str, Found]:
    """Return what needs no environment of its own: the chain, its greedy start, and HiGHS alone."""
    problem, places = instance(side)
    effort = Effort(exact_nodes=NO_NODE_LIMIT, exact_seconds=EXACT_SHARE * limit_s)

    def chain() -> tuple[BoolArray | None, float | None]:
        # Of the processor, so that other work on the machine takes nothing away; the chain has one thread.
        end_s = time.process_time() + limit_s
        answer = cheapest(problem, places=places, effort=effort, stop=lambda: time.process_time() > end_s)
        return answer.chosen, float(answer.bound)

    def highs() -> tuple[BoolArray | None, float | None]:
        answer = cheapest_cover(problem, seconds=limit_s)
        return answer.chosen, answer.bound

    return {
        OURS: measured(problem, chain),
        GREEDY: measured(problem, lambda: (searched(problem, [], steps=0, seed=0), None)),
        HIGHS: measured(problem, highs),
    }


def spopt(python: str, side: int, limit_s: float, solver: str) -> Found:
    """Return what spopt's location set covering problem finds, in the peers' environment, and check its cover."""
    command = [python, str(HERE / "peers" / "spopt_lscp.py"), str(side), str(RADIUS_CELLS), str(limit_s), solver]
    printed = subprocess.run(command, check=True, capture_output=True, text=True).stdout
    # HiGHS prints its licence first.
    answer = json.loads(printed.splitlines()[-1])
    chosen = None
    if answer["chosen"]:
        chosen = np.zeros(side * side, dtype=np.bool_)
        chosen[answer["chosen"]] = True
    checked = measured(instance(side)[0], lambda: (chosen, answer["bound"]))
    return Found(
        value=checked.value,
        bound=checked.bound,
        clock_s=answer["clock_s"],
        processor_s=answer["processor_s"],
    )


def warm_up() -> None:
    """Compile the kernels and import what is imported on first use, so that no row pays for it."""
    own(4, 1.0)


def rows_of(side: int, found: dict[str, Found]) -> list[str]:
    """Return the rows in Markdown."""

    def percent(gap: float | None) -> str:
        return "none" if gap is None else f"{100.0 * gap:.1f}"

    return [
        f"| {side} | {name} | {'none' if one.value is None else one.value} "
        f"| {'none' if one.bound is None or not np.isfinite(one.bound) else f'{one.bound:.1f}'} "
        f"| {percent(one.gap)} | {one.clock_s:.1f} | {one.processor_s:.1f} |"
        for name, one in found.items()
    ]


def missed(side: int, found: dict[str, Found]) -> list[str]:
    """Return which aims were missed, in words: the gap, and to be no worse than the greedy cover."""
    ours, greedy = found[OURS], found[GREEDY]
    out = []
    if side in AIMS and (ours.gap is None or ours.gap > AIMS[side]):
        reached = "none" if ours.gap is None else f"{100.0 * ours.gap:.1f} %"
        out.append(f"k = {side}: the gap is {reached}, the aim was {100.0 * AIMS[side]:.0f} %")
    if ours.value is None or (greedy.value is not None and ours.value > greedy.value):
        out.append(f"k = {side}: the greedy cover of {greedy.value} is better than {ours.value}")
    return out


def main() -> None:
    """Print the table, and fail if an aim was missed."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("sides", nargs="*", type=int, default=list(AIMS))
    parser.add_argument("--python", default=str(HERE.parent / ".venv-solver-peers" / "bin" / "python"))
    parser.add_argument("--without-peers", action="store_true", help="only what needs no environment of its own")
    arguments = parser.parse_args()
    if not arguments.without_peers and not Path(arguments.python).exists():
        parser.error(f"no {arguments.python}: run 'make benchmark-solver-peers' or give --without-peers")
    workload.use_one_core()
    warm_up()
    print(f"{workload.machine()}\n")
    print("| k | solver | tags | bound | gap, % | clock, s | processor, s |")
    print("| --- | --- | --- | --- | --- | --- | --- |")
    wrong = []
    for side in arguments.sides:
        found = own(side, limit_of(side))
        if not arguments.without_peers and side <= SPOPT_SIDE:
            for solver in ("CBC", "HiGHS"):
                found[f"spopt, {solver}"] = spopt(arguments.python, side, limit_of(side), solver)
        print(*rows_of(side, found), sep="\n", flush=True)
        wrong += missed(side, found)
    if wrong:
        raise SystemExit("; ".join(wrong))


if __name__ == "__main__":
    main()
