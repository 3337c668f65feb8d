"""What a screen would lose that drops layouts by a closed-form score before anything is simulated.

A closed-form score of a layout (half-gap, expected reads) costs nothing and ranks layouts, but bounds no error of
a filter. So the study's own screen drops no layout by one: its margin is infinite and its loss zero. The trials
that were run anyway tell how well such a score agrees with the simulated one, and how far from the front a tighter
screen would have stayed.

A screen of margin m keeps a layout if its closed-form score is within the factor m of the best among the layouts
that cost no more. A layout without that score it cannot judge, and keeps.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from layoutopt.identity import BoolArray, FloatArray
from layoutopt.result import Evaluated
from layoutopt.score_text import NOT_KNOWN, score_name, score_text
from layoutopt.scores import NORMAL_95, Score
from solvers.front import non_dominated
from studies.findings import Findings

CLOSED_FORMS: Final = {
    "published_half_gap": False,
    "derived_half_gap": False,
    "expected_reads_per_m": True,
    "expected_new_tags_per_m": True,
    "static_error_mean": False,
    "static_error_worst": False,
    "heading_bound": False,
    "blind_probability_mean": False,
    "blind_run_p95": False,
    "pose_coverage": True,
    "pose_coverage_two": True,
    "run_coverage": True,
}
"""Scores without a drive that a screen could go by, and whether more of them is better."""
MARGINS: Final = (1.0, 1.25, 1.5, 2.0, 3.0, math.inf)
STUDY_MARGIN: Final = math.inf
"""The margin of the study's own screen: it drops no layout by a closed-form score."""
_TOLD: Final = ("derived_half_gap", "expected_reads_per_m")
_TOLD_MARGIN: Final = 1.5
_LEAST_RANKED: Final = 6


@dataclass(frozen=True, slots=True, kw_only=True)
class Correlation:
    """A rank correlation with the ends of its 95 % interval; all NaN where it is not known."""

    value: float
    low: float
    high: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Agreement:
    """How a closed-form score ranks layouts beside the simulated one, over the layouts that have both.

    Positive means that what looks better in closed form is better in simulation, whatever the sense of the score.

    Attributes
    ----------
    overall
        Rank correlation of the two scores.
    at_equal_cost
        The same with what both owe to the cost taken out (partial correlation of the ranks). Dearer layouts are
        better in both, so the overall one says little of what a screen can tell among layouts of one price.
    """

    score: str
    layouts: int
    overall: Correlation
    at_equal_cost: Correlation


@dataclass(frozen=True, slots=True, kw_only=True)
class Screen:
    """A screen by one closed-form score with one margin.

    Attributes
    ----------
    kept
        How many of the layouts that raced it would have let race.
    dropped_members
        How many members of the front it would have dropped.
    largest_loss, mean_loss
        How far the front of the kept layouts lies above the full front, at the costs of the full front's members.
    """

    score: str
    margin: float
    kept: int
    dropped_members: int
    largest_loss: Score
    mean_loss: Score


@dataclass(frozen=True, slots=True, kw_only=True)
class Screening:
    """Agreements and screens of every closed-form score that layouts of the study have.

    ``raced`` counts the layouts with trials, over which agreement and kept layouts count; ``judged`` those with as
    many trials as any member of the front, among which fronts are compared.
    """

    goal: str
    raced: int
    judged: int
    front: int
    agreements: tuple[Agreement, ...]
    screens: tuple[Screen, ...]


def screening_of(findings: Findings) -> Screening:
    """Return what screens would have lost in a study; without a front there is nothing to tell."""
    goal = findings.problem.goals[1]
    raced = [
        item for item in findings.designs if item.trials and not item.refusal and _known(item.evaluated, goal)
    ]
    least = min((item.trials for item in raced if item.on_front), default=0)
    judged = [item.trials >= least for item in raced]
    return screening([item.evaluated for item in raced], judged, findings.problem.goals)


