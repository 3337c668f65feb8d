"""Every layout of the space, judged by what can be had without simulation."""

from dataclasses import dataclass
from typing import ClassVar, Final

from layoutopt import feasibility
from layoutopt.layout import Layout
from layoutopt.problem import Problem
from layoutopt.protocols import Evaluate, SolverCard, Stop
from layoutopt.result import Evaluated, Result, Status
from layoutopt.scores import Score
from solvers.front import front_of

CARD: Final = SolverCard(
    summary="Enumerates the design space; proven optimal for goals that are exact.",
    reference="complete enumeration",
    exact=True,
    multi_objective=True,
    handles_noise=False,
)


@dataclass(frozen=True, slots=True, kw_only=True)
class Screened:
    """A layout with its exact scores; ``rule`` and ``refusal`` say why it is out, both empty if it may race."""

    evaluated: Evaluated
    refusal: str = ""
    rule: str = ""


def exact_scores(problem: Problem, layout: Layout) -> dict[str, Score]:
    """Return every score of a layout that needs no simulation."""
    scores: dict[str, Score] = {}
    for objective in problem.objectives:
        if objective.card.fidelity != "simulated":
            scores.update(objective(layout, problem.design, None))
    return scores


def screen(problem: Problem) -> tuple[Screened, ...]:
    """Return every layout of the space with its exact scores, by cost, then key.

    A layout is refused if it cannot be built or if an exact score breaks a limit, such as the budget.
    """
    found = []
    for layout in problem.space.layouts():
        scores = exact_scores(problem, layout)
        violations = feasibility.check(layout, problem.design)
        reasons = [(violation.rule, violation.message) for violation in violations] + [
            (
                limit.score,
                f"{limit.score} of {score.value:.6g} {score.unit} exceeds {limit.upper:.6g} {score.unit}",
            )
            for limit, score in problem.limits_on(scores)
            if score.exact and limit.broken(score)
        ]
        rule, refusal = reasons[0] if reasons else ("", "")
        found.append(Screened(evaluated=Evaluated(layout=layout, scores=scores), refusal=refusal, rule=rule))
    first_goal = problem.goals[0]
    return tuple(sorted(found, key=lambda item: (_value(item, first_goal), item.evaluated.layout.key)))


@dataclass(frozen=True, slots=True, kw_only=True)
class Exhaustive:
    """Solver for problems whose goals are all exact; it never simulates."""

    card: ClassVar[SolverCard] = CARD

    def __call__(self, problem: Problem, evaluate: Evaluate, stop: Stop) -> Result:
        """Return the proven front.

        Raises
        ------
        ValueError
            If a goal or limit needs simulation.
        """
        inexact = [
            name
            for objective in problem.objectives
            if objective.card.fidelity == "simulated"
            for name in (*problem.goals, *(limit.score for limit in problem.limits))
            if name.rpartition(".")[2] in objective.card.scores
        ]
        if inexact:
            raise ValueError(f"exhaustive search needs exact scores; {inexact[0]} is simulated")
        candidates = [item.evaluated for item in screen(problem) if not item.refusal]
        front = front_of(candidates, problem.goals)
        if not front.members:
            return Result(status=Status.INFEASIBLE, front=front, recommended={}, trials=0)
        best = front.members[0]
        return Result(
            status=Status.OPTIMAL,
            front=front,
            recommended={"cheapest": best},
            trials=0,
            bound=best.scores[problem.goals[0]].value,
            gap=0.0,
        )


def _value(item: Screened, name: str) -> float:
    score = item.evaluated.scores.get(name)
    return score.value if score is not None else float("inf")
