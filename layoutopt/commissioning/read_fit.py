"""Read rate and scatter of tag places, fitted from what was read, and what was not, along a path."""

import math
from collections.abc import Callable
from dataclasses import dataclass
from typing import Final

import numpy as np

from layoutopt.commissioning.estimated import Fitted, fitted_share, hessian, log_scaled
from layoutopt.commissioning.read_chances import MARGIN_MOST_M, Chances, between_reads, chances_of
from layoutopt.commissioning.replay import Replay
from layoutopt.identity import BoolArray, FloatArray, IntArray

FEWEST: Final = 100
"""Scans over tags below which nothing is fitted."""
FEWEST_BETWEEN: Final = 50
"""Scans between two reads of one pass below which nothing is fitted without truth."""
DEEP_SHARE: Final = 0.6
"""A tag within this share of the read radius should be read however tags and edges scatter."""
_DEAD_AFTER: Final = 6
_LEAST_M: Final = 1e-4
_SLOPE_STEP: Final = 1e-4
_HALF_CHI_SQUARE: Final = 1.353
"""Half of chi-square, one degree of freedom, 90 %: one-sided 95 % for a number that cannot be negative."""
_LOGISTIC_SIGMA: Final = math.pi / math.sqrt(3.0)


@dataclass(frozen=True, slots=True, kw_only=True)
class ReadFit:
    """What a drive tells of its readers.

    Attributes
    ----------
    planned
        Share of the scans with a planned tag in the disc that brought it, of all tags alike.
    missed, placement_sigma_m
        Share of scans in range that bring nothing, and deviation of the tags' places, fitted together.
    dead, wrong
        Share of tags that never answered, and of reads that named a tag out of reach.
    notes
        What was not fitted and why, one sentence each.
    """

    planned: Fitted | None = None
    missed: Fitted | None = None
    placement_sigma_m: Fitted | None = None
    dead: Fitted | None = None
    wrong: Fitted | None = None
    notes: tuple[str, ...] = ()


def fit_reads(replayed: Replay) -> ReadFit:
    """Return read rate, scatter of tag places, dead tags and wrong reads along the reference path of a replay.

    A tag is read in a scan with a chance of ``(1 - missed) Φ((radius - distance - s² / 2 distance) / s)``, because
    a place that scatters by s along both axes lies on average s² / 2d farther away; s² is the sum of the squared
    placement deviation and that of the read edge, which is held as the layout file has it: distances alone do not
    tell the two apart. Reads of one tag share its place, so standard errors are taken over tags (sandwich).
    Tags that never answered in `_DEAD_AFTER` or more scans deep in a disc count as dead and in nothing else.

    Without truth the errors of the estimated path look like scatter and missed scans: on simulated drives the
    missed share came out three times too large. Then it is taken from the scans between two reads of one pass,
    which needs no path (`between_reads`), and the scatter is not fitted.
    """
    chances, wrong, notes = chances_of(replayed)
    if not replayed.with_truth:
        return _without_truth(replayed, chances, wrong, notes)
    inside = chances.beyond_m < 0.0
    if int(inside.sum()) < FEWEST:
        notes.append(
            f"reads are not fitted: {int(inside.sum())} scans with a tag in the planned disc where pose and turn "
            f"are known, and {FEWEST} are needed"
        )
        return ReadFit(wrong=wrong, notes=tuple(notes))
    planned = fitted_share(
        int(chances.hit[inside].sum()), int(inside.sum()), "scans with a tag in the planned disc"
    )
    dead_tags, dead = _dead(chances)
    chances = chances.among(~np.isin(chances.tag, dead_tags))
    if not chances.hit.any():
        notes.append("the missed share is not fitted: no tag answered")
        return ReadFit(planned=planned, dead=dead, wrong=wrong, notes=tuple(notes))
    edge_m = replayed.spec.study.design_faults.read_edge_m
    missed, placement, note = _fit(chances, edge_m)
    return ReadFit(
        planned=planned,
        missed=missed,
        placement_sigma_m=placement,
        dead=dead,
        wrong=wrong,
        notes=(*notes, *([note] if note else [])),
    )


def _without_truth(replayed: Replay, chances: Chances, wrong: Fitted | None, notes: list[str]) -> ReadFit:
    missed, count = between_reads(replayed)
    dead = _dead(chances)[1] if len(chances) else None
    notes.append("the scatter of tag places is not fitted: without truth the errors of the path look the same")
    if count < FEWEST_BETWEEN:
        notes.append(
            f"the missed share is not fitted: {count} scans between two reads of one pass, and "
            f"{FEWEST_BETWEEN} are needed"
        )
        return ReadFit(dead=dead, wrong=wrong, notes=tuple(notes))
    return ReadFit(
        missed=fitted_share(missed, count, "scans between two reads of one pass"),
        dead=dead,
        wrong=wrong,
        notes=tuple(notes),
    )


def read_chance(beyond_m: FloatArray, radius_m: FloatArray, scatter_m: float, missed_share: float) -> FloatArray:
    """Return the chance that a scan reads a tag that is planned so far beyond the read radius, shape (n,)."""
    from scipy.special import ndtr

    distance_m = np.maximum(radius_m + beyond_m, 0.5 * radius_m)
    return np.asarray(
        (1.0 - missed_share) * ndtr(-(beyond_m + scatter_m**2 / (2.0 * distance_m)) / scatter_m), dtype=np.float64
    )


