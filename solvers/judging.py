"""From outcomes to verdicts: scores of a layout, limits met or missed, and the layouts to point out."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import replace

from layoutopt.errors import NotANumber
from layoutopt.layout import Layout
from layoutopt.problem import Limit, Problem
from layoutopt.result import Evaluated, Front, Status
from layoutopt.scenario import Scenario
from layoutopt.score_text import percent_text, quantity_text, rough_text, score_name, score_text
from layoutopt.scores import Score, Scores, TrialOutcomes
from solvers.front import knee


def exact_scores(problem: Problem, layout: Layout, *, only: str = "") -> dict[str, Score]:
    """Return every score of a layout that needs no simulation, or those of the objective that makes ``only``.

    Raises
    ------
    NotANumber
        If a score is none: it would win or lose comparisons without a word.
    """
    scores: dict[str, Score] = {}
    for objective in problem.objectives:
        if objective.card.fidelity != "simulated" and (not only or only in objective.card.scores):
            scores.update(objective(layout, problem.design, None))
    for name, score in scores.items():
        if math.isnan(score.value):
            raise NotANumber(f"the exact score {name} is no number")
    return scores


def simulated_scores(
    problem: Problem, layout: Layout, scenario: Scenario, outcomes: TrialOutcomes | None
) -> dict[str, Score]:
    """Return every score that the outcomes give; none without outcomes."""
    scores: dict[str, Score] = {}
    for objective in problem.objectives:
        if objective.card.fidelity == "simulated":
            scores.update(objective(layout, scenario, outcomes))
    return scores


def as_seen(score: Score) -> Score:
    """Return a score as a search takes it: a share by the spread that its trials showed, zero where it was zero.

    To show that what no trial showed is rare takes more trials than a race gives a layout; held-out trials do.
    """
    if not score.share or score.exact:
        return score
    return Score(value=0.0, unit=score.unit) if score.value == 0.0 else replace(score, share=False)


def met_in_search(limit: Limit, score: Score) -> bool:
    """Return whether a search takes a limit for met: like `Limit.met`, but of the score `as_seen`."""
    return limit.met(as_seen(score))


def meeting_limits(problem: Problem, candidates: Sequence[Evaluated]) -> list[Evaluated]:
    """Return the layouts whose scores are known for every limit and meet it as far as a search can tell."""
    return [
        item
        for item in candidates
        if all(
            limit.score in item.scores and met_in_search(limit, item.scores[limit.score])
            for limit in problem.limits
        )
    ]


def worst_ratio(problem: Problem, scores: Scores) -> tuple[float, Limit, Score] | None:
    """Return the limit that is missed by most: how many times the demand its score is off, limit and score.

    A score that no trial gave a value misses its limit infinitely; without any limit the answer is ``None``.
    """
    ratios = []
    for limit, score in problem.limits_on(scores):
        ratios.append((limit.ratio(limit.bound(score)), limit, score))
    return max(ratios, key=lambda entry: entry[0], default=None)


def miss_text(item: Evaluated, limit: Limit, score: Score, where: str = "") -> str:
    """Return in words by how much a layout misses a limit."""
    start = f"nearest is {item.layout.short_key} ({item.layout.label}): {where}{score_name(limit.score)} is "
    side, demanded = ("most", "allowed") if limit.upper is not None else ("least", "demanded")
    allowed = f"where {quantity_text(limit.end, score, limit.score)} is {demanded}"
    if math.isnan(score.value):
        return f"{start}not known, because no drive gave it a value, {allowed}"
    bound = limit.bound(score)
    if math.isinf(bound):
        return f"{start}{score_text(score, limit.score)}, from too few drives to tell a bound, {allowed}"
    worst = quantity_text(bound, score, limit.score)
    miss = rough_text(limit.excess(bound), score, limit.score)
    needed = trials_needed(limit, score)
    rare = f"; no drive showed any, which {needed} drives would show to be within the limit" if needed else ""
    seen = score_text(score, limit.score, bounded=False)
    return (
        f"{start}{seen}, at {side} {worst} at {percent_text(limit.confidence)} "
        f"confidence, {allowed}: {miss} short{rare}"
    )


def trials_needed(limit: Limit, score: Score) -> int:
    """Return how many trials show that a share never seen keeps a limit, if the score has fewer; else zero.

    The bound of a share that was zero in n trials is 1 - (1 - confidence)^(1/n); see `layoutopt.scores.Score`.
    """
    if not (score.share and score.value == 0.0 and limit.upper is not None and 0.0 < limit.upper < 1.0):
        return 0
    if score.exact or limit.met(score):
        return 0
    return math.ceil(math.log(1.0 - limit.confidence) / math.log1p(-limit.upper))


def nearest_miss(problem: Problem, candidates: Sequence[Evaluated]) -> str:
    """Return in words which layout of a search misses the limits by least, and by how much.

    Shares count `as_seen`, as they do when a search takes limits for met: what no trial showed is no miss yet.
    """
    missed = []
    for item in candidates:
        worst = worst_ratio(problem, {name: as_seen(score) for name, score in item.scores.items()})
        if worst is not None:
            missed.append((worst[0], item, worst[1], worst[2]))
    if not missed:
        return "no layout could be judged"
    _, item, limit, score = min(missed, key=lambda entry: entry[0])
    return miss_text(item, limit, score)


def verdict(
    problem: Problem, status: Status, judged: Sequence[Evaluated], meeting: Sequence[Evaluated]
) -> tuple[Status, str]:
    """Return how a search ended and what is missing: a search that is complete says whether the limits are met."""
    if status is not Status.SEARCHED or not problem.limits:
        return status, ""
    return (Status.TARGET_MET, "") if meeting else (Status.TARGET_NOT_MET, nearest_miss(problem, judged))


def pointed_out(front: Front, cheapest: Evaluated | None) -> Mapping[str, Evaluated]:
    """Return the layouts to point out by role: the cheapest one given, the knee and the most accurate."""
    roles = {} if cheapest is None else {"cheapest": cheapest}
    if front.members:
        roles["knee"] = knee(front)
        roles["most accurate"] = front.members[-1]
    return roles