def screening(raced: Sequence[Evaluated], judged: Sequence[bool], goals: Sequence[str]) -> Screening:
    """Return agreements and screens over layouts that raced.

    Parameters
    ----------
    raced
        Layouts with cost, closed-form scores and simulated second goal.
    judged
        Which of them have trials enough to stand in a front.
    goals
        Names of cost and simulated goal.

    Notes
    -----
    A loss is the difference of two simulated scores; its standard error takes them for independent, which is
    cautious where all layouts meet the same drives. The full front is made of the luckiest layouts, which makes a
    loss look larger than it is. Where no kept layout has trials enough, the best of the others stands in, and its
    few trials flatter it.
    """
    costs = np.array([item.scores[goals[0]].value for item in raced])
    errors = [item.scores[goals[1]] for item in raced]
    in_front = np.array(judged, dtype=np.bool_).reshape(len(raced))
    members = _front(costs, errors, in_front)
    agreements, screens = [], []
    for name, more_is_better in CLOSED_FORMS.items():
        values = np.array([item.scores[name].value if name in item.scores else math.nan for item in raced])
        if np.isnan(values).all() or len(members) == 0:
            continue
        # Only ratios count, so that a score of which more is better enters by its inverse.
        with np.errstate(divide="ignore"):
            badness = 1.0 / values if more_is_better else values
        agreements.append(_agreement(name, badness, errors, costs))
        for margin in MARGINS:
            kept = kept_by(costs, badness, margin)
            largest, mean = _losses(costs, errors, members, kept, in_front)
            screens.append(
                Screen(
                    score=name,
                    margin=margin,
                    kept=int(kept.sum()),
                    dropped_members=int((~kept[members]).sum()),
                    largest_loss=largest,
                    mean_loss=mean,
                )
            )
    return Screening(
        goal=goals[1],
        raced=len(raced),
        judged=int(in_front.sum()),
        front=len(members),
        agreements=tuple(agreements),
        screens=tuple(screens),
    )


def screening_lines(found: Screening) -> list[str]:
    """Return what the study's screen lost and what a tighter one would have, in words; empty without a front."""
    if not found.agreements:
        return []
    lines = ["screen: no layout was dropped for a closed-form score (margin infinite, loss 0)"]
    agreements = {item.score: item for item in found.agreements}
    lines += [
        f"  {score_name(screen.score)}: rank correlation with the {score_name(found.goal)} "
        f"{correlation_text(agreements[screen.score].overall)}, at equal cost "
        f"{correlation_text(agreements[screen.score].at_equal_cost)}; a margin of {screen.margin:g} would have "
        f"kept {screen.kept} of {found.raced} layouts and lost up to {score_text(screen.largest_loss, found.goal)}"
        for screen in found.screens
        if screen.score in _TOLD and screen.margin == _TOLD_MARGIN
    ]
    return lines


def correlation_text(correlation: Correlation) -> str:
    """Return a rank correlation with its 95 % interval, or that it is not known.

    >>> correlation_text(Correlation(value=0.904, low=0.887, high=0.918))
    '0.90 (0.89 to 0.92)'
    """
    if math.isnan(correlation.value):
        return NOT_KNOWN
    return f"{correlation.value:z.2f} ({correlation.low:z.2f} to {correlation.high:z.2f})"


def kept_by(costs: FloatArray, badness: FloatArray, margin: float) -> BoolArray:
    """Return which layouts a screen keeps, shape (n,): those within ``margin`` of the best that cost no more.

    ``badness`` is a positive score of which less is better, NaN where a layout has none; such layouts are kept.
    """
    judged = ~np.isnan(badness)
    order = np.argsort(costs, kind="stable")
    best = np.minimum.accumulate(np.where(judged, badness, np.inf)[order])
    # Of layouts that cost the same, each sees the best of them all.
    last = np.searchsorted(costs[order], costs, side="right") - 1
    with np.errstate(invalid="ignore"):
        return np.asarray(~judged | math.isinf(margin) | (badness <= margin * best[last] * (1.0 + 1e-12)))


