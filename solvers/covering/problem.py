"""The covering problem in numbers: rows with demands, slots with costs, rules between slots.

A row is anything that wants to see chosen slots: a pose of a robot, a straight run, a cell of a grid. What it
stands for, and what a slot is, the module does not know.
"""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Final

import numpy as np
from numpy.typing import ArrayLike

from layoutopt.identity import BoolArray, IntArray

_LARGEST_PRODUCT: Final = 2**40
"""Searches compare worth times cost in 64 bits, with weights that grow a millionfold."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Incidence:
    """Which slots each row can see, as a sparse table: row i sees ``slot[start[i]:start[i + 1]]``, ascending.

    ``slot_count`` says how many slots there are; some may be seen from nowhere.

    Raises
    ------
    ValueError
        If the table is none: a slot does not exist, or the slots of a row do not rise.
    """

    start: IntArray
    slot: IntArray
    slot_count: int

    def __post_init__(self) -> None:
        """Check the table; compiled code that reads it looks at no border."""
        start, slot = self.start, self.slot
        if not (len(start) and start[0] == 0 and start[-1] == len(slot) and (np.diff(start) >= 0).all()):
            raise ValueError("row i sees slot[start[i]:start[i + 1]], so start must rise from 0 to len(slot)")
        if len(slot) and not (slot.min() >= 0 and slot.max() < self.slot_count):
            raise ValueError(f"slots are 0 to {self.slot_count - 1}, got {slot.min()} to {slot.max()}")
        if (np.diff(self.row * self.slot_count + slot) <= 0).any():
            raise ValueError("the slots of a row must rise, and none may come twice")

    @property
    def row_count(self) -> int:
        """Number of rows."""
        return len(self.start) - 1

    @property
    def row(self) -> IntArray:
        """Row of each entry, shape (entries,)."""
        return np.repeat(np.arange(self.row_count), np.diff(self.start))

    def turned(self) -> "Incidence":
        """Return the table the other way round: which rows see each slot."""
        order = np.argsort(self.slot, kind="stable")
        start = np.concatenate([[0], np.cumsum(np.bincount(self.slot, minlength=self.slot_count))])
        return Incidence(start=start.astype(np.int64), slot=self.row[order], slot_count=self.row_count)

    def counts(self, chosen: BoolArray) -> IntArray:
        """Return how many chosen slots each row sees, shape (rows,)."""
        seen = np.concatenate([[0], np.cumsum(chosen[self.slot])])
        return np.asarray(seen[self.start[1:]] - seen[self.start[:-1]], dtype=np.int64)

    def of_rows(self, rows: IntArray) -> "Incidence":
        """Return the table of some rows, in that order."""
        lengths = np.diff(self.start)[rows]
        start = np.concatenate([[0], np.cumsum(lengths)]).astype(np.int64)
        offsets = np.arange(start[-1]) - np.repeat(start[:-1], lengths)
        places = np.repeat(self.start[:-1][rows], lengths) + offsets
        return Incidence(start=start, slot=self.slot[places], slot_count=self.slot_count)


def incidence(rows: Sequence[ArrayLike], slot_count: int) -> Incidence:
    """Return the table of rows, each a list of the slots it sees.

    Raises
    ------
    ValueError
        If a slot does not exist or a row names one twice.
    """
    lists = [np.unique(np.asarray(row, dtype=np.int64)) for row in rows]
    if any(len(unique) != len(np.asarray(row)) for unique, row in zip(lists, rows, strict=True)):
        raise ValueError("a row names a slot twice")
    slot = np.concatenate([np.empty(0, dtype=np.int64), *lists])
    start = np.concatenate([[0], np.cumsum([len(row) for row in lists])]).astype(np.int64)
    return Incidence(start=start, slot=slot, slot_count=slot_count)


def from_pairs(row: IntArray, slot: IntArray, row_count: int, slot_count: int) -> Incidence:
    """Return the table of pairs of row and slot in any order; a pair that comes twice counts once."""
    pairs = np.unique(row * slot_count + slot)
    rows, slots = np.divmod(pairs, max(slot_count, 1))
    start = np.concatenate([[0], np.cumsum(np.bincount(rows, minlength=row_count))]).astype(np.int64)
    return Incidence(start=start, slot=slots, slot_count=slot_count)


def no_pairs() -> IntArray:
    """Return an empty list of pairs, shape (0, 2)."""
    return np.empty((0, 2), dtype=np.int64)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class CoverProblem:
    """Choose slots so that every row sees at least as many chosen ones as it demands.

    Attributes
    ----------
    sees
        Which slots each row can see.
    demand
        How many chosen slots each row wants, shape (rows,), zero or more.
    cost
        What a slot costs in whole units such as cents, shape (slots,), positive.
    worth
        What a met row is worth where not all can be met, shape (rows,), in whole units; one each by default.
    locked, forbidden
        Slots that are chosen in any case, or never; shape (slots,). A locked slot costs nothing: it is there.
    conflicts
        Pairs of slots of which at most one may be chosen, shape (m, 2).
    group, capacity
        Group of each slot, -1 for none, shape (slots,), and how many slots of each group may be chosen.

    Raises
    ------
    ValueError
        If shapes or kinds do not agree, a number is out of its range, or locked slots break a rule.
    """

    sees: Incidence
    demand: IntArray
    cost: IntArray
    worth: IntArray = field(default_factory=lambda: np.empty(0, dtype=np.int64))
    locked: BoolArray = field(default_factory=lambda: np.empty(0, dtype=np.bool_))
    forbidden: BoolArray = field(default_factory=lambda: np.empty(0, dtype=np.bool_))
    conflicts: IntArray = field(default_factory=no_pairs)
    group: IntArray = field(default_factory=lambda: np.empty(0, dtype=np.int64))
    capacity: IntArray = field(default_factory=lambda: np.empty(0, dtype=np.int64))

    def __post_init__(self) -> None:
        """Fill in what was left out and check the rest."""
        rows, slots = self.sees.row_count, self.sees.slot_count
        if not self.worth.size:
            object.__setattr__(self, "worth", np.ones(rows, dtype=np.int64))
        for name in ("locked", "forbidden"):
            if not getattr(self, name).size:
                object.__setattr__(self, name, np.zeros(slots, dtype=np.bool_))
        if not self.group.size:
            object.__setattr__(self, "group", np.full(slots, -1, dtype=np.int64))
        self._check_columns()
        if (self.demand < 0).any() or (self.cost <= 0).any() or (self.worth < 0).any():
            raise ValueError("demands and worths must be zero or more, costs positive")
        if (self.group >= len(self.capacity)).any():
            raise ValueError("every group needs a capacity")
        if (self.locked & self.forbidden).any():
            raise ValueError("a slot is locked and forbidden at once")
        if self.broken_rules(self.locked):
            raise ValueError(f"locked slots break a rule: {self.broken_rules(self.locked)[0]}")
        # Weights of rows begin with one or with what the row is worth; in float64, because a sum must not wrap.
        heaviest = max(float(self.worth.sum(dtype=np.float64)), float(rows))
        if heaviest * float(self.cost.max(initial=1)) > _LARGEST_PRODUCT:
            raise ValueError("worths and costs are too large to be multiplied: count them in larger units")

    def _check_columns(self) -> None:
        """Check shapes and kinds of numbers."""
        rows, slots = self.sees.row_count, self.sees.slot_count
        shapes = (("demand", rows), ("worth", rows), ("cost", slots), ("group", slots))
        for name, length in (*shapes, ("locked", slots), ("forbidden", slots)):
            if getattr(self, name).shape != (length,):
                raise ValueError(f"{name} has shape {getattr(self, name).shape} where {(length,)} is needed")
        for name in ("demand", "worth", "cost", "group", "capacity", "conflicts"):
            if not np.issubdtype(getattr(self, name).dtype, np.integer):
                raise ValueError(f"{name} must be whole numbers, not {getattr(self, name).dtype}")
        for name in ("locked", "forbidden"):
            if getattr(self, name).dtype != np.bool_:
                raise ValueError(f"{name} must be true or false for each slot, not {getattr(self, name).dtype}")
        pairs = self.conflicts
        if pairs.ndim != 2 or pairs.shape[1] != 2:
            raise ValueError(f"conflicts has shape {pairs.shape} where (pairs, 2) is needed")
        if len(pairs) and not (pairs.min() >= 0 and pairs.max() < slots):
            raise ValueError(f"conflicts name slots {pairs.min()} to {pairs.max()}, there are 0 to {slots - 1}")
        if (pairs[:, 0] == pairs[:, 1]).any():
            raise ValueError("a slot excludes itself; say that it is forbidden")

    @property
    def slot_count(self) -> int:
        """Number of slots."""
        return self.sees.slot_count

    @property
    def row_count(self) -> int:
        """Number of rows."""
        return self.sees.row_count

    def cost_of(self, chosen: BoolArray) -> int:
        """Return what the chosen slots cost, those that are there already aside."""
        return int(self.cost[chosen & ~self.locked].sum())

    def unmet(self, chosen: BoolArray) -> IntArray:
        """Return the rows that see fewer chosen slots than they demand."""
        return np.flatnonzero(self.sees.counts(chosen) < self.demand)

    def worth_of(self, chosen: BoolArray) -> int:
        """Return what the rows that are met are worth together."""
        return int(self.worth.sum() - self.worth[self.unmet(chosen)].sum())

    def hopeless(self) -> IntArray:
        """Return the rows that would stay unmet even if every slot that is not forbidden were chosen."""
        return self.unmet(~self.forbidden)

    def broken_rules(self, chosen: BoolArray) -> list[str]:
        """Return the rules between slots that a choice breaks, in words; what rows demand is not among them."""
        found = []
        if (chosen & self.forbidden).any():
            found.append(f"slot {int(np.flatnonzero(chosen & self.forbidden)[0])} is forbidden")
        if (self.locked & ~chosen).any():
            found.append(f"slot {int(np.flatnonzero(self.locked & ~chosen)[0])} is locked and left out")
        both = chosen[self.conflicts].all(axis=1) if len(self.conflicts) else np.zeros(0, dtype=np.bool_)
        if both.any():
            first, second = self.conflicts[int(np.flatnonzero(both)[0])]
            found.append(f"slots {first} and {second} exclude each other")
        load = np.bincount(self.group[chosen & (self.group >= 0)], minlength=len(self.capacity))
        if (load > self.capacity).any():
            full = int(np.flatnonzero(load > self.capacity)[0])
            found.append(f"group {full} has {load[full]} slots and takes {self.capacity[full]}")
        return found
