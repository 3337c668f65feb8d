"""The cheapest pattern for each zone, by predicted outcomes: exact for the model, whatever the number of zones."""

import heapq
import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from layoutopt.identity import FloatArray
from layoutopt.problem import Limit
from layoutopt.scores import Score

MOST_NODES: Final = 5_000
"""Partial compositions gone into, about a millisecond each; three zones of ten patterns took 91 at most."""
_ROUNDING: Final = 1e-9
"""Relative: sums in another order must not lose a composition that meets a limit to the last bit."""
_DIRECTIONS: Final = 4
"""Relaxations solved one after the other, each with the direction of the last; any number gives valid bounds."""
_UNBOUNDED: Final = 1e6
"""So many limits below zero stands for a bound that does not exist, because a linear program takes no infinity."""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ZoneChoices:
    """What may lie on each slot of the floor under one reader group, and what it would do.

    Attributes
    ----------
    base_eur
        What the layout costs without any tag.
    costs_eur
        For each slot what the tags of each option cost, shape (options,): an estimate, because spares are whole
        pieces and tags near a border give way.
    terms
        For each slot what each option adds to each limited score on each drive, shape (options, limits, drives),
        as `solvers.zone_terms.zone_terms` makes them; the drives are common to all.
    """

    base_eur: float
    costs_eur: tuple[FloatArray, ...]
    terms: tuple[FloatArray, ...]

    def __post_init__(self) -> None:
        """Check that the arrays fit each other.

        Raises
        ------
        ValueError
            If a slot has no option, or costs and terms are not of the same options and drives.
        """
        shapes = {terms.shape[1:] for terms in self.terms}
        counts = [len(terms) for terms in self.terms]
        if not counts or min(counts) == 0 or len(shapes) > 1 or counts != [len(one) for one in self.costs_eur]:
            raise ValueError("every slot needs options, each with a cost and with terms of the same drives")


