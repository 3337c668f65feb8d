"""Rows on their own: whether the rules between slots leave room for what one row demands."""

from typing import Final

import numpy as np

from layoutopt.identity import BoolArray, IntArray
from solvers.covering.problem import CoverProblem

_TRIES: Final = 2000
"""Partial choices that are looked at for one row before its question stays open."""


def unmeetable(problem: CoverProblem, usable: BoolArray, demand: IntArray, room: IntArray) -> BoolArray:
    """Return which rows cannot get what they demand from usable slots, whatever the other rows get, shape (rows,).

    It is proven for each of these. A row for which thousands of partial choices decide nothing is not among them.

    Parameters
    ----------
    usable
        Slots that may be chosen, shape (slots,).
    demand, room
        What rows still demand and groups still take.
    """
    found = problem.sees.counts(usable) < demand
    doubtful = ~found & (demand > 1)
    if not doubtful.any() or not (len(problem.conflicts) or (problem.group >= 0).any()):
        return found
    rivals: dict[int, set[int]] = {}
    for one, other in problem.conflicts.tolist():
        rivals.setdefault(one, set()).add(other)
        rivals.setdefault(other, set()).add(one)
    group = problem.group.tolist()
    # What one choice gives to all rows at once is shown to be possible for each of them.
    doubtful &= problem.sees.counts(_crowded(np.flatnonzero(usable).tolist(), rivals, group, room)) < demand
    known: dict[tuple[bytes, int], bool] = {}
    for row in np.flatnonzero(doubtful).tolist():
        slots = problem.sees.slot[problem.sees.start[row] : problem.sees.start[row + 1]]
        slots = slots[usable[slots]]
        name = (slots.tobytes(), int(demand[row]))
        if name not in known:
            known[name] = _fit(slots.tolist(), int(demand[row]), rivals, group, room)
        found[row] = not known[name]
    return found


def _crowded(slots: list[int], rivals: dict[int, set[int]], group: list[int], room: IntArray) -> BoolArray:
    """Return a choice to which no slot can be added."""
    chosen = np.zeros(len(group), dtype=np.bool_)
    left = room.tolist()
    for slot in slots:
        if (group[slot] < 0 or left[group[slot]] > 0) and not any(chosen[other] for other in rivals.get(slot, ())):
            chosen[slot] = True
            if group[slot] >= 0:
                left[group[slot]] -= 1
    return chosen


def _fit(slots: list[int], count: int, rivals: dict[int, set[int]], group: list[int], room: IntArray) -> bool:
    """Return whether so many of the slots can be chosen together; true as well where that stays open."""
    inside = set(slots)
    # Slots that exclude few others come first: then the first choice that is tried is nearly always large enough.
    slots = sorted(slots, key=lambda slot: (len(rivals.get(slot, set()) & inside), slot))
    open_choices = [(slots, count, room.tolist())]
    for _ in range(_TRIES):
        if not open_choices:
            return False
        left, missing, free = open_choices.pop()
        if missing == 0:
            return True
        if _at_most(left, rivals, group, free) < missing:
            continue
        first, rest = left[0], left[1:]
        open_choices.append((rest, missing, free))
        if group[first] >= 0:
            free = free.copy()
            free[group[first]] -= 1
        excluded = rivals.get(first, set())
        beside = [slot for slot in rest if slot not in excluded and (group[slot] < 0 or free[group[slot]] > 0)]
        open_choices.append((beside, missing - 1, free))
    return True


def _at_most(slots: list[int], rivals: dict[int, set[int]], group: list[int], room: list[int]) -> int:
    """Return a number that no choice among slots exceeds: one for each clique of rivals, or what groups take."""
    cliques: list[set[int]] = []
    members: dict[int, int] = {}
    for slot in slots:
        excluded = rivals.get(slot, set())
        home = next((clique for clique in cliques if clique <= excluded), None)
        if home is None:
            cliques.append({slot})
        else:
            home.add(slot)
        members[group[slot]] = members.get(group[slot], 0) + 1
    fit = sum(count if number < 0 else min(count, room[number]) for number, count in members.items())
    return min(len(cliques), fit)
