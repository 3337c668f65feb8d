"""What is known of a placement, and the endings that give none: each with a status and a sentence."""

import math
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, field, replace
from typing import Final

import numpy as np

from layoutopt.identity import BoolArray, FloatArray, IntArray
from layoutopt.result import Status
from layoutopt.units import format_length
from solvers.covering.search import CoverAnswer, Effort, cheapest
from solvers.demands import Demand, Runs, joined, random_runs_of
from solvers.placement_check import Missed, missed_share
from solvers.placement_model import Served, TagPlacement, contradiction, short_of_tags

_FALSE_REFUSAL: Final = 1e-6
"""Chance that runs which may be left out are found too many by their sampling alone."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PlacementEffort:
    """How finely demands are sampled, and how long the search goes on; counted, not timed.

    Attributes
    ----------
    step_m, headings
        Distance of starts of runs in the first sample, and directions from each.
    sample_routes
        Along routes the first sample follows so many.
    rounds
        How often missed runs are added to the sample and the search goes on; not where all demands are along
        routes, since what one choice misses there tells no more than so many routes more in the sample.
    mending_rounds
        How often, after that, tags are added for runs that are still missed, at most; it ends when a look misses
        no more than `least_share`.
    trial_runs, trial_routes
        Fresh random runs of every demand that look for missed ones in each round; along routes all runs of so many
        routes, if they are no more than that.
    check_runs, check_routes
        Fresh random runs of every demand on which the answer is checked at the end by plain numpy; along routes
        drawn from so many.
    budget_runs, front_runs, budget_routes
        Random runs of every demand, of which most are to be served within a budget, and the same for each budget
        of a front; along routes drawn from so many.
    budgets
        How many budgets a front of coverage is made of, at most; all of them where there are no more.
    cover
        Effort of the covering problem; a tenth of its steps in rounds that only find out what is missed and for
        lengths and budgets of which there are many. By default windows are left out, and up to 50,000 slots are
        searched as a whole: with 18,581 rows and 17,590 slots a walk of 22 s found 277 tags, regions in 64 s 279.
    budget_cover
        The same where most runs are to be served within a budget: there a step weighs all runs that are not.
    """

    step_m: float = 0.1
    headings: int = 16
    sample_routes: int = 700
    rounds: int = 3
    mending_rounds: int = 24
    trial_runs: int = 100_000
    trial_routes: int = 400
    check_runs: int = 5_000
    check_routes: int = 1_000
    budget_runs: int = 30_000
    front_runs: int = 8_000
    budget_routes: int = 1_000
    budgets: int = 16
    cover: Effort = field(
        default_factory=lambda: Effort(window_rounds=0, walk_slots=50_000, steps=500_000, iterations=1500)
    )
    budget_cover: Effort = field(
        default_factory=lambda: Effort(window_rounds=0, walk_slots=50_000, steps=100_000, iterations=1500)
    )
    seed: int = 0

    @property
    def quick(self) -> Effort:
        """Effort of a round that needs no proof."""
        return replace(self.shorter, iterations=0, window_rounds=0, exact_slots=0)

    @property
    def shorter(self) -> Effort:
        """Effort of one problem of many, a tenth of the steps of one that stands alone."""
        return _shorter(self.cover)

    @property
    def one_budget(self) -> Effort:
        """Effort of one budget of a front, a tenth of the steps and a fifth of the iterations of one alone."""
        effort = _shorter(self.budget_cover)
        return replace(effort, iterations=effort.iterations // 5)

    def least_share(self, demand: Demand) -> float:
        """Return the share of missed runs of which the check finds one draw on average; less is not mended."""
        return 1.0 / (self.check_routes if demand.along_routes else self.check_runs)

    def seed_of(self, round_number: int) -> int:
        """Return the seed of a round's fresh runs; other seeds of the effort have others."""
        return 1000 * self.seed + round_number

    @property
    def check_seed(self) -> int:
        """Seed of the runs of the check, which shape no choice; the next demands have the next seeds."""
        return self.seed_of(self.rounds + self.mending_rounds)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Placed:
    """The answer, with what is known of it.

    Attributes
    ----------
    status
        `Status.OPTIMAL`, ``BOUNDED``, ``STOPPED_BY_LIMIT``, ``BUDGET_TOO_SMALL``, ``TARGET_NOT_MET`` or
        ``INFEASIBLE``.
    xy_m
        All tags, installed ones included, shape (n, 2), m; ``None`` without an answer.
    new
        How many of them are new.
    bound
        No choice among these slots that meets the whole demand has fewer new tags. Where coverage is wanted within
        a budget: no choice meets more than this share of the sampled runs.
    met_share
        Share of the sampled runs that see what they demand.
    missed
        For each demand what the check on fresh runs found.
    lost
        Runs that no choice can serve, among all that were looked at.
    samples, rounds
        How many runs the last problem had, and how many rounds there were.
    message
        What is missing, in words.
    within_budget
        Whether coverage within a budget was wanted.
    """

    status: Status
    xy_m: FloatArray | None
    new: int
    bound: float
    met_share: float
    missed: tuple[Missed, ...]
    lost: Runs
    samples: int
    rounds: int
    message: str = ""
    within_budget: bool = False

    @property
    def gap(self) -> float | None:
        """How much of the new tags a better choice could save at most, as a share; ``None`` without an answer.

        Where coverage is wanted, how much more of the sampled runs a better choice could meet at most, as a share.
        """
        if self.xy_m is None:
            return None
        if self.within_budget:
            return 1.0 - self.met_share / self.bound if self.bound else 0.0
        return 1.0 - self.bound / self.new if self.new else 0.0


