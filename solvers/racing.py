"""Racing: many layouts get a few trials, the promising ones more, all on the same simulated drives."""

import math
import time
from collections.abc import Sequence
from dataclasses import dataclass, replace
from typing import ClassVar, Final

import numpy as np

from layoutopt.evaluate import outcomes_of
from layoutopt.identity import FloatArray, IntArray
from layoutopt.problem import Limit, Problem
from layoutopt.protocols import Evaluate, Evaluation, Failure, SolverCard, Stop, Task, group_of
from layoutopt.result import Evaluated, Result, Status
from layoutopt.scores import TrialOutcomes
from solvers.exhaustive import screen
from solvers.front import front_of
from solvers.judging import meeting_limits, nearest_miss, pointed_out, simulated_scores

CARD: Final = SolverCard(
    summary="Successive halving on paired differences over common random numbers, for cost against error.",
    reference="Jamieson and Talwalkar, AISTATS 2016 (successive halving); Nelson and Matejcik 1995 (paired "
    "comparison under common random numbers)",
    exact=False,
    multi_objective=True,
    handles_noise=True,
)
_PRIOR_DEGREES: Final = 4.0
_ROUNDS_SHARE: Final = 0.75


@dataclass(frozen=True, slots=True, kw_only=True)
class Standing:
    """How the race stands: who is still in it, what is known of them, and what to run next.

    ``tasks`` is empty when the race is over. ``finalists`` are sorted by cost, then goal, then key; before the end
    they are those still in the race, of which some may have no trials yet.
    """

    finalists: tuple[Evaluated, ...]
    tasks: tuple[Task, ...]
    trials: int


@dataclass(frozen=True, slots=True, kw_only=True)
class Racing:
    """Solver for an exact first goal (cost) and a simulated second one.

    Every round keeps about half of the layouts and doubles the trials of those that stay. Kept are the layouts
    least dominated in the second goal and those least dominated in the demand, the worst ratio of a limited
    score to its limit; the comparison is by paired differences with a shrunken standard error. At the end,
    layouts that could be the cheapest to meet the limits get trials until their confidence bounds decide.

    Attributes
    ----------
    trials
        Budget, counted in trials: three quarters for the rounds, what is left for deciding limits. Only the
        first round may exceed it, because every layout needs its first trials.
    first_trials
        Trials of every layout in the first round.
    finalists
        A round never keeps fewer.
    deciding_trials
        Most trials a layout gets for deciding its limits.
    """

    trials: int = 4000
    first_trials: int = 2
    finalists: int = 48
    deciding_trials: int = 256
    card: ClassVar[SolverCard] = CARD

    def __call__(self, problem: Problem, evaluate: Evaluate, stop: Stop) -> Result:
        """Return the estimated front and the cheapest layout shown to meet the limits."""
        contenders = [item.evaluated for item in screen(problem) if not item.refusal]
        if self.first_trials < 2:
            raise ValueError("layouts are compared by variances, which need at least two first trials")
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
            if spent > _ROUNDS_SHARE * self.trials or (kept == layouts and until >= self.deciding_trials):
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
        tables = outcomes_of(evaluations)
        estimator, scenario = problem.estimators[0], problem.design
        groups = {item.layout.key: group_of(item.layout, scenario, estimator) for item in contenders}
        own = set(groups.values())
        failed = {item.group.layout_key for item in evaluations if isinstance(item, Failure) and item.group in own}
        trials = sum(len(table) for group, table in tables.items() if group in own)

        def outcomes(item: Evaluated) -> TrialOutcomes | None:
            return tables.get(groups[item.layout.key])

        def task(item: Evaluated, until: int) -> Task:
            first = _count(outcomes(item))
            return Task(
                layout=item.layout, scenario=scenario, estimator=estimator, first=first, count=until - first
            )

        def scored(items: Sequence[Evaluated]) -> tuple[Evaluated, ...]:
            found = (
                replace(
                    item,
                    scores={**item.scores, **simulated_scores(problem, item.layout, scenario, outcomes(item))},
                )
                for item in items
            )
            return tuple(sorted(found, key=lambda item: _rank(item, problem.goals)))

        alive = [item for item in contenders if item.layout.key not in failed]
        before = 0
        for layouts, until in self.rounds(len(contenders)):
            if before:
                alive = _kept(problem, alive, [outcomes(item) for item in alive], before, layouts)
            before = until
            tasks = tuple(task(item, until) for item in alive if _count(outcomes(item)) < until)
            if tasks:
                return Standing(finalists=scored(alive), tasks=tasks, trials=trials)
        finalists = scored(alive)
        left, deciding = self.trials - trials, []
        for item in self._undecided(problem, finalists):
            wanted = task(item, min(2 * _count(outcomes(item)), self.deciding_trials))
            left -= wanted.count
            if left < 0:
                break
            if wanted.count:
                deciding.append(wanted)
        return Standing(finalists=finalists, tasks=tuple(deciding), trials=trials)

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
        shortfall = ""
        if status is Status.SEARCHED and problem.limits:
            status = Status.TARGET_MET if meeting else Status.TARGET_NOT_MET
            shortfall = "" if meeting else nearest_miss(problem, judged)
        return Result(
            status=status, front=front, recommended=recommended, trials=standing.trials, shortfall=shortfall
        )


def survivors(costs: FloatArray, errors: FloatArray, keep: int) -> IntArray:
    """Return the ``keep`` layouts least dominated, as ascending row numbers.

    Parameters
    ----------
    costs
        Exact first goal, shape (n,).
    errors
        Second goal, a row a layout and a column a replication, shape (n, r), r at least 2; common random
        numbers make the columns comparable.
    keep
        How many rows stay.

    Notes
    -----
    A row's rival is the best other row that costs no more. The evidence against the row is the mean paired
    difference to its rival over its standard error; the variance of the differences is shrunk, with four
    degrees of freedom, to the pooled relative variance, because single variances from two trials are useless.
    """
    count, replications = errors.shape
    if count <= keep:
        return np.arange(count)
    means = errors.mean(axis=1)
    rivals = np.where(costs[None, :] <= costs[:, None], means[None, :], np.inf)
    np.fill_diagonal(rivals, np.inf)
    rival = rivals.argmin(axis=1)
    unrivalled = ~np.isfinite(rivals.min(axis=1))
    differences = errors - errors[rival]
    gap = differences.mean(axis=1)
    own = differences.var(axis=1, ddof=1)
    scale = np.maximum(means, 1e-12) ** 2
    pooled = float(np.median(own[~unrivalled] / scale[~unrivalled])) * scale
    degrees = replications - 1.0
    variance = (_PRIOR_DEGREES * pooled + degrees * own) / (_PRIOR_DEGREES + degrees)
    evidence = np.where(unrivalled, -np.inf, gap / np.sqrt(np.maximum(variance, 1e-300) / replications))
    return np.sort(np.argsort(evidence, kind="stable")[:keep])


def _rank(item: Evaluated, goals: tuple[str, ...]) -> tuple[float, float, str]:
    """Return what finalists are sorted by: cost, then the other goal, unknown last, then key."""
    goal = item.scores[goals[1]].value if goals[1] in item.scores else math.nan
    return item.scores[goals[0]].value, math.inf if math.isnan(goal) else goal, item.layout.key


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
    if errors.shape[1] < 2:
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


def _count(table: TrialOutcomes | None) -> int:
    return 0 if table is None else len(table)
