"""Scores of one layout over several scenarios made one, by the worst case or a quantile, each with its bounds."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from layoutopt.problem import Limit
from layoutopt.protocols import Group
from layoutopt.scores import MORE_IS_BETTER, Score, TrialOutcomes
from solvers.judging import as_seen


@dataclass(frozen=True, slots=True, kw_only=True)
class Combined:
    """A score over scenarios.

    Attributes
    ----------
    value
        The estimate; NaN if a scenario's score is not known.
    lower, upper
        One-sided confidence bounds, each at the confidence asked for; infinite where the trials or the number of
        scenarios show nothing.
    scenario
        Number of the scenario that gave the value.
    seen
        Both bounds if shares had no more spread than their trials showed; see `solvers.judging.as_seen`.
    """

    value: float
    lower: float
    upper: float
    unit: str
    scenario: int
    seen: tuple[float, float]

    def bound(self, limit: Limit) -> float:
        """Return the bound on the side of a limit."""
        return self.upper if limit.upper is not None else self.lower

    def met(self, limit: Limit) -> bool:
        """Return whether the bound meets a limit."""
        return limit.excess(self.bound(limit)) <= 0.0

    def met_in_search(self, limit: Limit) -> bool:
        """Return whether a search takes a limit for met, as `solvers.judging.met_in_search` does."""
        return limit.excess(self.seen[1 if limit.upper is not None else 0]) <= 0.0


def scores_over(
    known: Mapping[Group, TrialOutcomes], groups: Sequence[Group], name: str
) -> tuple[Score, ...] | None:
    """Return a column's score in each group, in their order; ``None`` if a group has no outcomes."""
    if any(group not in known for group in groups):
        return None
    return tuple(known[group].score(name) for group in groups)


def worst_case(scores: Sequence[Score], name: str, *, confidence: float = 0.95) -> Combined:
    """Return the worst of the scores of one layout in several scenarios.

    Parameters
    ----------
    name
        Name of the score; it says whether more of it is better.

    Raises
    ------
    ValueError
        If there is no score.

    Notes
    -----
    Let the worst of k means be the largest. It is the mean of one scenario, whichever, and lies below that one's
    own bound with the confidence asked for, so below the largest of all bounds: this side needs no correction,
    although the scenario is not known. On the other side the largest of k lower bounds must hold for all k at
    once; there each has the k-th part of the risk (Bonferroni). The estimate itself is biased to the bad side.
    """
    return _ranked(scores, name, len(scores), len(scores), confidence, len(scores))


def quantile_over(scores: Sequence[Score], name: str, *, quantile: float, confidence: float = 0.95) -> Combined:
    """Return a quantile, counted from the good side, of a layout's mean over a distribution of scenarios.

    Parameters
    ----------
    scores
        Those in scenarios drawn independently from the distribution.
    quantile
        Share of scenarios that are at least so good.

    Raises
    ------
    ValueError
        If there is no score, or the quantile lies outside 0 to 1.

    Notes
    -----
    Order statistics bound the quantile of any distribution (David and Nagaraja, Order Statistics, 2003, Section
    7.1): the r-th smallest of n draws lies above it with the chance that at most r - 1 of n fall below it. Half of
    the risk goes there, the other half to the trials: if the r-th smallest upper bound lay below the r-th smallest
    mean, one of the n - r + 1 scenarios from that mean on would have a bound that does not hold, so each of these
    has its part of the risk. With fewer than `scenarios_needed` scenarios there is no bound on the bad side.
    """
    if not 0.0 < quantile < 1.0:
        raise ValueError(f"a quantile lies between 0 and 1, got {quantile!r}")
    count, half = len(scores), 1.0 - (1.0 - confidence) / 2.0
    above = next((rank for rank in range(1, count + 1) if _at_most(rank - 1, count, quantile) >= half), 0)
    below = next((rank for rank in range(count, 0, -1) if 1.0 - _at_most(rank - 1, count, quantile) >= half), 0)
    middle = min(count, max(1, math.ceil(round(quantile * count, 9))))
    return _ranked(scores, name, above, below, half, middle)


def scenarios_needed(quantile: float, confidence: float = 0.95) -> int:
    """Return how many drawn scenarios bound a quantile on its bad side; see `quantile_over`.

    >>> scenarios_needed(0.9)
    36
    """
    return math.ceil(math.log((1.0 - confidence) / 2.0) / math.log(quantile))


def _ranked(
    scores: Sequence[Score], name: str, above: int, below: int, confidence: float, middle: int
) -> Combined:
    """Return the ``middle``-th of the scores from the good side, bounded by those of rank ``above`` and ``below``.

    A rank of zero stands for no bound. What is done on the bad side for a score of which less is better is done on
    the other side for one of which more is better.
    """
    if not scores:
        raise ValueError("scores over scenarios need at least one scenario")
    sign = -1.0 if name.rpartition(".")[2] in MORE_IS_BETTER else 1.0
    count, risk = len(scores), 1.0 - confidence
    values = [sign * score.value for score in scores]
    if any(math.isnan(value) for value in values):
        lower, upper = -math.inf, math.inf
        return Combined(
            value=math.nan, lower=lower, upper=upper, unit=scores[0].unit, scenario=0, seen=(lower, upper)
        )
    place = sorted(range(count), key=lambda number: (values[number], number))[middle - 1]

    def bounds(judged: Sequence[Score]) -> tuple[float, float]:
        bad, good = math.inf, -math.inf
        if above:
            at = 1.0 - risk / (count - above + 1)
            bad = sorted(score.upper(at) if sign > 0.0 else -score.lower(at) for score in judged)[above - 1]
        if below:
            at = 1.0 - risk / below
            good = sorted(score.lower(at) if sign > 0.0 else -score.upper(at) for score in judged)[below - 1]
        return min(sign * bad, sign * good), max(sign * bad, sign * good)

    lower, upper = bounds(scores)
    return Combined(
        value=scores[place].value,
        lower=lower,
        upper=upper,
        unit=scores[0].unit,
        scenario=place,
        seen=bounds([as_seen(score) for score in scores]),
    )


def _at_most(successes: int, count: int, chance: float) -> float:
    """Return the chance of at most so many successes in ``count`` independent trials."""
    # Imported here: it costs more than all the rest of a short command.
    from scipy.special import bdtr

    return float(bdtr(successes, count, chance))
