"""Rows of the report's tables: recommended layouts, members of the front, demands, held-out drives, refusals."""

import re
from collections import Counter
from collections.abc import Collection, Mapping
from dataclasses import dataclass
from itertools import groupby
from typing import Final

from layoutopt.layout import Layout
from layoutopt.parts import BillOfMaterial
from layoutopt.problem import Limit
from layoutopt.result import Evaluated, Validation
from layoutopt.scores import Score, Scores
from solvers.front_measures import exchange_rate
from studies.findings import Findings
from studies.held_out import own_rows
from studies.layout_cards import cost_objective
from studies.one_steps import OneStep
from studies.report_words import verdict, verdict_of_all, with_exact
from studies.trade_off import rate_text

_REASONS_SHOWN: Final = 6


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
            for row in own_rows(findings.problem, findings.validations, item.layout)
        ),
    )


def limit_rows_of(findings: Findings) -> list[LimitRow]:
    """Return a row for each recommended layout and demand."""
    rows = []
    for role, item in findings.result.recommended.items():
        held_out = [
            (row.scenario, with_exact(item.scores, row.scores))
            for row in own_rows(findings.problem, findings.validations, item.layout)
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


@dataclass(frozen=True, slots=True, kw_only=True)
class ValidatedRow:
    """One estimator on the held-out drives of one scenario; ``drives`` if all its scores rest on as many."""

    found: Validation
    drives: int | None


@dataclass(frozen=True, slots=True, kw_only=True)
class ValidatedLayout:
    """A layout on held-out drives: its role or short key, its label, and rows by scenario."""

    name: str
    label: str
    scenarios: tuple[tuple[str, tuple[ValidatedRow, ...]], ...]

    @property
    def count(self) -> int:
        """Number of rows."""
        return sum(len(rows) for _, rows in self.scenarios)


def validated_layouts(findings: Findings, columns: Collection[str], *, recommended: bool) -> list[ValidatedLayout]:
    """Return the held-out rows of the recommended layouts, or of all others, in their order."""
    own = {item.layout.key for item in findings.result.recommended.values()}
    labels = _labels(findings)
    grouped: dict[str, list[Validation]] = {}
    for row in findings.validations:
        if (row.layout_key in own) == recommended:
            grouped.setdefault(row.layout_key, []).append(row)
    return [
        ValidatedLayout(
            name=labels[key][0] if key in labels else key[:10],
            label=labels[key][1] if key in labels else "",
            scenarios=tuple(
                (scenario, tuple(ValidatedRow(found=row, drives=_drives(row, columns)) for row in some))
                for scenario, some in groupby(rows, key=lambda row: row.scenario)
            ),
        )
        for key, rows in grouped.items()
    ]


def _drives(row: Validation, columns: Collection[str]) -> int | None:
    counts = {score.count for name, score in (row.scores or {}).items() if name in columns}
    return counts.pop() if len(counts) == 1 else None


def _labels(findings: Findings) -> Mapping[str, tuple[str, str]]:
    """Return role (or short key) and label by key, for every layout that the findings hold."""
    items = [design.evaluated.layout for design in findings.designs]
    items += [item.layout for item in (*findings.result.front.members, *findings.result.recommended.values())]
    found = {layout.key: (layout.short_key, layout.label) for layout in items}
    for role, item in reversed(list(findings.result.recommended.items())):
        found[item.layout.key] = (role, item.layout.label)
    return found


@dataclass(frozen=True, slots=True, kw_only=True)
class StepRow:
    """A layout one step away; ``rate_text`` is what a unit of accuracy costs by it, empty if it costs no more."""

    step: OneStep
    rate_text: str


def step_rows(findings: Findings) -> list[StepRow]:
    """Return the layouts one step from the first recommended one."""
    first = next(iter(findings.result.recommended.values()), None)
    goals = findings.problem.goals[:2]
    rows = []
    for step in () if first is None else findings.one_steps:
        gain = Score(
            value=-step.change.value,
            unit=step.change.unit,
            standard_error=step.change.standard_error,
            count=step.change.count,
        )
        text = ""
        if first is not None and step.verdict == "better" and step.extra_cost > 0.0:
            text = rate_text(exchange_rate(first, step.item, goals, gain), goals[1])
        rows.append(StepRow(step=step, rate_text=text))
    return rows


def bills_of(findings: Findings) -> list[tuple[str, BillOfMaterial]]:
    """Return role and bill of each recommended layout; none if the problem has no prices."""
    cost = cost_objective(findings)
    if cost is None:
        return []
    return [
        (role, cost.bill(item.layout, findings.problem.design))
        for role, item in findings.result.recommended.items()
    ]


def refusals_of(findings: Findings) -> list[tuple[int, str]]:
    """Return how many layouts were refused for which reason, an example of each, most frequent first."""
    examples: dict[str, str] = {}
    numbers: Counter[str] = Counter()
    for design in findings.designs:
        if design.refusal:
            kind = re.sub(r"\b\d[\d.]*\b", "#", design.refusal)
            examples.setdefault(kind, design.refusal)
            numbers[kind] += 1
    ordered = sorted(numbers.items(), key=lambda entry: (-entry[1], entry[0]))
    return [(count, examples[kind]) for kind, count in ordered[:_REASONS_SHOWN]]
