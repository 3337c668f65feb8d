"""The closing round of the study of zones: held-out drives for cheaper layouts that neither held nor missed."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Final

from layoutopt.problem import Limit, Problem
from layoutopt.protocols import Group, Task, group_of
from layoutopt.result import Evaluated
from layoutopt.scenario import Scenario
from layoutopt.scores import Score, TrialOutcomes
from studies import held_out
from studies.zones_candidates import Effort
from studies.zones_validation import Kind, Outlook

HELD, MISSED, OPEN = "held", "missed", "open"
_PARTS: Final = 4
"""Of the error rate each of two kinds has one part for what is taken to miss, and one for what is accepted."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Closed:
    """How a layout stands after the closing round.

    Attributes
    ----------
    word
        ``"held"``, ``"missed"`` or ``"open"``.
    sharpest
        Of one that held the worst bound; of any other the bound that shows a miss, or is nearest to showing one.
        ``None`` where no drive says anything.
    drives
        Its held-out drives by scenario.
    """

    item: Evaluated
    word: str
    sharpest: Outlook | None
    drives: Mapping[str, int]


@dataclass(frozen=True, slots=True, kw_only=True)
class Closing:
    """How the closing round stands.

    Attributes
    ----------
    entered
        For each kind the layouts below the accepted one that were open before the round.
    closed
        How these stand now, by rising cost.
    accepted
        For each kind the cheapest one that held in this round, if any did.
    spent
        Held-out drives of the round.
    """

    entered: Mapping[str, int] = field(default_factory=dict)
    closed: Mapping[str, tuple[Closed, ...]] = field(default_factory=dict)
    accepted: Mapping[str, Evaluated] = field(default_factory=dict)
    spent: int = 0

    def still_open(self, kind: str) -> tuple[Closed, ...]:
        """Return the layouts of a kind that are open and cheaper than what was accepted in this round."""
        held = self.accepted.get(kind)
        most_eur = math.inf if held is None else _rank(held)[0]
        return tuple(
            one for one in self.closed.get(kind, ()) if one.word == OPEN and _rank(one.item)[0] < most_eur
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class Evidence:
    """What verdicts rest on.

    Attributes
    ----------
    limits
        Those on columns of the outcomes.
    first_looks
        Scenarios, that of the search before the held-out ones, and the drives of the first look in each; every
        further look is at twice as many.
    known, failed
        Outcomes, and why tasks failed.
    """

    problem: Problem
    limits: tuple[Limit, ...]
    first_looks: tuple[tuple[Scenario, int], ...]
    known: Mapping[Group, TrialOutcomes]
    failed: Mapping[Group, str]

    def count(self, item: Evaluated, scenario: Scenario) -> int:
        """Return the number of drives of a layout in a scenario."""
        table = self.known.get(self._group(item, scenario))
        return 0 if table is None else len(table)

    def has_failed(self, item: Evaluated, scenario: Scenario) -> bool:
        """Return whether the estimator failed on a layout in a scenario."""
        return self._group(item, scenario) in self.failed

    def scores(self, item: Evaluated, scenario: Scenario, drives: int) -> list[tuple[Limit, Score]]:
        """Return the limits with the scores that the first so many drives give."""
        table = self.known[self._group(item, scenario)].head(drives)
        return [(limit, table.score(limit.score)) for limit in self.limits]

    def miss(self, item: Evaluated, most: Mapping[str, int]) -> tuple[Outlook | None, bool]:
        """Return the bound that shows a miss or is nearest to showing one, and whether it shows it.

        Drives beyond ``most`` of a scenario are left out, where it is named there.

        Notes
        -----
        The cheapest layout that would do is one, whichever it is: that it is none of those taken to miss is wrong
        only if it itself was taken to. So the error rate is shared by scenarios, limits and looks, and not by
        layouts, as with a subset that holds the best (Gupta, Technometrics 7, 1965). Look l gets the part
        1 / (l (l + 1)) and all looks together the whole, so that it does not matter when drives end, or why.
        Student's bounds are for normal errors; where errors are skewed to the right, as distances are, the lower
        ones are on the safe side.
        """
        nearest: Outlook | None = None
        for scenario, first in self.first_looks:
            count = self.count(item, scenario)
            for number, drives in _looks(first, min(count, most.get(scenario.name, count))):
                parts = _PARTS * len(self.first_looks) * len(self.limits) * number * (number + 1)
                for limit, score in self.scores(item, scenario, drives):
                    if math.isnan(score.value):
                        continue
                    shared = _shared(limit, parts)
                    best = (
                        score.lower(shared.confidence) if limit.lower is None else score.upper(shared.confidence)
                    )
                    one = Outlook(ratio=limit.ratio(best), limit=limit, score=score, scenario=scenario.name)
                    if shared.broken(score):
                        return one, True
                    if nearest is None or one.ratio > nearest.ratio:
                        nearest = one
        return nearest, False

    def holding(self, item: Evaluated, least: int, layouts: int) -> Outlook | None:
        """Return the worst bound of a layout that meets every limit in every held-out scenario, else ``None``.

        It is looked at from ``least`` drives in each scenario on. Any of so many ``layouts`` could be taken to
        hold by mistake, so they share the error rate with the looks.
        """
        held_out_looks = self.first_looks[1:]
        if any(self.has_failed(item, scenario) for scenario, _ in held_out_looks):
            return None
        most = min(self.count(item, scenario) for scenario, _ in held_out_looks)
        looks = [drives for _, drives in _looks(held_out_looks[0][1], most) if drives >= least]
        for number, drives in enumerate(looks, start=1):
            parts = _PARTS * layouts * number * (number + 1)
            found = [
                (_shared(limit, parts), score, scenario.name)
                for scenario, _ in held_out_looks
                for limit, score in self.scores(item, scenario, drives)
            ]
            if all(limit.met(score) for limit, score, _ in found):
                bounds = [
                    Outlook(ratio=limit.ratio(limit.bound(score)), limit=limit, score=score, scenario=name)
                    for limit, score, name in found
                ]
                return max(bounds, key=lambda one: one.ratio)
        return None

    def next_block(self, item: Evaluated) -> tuple[Scenario, int] | None:
        """Return the held-out scenario in which a layout is driven next, and the drives that it shall have there.

        It is the one whose mean is most beyond its limit, because one scenario is enough to show a miss; where
        none is, the one with the fewest drives. ``None`` where the estimator failed in all of them.
        """
        found = []
        for number, (scenario, first) in enumerate(self.first_looks[1:]):
            if self.has_failed(item, scenario):
                continue
            count = self.count(item, scenario)
            scores = self.scores(item, scenario, count) if count else []
            means = [limit.ratio(score.value) for limit, score in scores if not math.isnan(score.value)]
            off = max([1.0, *means])
            wanted = first
            while wanted <= count:
                wanted *= 2
            found.append(((-off, count, number), scenario, wanted))
        if not found:
            return None
        _, scenario, wanted = min(found, key=lambda entry: entry[0])
        return scenario, wanted

    def _group(self, item: Evaluated, scenario: Scenario) -> Group:
        return group_of(item.layout, scenario, self.problem.estimators[0])


def closing_of(
    evidence: Evidence,
    effort: Effort,
    kinds: Mapping[str, Kind],
    items: Mapping[str, Sequence[Evaluated]],
) -> tuple[Closing, tuple[Task, ...]]:
    """Return how the closing round stands and what is to be run next; nothing is when it is over.

    Parameters
    ----------
    kinds
        How each kind came out of the rounds before.
    items
        For each kind all layouts that were simulated and are within the limits on exact scores.

    Notes
    -----
    Layouts below the accepted one of their kind that are open are driven in blocks that double, the shortest block
    first and then the cheapest layout, until each is shown to miss or to hold, or no block of the shortest length
    is within the budget. What is to be run follows from the counts of drives and from outcomes alone.
    """
    worlds = [scenario for scenario, _ in evidence.first_looks[1:]]
    entered: dict[str, int] = {}
    closed: dict[str, tuple[Closed, ...]] = {}
    held: dict[str, Evaluated] = {}
    spent = 0
    for name, kind in kinds.items():
        if kind.accepted is None:
            continue
        below: list[Closed] = []
        cheaper = [item for item in items[name] if _rank(item)[0] < _rank(kind.accepted)[0]]
        for item in sorted(cheaper, key=_rank):
            before = _drives_before(kind, effort, item)
            spent += sum(max(0, evidence.count(item, scenario) - before) for scenario in worlds)
            if evidence.miss(item, {scenario.name: before for scenario in worlds})[1]:
                continue
            sharpest, missed = evidence.miss(item, {})
            holds = None if missed else evidence.holding(item, effort.validation_trials, len(items[name]))
            below.append(
                Closed(
                    item=item,
                    word=MISSED if missed else OPEN if holds is None else HELD,
                    sharpest=holds or sharpest,
                    drives={scenario.name: evidence.count(item, scenario) for scenario in worlds},
                )
            )
        entered[name], closed[name] = len(below), tuple(below)
        holding = [one.item for one in below if one.word == HELD]
        if holding:
            held[name] = holding[0]
    closing = Closing(entered=entered, closed=closed, accepted=held, spent=spent)
    return closing, _blocks(evidence, effort, closing)


def _blocks(evidence: Evidence, effort: Effort, closing: Closing) -> tuple[Task, ...]:
    """Return the tasks of the shortest blocks that open layouts need, cheapest first, within the budget."""
    found = []
    for kind in closing.closed:
        for one in closing.still_open(kind):
            block = evidence.next_block(one.item)
            if block is not None:
                found.append((block[1], _rank(one.item), one.item, block[0]))
    found.sort(key=lambda entry: entry[:2])
    tasks: list[Task] = []
    left = effort.closing_trials - closing.spent
    for wanted, _, item, scenario in found:
        left -= wanted - evidence.count(item, scenario)
        if left < 0 or wanted > found[0][0]:
            break
        estimators = evidence.problem.estimators[:1]
        tasks += held_out.tasks([item.layout], [scenario], estimators, wanted, evidence.known, evidence.failed)
    return tuple(tasks)


def _drives_before(kind: Kind, effort: Effort, item: Evaluated) -> int:
    """Return the drives of a layout in each held-out scenario before the closing round."""
    key = item.layout.key
    if any(key == one.layout.key for one in kind.tried):
        return effort.validation_trials
    return effort.look_trials if any(key == one.layout.key for one in kind.looked) else 0


def _looks(first: int, most: int) -> Iterator[tuple[int, int]]:
    """Yield number and drives of each look that so many drives allow."""
    number, drives = 1, first
    while drives <= most:
        yield number, drives
        number, drives = number + 1, 2 * drives


def _shared(limit: Limit, parts: int) -> Limit:
    """Return a limit at the confidence that leaves one of so many equal parts of its error rate."""
    return replace(limit, confidence=1.0 - (1.0 - limit.confidence) / parts)


def _rank(item: Evaluated) -> tuple[float, str]:
    return item.scores["cost"].value, item.layout.key
