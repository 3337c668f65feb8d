"""How good a front is and what a step along it costs: hypervolume, epsilon indicator and exchange rates.

All goals are minimised. A reference point is a point that every member of interest beats in every goal. There is
no natural one, and two hypervolumes compare only if reference and scale are the same, so a report states both. The
convention here is the nadir of the front, its worst value in each goal, times `REFERENCE_MARGIN`: at the nadir
itself the ends of the front would count for nothing (Ishibuchi et al., Evolutionary Computation 26(3), 2018).

Cost and error are judged by ratios, and their ranges span a decade or more. On the plain scale the largest error
of the cheapest layout decides nearly all of the volume. On the logarithmic one halving the error counts the same
everywhere, so that is the scale for fronts of cost and error.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass
from itertools import pairwise
from typing import Final

import numpy as np

from layoutopt.identity import FloatArray
from layoutopt.result import Evaluated, Front
from layoutopt.scores import Score
from solvers.front import non_dominated

REFERENCE_MARGIN: Final = 1.1
"""The reference lies a tenth beyond the worst of the front, so that its ends have a share in the volume."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ExchangeRate:
    """What accuracy costs between two layouts, the second of which costs more.

    Attributes
    ----------
    extra_cost
        Exact first goal of the dearer layout less that of the cheaper one.
    gain
        Second goal of the cheaper layout less that of the dearer one, with its standard error.
    rate, low, high
        Extra cost for one unit of the second goal, and the 95 % interval. Not significant: ``high`` is infinite,
        as far as the trials tell the extra money may buy nothing. Without a gain in the mean the rate is infinite
        too; ``low`` is infinite where it is shown that the dearer layout is no better.
    """

    cheaper: Evaluated
    dearer: Evaluated
    extra_cost: float
    gain: Score
    rate: float
    low: float
    high: float

    @property
    def significant(self) -> bool:
        """Whether the dearer layout is better by more than chance explains, at 95 %."""
        return math.isfinite(self.high)


def hypervolume(goals: FloatArray, reference: FloatArray, *, logarithmic: bool = False) -> float:
    """Return the volume that the points dominate within the reference point.

    Parameters
    ----------
    goals
        Points, smaller is better, shape (n, goals). Those that do not beat the reference in every goal add
        nothing.
    reference
        Shape (goals,).
    logarithmic
        Whether to measure in natural logarithms of all goals, so that ratios count and units drop out.

    Notes
    -----
    Exact: a sweep for two goals, for more the slices of While et al. (IEEE Trans. Evol. Comput. 10(1), 2006),
    whose effort grows with the power of the number of goals. Meant for up to some hundred points and five goals.

    Raises
    ------
    ValueError
        If shapes do not fit, a number is NaN, or a logarithm is asked of a number that is not positive.
    """
    goals, reference = np.asarray(goals, dtype=np.float64), np.asarray(reference, dtype=np.float64)
    if goals.ndim != 2 or reference.ndim != 1 or goals.shape[1] != len(reference) or not len(reference):
        raise ValueError(f"points of shape {goals.shape} do not fit a reference of shape {reference.shape}")
    if np.isnan(goals).any() or np.isnan(reference).any():
        raise ValueError("a hypervolume needs numbers in every goal and in the reference")
    if logarithmic:
        if (goals <= 0.0).any() or (reference <= 0.0).any():
            raise ValueError("the logarithmic scale needs goals and a reference that are positive")
        goals, reference = np.log(goals), np.log(reference)
    return _volume(goals[(goals < reference).all(axis=1)], reference)


def hypervolumes(costs: FloatArray, errors: FloatArray, reference: FloatArray) -> FloatArray:
    """Return the hypervolume of each of many draws of the errors of the same layouts, shape (draws,).

    It says how far the hypervolume of a front is off because its errors are means over trials. Plain scale: give
    logarithms for the logarithmic one.

    Parameters
    ----------
    costs
        Shape (layouts,).
    errors
        Shape (draws, layouts).
    reference
        Shape (2,).
    """
    order = np.argsort(costs, kind="stable")
    order = order[costs[order] < reference[0]]
    widths = np.append(costs[order][1:], reference[0]) - costs[order]
    # What a budget buys is the least error up to it, and never less than nothing.
    least = np.minimum.accumulate(np.minimum(errors[:, order], reference[1]), axis=1)
    return np.asarray((reference[1] - least) @ widths)


