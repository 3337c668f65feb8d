"""The race beside searches of other packages: the same layouts, the same drives, the same number of trials.

Run with ``make benchmark-search-peers`` or ``python benchmarks/search_peers.py [--without-peers]``; the protocol
is in the README beside this file. Prints the tables there.
"""

import argparse
import json
import math
import os
import subprocess
import sys
import tempfile
from collections.abc import Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import racing
import workload
from scipy.stats import t as student

from layoutopt.evaluate import Evaluator
from layoutopt.identity import FloatArray, IntArray
from layoutopt.layout import Layout
from layoutopt.problem import Problem
from layoutopt.result import Evaluated
from layoutopt.streams import Streams
from layoutopt.workers import Backend, Workers
from solvers.front import non_dominated
from solvers.racing import Racing

THINNING = (4, 2, 1)
"""Every fourth set of readers, every second pattern of the floor, both of the dock: 10 x 5 x 2 layouts."""
REPLICATIONS = 12
"""Of the full factorial run whose shares are the budgets."""
SHARES = (0.1, 0.2, 0.4)
SEEDS, BLOCK = 20, 10
HERE = Path(__file__).parent
RACES = {
    "layoutopt race that borrows, one first trial": {"first_trials": 1, "borrowing": True},
    "layoutopt race that borrows, two first trials": {"first_trials": 2, "borrowing": True},
    "layoutopt race, one first trial": {"first_trials": 1, "borrowing": False},
    "layoutopt race, two first trials": {"first_trials": 2, "borrowing": False},
}
"""Only one first trial keeps to a budget of less than two trials a layout; the last one is the default."""
OURS = next(iter(RACES))
EQUAL, ALL = "equal shares", "all trials of the block"
RANDOM = "random search"
PEERS = {
    "pymoo NSGA-II": ["search_pymoo.py"],
    "optuna TPE": ["search_optuna.py", "tpe"],
    "optuna NSGA-II": ["search_optuna.py", "nsga2"],
}


@dataclass(frozen=True, slots=True, kw_only=True)
class Ward:
    """All combinations of some options, and the places of the options in their lists, shape (n, variables)."""

    problem: Problem
    contenders: list[Evaluated]
    places: IntArray


@dataclass(frozen=True, slots=True, kw_only=True)
class Score:
    """Hypervolumes over that of the reference, one for each seed, and trials; setting in words."""

    setting: str
    logarithmic: FloatArray
    plain: FloatArray
    trials: FloatArray


def ward(thinning: Sequence[int]) -> Ward:
    """Return every so many-th option of readers, floor pattern and dock pattern, each by rising mean cost."""
    problem, contenders = racing.question(1)
    chosen = [_options(item.layout) for item in contenders]
    costs = np.array([item.scores[problem.goals[0]].value for item in contenders])
    kept = []
    for column, step in enumerate(thinning):
        of: dict[object, list[float]] = {}
        for options, cost in zip(chosen, costs.tolist(), strict=True):
            of.setdefault(options[column], []).append(cost)
        kept.append(sorted(of, key=lambda option: float(np.mean(of[option])))[::step])
    rows = [row for row, options in enumerate(chosen) if all(map(list.__contains__, kept, options))]
    places = np.array([list(map(list.index, kept, chosen[row])) for row in rows])
    if len(rows) != math.prod(map(len, kept)):
        raise RuntimeError("some combinations of options cannot be built, so the space is no product")
    kept_ones = racing.with_exact_scores(problem, [contenders[row] for row in rows])
    return Ward(problem=problem, contenders=kept_ones, places=places)


def race(space: Ward, errors: FloatArray, solver: Racing) -> tuple[list[int], int]:
    """Return the rows that the race selects on a block of replications, shape (n, r), and its trials."""
    solver = replace(solver, most_trials=errors.shape[1])
    evaluate = racing.looked_up(space.problem, space.contenders, errors)
    found = racing.race(space.problem, space.contenders, solver, evaluate)
    return found.rows, found.trials


def equal_shares(costs: FloatArray, errors: FloatArray, trials: int, seed: int) -> tuple[list[int], int]:
    """Return the front when all layouts get as many trials, and what is left goes to some of them at random."""
    each, left = divmod(trials, len(costs))
    counts = np.full(len(costs), each)
    counts[np.random.default_rng(seed).permutation(len(costs))[:left]] += 1
    counts = np.minimum(counts, errors.shape[1])
    means = np.array([row[:count].mean() for row, count in zip(errors, counts.tolist(), strict=True)])
    return non_dominated(np.stack([costs, means], axis=1)).tolist(), int(counts.sum())


def own(space: Ward, parts: Sequence[tuple[FloatArray, racing.Reference]], trials: int) -> dict[str, Score]:
    """Return the scores of the race and of the plain rules beside it."""
    found = {}
    for name, settings in RACES.items():
        solver = Racing(trials=trials, **settings)
        found[name] = [race(space, errors, solver) for errors, _ in parts]
    found[EQUAL] = [equal_shares(truth.costs, errors, trials, seed) for seed, (errors, truth) in enumerate(parts)]
    return {name: scored("", [truth for _, truth in parts], runs) for name, runs in found.items()}


def all_trials(parts: Sequence[tuple[FloatArray, racing.Reference]]) -> Score:
    """Return the score of all layouts in all replications of their blocks."""
    runs = [equal_shares(truth.costs, errors, errors.size, 0) for errors, truth in parts]
    return scored("", [truth for _, truth in parts], runs)


