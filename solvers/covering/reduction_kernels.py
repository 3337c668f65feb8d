"""Compiled search for rows that other rows imply; the plain twin is `reduction.plain_implied`."""

import numpy as np
from numba import njit

from layoutopt.identity import BoolArray, IntArray


@njit(cache=True)
def implied(
    row_start: IntArray, row_slot: IntArray, slot_start: IntArray, slot_row: IntArray, demand: IntArray
) -> BoolArray:
    """Return for each row whether another row's slots are a true subset of its own and demand as much or more."""
    rows = len(row_start) - 1
    out = np.zeros(rows, np.bool_)
    for row in range(rows):
        first, last = row_start[row], row_start[row + 1]
        if first == last:
            continue
        # Whoever contains the row contains its slot that fewest rows see.
        rarest = row_slot[first]
        for place in range(first + 1, last):
            slot = row_slot[place]
            if slot_start[slot + 1] - slot_start[slot] < slot_start[rarest + 1] - slot_start[rarest]:
                rarest = slot
        for other in slot_row[slot_start[rarest] : slot_start[rarest + 1]]:
            begin, end = row_start[other], row_start[other + 1]
            if out[other] or end - begin <= last - first or demand[other] > demand[row]:
                continue
            place = begin
            contained = True
            for own in range(first, last):
                while place < end and row_slot[place] < row_slot[own]:
                    place += 1
                if place == end or row_slot[place] != row_slot[own]:
                    contained = False
                    break
            if contained:
                out[other] = True
    return out
