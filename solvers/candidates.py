"""Points of the unit cube as layouts, with all that is known of them without a trial."""

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import partial
from typing import Final

from layoutopt import feasibility
from layoutopt.identity import FloatArray
from layoutopt.layout import Layout
from layoutopt.problem import Limit, Problem
from layoutopt.protocols import Group, group_of
from layoutopt.scores import Score, Scores, TrialOutcomes
from layoutopt.workers import Lost, Workers
from solvers.judging import exact_scores

MISSED: Final = 10.0
"""Worth of a layout that misses a simulated limit, on top of the logarithm of how many times it does."""
OVER: Final = 20.0
"""The same for an exact limit, such as the budget; such layouts are never simulated."""
UNBUILDABLE: Final = 30.0
"""Worth of a layout that cannot be built, on top of what it lacks, in metres."""
NO_LAYOUT: Final = 50.0
"""Worth of parameters of which no family makes anything, and of a layout that no trial or score can judge."""
_LEAST_GOAL: Final = 1e-9
"""Of which a logarithm is taken: a goal of zero is as good as this."""
_MOST_LACKING_M: Final = 10.0
"""Counts for rules that no length would cure."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Candidate:
    """A layout of the space, or what stands for one that is none.

    ``penalty`` is its worth where no trial is needed to know that it is out, ``None`` where trials decide;
    ``scores`` are exact; ``reason`` says why it is out.
    """

    layout: Layout | None
    scores: Scores
    penalty: float | None
    reason: str = ""


class Candidates:
    """Looks up and remembers the candidate at each point; what it returns depends on the problem alone.

    A worth is what a search minimises: a layout that can be built and keeps its limits is worth the decimal
    logarithm of the goal, and whatever breaks a rule is worth more than all that break none, less severe rules
    first (Deb, Comput. Methods Appl. Mech. Eng. 186, 2000).
    """

    def __init__(self, problem: Problem, goal: str) -> None:
        exact = {
            name
            for objective in problem.objectives
            if objective.card.fidelity != "simulated"
            for name in objective.card.scores
        }
        self.problem = problem
        self.goal = goal
        self.axes = problem.space.axes
        self.simulated_limits = tuple(
            limit for limit in problem.limits if limit.score.rpartition(".")[2] not in exact
        )
        self._exact_limits = tuple(limit for limit in problem.limits if limit not in self.simulated_limits)
        self.goal_is_exact = goal.rpartition(".")[2] in exact
        self._known: dict[bytes, Candidate] = {}
        self._groups: dict[str, Group] = {}

    @property
    def needs_trials(self) -> bool:
        """Whether goal or limits are simulated."""
        return not self.goal_is_exact or bool(self.simulated_limits)

    def at(self, point: FloatArray) -> Candidate:
        """Return the candidate at a point of the unit cube, shape (d,)."""
        # A negative zero is the same place with other bits.
        key = (point + 0.0).tobytes()
        found = self._known.get(key)
        if found is None:
            found = self._known[key] = self._candidate(point)
        return found

    def group(self, layout: Layout) -> Group:
        """Return the group of the trials of a layout in the search."""
        found = self._groups.get(layout.key)
        if found is None:
            found = self._groups[layout.key] = group_of(layout, self.problem.design, self.problem.estimators[0])
        return found

    def worth(self, candidate: Candidate, outcomes: TrialOutcomes | None) -> float:
        """Return the worth of a candidate without penalty after its trials; without any, of exact scores alone.

        A limit on a score that no trial gave a value is not counted: the trials at the end decide it.
        """
        ratios = [
            limit.ratio(value)
            for limit in self.simulated_limits
            if not math.isnan(value := _value(limit.score, candidate, outcomes))
        ]
        worst = max(ratios, default=0.0)
        if worst > 1.0:
            return MISSED + min(math.log10(worst), MISSED - 1.0)
        value = _value(self.goal, candidate, outcomes)
        return math.log10(max(value, _LEAST_GOAL)) if math.isfinite(value) else NO_LAYOUT

    def _candidate(self, point: FloatArray) -> Candidate:
        try:
            layout = self.problem.space.decode([float(value) for value in point])
        except ValueError as error:
            return Candidate(layout=None, scores={}, penalty=NO_LAYOUT, reason=str(error))
        violations = feasibility.check(layout, self.problem.design)
        if violations:
            lacking_m = sum(min(violation.shortfall_m, _MOST_LACKING_M) for violation in violations)
            penalty = UNBUILDABLE + min(lacking_m, _MOST_LACKING_M)
            return Candidate(layout=layout, scores={}, penalty=penalty, reason=violations[0].message)
        first = self.problem.goals[0]
        only = first if {limit.score for limit in self._exact_limits} <= {first} and self._priced else ""
        # As in the screen: an objective that raises refuses its layout and stops nothing else.
        scores = next(
            answer for _, answer in Workers().map(partial(exact_scores, self.problem, only=only), [layout])
        )
        if isinstance(scores, Lost):
            reason = f"cannot be scored: {scores.kind.value}: {scores.message}"
            return Candidate(layout=layout, scores={}, penalty=NO_LAYOUT, reason=reason)
        over, reason = self._excess(scores)
        if over is not None:
            return Candidate(layout=layout, scores=scores, penalty=over, reason=reason)
        reason = self.problem.estimators[0].applies(layout) if self.needs_trials else ""
        return Candidate(layout=layout, scores=scores, penalty=NO_LAYOUT if reason else None, reason=reason)

    @property
    def _priced(self) -> bool:
        return not self.goal_is_exact or self.goal == self.problem.goals[0]

    def _excess(self, scores: Mapping[str, Score]) -> tuple[float | None, str]:
        """Return the worth of a layout that breaks an exact limit, and which; of others ``None``."""
        broken = [
            (limit.ratio(scores[limit.score].value) if limit.score in scores else math.inf, limit)
            for limit in self._exact_limits
            if limit.score not in scores or limit.broken(scores[limit.score])
        ]
        if not broken:
            return None, ""
        ratio, limit = max(broken, key=lambda entry: entry[0])
        return OVER + min(math.log10(max(ratio, 1.0)), OVER - MISSED - 1.0), _excess_text(limit, scores)


def _value(name: str, candidate: Candidate, outcomes: TrialOutcomes | None) -> float:
    """Return a score of a candidate, exact or the mean of its trials; NaN if it has none."""
    if name in candidate.scores:
        return candidate.scores[name].value
    return outcomes.score(name).value if outcomes is not None and name in outcomes.columns else math.nan


def _excess_text(limit: Limit, scores: Scores) -> str:
    score = scores.get(limit.score)
    if score is None:
        return f"{limit.score} does not apply to this layout, but is limited"
    return f"{limit.score} is {score.value:.6g} {score.unit}, beyond {limit.end:.6g}"
