"""Covering problems that tests make up, and their answers by trying every choice."""

import itertools
from dataclasses import dataclass

import numpy as np
from scipy.optimize import Bounds, LinearConstraint, milp
from scipy.sparse import csr_array

from solvers.covering.problem import CoverProblem, from_pairs


def random_case(draws, *, slots, rows, share=0.35, rules=True, most_demand=2, most_cost=5):
    """Return a random problem; with rules also conflicts, groups, locked and forbidden slots."""
    seen = draws.random((rows, slots)) < share
    row, slot = np.nonzero(seen)
    given = {}
    if rules:
        groups = int(draws.integers(0, 4))
        if groups:
            given["group"] = draws.integers(-1, groups, slots)
            given["capacity"] = draws.integers(1, 4, groups)
        pairs = np.unique(np.sort(draws.integers(0, slots, (int(draws.integers(0, slots)), 2)), axis=1), axis=0)
        given["conflicts"] = pairs[pairs[:, 0] != pairs[:, 1]]
        given["forbidden"] = draws.random(slots) < 0.08
        locked = (draws.random(slots) < 0.12) & ~given["forbidden"]
        free = CoverProblem(
            sees=from_pairs(row, slot, rows, slots),
            demand=np.zeros(rows, dtype=np.int64),
            cost=np.ones(slots, dtype=np.int64),
            **given,
        )
        # What is locked keeps the rules, or the problem is refused.
        while free.broken_rules(locked):
            locked[int(draws.choice(np.flatnonzero(locked)))] = False
        given["locked"] = locked
    return CoverProblem(
        sees=from_pairs(row, slot, rows, slots),
        demand=draws.integers(0, most_demand + 1, rows),
        cost=draws.integers(1, most_cost + 1, slots),
        worth=draws.integers(0, 6, rows),
        **given,
    )


def floor_case(draws, *, slots, rows, side_m, most_demand):
    """Return slots and rows at random places of a square, with costs of all kinds and rules now and then.

    A row sees the slots within one metre and demands no more than it can see; some rows come twice.
    """
    places, wanted = side_m * draws.random((slots, 2)), side_m * draws.random((rows, 2))
    wanted[: rows // 5] = wanted[rows - rows // 5 :]
    row, slot = np.nonzero(((wanted[:, None] - places[None]) ** 2).sum(axis=2) <= 1.0)
    demand = np.minimum(draws.integers(0, most_demand + 1, rows), np.bincount(row, minlength=rows))
    cost = [
        np.ones(slots, dtype=np.int64),
        draws.integers(1, 6, slots),
        10 ** draws.integers(0, 7, slots),
        2**32 + draws.integers(0, 50, slots),
    ][int(draws.integers(4))]
    given = {}
    if draws.random() < 0.3:
        near = ((places[:, None] - places[None]) ** 2).sum(axis=2) <= 0.3**2
        given["conflicts"] = np.argwhere(np.triu(near, 1))
    if draws.random() < 0.3:
        given["forbidden"] = draws.random(slots) < 0.05
        locked = (draws.random(slots) < 0.1) & ~given["forbidden"]
        locked[given.get("conflicts", np.empty((0, 2), dtype=np.int64)).ravel()] = False
        given["locked"] = locked
    return CoverProblem(sees=from_pairs(row, slot, rows, slots), demand=demand, cost=cost, **given)


def grid_case(side, radius_cells=2.5):
    """Return the cover of a square grid by discs about its cells, with column and row of each slot."""
    places = np.stack(np.divmod(np.arange(side * side), side)[::-1], axis=1)
    apart = ((places[:, None] - places[None]) ** 2).sum(axis=2)
    row, slot = np.nonzero(apart <= radius_cells**2)
    ones = np.ones(side * side, dtype=np.int64)
    return CoverProblem(sees=from_pairs(row, slot, len(ones), len(ones)), demand=ones, cost=ones), places


@dataclass(frozen=True, kw_only=True)
class Everything:
    """All choices that keep the rules, with what they cost and meet."""

    cost: np.ndarray
    worth: np.ndarray
    met: np.ndarray

    @property
    def cheapest(self):
        """Least cost of a choice that meets every row; ``None`` if there is none."""
        covers = self.met.all(axis=1)
        return int(self.cost[covers].min()) if covers.any() else None

    @property
    def lost(self):
        """Rows that no choice meets."""
        return np.flatnonzero(~self.met.any(axis=0))

    def worthiest(self, budget):
        """Most worth within the budget."""
        return int(self.worth[self.cost <= budget].max())


def everything(problem):
    """Return all choices that keep the rules, counted from the problem's own arrays alone."""
    choices = np.array(list(itertools.product([False, True], repeat=problem.slot_count)), dtype=np.bool_)
    keeps = (choices | ~problem.locked).all(axis=1) & ~(choices & problem.forbidden).any(axis=1)
    for one, other in problem.conflicts:
        keeps &= ~(choices[:, one] & choices[:, other])
    for number, capacity in enumerate(problem.capacity):
        keeps &= choices[:, problem.group == number].sum(axis=1) <= capacity
    choices = choices[keeps]
    met = np.empty((len(choices), problem.row_count), dtype=np.bool_)
    for row in range(problem.row_count):
        slots = problem.sees.slot[problem.sees.start[row] : problem.sees.start[row + 1]]
        met[:, row] = choices[:, slots].sum(axis=1) >= problem.demand[row]
    return Everything(cost=(choices & ~problem.locked) @ problem.cost, worth=met @ problem.worth, met=met)


def scipy_rules(problem, columns):
    """Return matrix of rows and rules between slots for scipy, with as many columns as the program has."""
    table = problem.sees
    shape = (table.row_count, problem.slot_count)
    matrix = csr_array((np.ones(len(table.slot)), table.slot, table.start), shape=shape)
    rules = []
    for one, other in problem.conflicts:
        line = np.zeros(columns)
        line[[one, other]] = 1.0
        rules.append(LinearConstraint(line, -np.inf, 1.0))
    for number, capacity in enumerate(problem.capacity):
        line = np.zeros(columns)
        line[: problem.slot_count][problem.group == number] = 1.0
        rules.append(LinearConstraint(line, -np.inf, capacity))
    lower, upper = np.zeros(columns), np.ones(columns)
    lower[: problem.slot_count] = problem.locked
    upper[: problem.slot_count] = ~problem.forbidden
    return matrix, rules, Bounds(lower, upper)


def scipy_cheapest(problem):
    """Return the least cost of a cover by scipy's own integer program; ``None`` if there is none."""
    matrix, rules, bounds = scipy_rules(problem, problem.slot_count)
    cost = np.where(problem.locked, 0, problem.cost)
    rules.append(LinearConstraint(matrix, problem.demand, np.inf))
    # Without options scipy calls a cover the best that is dearer by a ten-thousandth.
    exact = {"mip_rel_gap": 0.0}
    found = milp(cost, constraints=rules, bounds=bounds, integrality=np.ones(problem.slot_count), options=exact)
    return None if found.status == 2 else round(found.fun)
