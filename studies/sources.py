"""Where a study's methods come from: the references on the cards of everything that it used."""

from collections.abc import Iterable
from dataclasses import dataclass

from layoutopt import registry
from layoutopt.protocols import Card
from solvers import racing
from studies.findings import Findings


@dataclass(frozen=True, slots=True, kw_only=True)
class Source:
    """A part that was used: its kind, its name, what it does, and who described it."""

    kind: str
    name: str
    summary: str
    reference: str


def sources_of(findings: Findings) -> list[Source]:
    """Return the parts that a study used, each with its reference.

    These are estimators, objectives, families of readers and patterns, antenna models and the search.
    """
    problem = findings.problem
    layouts = [design.evaluated.layout for design in findings.designs]
    found = [_source("estimator", one.name, one.card) for one in problem.estimators]
    found += [_source("objective", type(one).__name__, one.card) for one in problem.objectives]
    groups = [group for layout in layouts for group in layout.readers]
    readers = sorted({group.name for group in groups})
    patterns = sorted({zone.pattern.name for layout in layouts for zone in layout.floor_tags.zones})
    found += _of_table("readers", "reader arrangement", readers)
    found += _of_table("patterns", "tag pattern", patterns)
    antennas = {type(group.antenna).__name__: group.antenna.card for group in groups}
    found += [_source("antenna model", name, card) for name, card in sorted(antennas.items())]
    found.append(_source("search", "racing", racing.CARD))
    return list(dict.fromkeys(found))


def _of_table(point: str, kind: str, names: Iterable[str]) -> list[Source]:
    known = registry.names(point)
    return [_source(kind, name, registry.card(point, name)) for name in names if name in known]


def _source(kind: str, name: str, card: Card) -> Source:
    return Source(kind=kind, name=name, summary=card.summary, reference=card.reference)
