"""An explained layout in lines for people and in plain types for programs."""

import math
from collections.abc import Sequence
from typing import Final

from layoutopt.problem import Limit
from layoutopt.score_text import (
    NOT_KNOWN,
    counted_text,
    euros,
    limit_text,
    percent_text,
    quantity_text,
    rough_text,
    score_name,
    score_text,
    shown_unit,
)
from layoutopt.scores import Score
from objectives.cost import Cost
from solvers.conflicts import Relaxation, conflict_text
from studies.alternatives import signed_euros
from studies.explain import CONFIDENCE, PLACE_TRIALS, Explained, Step
from studies.explain_limits import BINDING_USE, LimitUse
from studies.trade_off import amount_text

_ORDER: Final = (
    "antenna less",
    "antenna more",
    "antenna side",
    "antenna height",
    "module",
    "tag pattern",
    "tag row",
)
"""Kinds of steps in the order in which they are told."""
_PARTS: Final = (
    ("antenna less", "Antennas, taken away one by one ({count}):"),
    ("tag row", "Rows of tags, left out in {count} ways:"),
)
"""Kind of step, and how the short answer about it begins."""


def explained_lines(found: Explained) -> list[str]:
    """Return the answer in plain words, then what it rests on.

    That is limits, worth of each part, what the next euro buys, what could be saved, and limits in conflict.
    """
    goal = found.problem.goals[1]
    last = found.first + found.trials - 1
    lines = [f"{found.layout.short_key}  {found.layout.label}"]
    drives = (
        f"held-out drives {found.first} to {last} of each scenario, estimator {found.problem.estimators[0].name}, "
        f"seed {found.seed}"
    )
    if found.refusal:
        return [*lines, drives, f"cannot be built or judged: {found.refusal}"]
    lines.append(f"cost {euros(found.cost_eur)}{_fleet_text(found)}")
    lines += ["", "In short", *(f"  {line}" for line in _short_lines(found)), "", drives]
    lines += [f"{score_name(goal)} on {name}: {score_text(score, goal)}" for name, score in found.scores.items()]
    lines += [f"failed: {text}" for text in sorted(set(found.failures.values()))]
    lines += _limit_lines(found)
    lines += _worth_lines(found)
    lines += _choice_lines(found)
    refused = [step for step in found.steps if step.refusal]
    if refused:
        lines += ["", "One step away, but cannot be built or judged"]
        lines += [f"  {step.variant.change}: {step.refusal}" for step in refused]
    text = conflict_text(found.conflicts, "here or one step away")
    if text:
        lines += ["", "Limits in conflict", f"  {text}"]
    return lines


def _short_lines(found: Explained) -> list[str]:
    """Return in plain words whether it holds, what its parts are worth, where to spend and where to save."""
    lines = [_verdict(found)]
    close = [use for use in found.limits if use.met and use.use >= BINDING_USE]
    if close:
        told = ", ".join(f"{limit_text(use.limit)} ({percent_text(use.use)} used)" for use in close)
        lines.append(f"Close to the end: {told}.")
    for kind, part in _PARTS:
        steps = [step for step in found.judged if step.variant.kind == kind]
        if steps:
            lines.append(f"{part.format(count=len(steps))} {_worth(found, steps)}")
    if found.bought:
        best = found.bought[0]
        lines.append(f"Spend the next euro on this: {best.variant.change} ({_rate_text(found, best)}).")
    else:
        lines.append("The next euro: no single step makes it better for certain.")
    if found.saved:
        best = found.saved[0]
        lines.append(f"Save on this: {best.variant.change} ({signed_euros(best.cost_eur)}).")
    elif all(use.met for use in found.limits):
        lines.append("Savings: no single cheaper step still meets every limit.")
    return lines


def _verdict(found: Explained) -> str:
    """Return whether the layout meets its limits, which it misses by how much, and which are not decided."""
    count = len(found.limits)
    if not count:
        return "No limit is set on what is looked at here."
    if all(use.met for use in found.limits):
        return f"It meets {'its limit' if count == 1 else f'all {count} limits'}."
    broken = [use for use in found.limits if use.broken]
    undecided = [use for use in found.limits if not (use.met or use.broken)]
    told = []
    if broken:
        misses = "; ".join(f"{limit_text(use.limit)}, {_missed_by(use)}" for use in broken)
        told.append(f"It misses {len(broken)} of {counted_text(count, 'limit')}: {misses}.")
    if undecided:
        left = "; ".join(f"{limit_text(use.limit)}, {_undecided_by(use)}" for use in undecided)
        told.append(f"{len(undecided)} of {counted_text(count, 'limit')} not decided: {left}.")
    return " ".join(told)