def rank_correlation(first: FloatArray, second: FloatArray, given: FloatArray | None = None) -> Correlation:
    """Return Spearman's rank correlation, ties at their mean rank; partial, if a third score is ``given``.

    The interval is that of Fisher's transform with the standard error sqrt((1 + r^2 / 2) / (n - 3)) of Bonett and
    Wright, Psychometrika 65, 2000, one less than n for a partial one; it takes the pairs for a random sample. Not
    known with fewer than six pairs, if a score never changes, or if one is a function of the one given.
    """
    unknown = Correlation(value=math.nan, low=math.nan, high=math.nan)
    columns = [first, second, *([] if given is None else [given])]
    if len(first) < _LEAST_RANKED or min(len(np.unique(column)) for column in columns) < 2:
        return unknown
    matrix = np.corrcoef([_ranks(column) for column in columns])
    value, count = float(matrix[0, 1]), len(first)
    if given is not None:
        with_first, with_second = float(matrix[0, 2]), float(matrix[1, 2])
        left = (1.0 - with_first**2) * (1.0 - with_second**2)
        if left < 1e-12:
            return unknown
        value, count = (value - with_first * with_second) / math.sqrt(left), count - 1
    if abs(value) > 1.0 - 1e-12:
        value = math.copysign(1.0, value)
        return Correlation(value=value, low=value, high=value)
    half = NORMAL_95 * math.sqrt((1.0 + value**2 / 2.0) / (count - 3))
    middle = math.atanh(value)
    return Correlation(value=value, low=math.tanh(middle - half), high=math.tanh(middle + half))


def _ranks(values: FloatArray) -> FloatArray:
    _, which, counts = np.unique(values, return_inverse=True, return_counts=True)
    return np.asarray((np.cumsum(counts) - (counts - 1) / 2.0)[which])


def _agreement(name: str, badness: FloatArray, errors: Sequence[Score], costs: FloatArray) -> Agreement:
    both = ~np.isnan(badness)
    values = np.array([error.value for error in errors])
    return Agreement(
        score=name,
        layouts=int(both.sum()),
        overall=rank_correlation(badness[both], values[both]),
        at_equal_cost=rank_correlation(badness[both], values[both], given=costs[both]),
    )


def _front(costs: FloatArray, errors: Sequence[Score], among: BoolArray) -> list[int]:
    """Return the rows of the front of some layouts, by rising cost."""
    rows = np.flatnonzero(among).tolist()
    values = np.array([[costs[row], errors[row].value] for row in rows]).reshape(-1, 2)
    return [rows[number] for number in non_dominated(values)]


def _losses(
    costs: FloatArray, errors: Sequence[Score], members: Sequence[int], kept: BoolArray, judged: BoolArray
) -> tuple[Score, Score]:
    """Return the largest and the mean loss at the costs of the full front's members.

    A member's place is taken by the best kept layout that costs no more: one with trials enough to stand in a
    front, or any other where there is none. The best of the cheapest layouts is always kept, so there is one.
    """
    values = np.array([error.value for error in errors])
    rivals = []
    for row in members:
        affordable = kept & (costs <= costs[row])
        fit = affordable & judged if (affordable & judged).any() else affordable
        rivals.append(int(np.argmin(np.where(fit, values, np.inf))))
    worst = int(np.argmax(values[rivals] - values[list(members)]))
    largest = _sum_of(errors, [(1.0, rivals[worst]), (-1.0, members[worst])])
    share = 1.0 / len(members)
    mean = _sum_of(errors, [*((share, row) for row in rivals), *((-share, row) for row in members)])
    return largest, mean


def _sum_of(errors: Sequence[Score], terms: Sequence[tuple[float, int]]) -> Score:
    """Return a weighted sum of scores as if they were independent; one in which all cancel is exactly zero."""
    weights: dict[int, float] = {}
    for weight, row in terms:
        weights[row] = weights.get(row, 0.0) + weight
    left = [(weight, errors[row]) for row, weight in weights.items() if abs(weight) > 1e-12]
    if not left:
        return Score(value=0.0, unit=errors[0].unit)
    return Score(
        value=sum(weight * score.value for weight, score in left),
        unit=errors[0].unit,
        standard_error=math.hypot(*(weight * score.standard_error for weight, score in left)),
        count=min(score.count for _, score in left),
    )


def _known(item: Evaluated, goal: str) -> bool:
    return goal in item.scores and not math.isnan(item.scores[goal].value)
