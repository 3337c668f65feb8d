"""What common drives save: the variance of paired against independent comparison of layouts.

All layouts meet the same drives, faults and draws (`layoutopt.streams`), so the race compares them replication by
replication. On independent drives the variance of a difference would be the sum of the variances of both layouts;
on common ones it is smaller by what the two have in common. The ratio of the two variances is the share of trials
that a paired comparison needs for the same standard error: 0 if the drives decide all, 1 if they decide nothing,
up to 2 if what is hard for one layout is easy for the other.

Compared are the layouts that the race compares: each finalist with its rival, the best finalist before it by
rising cost. The rival of a member of the front is its cheaper neighbour there.
"""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from layoutopt.identity import FloatArray, IntArray
from layoutopt.layout import Layout
from layoutopt.problem import Problem
from layoutopt.protocols import Group, group_of
from layoutopt.result import Evaluated, Front
from layoutopt.score_text import NOT_KNOWN, score_name
from layoutopt.scores import Score, TrialOutcomes, paired_difference


@dataclass(frozen=True, slots=True, kw_only=True)
class VarianceRatio:
    """Variance of a difference on common drives over that on independent ones, with its 95 % interval.

    All NaN where it is not known, the ends alone where there are too few trials for an interval.
    """

    value: float
    low: float
    high: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Comparison:
    """A layout beside its rival, on the search trials that both have.

    ``on_front`` is true for two neighbours on the front; ``difference`` is the simulated goal of the layout less
    that of the rival, paired.
    """

    layout: Layout
    rival: Layout
    on_front: bool
    trials: int
    difference: Score
    ratio: VarianceRatio


@dataclass(frozen=True, slots=True, kw_only=True)
class MeanRatio:
    """Mean of the ratios that are known, how many these are, and the fewest and the most trials of one."""

    ratio: VarianceRatio
    comparisons: int
    fewest_trials: int
    most_trials: int


@dataclass(frozen=True, slots=True, kw_only=True)
class Pairing:
    """All comparisons by rising cost, and the mean ratio of those on the front and of all."""

    goal: str
    comparisons: tuple[Comparison, ...]
    front: MeanRatio
    finalists: MeanRatio


@dataclass(frozen=True, slots=True, kw_only=True)
class Pair:
    """Values of two layouts in the replications that both have, ascending, all of shape (n,)."""

    replications: IntArray
    first: FloatArray
    second: FloatArray


def pairing_of(
    problem: Problem, finalists: Sequence[Evaluated], front: Front, known: Mapping[Group, TrialOutcomes]
) -> Pairing:
    """Return the comparisons of a search, on its trials in the design scenario alone.

    Parameters
    ----------
    finalists
        Layouts that stayed in the race to its end, by rising cost and, at one cost, error.
    front
        The front of the finalists.
    known
        Outcomes of every group; those of other scenarios and estimators do not count.
    """
    goal = problem.goals[1]
    on_front = {item.layout.key for item in front.members}
    judged = [item for item in finalists if goal in item.scores and not math.isnan(item.scores[goal].value)]
    tables = [known[group_of(item.layout, problem.design, problem.estimators[0])] for item in judged]
    errors = np.array([item.scores[goal].value for item in judged])
    comparisons, pairs = [], []
    for row in range(1, len(judged)):
        rival = int(errors[:row].argmin())
        pair = pair_of(tables[row], tables[rival], goal)
        pairs.append(pair)
        comparisons.append(
            Comparison(
                layout=judged[row].layout,
                rival=judged[rival].layout,
                on_front={judged[row].layout.key, judged[rival].layout.key} <= on_front,
                trials=len(pair.replications),
                difference=paired_difference(tables[row], tables[rival], goal),
                ratio=mean_variance_ratio([pair]),
            )
        )
    neighbours = [pair for pair, item in zip(pairs, comparisons, strict=True) if item.on_front]
    return Pairing(
        goal=goal,
        comparisons=tuple(comparisons),
        front=_mean_of(neighbours),
        finalists=_mean_of(pairs),
    )


def pair_of(first: TrialOutcomes, second: TrialOutcomes, name: str) -> Pair:
    """Return a column of two tables in the replications in which both have a value."""
    replications, left, right = np.intersect1d(first.replications, second.replications, return_indices=True)
    values = np.stack([first.column(name)[left], second.column(name)[right]])
    both = ~np.isnan(values).any(axis=0)
    return Pair(replications=replications[both], first=values[0, both], second=values[1, both])


