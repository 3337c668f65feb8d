"""How sure a selection is, and where the next trials make it surer: layouts compared on common replications.

A table of outcomes has a row a layout and a column a replication. All layouts meet the same drives, so two of them
are compared by the differences in the replications that both have (common random numbers). A layout takes its
replications in order; an allocation therefore says up to which replication each one goes, and trials that only one
of two layouts has say nothing of their difference.

With exact costs the front is right if, and only if, n - 1 comparisons among n layouts are: each member is better
than the member before it, and each other layout is not better than the dearest member that costs no more. With all
costs equal the front is the single best layout, and the comparisons are those of ranking and selection.

What is approximate: means are taken for normal, variances are estimates (hence Student's quantiles), single
variances are shrunk towards a common one, the probability that all comparisons hold is bounded by Bonferroni's
inequality, and it is a posterior one without prior knowledge of the means. Where two layouts are really as good as
equal, such a probability promises more than it holds; an indifference above zero mends that.
"""

import math
from dataclasses import dataclass
from typing import Final

import numpy as np

from layoutopt.identity import BoolArray, FloatArray, IntArray
from solvers.front import non_dominated

_FEWEST_POOLED: Final = 10
"""With fewer variances than that nothing can be said of their spread, and none is shrunk."""
_MOST_PRIOR_DEGREES: Final = 100.0
"""More degrees of freedom make no difference to Student's quantiles that matters."""
_HALVINGS: Final = 60
"""Bisections of a price, after which the interval is below the precision of floating point."""
_LOG_TAIL: Final = math.log(2.0 * math.sqrt(2.0 * math.pi))


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Comparisons:
    """A front and the comparisons that make it one, all columns of shape (k,).

    Attributes
    ----------
    members
        Rows of the front by rising cost, shape (m,).
    rows, rivals
        The two layouts of a comparison: of a member, its cheaper neighbour on the front; of any other layout, the
        dearest member that costs no more.
    margin
        What speaks for the front: mean paired difference in the direction that the front says, plus the
        indifference. Unit of the goal.
    deviation
        Standard deviation of one paired difference, shrunk.
    pairs
        Common replications with a value for both.
    equal
        Whether both did the same in all common replications, of which there are at least two.
    wrong
        Probability that the comparison is wrong by more than the indifference.
    """

    members: IntArray
    rows: IntArray
    rivals: IntArray
    margin: FloatArray
    deviation: FloatArray
    pairs: IntArray
    equal: BoolArray
    wrong: FloatArray


def compared(
    outcomes: FloatArray,
    costs: FloatArray | None = None,
    *,
    candidates: BoolArray | None = None,
    means: FloatArray | None = None,
    scales: FloatArray | None = None,
    indifference: float = 0.0,
) -> Comparisons:
    """Return the front that a table of outcomes shows, with the comparisons on which it rests.

    Parameters
    ----------
    outcomes
        Goal to be made small, shape (n, r); NaN where a layout has no such replication, or no value in it.
    costs
        Exact other goal, shape (n,). Without it the front is the one layout with the smallest mean.
    candidates
        Which layouts may be members, shape (n,); all by default. Others only speak against the members.
    means
        What chooses the members, smaller is better, shape (n,); by default the outcomes do, by paired differences.
        Whether the comparisons hold is judged by the outcomes in any case, so a choice that they speak against has
        negative margins.
    scales
        What the deviations of layouts are taken to be proportional to, positive, shape (n,); 1 by default.
    indifference
        Difference that does not matter, in units of the rival's scale.

    Raises
    ------
    ValueError
        If no layout may be a member.

    Notes
    -----
    Two layouts that did the same in every common replication, of which there are at least two, are taken for
    equal: the dearer one is no member, whatever ``means`` say, and nothing is wrong if it is left out.

    Variances are shrunk to the common one of an inverse chi-square prior whose degrees of freedom are estimated
    from all variances; the sum of both degrees belongs to Student's distribution (Smyth, Statistical Applications
    in Genetics and Molecular Biology 3 (1), 2004, article 3). Below ten variances nothing is shrunk.
    That exact costs leave n - 1 comparisons is what remains of the errors of type I and II of Lee, Chew, Teng and
    Goldsman, IIE Transactions 42, 2010, if one goal has no noise.
    """
    count = len(outcomes)
    costs = np.zeros(count) if costs is None else costs
    scales = np.ones(count) if scales is None else scales
    candidates = np.ones(count, dtype=np.bool_) if candidates is None else candidates
    if not candidates.any():
        raise ValueError("a front needs at least one candidate")
    if means is None:
        members = _front(outcomes, costs, candidates)
    else:
        rows = np.flatnonzero(candidates)
        chosen = rows[non_dominated(np.stack([costs[rows], means[rows]], axis=1))]
        members = _without_equals(outcomes, chosen)
    # Rows before the first member cost less than any candidate: no member stands for them, and none is asked.
    place = np.searchsorted(costs[members], costs, side="right") - 1
    place[members] = np.arange(len(members)) - 1
    rows = np.flatnonzero(place >= 0)
    rivals = members[place[rows]]
    differences = outcomes[rows] - outcomes[rivals]
    known = ~np.isnan(differences)
    pairs = known.sum(axis=1)
    differences = np.where(known, differences, 0.0)
    mean = differences.sum(axis=1) / np.maximum(pairs, 1)
    squares = (np.where(known, differences - mean[:, None], 0.0) ** 2).sum(axis=1)
    equal = (pairs >= 2) & ~differences.any(axis=1)
    variance, degrees = _shrunk(squares / scales[rows] ** 2, pairs)
    deviation = np.sqrt(variance) * scales[rows]
    sense = np.where(np.isin(rows, members), -1.0, 1.0)
    margin = sense * mean + indifference * scales[rivals]
    return Comparisons(
        members=members,
        rows=rows,
        rivals=rivals,
        margin=margin,
        deviation=deviation,
        pairs=pairs,
        equal=equal,
        wrong=np.where(equal, 0.0, _probability_below_zero(margin, deviation, pairs, degrees)),
    )


