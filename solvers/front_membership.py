"""How sure it is that a layout is on the front: probability of membership by resampling replications.

All layouts meet the same drives (common random numbers), so a bootstrap has to draw replications, not outcomes: a
drive that is drawn twice counts twice for every layout that met it. Here each draw gives every replication a
normal weight (the multiplier bootstrap: Praestgaard and Wellner, Ann. Probab. 21, 1993), the same one for all
layouts. Then means of layouts that share drives keep the covariance that they have in the sample, whatever trials
each has, and all draws are one product of matrices. Weights as for Efron's bootstrap would lose half of the
variance where there are two replications.

A race gives layouts different numbers of replications, and the mean of a few drives is off by how hard those
drives are. How hard each drive is for all layouts alike comes from a model with an effect of each drive and a
random one of each layout; it is the control variate by which short means are corrected (Lavenberg and Welch,
Management Science 27(3), 1981). With slope one that is the paired difference on the common replications, put on
top of the long mean; the slope used is that of the layout, shrunken to the pooled one.

From `LINKED_FROM` replications on, what the control variate leaves over is drawn by the weights of the
replications as well, with the layout's own variance. With fewer, a sample cannot tell which residuals go together,
nor a variance: they are drawn for each layout alone, with its variance shrunken to the pooled one. All draws are
widened from normal to Student's distribution, which stands for variances that are estimated.

Layouts on a front were picked because they looked good, so their means are too good on average, the more the
nearer the layouts are to each other (the curse of the winner). Against that stands a prior that the layouts
themselves tell (empirical Bayes: Efron and Morris, J. Am. Statist. Assoc. 70, 1975): the error scatters about a
smooth curve of the cost, and an outcome that stands far from it on few trials is drawn back to it.

How well the probabilities are kept is tested on made-up worlds with known fronts: with the same trials for all
layouts, near ties among them, within sampling error and 0.03; after a race that leaves most layouts two drives,
those told with a middle probability are members up to 0.1 more often than told.
"""

from collections.abc import Sequence
from typing import Final

import numpy as np

from layoutopt.identity import BoolArray, FloatArray, IntArray
from layoutopt.scores import TrialOutcomes

RESAMPLES: Final = 1000
"""So many draws give a probability with a standard error of at most 0.016, well below what matters to anybody."""
LINKED_FROM: Final = 16
"""Replications from which a correlation between two layouts is known to about a quarter."""
_LEAST_FOR_PRIOR: Final = 10
"""Fewer layouts than that do not tell a parabola and a variance about it."""
_HALVINGS: Final = 50
"""They bring a variance between 1e-12 and a large one to better than 1e-9."""
_STEPS: Final = 60
"""Of expectation and maximisation; more change no probability by as much as its sampling error."""
_SCALINGS: Final = 5
_LEAST_HARDNESS: Final = 0.2
_PRIOR_DEGREES: Final = 4.0
"""Weight of pooled variance and slope, in replications; the race uses the same."""


def goal_values(tables: Sequence[TrialOutcomes | None], goal: str) -> FloatArray:
    """Return a column of several tables side by side, shape (layouts, replications).

    There is a column for each replication that any table has, ascending; NaN stands where a layout has no value.
    """
    numbers = [table.replications for table in tables if table is not None]
    every = np.unique(np.concatenate(numbers)) if numbers else np.empty(0, dtype=np.int64)
    values = np.full((len(tables), len(every)), np.nan)
    for row, table in enumerate(tables):
        if table is not None and goal in table.columns:
            values[row, np.searchsorted(every, table.replications)] = table.column(goal)
    return values


def mean_draws(costs: FloatArray, values: FloatArray, *, seed: int, resamples: int = RESAMPLES) -> FloatArray:
    """Return draws of the true means of layouts, given their outcomes on common replications.

    Parameters
    ----------
    costs
        Exact, shape (layouts,).
    values
        Positive outcomes such as errors, shape (layouts, replications), NaN where a layout has none. Variances and
        slopes are pooled relative to the mean, because large errors vary more.
    seed
        Of the draws (Philox): the same seed gives the same draws.

    Returns
    -------
    Shape (resamples, layouts); NaN for a layout without any value.

    Raises
    ------
    ValueError
        If there are values but no layout has two of them: then nothing is known of their errors.
    """
    known = ~np.isnan(values)
    counts = known.sum(axis=1)
    if not counts.any():
        return np.full((resamples, len(values)), np.nan)
    most = int(counts.max())
    if most < 2:
        raise ValueError("draws of means need at least two replications of one layout")
    lead = known[int(counts.argmax())]
    control = np.where(lead, _hardness(costs, values, known), 0.0)
    control[lead] -= control[lead].mean()
    centres, slopes, residuals = _explained(values, known, lead, control)
    variances = _shrunken(centres, residuals, counts) / np.maximum(counts, 1)
    trend, trust = _prior(costs, centres, variances)

    generator = np.random.Generator(np.random.Philox(seed))
    weights = generator.standard_normal((resamples, values.shape[1]))
    alone = generator.standard_normal((resamples, len(values)))
    width = generator.random(resamples)
    linked = counts >= LINKED_FROM
    own = np.where(linked, counts - 1.0, np.maximum(counts, 1) - 1.0 + _PRIOR_DEGREES)
    spread = alone * np.sqrt(variances)
    shares = np.sqrt(np.maximum(counts * (counts - 1.0), 1.0))
    spread[:, linked] = (weights @ residuals[linked].T) / shares[linked]
    shared = (weights @ control) / np.sqrt(most * (most - 1.0)) * _widening(width, np.array([most - 1.0]))[:, 0]
    # What all layouts share moves the prior as well; only what is a layout's own is held against it.
    own_part = (1.0 - trust) * trend + trust * centres + np.sqrt(trust) * spread * _widening(width, own)
    return np.asarray(own_part + slopes * shared[:, None])


