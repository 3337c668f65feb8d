"""What a study rests on: its methods, and the works that their cards name."""

import re
from collections.abc import Collection, Iterable, Sequence
from dataclasses import dataclass, fields, is_dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Final, get_type_hints

from layoutopt import registry
from layoutopt.citation import software, works_named
from layoutopt.errors import InvalidInput, did_you_mean
from layoutopt.journal import FROZEN_SPEC, MANIFEST, read_manifest, read_recorded
from layoutopt.problem import Problem
from layoutopt.spec.building import Spec
from layoutopt.spec.reading import read_spec
from layoutopt.spec.template import built_in

if TYPE_CHECKING:
    from studies.findings import Findings

_ASKED_OF: Final = {
    "docking": "bearing",
    "direction_quality": "bearing",
    "tracking": "target",
    "uhf_coverage": "target",
}
"""Objectives that speak of estimates of a kind, so that only studies with such an estimator use them."""
OWN_CELLS: Final = "published/"
"""Studies of papers have worlds and estimators of their own, whatever the spec says."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Cited:
    """A method that a study uses: its extension point and name there, what it does, and where it comes from."""

    point: str
    name: str
    summary: str
    reference: str


def methods_of_study(name: str, spec: Spec | None = None) -> tuple[Cited, ...]:
    """Return the methods of a study: itself, its solvers, and what it takes from a spec (the built-in one).

    Raises
    ------
    UnknownName
        If there is no such study.
    """
    found = _of_study(name)
    if name.startswith(OWN_CELLS):
        return found
    spec = read_spec(built_in()) if spec is None else spec
    estimators = _cited("estimators", [estimator.name for estimator in spec.problem().estimators])
    return (*found, *estimators, *_of_spec(spec, estimators))


def methods_of_findings(findings: "Findings") -> tuple[Cited, ...]:
    """Return the methods of a cost-against-accuracy study that was run, and the families of its layouts."""
    problem = findings.problem
    layouts = [design.evaluated.layout for design in findings.designs]
    groups = [group for layout in layouts for group in layout.readers]
    estimators = _cited("estimators", [estimator.name for estimator in problem.estimators])
    return (
        *_of_study("cost_vs_accuracy"),
        *estimators,
        *_objectives(problem, estimators),
        *_cited("antennas", _rows_of("antennas", {type(group.antenna) for group in groups})),
        *_cited("readers", {group.name for group in groups}),
        *_cited("patterns", {pattern.name for layout in layouts for _, pattern in layout.floor_tags.patterns()}),
    )


def methods_told(name: str, text: str) -> tuple[Cited, ...]:
    """Return the methods of a study's page: the study itself, its solvers, and estimators that its text names."""
    told = {
        known for known in registry.names("estimators") if re.search(rf"(?<!\w){re.escape(known)}(?!\w)", text)
    }
    return (*_of_study(name), *_cited("estimators", told))


def methods_of_folder(folder: Path) -> tuple[Cited, ...]:
    """Return the methods of the study in a folder, with the estimators whose trials its journal holds.

    Raises
    ------
    StudyDamaged, InvalidInput
        If the folder holds no study that can be read.
    """
    name = str(read_manifest(folder).get("study"))
    if name not in registry.names("studies"):
        problem = f"there is no study named {name!r}"
        raise InvalidInput.at(str(folder / MANIFEST), problem, did_you_mean(name, registry.names("studies")))
    estimators = _cited("estimators", {item.group.estimator for item in read_recorded(folder).values()})
    own = () if name.startswith(OWN_CELLS) else _of_spec(read_spec(folder / FROZEN_SPEC), estimators)
    return (*_of_study(name), *estimators, *own)


def cited_lines(methods: Sequence[Cited]) -> list[str]:
    """Return in words how to cite layoutopt, and what each method rests on."""
    lines = ["layoutopt:", f"  {software().text}"]
    if methods:
        lines.append("methods, and what they rest on:")
        lines += [f"  {item.point} {item.name}: {item.reference}" for item in methods]
    named = works_named(item.reference for item in methods)
    if named:
        lines.append("works:")
        lines += [f"  [{work.key}] {work.text}" for work in named]
    return lines


def cited_bibtex(methods: Sequence[Cited]) -> list[str]:
    """Return the entries of BibTeX of layoutopt and of the works that the methods rest on."""
    named = works_named(item.reference for item in methods)
    return [work.bibtex for work in (software(), *named)]


def _of_study(name: str) -> tuple[Cited, ...]:
    study = registry.load("studies", name, place="layoutopt cite")
    hints = get_type_hints(study) if is_dataclass(study) else {}
    held = [hints[field.name] for field in fields(study)] if is_dataclass(study) else []
    return (*_cited("studies", [name]), *_cited("solvers", _rows_of("solvers", held)))


def _of_spec(spec: Spec, estimators: Iterable[Cited]) -> tuple[Cited, ...]:
    """Return the objectives of a spec and the families of its space."""
    antennas = _rows_of("antennas", [type(mount.antenna) for mounts in spec.mounts for mount in mounts])
    return (
        *_objectives(spec.problem(), estimators),
        *_cited("antennas", antennas),
        *_cited("readers", {family.name for family in spec.space.readers}),
        *_cited("patterns", {family.name for zone in spec.space.patterns.values() for family in zone}),
    )


def _objectives(problem: Problem, estimators: Iterable[Cited]) -> tuple[Cited, ...]:
    """Return the objectives that speak of what these estimators estimate."""
    asked = {registry.card("estimators", item.name).estimates for item in estimators}
    objectives = [
        name
        for name in _rows_of("objectives", [type(objective) for objective in problem.objectives])
        if _ASKED_OF.get(name, "robot") in asked
    ]
    return _cited("objectives", objectives)


def _rows_of(point: str, objects: Collection[object]) -> list[str]:
    """Return the names of a table whose objects are among some."""
    return [name for name in registry.names(point) if registry.load(point, name) in objects]


def _cited(point: str, names: Collection[str]) -> tuple[Cited, ...]:
    """Return what the cards say of those names that the table has, in its order."""
    cards = {name: registry.card(point, name) for name in registry.names(point) if name in names}
    return tuple(
        Cited(point=point, name=name, summary=card.summary, reference=card.reference)
        for name, card in cards.items()
    )
