"""What a budget for tags can show: most runs, the shortest runs, or the whole front of tags and runs served."""

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

from layoutopt.identity import BoolArray
from layoutopt.result import Status
from solvers.covering.search import worthiest
from solvers.demands import Runs, random_runs_of
from solvers.epsilon_constraint import BudgetAnswer, OpenRange, epsilon_constraint_front
from solvers.placement import place_tags
from solvers.placement_answer import (
    Placed,
    PlacementEffort,
    checked,
    covered,
    places_of,
    unanswerable,
    without_tags,
)
from solvers.placement_model import Served, TagPlacement, served


def cover_within(
    question: TagPlacement,
    budget_cents: int,
    *,
    effort: PlacementEffort | None = None,
    stop: Callable[[], bool] = lambda: False,
) -> Placed:
    """Return the tags within a budget with which most of the sampled runs see what they demand.

    The sample is drawn evenly, ``effort.budget_runs`` of each demand, so that its share speaks for all runs.

    Raises
    ------
    ValueError
        If the budget is below zero.
    """
    if budget_cents < 0:
        raise ValueError(f"a budget is zero or more, got {budget_cents} cents")
    effort = effort or PlacementEffort()
    drawn = _Drawn.of(question, effort, effort.budget_runs, stop)
    if isinstance(drawn, Placed):
        return drawn
    tags = budget_cents // question.tag_price_cents
    if tags < question.required_count:
        message = f"the budget pays for {tags} tags, and {question.required_count} are required"
        return without_tags(Status.BUDGET_TOO_SMALL, message, bound=float(question.required_count))
    return drawn.within(tags, whole=True)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SmallestGap:
    """The shortest run on which a budget can show what is demanded, from both sides.

    ``placed`` meets ``length_m``; no choice within the budget meets ``impossible_m`` (zero if none was shown to be
    impossible). Between the two nothing is known. ``length_m`` is ``None`` if not even the longest length was met;
    ``placed`` then says why.
    """

    length_m: float | None
    impossible_m: float
    step_m: float
    placed: Placed

    @property
    def decided(self) -> bool:
        """Whether the next shorter length that was looked at is proven to be impossible."""
        return self.length_m is not None and self.length_m - self.impossible_m < 1.5 * self.step_m


def smallest_gap(
    question: TagPlacement,
    budget_cents: int,
    *,
    longest_m: float,
    step_m: float = 0.05,
    effort: PlacementEffort | None = None,
    stop: Callable[[], bool] = lambda: False,
) -> SmallestGap:
    """Return the smallest worst gap within a budget, by bisection over multiples of ``step_m``.

    All demands of runs get the same length; those of poses stay. The longest length looked at is the greatest
    multiple of the step up to ``longest_m``. The covering problem of each has a tenth of the steps of one alone.

    Raises
    ------
    ValueError
        If the step is not positive, the longest length is shorter than a step, all demands are of poses, or the
        budget is below zero.
    """
    longest = math.floor(longest_m / step_m + 1e-9) if step_m > 0.0 else 0
    if not longest:
        raise ValueError(f"gaps of up to {longest_m} m in steps of {step_m} m: the step is positive and no longer")
    effort = effort or PlacementEffort()
    many = replace(effort, cover=effort.shorter)
    if not any(demand.length_m > 0.0 for demand in question.demands):
        raise ValueError("the smallest gap is sought among runs, and all demands are of poses")

    def at(steps: int) -> Placed:
        demands = tuple(
            replace(demand, length_m=round(steps * step_m, 9)) if demand.length_m > 0.0 else demand
            for demand in question.demands
        )
        return place_tags(replace(question, demands=demands), budget_cents=budget_cents, effort=many, stop=stop)

    shortest, impossible = 0, 0
    best = at(longest)
    if best.xy_m is None:
        return SmallestGap(length_m=None, impossible_m=0.0, step_m=step_m, placed=best)
    while longest - shortest > 1 and not stop():
        middle = (shortest + longest) // 2
        placed = at(middle)
        if placed.xy_m is not None:
            longest, best = middle, placed
            continue
        shortest = middle
        if placed.status in (Status.INFEASIBLE, Status.BUDGET_TOO_SMALL):
            impossible = middle
    if longest - shortest > 1:
        best = replace(best, status=Status.STOPPED_BY_LIMIT, message="stopped before shorter runs were looked at")
    return SmallestGap(
        length_m=round(longest * step_m, 9),
        impossible_m=round(impossible * step_m, 9),
        step_m=step_m,
        placed=best,
    )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class FrontPoint:
    """What some number of new tags can serve: ``placed`` within ``tags``; its bound holds for all that many."""

    tags: int
    placed: Placed


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class CoverageFront:
    """New tags against the share of sampled runs that they serve.

    Attributes
    ----------
    points
        By rising number of tags; no other serves as many runs with fewer of them.
    open_ranges
        Numbers of new tags, both ends included, for which better choices may exist; ``bound`` is the least share
        of runs that these leave unserved. Empty where the front is proven complete.
    refused
        The ending where there is no front; else ``None``.
    """

    points: tuple[FrontPoint, ...] = ()
    open_ranges: tuple[OpenRange, ...] = ()
    refused: Placed | None = None

    @property
    def complete(self) -> bool:
        """Whether it is proven that no better choice exists for any number of tags."""
        return self.refused is None and not self.open_ranges


