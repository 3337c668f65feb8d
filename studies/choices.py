"""The sections of the report on what a user may choose: what more accuracy costs, and other layouts as good."""

from collections.abc import Mapping
from dataclasses import dataclass

from layoutopt.result import Evaluated
from layoutopt.score_text import shown_unit
from solvers.front_measures import ExchangeRate
from studies.alternatives import rule_text, signed_euros
from studies.findings import Findings
from studies.trade_off import front_text, next_step_text, rate_text


@dataclass(frozen=True, slots=True, kw_only=True)
class FrontRow:
    """A member of the front, how sure it is, and what the step to its dearer neighbour costs."""

    item: Evaluated
    roles: tuple[str, ...]
    share: float | None
    rate: ExchangeRate | None
    rate_text: str


def choices_of(findings: Findings) -> dict[str, object]:
    """Return what the sections show, by the names in the template ``choices.html``."""
    trade_off, recommended = findings.trade_off, findings.result.recommended
    goal = findings.problem.goals[1]
    return {
        "front_rows": _rows(findings, recommended),
        "next_steps": [next_step_text(trade_off, role) for role in recommended if role != "most accurate"],
        "front_text": front_text(trade_off),
        "alternatives": findings.alternatives,
        "rule": rule_text(findings.alternatives, goal),
        "one": shown_unit(goal)[1] or "unit",
        "signed_euros": signed_euros,
    }


def _rows(findings: Findings, recommended: Mapping[str, Evaluated]) -> list[FrontRow]:
    rates = {rate.cheaper.layout.key: rate for rate in findings.trade_off.rates}
    rows = []
    for item in findings.result.front.members:
        rate = rates.get(item.layout.key)
        rows.append(
            FrontRow(
                item=item,
                roles=tuple(role for role, other in recommended.items() if other.layout.key == item.layout.key),
                share=findings.trade_off.membership.get(item.layout.key),
                rate=rate,
                rate_text="" if rate is None else _unbroken(rate_text(rate, findings.trade_off.goal)),
            )
        )
    return rows


def _unbroken(text: str) -> str:
    """Return a rate that breaks over lines only before its interval or what it costs at least."""
    return text.replace(" ", "\u00a0").replace("\u00a0(", " (").replace(",\u00a0", ", ")
