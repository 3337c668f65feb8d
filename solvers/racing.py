"""Racing: many layouts get a few trials, the promising ones more, all on the same simulated drives."""

import math
import time
from collections.abc import Container, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import ClassVar, Final

import numpy as np

from layoutopt.evaluate import outcomes_of
from layoutopt.identity import FloatArray, IntArray
from layoutopt.problem import Limit, Problem
from layoutopt.protocols import Evaluate, Evaluation, Failure, Group, SolverCard, Stop, Task, group_of
from layoutopt.result import Evaluated, Result, Status
from layoutopt.scores import TrialOutcomes
from solvers.allocation import probability_of_correct_selection
from solvers.exhaustive import screen
from solvers.front import front_of
from solvers.judging import meeting_limits, pointed_out, simulated_scores, verdict
from solvers.run_off import run_off

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
_PRIOR_DEGREES: Final = 4.0
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
    they are those still in the race, of which some may have no trials yet. ``correct_selection`` is at least how
    probable it is that the front is right, and ``misjudged`` at most how many layouts are expected on its wrong
    side, differences within the indifference aside; ``None`` before the rounds are over.
    """

    finalists: tuple[Evaluated, ...]
    tasks: tuple[Task, ...]
    trials: int
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
    """

    trials: int = 4000
    first_trials: int = 2
    most_trials: int | None = None
    finalists: int = 48
    deciding_trials: int = 256
    confidence: float = 0.95
    indifference: float = 0.02
    card: ClassVar[SolverCard] = CARD

    def __call__(self, problem: Problem, evaluate: Evaluate, stop: Stop) -> Result:
        """Return the estimated front and the cheapest layout shown to meet the limits."""
        contenders = [item.evaluated for item in screen(problem) if not item.refusal]
        if self.first_trials < 1:
            raise ValueError(f"every layout needs a first trial to be compared, not {self.first_trials}")
        if self.most_trials is not None and self.most_trials < self.first_trials:
            raise ValueError(f"{self.first_trials} first trials are more than the most, {self.most_trials}")
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
            kept = max(-(-layouts // 2), min(self.finalists, layouts))
            spent += kept * until
            if spent > _ROUNDS_SHARE * self.trials or (kept == layouts and until >= _FEWEST_TRIALS):
                break
            if self.most_trials is not None and 2 * until > self.most_trials:
                break
            layouts, until = kept, 2 * until
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
        through: dict[str, int] = {}
        before = 0
        for layouts, until in self.rounds(len(contenders)):
            if before:
                alive = _kept(problem, alive, [known.outcomes(item) for item in alive], before, layouts)
            before = until
            through.update((item.layout.key, until) for item in alive)
            if tasks := known.tasks(alive, [until] * len(alive)):
                return Standing(finalists=known.scored(alive), tasks=tasks, trials=known.trials)
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
        )
        members = {racers[row].layout.key for row in selected.found.members}
        finalists = _without_intruders(
            problem.goals, known.scored([item for item in racers if item.layout.key in chosen | members]), members
        )
        return Standing(
            finalists=finalists,
            tasks=known.tasks(racers, selected.wanted.tolist()) or self._deciding(problem, finalists, known),
            trials=known.trials,
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
        judged = [item for item in standing.finalists if problem.goals[1] in item.scores]
        front = front_of(judged, problem.goals)
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


def survivors(costs: FloatArray, errors: FloatArray, keep: int) -> IntArray:
    """Return the ``keep`` layouts least dominated, as ascending row numbers.

    Parameters
    ----------
    costs
        Exact first goal, shape (n,).
    errors
        Second goal, a row a layout and a column a replication, shape (n, r); common random numbers make the
        columns comparable.
    keep
        How many rows stay.

    Notes
    -----
    A row's rival is the best other row that costs no more. The evidence against the row is the mean paired
    difference to its rival over its standard error; the variance of the differences is shrunk, with four
    degrees of freedom, to the pooled relative variance, because single variances from two trials are useless.
    One replication shows no variance; there the difference is taken relative to the mean of the row, as if all
    relative variances were equal.
    """
    count, replications = errors.shape
    if count <= keep or keep == 0:
        return np.arange(min(count, keep))
    means = errors.mean(axis=1)
    rivals = np.where(costs[None, :] <= costs[:, None], means[None, :], np.inf)
    np.fill_diagonal(rivals, np.inf)
    rival = rivals.argmin(axis=1)
    unrivalled = ~np.isfinite(rivals.min(axis=1))
    differences = errors - errors[rival]
    gap = differences.mean(axis=1)
    scale = np.maximum(means, 1e-12) ** 2
    if replications == 1:
        evidence = np.where(unrivalled, -np.inf, gap / np.sqrt(scale))
        return np.sort(np.argsort(evidence, kind="stable")[:keep])
    own = differences.var(axis=1, ddof=1)
    pooled = float(np.median(own[~unrivalled] / scale[~unrivalled])) * scale
    degrees = replications - 1.0
    variance = (_PRIOR_DEGREES * pooled + degrees * own) / (_PRIOR_DEGREES + degrees)
    evidence = np.where(unrivalled, -np.inf, gap / np.sqrt(np.maximum(variance, 1e-300) / replications))
    return np.sort(np.argsort(evidence, kind="stable")[:keep])


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
        for item in front_of([item for item in left if goals[1] in item.scores], goals).members
        if item.layout.key not in members
    }:
        left = tuple(item for item in left if item.layout.key not in intruders)
    return left


def _kept(
    problem: Problem,
    alive: Sequence[Evaluated],
    tables: Sequence[TrialOutcomes | None],
    trials: int,
    keep: int,
) -> list[Evaluated]:
    """Return the layouts that stay after ``trials``: half of the places by the goal, the rest by the demand."""
    judged = [(item, table.head(trials)) for item, table in zip(alive, tables, strict=True) if table is not None]
    if not judged:
        return []
    costs = np.array([item.scores[problem.goals[0]].value for item, _ in judged])
    errors = np.array([table.column(problem.goals[1]) for _, table in judged])
    # All layouts meet the same drives, so one that never entered a zone says nothing of any of them.
    errors = errors[:, ~np.isnan(errors).any(axis=0)]
    if not errors.shape[1]:
        return [item for item, _ in judged]
    if not problem.limits:
        return [judged[row][0] for row in survivors(costs, errors, keep)]
    demands = np.array([_demand(problem.limits, table) for _, table in judged])
    chosen = set(survivors(costs, errors, -(-keep // 2)).tolist())
    for places in range(keep // 2, keep + 1):
        chosen_now = chosen | set(survivors(costs, demands, places).tolist())
        if len(chosen_now) >= min(keep, len(judged)):
            break
    return [judged[row][0] for row in sorted(chosen_now)]


def _demand(limits: Sequence[Limit], table: TrialOutcomes) -> FloatArray:
    """Return for each replication the worst ratio of a limited score to its limit, shape (n,)."""
    ratios = [_ratios(limit, table.column(limit.score)) for limit in limits if limit.score in table.columns]
    if not ratios:
        return np.zeros(len(table))
    # A drive that never entered a zone says nothing of it, for no layout: there NaN gives way to the other limits.
    return np.asarray(np.fmax.reduce([np.zeros(len(table)), *ratios]))


def _ratios(limit: Limit, values: FloatArray) -> FloatArray:
    """Return `Limit.ratio` of each value; of one that is not known, NaN."""
    return np.array([math.nan if math.isnan(value) else limit.ratio(value) for value in values.tolist()])