def on_front(costs: FloatArray, draws: FloatArray) -> BoolArray:
    """Return for each draw which layouts are on the front of cost and drawn error, shape (resamples, layouts).

    A layout is on it if none that costs less is as good, and none of its own cost is better; NaN is never on it.
    An exact error goes in as a column of equal draws.
    """
    # Layouts of one cost come as one block: they are compared with all of it, and with all that is cheaper.
    order = np.argsort(costs, kind="stable")
    sorted_costs = costs[order]
    drawn = np.where(np.isnan(draws[:, order]), np.inf, draws[:, order])
    least = np.minimum.accumulate(drawn, axis=1)
    before = np.concatenate([np.full((len(draws), 1), np.inf), least], axis=1)
    cheaper = before[:, np.searchsorted(sorted_costs, sorted_costs, side="left")]
    up_to = before[:, np.searchsorted(sorted_costs, sorted_costs, side="right")]
    found = np.empty(draws.shape, dtype=np.bool_)
    found[:, order] = (drawn < cheaper) & (drawn <= up_to)
    return found


def membership(costs: FloatArray, values: FloatArray, *, seed: int, resamples: int = RESAMPLES) -> FloatArray:
    """Return for each layout the probability that it is on the true front, shape (layouts,).

    Parameters
    ----------
    costs
        Exact, shape (layouts,).
    values
        Outcomes by replication as `goal_values` gives them, shape (layouts, replications).

    See Also
    --------
    mean_draws : What is drawn, and what it assumes.
    """
    return np.asarray(on_front(costs, mean_draws(costs, values, seed=seed, resamples=resamples)).mean(axis=0))


def _hardness(costs: FloatArray, values: FloatArray, known: BoolArray) -> FloatArray:
    """Return how hard each drive is for all layouts alike, relative to their means, shape (replications,).

    The mean of the layouts with the most drives will not do: they went on because their first drives went well.
    In a model with random effects of layouts that selection is harmless (Rubin, Biometrika 63(3), 1976), so the
    effects of drives are those of its likelihood, found by expectation and maximisation.
    """
    counts = known.sum(axis=1)
    filled = np.where(known, values, 0.0)
    means = filled.sum(axis=1) / np.maximum(counts, 1)
    residuals = np.where(known, values - means[:, None], 0.0)
    own = (residuals**2).sum(axis=1) / np.maximum(counts - 1, 1)
    trend, _ = _prior(costs, np.where(counts > 1, means, np.nan), own / np.maximum(counts, 1))
    scale = np.where(trend > 0.0, trend, np.where(np.abs(means) > 0.0, np.abs(means), 1.0))
    relative = np.where(known, values / scale[:, None], 0.0)
    met = np.maximum(known.sum(axis=0), 1)
    hardness = np.zeros(values.shape[1])
    effects = relative.sum(axis=1) / np.maximum(counts, 1)
    scatter = noise = max(float(effects[counts > 0].var()), 1e-12)
    middle = float(effects[counts > 0].mean())
    for _ in range(_STEPS):
        weight = scatter / (scatter + noise / np.maximum(counts, 1))
        rest = np.where(known, relative - hardness, 0.0)
        effects = middle + weight * (rest.sum(axis=1) / np.maximum(counts, 1) - middle)
        doubt = np.where(counts > 0, scatter * (1.0 - weight), 0.0)
        middle = float(effects[counts > 0].mean())
        scatter = max(float(((effects - middle) ** 2 + doubt)[counts > 0].mean()), 1e-12)
        left = np.where(known, relative - effects[:, None], 0.0)
        hardness = left.sum(axis=0) / met
        squares = np.where(known, (left - hardness) ** 2, 0.0).sum() + float((counts * doubt).sum())
        noise = max(float(squares) / float(known.sum()), 1e-12)
    return hardness


