"""What the robustness study found in words: tolerance, both layouts, the price of robustness, conflicts."""

import math

from layoutopt.result import Evaluated, Status
from layoutopt.scenario import Scenario
from layoutopt.score_text import (
    NOT_KNOWN,
    counted_text,
    euros,
    limit_text,
    percent_text,
    quantity_text,
    score_name,
    score_text,
)
from layoutopt.scores import Score
from layoutopt.tolerance import Tolerance
from layoutopt.units import format_length
from solvers.conflicts import conflict_text, conflicts_of
from studies.alternatives import signed_euros
from studies.cells import status_text
from studies.robustness_findings import Choice, Judged, RobustnessFindings


def tolerance_text(tolerance: Tolerance) -> str:
    """Return the ranges in words."""
    lengths = {
        "tags off their place with a standard deviation of": tolerance.placement_m,
        "antennas too high by": tolerance.antenna_height_m,
    }
    shares = {"dead tags": tolerance.dead_tags, "missed reads": tolerance.missed_reads}
    told = [
        f"{words} {format_length(low)} to {format_length(high)}"
        for words, (low, high) in lengths.items()
        if low < high
    ]
    told += [
        f"{words} {100.0 * low:.3g} to {100.0 * high:.3g} %" for words, (low, high) in shares.items() if low < high
    ]
    return ", ".join(told) or "no range has any width"


def judged_by(found: RobustnessFindings) -> str:
    """Return in words how scores over the tolerance are made one."""
    if found.tolerance.combine == "worst":
        return f"the worst of {len(found.scenarios)} corners"
    return f"the {percent_text(found.tolerance.quantile)} quantile over {len(found.scenarios)} drawn installations"


def summary(found: RobustnessFindings) -> list[str]:
    """Return the answer in a few sentences."""
    robust = found.choices.get("robust")
    fewest = 0 if robust is None else min(score.count for score in robust.judged.scores)
    lines = [status_text(found.status, fewest)]
    if found.refusal:
        return [*lines, f"Shortfall: {found.refusal}."]
    lines.append(f"Tolerance: {tolerance_text(found.tolerance)}; judged by {judged_by(found)}.")
    if found.limits:
        lines.append(f"Demand: {'; '.join(limit_text(limit) for limit in found.limits)}.")
    lines += [_choice_text(found, name, choice) for name, choice in found.choices.items()]
    lines += price_lines(found)
    if found.status is Status.TARGET_NOT_MET and found.contenders:
        text = robust_conflict(found)
        lines += [f"Over the tolerance: {text}."] if text else []
    counts = sorted({score.count for judged in found.contenders for score in judged.scores})
    drives = " to ".join(str(count) for count in dict.fromkeys([*counts[:1], *counts[-1:]]))
    lines.append(
        f"{len(found.contenders)} contenders were judged, each on {drives or 'no'} drives in each of "
        f"{len(found.scenarios) + 1} worlds, with the estimator {found.problem.estimators[0].name}, "
        f"seed {found.seed}."
    )
    return lines


def robust_conflict(found: RobustnessFindings) -> str:
    """Return which limits no contender meets together over the tolerance, by its bounds; empty if none."""
    items = [
        Evaluated(
            layout=judged.evaluated.layout,
            scores={
                **judged.evaluated.scores,
                **{
                    limit.score: Score(
                        value=judged.robust[limit.score].bound(limit), unit=judged.robust[limit.score].unit
                    )
                    for limit in found.limits
                },
            },
        )
        for judged in found.contenders
    ]
    return conflict_text(conflicts_of(found.limits, items), "judged over the tolerance")


def _choice_text(found: RobustnessFindings, name: str, choice: Choice) -> str:
    goal = found.problem.goals[1]
    item, judged = choice.judged.evaluated, choice.judged
    if not found.limits:
        why = "the knee of cost against error in its worlds"
    elif choice.held:
        why = f"the cheapest shown to meet every limit, {counted_text(choice.tried, 'layout')} tried"
    else:
        why = f"not shown to meet every limit, {counted_text(choice.tried, 'layout')} tried; the nearest to it"
    return (
        f"{name.capitalize()} layout: {item.layout.label} [{item.layout.short_key}], "
        f"{euros(item.scores[found.problem.goals[0]].value)}; "
        f"{score_name(goal)} {score_text(judged.scores[0], goal)} as planned, "
        f"{combined_text(judged, goal)} over the tolerance; {why}."
    )


def price_lines(found: RobustnessFindings) -> list[str]:
    """Return what the nominal layout loses in its worst world, and what the robust one costs and gives for it."""
    price, goal = found.price, found.problem.goals[1]
    if price is None:
        return []
    plain, safe = (found.choices[name].judged.evaluated.layout for name in ("nominal", "robust"))
    lines = [
        f"In the world that is worst for it ({faults_text(price.hardest)}) the {score_name(goal)} of the nominal "
        f"layout differs by {score_text(price.loss, goal, signed=True)} from that as planned, on the same drives."
    ]
    if not all(choice.held for choice in found.choices.values()):
        return [*lines, "Without a layout shown to meet every limit in both there is no price of robustness."]
    if plain.key == safe.key:
        return [*lines, "The nominal layout is the robust one: to be safe costs nothing."]
    return [
        *lines,
        f"Price of robustness: {signed_euros(price.cost_eur)}, from {euros(_cost(found, 'nominal'))} to "
        f"{euros(_cost(found, 'robust'))}; for it the robust layout is better by {score_text(price.gain, goal)} "
        f"in that world and by {score_text(price.nominal_gain, goal)} as planned.",
    ]


def _cost(found: RobustnessFindings, name: str) -> float:
    return found.choices[name].judged.evaluated.scores[found.problem.goals[0]].value


def faults_text(scenario: Scenario) -> str:
    """Return the faults that a tolerance speaks of, in words."""
    faults = scenario.faults
    height_m = faults.antenna_height_error_m
    return (
        f"tags off by {format_length(faults.tag_placement_sigma_m)}, {100.0 * faults.dead_tag_share:.3g} % dead, "
        f"{100.0 * faults.missed_read_share:.3g} % of reads missed"
        + (f", antennas {1000.0 * height_m:+.3g} mm" if height_m else "")
    )


def combined_text(judged: Judged, name: str) -> str:
    """Return value, bound on the bad side and drives in each world of a score over the tolerance."""
    found, like = judged.robust[name], judged.scores[0]
    if math.isnan(found.value):
        return NOT_KNOWN
    bound = f"at most {quantity_text(found.upper, like, name)}" if math.isfinite(found.upper) else "no bound"
    fewest = min(score.count for score in judged.scores)
    return f"{quantity_text(found.value, like, name)} ({bound}, n = {fewest})"