def probability_of_correct_selection(found: Comparisons) -> float:
    """Return a lower bound of the probability that every comparison holds: 1 less the sum of what is wrong.

    Bonferroni's inequality needs no independence, which comparisons on common drives do not have (APCS-B of Chen,
    Lin, Yücesan and Chick, Discrete Event Dynamic Systems 10, 2000).
    """
    return max(0.0, 1.0 - float(found.wrong.sum()))


def optimal_allocation(
    found: Comparisons, counts: IntArray, batch: int, *, most: IntArray | None = None
) -> IntArray:
    """Return up to which replication each layout goes if ``batch`` trials more are spent where they help most.

    Parameters
    ----------
    counts
        Trials that each layout has, shape (n,).
    batch
        Trials to spend.
    most
        No layout goes further, shape (n,). If all are there, fewer trials than the batch are spent.

    Returns
    -------
    IntArray
        Trials of each layout afterwards, shape (n,), nowhere less than ``counts``.

    Notes
    -----
    Every comparison gets pairs as long as one more takes at least so much from the probability that it is wrong
    as a trial is worth; that price is such that the batch is used up. A layout then goes as far as its most
    demanding comparison, because pairs exist on the common replications alone: a member takes part in many. With
    many trials the pairs of two comparisons are as the squares of deviation over margin, which is the rule of
    optimal computing budget allocation (Chen et al. 2000) and, for a front, of its form for several goals (Lee et
    al. 2010). These give the better layout of a comparison the root of a sum of squares, as independent
    replications demand; Fu, Hu, Chen and Xiong, INFORMS Journal on Computing 19, 2007, treat correlated ones.
    Prices from the probabilities themselves hold with few trials too, where the limiting rule would give all to
    ties that nobody can break. A margin is not known better than by its standard error, so this is added to it in
    squares. Parts of trials are rounded to the largest remainders, ties by row.
    """
    limits = np.full(len(counts), np.iinfo(np.int64).max) if most is None else np.maximum(most, counts)
    if batch <= 0 or not len(found.rows):
        return counts.copy()
    pairs = np.maximum(found.pairs, 1).astype(np.float64)
    both = np.minimum(counts[found.rows], counts[found.rivals])
    # Drives without a value take trials and give no pair.
    trials_a_pair = np.maximum(both, 1) / pairs
    spread = found.deviation > 0.0
    ratio = np.divide(np.maximum(found.margin, 0.0), found.deviation, out=np.zeros_like(pairs), where=spread)
    rate = np.sqrt(ratio**2 + 1.0 / pairs)
    decided = found.equal | (~spread & (found.pairs >= 2))
    ceiling = np.minimum(limits.astype(np.float64), counts + float(batch))

    def wanted(log_price: float) -> FloatArray:
        trials = np.where(decided, 0.0, trials_a_pair * _pairs_at(log_price, rate))
        goal = counts.astype(np.float64)
        np.maximum.at(goal, found.rows, trials)
        np.maximum.at(goal, found.rivals, trials)
        return np.asarray(np.minimum(goal, ceiling))

    # Logarithms of prices, in probability: at 1 nobody gets a trial, at the lowest each comparison would get all.
    low = -10.0 - float(rate.max()) ** 2 * float(counts.max() + batch) + 4.0 * min(0.0, float(np.log(rate.min())))
    high = 0.0
    for _ in range(_HALVINGS):
        middle = (low + high) / 2.0
        if float((wanted(middle) - counts).sum()) > batch:
            low = middle
        else:
            high = middle
    return _rounded(wanted(high), counts, batch, ceiling)


