"""What the study of single tags asks of a spec: the question, its effort and its answer."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from fractions import Fraction
from functools import lru_cache
from typing import Final

import numpy as np

from layoutopt import feasibility, registry
from layoutopt.detection import antennas_of
from layoutopt.errors import Fault, InvalidInput
from layoutopt.identity import BoolArray, content_key
from layoutopt.layout import WHOLE_FLOOR, FloorTags, Layout, ReaderGroup, TagPattern, ZonePattern
from layoutopt.parts import Need, PriceList, Scope, bill_of_needs
from layoutopt.problem import Problem
from layoutopt.result import Status
from layoutopt.scenario import Scenario
from layoutopt.spec.building import PlacementSettings, Spec
from layoutopt.spec.placement_building import too_many_slots
from layoutopt.units import format_length
from solvers.covering.search import Effort
from solvers.demands import Demand
from solvers.placement import place_tags
from solvers.placement_answer import Placed, PlacementEffort
from solvers.placement_budget import CoverageFront, SmallestGap, cover_within, coverage_front, smallest_gap
from solvers.placement_model import TagPlacement
from solvers.placement_relaxation import WayOut, ways_out
from solvers.placement_stages import Stage, staged
from solvers.slots import Slots, centre_slots, grid_slots, joint_slots, listed_slots

_QUICK_COVER: Final = Effort(
    steps=10_000, iterations=200, window_rounds=0, walk_slots=50_000, cut_nodes=0, exact_slots=0, lattices=2
)
QUICK_EFFORT: Final = PlacementEffort(
    step_m=0.2,
    headings=8,
    sample_routes=20,
    rounds=1,
    mending_rounds=3,
    trial_runs=2_500,
    trial_routes=20,
    check_runs=500,
    check_routes=100,
    budget_runs=2_500,
    front_runs=2_500,
    budget_routes=50,
    budgets=6,
    cover=_QUICK_COVER,
    budget_cover=_QUICK_COVER,
)
_MANY: Final = 10_000
"""Over so many tags the rounding of spares to pieces is spread."""
_HALF_CENT_EUR: Final = 0.005
"""Sums of whole cents are told apart by it."""
_SEEDS: Final = 2**32
"""Seeds of the placement are taken modulo it: each is multiplied to give every round its own."""
_LISTED_M: Final = 1e-3
"""A listed slot is named by a place no farther from it: a millimetre is how places are measured."""
_ROUNDING_M: Final = 1e-9
_GAP_STEP_M: Final = 0.05
"""Lengths of runs are told apart by this at most."""
_GAP_STEPS: Final = 8
"""The longest length has so many steps at least."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Asked:
    """The question with everything that its answer depends on; equal by its content key.

    ``budget_tags`` is how many new tags the budget pays for by the bill, survey included (or ``None``), and
    ``survey_cents`` what the first of them costs besides.
    """

    key: str
    question: TagPlacement = field(compare=False)
    settings: PlacementSettings = field(compare=False)
    effort: PlacementEffort = field(compare=False)
    survey_cents: int = field(compare=False)
    budget_tags: int | None = field(compare=False)

    @property
    def budget_cents(self) -> int | None:
        """The budget in the solver's money, in which all tags cost the same; ``None`` without a budget."""
        return None if self.budget_tags is None else self.budget_tags * self.question.tag_price_cents


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Found:
    """What the solver found.

    Attributes
    ----------
    placed
        The answer; of stages the last, of a front the tags that serve most runs.
    new
        How many tags are new, of all stages together.
    stages
        The stages up to the last or to the one without an answer; empty where none were asked for.
    at_once
        With stages, the answer if all were equipped at once.
    gap
        Where the smallest gap was sought, from both sides.
    front
        Where the front of tags and runs served was sought, all of it.
    ways
        Where no choice of slots meets the demand, what could give.
    """

    placed: Placed
    stages: tuple[Stage, ...] = ()
    at_once: Placed | None = None
    gap: SmallestGap | None = None
    front: CoverageFront | None = None
    ways: tuple[WayOut, ...] = ()

    @property
    def new(self) -> int:
        """New tags, those of all stages together."""
        return sum(stage.placed.new for stage in self.stages) if self.stages else self.placed.new


def asked_of(spec: Spec, problem: Problem, *, quick: bool) -> Asked:
    """Return the question of a spec.

    Raises
    ------
    InvalidInput
        If the reader group cannot be built, there is no slot or too many, or a forbidden or required place is
        none.
    """
    settings, scenario = spec.placement, problem.design
    group = reader_of(spec, problem)
    tag_size_m = max(problem.space.tag_size_m)
    slots = _slots(settings, scenario, tag_size_m / 2.0, problem.space.tag_part)
    forbidden = _marked(settings.forbidden_m, slots, "forbidden")
    required = _marked(settings.required_m, slots, "required")
    # Tags do not decide what antennas there are.
    antennas = antennas_of(layout_of(problem, square(0.5), group), scenario.step_s)
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
        required=required,
        unserved_share=settings.unserved_share,
    )
    effort = replace(QUICK_EFFORT if quick else PlacementEffort(), seed=spec.seed % _SEEDS)
    budget_tags = most_tags(spec, len(settings.installed_m), len(slots))
    key = content_key(
        "tag_placement",
        scenario.key,
        group.key,
        repr(settings),
        repr(effort),
        problem.space.tag_part,
        tag_size_m,
        tag_cents,
        survey_cents,
        -1 if budget_tags is None else budget_tags,
    )
    return Asked(
        key=key,
        question=question,
        settings=settings,
        effort=effort,
        survey_cents=survey_cents,
        budget_tags=budget_tags,
    )


