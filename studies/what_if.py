"""What the report says of other worlds: faults that the study simulated, and commands for what it did not."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from layoutopt import registry
from layoutopt.journal import FROZEN_SPEC
from layoutopt.result import Evaluated
from layoutopt.scenario import Faults, Scenario
from layoutopt.score_text import percent_text
from layoutopt.scores import Score
from layoutopt.units import format_length
from studies.findings import Findings
from studies.held_out import difference
from studies.layout_cards import held_out_of

_STUDIES: Final = (
    ("placement_tolerance", "how much worse it gets the farther tags are laid from their places"),
    ("dead_tags", "how much worse it gets the more tags are dead"),
    (
        "robustness",
        "what it costs to be safe against a tolerance of installation, and which layout is then the best",
    ),
)
"""Studies that answer what the main one did not simulate, each with its question in words."""


@dataclass(frozen=True, slots=True, kw_only=True)
class World:
    """One world that was simulated, and how the recommended layouts did in it.

    ``errors`` and ``changes`` have an entry for each recommended layout: the goal there, and the goal there less
    that of the search.
    """

    scenario: Scenario
    placement: str
    dead: str
    missed: str
    errors: tuple[Score | None, ...]
    changes: tuple[Score | None, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Command:
    """A command that answers a question the study left open."""

    question: str
    text: str


def worlds_of(findings: Findings, items: Sequence[Evaluated]) -> list[World]:
    """Return the design scenario and each held-out one with the goal of some layouts in them."""
    problem = findings.problem
    search = [item.scores.get(problem.goals[1]) for item in items]
    found = [_world(problem.design, search, [None] * len(search))]
    for scenario in problem.held_out:
        errors = [held_out_of(findings, item.layout)[scenario.name].get(problem.goals[1]) for item in items]
        changes = [
            None if before is None or after is None else difference(after, before)
            for before, after in zip(search, errors, strict=True)
        ]
        found.append(_world(scenario, errors, changes))
    return found


def commands_of(item: Evaluated | None) -> list[Command]:
    """Return what answers further questions, to be run in the folder of the study."""
    known = registry.names("studies")
    found = [
        Command(question=question, text=f"layoutopt study {name} {FROZEN_SPEC}")
        for name, question in _STUDIES
        if name in known
    ]
    found.append(
        Command(
            question="what the whole front is under other prices, layouts that are not on this page included",
            text="layoutopt reprice . my_prices.toml",
        )
    )
    if item is not None:
        found.append(
            Command(
                question="what each reader and each row of tags is worth, on new drives",
                text=f"layoutopt explain layouts/{item.layout.short_key}.toml",
            )
        )
    return found


def _world(scenario: Scenario, errors: Sequence[Score | None], changes: Sequence[Score | None]) -> World:
    faults: Faults = scenario.faults
    return World(
        scenario=scenario,
        placement=format_length(faults.tag_placement_sigma_m) if faults.tag_placement_sigma_m else "none",
        dead=percent_text(faults.dead_tag_share, 1) if faults.dead_tag_share else "none",
        missed=percent_text(faults.missed_read_share, 1) if faults.missed_read_share else "none",
        errors=tuple(errors),
        changes=tuple(changes),
    )
