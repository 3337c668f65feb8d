"""What the study of single tags asks of a spec: the question, its effort, and what the answer stands beside."""

from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from fractions import Fraction
from functools import lru_cache
from typing import Final

import numpy as np

from layoutopt import feasibility, registry
from layoutopt.detection import antennas_of
from layoutopt.errors import Fault, InvalidInput
from layoutopt.identity import FloatArray, content_key
from layoutopt.layout import WHOLE_FLOOR, FloorTags, Layout, ReaderGroup, TagPattern, ZonePattern
from layoutopt.parts import Need, PriceList, Scope, bill_of_needs
from layoutopt.problem import Problem
from layoutopt.result import Status
from layoutopt.scenario import Scenario
from layoutopt.spec.building import PlacementSettings, Spec
from layoutopt.units import format_length
from solvers.covering.search import Effort
from solvers.demands import Demand, random_runs_of
from solvers.placement import (
    Placed,
    PlacementEffort,
    SmallestGap,
    cover_within,
    place_tags,
    smallest_gap,
    staged,
)
from solvers.placement_check import Missed, tags_in_view
from solvers.placement_model import TagPlacement
from solvers.placement_relaxation import WayOut, ways_out
from solvers.slots import Slots, centre_slots, grid_slots, joint_slots, listed_slots

