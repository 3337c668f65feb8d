"""The local search for covers in plain Python: the truth that `local_search_kernels` is tested against.

Nothing is brought up to date here. What rows see and what slots score is counted anew from the choice and the
weights whenever it is asked for, so that only the rules of the search are left to be read.
"""

from collections.abc import Iterable
from typing import Final

import numpy as np

from layoutopt.identity import BoolArray, IntArray
from solvers.covering.problem import CoverProblem

NO_BUDGET: Final = -1
MULTIPLIER: Final = 1103515245
INCREMENT: Final = 12345
WORD: Final = 0x7FFFFFFF
LOW_BITS: Final = 8
"""Of a linear congruential word; they repeat too soon to be used."""


class PlainSearch:
    """A search on a small problem; its steps are those of `local_search_search`.

    Parameters
    ----------
    problem
        A problem without locked and forbidden slots.
    start
        Choice to begin with; it breaks no rule.
    weight
        Of the rows, shape (rows,); one each if left out.
    """

    def __init__(self, problem: CoverProblem, start: BoolArray, weight: IntArray | None = None) -> None:
        """Begin with a choice, whose slots come in rising order."""
        self.problem = problem
        slots, rows = problem.slot_count, problem.row_count
        self.chosen = np.zeros(slots, dtype=np.bool_)
        self.best = np.zeros(slots, dtype=np.bool_)
        self.weight = np.ones(rows, dtype=np.int64) if weight is None else np.array(weight, dtype=np.int64)
        self.stamp = np.zeros(slots, dtype=np.int64)
        self.changed = np.ones(slots, dtype=np.bool_)
        self.unmet = [int(row) for row in np.flatnonzero(problem.demand > 0)]
        self.step = 0
        self.tabu = -1
        self.best_cost, self.best_worth = int(problem.cost.sum()) + 1, -1
        self._sees = np.zeros((rows, slots), dtype=np.bool_)
        self._sees[problem.sees.row, problem.sees.slot] = True
        self._rivals = np.zeros((slots, slots), dtype=np.bool_)
        self._rivals[problem.conflicts[:, 0], problem.conflicts[:, 1]] = True
        self._rivals |= self._rivals.T
        for slot in np.flatnonzero(start):
            self.add(int(slot))

    @property
    def cost(self) -> int:
        """Cost of the choice."""
        return int(self.problem.cost[self.chosen].sum())

    @property
    def worth(self) -> int:
        """What the rows that are met are worth."""
        return self.problem.worth_of(self.chosen)

    @property
    def numbers(self) -> IntArray:
        """The single numbers in the order of `local_search_kernels`."""
        return np.array(
            [
                self.chosen.sum(),
                len(self.unmet),
                self.cost,
                self.worth,
                self.step,
                self.tabu,
                self.best_cost,
                self.best_worth,
            ],
            dtype=np.int64,
        )

    def counted(self) -> BoolArray:
        """Return which rows count for which slots, shape (rows, slots).

        For a slot that is not chosen these are unmet rows, which it would help; for one that is chosen also those
        met without one to spare, which would lack it.
        """
        surplus = self.problem.sees.counts(self.chosen) - self.problem.demand
        return self._sees & np.where(self.chosen[None, :], surplus[:, None] <= 0, surplus[:, None] < 0)

    def scores(self) -> IntArray:
        """Return the weight of the rows that count for each slot, shape (slots,)."""
        return np.asarray(self.weight @ self.counted(), dtype=np.int64)

    def search(self, budget: int, draws: IntArray) -> None:
        """Go on with the search, one step for each draw."""
        for first in draws:
            word = int(first)
            self.step += 1
            if budget == NO_BUDGET:
                while not self.unmet and self.chosen.any():
                    self.drop(self.least_loss(np.flatnonzero(self.chosen).tolist()))
                    self.keep_better(budget)
            if not self.unmet:
                return
            others = [slot for slot in np.flatnonzero(self.chosen).tolist() if slot != self.tabu]
            if others:
                self.drop(self.least_loss(others))
            limit = self.best_cost - 1 if budget == NO_BUDGET else budget
            pushes = True
            while self.unmet:
                row = self.unmet[(word >> LOW_BITS) % len(self.unmet)]
                word = (word * MULTIPLIER + INCREMENT) & WORD
                found = self.best_gain(row, limit, pushes=pushes)
                if found is None:
                    break
                slot, pushed = found
                pushes = pushes and not pushed
                while out := self.pushed_out(slot):
                    self.drop(out[0])
                self.add(slot)
                self.tabu = slot
            self.keep_better(budget)
            self.weight[self.unmet] += 1 if budget == NO_BUDGET else self.problem.worth[self.unmet]

    def fill(self, budget: int) -> None:
        """Add the slot that helps most for its cost, again and again, as far as rules and budget allow."""
        while self.unmet:
            scores = self.scores()
            able = [
                slot
                for slot in np.flatnonzero(~self.chosen & (scores > 0)).tolist()
                if not self.pushed_out(slot)
                and (budget == NO_BUDGET or self.cost + self.problem.cost[slot] <= budget)
            ]
            if not able:
                return
            self.add(min(able, key=lambda slot: (-scores[slot] / self.problem.cost[slot], slot)))

    def keep_better(self, budget: int) -> None:
        """Remember the present choice if it beats the best."""
        covers = not self.unmet and self.cost < self.best_cost
        if covers if budget == NO_BUDGET else self.worth > self.best_worth:
            self.best, self.best_cost, self.best_worth = self.chosen.copy(), self.cost, self.worth

    def least_loss(self, slots: Iterable[int]) -> int:
        """Return which of some slots loses least for its cost; of equals the oldest, of these the first."""
        scores = [int(score) for score in self.scores()]
        cost = [int(cost) for cost in self.problem.cost]
        found = -1
        for slot in sorted(slots):
            if found >= 0:
                less = scores[slot] * cost[found] - scores[found] * cost[slot]
                if less > 0 or (less == 0 and self.stamp[slot] >= self.stamp[found]):
                    continue
            found = slot
        return found

    def best_gain(self, row: int, limit: int, *, pushes: bool) -> tuple[int, bool] | None:
        """Return the slot to add for a row and whether others must go for it; ``None`` if there is none."""
        scores = [int(score) for score in self.scores()]
        cost = [int(cost) for cost in self.problem.cost]
        candidates = [int(slot) for slot in np.flatnonzero(self._sees[row] & ~self.chosen)]
        out = {slot: self.pushed_out(slot) for slot in candidates}
        levels = [
            [slot for slot in candidates if self.changed[slot] and not out[slot]],
            [slot for slot in candidates if not out[slot]],
            candidates if pushes else [],
        ]
        for level in levels:
            found, gain = -1, 0
            for slot in level:
                if self.cost - sum(cost[other] for other in out[slot]) + cost[slot] > limit:
                    continue
                own = scores[slot] - sum(scores[other] for other in out[slot])
                if found >= 0:
                    more = own * cost[found] - gain * cost[slot]
                    if more < 0 or (more == 0 and self.stamp[slot] >= self.stamp[found]):
                        continue
                found, gain = slot, own
            if found >= 0:
                return found, bool(out[found])
        return None

    def pushed_out(self, slot: int) -> list[int]:
        """Return the chosen slots that cannot stay beside a slot: rivals, and one of its group if that is full."""
        problem = self.problem
        out = [int(other) for other in np.flatnonzero(self._rivals[slot] & self.chosen)]
        group = problem.group[slot]
        if group < 0:
            return out
        stay = [int(other) for other in np.flatnonzero(self.chosen & (problem.group == group)) if other not in out]
        return [*out, self.least_loss(stay)] if len(stay) >= problem.capacity[group] else out

    def add(self, slot: int) -> None:
        """Choose a slot; rows that are met now leave the list, and the last one of it takes their place."""
        before = self.counted()
        self.chosen[slot] = True
        self.stamp[slot] = self.step
        seen = self.problem.sees.counts(self.chosen)
        for row in np.flatnonzero(self._sees[:, slot] & (seen == self.problem.demand)):
            place = self.unmet.index(int(row))
            self.unmet[place] = self.unmet[-1]
            self.unmet.pop()
        self._note_changes(before, slot)

    def drop(self, slot: int) -> None:
        """Let a slot go; rows that are unmet now join the end of the list."""
        before = self.counted()
        self.chosen[slot] = False
        self.stamp[slot] = self.step
        seen = self.problem.sees.counts(self.chosen)
        self.unmet += [int(row) for row in np.flatnonzero(self._sees[:, slot] & (seen == self.problem.demand - 1))]
        self.changed[slot] = False
        self._note_changes(before, slot)

    def _note_changes(self, before: BoolArray, moved: int) -> None:
        others = (before != self.counted()).any(axis=0)
        others[moved] = False
        self.changed |= others
