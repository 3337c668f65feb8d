"""Compiled search through the choices of a window; the plain twin is `surplus.plain_least_surplus`."""

from typing import Final

import numpy as np
from numba import njit

from layoutopt.identity import BoolArray, IntArray

NO: Final = 0
YES: Final = 1
OPEN: Final = 2


@njit(cache=True)
def meets_within(
    row_start: IntArray,
    row_slot: IntArray,
    slot_start: IntArray,
    slot_row: IntArray,
    demand: IntArray,
    limit: int,
    nodes: int,
) -> tuple[int, int]:
    """Return whether some choice meets every row with no more surplus than the limit, and the nodes left.

    Depth first: of the unmet rows the one that has fewest slots left goes next, and each of these is tried in
    turn. A slot that was tried is closed for the rest of its row, so that no choice comes twice. The answer is
    `OPEN` if the nodes do not suffice.
    """
    rows = len(row_start) - 1
    missing = demand.copy()
    closed = np.zeros(len(slot_start) - 1, np.bool_)
    # Of each slot: how many of its rows are met already.
    waste = np.zeros(len(closed), np.int64)
    unmet, longest, most = 0, 0, 0
    for row in range(rows):
        longest = max(longest, row_start[row + 1] - row_start[row])
        if missing[row] > 0:
            unmet += 1
            most += missing[row]
        else:
            for slot in row_slot[row_start[row] : row_start[row + 1]]:
                waste[slot] += 1
    candidate = np.empty((most + 1, longest), np.int64)
    count, tried, surplus = (
        np.zeros(most + 1, np.int64),
        np.zeros(most + 1, np.int64),
        np.zeros(most + 1, np.int64),
    )
    depth = 0
    while True:
        if unmet == 0:
            return YES, nodes
        if nodes == 0:
            return OPEN, 0
        nodes -= 1
        room = limit - surplus[depth]
        count[depth] = _scarcest(row_start, row_slot, missing, closed, waste, room, candidate[depth])
        tried[depth] = 0
        while tried[depth] == count[depth]:
            for slot in candidate[depth, : count[depth]]:
                closed[slot] = False
            depth -= 1
            if depth < 0:
                return NO, nodes
            # The slot goes, and stays closed until all others of its row were tried.
            slot = candidate[depth, tried[depth] - 1]
            for row in slot_row[slot_start[slot] : slot_start[slot + 1]]:
                if missing[row] == 0:
                    unmet += 1
                    for other in row_slot[row_start[row] : row_start[row + 1]]:
                        waste[other] -= 1
                missing[row] += 1
        slot = candidate[depth, tried[depth]]
        tried[depth] += 1
        closed[slot] = True
        surplus[depth + 1] = surplus[depth] + waste[slot]
        for row in slot_row[slot_start[slot] : slot_start[slot + 1]]:
            missing[row] -= 1
            if missing[row] == 0:
                unmet -= 1
                for other in row_slot[row_start[row] : row_start[row + 1]]:
                    waste[other] += 1
        depth += 1


@njit(cache=True)
def _scarcest(
    row_start: IntArray,
    row_slot: IntArray,
    missing: IntArray,
    closed: BoolArray,
    waste: IntArray,
    room: int,
    candidate: IntArray,
) -> int:
    """Write down the slots that may still serve the unmet row with fewest of them; return how many there are."""
    fewest, chosen = len(candidate) + 1, -1
    for row in range(len(missing)):
        if missing[row] <= 0:
            continue
        left = 0
        for slot in row_slot[row_start[row] : row_start[row + 1]]:
            if not closed[slot] and waste[slot] <= room:
                left += 1
        if left < fewest:
            fewest, chosen = left, row
        if left < missing[row]:
            return 0
    number = 0
    for slot in row_slot[row_start[chosen] : row_start[chosen + 1]]:
        if not closed[slot] and waste[slot] <= room:
            candidate[number] = slot
            number += 1
    return number