@dataclass(frozen=True, slots=True, kw_only=True)
class Composition:
    """One option for each slot; cost and scores are predicted, the scores in the order of the limits."""

    options: tuple[int, ...]
    cost_eur: float
    scores: tuple[Score, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Cheapest:
    """What a search for compositions found.

    Attributes
    ----------
    compositions
        By rising cost, then options.
    rest_eur
        No other composition that meets the limits by the prediction costs less; infinite if there is none.
    cut
        Whether the search ended because it had gone into as many partial compositions as it may, and not because
        it had what was wanted.
    """

    compositions: tuple[Composition, ...]
    rest_eur: float
    cut: bool


def composition(choices: ZoneChoices, options: Sequence[int]) -> Composition:
    """Return what is predicted of one option for each slot."""
    parts = [terms[option] for terms, option in zip(choices.terms, options, strict=True)]
    costs = (costs[option] for costs, option in zip(choices.costs_eur, options, strict=True))
    return Composition(
        options=tuple(options),
        cost_eur=choices.base_eur + float(sum(costs)),
        scores=tuple(_score(values) for values in np.sum(parts, axis=0)),
    )


def cheapest(
    choices: ZoneChoices,
    limits: Sequence[Limit],
    *,
    count: int,
    shown: bool = True,
    most_eur: float = math.inf,
    most_nodes: int = MOST_NODES,
) -> Cheapest:
    """Return the cheapest compositions that meet the limits by the prediction, with what is proven of the rest.

    Parameters
    ----------
    limits
        One for each row of the terms.
    count
        How many are wanted.
    shown
        True: the confidence bound of each score must meet its limit. False: it is enough that the opposite bound
        does not break it, which is for a first look on few drives.
    most_eur
        Compositions that cost more are not looked for.
    most_nodes
        Partial compositions that are gone into, at most.

    Notes
    -----
    Best-first branch and bound (Land and Doig, Econometrica 28, 1960) over the slots, one after the other. A
    partial composition costs no less than what is laid plus the cheapest rest, and no less than its Lagrangian
    bound (Fisher, Management Science 27, 1981) with the multipliers of the linear relaxation. It is dropped where
    even the smallest rest breaks a limit. Bounds of sums are no sums of bounds. The half width of a sum is a
    multiple of the length of its deviations over the drives, and no less than their part along any direction
    (Cauchy and Schwarz), which can be summed; the direction is that of the relaxation's own solution. Where
    ``shown`` is false, half widths are subtracted: that of a sum is no larger than the sum of theirs.
    Since the cheapest bound is always gone into first, the bound of the next one holds for all that is left.
    """
    costs, ends = choices.costs_eur, _signs(limits) * np.array([limit.end for limit in limits])
    relaxation = _relaxation(choices, limits, ends, shown=shown)
    if relaxation is None:
        return Cheapest(compositions=(), rest_eur=math.inf, cut=False)
    least, multipliers = relaxation
    room = ends + _ROUNDING * np.abs(ends)
    priced = [_priced(cost, values, multipliers) for cost, values in zip(costs, least, strict=True)]
    rest_least = _tails([values.min(axis=0) for values in least], np.zeros(len(ends)))
    rest_cost = _tails([cost.min(keepdims=True) for cost in costs], np.zeros(1))
    rest_priced = _tails([value.min(keepdims=True) for value in priced], np.zeros(1))
    paid = float(multipliers @ ends)
    queue: list[tuple[float, tuple[int, ...]]] = [(0.0, ())]
    found: list[Composition] = []
    nodes = 0
    while queue and len(found) < count and nodes < most_nodes and choices.base_eur + queue[0][0] <= most_eur:
        _, options = heapq.heappop(queue)
        slot = len(options)
        if slot == len(costs):
            found.append(composition(choices, options))
            continue
        nodes += 1
        laid_least = np.sum([least[number][option] for number, option in enumerate(options)], axis=0)
        laid_cost = sum(costs[number][option] for number, option in enumerate(options))
        laid_priced = sum(priced[number][option] for number, option in enumerate(options))
        fits = (laid_least + least[slot] + rest_least[slot + 1] <= room).all(axis=1)
        for option in np.flatnonzero(fits).tolist():
            chosen = (*options, option)
            cost = laid_cost + costs[slot][option]
            if slot + 1 == len(costs):
                if _meets(composition(choices, chosen).scores, limits, shown=shown):
                    heapq.heappush(queue, (float(cost), chosen))
                continue
            relaxed = laid_priced + priced[slot][option] + rest_priced[slot + 1][0] - paid
            bound = max(cost + rest_cost[slot + 1][0], relaxed - _ROUNDING * (1.0 + abs(relaxed)))
            heapq.heappush(queue, (float(bound), chosen))
    rest_eur = choices.base_eur + queue[0][0] if queue else math.inf
    cut = bool(queue) and len(found) < count and rest_eur <= most_eur
    return Cheapest(compositions=tuple(found), rest_eur=rest_eur, cut=cut)


def most_accurate(choices: ZoneChoices, limits: Sequence[Limit]) -> Composition:
    """Return the composition whose every slot adds least to the limited scores, each over its limit, on average.

    It is what to try where nothing is predicted to meet the limits; of equals the cheaper one is taken.
    """
    signs = _signs(limits)
    weights = signs / np.array([max(abs(limit.end), 1e-12) for limit in limits])
    options = []
    for costs, terms in zip(choices.costs_eur, choices.terms, strict=True):
        added = np.nan_to_num(_means(terms)) @ weights
        options.append(int(np.lexsort((costs, np.round(added, 12)))[0]))
    return composition(choices, options)


def worst_predicted(found: Composition, limits: Sequence[Limit]) -> tuple[float, Limit]:
    """Return how many times its demand the worst predicted confidence bound is off, and the limit."""
    ratios = [
        (limit.ratio(limit.bound(score)), number)
        for number, (limit, score) in enumerate(zip(limits, found.scores, strict=True))
    ]
    ratio, number = max(ratios)
    return ratio, limits[number]


def tightened(limits: Sequence[Limit], share: float) -> tuple[Limit, ...]:
    """Return limits that leave only a share of what these allow, or demand so much more of what is to be large."""
    return tuple(
        Limit(score=limit.score, upper=limit.upper * share, confidence=limit.confidence)
        if limit.upper is not None
        else Limit(score=limit.score, lower=limit.end / share, confidence=limit.confidence)
        for limit in limits
    )


def _score(values: FloatArray) -> Score:
    """Return the mean over the drives that say something, as `TrialOutcomes.score` does."""
    said = values[~np.isnan(values)]
    if len(said) == 0:
        return Score(value=math.nan, unit="", standard_error=math.inf, count=1)
    error = float(said.std(ddof=1)) / math.sqrt(len(said)) if len(said) > 1 else math.inf
    return Score(value=float(said.mean()), unit="", standard_error=error, count=len(said))


def _meets(scores: Sequence[Score], limits: Sequence[Limit], *, shown: bool) -> bool:
    pairs = zip(limits, scores, strict=True)
    return all(limit.met(score) if shown else not limit.broken(score) for limit, score in pairs)


def _signs(limits: Sequence[Limit]) -> FloatArray:
    """Return 1 where less is better and -1 where more is, so that every limit is an upper one."""
    return np.array([1.0 if limit.upper is not None else -1.0 for limit in limits])


def _means(terms: FloatArray) -> FloatArray:
    """Return the means over the drives that say something, NaN where none does."""
    said = ~np.isnan(terms)
    count = said.sum(axis=2)
    total = np.where(said, terms, 0.0).sum(axis=2)
    return np.asarray(np.divide(total, count, out=np.full(total.shape, np.nan), where=count > 0))


def _relaxation(
    choices: ZoneChoices, limits: Sequence[Limit], ends: FloatArray, *, shown: bool
) -> tuple[list[FloatArray], FloatArray] | None:
    """Return the least that each option adds, for each slot, and multipliers; ``None`` if no mixture will do."""
    along: FloatArray | None = None
    for _ in range(_DIRECTIONS if shown else 1):
        least = [_least(choices, slot, limits, along, shown=shown) for slot in range(len(choices.terms))]
        relaxed_to = _relaxed(choices.costs_eur, least, ends)
        if relaxed_to is None:
            return None
        multipliers, weights = relaxed_to
        along = _directions(choices, weights)
    return least, multipliers


def _least(
    choices: ZoneChoices, slot: int, limits: Sequence[Limit], along: FloatArray | None, *, shown: bool
) -> FloatArray:
    """Return the least that each option of a slot adds to the side of each score that is judged.

    Shape (options, limits), signed so that every limit is an upper one. ``along`` holds a direction of unit length
    for each limit, shape (limits, drives); without it means are returned. Where no other slot touches a score, it
    is the judged bound itself.
    """
    terms = choices.terms[slot]
    least = np.asarray(_signs(limits) * _means(terms))
    others = [other for number, other in enumerate(choices.terms) if number != slot]
    for column, limit in enumerate(limits):
        alone = not any((np.nan_to_num(other[:, column]) != 0.0).any() for other in others)
        if shown and not alone:
            if along is not None:
                least[:, column] += _width(limit, terms[:, column]) * (_off(terms[:, column]) @ along[column])
            continue
        for option in range(len(terms)):
            score = _score(terms[option, column])
            if not math.isnan(score.value):
                half = abs(limit.bound(score) - score.value)
                least[option, column] += half if shown else -half
    # What no drive tells is not shown to meet a limit, nor to break one.
    unknown = np.where(np.isnan(least), np.inf if shown else -np.inf, least)
    scale = np.maximum(np.abs(np.array([limit.end for limit in limits])), 1e-12)
    return np.asarray(np.maximum(unknown, -_UNBOUNDED * scale))


def _off(values: FloatArray) -> FloatArray:
    """Return the deviations of each row from its mean over the drives that say something, zero on the others."""
    said = ~np.isnan(values)
    count = np.maximum(1, said.sum(axis=-1, keepdims=True))
    means = np.where(said, values, 0.0).sum(axis=-1, keepdims=True) / count
    return np.asarray(np.where(said, values - means, 0.0))


def _width(limit: Limit, values: FloatArray) -> float:
    """Return the half width of a bound over the length of the deviations; zero where one drive says something."""
    count = int((~np.isnan(values[0])).sum())
    if count < 2:
        return 0.0
    # Of a score whose standard error is 1 the bound tells the multiple.
    one = Score(value=0.0, unit="", standard_error=1.0, count=count)
    return abs(limit.bound(one)) / math.sqrt(count * (count - 1))


def _directions(choices: ZoneChoices, weights: Sequence[FloatArray]) -> FloatArray:
    """Return the directions of the deviations of a mixture of options, shape (limits, drives)."""
    mixed = np.sum(
        [np.tensordot(weight, terms, axes=1) for weight, terms in zip(weights, choices.terms, strict=True)], axis=0
    )
    off = _off(mixed)
    length = np.linalg.norm(off, axis=1, keepdims=True)
    return np.asarray(np.divide(off, length, out=np.zeros_like(off), where=length > 0.0))


def _priced(costs: FloatArray, least: FloatArray, multipliers: FloatArray) -> FloatArray:
    """Return cost plus what an option takes of the limits at the price of the multipliers, shape (options,)."""
    usable = np.asarray(np.isfinite(least).all(axis=1))
    return np.where(usable, costs + np.asarray(np.where(usable[:, None], least, 0.0)) @ multipliers, np.inf)


def _relaxed(
    costs: Sequence[FloatArray], least: Sequence[FloatArray], ends: FloatArray
) -> tuple[FloatArray, list[FloatArray]] | None:
    """Return multipliers, none negative, and weights of the options in the linear relaxation.

    ``None`` if even that has no solution.
    """
    from scipy.optimize import linprog

    values = np.concatenate(least)
    usable = np.isfinite(values).all(axis=1)
    owner = np.repeat(np.arange(len(costs)), [len(cost) for cost in costs])
    if len(set(owner[usable].tolist())) < len(costs):
        return None
    scale = np.maximum(np.abs(ends), 1e-12)
    found = linprog(
        np.concatenate(costs)[usable],
        A_ub=(values[usable] / scale).T,
        b_ub=ends / scale,
        A_eq=(owner[usable][None, :] == np.arange(len(costs))[:, None]).astype(np.float64),
        b_eq=np.ones(len(costs)),
        method="highs",
    )
    if not found.success:
        return None
    weights = np.zeros(len(owner))
    weights[usable] = found.x
    multipliers = np.maximum(0.0, -np.asarray(found.ineqlin.marginals)) / scale
    return multipliers, [weights[owner == slot] for slot in range(len(costs))]


def _tails(rows: Sequence[FloatArray], zero: FloatArray) -> list[FloatArray]:
    """Return for each slot the sum of the rows from it on, and zero after the last."""
    found = [zero]
    for row in reversed(rows):
        found.append(found[-1] + row)
    return found[::-1]
