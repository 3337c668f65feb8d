"""The closing round of the study of zones: held-out drives for cheaper layouts that neither held nor missed."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from typing import Final

import numpy as np

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
_MOST_LOG: Final = 700.0
"""Logarithm of a number that can still be written."""
_STAKES: Final = np.array([0.5, 0.25, 0.125, 0.0625])
"""Of the bets on a miss: the best stake is the excess over the squared deviations, which is not known before."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Closed:
    """How a layout stands after the closing round.

    Attributes
    ----------
    word
        ``"held"``, ``"missed"`` or ``"open"``.
    evidence
        That it misses a limit: from 1 on it is shown to.
    worst
        The mean that is worst beside its demand, and how many times the demand it is; ``None`` without any drive.
    drives
        Its held-out drives by scenario.
    """

    item: Evaluated
    word: str
    evidence: float
    worst: Outlook | None
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
    block
        Drives of the first block in a held-out scenario; every further one doubles them.
    known, failed
        Outcomes, and why tasks failed.
    """

    problem: Problem
    limits: tuple[Limit, ...]
    block: int
    known: Mapping[Group, TrialOutcomes]
    failed: Mapping[Group, str]

    @property
    def error_rate(self) -> float:
        """The error rate of each part of the verdicts; where limits differ in confidence, by the strictest."""
        return (1.0 - max(limit.confidence for limit in self.limits)) / _PARTS

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

    def worst(self, item: Evaluated) -> Outlook | None:
        """Return the mean that is worst beside its demand, over all scenarios."""
        found = [
            Outlook(ratio=limit.ratio(score.value), limit=limit, score=score, scenario=scenario.name)
            for scenario in (self.problem.design, *self.problem.held_out)
            if (count := self.count(item, scenario))
            for limit, score in self.scores(item, scenario, count)
            if not math.isnan(score.value)
        ]
        return max(found, key=lambda one: one.ratio, default=None)

    def of_a_miss(self, item: Evaluated, most: Mapping[str, int]) -> float:
        """Return the evidence that a layout misses a limit in some scenario: from 1 on it is shown to.

        Held-out drives beyond ``most`` of a scenario are left out, where it is named there. A limit from below is
        never shown to be missed.

        Notes
        -----
        Drives bet that a score is beyond its limit: with a stake s, a value of r times the limit multiplies the
        wealth by 1 + s (r - 1). Where the layout meets the limit in every scenario, no such wealth is expected to
        grow, nor is the mean of those with several stakes and limits, so that it ever reaches one over the error
        rate has at most that rate as its probability (Ville's inequality; Waudby-Smith and Ramdas, J. R. Stat.
        Soc. B 86, 2024). That holds whatever the distribution of errors, however scenarios, whose drives are
        independent, are mixed, whenever drives end, and why.

        It is not divided by the number of layouts. The cheapest one that would do is one, whichever it is: that it
        is none of those taken to miss is wrong only if it itself was taken to, as with a subset that holds the
        best (Gupta, Technometrics 7, 1965).
        """
        grown = np.zeros((len(self.limits), len(_STAKES)))
        for scenario in (self.problem.design, *self.problem.held_out):
            table = self.known.get(self._group(item, scenario))
            if table is None:
                continue
            for number, limit in enumerate(self.limits):
                if limit.upper is None:
                    continue
                values = table.column(limit.score)[: most.get(scenario.name)]
                values = values[~np.isnan(values)]
                if limit.upper > 0.0:
                    grown[number] += np.log1p(_STAKES[:, None] * (values / limit.upper - 1.0)).sum(axis=1)
                elif (values > 0.0).any():
                    return math.inf
        # In logarithms: thousands of drives may bring more than the largest number.
        mean_log = float(np.logaddexp.reduce(grown, axis=None)) - math.log(grown.size)
        return math.exp(min(_MOST_LOG, mean_log)) * self.error_rate

    def holds(self, item: Evaluated, least: int, layouts: int) -> bool:
        """Return whether a layout meets every limit in every held-out scenario.

        It is looked at from ``least`` drives in each scenario on, after every block. Any of so many ``layouts``
        could be taken to hold by mistake, so they share the error rate; look l gets the part 1 / (l (l + 1)).
        """
        worlds = self.problem.held_out
        if any(self.has_failed(item, scenario) for scenario in worlds):
            return False
        most = min(self.count(item, scenario) for scenario in worlds)
        drives, looks = self.block, 0
        while drives <= most:
            if drives >= least:
                looks += 1
                confidence = 1.0 - self.error_rate / (layouts * looks * (looks + 1))
                if all(
                    replace(limit, confidence=confidence).met(score)
                    for scenario in worlds
                    for limit, score in self.scores(item, scenario, drives)
                ):
                    return True
            drives *= 2
        return False

    def next_block(self, item: Evaluated) -> tuple[Scenario, int] | None:
        """Return the held-out scenario in which a layout is driven next, and the drives that it shall have there.

        It is the one whose mean is most beyond its limit, because one scenario is enough to show a miss; where
        none is, the one with the fewest drives. ``None`` where the estimator failed in all of them.
        """
        found = []
        for number, scenario in enumerate(self.problem.held_out):
            if self.has_failed(item, scenario):
                continue
            count = self.count(item, scenario)
            scores = self.scores(item, scenario, count) if count else []
            means = [limit.ratio(score.value) for limit, score in scores if not math.isnan(score.value)]
            off = max([1.0, *means])
            wanted = self.block
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
    Of the layouts below the accepted one of their kind that are open the cheapest few are driven in blocks that
    double, the shortest block first, until each is shown to miss or to hold, or the shortest block is not within
    the budget. The cheapest open layout is the end of what may be saved, so dearer ones come when cheaper ones
    are decided. What is to be run follows from the counts of drives and from outcomes alone.
    """
    worlds = evidence.problem.held_out
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
            if evidence.of_a_miss(item, {scenario.name: before for scenario in worlds}) >= 1.0:
                continue
            shown = evidence.of_a_miss(item, {})
            holds = shown < 1.0 and evidence.holds(item, effort.validation_trials, len(items[name]))
            below.append(
                Closed(
                    item=item,
                    word=HELD if holds else MISSED if shown >= 1.0 else OPEN,
                    evidence=shown,
                    worst=evidence.worst(item),
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
    """Return the tasks of the shortest blocks that the cheapest open layouts need, within the budget."""
    found = []
    for kind in closing.closed:
        blocks = [(one.item, evidence.next_block(one.item)) for one in closing.still_open(kind)]
        # Layouts that cannot be driven any more must not take the places of others.
        driven = [(item, block) for item, block in blocks if block is not None][: effort.closing_window]
        found += [(wanted, _rank(item), item, scenario) for item, (scenario, wanted) in driven]
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


def _rank(item: Evaluated) -> tuple[float, str]:
    return item.scores["cost"].value, item.layout.key
