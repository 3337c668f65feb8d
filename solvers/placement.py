"""Placement of single tags on a real floor: the fewest that show a robot what it demands, with a proof.

Runs are endless in number, so a sample of them makes the covering problem. What a choice misses among fresh
random runs is added and the search goes on; at last tags are only added, until fresh runs find nothing missed. A
sample is a part of the demand, so a bound for it holds for the whole.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace

from layoutopt.identity import BoolArray
from layoutopt.layout import WHOLE_FLOOR, FloorTags, ZonePattern
from layoutopt.patterns.listed import listed
from layoutopt.result import Status
from solvers.covering.search import CoverAnswer, cheapest
from solvers.demands import Runs, joined, runs_of, share_by_draw
from solvers.placement_answer import (
    Placed,
    PlacementEffort,
    checked,
    covered,
    fresh_runs,
    too_many,
    unanswerable,
    unserved,
    without_tags,
)
from solvers.placement_model import Served, TagPlacement, covering_of, missed_runs, served


def place_tags(
    question: TagPlacement,
    *,
    budget_cents: int | None = None,
    effort: PlacementEffort | None = None,
    stop: Callable[[], bool] = lambda: False,
) -> Placed:
    """Return the fewest new tags found that meet every demand, with a bound on every other choice.

    Parameters
    ----------
    budget_cents
        If given, dearer choices are no answer; the status says whether a cheaper one may exist.
    stop
        Asked now and then whether to end early.

    Raises
    ------
    ValueError
        If the budget is below zero.
    """
    if budget_cents is not None and budget_cents < 0:
        raise ValueError(f"a budget is zero or more, got {budget_cents} cents")
    return _Search(
        question=question, budget_cents=budget_cents, effort=effort or PlacementEffort(), stop=stop
    ).answer()


def floor_tags_of(placed: Placed, tag_part: str, tag_size_m: tuple[float, float]) -> FloorTags:
    """Return the placed tags as floor tags of a layout.

    Raises
    ------
    ValueError
        If there is no tag.
    """
    if placed.xy_m is None or not len(placed.xy_m):
        raise ValueError(f"there is no tag to lay: {placed.message or placed.status.value}")
    laid = ZonePattern(zone=WHOLE_FLOOR, pattern=listed(points_m=placed.xy_m.tolist()))
    return FloorTags(zones=(laid,), tag_part=tag_part, tag_size_m=tag_size_m)


def sampled(question: TagPlacement, effort: PlacementEffort) -> list[Runs]:
    """Return the first sample of runs of each demand."""
    return [
        runs_of(
            demand,
            question.scenario,
            step_m=effort.step_m,
            headings=effort.headings,
            routes=effort.sample_routes,
            seed=effort.seed,
        )
        for demand in question.demands
    ]


@dataclass(slots=True, kw_only=True)
class _Search:
    """One search: the runs that were met so far, and what no choice serves of them."""

    question: TagPlacement
    budget_cents: int | None
    effort: PlacementEffort
    stop: Callable[[], bool]
    rounds: int = 0
    looked_at: int = 0
    draws: int = 0
    lost: Runs = field(default_factory=lambda: joined([]))

    def answer(self) -> Placed:
        """Return the placement."""
        effort, sample = self.effort, sampled(self.question, self.effort)
        if reason := unanswerable(self.question, sample, effort):
            return without_tags(Status.INFEASIBLE, reason)
        left = self._left_cents()
        if left is not None and left < 0:
            return self._without_choice(0, Status.BUDGET_TOO_SMALL, "", 0)
        along_routes = all(demand.along_routes for demand in self.question.demands)
        found, fresh, start = served(self.question, sample), sample, list[BoolArray]()
        while True:
            if self._refuses(found, fresh):
                return unserved(self.lost, self.looked_at, len(found), self.rounds)
            last = along_routes or self.rounds == effort.rounds or self.stop()
            self.rounds += 1
            answer = covered(
                self.question,
                found,
                effort=effort.cover if last else effort.quick,
                starts=start,
                budget_cents=left,
                stop=self.stop,
            )
            if answer.chosen is None:
                return self._without_choice(answer.bound, answer.status, answer.message, len(found))
            if last:
                return self._mended(found, answer, answer.chosen)
            start = [answer.chosen]
            fresh = fresh_runs(self.question, effort, self.rounds - 1)
            missed = missed_runs(self.question, answer.chosen, fresh)
            found = served(self.question, _together(found.runs, missed))

    def _mended(self, found: Served, answer: CoverAnswer, chosen: BoolArray) -> Placed:
        """Return the answer with tags added until fresh runs find nothing missed."""
        question, effort, runs = self.question, self.effort, found.runs
        stopped, bound = answer.status is Status.STOPPED_BY_LIMIT, answer.bound
        # What a budget leaves open is told at the end, when it is known how many tags there are.
        messages = ["" if answer.status is Status.TARGET_NOT_MET else answer.message]
        for number in range(effort.rounds, effort.rounds + effort.mending_rounds):
            if self.stop():
                stopped = True
                messages.append("stopped before fresh runs had found what is still missed")
                break
            fresh = fresh_runs(question, effort, number)
            missed = missed_runs(question, chosen, fresh)
            more = served(question, missed)
            if self._refuses(more, fresh):
                return unserved(self.lost, self.looked_at, len(more), self.rounds)
            if not len(more):
                break
            runs = _together(runs, more.runs)
            self.rounds += 1
            laid = replace(covering_of(question, more.runs), locked=chosen)
            mended = cheapest(laid, effort=effort.quick, stop=self.stop)
            if mended.chosen is None:
                # The tags that lie may bar the place of one that is missing, so that all are asked about anew.
                mended = covered(question, served(question, runs), effort=effort.cover, stop=self.stop)
                bound = max(bound, mended.bound)
            if mended.chosen is None:
                return self._without_choice(bound, mended.status, mended.message, sum(map(len, runs)))
            chosen = mended.chosen
            if self._mends_enough(missed, fresh):
                break
        else:
            messages.append(
                "the rounds that add tags for what fresh runs miss ended before fresh runs missed little enough"
            )
        new = int(chosen[: len(question.slots)].sum())
        if self.budget_cents is not None and question.tag_price_cents * new > self.budget_cents:
            return self._without_choice(bound, Status.TARGET_NOT_MET, "", sum(map(len, runs)), new)
        least = self._tags(bound)
        status = Status.OPTIMAL if least == new else Status.BOUNDED
        return replace(
            checked(
                question,
                runs,
                chosen,
                effort,
                status=Status.STOPPED_BY_LIMIT if stopped else status,
                rounds=self.rounds,
            ),
            bound=float(least),
            lost=self.lost,
            message="; ".join(sentence for sentence in messages if sentence),
        )

    def _refuses(self, found: Served, fresh: Sequence[Runs]) -> bool:
        """Count what a look at fresh runs found that no choice serves; return whether all looks found too much."""
        self.lost = joined([self.lost, found.lost])
        self.looked_at += sum(map(len, fresh))
        self.draws += sum(part.draws for part in fresh)
        return too_many(len(self.lost), self.looked_at, self.draws, self.question.unserved_share)

    def _mends_enough(self, missed: Sequence[Runs], fresh: Sequence[Runs]) -> bool:
        """Return whether a look missed so little of every demand that the check would hardly find it."""
        return all(
            not len(part) or share_by_draw(part, looked_at).value < self.effort.least_share(demand)
            for demand, part, looked_at in zip(self.question.demands, missed, fresh, strict=True)
        )

    def _left_cents(self) -> int | None:
        """Return what required tags leave of the budget."""
        if self.budget_cents is None:
            return None
        return self.budget_cents - self.question.required_count * self.question.tag_price_cents

    def _tags(self, cents: int) -> int:
        """Return the least number of new tags where those that are not required cost so much at least."""
        return self.question.required_count - (-cents // self.question.tag_price_cents)

    def _without_choice(
        self, bound_cents: int, status: Status, message: str, samples: int, fewest: int | None = None
    ) -> Placed:
        least = self._tags(bound_cents)
        if self.budget_cents is not None and status in (Status.BUDGET_TOO_SMALL, Status.TARGET_NOT_MET):
            paid = self.budget_cents // self.question.tag_price_cents
            message = (
                f"the budget pays for {paid} new tags, and no choice that serves every run has fewer than {least}"
            )
            if fewest is not None:
                message += f"; the fewest found are {fewest}"
        if status is Status.INFEASIBLE:
            message = "spacing and tags a tile leave no choice that serves every run"
        return without_tags(status, message, bound=float(least), samples=samples, rounds=self.rounds)


def _together(runs: tuple[Runs, ...], more: list[Runs] | tuple[Runs, ...]) -> tuple[Runs, ...]:
    return tuple(joined([have, added]) for have, added in zip(runs, more, strict=True))
