"""Samplers of optuna over integers that are ordered by cost, or over categories. SAMPLER FILE BUDGET ...

A design that comes again gets fresh replications, and optuna is told the mean of all of them. After one that has
none left, a random one that has some is put in line, because TPE would ask for the same few designs for ever.
"""

import itertools
import sys
import warnings
from collections.abc import Mapping
from typing import Any

import numpy as np
import optuna
from search_parts import Trials, run

TREES = [
    {"replications": count, "ordered": ordered}
    for count, ordered in itertools.product((8, 4, 2, 1), (True, False))
]
GENETIC = [
    {"replications": count, "population": population, "ordered": ordered}
    for count, population, ordered in itertools.product((1, 2, 4, 8), (20, 40), (True, False))
]


def search(trials: Trials, setting: Mapping[str, Any], seed: int) -> None:
    """Ask and tell until the budget is spent."""
    sampler: optuna.samplers.BaseSampler
    if "population" in setting:
        sampler = optuna.samplers.NSGAIISampler(population_size=setting["population"], seed=seed)
    else:
        sampler = optuna.samplers.TPESampler(multivariate=True, seed=seed)
    study = optuna.create_study(directions=["minimize", "minimize"], sampler=sampler)
    random = np.random.default_rng(seed)
    while True:
        trial = study.ask()
        design = [
            trial.suggest_int(f"variable{number}", 0, count - 1)
            if setting["ordered"]
            else trial.suggest_categorical(f"variable{number}", list(range(count)))
            for number, count in enumerate(trials.options)
        ]
        before = trials.spent
        study.tell(trial, trials(design, setting["replications"]))
        if trials.spent == before:
            others = trials.unread()
            other = others[int(random.integers(len(others)))]
            study.enqueue_trial({f"variable{number}": place for number, place in enumerate(other)})


def main() -> None:
    """Run the sampler that the first argument names."""
    optuna.logging.set_verbosity(optuna.logging.ERROR)
    warnings.simplefilter("ignore", optuna.exceptions.ExperimentalWarning)
    run(search, {"tpe": TREES, "nsga2": GENETIC}[sys.argv.pop(1)])


if __name__ == "__main__":
    main()