def _missed_by(use: LimitUse) -> str:
    if use.score is None:
        return NOT_KNOWN
    return f"by {rough_text(abs(use.slack), use.score, use.limit.score)}"


def _undecided_by(use: LimitUse) -> str:
    if use.score is None or math.isnan(use.score.value):
        return NOT_KNOWN
    if use.more_trials:
        return f"of which {use.more_trials} drives would show enough (--trials)"
    return f"{score_text(use.score, use.limit.score)}, which more drives would tell (--trials)"


def _worth(found: Explained, steps: Sequence[Step]) -> str:
    """Return how many of the steps lose accuracy for certain, how much, and how many break a limit."""
    worse = [step for step in steps if step.worse]
    breaking = [step for step in steps if _lost(found, step)]
    spared = sum(not step.worse and not _lost(found, step) for step in steps)
    parts = ["for none of them the error grows for certain"]
    if worse:
        factor, unit = shown_unit(found.problem.goals[1])
        changes = sorted(step.differences[found.scenario].value * factor for step in worse)
        which = "for each" if len(worse) == len(steps) else f"for {len(worse)} of {len(steps)}"
        span = f"{changes[0]:.2g}" if len(changes) == 1 else f"{changes[0]:.2g} to {changes[-1]:.2g}"
        parts = [f"{which} the error grows for certain, by {span} {unit}".rstrip()]
    if breaking:
        parts.append(f"{len(breaking)} would break a limit")
    if spared:
        parts.append(f"{spared} may not be needed, which more drives would tell (--trials)")
    return f"{'; '.join(parts)}."


def _lost(found: Explained, step: Step) -> list[Limit]:
    """Return the limits that the layout meets and the step misses."""
    kept = {use.limit for use in found.limits if use.met}
    return [limit for limit in step.misses if limit in kept]


def _limit_lines(found: Explained) -> list[str]:
    elsewhere = [f"  not looked at here: {text}" for text in found.problem.elsewhere]
    if not found.limits:
        return ["", "Limits: the spec sets none on floor tags", *elsewhere]
    binding = f"binding: {percent_text(BINDING_USE)} used or more, or broken by the next cheaper layout"
    lines = ["", f"Limits ({binding})"]
    for use in found.limits:
        state = "missed" if use.broken else "open" if not use.met else "binding" if use.binding else ""
        lines.append(f"  {state:7}  {limit_text(use.limit)}: {_use_text(use)}")
    return [*lines, *elsewhere]


def _use_text(use: LimitUse) -> str:
    name = use.limit.score
    if use.score is None or math.isnan(use.score.value):
        return f"{NOT_KNOWN}, so it is not met"
    side = "at most" if use.limit.upper is not None else "at least"
    bound, slack = (quantity_text(value, use.score, name) for value in (use.bound, abs(use.slack)))
    text = score_text(use.score, name, bounded=False)
    if not use.score.exact:
        text += f", {side} {bound} at {percent_text(use.limit.confidence)} confidence"
    text += f"; {slack} {'left' if use.met else 'short'}, {percent_text(use.use)} used"
    if use.more_trials:
        text += f"; never seen, which {use.more_trials} trials would show to be within the limit"
    return text + (f"; the next cheaper layout breaks it: {use.broken_by}" if use.met and use.broken_by else "")


def _worth_lines(found: Explained) -> list[str]:
    lines = [
        "",
        f"One step away ({score_name(found.problem.goals[1])} on {found.scenario}, on the same drives; "
        f"all {len(found.judged)} intervals together hold at {percent_text(CONFIDENCE)})",
    ]
    steps = sorted(found.judged, key=lambda step: _ORDER.index(step.variant.kind))
    lines += [f"  {step.variant.change}: {_step_text(found, step)}" for step in steps]
    if any(step.variant.kind == "antenna more" for step in steps):
        lines.append(
            f"  (the place of one antenna more was chosen on {PLACE_TRIALS} other drives of "
            f"{found.problem.held_out[-1].name})"
        )
    return lines


def _step_text(found: Explained, step: Step) -> str:
    lost = [limit_text(limit) for limit in _lost(found, step)]
    missed = f"; then no longer shown to meet: {', '.join(lost)}" if lost else ""
    cost = f"cost {signed_euros(step.cost_eur)}" if step.cost_eur else "at the same cost"
    return f"{_change_text(found, step)}, {cost}{missed}"