QUICK_EFFORT: Final = PlacementEffort(
    step_m=0.2,
    headings=8,
    rounds=1,
    mending_rounds=5,
    trial_runs=2_500,
    check_runs=500,
    cover=Effort(steps=10_000, iterations=200, window_rounds=0, exact_slots=0, lattices=2),
)
_MANY: Final = 10_000
"""Over so many tags the rounding of spares to pieces is spread."""
_SEEDS: Final = 2**32
"""Seeds of the placement are taken modulo it: each is multiplied to give every round its own."""
_PITCHES_M: Final = tuple(round(1.0 / 1.05**number, 3) for number in range(72))
"""Pitches of square patterns that are compared, the sparsest first, down to 31 mm."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Asked:
    """The question with everything that its answer depends on; equal by its content key."""

    key: str
    question: TagPlacement = field(compare=False)
    settings: PlacementSettings = field(compare=False)
    effort: PlacementEffort = field(compare=False)
    survey_cents: int = field(compare=False)

    @property
    def budget_cents(self) -> int | None:
        """What is left of the budget for tags once the survey is paid; ``None`` without a budget."""
        if self.settings.budget_eur is None:
            return None
        return max(0, round(100.0 * self.settings.budget_eur) - self.survey_cents)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Found:
    """What the solver found.

    Attributes
    ----------
    placed
        The answer; of stages the last.
    stages
        One answer for each stage; empty without stages.
    at_once
        With stages, the answer if all were equipped at once.
    gap
        Where the smallest gap was sought, from both sides.
    ways
        Where no choice of slots meets the demand, what could give.
    """

    placed: Placed
    stages: tuple[Placed, ...] = ()
    at_once: Placed | None = None
    gap: SmallestGap | None = None
    ways: tuple[WayOut, ...] = ()


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Rival:
    """Tags that robots drive over, and how many of the fresh runs of each demand miss it."""

    label: str
    layout: Layout
    tags: int
    missed: tuple[Missed, ...]

    @property
    def missed_count(self) -> int:
        """Runs of all demands that miss theirs."""
        return sum(missed.count for missed in self.missed)


def asked_of(spec: Spec, problem: Problem, *, quick: bool) -> Asked:
    """Return the question of a spec.

    Raises
    ------
    InvalidInput
        If the reader group cannot be built, there is no slot, or a forbidden place is none.
    """
    settings, scenario = spec.placement, problem.design
    group = reader_of(spec, problem)
    tag_size_m = max(problem.space.tag_size_m)
    slots = _slots(settings, scenario, tag_size_m / 2.0)
    forbidden = _forbidden(settings, slots)
    # Tags do not decide what antennas there are.
    antennas = antennas_of(_layout(problem, _square(0.5), group), scenario.step_s)
    tag_cents, survey_cents = tag_price_cents(
        problem.space.tag_part, spec.prices, spec.robot_count, len(settings.installed_m)
    )
    question = TagPlacement(
        scenario=scenario,
        antennas=antennas,
        slots=slots,
        demands=tuple(
            Demand(
                tags=demand.tags,
                length_m=demand.length_m,
                zone=demand.zone,
                along_routes=demand.along_routes,
                without=demand.without,
            )
            for demand in settings.demands
        ),
        tag_size_m=tag_size_m,
        tag_price_cents=tag_cents,
        spacing_m=settings.spacing_m,
        tags_per_tile=settings.tags_per_tile,
        installed_m=np.array(settings.installed_m, dtype=np.float64).reshape(-1, 2),
        forbidden=forbidden,
        unserved_share=settings.unserved_share,
    )
    effort = replace(QUICK_EFFORT if quick else PlacementEffort(), seed=spec.seed % _SEEDS)
    key = content_key(
        "tag_placement", scenario.key, group.key, repr(settings), repr(effort), tag_size_m, tag_cents, survey_cents
    )
    return Asked(key=key, question=question, settings=settings, effort=effort, survey_cents=survey_cents)


@lru_cache(maxsize=16)
def found_for(asked: Asked) -> Found:
    """Return the answer; it is a function of the question, so that a study that is resumed finds it again."""
    question, settings, effort = asked.question, asked.settings, asked.effort
    budget = asked.budget_cents
    if settings.aim == "coverage":
        assert budget is not None
        return Found(placed=cover_within(question, budget, effort=effort))
    if settings.aim == "gap":
        assert budget is not None
        longest_m = max(demand.length_m for demand in question.demands)
        gap = smallest_gap(question, budget, longest_m=longest_m, effort=effort)
        if gap is not None:
            return Found(placed=gap.placed, gap=gap)
    if settings.stages:
        stages = staged(question, settings.stages, effort=effort)
        if stages[-1].xy_m is not None:
            return Found(placed=stages[-1], stages=stages, at_once=place_tags(question, effort=effort))
        return Found(placed=stages[-1], stages=stages, ways=_ways(question, stages[-1], effort))
    placed = place_tags(question, budget_cents=budget, effort=effort)
    return Found(placed=placed, ways=_ways(question, placed, effort))


def rivals_of(problem: Problem, asked: Asked, group: ReaderGroup, placed: Placed) -> tuple[Rival, ...]:
    """Return the placed tags, the nearest patterns of the spec, and the sparsest square one that does as well.

    All are checked on the same fresh runs as the placed tags, by plain numpy. Without an answer there are the
    densest patterns of the spec alone.
    """
    question = asked.question
    fresh = asked.effort.seed_of(asked.effort.rounds + asked.effort.mending_rounds)
    runs = [
        random_runs_of(demand, question.scenario, asked.effort.check_runs, fresh + number)
        for number, demand in enumerate(question.demands)
    ]

    def judged(label: str, layout: Layout, xy_m: FloatArray) -> Rival:
        missed = tuple(
            Missed(
                demand=demand,
                count=int((tags_in_view(part, question.antennas, xy_m) < demand.tags).sum()),
                runs=len(part),
            )
            for demand, part in zip(question.demands, runs, strict=True)
        )
        return Rival(label=label, layout=layout, tags=len(xy_m), missed=missed)

    found: list[Rival] = []
    if placed.xy_m is not None and len(placed.xy_m):
        tags = floor_tags(problem, placed)
        own = Layout(floor_tags=tags, readers=(group,))
        found.append(judged("placed", own, tags.lay_on(question.scenario.site).xy_m))
    for label, pattern in _alike(problem, None if placed.xy_m is None else len(placed.xy_m)):
        layout = _layout(problem, pattern, group)
        if not feasibility.check(layout, question.scenario):
            found.append(judged(label, layout, layout.floor_tags.lay_on(question.scenario.site).xy_m))
    allowed = sum(missed.count for missed in placed.missed)
    for pitch_m in _PITCHES_M if placed.xy_m is not None else ():
        layout = _layout(problem, _square(pitch_m), group)
        if feasibility.check(layout, question.scenario):
            continue
        rival = judged(
            f"square, {format_length(pitch_m)}, misses no more",
            layout,
            layout.floor_tags.lay_on(question.scenario.site).xy_m,
        )
        if rival.missed_count <= allowed:
            found.append(rival)
            break
    return tuple({rival.layout.key: rival for rival in reversed(found)}.values())[::-1]


def floor_tags(problem: Problem, placed: Placed) -> FloorTags:
    """Return placed tags as those of the space."""
    from solvers.placement import floor_tags_of

    laid = floor_tags_of(placed, problem.space.tag_part, problem.space.tag_size_m)
    return replace(laid, placement_sigma_m=problem.space.placement_sigma_m)


def reader_of(spec: Spec, problem: Problem) -> ReaderGroup:
    """Return the reader group that the spec names, or the first that can be built.

    Raises
    ------
    InvalidInput
        If it cannot be built, with the rule that it breaks.
    """
    groups = [group for family in problem.space.readers for group in family.options()]
    number = spec.placement.reader
    reasons = []
    for group in groups if number is None else groups[number - 1 : number]:
        broken = feasibility.check(_layout(problem, _square(0.5), group), problem.design)
        if not broken:
            return group
        reasons.append(broken[0].message)
    raise InvalidInput.at(
        "placement.reader" if number is not None else "space.readers",
        f"the reader group cannot be built: {reasons[0]}"
        if number is not None
        else "no reader group can be built",
        "Choose another group; `layoutopt check` says how many there are.",
    )


def tag_price_cents(tag_part: str, prices: PriceList, robot_count: int, installed: int) -> tuple[int, int]:
    """Return what one tag more costs with labour, survey and spares, and what the first one costs besides."""
    few, many = (_tags_bill(tag_part, prices, robot_count, count) for count in (_MANY, 2 * _MANY))
    one = max(1, round(Fraction(many - few, _MANY)))
    first = 0 if installed else max(0, few - _MANY * one)
    return one, first


def tags_cost_eur(spec: Spec, tags: int, installed: int) -> float:
    """Return what new tags beside installed ones cost by the bill."""
    part = spec.space.tag_part
    whole = _tags_bill(part, spec.prices, spec.robot_count, tags + installed)
    return (whole - _tags_bill(part, spec.prices, spec.robot_count, installed)) / 100.0


def _tags_bill(tag_part: str, prices: PriceList, robot_count: int, count: int) -> int:
    if not count:
        return 0
    wanted = (
        Need(item=tag_part, scope=Scope.FLOOR, quantity=count),
        Need(item="survey", scope=Scope.LABOUR, quantity=1),
        Need(item="survey_tag", scope=Scope.LABOUR, quantity=count),
    )
    return round(100.0 * bill_of_needs(wanted, robot_count, prices).total_eur)


def _ways(question: TagPlacement, placed: Placed, effort: PlacementEffort) -> tuple[WayOut, ...]:
    return ways_out(question, effort) if placed.status is Status.INFEASIBLE else ()


def _slots(settings: PlacementSettings, scenario: Scenario, margin_m: float) -> Slots:
    site = scenario.site
    if settings.slots == "listed":
        return listed_slots(site, settings.listed_m, margin_m)
    if settings.slots == "grid":
        slots = grid_slots(site, settings.pitch_m, margin_m)
    else:
        slots = (joint_slots if settings.slots == "joints" else centre_slots)(site, margin_m)
    if not len(slots):
        raise InvalidInput.at(
            "placement.slots",
            f'no slot of "{settings.slots}" lies where a tag may lie',
            "Choose a finer pitch or other slots, or free a part of the floor.",
        )
    return slots


def _forbidden(settings: PlacementSettings, slots: Slots) -> np.ndarray:
    from scipy.spatial import cKDTree

    marks = np.zeros(len(slots), dtype=np.bool_)
    if not settings.forbidden_m:
        return marks[:0]
    found = cKDTree(slots.xy_m).query(np.array(settings.forbidden_m))
    away_m, nearest = np.asarray(found[0]), np.asarray(found[1])
    within_m = slots.pitch_m / 2.0 if slots.pitch_m is not None else 1e-3
    faults = [
        Fault(
            place=f"placement.forbidden[{number}]",
            problem=f"no slot lies within {format_length(within_m)} of ({x_m:g}, {y_m:g}) m",
            repair="The nearest is at ({:g}, {:g}) m.".format(*slots.xy_m[nearest[number]]),
        )
        for number, (x_m, y_m) in enumerate(settings.forbidden_m)
        if away_m[number] > within_m + 1e-9
    ]
    if faults:
        raise InvalidInput(faults)
    marks[nearest] = True
    return marks


def _alike(problem: Problem, tags: int | None) -> Iterator[tuple[str, TagPattern]]:
    """Yield of each family of the whole floor the pattern with about as many tags, or the densest."""
    for family in problem.space.patterns.get(WHOLE_FLOOR, ()):
        patterns = [pattern for pattern in family.options() if pattern.cell_m is not None]
        if not patterns:
            continue
        if tags is None:
            yield f"{family.name}, densest", max(patterns, key=lambda pattern: pattern.density_per_m2)
            continue
        counts = [
            len(FloorTags(zones=(ZonePattern(zone=WHOLE_FLOOR, pattern=pattern),)).lay_on(problem.design.site))
            for pattern in patterns
        ]
        nearest = min(range(len(patterns)), key=lambda number: abs(counts[number] - tags))
        yield f"{family.name}, about as many", patterns[nearest]


def _square(pitch_m: float) -> TagPattern:
    pattern: TagPattern = registry.load("patterns", "square")(pitch_m=pitch_m)
    return pattern


def _layout(problem: Problem, pattern: TagPattern, group: ReaderGroup) -> Layout:
    space = problem.space
    tags = FloorTags(
        zones=(ZonePattern(zone=WHOLE_FLOOR, pattern=pattern, origin_m=space.origin_m),),
        tag_part=space.tag_part,
        tag_size_m=space.tag_size_m,
        placement_sigma_m=space.placement_sigma_m,
    )
    return Layout(floor_tags=tags, readers=(group,))