def asked(
    command: Sequence[str],
    space: Ward,
    parts: Sequence[tuple[FloatArray, racing.Reference]],
    budgets: Sequence[int],
) -> dict[int, dict[str, Score]]:
    """Return the scores of a search in a process of its own, for each budget and each of its settings."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "table.npz"
        errors = np.stack([errors for errors, _ in parts])
        np.savez(file, costs=parts[0][1].costs, places=space.places, errors=errors)
        printed = subprocess.run(
            [*command, str(file), *map(str, budgets)], check=True, stdout=subprocess.PIPE, text=True
        ).stdout
    answers = [json.loads(line) for line in printed.splitlines()]
    truths = [truth for _, truth in parts]
    found: dict[int, dict[str, Score]] = {}
    for budget in budgets:
        runs: dict[str, list[tuple[list[int], int]]] = {}
        for answer in answers:
            if answer["budget"] == budget:
                words = ", ".join(f"{name} {value}" for name, value in answer["setting"].items())
                runs.setdefault(words, []).append((answer["rows"], answer["trials"]))
        found[budget] = {words: scored(words, truths, some) for words, some in runs.items()}
    return found


def scored(setting: str, truths: Sequence[racing.Reference], runs: Sequence[tuple[list[int], int]]) -> Score:
    """Return the scores of selections by the references of their blocks."""
    volumes = [
        [truth.ratio(rows, logarithmic=logarithmic) for truth, (rows, _) in zip(truths, runs, strict=True)]
        for logarithmic in (True, False)
    ]
    return Score(
        setting=setting,
        logarithmic=100.0 * np.array(volumes[0]),
        plain=100.0 * np.array(volumes[1]),
        trials=np.array([trials for _, trials in runs], dtype=np.float64),
    )


def best(scores: Mapping[str, Score]) -> Score:
    """Return the setting with the largest mean hypervolume in logarithms: generous, as it had the same seeds."""
    return max(scores.values(), key=lambda score: float(score.logarithmic.mean()))


def rows_of(found: Mapping[str, Score], layouts: int) -> list[str]:
    """Return the rows in Markdown: trials, hypervolumes, and by how much the race's are larger, seed by seed."""
    ours = found[OURS]
    return [
        f"| {name} | {score.setting} | {score.trials.mean() / layouts:.2f} "
        f"| {interval(score.logarithmic)} | {interval(score.plain)} "
        + (
            "| | |"
            if score is ours
            else f"| {interval(ours.logarithmic - score.logarithmic, sign='+')} "
            f"| {interval(ours.plain - score.plain, sign='+')} |"
        )
        for name, score in found.items()
    ]


def interval(values: FloatArray, sign: str = "") -> str:
    """Return the mean with its 95 % interval by Student."""
    half = float(student.ppf(0.975, len(values) - 1)) * float(values.std(ddof=1)) / math.sqrt(len(values))
    return f"{values.mean():{sign}.2f} ± {half:.2f}"


def _options(layout: Layout) -> tuple[object, ...]:
    return (layout.readers, *(zone.pattern for zone in layout.floor_tags.zones))


def _table(path: Path | None, space: Ward, replications: int) -> racing.Reference:
    """Return the errors of all layouts: those of a file, or simulated and kept there."""
    costs = np.array([item.scores[space.problem.goals[0]].value for item in space.contenders])
    if path is not None and path.exists():
        errors = np.load(path)
        if errors.shape[0] != len(costs) or errors.shape[1] < replications:
            raise SystemExit(f"{path} holds other layouts or fewer replications than those asked for")
        return racing.Reference(costs=costs, errors=errors[:, :replications])
    evaluate = Evaluator(Streams(seed=racing.SEED), workers=Workers(Backend.LOKY))
    table = racing.reference(space.problem, space.contenders, replications, evaluate)
    if path is not None:
        np.save(path, table.errors)
    return table


def main() -> None:
    """Print a table for each budget."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("--python", default=str(HERE.parent / ".venv-search-peers" / "bin" / "python"))
    parser.add_argument("--without-peers", action="store_true", help="only what needs no environment of its own")
    parser.add_argument("--table", type=Path, help="file that keeps the errors of all layouts, made if absent")
    arguments = parser.parse_args()
    if not arguments.without_peers and not Path(arguments.python).exists():
        parser.error(f"no {arguments.python}: run 'make benchmark-search-peers' or give --without-peers")
    print(f"{workload.machine()}\n")
    space = ward(THINNING)
    table = _table(arguments.table, space, SEEDS * BLOCK)
    parts = racing.blocks(table, SEEDS)
    full = REPLICATIONS * len(space.contenders)
    budgets = [int(share * full) for share in SHARES]
    commands = {RANDOM: [sys.executable, str(HERE / "peers" / "search_random.py")]}
    if not arguments.without_peers:
        for name, (script, *words) in PEERS.items():
            commands[name] = [arguments.python, str(HERE / "peers" / script), *words]
    with ThreadPoolExecutor(max_workers=os.cpu_count()) as pool:
        running = {name: pool.submit(asked, command, space, parts, budgets) for name, command in commands.items()}
        others = {name: search.result() for name, search in running.items()}
    print(
        f"{len(space.contenders)} layouts, {len(table.front)} on the front; {SEEDS} blocks of {BLOCK} "
        f"replications (seed {racing.SEED}), each with the other {(SEEDS - 1) * BLOCK} as reference"
    )
    for share, budget in zip(SHARES, budgets, strict=True):
        found = own(space, parts, budget)
        found |= {name: best(scores[budget]) for name, scores in others.items()}
        print(f"\n{100.0 * share:.0f} % of the full factorial run: {budget} trials\n")
        print(
            "| search | its best setting | trials a layout | hypervolume in logarithms, % | in EUR m, % "
            "| first row is better by, logarithms | EUR m |"
        )
        print("| --- | --- | --- | --- | --- | --- | --- |")
        print(*rows_of({**found, ALL: all_trials(parts)}, len(space.contenders)), sep="\n", flush=True)


if __name__ == "__main__":
    main()
