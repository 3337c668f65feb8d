"""The answer of the study of a transponder's place in sentences."""

import math
from collections import Counter
from collections.abc import Mapping
from typing import Final

from layoutopt.problem import Limit
from layoutopt.result import Status
from layoutopt.score_text import counted_text, limit_text, percent_text, quantity_text, score_name
from layoutopt.scores import Score, TrialOutcomes, wilson
from layoutopt.units import format_length
from studies.finder_scores import elsewhere_lines
from studies.screening import correlation_text
from studies.transponder_placement_race import SUCCESS, hits_of
from studies.transponder_placement_results import Finalist, Results
from studies.transponder_placement_setting import CHEAP, Place

_TOLD: Final = 0.5
"""A best place that is less probable than this is not called so."""
GUIDE_WORDS: Final[Mapping[str, str]] = {
    "direction_as_measured": "directions as measured",
    "direction_corrected": "published correction, ranges from signal strength",
    "bearing_filter": "bearing filter",
    "bearing_bumper": "bearing filter led round what stopped the robot",
}


def summary(results: Results) -> list[str]:
    """Return the answer in a few sentences."""
    best, elsewhere = results.best, elsewhere_lines(results.asked.elsewhere)
    if best is None:
        return ["There is no place to recommend.", *_nothing(results), *elsewhere]
    found, others = results.finalists[0], results.finalists[1:]
    lines = [f"The transponder goes to {place_text(best)}: {docked_text(found.drives)}.", _status(results)]
    if results.rivals:
        lines.append(_sure(results))
    lines += [_given(item) for item in others if item.place.given]
    if best.given:
        lines.append("It is the place that the spec gives.")
    lines += [_shortfall(limit, score) for limit, score in results.misses]
    if results.guides:
        guides = "; ".join(f"{guide_text(item.name)} {share_text(item.drives)}" for item in results.guides)
        lines.append(f"By guide, on the same fresh drives to the best place: {guides}.")
    return [*lines, *_cheap(results), *elsewhere]


def place_text(place: Place) -> str:
    """Return x and y of a place in the floor frame."""
    return f"({place.xy_m[0]:.2f}, {place.xy_m[1]:.2f}) m"


def guide_text(name: str) -> str:
    """Return what an estimator of bearings is called in a sentence."""
    return GUIDE_WORDS.get(name, name)


def share_text(drives: TrialOutcomes) -> str:
    """Return the share of drives that docked with its 95 % interval after Wilson."""
    low, high = wilson(hits_of(drives), len(drives))
    share = percent_text(hits_of(drives) / len(drives), 1)
    return f"{share} ({100.0 * low:.1f} to {percent_text(high, 1)})"


def docked_text(drives: TrialOutcomes) -> str:
    """Return how many drives docked, in words."""
    low, high = wilson(hits_of(drives), len(drives))
    share = percent_text(hits_of(drives) / len(drives), 1)
    return (
        f"{share} of {len(drives)} fresh drives dock (95 % interval {100.0 * low:.1f} to {percent_text(high, 1)})"
    )


def lead_text(lead: Score) -> str:
    """Return a paired difference of shares in percentage points with its 95 % interval."""
    low, high = lead.interval()
    return f"{100.0 * lead.value:+.1f} ({100.0 * low:+.1f} to {100.0 * high:+.1f})"


def _status(results: Results) -> str:
    if results.status is Status.TARGET_MET:
        return "The best place keeps every limit on docking at 95 % confidence on fresh drives."
    if results.status is Status.TARGET_NOT_MET:
        return "No place was shown to keep every limit on docking."
    return Status.SEARCHED.value


def _sure(results: Results) -> str:
    """Return how sure it is that the best is best, and which places are as good."""
    rivals, count = results.rivals, results.asked.effort.fresh
    second = rivals[0]
    assert second.lead is not None
    text = (
        f"The next of the race is {place_text(second.place)}; on the same {count} fresh drives the best docks "
        f"{lead_text(second.lead)} percentage points more and is the better of the two with a probability of "
        f"{percent_text(second.better)}."
    )
    equal = [place_text(item.place) for item in rivals if item.as_good]
    if equal:
        text += f" As good as far as these drives tell: {', '.join(equal)}."
    last = f"the last {counted_text(len(rivals) + 1, 'place')}"
    if results.correct < _TOLD:
        return f"{text} Which of {last} is best these drives do not tell."
    return f"{text} That it is the best of {last} has a probability of at least {percent_text(results.correct)}."


def _given(item: Finalist) -> str:
    assert item.lead is not None
    refused = f" It would have been refused: {item.place.refusal}." if item.place.refusal else ""
    return (
        f"At the given place {place_text(item.place)} {docked_text(item.drives)}; the best docks "
        f"{lead_text(item.lead)} percentage points more.{refused}"
    )


def _shortfall(limit: Limit, score: Score) -> str:
    name, bound = limit.score, limit.bound(score)
    side = "most" if limit.upper is not None else "least"
    worst, short = (quantity_text(value, score, name) for value in (bound, limit.excess(bound)))
    return (
        f"Not shown: {limit_text(limit)}. The {score_name(name)} at the best place is at {side} {worst} at "
        f"{percent_text(limit.confidence)} confidence: {short} short."
    )


def _cheap(results: Results) -> list[str]:
    """Return what the exact scores tell of the drives."""
    known = [(name, *results.correlation(name)) for name in CHEAP]
    told = [
        f"the {score_name(name)} {correlation_text(ranks)}"
        for name, ranks, _ in known
        if math.isfinite(ranks.value)
    ]
    if not told:
        return [
            "Whether exact scores rank places as drives do cannot be told: scores or drives do not differ here."
        ]
    return [
        f"Rank correlation with the share of the first {results.asked.effort.levels[0]} drives that dock, over "
        f"{known[0][2]} places, with 95 % intervals: {'; '.join(told)}. Only where it is near -1 would the score "
        "do instead of drives."
    ]


def _nothing(results: Results) -> list[str]:
    """Return why there is no place."""
    if results.running:
        return ["Drives to every place failed; the messages say why."]
    reasons = Counter(place.refusal for place in results.places)
    lines = [f"All {counted_text(len(results.places), 'place')} are refused: "]
    lines[0] += "; ".join(f"{count} {reason}" for reason, count in reasons.most_common()) + "."
    widest = max((place.clearance_m for place in results.places), default=0.0)
    if widest < results.asked.least_clearance_m:
        lines.append(
            f"No place of the lattice has a clearance of more than {format_length(widest)}, and "
            f"{format_length(results.asked.least_clearance_m)} are demanded: lower the limit on "
            "scatterer_clearance or the candidate_pitch."
        )
    return lines


def steps_text(drives: TrialOutcomes) -> str:
    """Return the mean number of steps with its standard error."""
    score = drives.score("docking_steps")
    return f"{score.value:.1f} ± {score.standard_error:.1f}"


def success_of(drives: TrialOutcomes) -> float:
    """Return the share of drives that docked."""
    return float(drives.column(SUCCESS).mean())
