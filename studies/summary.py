"""What the command line prints of findings: plain lines, every simulated figure with its error."""

from pathlib import Path
from typing import Final

from layoutopt.result import Evaluated, Status
from layoutopt.score_text import counted_text, euros, limit_text, score_name, score_text
from studies import alternatives, dead_reckoning, held_out, pairing, report_words, screening, trade_off
from studies.cells import ENOUGH_HELD_OUT, status_text
from studies.findings import Findings
from studies.layout_cards import held_out_of

_VERDICTS: Final = {"broken": "missed", "undecided": "not decided"}


def findings_lines(findings: Findings, folder: Path | None) -> list[str]:
    """Return status, recommended layouts with held-out scores, and where to look.

    How well drives were paired and what a screen would have dropped is said of a study alone, which has a folder.
    Estimators that read no tags are left out of a layout's rows: what they reach is the same beside every layout,
    and told once.
    """
    result, goal = findings.result, findings.problem.goals[1]
    without_tags = dead_reckoning.need_for_tags(findings)
    blind = {row.estimator for row in without_tags.rows}
    lines = [verdict(findings)]
    if result.shortfall:
        title = "Why" if result.status is Status.STOPPED_BY_LIMIT else "Shortfall"
        lines.append(f"{title}: {result.shortfall}.")
    if findings.problem.limits:
        lines.append(f"Demand: {'; '.join(limit_text(limit) for limit in findings.problem.limits)}.")
    if findings.problem.elsewhere:
        lines.append(f"Not looked at here: {'; '.join(findings.problem.elsewhere)}.")
    if result.recommended:
        lines.append(
            f"Judged with the estimator {findings.problem.estimators[0].name}, which the robots have to run; "
            "rows of other estimators say what they would get."
        )
    for item in {item.layout.key: item for item in result.recommended.values()}.values():
        roles = [role for role, other in result.recommended.items() if other.layout.key == item.layout.key]
        lines.append(f"{', '.join(roles)}: {item.layout.label} [{item.layout.short_key}]")
        lines.append(f"  cost {euros(item.scores[findings.problem.goals[0]].value)}")
        lines += [f"  {findings.reasons[role]}" for role in roles]
        if item.layout.extrapolated:
            lines.append("  the antenna model is extrapolated to this antenna: measure one before buying")
        lines.append(f"  search    {score_text(item.scores[goal], goal)}")
        lines += [
            f"  {row.scenario}, {row.estimator}: {score_text(row.scores[goal], goal)}"
            + (f", optimism {score_text(row.optimism, goal, signed=True)}" if row.optimism is not None else "")
            for row in findings.validations
            if row.layout_key == item.layout.key and row.scores is not None and row.estimator not in blind
        ]
        lines += [f"  {text}" for text in _demand_texts(findings, item)]
    if result.recommended:
        lines.append(f"{dead_reckoning.QUESTION} {without_tags.text}")
    if findings.candidates_validated > 1:
        lines.append(
            f"{findings.candidates_validated} layouts were tried on held-out drives, cheapest first, "
            "each at 95 %; with several tries the chance that the last one passed by luck grows"
        )
    if passed := passed_over_text(findings):
        lines.append(passed)
    lines += [f"failed: {message}" for message in sorted(set(findings.failures.values()))]
    lines.append(
        f"{len(findings.designs)} layouts, {sum(not design.refusal for design in findings.designs)} raced, "
        f"{result.trials} search trials, front of {len(result.front)}, seed {findings.seed}"
    )
    lines += trade_off.trade_off_lines(findings.trade_off, result.recommended)
    lines += alternatives.alternatives_lines(findings.alternatives, goal)
    if folder is not None:
        lines += pairing.pairing_lines(findings.pairing)
        lines += screening.screening_lines(screening.screening_of(findings))
    if folder is not None and result.front.members:
        lines.append(f"report: {folder / 'report.html'}")
    if folder is not None and result.status is Status.TARGET_MET and too_few_drives(findings) is None:
        first = next(iter(result.recommended.values())).layout
        lines.append(f"next: layoutopt draw {folder / 'layouts' / f'{first.short_key}.toml'} --out drawings")
    return lines


def _demand_texts(findings: Findings, item: Evaluated) -> list[str]:
    """Return what the held-out drives say of each demand, in the scenario that is the worst for it.

    A demand on the goal that is met needs no line, because the errors above tell it.
    """
    goal, told = findings.problem.goals[1], []
    for limit in findings.problem.limits:
        known = [
            (limit.ratio(limit.bound(scores[limit.score])), scenario, scores)
            for scenario, scores in held_out_of(findings, item.layout).items()
            if limit.score in scores
        ]
        if not known:
            continue
        _, scenario, scores = max(known, key=lambda entry: entry[0])
        judged = report_words.verdict(limit, scores)
        if judged != "met" or limit.score != goal:
            score = score_text(scores[limit.score], limit.score)
            told.append(f"{_VERDICTS.get(judged, judged)}: {limit_text(limit)}: {score} in {scenario}")
    return told


def verdict(findings: Findings) -> str:
    """Return how the study ended in a sentence; few held-out drives do not show that limits are met."""
    few = too_few_drives(findings)
    return status_text(findings.result.status, ENOUGH_HELD_OUT if few is None else few)


def passed_over_text(findings: Findings) -> str:
    """Return a sentence on cheaper layouts that met the limits in search and were left there, or nothing."""
    if not findings.passed_over:
        return ""
    cost = findings.problem.goals[0]
    number = counted_text(len(findings.passed_over), "cheaper layout")
    undriven, told = [], []
    for item in findings.passed_over:
        said = held_out.verdict_text(findings.problem, findings.validations, item)
        named = f"{item.layout.label} [{item.layout.short_key}] for {euros(item.scores[cost].value)}"
        if not said:
            undriven.append(named)
            continue
        few = ", which are too few to take it" if said.startswith("met") else ""
        driven = "" if said.startswith("was ") else "was driven there all the same and "
        told.append(f"{named} {driven}{said}{few}")
    start = (
        f"{number} met every limit in search, but would miss one on "
        "held-out drives by losing there what the front lost"
    )
    if not undriven:
        return "; ".join([start, *told]) + "."
    none = f"none was tried there; the cheapest is {undriven[0]}."
    return f"{start}, so {none}" if not told else "; ".join([start, *told, f"of the other {len(undriven)} {none}"])


def too_few_drives(findings: Findings) -> int | None:
    """Return on how few held-out drives a layout met every limit; ``None`` if they are enough, or none did."""
    result, goal = findings.result, findings.problem.goals[1]
    if result.status is not Status.TARGET_MET:
        return None
    chosen = {item.layout.key for item in result.recommended.values()}
    judged = [row.scores for row in findings.validations if row.layout_key in chosen and row.scores is not None]
    fewest = min((scores[goal].count for scores in judged if goal in scores), default=ENOUGH_HELD_OUT)
    return fewest if fewest < ENOUGH_HELD_OUT else None


def front_lines(findings: Findings) -> list[str]:
    """Return the front, a line a member."""
    cost, goal = findings.problem.goals[:2]
    return [
        f"{'cost':>16}  {score_name(goal):32}  layout",
        *(
            f"{euros(item.scores[cost].value):>16}  {score_text(item.scores[goal], goal):32}  "
            f"{item.layout.label} [{item.layout.short_key}]"
            for item in findings.result.front.members
        ),
    ]
