"""What the command line prints of findings and of effort: plain lines, every simulated figure with its error."""

from pathlib import Path

from studies.effort import Effort
from studies.findings import Findings
from studies.score_text import euros, score_text


def findings_lines(findings: Findings, folder: Path | None) -> list[str]:
    """Return status, recommended layouts with held-out scores, and where to look."""
    result, goal = findings.result, findings.problem.goals[1]
    lines = [result.status.value]
    if result.shortfall:
        lines.append(f"Shortfall: {result.shortfall}.")
    for item in {item.layout.key: item for item in result.recommended.values()}.values():
        roles = [role for role, other in result.recommended.items() if other.layout.key == item.layout.key]
        lines.append(f"{', '.join(roles)}: {item.layout.label} [{item.layout.short_key}]")
        lines.append(f"  cost {euros(item.scores[findings.problem.goals[0]].value)}")
        lines += [f"  {findings.reasons[role]}" for role in roles]
        lines.append(f"  search    {score_text(item.scores[goal])}")
        lines += [
            f"  {row.scenario}, {row.estimator}: {score_text(row.scores[goal])}"
            + (f", optimism {score_text(row.optimism, signed=True)}" if row.optimism is not None else "")
            for row in findings.validations
            if row.layout_key == item.layout.key and row.scores is not None
        ]
    lines.append(
        f"{len(findings.designs)} layouts, {sum(not design.refusal for design in findings.designs)} raced, "
        f"{result.trials} search trials, front of {len(result.front)}, seed {findings.seed}"
    )
    if folder is not None and result.front.members:
        lines.append(f"report: {folder / 'report.html'}")
    return lines


def front_lines(findings: Findings) -> list[str]:
    """Return the front, a line a member."""
    cost, goal = findings.problem.goals[:2]
    return [
        f"{euros(item.scores[cost].value):>16}  {score_text(item.scores[goal]):32}  {item.layout.label}"
        for item in findings.result.front.members
    ]


def effort_lines(effort: Effort, jobs: int) -> list[str]:
    """Return what a study would run and how long that takes here."""
    return [
        f"layouts: {effort.layouts}, of which {effort.contenders} can be built within the limits on exact scores",
        *(f"  refused by the rule of {rule}: {count}" for rule, count in effort.refusals),
        f"search: {effort.search_trials} trials; validation: about {effort.validation_trials} trials",
        f"predicted: {effort.seconds / 60.0:.1f} min with {jobs} workers "
        f"({effort.trial_s * 1000.0:.0f} ms a trial, measured on a pilot)",
    ]
