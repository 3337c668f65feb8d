"""Placement of single tags on a real floor: the fewest that show a robot what it demands, with a proof.

Runs are endless in number, so a sample of them makes the covering problem. What a choice misses among fresh
random runs is added and the search goes on; at last tags are only added, until fresh runs find nothing missed. A
sample is a part of the demand, so a bound for it holds for the whole.
"""

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field, replace
from typing import Final

import numpy as np

from layoutopt.identity import BoolArray, FloatArray, IntArray
from layoutopt.layout import WHOLE_FLOOR, FloorTags, ZonePattern
from layoutopt.patterns.listed import listed
from layoutopt.result import Status
from solvers.covering.search import CoverAnswer, Effort, cheapest, worthiest
from solvers.demands import Runs, joined, random_runs_of, runs_of
from solvers.placement_check import Missed, missed_share
from solvers.placement_model import TagPlacement, covering_of, missed_runs, servable, short_of_tags

_FALSE_REFUSAL: Final = 1e-6
"""Chance that runs which may be left out are found too many by their sampling alone."""


@dataclass(frozen=True, slots=True, kw_only=True)
class PlacementEffort:
    """How finely demands are sampled, and how long the search goes on; counted, not timed.

    Attributes
    ----------
    step_m, headings
        Distance of starts of runs in the first sample, and directions from each.
    rounds
        How often missed runs are added to the sample and the search goes on.
    mending_rounds
        How often, after that, tags are added for runs that are still missed, at most.
    trial_runs
        Fresh random runs of every demand that look for missed ones in each round.
    check_runs
        Fresh random runs of every demand on which the answer is checked at the end by plain numpy.
    cover
        Effort of the covering problem; a tenth of it in rounds that only find out what is missed. Windows are left
        out by default: with so many rows each takes long and saves next to nothing.
    """

    step_m: float = 0.1
    headings: int = 16
    rounds: int = 3
    mending_rounds: int = 24
    trial_runs: int = 100_000
    check_runs: int = 2_000
    cover: Effort = field(default_factory=lambda: Effort(window_rounds=0))
    seed: int = 0

    @property
    def quick(self) -> Effort:
        """Effort of a round that needs no proof."""
        steps = max(self.cover.steps // 10, 1)
        return replace(self.cover, steps=steps, iterations=0, window_rounds=0, exact_slots=0)

    def seed_of(self, round_number: int) -> int:
        """Return the seed of a round's fresh runs; other seeds of the effort have others."""
        return 1000 * self.seed + round_number


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
    """
    effort = effort or PlacementEffort()
    sample = sampled(question, effort)
    runs, lost = servable(question, sample)
    if _too_many(len(lost), sum(map(len, sample)), question.unserved_share):
        return _refused(runs, lost, sum(map(len, sample)), 0)
    start: list[BoolArray] = []
    for number in range(effort.rounds + 1):
        last = number == effort.rounds or stop()
        answer = cheapest(
            covering_of(question, runs),
            budget=budget_cents,
            places=lattice_places(question),
            starts=start,
            effort=effort.cover if last else effort.quick,
            stop=stop,
        )
        if answer.chosen is None or last:
            break
        start = [answer.chosen]
        missed, looked_at = missed_runs(question, answer.chosen, effort.trial_runs, effort.seed_of(number))
        missed, more = servable(question, missed)
        lost = joined([lost, more])
        if _too_many(len(more), looked_at, question.unserved_share):
            return _refused(runs, more, looked_at, number + 1)
        runs = [joined([have, added]) for have, added in zip(runs, missed, strict=True)]
    if answer.chosen is None:
        return _without_choice(question, answer, runs, number + 1)
    return _mended(question, runs, lost, answer, effort, budget_cents, stop)


def cover_within(
    question: TagPlacement,
    budget_cents: int,
    *,
    effort: PlacementEffort | None = None,
    stop: Callable[[], bool] = lambda: False,
) -> Placed:
    """Return the tags within a budget with which most of the sampled runs see what they demand.

    The sample is drawn evenly, ``effort.trial_runs`` of each demand, so that its share speaks for all runs.
    """
    effort = effort or PlacementEffort()
    runs = [
        random_runs_of(demand, question.scenario, effort.trial_runs, effort.seed_of(0))
        for demand in question.demands
    ]
    total = sum(map(len, runs))
    answer = worthiest(
        covering_of(question, runs), budget_cents, places=lattice_places(question), effort=effort.cover, stop=stop
    )
    assert answer.chosen is not None, "to choose nothing keeps every budget"
    placed = _checked(question, runs, answer.chosen, effort, status=answer.status, rounds=1)
    return replace(
        placed,
        bound=answer.bound / total if total else 1.0,
        lost=joined(runs).some(answer.lost),
        message=answer.message,
        within_budget=True,
    )


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class SmallestGap:
    """The shortest run on which a budget can show what is demanded, from both sides.

    ``placed`` meets ``length_m``; no choice within the budget meets ``impossible_m`` (zero if none was shown to be
    impossible). Between the two nothing is known.
    """

    length_m: float
    impossible_m: float
    placed: Placed


def smallest_gap(
    question: TagPlacement,
    budget_cents: int,
    *,
    longest_m: float,
    step_m: float = 0.05,
    effort: PlacementEffort | None = None,
    stop: Callable[[], bool] = lambda: False,
) -> SmallestGap | None:
    """Return the smallest worst gap within a budget, by bisection over multiples of ``step_m``.

    All demands get the same length of run. ``None`` if not even the longest length can be met.
    """

    def at(steps: int) -> Placed:
        demands = tuple(replace(demand, length_m=round(steps * step_m, 9)) for demand in question.demands)
        return place_tags(replace(question, demands=demands), budget_cents=budget_cents, effort=effort, stop=stop)

    shortest, longest, impossible = 0, round(longest_m / step_m), 0
    best = at(longest)
    if best.xy_m is None:
        return None
    while longest - shortest > 1 and not stop():
        middle = (shortest + longest) // 2
        placed = at(middle)
        if placed.xy_m is not None:
            longest, best = middle, placed
            continue
        shortest = middle
        if placed.status in (Status.INFEASIBLE, Status.BUDGET_TOO_SMALL):
            impossible = middle
    return SmallestGap(
        length_m=round(longest * step_m, 9), impossible_m=round(impossible * step_m, 9), placed=best
    )


def staged(
    question: TagPlacement,
    stages: Sequence[Sequence[str]],
    *,
    effort: PlacementEffort | None = None,
    stop: Callable[[], bool] = lambda: False,
) -> tuple[Placed, ...]:
    """Return one answer for each stage: zones are equipped one after the other, and tags once laid stay.

    Parameters
    ----------
    stages
        Names of the zones of each stage; the demands of a zone count from its stage on.

    Raises
    ------
    ValueError
        If the zone of a demand is in no stage, or a stage comes before any demand.
    """
    known = {zone for stage in stages for zone in stage}
    missing = [demand.zone or "the whole floor" for demand in question.demands if demand.zone not in known]
    if missing:
        raise ValueError(f"no stage equips {missing[0]}")
    answers: list[Placed] = []
    installed_m, equipped = question.installed_m, set[str]()
    for stage in stages:
        equipped |= set(stage)
        demands = tuple(demand for demand in question.demands if demand.zone in equipped)
        if not demands:
            raise ValueError(f"nothing is demanded up to the stage of {', '.join(stage)}")
        part = replace(question, demands=demands, installed_m=installed_m)
        answers.append(place_tags(part, effort=effort, stop=stop))
        laid_m = answers[-1].xy_m
        if laid_m is None:
            break
        installed_m = laid_m
    return tuple(answers)


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
        runs_of(demand, question.scenario, step_m=effort.step_m, headings=effort.headings, seed=effort.seed)
        for demand in question.demands
    ]


def _mended(
    question: TagPlacement,
    runs: list[Runs],
    lost: Runs,
    answer: CoverAnswer,
    effort: PlacementEffort,
    budget_cents: int | None,
    stop: Callable[[], bool],
) -> Placed:
    """Return the answer with tags added until fresh runs find nothing missed."""
    assert answer.chosen is not None
    chosen, rounds, messages = answer.chosen, effort.rounds + 1, [answer.message]
    for number in range(effort.rounds, effort.rounds + effort.mending_rounds):
        if stop():
            answer = replace(answer, status=Status.STOPPED_BY_LIMIT)
            messages.append("stopped before fresh runs had found what is still missed")
            break
        missed, looked_at = missed_runs(question, chosen, effort.trial_runs, effort.seed_of(number))
        missed, more = servable(question, missed)
        if _too_many(len(more), looked_at, question.unserved_share):
            return _refused(runs, more, looked_at, rounds)
        lost = joined([lost, more])
        if not any(map(len, missed)):
            break
        runs = [joined([have, added]) for have, added in zip(runs, missed, strict=True)]
        rounds += 1
        mended = cheapest(replace(covering_of(question, missed), locked=chosen), effort=effort.quick, stop=stop)
        if mended.chosen is None:
            # The tags that lie may bar the place of one that is missing, so that all are asked about anew.
            mended = cheapest(
                covering_of(question, runs), places=lattice_places(question), effort=effort.cover, stop=stop
            )
        if mended.chosen is None:
            return _without_choice(question, mended, runs, rounds)
        chosen = mended.chosen
    else:
        messages.append("every round of mending still found runs that were missed, so that some still are")
    bound = answer.bound / question.tag_price_cents
    new = int(chosen[: len(question.slots)].sum())
    cost = question.tag_price_cents * new
    if budget_cents is not None and cost > budget_cents:
        message = (
            f"the cheapest tags found cost {_euros(cost)}, {_euros(cost - budget_cents)} too much; none that "
            f"serve every run cost less than {_euros(answer.bound)}"
        )
        answer = replace(answer, chosen=None, status=Status.TARGET_NOT_MET, message=message)
        return _without_choice(question, answer, runs, rounds)
    proven = answer.status is Status.OPTIMAL and bound == new
    status = answer.status if proven or answer.status is not Status.OPTIMAL else Status.BOUNDED
    placed = _checked(question, runs, chosen, effort, status=status, rounds=rounds)
    message = "; ".join(sentence for sentence in messages if sentence)
    return replace(placed, bound=bound, lost=lost, message=message)


def _too_many(lost: int, looked_at: int, share: float) -> bool:
    """Return whether more runs are lost than a share allows; chance alone refuses one question in a million."""
    from scipy.special import bdtrc

    return lost > share * looked_at and bool(bdtrc(lost - 1, looked_at, share) < _FALSE_REFUSAL)


def lattice_places(question: TagPlacement) -> IntArray | None:
    """Return where slots lie on their grid if lattices may be good starts: they cover floors, not lines."""
    everywhere = any(not demand.along_routes for demand in question.demands)
    return question.columns if everywhere else None


def _checked(
    question: TagPlacement,
    runs: Sequence[Runs],
    chosen: BoolArray,
    effort: PlacementEffort,
    *,
    status: Status,
    rounds: int,
) -> Placed:
    """Return a choice with its check on fresh runs; the bound is left to the caller."""
    xy_m = question.places_m[chosen]
    total = sum(map(len, runs))
    unmet = sum(
        int(short_of_tags(part, demand, question.antennas, xy_m).sum())
        for part, demand in zip(runs, question.demands, strict=True)
    )
    # A choice is not checked on runs that shaped it.
    fresh = effort.seed_of(effort.rounds + effort.mending_rounds)
    missed = tuple(
        missed_share(demand, question.scenario, question.antennas, xy_m, effort.check_runs, fresh + number)
        for number, demand in enumerate(question.demands)
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


def _refused(runs: Sequence[Runs], lost: Runs, looked_at: int, rounds: int) -> Placed:
    x_m, y_m, heading_rad = lost.poses[0]
    return Placed(
        status=Status.INFEASIBLE,
        xy_m=None,
        new=0,
        bound=0.0,
        met_share=0.0,
        missed=(),
        lost=lost,
        samples=sum(map(len, runs)),
        rounds=rounds,
        message=f"{len(lost)} of {looked_at} runs see too few slots whatever is chosen, the first from "
        f"({x_m:.3f}, {y_m:.3f}) m heading {np.degrees(heading_rad):.1f} deg",
    )


def _without_choice(question: TagPlacement, answer: CoverAnswer, runs: Sequence[Runs], rounds: int) -> Placed:
    messages = {
        Status.BUDGET_TOO_SMALL: f"no tags that serve every run cost less than {_euros(answer.bound)}",
        Status.INFEASIBLE: "spacing and tags a tile leave no choice that serves every run",
    }
    return Placed(
        status=answer.status,
        xy_m=None,
        new=0,
        bound=answer.bound / question.tag_price_cents,
        met_share=0.0,
        missed=(),
        lost=joined([]),
        samples=sum(map(len, runs)),
        rounds=rounds,
        message=messages.get(answer.status, answer.message),
    )


def _euros(cents: int) -> str:
    return f"{cents / 100:.2f} EUR"