def mean_variance_ratio(pairs: Sequence[Pair]) -> VarianceRatio:
    """Return Var(first - second) / (Var(first) + Var(second)), its mean over the pairs in which it is known.

    It is known from two replications on in which not all values are the same, its interval from three.

    Notes
    -----
    The interval is that of the delete-one jackknife of log(ratio / (2 - ratio)), which is the logarithm of
    Var(first - second) / Var(first + second) and so neither bounded nor as skew as the ratio (Miller, Ann. Math.
    Statist. 39, 1968, jackknifes logarithms of variances for the same reason), with Student's quantile for the
    pair with the fewest replications. A replication is left out of all pairs at once: pairs share drives and
    layouts, and their errors are not independent. With few replications the ratio is biased upwards.
    """
    known = [(pair, ratio) for pair in pairs if not math.isnan(ratio := _ratio(pair))]
    if not known:
        return VarianceRatio(value=math.nan, low=math.nan, high=math.nan)
    value = float(np.mean([ratio for _, ratio in known]))
    fewest = min(len(pair.replications) for pair, _ in known)
    if fewest < 3:
        return VarianceRatio(value=value, low=math.nan, high=math.nan)
    every = np.unique(np.concatenate([pair.replications for pair, _ in known]))
    without = np.empty((len(known), len(every)))
    for row, (pair, ratio) in enumerate(known):
        without[row] = ratio
        without[row, np.searchsorted(every, pair.replications)] = _ratios_without_one(pair)
    means = without.mean(axis=0)
    if (means == value).all():
        return VarianceRatio(value=value, low=value, high=value)
    # Imported here: it costs more than all the rest of a short command.
    from scipy.special import expit, logit, stdtrit

    logits = logit(means / 2.0)
    if not np.isfinite(logits).all():
        return VarianceRatio(value=value, low=math.nan, high=math.nan)
    spread = math.sqrt((len(every) - 1.0) / len(every) * float(((logits - logits.mean()) ** 2).sum()))
    half = float(stdtrit(fewest - 1, 0.975)) * spread
    low, high = (2.0 * float(expit(logit(value / 2.0) + end)) for end in (-half, half))
    return VarianceRatio(value=value, low=low, high=high)


def pairing_lines(found: Pairing) -> list[str]:
    """Return in one line what common drives saved; empty where no two layouts were compared."""
    return [text] if (text := pairing_text(found)) else []


def pairing_text(found: Pairing) -> str:
    """Return in words what common drives saved in the search; empty where no ratio is known."""
    told = [
        f"{ratio_text(mean.ratio)} between {layouts} ({_counted(mean)})"
        for mean, layouts in (
            (found.front, "neighbours on the front"),
            (found.finalists, "finalists and the best that costs no more"),
        )
        if mean.comparisons
    ]
    if not told:
        return ""
    return (
        f"comparisons of the {score_name(found.goal)} on common drives need this share of the trials that "
        f"independent ones would: {', '.join(told)}"
    )


def ratio_text(ratio: VarianceRatio) -> str:
    """Return a ratio with its 95 % interval, as far as they are known.

    >>> ratio_text(VarianceRatio(value=0.312, low=0.22, high=0.404))
    '0.31 (0.22 to 0.40)'
    """
    if math.isnan(ratio.value):
        return NOT_KNOWN
    if math.isnan(ratio.low):
        return f"{ratio.value:.2f} (interval {NOT_KNOWN})"
    return f"{ratio.value:.2f} ({ratio.low:.2f} to {ratio.high:.2f})"


def _counted(mean: MeanRatio) -> str:
    fewest, most = mean.fewest_trials, mean.most_trials
    trials = f"{fewest}" if fewest == most else f"{fewest} to {most}"
    return f"{mean.comparisons} comparison{'s' if mean.comparisons != 1 else ''} of {trials} trials"


def _mean_of(pairs: Sequence[Pair]) -> MeanRatio:
    trials = [len(pair.replications) for pair in pairs if not math.isnan(_ratio(pair))]
    return MeanRatio(
        ratio=mean_variance_ratio(pairs),
        comparisons=len(trials),
        fewest_trials=min(trials, default=0),
        most_trials=max(trials, default=0),
    )


def _ratio(pair: Pair) -> float:
    if len(pair.replications) < 2:
        return math.nan
    apart = float(pair.first.var(ddof=1) + pair.second.var(ddof=1))
    return float((pair.first - pair.second).var(ddof=1)) / apart if apart > 0.0 else math.nan


def _ratios_without_one(pair: Pair) -> FloatArray:
    """Return the ratio with each replication left out in turn, shape (n,)."""
    with np.errstate(invalid="ignore"):
        apart = _variances_without_one(pair.first) + _variances_without_one(pair.second)
        return np.asarray(_variances_without_one(pair.first - pair.second) / apart)


def _variances_without_one(values: FloatArray) -> FloatArray:
    """Return the sample variance with each value left out in turn, shape (n,), n at least 3."""
    count = len(values)
    rows = np.arange(count)
    others = values[(rows[:, None] + rows[1:]) % count]
    return np.asarray(others.var(axis=1, ddof=1))
