"""Racing: many layouts get a few trials, the promising ones more, all on the same simulated drives."""

import math
import time
from collections.abc import Container, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import ClassVar, Final

import numpy as np

from layoutopt.evaluate import outcomes_of
from layoutopt.identity import FloatArray
from layoutopt.problem import Problem
from layoutopt.protocols import Evaluate, Evaluation, Failure, Group, SolverCard, Stop, Task, group_of
from layoutopt.result import Evaluated, Front, Result, Status
from layoutopt.scores import TrialOutcomes
from solvers.allocation import probability_of_correct_selection
from solvers.borrowing import borrowed_log_means, features_of
from solvers.exhaustive import screen
from solvers.front import front_of
from solvers.halving import kept
from solvers.judging import meeting_limits, pointed_out, simulated_scores, verdict
from solvers.run_off import run_off, up_to

CARD: Final = SolverCard(
    summary="Successive halving, then optimal computing budget allocation, on paired differences over common "
    "random numbers, for cost against error.",
    reference="Jamieson and Talwalkar, AISTATS 2016 (successive halving); Lee, Chew, Teng and Goldsman, IIE "
    "Transactions 42, 2010 (budget allocation for fronts); Nelson and Matejcik 1995 (paired comparison under "
    "common random numbers)",
    exact=False,
    multi_objective=True,
    handles_noise=True,
)
_ROUNDS_SHARE: Final = 0.6
"""What the rounds may spend; that leaves the run-off at least a tenth of the budget."""
_FEWEST_TRIALS: Final = 8
"""From so many trials a layout on, a round that drops none gives way to the run-off."""
_SELECTING_SHARE: Final = 0.7
"""What rounds and run-off may spend together where limits are to be decided afterwards."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Standing:
    """How the race stands: who is still in it, what is known of them, and what to run next.

    ``tasks`` is empty when the race is over. ``finalists`` are sorted by cost, then goal, then key; before the end
    they are those still in the race, of which some may have no trials yet. ``front`` is sorted by cost: the
    layouts selected, or before the rounds are over those of the finalists that have the best means. Its scores are
    those of the trials. They may fall out of order, because layouts are compared on common drives and may have
    others beside them, and because a front that is ``borrowed`` was chosen by the trials together with what exact
    scores predict. ``correct_selection`` is at least how probable it is, by the trials alone, that the selection
    is right, and ``misjudged`` at most how many layouts are expected on its wrong side, differences within the
    indifference aside; ``None`` before the rounds are over.
    """

    finalists: tuple[Evaluated, ...]
    tasks: tuple[Task, ...]
    trials: int
    front: tuple[Evaluated, ...] = ()
    borrowed: bool = False
    correct_selection: float | None = None
    misjudged: float | None = None


@dataclass(frozen=True, slots=True, kw_only=True)
class Racing:
    """Solver for an exact first goal (cost) and a simulated second one.

    Every round keeps about half of the layouts and doubles the trials of those that stay. Kept are the layouts
    least dominated in the second goal and those least dominated in the demand, the worst ratio of a limited
    score to its limit; the comparison is by paired differences with a shrunken standard error. Then a run-off
    gives trials to the comparisons that decide the front, among all contenders, until the front is right with the
    confidence asked for or its share of the budget is spent. At the end, layouts that could be the cheapest to
    meet the limits get trials until their confidence bounds decide.

    Attributes
    ----------
    trials
        Budget, counted in trials: seven tenths for rounds and run-off, what is left for deciding limits; all for
        rounds and run-off where there are no limits. Only the first round may exceed it, because every layout
        needs its first trials.
    first_trials
        Trials of every layout in the first round. With 1 a budget of a few trials a layout leaves more for the
        promising ones; variances are unknown then, and the first round compares by ratios of the goal.
    most_trials
        Rounds and run-off give no layout more, for instance because a table holds no more replications; ``None``
        for no bound.
    finalists
        A round never keeps fewer.
    deciding_trials
        Most trials a layout gets for deciding its limits.
    confidence
        Probability of a correct selection at which the run-off ends early.
    indifference
        Share of the error that does not matter for that probability: no layout left out is better by more than
        this share than the member that stands for it, and no member worse by more than this than the one before
        it.
    borrowing
        Whether rounds and front go by means drawn towards what the exact scores of all layouts predict
        (`solvers.borrowing`), where there are such means. What is stated of the front rests on the trials alone.
    """

    trials: int = 4000
    first_trials: int = 2
    most_trials: int | None = None
    finalists: int = 48
    deciding_trials: int = 256
    confidence: float = 0.95
    indifference: float = 0.02
    borrowing: bool = False
    card: ClassVar[SolverCard] = CARD

    def __post_init__(self) -> None:
        if self.first_trials < 1:
            raise ValueError(f"every layout needs a first trial to be compared, not {self.first_trials}")
        if self.most_trials is not None and self.most_trials < self.first_trials:
            raise ValueError(f"{self.first_trials} first trials are more than the most, {self.most_trials}")
        if not 0.0 < self.confidence <= 1.0:
            raise ValueError(f"a confidence is a probability above 0, not {self.confidence}")
        if not self.indifference >= 0.0:
            raise ValueError(f"an indifference is a share of the error, 0 or more, not {self.indifference}")

    def __call__(self, problem: Problem, evaluate: Evaluate, stop: Stop) -> Result:
        """Return the estimated front and the cheapest layout shown to meet the limits."""
        contenders = [item.evaluated for item in screen(problem) if not item.refusal]
        evaluations: list[Evaluation | Failure] = []
        began = time.monotonic()
        standing = self.standing(problem, contenders, evaluations)
        while standing.tasks:
            if stop(standing.trials, time.monotonic() - began):
                return self._result(problem, standing, Status.STOPPED_BY_LIMIT)
            evaluations += evaluate(standing.tasks)
            standing = self.standing(problem, contenders, evaluations)
        return self._result(problem, standing, Status.SEARCHED)

    def rounds(self, contenders: int) -> tuple[tuple[int, int], ...]:
        """Return the plan of the race: for each round, how many layouts run and up to which trial."""
        plan, layouts, until, spent = [], contenders, self.first_trials, contenders * self.first_trials
        while layouts:
            plan.append((layouts, until))
            staying = max(-(-layouts // 2), min(self.finalists, layouts))
            spent += staying * until
            if spent > _ROUNDS_SHARE * self.trials or (staying == layouts and until >= _FEWEST_TRIALS):
                break
            if self.most_trials is not None and 2 * until > self.most_trials:
                break
            layouts, until = staying, 2 * until
        return tuple(plan)

    def standing(
        self,
        problem: Problem,
        contenders: Sequence[Evaluated],
        evaluations: Sequence[Evaluation | Failure],
    ) -> Standing:
        """Return how the race stands after the evaluations: a pure function, so a killed race resumes."""
        known = _Known.of(problem, contenders, evaluations)
        alive = racers = [item for item in contenders if item.layout.key not in known.failed]
        features = features_of(racers) if self.borrowing else None
        through: dict[str, int] = {}
        before = 0
        for layouts, until in self.rounds(len(contenders)):
            if before:
                log_means = known.borrowed(racers, through, features)
                alive = kept(problem, alive, [known.outcomes(item) for item in alive], before, layouts, log_means)
            before = until
            through.update((item.layout.key, until) for item in alive)
            if tasks := known.tasks(alive, [until] * len(alive)):
                finalists = known.scored(alive)
                front = front_of(_judged(finalists, problem.goals[1]), problem.goals).members
                return Standing(finalists=finalists, tasks=tasks, trials=known.trials, front=front)
        if not alive:
            return Standing(finalists=(), tasks=(), trials=known.trials)
        chosen = {item.layout.key for item in alive}
        counts = np.array([through[item.layout.key] for item in racers])
        selected = run_off(
            known.table(racers, problem.goals[1]),
            np.array([item.scores[problem.goals[0]].value for item in racers]),
            np.array([known.count(item) for item in racers]),
            counts,
            np.array([item.layout.key in chosen for item in racers]),
            trials=max(0, self._selecting(problem) - int(counts.sum())),
            confidence=self.confidence,
            indifference=self.indifference,
            most=self.most_trials,
            features=features,
        )
        members = {racers[row].layout.key for row in selected.found.members}
        finalists = _without_intruders(
            problem.goals, known.scored([item for item in racers if item.layout.key in chosen | members]), members
        )
        return Standing(
            finalists=finalists,
            tasks=known.tasks(racers, selected.wanted.tolist()) or self._deciding(problem, finalists, known),
            trials=known.trials,
            front=tuple(item for item in _judged(finalists, problem.goals[1]) if item.layout.key in members),
            borrowed=selected.borrowed,
            correct_selection=probability_of_correct_selection(selected.found),
            misjudged=float(selected.found.wrong.sum()),
        )

    def _selecting(self, problem: Problem) -> int:
        """Return the trials for finding the front; where there are limits, some are kept back to decide them."""
        return int(_SELECTING_SHARE * self.trials) if problem.limits else self.trials

    def _deciding(self, problem: Problem, finalists: Sequence[Evaluated], known: "_Known") -> tuple[Task, ...]:
        """Return tasks that double the trials of layouts that could be the cheapest to meet the limits."""
        left = self.trials - known.trials
        deciding: list[Task] = []
        for item in self._undecided(problem, finalists):
            tasks = known.tasks([item], [min(2 * known.count(item), self.deciding_trials)])
            left -= sum(wanted.count for wanted in tasks)
            if left < 0:
                break
            deciding += tasks
        return tuple(deciding)

    def _undecided(self, problem: Problem, finalists: Sequence[Evaluated]) -> list[Evaluated]:
        """Return the layouts, up to the cheapest that meets all limits, whose limits are still open."""
        found = []
        for item in finalists:
            if meeting_limits(problem, [item]):
                break
            if not any(limit.broken(score) for limit, score in problem.limits_on(item.scores)):
                found.append(item)
        return found

    def _result(self, problem: Problem, standing: Standing, status: Status) -> Result:
        judged = _judged(standing.finalists, problem.goals[1])
        front = Front(goals=problem.goals, members=standing.front)
        meeting = meeting_limits(problem, judged) if problem.limits else list(front.members)
        recommended = pointed_out(front, meeting[0] if meeting else None)
        status, shortfall = verdict(problem, status, judged, meeting)
        return Result(
            status=status,
            front=front,
            recommended=recommended,
            trials=standing.trials,
            shortfall=shortfall,
            correct_selection=standing.correct_selection,
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class _Known:
    """What the evaluations say of the contenders of a race."""

    problem: Problem
    groups: Mapping[str, Group]
    tables: Mapping[Group, TrialOutcomes]
    failed: frozenset[str]

    @classmethod
    def of(
        cls, problem: Problem, contenders: Sequence[Evaluated], evaluations: Sequence[Evaluation | Failure]
    ) -> "_Known":
        """Return what the evaluations of the design scenario with the search's own estimator say."""
        estimator, scenario = problem.estimators[0], problem.design
        groups = {item.layout.key: group_of(item.layout, scenario, estimator) for item in contenders}
        own = set(groups.values())
        return cls(
            problem=problem,
            groups=groups,
            tables={group: table for group, table in outcomes_of(evaluations).items() if group in own},
            failed=frozenset(
                item.group.layout_key for item in evaluations if isinstance(item, Failure) and item.group in own
            ),
        )

    @property
    def trials(self) -> int:
        """Trials of all contenders."""
        return sum(len(table) for table in self.tables.values())

    def outcomes(self, item: Evaluated) -> TrialOutcomes | None:
        """Return the outcomes of a layout, if there are any."""
        return self.tables.get(self.groups[item.layout.key])

    def count(self, item: Evaluated) -> int:
        """Return the number of trials of a layout."""
        table = self.outcomes(item)
        return 0 if table is None else len(table)

    def table(self, items: Sequence[Evaluated], name: str) -> FloatArray:
        """Return a column of all layouts, shape (n, replications), NaN where there is no trial or no value."""
        values = np.full((len(items), max(map(self.count, items))), np.nan)
        for row, item in enumerate(items):
            if (table := self.outcomes(item)) is not None:
                values[row, : len(table)] = table.column(name)
        return values

    def borrowed(
        self, items: Sequence[Evaluated], through: Mapping[str, int], features: FloatArray | None
    ) -> dict[str, float] | None:
        """Return logarithms of means, by key, that borrow on the first trials of each layout, if they can."""
        if features is None:
            return None
        counts = np.array([through[item.layout.key] for item in items])
        log_means = borrowed_log_means(up_to(self.table(items, self.problem.goals[1]), counts), features)
        if log_means is None:
            return None
        return {item.layout.key: value for item, value in zip(items, log_means.tolist(), strict=True)}

    def tasks(self, items: Sequence[Evaluated], until: Sequence[int]) -> tuple[Task, ...]:
        """Return what is missing up to a replication of each layout."""
        found = []
        for item, end in zip(items, until, strict=True):
            first = self.count(item)
            if first < end:
                task = Task(
                    layout=item.layout,
                    scenario=self.problem.design,
                    estimator=self.problem.estimators[0],
                    first=first,
                    count=end - first,
                )
                found.append(task)
        return tuple(found)

    def scored(self, items: Sequence[Evaluated]) -> tuple[Evaluated, ...]:
        """Return layouts with the scores that the outcomes give, by cost, then goal, then key."""
        found = []
        for item in items:
            simulated = simulated_scores(self.problem, item.layout, self.problem.design, self.outcomes(item))
            found.append(replace(item, scores={**item.scores, **simulated}))
        return tuple(sorted(found, key=lambda item: _rank(item, self.problem.goals)))


def _judged(items: Sequence[Evaluated], goal: str) -> list[Evaluated]:
    """Return the layouts whose goal is known: some drive gave it a value."""
    return [item for item in items if goal in item.scores and not math.isnan(item.scores[goal].value)]


def _rank(item: Evaluated, goals: tuple[str, ...]) -> tuple[float, float, str]:
    """Return what finalists are sorted by: cost, then the other goal, unknown last, then key."""
    goal = item.scores[goals[1]].value if goals[1] in item.scores else math.nan
    return item.scores[goals[0]].value, math.inf if math.isnan(goal) else goal, item.layout.key


def _without_intruders(
    goals: tuple[str, ...], finalists: Sequence[Evaluated], members: Container[str]
) -> tuple[Evaluated, ...]:
    """Return the finalists without those that have a place on their front and none among the members.

    Means over different numbers of drives are not paired: a layout may owe its mean to easy drives, which the
    others had as well, beside harder ones.
    """
    left = tuple(finalists)
    while intruders := {
        item.layout.key
        for item in front_of(_judged(left, goals[1]), goals).members
        if item.layout.key not in members
    }:
        left = tuple(item for item in left if item.layout.key not in intruders)
    return left
