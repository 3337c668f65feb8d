"""What the study of antennas and their yaw found, in sentences."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from layoutopt.identity import FloatArray
from layoutopt.plots.front import known_interval
from layoutopt.problem import Problem
from layoutopt.result import Status
from layoutopt.score_text import counted_text, euros, limit_text, percent_text, score_name
from layoutopt.scores import Score, TrialOutcomes
from studies.antenna_yaw_results import (
    Driven,
    Verdict,
    cost_eur,
    errors_of,
    rivals_of,
)
from studies.antenna_yaw_setting import CHEAP, ERROR
from studies.antenna_yaw_statistics import bootstrapped_correlation, chance_to_be_best
from studies.cells import shown_on
from studies.finder_scores import elsewhere_lines, laser_lines
from studies.published.comparison import scaled, with_interval
from studies.published.medians import Median, median
from studies.screening import Correlation, correlation_text

_MM: Final = 1000.0


@dataclass(frozen=True, slots=True, kw_only=True)
class Told:
    """What is told of: the choices with their trials, and what came of them."""

    problem: Problem
    driven: tuple[Driven, ...]
    verdict: Verdict
    trials: int
    seed: int
    tracker: str
    prices: str
    failed: int


def summary(told: Told) -> list[str]:
    """Return the answer in a few sentences."""
    verdict, chosen = told.verdict, told.verdict.recommended
    if chosen is None:
        return [f"Nothing can be recommended: {verdict.shortfall}."]
    lines = [_answer_line(told, chosen)]
    if verdict.status is Status.TARGET_NOT_MET:
        lines.append(f"No choice was shown to meet every limit; {verdict.shortfall}.")
    elif told.problem.limits:
        demands = "; ".join(limit_text(limit) for limit in told.problem.limits)
        shown = shown_on(len(chosen.fresh or ()), what="trial")
        lines.append(f"On fresh trials it is {shown} to meet the limits: {demands}.")
        if verdict.tried > 1:
            lines.append(
                f"{verdict.tried} candidates were asked for fresh trials, each at 95 %; with several tries the "
                "chance that the last one passed by luck grows."
            )
    else:
        lines.append(
            "No limit says how accurate is enough, so this is the knee of the front of cost and error. A limit on "
            "tracking_error_mean asks for the cheapest choice within it."
        )
    lines += laser_lines(chosen.outcomes)
    lines += elsewhere_lines(told.problem.elsewhere)
    lines += _sure_lines(told, chosen)
    lines += _cheap_lines(told)
    return lines


def _answer_line(told: Told, chosen: Driven) -> str:
    word = "nearest to the limits" if told.verdict.status is Status.TARGET_NOT_MET else "take"
    line = (
        f"{word.capitalize()}: {chosen.choice.label}, {euros(cost_eur(chosen))}, mean tracking error "
        f"{mm_text(chosen.outcomes)} mm over {counted_text(len(chosen.outcomes), 'trial')}"
    )
    if chosen.fresh is None:
        return f"{line}."
    return f"{line}, {mm_text(chosen.fresh)} mm on {counted_text(len(chosen.fresh), 'fresh trial')}."


def _sure_lines(told: Told, chosen: Driven) -> list[str]:
    """Return how the chosen one compares with others of its cost, and with those of other costs."""
    lines = []
    same = [
        chosen,
        *(entry for entry in told.driven if entry is not chosen and cost_eur(entry) == cost_eur(chosen)),
    ]
    for rival, difference in rivals_of(told.driven, chosen):
        verb = "errs" if rival.choice.count == 1 else "err"
        words = f"{rival.choice.label} {verb} {difference_text(difference)}"
        if cost_eur(rival) == cost_eur(chosen):
            line = f"The next of the same cost: {words}"
            if len(chosen.outcomes) > 1:
                share = chance_to_be_best(errors_of(same), told.seed)
                line += (
                    f"; in {percent_text(share)} of resampled sets of trials this choice stays first of the "
                    f"{len(same)} of its cost"
                )
            lines.append(f"{line}.")
        else:
            more = cost_eur(rival) - cost_eur(chosen)
            lines.append(f"For {euros(abs(more))} {'more' if more > 0.0 else 'less'}, {words}.")
    return lines


def _cheap_lines(told: Told) -> list[str]:
    found = [(name, agreement(told, name)) for name in CHEAP]
    known = [(name, item) for name, item in found if not math.isnan(item.value)]
    if not known:
        return []
    texts = [f"{score_name(name)} {correlation_words(item)}" for name, item in known]
    return [f"Rank correlation of exact scores with the simulated error: {', '.join(texts)}."]


def agreement(told: Told, name: str) -> Correlation:
    """Return Spearman's rank correlation of an exact score with the mean error over the choices that have it."""
    fit = [entry for entry in told.driven if name in entry.item.scores]
    if not fit:
        return Correlation(value=math.nan, low=math.nan, high=math.nan)
    cheap = np.array([entry.item.scores[name].value for entry in fit])
    return bootstrapped_correlation(cheap, errors_of(fit), told.seed)


def correlation_words(correlation: Correlation) -> str:
    """Return a rank correlation with its interval where that is known."""
    if math.isnan(correlation.low):
        return f"{correlation.value:.2f}" if math.isfinite(correlation.value) else correlation_text(correlation)
    return correlation_text(correlation)


def mm_text(outcomes: TrialOutcomes) -> str:
    """Return mean tracking error, mm, with half the width of its 95 % interval."""
    return with_interval(scaled(outcomes.score(ERROR), _MM, unit="mm"))


def difference_text(difference: Score) -> str:
    """Return a paired difference in error in words, with its 95 % interval."""
    low, high = (end * _MM for end in difference.interval())
    way = "more" if difference.value > 0.0 else "less"
    if not (math.isfinite(low) and math.isfinite(high)):
        return f"{abs(difference.value) * _MM:.3g} mm {way}"
    ends = (low, high) if difference.value > 0.0 else (-high, -low)
    return f"{abs(difference.value) * _MM:.0f} mm {way} ({round(ends[0])} to {round(ends[1])} mm, paired)"


def median_of(entry: Driven) -> Median:
    """Return the median over trials of their mean errors, m."""
    return median(entry.errors_m)


def ends_mm(values: Sequence[Score]) -> tuple[FloatArray, FloatArray]:
    """Return the ends of the 95 % intervals, mm, NaN where too few trials give one that is worth drawing."""
    ends = np.array([known_interval(score) or (math.nan, math.nan) for score in values]).reshape(-1, 2) * _MM
    return ends[:, 0], ends[:, 1]