def coverage_front(
    question: TagPlacement,
    *,
    budget_cents: int | None = None,
    effort: PlacementEffort | None = None,
    stop: Callable[[], bool] = lambda: False,
) -> CoverageFront:
    """Return the front of new tags and runs served, by the epsilon-constraint method.

    Runs are drawn as for `cover_within`, ``effort.front_runs`` of each demand. The front begins with tags that
    serve every run which can be served, or with the budget, and goes down tag by tag; where that would take more
    than ``effort.budgets`` budgets, in equal steps. What lies between two budgets was not looked at, and is an
    open range with the bound of the larger budget, which holds for every smaller one.

    Raises
    ------
    ValueError
        If the budget is below zero.
    """
    if budget_cents is not None and budget_cents < 0:
        raise ValueError(f"a budget is zero or more, got {budget_cents} cents")
    effort = effort or PlacementEffort()
    drawn = _Drawn.of(question, effort, effort.front_runs, stop)
    if isinstance(drawn, Placed):
        return CoverageFront(refused=drawn)
    most = len(question.slots) if budget_cents is None else budget_cents // question.tag_price_cents
    least = question.required_count
    first = drawn.serving_all()
    stride = max(1, math.ceil((min(first.new if first else most, most) - least) / drawn.effort.budgets))
    known_unmet = float(len(drawn.sample.lost))

    def solve(budget: float) -> BudgetAnswer[FrontPoint]:
        nonlocal known_unmet
        tags = most if budget == math.inf else math.floor(budget)
        if tags < least:
            return BudgetAnswer(status=Status.INFEASIBLE)
        if stop():
            return BudgetAnswer(status=Status.STOPPED_BY_LIMIT, bound=known_unmet)
        if first is not None and first.new <= tags and budget == math.inf:
            return drawn.answer(FrontPoint(tags=first.new, placed=first), Status.OPTIMAL, known_unmet)
        looked_at = tags if budget == math.inf else least + (tags - least) // stride * stride
        placed = drawn.within(looked_at, whole=False)
        point, bound = FrontPoint(tags=looked_at, placed=placed), known_unmet
        known_unmet = max(known_unmet, drawn.unmet(placed.bound))
        if looked_at == tags:
            return drawn.answer(point, placed.status, known_unmet)
        return drawn.answer(point, Status.BOUNDED, bound)

    front = epsilon_constraint_front(solve, cost_step=1.0)
    return CoverageFront(
        points=tuple(answer.solution for answer in front.members if answer.solution is not None),
        open_ranges=tuple(
            OpenRange(
                # With required tags alone there is one choice, so that nothing better is missing there.
                low_cost=max(float(least + 1), item.low_cost),
                high_cost=float(min(most, math.floor(min(item.high_cost, most)))),
                bound=None if item.bound is None else item.bound / drawn.total,
            )
            for item in front.open_ranges
        ),
    )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class _Drawn:
    """Runs drawn evenly, and their covering problem in which not every run must be served."""

    question: TagPlacement
    effort: PlacementEffort
    stop: Callable[[], bool]
    runs: tuple[Runs, ...]
    sample: Served

    @classmethod
    def of(
        cls, question: TagPlacement, effort: PlacementEffort, count: int, stop: Callable[[], bool]
    ) -> "_Drawn | Placed":
        """Return so many runs of each demand of a question, or why it has no answer."""
        runs = tuple(
            random_runs_of(demand, question.scenario, count, effort.seed_of(0), routes=effort.budget_routes)
            for demand in question.demands
        )
        if reason := unanswerable(question, runs, effort):
            return without_tags(Status.INFEASIBLE, reason)
        sample = served(question, runs, every_run=False)
        return cls(question=question, effort=effort, stop=stop, runs=runs, sample=sample)

    @property
    def total(self) -> int:
        """Number of runs of all demands."""
        return sum(map(len, self.runs))

    def unmet(self, share: float) -> float:
        """Return how many runs a choice leaves out that serves this share of them."""
        return float(round((1.0 - share) * self.total))

    def within(self, tags: int, *, whole: bool) -> Placed:
        """Return the choice of at most so many new tags that serves most runs; ``whole`` with the whole effort."""
        small = self.sample.small
        if tags == self.question.required_count:
            # There is one choice only, which no bound need be proven for.
            placed = self._placed(Status.OPTIMAL, self.question.fixed, "")
            return replace(placed, bound=placed.met_share)
        answer = worthiest(
            small.problem,
            (tags - self.question.required_count) * self.question.tag_price_cents,
            places=places_of(self.question, self.sample),
            effort=self.effort.budget_cover if whole else self.effort.one_budget,
            stop=self.stop,
        )
        assert answer.chosen is not None, "to choose nothing keeps every budget"
        placed = self._placed(answer.status, small.whole(answer.chosen), answer.message)
        return replace(placed, bound=(answer.bound + small.worth_met) / self.total)

    def serving_all(self) -> Placed | None:
        """Return tags that serve every run that can be served; ``None`` if the rules leave none that was found."""
        every = served(self.question, self.sample.runs)
        answer = covered(self.question, every, effort=self.effort.cover, stop=self.stop)
        if answer.chosen is None:
            return None
        placed = self._placed(answer.status, answer.chosen, answer.message)
        return replace(placed, bound=1.0 - len(self.sample.lost) / self.total)

    def answer(self, point: FrontPoint, status: Status, unmet: float) -> BudgetAnswer[FrontPoint]:
        """Return a point as an answer within a budget, with the runs it leaves out as its value."""
        return BudgetAnswer(
            status=status,
            solution=point,
            value=self.unmet(point.placed.met_share),
            cost=float(point.placed.new),
            bound=None if status is Status.OPTIMAL else unmet,
        )

    def _placed(self, status: Status, chosen: BoolArray, message: str) -> Placed:
        """Return a choice with its check; the bound is left to the caller."""
        found = checked(self.question, self.runs, chosen, self.effort, status=status, rounds=1)
        return replace(found, lost=self.sample.lost, message=message, within_budget=True)