def _shorter(effort: Effort) -> Effort:
    return replace(effort, steps=max(effort.steps // 10, 1), region_steps=max(effort.region_steps // 10, 1))


def covered(
    question: TagPlacement,
    sample: Served,
    *,
    effort: Effort,
    starts: Iterable[BoolArray] = (),
    budget_cents: int | None = None,
    stop: Callable[[], bool] = lambda: False,
) -> CoverAnswer:
    """Return the cheapest choice of places that serves a sample; parameters as of `covering.search.cheapest`.

    Required tags cost nothing in it.
    """
    small = sample.small
    answer = cheapest(
        small.problem,
        budget=budget_cents,
        places=places_of(question, sample),
        starts=[small.part(start) for start in starts],
        effort=effort,
        stop=stop,
    )
    return answer if answer.chosen is None else replace(answer, chosen=small.whole(answer.chosen))


def places_of(question: TagPlacement, sample: Served) -> IntArray | None:
    """Return where the slots of a sample's problem lie on their grid if lattices may be good starts.

    They cover floors, not lines.
    """
    everywhere = any(not demand.along_routes for demand in question.demands)
    columns = question.columns if everywhere else None
    return None if columns is None else columns[sample.small.slots]


def fresh_runs(question: TagPlacement, effort: PlacementEffort, round_number: int) -> list[Runs]:
    """Return the fresh random runs of each demand that look for missed ones in a round."""
    seed = effort.seed_of(round_number)
    return [
        random_runs_of(demand, question.scenario, effort.trial_runs, seed, routes=effort.trial_routes)
        for demand in question.demands
    ]


def check_runs(question: TagPlacement, effort: PlacementEffort) -> list[Runs]:
    """Return the fresh random runs of each demand on which answers are checked; they shape no choice."""
    return [
        random_runs_of(
            demand,
            question.scenario,
            effort.check_runs,
            effort.check_seed + number,
            routes=effort.check_routes,
        )
        for number, demand in enumerate(question.demands)
    ]


def unanswerable(question: TagPlacement, sample: Sequence[Runs], effort: PlacementEffort) -> str:
    """Return in words why a question has no answer, whatever slots see; empty if it may have one.

    Either required tags contradict each other, or a demand speaks of no run at all, neither on the grid of the
    sample nor among random ones: no tags would then be taken for an answer to it.
    """
    if said := contradiction(question):
        return said
    for number, (demand, part) in enumerate(zip(question.demands, sample, strict=True)):
        if not len(part) and not len(fresh_runs(question, effort, 0)[number]):
            return f"the robot has room for none of the runs that a demand speaks of: {in_words(demand)}"
    return ""


def in_words(demand: Demand) -> str:
    """Return a demand as a person says it."""
    what = f"runs of {format_length(demand.length_m)}" if demand.length_m else "poses"
    where = f" from zone '{demand.zone}'" if demand.zone else ""
    along = " along routes" if demand.along_routes else ""
    return f"{what}{where}{along} see {demand.tags} tag{'' if demand.tags == 1 else 's'}"


def too_many(lost: int, looked_at: int, draws: int, share: float) -> bool:
    """Return whether more runs are lost than a share allows; chance alone refuses one question in a million.

    Runs of one draw, such as a route, count as one in the test: they may be lost all together.
    """
    from scipy.special import bdtrc

    if not share:
        return lost > 0
    alike = math.floor(lost * draws / looked_at)
    return lost > share * looked_at and bool(bdtrc(alike - 1, draws, share) < _FALSE_REFUSAL)


def checked(
    question: TagPlacement,
    runs: Sequence[Runs],
    chosen: BoolArray,
    effort: PlacementEffort,
    *,
    status: Status,
    rounds: int,
) -> Placed:
    """Return a choice with its check on fresh runs; bound, lost runs and message are left to the caller."""
    xy_m = question.places_m[chosen]
    total = sum(map(len, runs))
    unmet = sum(
        int(short_of_tags(part, demand, question.antennas, xy_m).sum())
        for part, demand in zip(runs, question.demands, strict=True)
    )
    missed = tuple(
        missed_share(demand, part, question.antennas, xy_m)
        for demand, part in zip(question.demands, check_runs(question, effort), strict=True)
    )
    return Placed(
        status=status,
        xy_m=xy_m,
        new=int(chosen[: len(question.slots)].sum()),
        bound=0.0,
        met_share=1.0 - unmet / total if total else 1.0,
        missed=missed,
        lost=joined([]),
        samples=total,
        rounds=rounds,
    )


def without_tags(
    status: Status,
    message: str,
    *,
    bound: float = 0.0,
    lost: Runs | None = None,
    samples: int = 0,
    rounds: int = 0,
) -> Placed:
    """Return an ending without tags."""
    return Placed(
        status=status,
        xy_m=None,
        new=0,
        bound=bound,
        met_share=0.0,
        missed=(),
        lost=joined([]) if lost is None else lost,
        samples=samples,
        rounds=rounds,
        message=message,
    )


def unserved(lost: Runs, looked_at: int, samples: int, rounds: int) -> Placed:
    """Return the refusal of a question of which too many runs cannot be served."""
    x_m, y_m, heading_rad = lost.poses[0]
    message = (
        f"{len(lost)} of {looked_at} runs see too few slots whatever is chosen, the first from "
        f"({x_m:.3f}, {y_m:.3f}) m heading {np.degrees(heading_rad):.1f} deg"
    )
    return without_tags(Status.INFEASIBLE, message, lost=lost, samples=samples, rounds=rounds)