@lru_cache(maxsize=16)
def found_for(asked: Asked) -> Found:
    """Return the answer; it is a function of the question, so that a study that is resumed finds it again."""
    question, settings, effort = asked.question, asked.settings, asked.effort
    budget = asked.budget_cents
    if settings.aim == "front":
        return _of_front(question, coverage_front(question, budget_cents=budget, effort=effort), effort)
    if settings.aim == "coverage":
        assert budget is not None
        placed = cover_within(question, budget, effort=effort)
        return Found(placed=placed, ways=_ways(question, placed, effort))
    if settings.aim == "gap":
        assert budget is not None
        longest_m = max(demand.length_m for demand in question.demands)
        step_m = min(_GAP_STEP_M, longest_m / _GAP_STEPS)
        gap = smallest_gap(question, budget, longest_m=longest_m, step_m=step_m, effort=effort)
        return _of_gap(question, gap, effort)
    if settings.stages:
        stages = staged(question, settings.stages, effort=effort)
        last = stages[-1]
        if last.placed.xy_m is not None:
            return Found(placed=last.placed, stages=stages, at_once=place_tags(question, effort=effort))
        return Found(placed=last.placed, stages=stages, ways=_ways(last.question, last.placed, effort))
    placed = place_tags(question, budget_cents=budget, effort=effort)
    return Found(placed=placed, ways=_ways(question, placed, effort))


def _of_front(question: TagPlacement, front: CoverageFront, effort: PlacementEffort) -> Found:
    if front.refused is not None:
        return Found(placed=front.refused, front=front, ways=_ways(question, front.refused, effort))
    status = Status.OPTIMAL if front.complete else Status.BOUNDED
    return Found(placed=replace(front.points[-1].placed, status=status), front=front)


def _of_gap(question: TagPlacement, gap: SmallestGap, effort: PlacementEffort) -> Found:
    placed = gap.placed
    if gap.length_m is None:
        return Found(placed=placed, gap=gap, ways=_ways(question, placed, effort))
    if placed.status is Status.STOPPED_BY_LIMIT:
        return Found(placed=placed, gap=gap)
    return Found(placed=replace(placed, status=Status.OPTIMAL if gap.decided else Status.BOUNDED), gap=gap)


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
        broken = feasibility.check(layout_of(problem, square(0.5), group), problem.design)
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


def most_tags(spec: Spec, installed: int, slots: int) -> int | None:
    """Return the most new tags that the budget pays for by the bill, survey included; ``None``: no budget."""
    budget_eur = spec.placement.budget_eur
    if budget_eur is None:
        return None
    low, high = 0, slots + 1
    while high - low > 1:
        middle = (low + high) // 2
        fits = tags_cost_eur(spec, middle, installed) <= budget_eur + _HALF_CENT_EUR
        low, high = (middle, high) if fits else (low, middle)
    return low


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


def _slots(settings: PlacementSettings, scenario: Scenario, margin_m: float, tag_part: str) -> Slots:
    site = scenario.site
    if settings.slots == "listed":
        return listed_slots(site, settings.listed_m, margin_m, tag_part=tag_part)
    if settings.slots == "grid":
        if said := too_many_slots(site, settings.pitch_m):
            raise InvalidInput.at("placement.pitch", *said)
        slots = grid_slots(site, settings.pitch_m, margin_m, tag_part=tag_part)
    else:
        of_tiles = joint_slots if settings.slots == "joints" else centre_slots
        slots = of_tiles(site, margin_m, tag_part=tag_part)
    if not len(slots):
        raise InvalidInput.at(
            "placement.slots",
            f'no slot of "{settings.slots}" lies where a tag may lie',
            "Choose a finer pitch or other slots, or free a part of the floor.",
        )
    return slots


def _marked(places_m: Sequence[tuple[float, float]], slots: Slots, key: str) -> BoolArray:
    """Return which slots places name, shape (slots,); empty without places."""
    from scipy.spatial import cKDTree

    if not places_m:
        return np.empty(0, dtype=np.bool_)
    marks = np.zeros(len(slots), dtype=np.bool_)
    found = cKDTree(slots.xy_m).query(np.array(places_m))
    away_m, nearest = np.asarray(found[0]), np.asarray(found[1])
    within_m = slots.pitch_m / 2.0 if slots.pitch_m is not None else _LISTED_M
    faults = [
        Fault(
            place=f"placement.{key}[{number}]",
            problem=f"no slot lies within {format_length(within_m)} of ({x_m:g}, {y_m:g}) m",
            repair="The nearest is at ({:g}, {:g}) m.".format(*slots.xy_m[nearest[number]]),
        )
        for number, (x_m, y_m) in enumerate(places_m)
        if away_m[number] > within_m + _ROUNDING_M
    ]
    if faults:
        raise InvalidInput(faults)
    marks[nearest] = True
    return marks


def square(pitch_m: float) -> TagPattern:
    """Return the square pattern of a pitch."""
    pattern: TagPattern = registry.load("patterns", "square")(pitch_m=pitch_m)
    return pattern


def layout_of(problem: Problem, pattern: TagPattern, group: ReaderGroup) -> Layout:
    """Return a pattern on the whole floor, of the tags of the space, under a reader group."""
    space = problem.space
    tags = FloorTags(
        zones=(ZonePattern(zone=WHOLE_FLOOR, pattern=pattern, origin_m=space.origin_m),),
        tag_part=space.tag_part,
        tag_size_m=space.tag_size_m,
        placement_sigma_m=space.placement_sigma_m,
    )
    return space.equipped(tags, group)