def _explained(
    values: FloatArray, known: BoolArray, lead: BoolArray, control: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return means corrected by the control variate, slopes on it, and what it leaves over, 0 without a value.

    A hard drive multiplies errors, so slopes are pooled relative to the corrected mean, which asks for a few
    rounds.
    """
    counts = np.maximum(known.sum(axis=1), 1)
    means = np.where(known, values, 0.0).sum(axis=1) / counts
    centred = np.where(known, values - means[:, None], 0.0)
    hardness = (known * control).sum(axis=1) / counts
    harder = np.where(known, control - hardness[:, None], 0.0)
    own, spread = (centred * harder).sum(axis=1), (harder**2).sum(axis=1)
    # A drive outside the control variate says nothing of how hard it was: such layouts stay as they are.
    usable = known.any(axis=1) & ~(known & ~lead).any(axis=1)
    total, prior = float(spread[usable].sum()), _PRIOR_DEGREES * float((control[lead] ** 2).mean())
    centres, slopes = means, np.zeros(len(values))
    for _ in range(_SCALINGS):
        if total <= 0.0:
            break
        scale = np.where(np.abs(centres) > 0.0, np.abs(centres), 1.0)
        pooled = float((own / scale)[usable].sum()) / total
        relative = np.where(usable, (own / scale + prior * pooled) / (spread + prior), 0.0)
        # One drive cannot be so easy that an error grows more than fivefold by it.
        centres = means / np.maximum(1.0 + relative * hardness, _LEAST_HARDNESS)
        slopes = relative * centres
    centres = np.where(known.any(axis=1), centres, np.nan)
    return centres, slopes, centred - slopes[:, None] * harder


def _shrunken(means: FloatArray, residuals: FloatArray, counts: IntArray) -> FloatArray:
    """Return the variance of one outcome of each layout, shrunken to the pooled relative variance."""
    degrees = np.maximum(counts - 1.0, 0.0)
    squares = (residuals**2).sum(axis=1)
    scale = np.where(np.abs(means) > 0.0, means, 1.0) ** 2
    judged = degrees > 0.0
    # The median forgives single wild layouts; it is divided by that of chi-squared (Wilson and Hilferty, 1931).
    relative = squares[judged] / degrees[judged] / scale[judged] / (1.0 - 2.0 / (9.0 * degrees[judged])) ** 3
    pooled = float(np.median(relative))
    return np.asarray((_PRIOR_DEGREES * pooled * scale + squares) / (_PRIOR_DEGREES + degrees))


def _prior(costs: FloatArray, centres: FloatArray, variances: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return what is expected at each cost before trials, and the weight of the trials against it.

    Logarithms of means scatter about a parabola in the logarithm of cost. Their variance is found by the moments
    of Paule and Mandel (J. Res. Natl. Bur. Stand. 87(5), 1982): the one with which the weighted squares of all
    deviations are as large as their number, less the coefficients. A mean that is not positive, and too few
    of them, have no prior.
    """
    usable = np.isfinite(centres) & (centres > 0.0) & (costs > 0.0)
    if usable.sum() < _LEAST_FOR_PRIOR:
        return np.zeros(len(centres)), np.ones(len(centres))
    x, y = np.log(costs[usable]), np.log(centres[usable])
    spread = float(x.std())
    x = (x - x.mean()) / spread if spread > 0.0 else x - x.mean()
    terms = np.stack([x**power for power in range(3)], axis=1)
    own = variances[usable] / centres[usable] ** 2

    def fitted(scatter: float) -> tuple[FloatArray, float]:
        weight = 1.0 / np.sqrt(scatter + own)
        coefficients = np.linalg.lstsq(terms * weight[:, None], y * weight, rcond=None)[0]
        fit = terms @ coefficients
        return fit, float(((y - fit) ** 2 * weight**2).sum())

    low, high = 1e-12, max(float(y.var()), 1e-12) * len(y)
    for _ in range(_HALVINGS):
        middle = float(np.sqrt(low * high))
        low, high = (middle, high) if fitted(middle)[1] > len(y) - terms.shape[1] else (low, middle)
    trend, trust = np.zeros(len(centres)), np.ones(len(centres))
    trend[usable] = np.exp(fitted(high)[0])
    trust[usable] = high / (high + own)
    return trend, trust


def _widening(width: FloatArray, degrees: FloatArray) -> FloatArray:
    """Return the factors that turn normal draws into Student's, shape (resamples, layouts).

    One quantile a draw serves all layouts: two that go together are widened together, so that their difference is.
    """
    # Imported here: it costs more than all the rest of a short command.
    from scipy.special import gammaincinv

    every, place = np.unique(degrees, return_inverse=True)
    chi_squared = 2.0 * gammaincinv(every[None, :] / 2.0, width[:, None])
    return np.asarray(np.sqrt(every / chi_squared)[:, place])
