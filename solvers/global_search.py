"""Search over discrete and continuous parameters: which layout is best for one goal within the limits.

Four stages, each on the drives of the design scenario: an optimiser of scipy over the unit cube, in which every
layout has a few trials; a race, in which the best of all layouts seen get twice as many from round to round; a
descent from its winner in the continuous coordinates; and fresh trials, which no stage has used, for all that came
to the end. A search picks what was lucky on its trials, so only the fresh ones count as scores.
"""

import time
from collections.abc import Sequence
from dataclasses import dataclass
from typing import ClassVar, Final

from layoutopt.problem import Problem
from layoutopt.protocols import Evaluate, Evaluation, Failure, SolverCard, Stop
from layoutopt.result import Result, Status
from solvers.candidates import OVER, UNBUILDABLE, Candidates
from solvers.front import front_of
from solvers.judging import meeting_limits, pointed_out, verdict
from solvers.replayed import DifferentialEvolution, Direct, DualAnnealing, Method
from solvers.search_stages import Effort, SearchStanding, standing_of

CARD: Final = SolverCard(
    summary="Differential evolution, dual annealing or DIRECT over a mixed space, on common random numbers.",
    reference="Storn and Price 1997 (differential evolution); Haimes, Lasdon and Wismer 1971 (limits instead of "
    "weights); Kim, Pasupathy and Henderson 2015 (sample average approximation)",
    exact=False,
    multi_objective=False,
    handles_noise=True,
)
METHODS: Final = ("differential_evolution", "dual_annealing", "direct")


@dataclass(frozen=True, slots=True, kw_only=True)
class GlobalSearch:
    """Solver for one goal within limits, over spaces with intervals; it works on lists of values as well.

    Attributes
    ----------
    minimise
        The goal. Empty for the last goal of the problem that no limit speaks of: the error within a budget, the
        cost for a target of accuracy.
    method
        ``"differential_evolution"``, which asks for whole generations and so keeps many workers busy,
        ``"dual_annealing"`` or ``"direct"``.
    population, generations
        Points of a generation, and generations after the first; the other methods get as many evaluations.
    replications
        Trials of each layout in the search, the same for all.
    finalists, race_trials
        Layouts that enter the race, and how many trials its last round comes to.
    polish_evaluations
        Layouts of the descent, each with ``race_trials`` trials; 0 for none.
    fresh_trials
        Fresh trials of each layout at the end.
    seed
        Of the optimiser. That of the drives is the study's.
    starts
        Points of the unit cube over the problem's space that differential evolution begins with, beside random
        ones; the other methods know no such points.

    Raises
    ------
    ValueError
        If the method is unknown, or a number is too small.
    """

    minimise: str = ""
    method: str = "differential_evolution"
    population: int = 24
    generations: int = 30
    replications: int = 8
    finalists: int = 8
    race_trials: int = 64
    polish_evaluations: int = 40
    fresh_trials: int = 64
    seed: int = 0
    starts: tuple[tuple[float, ...], ...] = ()
    card: ClassVar[SolverCard] = CARD

    def __post_init__(self) -> None:
        """Check the settings."""
        if self.method not in METHODS:
            raise ValueError(f"a method is one of {', '.join(METHODS)}, not {self.method!r}")
        # Differential evolution makes a new point of five others.
        least = {"population": 5, "replications": 1, "finalists": 1, "fresh_trials": 2, "generations": 0}
        for name, number in least.items():
            if getattr(self, name) < number:
                raise ValueError(f"{name} must be at least {number}, got {getattr(self, name)}")
        if self.starts and self.method != "differential_evolution":
            raise ValueError(f"only differential evolution takes starts, not {self.method}")
        if self.race_trials < self.replications or self.polish_evaluations < 0:
            raise ValueError("a race has at least the trials of the search, and a descent 0 or more evaluations")

    def __call__(self, problem: Problem, evaluate: Evaluate, stop: Stop) -> Result:
        """Return the finalists' front by fresh trials, with the best layout within the limits."""
        candidates = self.candidates(problem)
        evaluations: list[Evaluation | Failure] = []
        began = time.monotonic()
        standing = self.standing(candidates, evaluations)
        while standing.tasks:
            if stop(standing.trials, time.monotonic() - began):
                return self._result(problem, standing, Status.STOPPED_BY_LIMIT)
            evaluations += evaluate(standing.tasks)
            standing = self.standing(candidates, evaluations)
        return self._result(problem, standing, Status.SEARCHED)

    def candidates(self, problem: Problem) -> Candidates:
        """Return the candidates of a problem, which remember what they looked up; any other ones do as well.

        Raises
        ------
        ValueError
            If the space is empty, or the goal is none of the problem's.
        """
        if not problem.space.readers or not all(problem.space.patterns.values()) or not problem.space.patterns:
            raise ValueError("the design space is empty: it needs a family of readers, and one of patterns a zone")
        limited = {limit.score for limit in problem.limits}
        free = [goal for goal in problem.goals if goal not in limited]
        goal = self.minimise or (free or list(problem.goals))[-1]
        if goal not in problem.goals:
            raise ValueError(f"{goal} is no goal of the problem; its goals are {', '.join(problem.goals)}")
        return Candidates(problem, goal)

    def standing(self, candidates: Candidates, evaluations: Sequence[Evaluation | Failure]) -> SearchStanding:
        """Return how the search stands after the evaluations: a pure function, so a killed search resumes."""
        effort = Effort(
            replications=self.replications,
            finalists=self.finalists,
            race_trials=self.race_trials,
            polish_evaluations=self.polish_evaluations,
            fresh_trials=self.fresh_trials,
        )
        return standing_of(candidates, self.global_method(), effort, evaluations)

    def global_method(self) -> Method:
        """Return the optimiser of the first stage."""
        evaluations = self.population * (self.generations + 1)
        if self.method == "direct":
            return Direct(evaluations=evaluations)
        if self.method == "dual_annealing":
            return DualAnnealing(evaluations=evaluations, seed=self.seed)
        return DifferentialEvolution(
            population=self.population, generations=self.generations, seed=self.seed, starts=self.starts
        )

    def _result(self, problem: Problem, standing: SearchStanding, status: Status) -> Result:
        judged = [item for item in standing.finalists if all(goal in item.scores for goal in problem.goals)]
        front = front_of(judged, problem.goals)
        if not judged and status is Status.SEARCHED:
            too_dear = OVER <= standing.nearest < UNBUILDABLE
            return Result(
                status=Status.BUDGET_TOO_SMALL if too_dear else Status.INFEASIBLE,
                front=front,
                recommended={},
                trials=standing.trials,
                shortfall=standing.reason,
            )
        meeting = meeting_limits(problem, judged) if problem.limits else judged
        best = meeting[0] if meeting else None
        status, shortfall = verdict(problem, status, judged, meeting)
        return Result(
            status=status,
            front=front,
            recommended={**pointed_out(front, None), **({"best": best} if best else {})},
            trials=standing.trials,
            shortfall=shortfall,
        )
