"""Compiled local search for covers; the plain twin, its truth, is `plain_search.PlainSearch`.

Every number is whole, so the two agree to the last bit whatever the order of sums.
"""

from heapq import heapify, heappop, heappush
from typing import Final, NamedTuple

from numba import njit

from layoutopt.identity import BoolArray, IntArray
from solvers.covering.plain_search import INCREMENT, LOW_BITS, MULTIPLIER, NO_BUDGET, WORD

CHOSEN, UNMET, COST, WORTH, STEP, TABU, BEST_COST, BEST_WORTH = range(8)
"""Places of the single numbers in ``SearchState.numbers``: how many slots are chosen and rows unmet, what they
cost and what the met ones are worth, steps done, the slot that must not go next, and the best so far."""
NUMBERS: Final = 8
_compiled = njit(cache=True)


class Table(NamedTuple):
    """A covering problem in columns: rows, slots, rivals of slots (which exclude each other), groups."""

    row_start: IntArray
    row_slot: IntArray
    slot_start: IntArray
    slot_row: IntArray
    demand: IntArray
    cost: IntArray
    worth: IntArray
    rival_start: IntArray
    rival: IntArray
    group: IntArray
    capacity: IntArray


class SearchState(NamedTuple):
    """All that a search knows between two steps.

    ``weight`` of rows grows while they are unmet, by one, or with a budget by what they are worth. ``score`` of a
    slot is the weight of the rows that it would help if it were chosen, or that would lack it if it went.
    ``changed`` says whether something near a slot changed since it went. Lists hold the chosen slots and the unmet
    rows, with the place of each in them.
    """

    chosen: BoolArray
    best: BoolArray
    seen: IntArray
    weight: IntArray
    score: IntArray
    stamp: IntArray
    changed: BoolArray
    load: IntArray
    chosen_list: IntArray
    chosen_place: IntArray
    unmet_list: IntArray
    unmet_place: IntArray
    numbers: IntArray


@_compiled
def search(table: Table, state: SearchState, budget: int, draws: IntArray) -> None:
    """Go on with the search, one step for each draw.

    Without a budget (`NO_BUDGET`) it looks for a cheaper cover than the best so far, else for a choice within the
    budget whose met rows are worth more.
    """
    numbers = state.numbers
    for first in draws:
        word = first
        numbers[STEP] += 1
        if budget == NO_BUDGET:
            while numbers[UNMET] == 0 and numbers[CHOSEN] > 0:
                drop(table, state, least_loss(table, state, -1, -1))
                keep_better(state, budget)
        if numbers[UNMET] == 0:
            return
        if numbers[CHOSEN] > 0:
            slot = least_loss(table, state, -1, numbers[TABU])
            if slot >= 0:
                drop(table, state, slot)
        limit = numbers[BEST_COST] - 1 if budget == NO_BUDGET else budget
        pushes = True
        while numbers[UNMET] > 0:
            row = state.unmet_list[(word >> LOW_BITS) % numbers[UNMET]]
            word = (word * MULTIPLIER + INCREMENT) & WORD
            slot, pushed = best_gain(table, state, row, limit, pushes)
            if slot < 0:
                break
            if pushed:
                pushes = False
                _push_out(table, state, slot)
            add(table, state, slot)
            numbers[TABU] = slot
        keep_better(state, budget)
        for place in range(numbers[UNMET]):
            row = state.unmet_list[place]
            grown = 1 if budget == NO_BUDGET else table.worth[row]
            state.weight[row] += grown
            for slot in table.row_slot[table.row_start[row] : table.row_start[row + 1]]:
                state.score[slot] += grown


@_compiled
def keep_better(state: SearchState, budget: int) -> None:
    """Remember the present choice if it beats the best: a cheaper cover, or with a budget one of more worth."""
    numbers = state.numbers
    if budget == NO_BUDGET:
        better = numbers[UNMET] == 0 and numbers[COST] < numbers[BEST_COST]
    else:
        better = numbers[WORTH] > numbers[BEST_WORTH]
    if better:
        numbers[BEST_COST], numbers[BEST_WORTH] = numbers[COST], numbers[WORTH]
        state.best[:] = state.chosen


@_compiled
def fill(table: Table, state: SearchState, budget: int) -> None:
    """Add slot after slot, the one that helps most for its cost first, as far as rules and budget allow.

    What a slot helps only shrinks as others come, so a slot whose old value is still its own is the best of all
    (Minoux, "Accelerated greedy algorithms for maximizing submodular set functions", 1978).
    """
    queue = [(0.0, -1)]
    for slot in range(len(table.cost)):
        if not state.chosen[slot] and state.score[slot] > 0:
            queue.append((-state.score[slot] / table.cost[slot], slot))
    heapify(queue)
    while state.numbers[UNMET] > 0 and len(queue) > 1:
        old, slot = heappop(queue)
        if slot < 0:
            return
        value = -state.score[slot] / table.cost[slot]
        if value > old:
            if value < 0.0:
                heappush(queue, (value, slot))
        elif free(table, state, slot) and (
            budget == NO_BUDGET or state.numbers[COST] + table.cost[slot] <= budget
        ):
            add(table, state, slot)


@_compiled
def free(table: Table, state: SearchState, slot: int) -> bool:
    """Return whether a slot could be chosen without pushing another out."""
    group = table.group[slot]
    if group >= 0 and state.load[group] >= table.capacity[group]:
        return False
    for other in table.rival[table.rival_start[slot] : table.rival_start[slot + 1]]:
        if state.chosen[other]:
            return False
    return True