def reference_point(goals: FloatArray) -> FloatArray:
    """Return the reference by the convention of this module: the worst of each goal and a tenth more.

    Raises
    ------
    ValueError
        If there is no point, or a worst value is not positive: a tenth beyond it would lie on the wrong side.
    """
    goals = np.asarray(goals, dtype=np.float64)
    if goals.ndim != 2 or not len(goals):
        raise ValueError("a reference point needs at least one point of the front")
    worst = goals.max(axis=0)
    if not (worst > 0.0).all():
        raise ValueError("the convention for a reference point needs positive goals; state a point of your own")
    return np.asarray(worst * REFERENCE_MARGIN)


def additive_epsilon(goals: FloatArray, target: FloatArray) -> float:
    """Return the least amount by which all points have to improve in every goal to match each point of ``target``.

    Zero or less: every target is matched. Of logarithms of goals it is the logarithm of the factor (Zitzler et
    al., IEEE Trans. Evol. Comput. 7(2), 2003, eq. 9).

    Raises
    ------
    ValueError
        If one of both is empty or they differ in the number of goals.
    """
    goals, target = np.asarray(goals, dtype=np.float64), np.asarray(target, dtype=np.float64)
    if goals.ndim != 2 or target.ndim != 2 or not len(goals) or not len(target):
        raise ValueError("an epsilon indicator needs points on both sides")
    if goals.shape[1] != target.shape[1]:
        raise ValueError(f"points of {goals.shape[1]} goals cannot match points of {target.shape[1]}")
    short = (goals[None, :, :] - target[:, None, :]).max(axis=2)
    return float(short.min(axis=1).max())


def exchange_rate(cheaper: Evaluated, dearer: Evaluated, goals: tuple[str, ...], gain: Score) -> ExchangeRate:
    """Return what the gain costs from one layout to a dearer one.

    The extra cost is exact, so the interval of the rate follows from that of the gain: it is Fieller's interval of
    a ratio with a certain numerator (Fieller, J. R. Statist. Soc. B 16, 1954).

    Raises
    ------
    ValueError
        If the second layout does not cost more.
    """
    extra = dearer.scores[goals[0]].value - cheaper.scores[goals[0]].value
    if not extra > 0.0:
        raise ValueError(f"an exchange rate needs a dearer layout, not one that costs {extra:+.2f} more")
    least, most = gain.interval()
    return ExchangeRate(
        cheaper=cheaper,
        dearer=dearer,
        extra_cost=extra,
        gain=gain,
        rate=_price(extra, gain.value),
        low=_price(extra, most),
        high=_price(extra, least),
    )


def exchange_rates(
    front: Front, gain: Callable[[Evaluated, Evaluated], Score] | None = None
) -> tuple[ExchangeRate, ...]:
    """Return the exchange rate of every two neighbours of a two-goal front, by rising cost.

    Parameters
    ----------
    gain
        Gives for a member and its dearer neighbour by how much the second goal falls, paired over common
        replications. Without it the two scores are taken for independent, which is cautious on common drives.

    Raises
    ------
    ValueError
        If the front has not two goals.
    """
    if len(front.goals) != 2:
        raise ValueError("exchange rates need a front of two goals")
    measure = gain if gain is not None else lambda left, right: independent_gain(left, right, front.goals[1])
    return tuple(
        exchange_rate(left, right, front.goals, measure(left, right)) for left, right in pairwise(front.members)
    )


def independent_gain(cheaper: Evaluated, dearer: Evaluated, goal: str) -> Score:
    """Return by how much the goal falls, as the difference of two independent scores.

    The count is that of the score with fewer trials, so that its Student interval is not too narrow.
    """
    first, second = cheaper.scores[goal], dearer.scores[goal]
    counts = [score.count for score in (first, second) if not score.exact]
    return Score(
        value=first.value - second.value,
        unit=first.unit,
        standard_error=math.hypot(first.standard_error, second.standard_error),
        count=min(counts, default=0),
    )


def _price(extra: float, gain: float) -> float:
    return extra / gain if gain > 0.0 else math.inf


def _volume(points: FloatArray, reference: FloatArray) -> float:
    """Return the volume of points that all lie strictly within the reference."""
    if not len(points):
        return 0.0
    if len(reference) == 1:
        return float(reference[0] - points[:, 0].min())
    points = points[non_dominated(points)]
    if len(reference) == 2:
        widths = np.append(points[1:, 0], reference[0]) - points[:, 0]
        return float(widths @ (reference[1] - points[:, 1]))
    # Between two values of the first goal the same points are in; their slice has one goal less.
    ends = np.append(points[1:, 0], reference[0])
    return math.fsum(
        (end - start) * _volume(points[: row + 1, 1:], reference[1:])
        for row, (start, end) in enumerate(zip(points[:, 0], ends, strict=True))
        if end > start
    )