def _front(outcomes: FloatArray, costs: FloatArray, candidates: BoolArray) -> IntArray:
    """Return the members by rising cost: a sweep in which each is compared with the last on common drives."""
    members: list[int] = []
    for row in (rows := np.flatnonzero(candidates))[np.argsort(costs[rows], kind="stable")].tolist():
        if not members:
            members.append(row)
        elif _mean_difference(outcomes[row], outcomes[members[-1]]) < 0.0:
            if costs[row] == costs[members[-1]]:
                members[-1] = row
            else:
                members.append(row)
    return np.array(members, dtype=np.int64)


def _without_equals(outcomes: FloatArray, members: IntArray) -> IntArray:
    """Return members by rising cost without those that did the same as the last of these in all common drives."""
    found = members[:1].tolist()
    for row in members[1:].tolist():
        differences = outcomes[row] - outcomes[found[-1]]
        differences = differences[~np.isnan(differences)]
        if len(differences) < 2 or differences.any():
            found.append(row)
    return np.array(found, dtype=np.int64)


def _mean_difference(first: FloatArray, second: FloatArray) -> float:
    differences = first - second
    differences = differences[~np.isnan(differences)]
    return float(differences.mean()) if len(differences) else 0.0


def _shrunk(squares: FloatArray, pairs: IntArray) -> tuple[FloatArray, FloatArray]:
    """Return variances and degrees of freedom from sums of squares, each shrunk to what is common to all."""
    # Imported here: it costs more than all the rest of a short command.
    from scipy.special import digamma, polygamma

    degrees = np.maximum(pairs - 1, 0).astype(np.float64)
    used = (degrees > 0) & (squares > 0.0)
    own = np.divide(squares, degrees, out=np.zeros_like(squares), where=degrees > 0)
    if used.sum() < _FEWEST_POOLED:
        return own, degrees
    half = degrees[used] / 2.0
    logs = np.log(own[used]) - digamma(half) + np.log(half)
    excess = float(logs.var(ddof=1) - polygamma(1, half).mean())
    prior = 2.0 * _inverse_trigamma(excess)
    common = float(np.exp(logs.mean() + digamma(prior / 2.0) - np.log(prior / 2.0)))
    return (prior * common + squares) / (prior + degrees), prior + degrees


def _inverse_trigamma(value: float) -> float:
    """Return where the trigamma function has a value, at most half of the most prior degrees."""
    from scipy.special import polygamma

    most = _MOST_PRIOR_DEGREES / 2.0
    if value <= float(polygamma(1, most)):
        return most
    low, high = 0.0, most
    for _ in range(_HALVINGS):
        middle = (low + high) / 2.0
        low, high = (middle, high) if float(polygamma(1, middle)) > value else (low, middle)
    return high


def _probability_below_zero(
    margin: FloatArray, deviation: FloatArray, pairs: IntArray, degrees: FloatArray
) -> FloatArray:
    """Return the posterior probability that a mean with these estimates is negative; 1 where nothing is known."""
    from scipy.special import stdtr

    with np.errstate(divide="ignore", invalid="ignore"):
        ratio = margin / (deviation / np.sqrt(pairs))
    # A margin of nothing without spread is a tie that stands as the front says.
    ratio = np.where((margin == 0.0) & (deviation == 0.0), np.inf, ratio)
    known = (pairs > 0) & (degrees > 0.0)
    return np.where(known, stdtr(np.where(known, degrees, 1.0), -np.where(known, ratio, 0.0)), 1.0)


def _pairs_at(log_price: float, rate: FloatArray) -> FloatArray:
    """Return how many pairs each comparison gets while one more takes at least a price from its normal tail.

    The tail at n pairs is Φ(-rate √n), which falls by φ(rate √n) rate / (2 √n) a pair. With u = rate² n the price
    is reached where u + log u is twice the logarithm below: the Wright omega function.
    """
    from scipy.special import wrightomega

    return np.asarray(wrightomega(2.0 * (2.0 * np.log(rate) - _LOG_TAIL - log_price)) / rate**2)


def _rounded(wanted: FloatArray, counts: IntArray, batch: int, ceiling: FloatArray) -> IntArray:
    """Return whole trials: rounded down, and what is left of the batch to the largest remainders, ties by row."""
    whole = np.floor(wanted).astype(np.int64)
    left = batch - int((whole - counts).sum())
    remainder = np.where(whole + 1 <= ceiling, wanted - whole, -1.0)
    for row in np.argsort(-remainder, kind="stable")[: max(left, 0)]:
        if remainder[row] > 0.0:
            whole[row] += 1
    return whole