@_compiled
def least_loss(table: Table, state: SearchState, group: int, tabu: int) -> int:
    """Return the chosen slot, of a group or of all (-1), that loses least for its cost; -1 if there is none."""
    found = -1
    for slot in state.chosen_list[: state.numbers[CHOSEN]]:
        if slot == tabu or (group >= 0 and table.group[slot] != group):
            continue
        if found < 0 or _loses_less(table, state, slot, found):
            found = slot
    return found


@_compiled
def _loses_less(table: Table, state: SearchState, slot: int, other: int) -> bool:
    """Return whether a chosen slot loses less for its cost than another; of equals the oldest, then the first."""
    less = state.score[slot] * table.cost[other] - state.score[other] * table.cost[slot]
    if less != 0:
        return bool(less < 0)
    if state.stamp[slot] != state.stamp[other]:
        return bool(state.stamp[slot] < state.stamp[other])
    return slot < other


@_compiled
def best_gain(table: Table, state: SearchState, row: int, limit: int, pushes: bool) -> tuple[int, bool]:
    """Return the slot to add for a row, -1 if there is none, and whether others must be pushed out for it.

    First choice are slots that push nothing out and near which something changed since they went, then others that
    push nothing out, then, if ``pushes``, the rest.
    """
    for level in range(3 if pushes else 2):
        found, gain = -1, 0
        for slot in table.row_slot[table.row_start[row] : table.row_start[row + 1]]:
            if state.chosen[slot] or (level == 0 and not state.changed[slot]):
                continue
            lost, freed = 0, 0
            if table.group[slot] >= 0 or table.rival_start[slot] < table.rival_start[slot + 1]:
                lost, freed = _pushed(table, state, slot)
            if (level < 2 and freed > 0) or state.numbers[COST] - freed + table.cost[slot] > limit:
                continue
            own = state.score[slot] - lost
            if found >= 0:
                more = own * table.cost[found] - gain * table.cost[slot]
                if more < 0 or (more == 0 and state.stamp[slot] >= state.stamp[found]):
                    continue
            found, gain = slot, own
        if found >= 0:
            return found, level == 2
    return -1, False


@_compiled
def _pushed(table: Table, state: SearchState, slot: int) -> tuple[int, int]:
    """Return score and cost of what would have to go for a slot."""
    lost, freed = 0, 0
    group = table.group[slot]
    room = group < 0 or state.load[group] < table.capacity[group]
    for other in table.rival[table.rival_start[slot] : table.rival_start[slot + 1]]:
        if state.chosen[other]:
            lost += state.score[other]
            freed += table.cost[other]
            room = room or table.group[other] == group
    if not room:
        other = least_loss(table, state, group, -1)
        lost += state.score[other]
        freed += table.cost[other]
    return lost, freed


@_compiled
def _push_out(table: Table, state: SearchState, slot: int) -> None:
    """Let go what cannot stay beside a slot."""
    for other in table.rival[table.rival_start[slot] : table.rival_start[slot + 1]]:
        if state.chosen[other]:
            drop(table, state, other)
    group = table.group[slot]
    if group >= 0 and state.load[group] >= table.capacity[group]:
        drop(table, state, least_loss(table, state, group, -1))


@_compiled
def add(table: Table, state: SearchState, slot: int) -> None:
    """Choose a slot and bring all scores up to date."""
    numbers = state.numbers
    state.chosen[slot] = True
    state.chosen_place[slot] = numbers[CHOSEN]
    state.chosen_list[numbers[CHOSEN]] = slot
    numbers[CHOSEN] += 1
    numbers[COST] += table.cost[slot]
    state.stamp[slot] = numbers[STEP]
    if table.group[slot] >= 0:
        state.load[table.group[slot]] += 1
    for row in table.slot_row[table.slot_start[slot] : table.slot_start[slot + 1]]:
        state.seen[row] += 1
        surplus = state.seen[row] - table.demand[row]
        if surplus == 0:
            numbers[UNMET] -= 1
            numbers[WORTH] += table.worth[row]
            last = state.unmet_list[numbers[UNMET]]
            state.unmet_list[state.unmet_place[row]] = last
            state.unmet_place[last] = state.unmet_place[row]
        if surplus == 0 or surplus == 1:
            # Met now: no other slot helps it. Met with one to spare: no chosen one is needed for it alone.
            for place in range(table.row_start[row], table.row_start[row + 1]):
                other = table.row_slot[place]
                if other != slot and state.chosen[other] == (surplus == 1):
                    state.score[other] -= state.weight[row]
                    state.changed[other] = True


@_compiled
def drop(table: Table, state: SearchState, slot: int) -> None:
    """Let a chosen slot go and bring all scores up to date."""
    numbers = state.numbers
    state.chosen[slot] = False
    numbers[CHOSEN] -= 1
    last = state.chosen_list[numbers[CHOSEN]]
    state.chosen_list[state.chosen_place[slot]] = last
    state.chosen_place[last] = state.chosen_place[slot]
    numbers[COST] -= table.cost[slot]
    state.stamp[slot] = numbers[STEP]
    state.changed[slot] = False
    if table.group[slot] >= 0:
        state.load[table.group[slot]] -= 1
    for row in table.slot_row[table.slot_start[slot] : table.slot_start[slot + 1]]:
        state.seen[row] -= 1
        surplus = state.seen[row] - table.demand[row]
        if surplus == -1:
            state.unmet_place[row] = numbers[UNMET]
            state.unmet_list[numbers[UNMET]] = row
            numbers[UNMET] += 1
            numbers[WORTH] -= table.worth[row]
        if surplus == 0 or surplus == -1:
            for place in range(table.row_start[row], table.row_start[row + 1]):
                other = table.row_slot[place]
                if other != slot and state.chosen[other] == (surplus == 0):
                    state.score[other] += state.weight[row]
                    state.changed[other] = True
