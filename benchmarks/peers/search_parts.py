"""What all searches of the peers share: trials looked up in a table under a budget, and the selection at the end.

numpy alone, because it runs in the peers' environment. A search asks for a design, by the places of its options,
and for a number of replications; it gets the exact cost and the mean error of all replications that it has read.
"""

import json
import sys
from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np

EVALUATIONS_A_TRIAL = 20
"""A search that asks only for designs it has read to the end would never spend its budget."""


class OutOfTrials(Exception):
    """The budget is spent: the search is over."""


class Trials:
    """The trials of one search: fresh replications of one block, a budget, and the means so far.

    Attributes
    ----------
    options
        How many options each variable has.
    spent
        Trials read so far.
    """

    def __init__(self, costs: np.ndarray, places: np.ndarray, errors: np.ndarray, trials: int) -> None:
        self.options: list[int] = (places.max(axis=0) + 1).tolist()
        self.spent = 0
        self._rows = {tuple(place): row for row, place in enumerate(places.tolist())}
        self._costs, self._errors, self._budget = costs, errors, trials
        self._read = np.zeros(len(costs), dtype=np.int64)
        self._asked = 0

    def __call__(self, design: Sequence[int], replications: int) -> tuple[float, float]:
        """Read the next replications of a design, fewer where block or budget end, and return cost and mean error.

        Raises
        ------
        OutOfTrials
            If nothing is left of the budget, or nothing comes of it.
        """
        row = self._rows[tuple(int(place) for place in design)]
        self._asked += 1
        if self.spent == self._budget or self._asked > EVALUATIONS_A_TRIAL * self._budget:
            raise OutOfTrials
        fresh = min(replications, self._errors.shape[1] - int(self._read[row]), self._budget - self.spent)
        self._read[row] += fresh
        self.spent += fresh
        return self.known(design)

    def known(self, design: Sequence[int]) -> tuple[float, float]:
        """Return cost and mean error of all replications read of a design."""
        row = self._rows[tuple(int(place) for place in design)]
        return float(self._costs[row]), float(self._errors[row, : self._read[row]].mean())

    def unread(self) -> list[list[int]]:
        """Return the designs that have replications left."""
        return [list(design) for design, row in self._rows.items() if self._read[row] < self._errors.shape[1]]

    def selected(self) -> list[int]:
        """Return the rows that no other one dominates by the means, by rising cost."""
        rows = np.flatnonzero(self._read)
        means = np.array([self._errors[row, : self._read[row]].mean() for row in rows])
        found, least = [], np.inf
        for place in np.lexsort((means, self._costs[rows])):
            if means[place] < least:
                found.append(int(rows[place]))
                least = means[place]
        return found


def run(search: Callable[[Trials, Mapping[str, Any], int], None], settings: Sequence[Mapping[str, Any]]) -> None:
    """Search every block with every setting and budget, and print each selection as a line of JSON.

    Arguments of the command: a file with costs (n,), places (n, variables) and errors (blocks, n, replications),
    then the budgets in trials. A search ends by `OutOfTrials`.
    """
    with np.load(sys.argv[1]) as file:
        costs, places, blocks = file["costs"], file["places"], file["errors"]
    for budget in map(int, sys.argv[2:]):
        for setting in settings:
            for seed, errors in enumerate(blocks):
                trials = Trials(costs, places, errors, budget)
                try:
                    search(trials, setting, seed)
                except OutOfTrials:
                    answer = {"rows": trials.selected(), "trials": trials.spent}
                else:
                    raise SystemExit("a search ended before its budget did")
                print(json.dumps({"budget": budget, "setting": setting, "seed": seed, **answer}), flush=True)
