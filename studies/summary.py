"""What the command line prints of findings and of effort: plain lines, every simulated figure with its error."""

from pathlib import Path

from layoutopt.result import Evaluated
from layoutopt.scores import Score
from studies.effort import Effort
from studies.findings import Findings


def findings_lines(findings: Findings, folder: Path | None) -> list[str]:
    """Return status, recommended layouts with held-out scores, and where to look."""
    result, goal = findings.result, findings.problem.goals[1]
    lines = [result.status.value]
    if result.shortfall:
        lines.append(f"Shortfall: {result.shortfall}.")
    for role, item in result.recommended.items():
        lines.append(f"{role}: {item.layout.label} [{item.layout.short_key}]")
        lines.append(f"  cost {item.scores[findings.problem.goals[0]].value:.2f} EUR, {findings.reasons[role]}")
        lines.append(f"  search    {_millimetres(item.scores[goal])}")
        lines += [
            f"  {row.scenario}, {row.estimator}: {_millimetres(row.scores[goal])}"
            + (f", optimism {_millimetres(row.optimism, signed=True)}" if row.optimism is not None else "")
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
        f"{_cost(item, cost)}  {_millimetres(item.scores[goal]):32}  {item.layout.label}"
        for item in findings.result.front.members
    ]


def effort_lines(effort: Effort, jobs: int) -> list[str]:
    """Return what a study would run and how long that takes here."""
    return [
        f"layouts: {effort.layouts}, of which {effort.contenders} can be built within the limits on exact scores",
        f"search: {effort.search_trials} trials; validation: about {effort.validation_trials} trials",
        f"predicted: {effort.seconds / 60.0:.1f} min with {jobs} workers "
        f"({effort.trial_s * 1000.0:.0f} ms a trial, measured on a pilot)",
    ]


def _cost(item: Evaluated, name: str) -> str:
    return f"{item.scores[name].value:10.2f} EUR"


def _millimetres(score: Score, *, signed: bool = False) -> str:
    value = f"{score.value * 1000.0:{'+' if signed else ''}.2f}"
    return f"{value} ± {score.standard_error * 1000.0:.2f} mm (n = {score.count})"
