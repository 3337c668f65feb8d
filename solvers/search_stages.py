"""The stages of a global search, walked through until a trial is missing: search, race, polish, fresh trials."""

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Final

import numpy as np

from layoutopt.evaluate import outcomes_of
from layoutopt.identity import FloatArray
from layoutopt.layout import Layout
from layoutopt.protocols import Evaluation, Failure, Group, Task
from layoutopt.result import Evaluated
from layoutopt.scores import TrialOutcomes
from solvers.candidates import NO_LAYOUT, Candidate, Candidates
from solvers.judging import simulated_scores
from solvers.replayed import Asked, Method, Polishing, asked

FRESH: Final = 1_000_000
"""Number of the first fresh replication, far beyond those of any search."""
_BLOCK: Final = 16
"""Replications that go into one task, so that workers share even a single layout."""
_LEAST_LEFT: Final = 2
"""Layouts that leave the race: the scores of two tell whether the choice between them mattered."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Effort:
    """Trials of the stages; `solvers.global_search.GlobalSearch` explains each number."""

    replications: int
    finalists: int
    race_trials: int
    polish_evaluations: int
    fresh_trials: int


@dataclass(frozen=True, slots=True, kw_only=True)
class SearchStanding:
    """How a search stands.

    Attributes
    ----------
    stage
        ``"search"``, ``"race"``, ``"polish"``, ``"fresh"`` or ``"done"``.
    tasks
        What to run next; empty when the search is over.
    finalists
        Best first. When the search is over, with the scores of fresh trials; before, with those of the search, for
        progress and not for results.
    trials
        Trials of all layouts that the search has met.
    layouts
        How many these are.
    nearest, reason
        The least penalty of all that was refused without a trial, infinite for none, and why.
    """

    stage: str
    tasks: tuple[Task, ...]
    finalists: tuple[Evaluated, ...]
    trials: int
    layouts: int
    nearest: float
    reason: str


def standing_of(
    candidates: Candidates, method: Method, effort: Effort, evaluations: Sequence[Evaluation | Failure]
) -> SearchStanding:
    """Return how a search with a global method stands after the evaluations, in any order."""
    return _Walk(candidates=candidates, effort=effort, known=_Known.of(evaluations)).standing(method)


@dataclass(frozen=True, slots=True, kw_only=True)
class _Known:
    """Outcomes and failures by group."""

    tables: Mapping[Group, TrialOutcomes]
    failed: frozenset[Group]

    @classmethod
    def of(cls, evaluations: Sequence[Evaluation | Failure]) -> "_Known":
        return cls(
            tables=outcomes_of(evaluations),
            failed=frozenset(item.group for item in evaluations if isinstance(item, Failure)),
        )

    def between(self, group: Group, first: int, until: int) -> TrialOutcomes | None:
        """Return the outcomes of the replications from ``first`` to before ``until``; ``None`` without any."""
        table = self.tables.get(group)
        if table is None:
            return None
        low, high = np.searchsorted(table.replications, [first, until])
        if low == high:
            return None
        return TrialOutcomes(
            replications=table.replications[low:high], columns=table.columns, values=table.values[low:high]
        )


@dataclass(slots=True, kw_only=True)
class _Walk:
    """One walk through the stages."""

    candidates: Candidates
    effort: Effort
    known: _Known
    met: dict[str, tuple[FloatArray, Candidate]] = field(default_factory=dict)
    refused: tuple[float, str] = (math.inf, "")
    worths: dict[tuple[str, int], float] = field(default_factory=dict)

    def standing(self, method: Method) -> SearchStanding:
        effort = self.effort
        points = self._asked(method, effort.replications).points
        if len(points):
            return self._wanting("search", self._layouts(points), 0, effort.replications)
        finalists, until = self._ranked(effort.replications)[: effort.finalists], effort.replications
        while finalists and self.candidates.needs_trials and until < effort.race_trials:
            until = min(2 * until, effort.race_trials)
            race = self._wanting("race", finalists, 0, until)
            if race.tasks:
                return race
            finalists = self._sorted(finalists, until)[: max(_LEAST_LEFT, -(-len(finalists) // 2))]
        polished = self._polished(finalists, until)
        if polished is not None and len(polished.points):
            return self._wanting("polish", self._layouts(polished.points), 0, until)
        if polished is not None and polished.best is not None:
            # The descent begins at the winner of the race, so its end is that layout or a better one.
            finalists = list(dict.fromkeys([*self._layouts(polished.best[None]), *finalists]))
        return self._fresh(finalists)

    def _asked(self, method: Method, until: int) -> Asked:
        """Return what a method asks for; of a space without any choice its only point."""
        dimensions = len(self.candidates.axes)
        if dimensions:
            return asked(method, lambda points: self._values(points, until), dimensions)
        point = np.empty((1, 0))
        return Asked(points=point[np.isnan(self._values(point, until))])

    def _polished(self, finalists: Sequence[Layout], until: int) -> Asked | None:
        """Return what the descent from the best layout asks for, ``None`` where there is nothing to move."""
        coordinates = tuple(number for number, axis in enumerate(self.candidates.axes) if axis.continuous)
        if not (finalists and coordinates and self.effort.polish_evaluations):
            return None
        start, _ = self.met[finalists[0].key]
        method = Polishing(
            start=tuple(float(value) for value in start),
            coordinates=coordinates,
            evaluations=self.effort.polish_evaluations,
        )
        return self._asked(method, until)

    def _values(self, points: FloatArray, until: int) -> FloatArray:
        """Return the worth of each point after the first ``until`` trials, NaN where some are missing."""
        values = np.empty(len(points))
        for row, point in enumerate(points):
            item = self.candidates.at(point)
            if item.layout is None or item.penalty is not None:
                values[row] = NO_LAYOUT if item.penalty is None else item.penalty
                self.refused = min(self.refused, (float(values[row]), item.reason))
            else:
                self.met.setdefault(item.layout.key, (point, item))
                values[row] = self._worth(item.layout, until)
        return values

    def _worth(self, layout: Layout, until: int) -> float:
        place = layout.key, until
        if place not in self.worths:
            self.worths[place] = self._judged(layout, until)
        return self.worths[place]

    def _judged(self, layout: Layout, until: int) -> float:
        """Return the worth of a layout after its first ``until`` trials, NaN where some are missing."""
        _, item = self.met[layout.key]
        if not self.candidates.needs_trials:
            return self.candidates.worth(item, None)
        group = self.candidates.group(layout)
        if group in self.known.failed:
            return NO_LAYOUT
        table = self.known.between(group, 0, until)
        if table is None or len(table) < until:
            return math.nan
        return self.candidates.worth(item, table)

    def _layouts(self, points: FloatArray) -> list[Layout]:
        """Return the layouts at points that are met, each once."""
        found = (self.candidates.at(point).layout for point in points)
        return list(
            {layout.key: layout for layout in found if layout is not None and layout.key in self.met}.values()
        )

    def _sorted(self, layouts: Sequence[Layout], until: int) -> list[Layout]:
        """Return layouts by their worth; the key decides between equals."""
        return sorted(layouts, key=lambda layout: (self._worth(layout, until), layout.key))

    def _ranked(self, until: int) -> list[Layout]:
        """Return all layouts that were met and could be judged, best first."""
        met = [item.layout for _, item in self.met.values() if item.layout is not None]
        # A worth that is not known yet is NaN and less than nothing.
        return self._sorted([layout for layout in met if self._worth(layout, until) < NO_LAYOUT], until)

    def _wanting(self, stage: str, layouts: Sequence[Layout], first: int, until: int) -> SearchStanding:
        """Return a standing with the tasks that the layouts lack for the replications from first to until."""
        tasks: list[Task] = []
        problem = self.candidates.problem
        for layout in layouts if self.candidates.needs_trials else ():
            group = self.candidates.group(layout)
            if group in self.known.failed:
                continue
            table = self.known.between(group, first, until)
            begin = first + (0 if table is None else len(table))
            tasks += [
                Task(
                    layout=layout,
                    scenario=problem.design,
                    estimator=problem.estimators[0],
                    first=number,
                    count=min(_BLOCK, until - number),
                )
                for number in range(begin, until, _BLOCK)
            ]
        return self._told(stage, tasks, layouts if stage != "search" else self._ranked_so_far(), (0, until))

    def _ranked_so_far(self) -> list[Layout]:
        return self._ranked(self.effort.replications)[: self.effort.finalists]

    def _fresh(self, finalists: Sequence[Layout]) -> SearchStanding:
        until = FRESH + self.effort.fresh_trials
        fresh = self._wanting("fresh", finalists, FRESH, until)
        return fresh if fresh.tasks else self._told("done", [], finalists, (FRESH, until))

    def _told(
        self, stage: str, tasks: Sequence[Task], layouts: Sequence[Layout], trials: tuple[int, int]
    ) -> SearchStanding:
        """Return the standing; at the end, and only there, finalists are sorted by what fresh trials gave."""
        problem, groups = self.candidates.problem, self.candidates.group
        finalists = []
        for layout in layouts:
            _, item = self.met[layout.key]
            table = self.known.between(groups(layout), *trials)
            scores = {**item.scores, **simulated_scores(problem, layout, problem.design, table)}
            worth = self.candidates.worth(item, table) if table is not None or stage == "done" else NO_LAYOUT
            finalists.append((worth, Evaluated(layout=layout, scores=scores)))
        if stage == "done":
            finalists.sort(key=lambda entry: (entry[0], entry[1].layout.key))
        counted = [self.known.tables.get(groups(item.layout)) for _, item in self.met.values() if item.layout]
        return SearchStanding(
            stage=stage,
            tasks=tuple(tasks),
            finalists=tuple(item for _, item in finalists),
            trials=sum(len(table) for table in counted if table is not None),
            layouts=len(self.met),
            nearest=self.refused[0],
            reason=self.refused[1],
        )
