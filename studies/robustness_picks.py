"""Layouts judged over several worlds: scores made one, limits held against their bounds, the layout picked."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

from layoutopt.problem import Limit, Problem
from layoutopt.protocols import Group, group_of
from layoutopt.result import Evaluated
from layoutopt.scenario import Scenario
from layoutopt.scores import OUTCOME_UNITS, Score, TrialOutcomes
from layoutopt.tolerance import Tolerance
from solvers.front import front_of, knee
from solvers.robust import Combined, quantile_over, scores_over, worst_case


@dataclass(frozen=True, slots=True, kw_only=True)
class Effort:
    """How much the study spends.

    Attributes
    ----------
    contenders
        Finalists of each of the two races, those near its front, that are judged over the tolerance.
    screening_trials
        Drives of each contender in each scenario, for choosing the candidates.
    deciding_trials
        Drives of a candidate in each scenario, for its limits.
    most_candidates
        How many layouts, cheapest first, are tried before the study gives up.
    drawn
        Scenarios drawn for a quantile.
    """

    contenders: int
    screening_trials: int
    deciding_trials: int
    most_candidates: int
    drawn: int


@dataclass(frozen=True, slots=True, kw_only=True)
class Pick:
    """The layout chosen for the nominal world or for the tolerance.

    ``held`` says whether its deciding drives met every limit: ``None`` while they are missing; ``tried`` how many
    layouts got such drives.
    """

    item: Evaluated
    held: bool | None
    tried: int


@dataclass(frozen=True, slots=True, kw_only=True)
class Judgement:
    """What is known of layouts in the worlds of a tolerance, and how it is judged.

    Attributes
    ----------
    effort
        How many drives choose candidates and decide.
    known, failed
        Outcomes, and messages of failed tasks, of every group.
    """

    problem: Problem
    tolerance: Tolerance
    effort: Effort
    known: Mapping[Group, TrialOutcomes]
    failed: Mapping[Group, str]

    @property
    def limits(self) -> tuple[Limit, ...]:
        """The limits on simulated scores; exact ones were met on entry."""
        return tuple(limit for limit in self.problem.limits if limit.score.rpartition(".")[2] in OUTCOME_UNITS)

    def groups(self, item: Evaluated, worlds: Sequence[Scenario]) -> list[Group]:
        """Return the groups of a layout in some worlds, with the estimator of the search."""
        return [group_of(item.layout, scenario, self.problem.estimators[0]) for scenario in worlds]

    def scores(self, item: Evaluated, worlds: Sequence[Scenario]) -> tuple[Score, ...] | None:
        """Return the goal of a layout in each of some worlds; ``None`` if one is missing."""
        return scores_over(self.known, self.groups(item, worlds), self.problem.goals[1])

    def combined(
        self, item: Evaluated, name: str, worlds: Sequence[Scenario], *, first: int | None = None
    ) -> Combined | None:
        """Return a score of a layout over some worlds, from its ``first`` drives or all; ``None`` without any."""
        groups, known = self.groups(item, worlds), self.known
        if any(group not in known for group in groups):
            return None
        tables = {group: known[group] if first is None else known[group].head(first) for group in groups}
        scores = scores_over(tables, groups, name)
        if scores is None:
            return None
        if self.tolerance.combine == "worst" or len(worlds) == 1:
            return worst_case(scores, name)
        return quantile_over(scores, name, quantile=self.tolerance.quantile)

    def pick(self, contenders: Sequence[Evaluated], worlds: Sequence[Scenario]) -> Pick | None:
        """Return the layout for some worlds; ``None`` if none was driven in all of them.

        It is the cheapest contender whose bounds meet every limit on its deciding drives, or, as long as there is
        none, the one to be decided next; after the last the one that misses its limits by least. Without any limit
        it is the knee of cost against the error in the worlds.
        """
        cost, goal = self.problem.goals[:2]
        judged = [item for item in contenders if self.combined(item, goal, worlds) is not None]
        if not judged:
            return None
        if not self.limits:
            return self._knee(judged, worlds)
        first, tried = self.effort.screening_trials, 0
        promising = [item for item in judged if self._ratio(item, worlds, first=first) <= 1.0]
        for item in promising[: self.effort.most_candidates]:
            tried += 1
            groups = self.groups(item, worlds)
            if any(group in self.failed for group in groups):
                continue
            if any(len(self.known[group]) < self.effort.deciding_trials for group in groups):
                return Pick(item=item, held=None, tried=tried)
            if self._ratio(item, worlds) <= 1.0:
                return Pick(item=item, held=True, tried=tried)
        nearest = min(judged, key=lambda item: (self._ratio(item, worlds), item.scores[cost].value))
        return Pick(item=nearest, held=False, tried=tried)

    def _knee(self, judged: Sequence[Evaluated], worlds: Sequence[Scenario]) -> Pick | None:
        cost, goal = self.problem.goals[:2]
        scored = []
        for item in judged:
            # From the first drives alone, so that a layout that got more is not judged anew.
            found = self.combined(item, goal, worlds, first=self.effort.screening_trials)
            if found is not None:
                scores = {cost: item.scores[cost], goal: Score(value=found.value, unit=found.unit)}
                scored.append(Evaluated(layout=item.layout, scores=scores))
        front = front_of(scored, self.problem.goals)
        if not front.members:
            return None
        key = knee(front).layout.key
        return Pick(item=next(item for item in judged if item.layout.key == key), held=True, tried=1)

    def _ratio(self, item: Evaluated, worlds: Sequence[Scenario], *, first: int | None = None) -> float:
        """Return how many times its demand the worst bound of a layout is off; at most 1 if it meets all limits.

        With the ``first`` drives alone, which choose candidates, shares count by the spread that these showed.
        """
        worst = 0.0
        for limit in self.limits:
            found = self.combined(item, limit.score, worlds, first=first)
            if found is None:
                return math.inf
            if first is None or not found.met_in_search(limit):
                worst = max(worst, limit.ratio(found.bound(limit)))
        return worst
