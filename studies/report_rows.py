"""Rows of the report's tables: recommended layouts, members of the front, demands."""

from dataclasses import dataclass

from layoutopt.layout import Layout
from layoutopt.problem import Limit
from layoutopt.result import Evaluated
from layoutopt.scores import Score, Scores
from studies.findings import Findings
from studies.layout_cards import own_validations
from studies.report_words import verdict, verdict_of_all, with_exact


@dataclass(frozen=True, slots=True, kw_only=True)
class HeldOut:
    """How a layout did in one held-out scenario with the estimator that the search used."""

    scenario: str
    error: Score | None
    optimism: Score | None
    verdict: str


@dataclass(frozen=True, slots=True, kw_only=True)
class Row:
    """A layout as the tables show it."""

    roles: tuple[str, ...]
    reason: str
    layout: Layout
    scores: Scores
    tags: int
    antennas: int
    modules: int
    extrapolated: bool
    held_out: tuple[HeldOut, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class LimitRow:
    """A demand on one recommended layout: its score in the search, and each held-out one with the verdict."""

    role: str
    limit: Limit
    search: Score | None
    held_out: tuple[tuple[str, Score | None, str], ...]


def recommended_rows(findings: Findings) -> list[Row]:
    """Return one row for each recommended layout."""
    return [row_of(item, findings) for item in recommended_of(findings)]


def recommended_of(findings: Findings) -> list[Evaluated]:
    """Return each recommended layout once, whatever the number of its roles."""
    return list({item.layout.key: item for item in findings.result.recommended.values()}.values())


def row_of(item: Evaluated, findings: Findings) -> Row:
    """Return a layout as the tables show it."""
    roles = tuple(
        role for role, chosen in findings.result.recommended.items() if chosen.layout.key == item.layout.key
    )
    reasons = [findings.reasons[role] for role in roles if role in findings.reasons]
    return Row(
        roles=roles,
        reason="; ".join(dict.fromkeys(reasons)),
        layout=item.layout,
        scores=item.scores,
        tags=len(item.layout.floor_tags.lay_on(findings.problem.design.site)),
        antennas=sum(group.count for group in item.layout.readers),
        modules=sum(group.module_count for group in item.layout.readers),
        extrapolated=item.layout.extrapolated,
        held_out=tuple(
            HeldOut(
                scenario=row.scenario,
                error=(row.scores or {}).get(findings.problem.goals[1]),
                optimism=row.optimism,
                verdict=verdict_of_all(findings.problem.limits, with_exact(item.scores, row.scores)),
            )
            for row in own_validations(findings, item.layout)
        ),
    )


def limit_rows_of(findings: Findings) -> list[LimitRow]:
    """Return a row for each recommended layout and demand."""
    rows = []
    for role, item in findings.result.recommended.items():
        held_out = [
            (row.scenario, with_exact(item.scores, row.scores)) for row in own_validations(findings, item.layout)
        ]
        rows += [
            LimitRow(
                role=role,
                limit=limit,
                search=item.scores.get(limit.score),
                held_out=tuple(
                    (scenario, scores.get(limit.score), verdict(limit, scores)) for scenario, scores in held_out
                ),
            )
            for limit in findings.problem.limits
        ]
    return rows