def _dead(chances: Chances) -> tuple[IntArray, Fitted | None]:
    """Return the tags that never answered although often deep in a disc, and their share of those so tried."""
    deep = chances.beyond_m < (DEEP_SHARE - 1.0) * chances.radius_m
    tags, index = np.unique(chances.tag, return_inverse=True)
    tried = np.bincount(index[deep], minlength=len(tags)) >= _DEAD_AFTER
    silent = np.bincount(index, weights=chances.hit, minlength=len(tags)) == 0
    if not tried.any():
        return np.empty(0, dtype=np.int64), None
    dead = tried & silent
    return tags[dead], fitted_share(int(dead.sum()), int(tried.sum()), "tags that were often in a disc")


def _fit(chances: Chances, edge_m: float) -> tuple[Fitted | None, Fitted | None, str]:
    """Return missed share and placement deviation by maximum likelihood, and what should be said of them."""
    from scipy.optimize import minimize

    beyond_m, radius_m, hit = chances.beyond_m, chances.radius_m, chances.hit

    def terms(at: FloatArray) -> FloatArray:
        chance = read_chance(beyond_m, radius_m, math.exp(at[1]), 1.0 / (1.0 + math.exp(-at[0])))
        chance = np.clip(chance, 1e-9, 1.0 - 1e-9)
        return np.log(np.where(hit, chance, 1.0 - chance))

    def cost(at: FloatArray) -> float:
        return float(-terms(at).sum())

    bounds = [(-9.0, 5.0), (math.log(_LEAST_M), math.log(MARGIN_MOST_M))]
    starts = [[-3.0, math.log(scatter_m)] for scatter_m in (0.0005, 0.003, 0.01)]
    best = min(
        (minimize(cost, start, method="L-BFGS-B", bounds=bounds) for start in starts),
        key=lambda result: float(result.fun),
    )
    at = np.asarray(best.x)
    tags = np.unique(chances.tag, return_inverse=True)[1]
    count, scans = int(tags.max()) + 1, len(chances)
    held_m = _LOGISTIC_SIGMA * edge_m
    scatter_m = math.exp(at[1])
    sharp = at[1] < bounds[1][0] + 0.5
    none_missed = at[0] < bounds[0][0] + 1.0
    free = np.array([not none_missed, not sharp])
    covariance = np.zeros((2, 2))
    if free.any():
        covariance[np.ix_(free, free)] = _sandwich(terms, at, free, tags)
    if none_missed:
        deep = beyond_m < -3.0 * scatter_m
        missed = fitted_share(int((~hit[deep]).sum()), int(deep.sum()), "scans deep in a disc")
    else:
        missed = _share(at[0], math.sqrt(covariance[0, 0]), scans)
    if sharp or scatter_m <= held_m:
        most_m = _most_scatter_m(cost, at)
        limit_m = math.sqrt(max(most_m**2 - held_m**2, 0.0))
        none = Fitted(value=0.0, se=math.nan, low=0.0, high=limit_m, count=count, of="tags")
        return missed, none, "no scatter of tag places shows" + (" beyond the read edge" if held_m > 0.0 else "")
    placement_m = math.sqrt(scatter_m**2 - held_m**2)
    # The logarithm of the placement moves by (scatter / placement)² where that of the scatter moves by one.
    log_se = math.sqrt(covariance[1, 1]) * (scatter_m / placement_m) ** 2
    return missed, log_scaled(placement_m, log_se, count, "tags"), ""


def _most_scatter_m(cost: Callable[[FloatArray], float], at: FloatArray) -> float:
    """Return the scatter at which the likelihood has fallen to the end of a 95 % interval."""
    limit = cost(at) + _HALF_CHI_SQUARE
    for scatter_m in np.geomspace(math.exp(at[1]), MARGIN_MOST_M, 200):
        if cost(np.array([at[0], math.log(scatter_m)])) > limit:
            return float(scatter_m)
    return MARGIN_MOST_M


def _share(logit: float, se: float, count: int) -> Fitted:
    """Return a share whose logit has a normal error."""
    low, value, high = (1.0 / (1.0 + math.exp(-x)) for x in (logit - 1.96 * se, logit, logit + 1.96 * se))
    return Fitted(
        value=value, se=value * (1.0 - value) * se, low=low, high=high, count=count, of="scans near tags"
    )


def _sandwich(
    terms: Callable[[FloatArray], FloatArray], at: FloatArray, free: BoolArray, tags: IntArray
) -> FloatArray:
    """Return the covariance of the free parameters where errors are independent only from tag to tag.

    P. J. Huber, Proc. 5th Berkeley Symposium 1 (1967) 221: the inverse of the second derivatives on both sides of
    the scatter of the first ones, here summed over each tag.
    """
    which = np.flatnonzero(free)

    def moved(shift: FloatArray) -> FloatArray:
        there = at.copy()
        there[which] += shift
        return terms(there)

    inverse = np.linalg.pinv(hessian(lambda shift: -float(moved(shift).sum()), np.zeros(len(which))))
    slopes = []
    for axis in np.eye(len(which)):
        slope = (moved(_SLOPE_STEP * axis) - moved(-_SLOPE_STEP * axis)) / (2.0 * _SLOPE_STEP)
        slopes.append(np.bincount(tags, weights=slope))
    by_tag = np.stack(slopes, axis=1)
    count = len(by_tag)
    return np.asarray(inverse @ (by_tag.T @ by_tag) @ inverse * (count / max(count - 1, 1)))