def _change_text(found: Explained, step: Step) -> str:
    goal = found.problem.goals[1]
    difference = step.differences[found.scenario]
    factor, unit = shown_unit(goal)
    low, high = (end * factor for end in step.interval)
    interval = f"{low:+.2g} to {high:+.2g} {unit}".rstrip()
    if not (step.better or step.worse):
        return f"no significant change ({interval}, n = {difference.count})"
    value = f"{difference.value * factor:+.2g} {unit}".rstrip()
    return f"error {value} ({interval}, n = {difference.count})"


def _choice_lines(found: Explained) -> list[str]:
    lines = ["", "What the next euro buys (best rate first)"]
    for step in found.bought:
        lines.append(f"  {step.variant.change}: {_rate_text(found, step)}; {_step_text(found, step)}")
    if not found.bought:
        lines.append("  no single step makes it better for certain")
    limits = " that still meets every limit" if found.limits else ""
    lines += ["", f"What could be saved (each alone{', all limits still met' if found.limits else ''})"]
    lines += [f"  {step.variant.change}: {_step_text(found, step)}" for step in found.saved]
    if not found.saved:
        lines.append(f"  no single cheaper step{limits}")
    return lines


def _rate_text(found: Explained, step: Step) -> str:
    """Return the euros for one unit of accuracy with their interval, or that it costs nothing."""
    if step.cost_eur <= 0.0:
        return "for nothing"
    factor, unit = shown_unit(found.problem.goals[1])
    rate, low, high = (amount_text(end / factor) for end in (found.rate(step), *found.rate_interval(step)))
    return f"{rate} EUR ({low} to {high}) per {unit or 'unit'}"


def _fleet_text(found: Explained) -> str:
    """Return for how many robots the cost is; empty where the problem has no prices."""
    robots = next((item.robot_count for item in found.problem.objectives if isinstance(item, Cost)), 0)
    return f" for the floor and {counted_text(robots, 'robot')}" if robots else ""


def explained_json(found: Explained) -> dict[str, object]:
    """Return everything in plain types, SI units and EUR; what is not known is null."""
    return {
        "layout": found.layout.key,
        "label": found.layout.label,
        "seed": found.seed,
        "estimator": found.problem.estimators[0].name,
        "first_replication": found.first,
        "trials": found.trials,
        "refusal": found.refusal,
        "cost_eur": _number(found.cost_eur),
        "goal": found.problem.goals[1],
        "scenario": found.scenario,
        "scores": {name: _score(score) for name, score in found.scores.items()},
        "limits": [_limit(use) for use in found.limits],
        "intervals_together": CONFIDENCE,
        "steps": [_step(found, step) for step in found.steps],
        "bought": [step.variant.layout.key for step in found.bought],
        "saved": [step.variant.layout.key for step in found.saved],
        "conflicts": [[limit.score for limit in chosen] for chosen in found.conflicts.sets],
        "relaxations": [_relaxation(way) for way in found.conflicts.relaxations],
        "failures": sorted(set(found.failures.values())),
    }


def _limit(use: LimitUse) -> dict[str, object]:
    return {
        "score": use.limit.score,
        "upper": use.limit.upper,
        "lower": use.limit.lower,
        "confidence": use.limit.confidence,
        "value": None if use.score is None else _score(use.score),
        "bound": _number(use.bound),
        "slack": _number(use.slack),
        "use": _number(use.use),
        "met": use.met,
        "binding": use.binding,
        "broken_by": use.broken_by,
        "trials_needed": use.more_trials,
    }


def _step(found: Explained, step: Step) -> dict[str, object]:
    return {
        "kind": step.variant.kind,
        "change": step.variant.change,
        "layout": step.variant.layout.key,
        "refusal": step.refusal,
        "cost_eur": _number(step.cost_eur),
        "differences": {name: _score(score) for name, score in step.differences.items()},
        "interval": [_number(end) for end in step.interval],
        "significant": step.better or step.worse,
        "eur_per_unit": None if step.refusal else _number(found.rate(step)),
        "eur_per_unit_interval": [_number(end) for end in found.rate_interval(step)],
        "misses": [limit.score for limit in step.misses],
    }


def _relaxation(way: Relaxation) -> dict[str, object]:
    return {
        "layout": way.item.layout.key,
        "share": _number(way.share),
        "gives": [{"score": give.limit.score, "end": give.end, "amount": give.amount} for give in way.gives],
    }


def _score(score: Score) -> dict[str, object]:
    return {
        "value": _number(score.value),
        "unit": score.unit,
        "standard_error": _number(score.standard_error),
        "count": score.count,
    }


def _number(value: float) -> float | None:
    return value if math.isfinite(value) else None
