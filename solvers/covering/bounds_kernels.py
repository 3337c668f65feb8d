"""Compiled subgradient ascent for covers; the plain truth of its values is `bounds.cost_value`."""

from numba import njit

from layoutopt.identity import FloatArray, IntArray
from solvers.covering.bounds import DEFLECTION


@njit(cache=True)
def ascend(
    slot_start: IntArray,
    slot_row: IntArray,
    weight: FloatArray,
    least: FloatArray,
    cost: FloatArray,
    price: FloatArray,
    direction: FloatArray,
    best: FloatArray,
    best_value: float,
    incumbent: float,
    step: float,
    ratio: float,
    iterations: int,
) -> float:
    """Go on with the ascent in place of ``price``, ``direction`` and ``best``; return the best value.

    ``slot_row`` and ``weight`` are the rows of each slot, cuts among them, and how much it counts there.
    """
    rows = len(price)
    slope = least.copy()
    for _ in range(iterations):
        value = 0.0
        for row in range(rows):
            value += price[row] * least[row]
            slope[row] = least[row]
        for slot in range(len(cost)):
            left = cost[slot]
            for place in range(slot_start[slot], slot_start[slot + 1]):
                left -= weight[place] * price[slot_row[place]]
            if left < 0.0:
                value += left
                for place in range(slot_start[slot], slot_start[slot + 1]):
                    slope[slot_row[place]] -= weight[place]
        if value > best_value:
            best_value = value
            best[:] = price
        squared = 0.0
        for row in range(rows):
            direction[row] = DEFLECTION * slope[row] + (1.0 - DEFLECTION) * direction[row]
            squared += direction[row] * direction[row]
        if squared == 0.0:
            break
        length = step * max(incumbent - value, 0.0) / squared
        for row in range(rows):
            price[row] = max(0.0, price[row] + length * direction[row])
        step *= ratio
    return best_value
