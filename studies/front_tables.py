"""Tables beside the front: exchange rates, and the alternatives to the recommended layout."""

from pathlib import Path

from layoutopt.tables.cells import text_cell, write_csv
from solvers.layout_difference import WEIGHTS
from studies.columns import named, number, pair, unit_of
from studies.findings import Findings
from studies.trade_off import TradeOff


def write_exchange_rates(found: TradeOff, path: Path) -> None:
    """Write what accuracy costs between neighbours on the front, and from each recommended layout on.

    A rate without an upper end is not significant; one without any end is not known, or the dearer layout is shown
    to be no better.
    """
    unit = unit_of(found.goal)
    header = ["step", "cheaper", "dearer", "trials", "extra_cost_eur", *named("gain", unit)]
    header += [f"eur{f'_per_{unit}' if unit else ''}{end}" for end in ("", "_low", "_high")] + ["significant"]
    steps = [("neighbours", rate) for rate in found.rates]
    steps += [(f"next after {role}", rate) for role, rate in found.next_steps.items()]
    rows = [
        [
            name,
            rate.cheaper.layout.short_key,
            rate.dearer.layout.short_key,
            str(rate.gain.count),
            number(rate.extra_cost),
            *pair(rate.gain),
            *(number(end) for end in (rate.rate, rate.low, rate.high)),
            "yes" if rate.significant else "no",
        ]
        for name, rate in steps
    ]
    write_csv(path, header, rows)


def write_portfolio(findings: Findings, path: Path) -> None:
    """Write the alternatives to the recommended layout: what they cost and give, and how they differ from it.

    ``difference`` is of `solvers.layout_difference`, its parts after it; ``change`` is paired over common drives.
    """
    found, (cost, goal) = findings.alternatives, findings.problem.goals[:2]
    header = ["layout", "label", "instead_of", "cost_eur", "extra_cost_eur", *named(goal, unit_of(goal))]
    header += [*named("change", unit_of(goal)), "trials", "difference", *WEIGHTS, "words"]
    rows = [
        [
            entry.item.layout.short_key,
            text_cell(entry.item.layout.label),
            found.role,
            number(entry.item.scores[cost].value),
            number(entry.extra_cost),
            *pair(entry.item.scores[goal]),
            *pair(entry.change),
            str(entry.item.scores[goal].count),
            number(entry.difference.total),
            *(number(getattr(entry.difference, part)) for part in WEIGHTS),
            text_cell(entry.words),
        ]
        for entry in found.found
    ]
    write_csv(path, header, rows)
