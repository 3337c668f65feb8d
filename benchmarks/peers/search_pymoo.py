"""NSGA-II of pymoo over integers that are ordered by cost, or over categories. FILE BUDGET ...

A design that comes again gets fresh replications, and every member of the population has the mean of all of them.
"""

import itertools
from collections.abc import Mapping
from typing import Any

import numpy as np
from pymoo.algorithms.moo.nsga2 import NSGA2
from pymoo.core.duplicate import NoDuplicateElimination
from pymoo.core.evaluator import Evaluator
from pymoo.core.mixed import MixedVariableDuplicateElimination, MixedVariableMating, MixedVariableSampling
from pymoo.core.problem import Problem
from pymoo.core.variable import Choice, Integer
from pymoo.problems.static import StaticProblem
from search_parts import Trials, run

SETTINGS = [
    {"replications": count, "population": population, "ordered": ordered, "again": again}
    for count, population, ordered, again in itertools.product(
        (1, 2, 4, 8), (20, 40), (True, False), (True, False)
    )
]
NO_END = 10**9


def search(trials: Trials, setting: Mapping[str, Any], seed: int) -> None:
    """Evolve until the budget is spent; a population without new offspring gives way to a new one."""
    for start in itertools.count():
        _evolve(trials, setting, 1000 * seed + start)


def _evolve(trials: Trials, setting: Mapping[str, Any], seed: int) -> None:
    names = [f"variable{number}" for number in range(len(trials.options))]
    variables = {
        name: Integer(bounds=(0, count - 1)) if setting["ordered"] else Choice(options=list(range(count)))
        for name, count in zip(names, trials.options, strict=True)
    }
    problem = Problem(vars=variables, n_obj=2)
    twins = NoDuplicateElimination() if setting["again"] else MixedVariableDuplicateElimination()
    algorithm = NSGA2(
        pop_size=setting["population"],
        sampling=MixedVariableSampling(),
        mating=MixedVariableMating(eliminate_duplicates=twins),
        eliminate_duplicates=twins,
    )
    algorithm.setup(problem, termination=("n_gen", NO_END), seed=seed, verbose=False)

    def design(individual: Any) -> list[int]:
        return [int(individual.X[name]) for name in names]

    while algorithm.has_next():
        offspring = algorithm.ask()
        if offspring is None or len(offspring) == 0:
            return
        for individual in offspring:
            trials(design(individual), setting["replications"])
        goals = np.array([trials.known(design(individual)) for individual in offspring])
        Evaluator().eval(StaticProblem(problem, F=goals), offspring)
        for individual in () if algorithm.pop is None else algorithm.pop:
            individual.F = np.array(trials.known(design(individual)))
        algorithm.tell(infills=offspring)


if __name__ == "__main__":
    run(search, SETTINGS)
