"""Non-dominated layouts, and the knee of a front."""

from collections.abc import Sequence

import numpy as np

from layoutopt.identity import FloatArray, IntArray
from layoutopt.result import Evaluated, Front


def non_dominated(goals: FloatArray) -> IntArray:
    """Return the rows of ``goals``, shape (n, goals), smaller is better, that no other row dominates.

    A row dominates another if it is nowhere worse and somewhere better. Of equal rows the first stays. Rows
    come back sorted by the first goal. Rows with NaN are never part of a front.
    """
    goals = np.asarray(goals, dtype=np.float64)
    rows = np.flatnonzero(~np.isnan(goals).any(axis=1))
    kept: list[int] = []
    for row in rows[np.lexsort(goals[rows].T[::-1])]:
        # In lexicographic order a row can be dominated, or equalled, only by one that comes before it.
        if not any((goals[other] <= goals[row]).all() for other in kept):
            kept.append(int(row))
    return np.array(kept, dtype=np.int64)


def front_of(candidates: Sequence[Evaluated], goals: tuple[str, ...]) -> Front:
    """Return the front of layouts by the values of the scores named in ``goals``."""
    values = np.array([[candidate.scores[goal].value for goal in goals] for candidate in candidates])
    rows = non_dominated(values.reshape(len(candidates), len(goals)))
    return Front(goals=goals, members=tuple(candidates[row] for row in rows))


def knee(front: Front) -> Evaluated:
    """Return the member of a two-goal front farthest below the straight line between its ends.

    Both goals are taken on a logarithmic scale from end to end, because cost and error are judged by ratios
    (the chord rule of Das, Structural Optimization 18, 1999); a goal that has no logarithm, because a member's is
    zero or less, on the plain one. Members with an infinite goal are no ends and no knee. With fewer than three
    others it is the first of these.

    Raises
    ------
    ValueError
        If the front is empty or has not two goals.
    """
    if not front.members or len(front.goals) != 2:
        raise ValueError("a knee needs a front of two goals with at least one member")
    goals = np.array([[member.scores[goal].value for goal in front.goals] for member in front.members])
    finite = np.isfinite(goals).all(axis=1)
    members = [member for member, known in zip(front.members, finite, strict=True) if known]
    if len(members) < 3:
        return members[0] if members else front.members[0]
    values = goals[finite]
    logarithmic = (values > 0.0).all(axis=0)
    values[:, logarithmic] = np.log(values[:, logarithmic])
    span = values[-1] - values[0]
    if (span == 0.0).any():
        return members[0]
    scaled = (values - values[0]) / span
    # Cost runs from 0 to 1 and error too (its span is negative), so the chord is y = x and better is y > x.
    return members[int(np.argmax(scaled[:, 1] - scaled[:, 0]))]
