"""The rounds of a race: which layouts stay after a few trials each."""

import math
from collections.abc import Mapping, Sequence
from typing import Final

import numpy as np

from layoutopt.identity import BoolArray, FloatArray, IntArray
from layoutopt.problem import Limit, Problem
from layoutopt.result import Evaluated
from layoutopt.scores import TrialOutcomes

_PRIOR_DEGREES: Final = 4.0


def kept(
    problem: Problem,
    alive: Sequence[Evaluated],
    tables: Sequence[TrialOutcomes | None],
    trials: int,
    keep: int,
    log_means: Mapping[str, float] | None = None,
) -> list[Evaluated]:
    """Return the layouts that stay after ``trials``: half of the places by the goal, the rest by the demand.

    With ``log_means``, by key, the goal is judged by these instead of by the trials alone.
    """
    judged = [(item, table.head(trials)) for item, table in zip(alive, tables, strict=True) if table is not None]
    if not judged:
        return []
    costs = np.array([item.scores[problem.goals[0]].value for item, _ in judged])
    errors = np.array([table.column(problem.goals[1]) for _, table in judged])
    # All layouts meet the same drives, so one that never entered a zone says nothing of any of them.
    errors = errors[:, ~np.isnan(errors).any(axis=0)]
    if not errors.shape[1]:
        return [item for item, _ in judged]

    def by_goal(places: int) -> IntArray:
        if log_means is None:
            return survivors(costs, errors, places)
        logarithms = np.array([log_means[item.layout.key] for item, _ in judged])
        return least_dominated(costs, logarithms, places)

    if not problem.limits:
        return [judged[row][0] for row in by_goal(keep)]
    demands = np.array([_demand(problem.limits, table) for _, table in judged])
    chosen = set(by_goal(-(-keep // 2)).tolist())
    for places in range(keep // 2, keep + 1):
        chosen_now = chosen | set(survivors(costs, demands, places).tolist())
        if len(chosen_now) >= min(keep, len(judged)):
            break
    return [judged[row][0] for row in sorted(chosen_now)]


def survivors(costs: FloatArray, errors: FloatArray, keep: int) -> IntArray:
    """Return the ``keep`` layouts least dominated, as ascending row numbers.

    Parameters
    ----------
    costs
        Exact first goal, shape (n,).
    errors
        Second goal, a row a layout and a column a replication, shape (n, r); common random numbers make the
        columns comparable.
    keep
        How many rows stay.

    Notes
    -----
    A row's rival is the best other row that costs no more. The evidence against the row is the mean paired
    difference to its rival over its standard error; the variance of the differences is shrunk, with four
    degrees of freedom, to the pooled relative variance, because single variances from two trials are useless.
    One replication shows no variance; there the difference is taken relative to the mean of the row, as if all
    relative variances were equal.
    """
    count, replications = errors.shape
    if count <= keep or keep == 0:
        return np.arange(min(count, keep))
    means = errors.mean(axis=1)
    rival, unrivalled = _rivals(costs, means)
    differences = errors - errors[rival]
    gap = differences.mean(axis=1)
    scale = np.maximum(means, 1e-12) ** 2
    if replications == 1:
        return _least(np.where(unrivalled, -np.inf, gap / np.sqrt(scale)), keep)
    own = differences.var(axis=1, ddof=1)
    pooled = float(np.median(own[~unrivalled] / scale[~unrivalled])) * scale
    degrees = replications - 1.0
    variance = (_PRIOR_DEGREES * pooled + degrees * own) / (_PRIOR_DEGREES + degrees)
    return _least(np.where(unrivalled, -np.inf, gap / np.sqrt(np.maximum(variance, 1e-300) / replications)), keep)


def least_dominated(costs: FloatArray, log_means: FloatArray, keep: int) -> IntArray:
    """Return the ``keep`` layouts least dominated by logarithms of means, all finite and about equally sure.

    The evidence against a row is how far its logarithm lies above that of the best other row that costs no more.
    """
    if len(costs) <= keep or keep == 0:
        return np.arange(min(len(costs), keep))
    rival, unrivalled = _rivals(costs, log_means)
    return _least(np.where(unrivalled, -np.inf, log_means - log_means[rival]), keep)


def _rivals(costs: FloatArray, means: FloatArray) -> tuple[IntArray, BoolArray]:
    """Return the best other row that costs no more, for each row, and which rows have none."""
    rivals = np.where(costs[None, :] <= costs[:, None], means[None, :], np.inf)
    np.fill_diagonal(rivals, np.inf)
    return rivals.argmin(axis=1), ~np.isfinite(rivals.min(axis=1))


def _least(evidence: FloatArray, keep: int) -> IntArray:
    return np.sort(np.argsort(evidence, kind="stable")[:keep])


def _demand(limits: Sequence[Limit], table: TrialOutcomes) -> FloatArray:
    """Return for each replication the worst ratio of a limited score to its limit, shape (n,)."""
    ratios = [_ratios(limit, table.column(limit.score)) for limit in limits if limit.score in table.columns]
    if not ratios:
        return np.zeros(len(table))
    # A drive that never entered a zone says nothing of it, for no layout: there NaN gives way to the other limits.
    return np.asarray(np.fmax.reduce([np.zeros(len(table)), *ratios]))


def _ratios(limit: Limit, values: FloatArray) -> FloatArray:
    """Return `Limit.ratio` of each value; of one that is not known, NaN."""
    return np.array([math.nan if math.isnan(value) else limit.ratio(value) for value in values.tolist()])
