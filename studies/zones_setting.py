"""Layouts of one pattern for each part of the floor: what may lie where, where robots are, what the model sees."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from layoutopt import feasibility
from layoutopt.errors import InvalidInput
from layoutopt.geometry import covers
from layoutopt.identity import FloatArray, IntArray
from layoutopt.layout import WHOLE_FLOOR, FloorTags, Layout, ReaderGroup, TagPattern, ZonePattern
from layoutopt.parts import bill_of_needs, needs
from layoutopt.problem import Limit, Problem
from layoutopt.result import Evaluated
from layoutopt.scenario import Scenario
from layoutopt.scores import OUTCOME_UNITS, TrialOutcomes
from layoutopt.simulation.motion import drive
from layoutopt.simulation.outcomes import judged_steps, standing_steps
from layoutopt.spec.building import Spec
from layoutopt.streams import Streams
from objectives.cost import Cost
from solvers.exhaustive import entered, exceeds
from solvers.judging import exact_scores
from solvers.zone_terms import Shares, zone_terms
from solvers.zones import ZoneChoices

if TYPE_CHECKING:
    from layoutopt.space import DesignSpace


@dataclass(frozen=True, slots=True, kw_only=True)
class Slot:
    """A part of the floor with one pattern: its zone, ``""`` for the floor, and what may lie there."""

    zone: str
    patterns: tuple[TagPattern, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Setting:
    """What the study chooses from.

    Attributes
    ----------
    problem
        The question, with the objectives that goals and limits need, and the estimator of the search alone.
    slots
        The floor outside zones with patterns of their own, then these zones.
    uniform
        Layouts of one pattern everywhere that can be built and judged, with their cost, for each reader group by
        its key and then by the key of the pattern.
    left_out
        How many such layouts cannot be built or judged.
    """

    problem: Problem
    slots: tuple[Slot, ...]
    uniform: Mapping[str, Mapping[str, Evaluated]]
    left_out: int
    cost: Cost
    seed: int
    notes: tuple[str, ...] = ()
    known: dict[str, tuple[Evaluated, str]] = field(default_factory=dict, repr=False, compare=False)

    @property
    def zones(self) -> tuple[str, ...]:
        """Zone of each slot, the floor first."""
        return tuple(slot.zone for slot in self.slots)

    @property
    def simulated_limits(self) -> tuple[Limit, ...]:
        """The limits that drives decide."""
        limits = self.problem.limits
        return tuple(limit for limit in limits if limit.score.rpartition(".")[2] in OUTCOME_UNITS)

    @property
    def layouts(self) -> tuple[Evaluated, ...]:
        """Every uniform layout, group by group."""
        return tuple(item for group in self.uniform.values() for item in group.values())

    def tags_by_slot(self, layout: Layout) -> tuple[int, ...]:
        """Return how many tags of a layout lie on each slot."""
        return _tags_by_slot(layout.floor_tags, self.problem.design, self.zones)

    def cost_eur(self, layout: Layout, tag_count: int) -> float:
        """Return what the readers of a layout cost with so many tags, whatever its own number is."""
        count = self.cost.robot_count
        needed = needs(layout, tag_count, count, self.cost.reader_part)
        return bill_of_needs(needed, count, self.cost.prices).total_eur

    def composed(self, group: ReaderGroup, patterns: Sequence[TagPattern]) -> Layout:
        """Return the layout with a pattern for each slot.

        A zone that has the floor's pattern and overlaps no other gets no entry, so that equal layouts have equal
        keys.
        """
        space, site = self.problem.space, self.problem.design.site
        regions = {zone: site.zone(zone).region for zone in self.zones if zone}
        entries = []
        for zone, pattern in zip(self.zones, patterns, strict=True):
            alone = not zone or not any(
                regions[zone].intersects(region) for other, region in regions.items() if other != zone
            )
            if not zone or not alone or pattern.key != patterns[0].key:
                entries.append(ZonePattern(zone=zone, pattern=pattern, origin_m=space.origin_m))
        tags = FloorTags(
            zones=tuple(entries),
            tag_part=space.tag_part,
            tag_size_m=space.tag_size_m,
            placement_sigma_m=space.placement_sigma_m,
        )
        return space.layout(tags, group)

    def judged(self, layout: Layout) -> tuple[Evaluated, str]:
        """Return a layout with its exact scores, and why it cannot be built or breaks an exact limit, if so."""
        if layout.key not in self.known:
            self.known[layout.key] = _judged(self.problem, layout)
        return self.known[layout.key]

    def drives_for(self, wanted: int, most: int) -> int:
        """Return how many drives of the search it takes for so many of them to enter each zone with a target.

        Not more than ``most``, whatever is missing then. The true paths tell it, which are the same for every
        layout.
        """
        within = self.shares(most).within.values()
        entered_by = np.array([np.cumsum(~np.isnan(share).any(axis=1)) for share in within])
        enough = np.flatnonzero((entered_by >= wanted).all(axis=0))
        return max(wanted, int(enough[0]) + 1) if len(enough) else most

    def shares(self, drives: int) -> Shares:
        """Return where the robot is on the first drives of the search."""
        return _shares(self.problem.design, self.zones, self.seed, drives)

    def choices(
        self, group: Mapping[str, Evaluated], tables: Mapping[str, TrialOutcomes], shares: Shares
    ) -> tuple[ZoneChoices, list[list[TagPattern]]] | None:
        """Return the model of one reader group and the patterns behind its options; ``None`` if a slot has none.

        Parameters
        ----------
        group
            Its uniform layouts by pattern.
        tables
            Outcomes of those that are in, by pattern, all of the same drives.
        """
        names = [limit.score for limit in self.simulated_limits]
        patterns = [[one for one in slot.patterns if one.key in tables] for slot in self.slots]
        if not all(patterns):
            return None
        terms = {key: zone_terms(table, names, self.zones, shares) for key, table in tables.items()}
        items = list(group.values())
        # With one tag, so that what is paid once for any tag, such as coming to survey, is in it.
        base_eur = self.cost_eur(items[0].layout, 1)
        counts = {key: self.tags_by_slot(item.layout) for key, item in group.items()}
        # What a tag costs in a uniform layout, its labour and share of spares included.
        each_eur = {
            key: (item.scores["cost"].value - base_eur) / max(1, sum(counts[key])) for key, item in group.items()
        }
        return (
            ZoneChoices(
                base_eur=base_eur,
                costs_eur=tuple(
                    np.array([counts[one.key][slot] * each_eur[one.key] for one in options])
                    for slot, options in enumerate(patterns)
                ),
                terms=tuple(
                    np.array([terms[one.key][slot] for one in options]) for slot, options in enumerate(patterns)
                ),
            ),
            patterns,
        )


def setting_of(spec: Spec, *, most_layouts: int | None = None) -> Setting:
    """Return the setting of a spec, its reader groups thinned evenly by cost to ``most_layouts`` layouts.

    A zone has a slot if it has a target or patterns of its own in the spec, and tags may be laid in it. It may
    take its own patterns and those of the floor; the floor takes its own, or any where the spec has none for it.

    Raises
    ------
    InvalidInput
        If no zone has a target.
    """
    problem = spec.problem()
    site = problem.design.site
    if not any(zone.target_error_m is not None for zone in site.zones):
        raise InvalidInput.at(
            "site.zone",
            "no zone has a target_error, so no zone has a demand of its own that other patterns could serve",
            'Give a [[site.zone]] target_error = "10 mm", or ask the study cost_vs_accuracy.',
        )
    wanted = {name.rpartition(".")[2] for name in (*problem.goals, *(limit.score for limit in problem.limits))}
    objectives = tuple(one for one in problem.objectives if wanted & set(one.card.scores))
    problem = replace(problem, objectives=objectives, estimators=problem.estimators[:1])
    every = tuple(family for families in problem.space.patterns.values() for family in families)
    uniform: DesignSpace = replace(problem.space, patterns={WHOLE_FLOOR: every})
    # A pattern that is too dear for the whole floor, or breaks another limit there, may do well in a zone.
    entries = entered(replace(problem, space=uniform, limits=()))
    groups: dict[str, dict[str, Evaluated]] = {}
    for entry in entries:
        if not entry.refusal:
            layout = entry.evaluated.layout
            pattern = layout.floor_tags.base.pattern
            groups.setdefault(layout.readers[0].key, {})[pattern.key] = entry.evaluated
    notes = []
    if most_layouts is not None and groups:
        patterns = max(len(group) for group in groups.values())
        step = max(1, -(-len(groups) * patterns // most_layouts))
        if step > 1:
            notes.append(f"A quick look takes one reader group in {step}.")
        groups = {key: group for number, (key, group) in enumerate(groups.items()) if number % step == 0}
    slots, more = _slots(problem)
    return Setting(
        problem=problem,
        slots=slots,
        uniform=groups,
        left_out=sum(bool(entry.refusal) for entry in entries),
        cost=next(one for one in objectives if isinstance(one, Cost)),
        seed=spec.seed,
        notes=(*notes, *more),
    )


def _slots(problem: Problem) -> tuple[tuple[Slot, ...], list[str]]:
    """Return the slots, and a note on each zone with a target that has none."""
    site, listed = problem.design.site, problem.space.patterns
    patterns = {
        zone: tuple({one.key: one for family in families for one in family.options()}.values())
        for zone, families in listed.items()
    }
    every = tuple({one.key: one for options in patterns.values() for one in options}.values())
    floor = patterns.get(WHOLE_FLOOR, every)
    slots, notes = [Slot(zone=WHOLE_FLOOR, patterns=floor)], []
    for zone in site.zones:
        if zone.name not in patterns and zone.target_error_m is None:
            continue
        margin_m, tag_part = max(problem.space.tag_size_m) / 2.0, problem.space.tag_part
        if site.taggable_region(zone.name, margin_m, tag_part).is_empty:
            notes.append(f"No tag may lie in zone '{zone.name}': its demand is met by what lies around it.")
            continue
        own = patterns.get(zone.name, ())
        options = tuple({one.key: one for one in (*own, *floor)}.values())
        slots.append(Slot(zone=zone.name, patterns=options))
    return tuple(slots), notes


def _judged(problem: Problem, layout: Layout) -> tuple[Evaluated, str]:
    violations = feasibility.check(layout, problem.design)
    if violations:
        return Evaluated(layout=layout, scores={}), violations[0].message
    scores = exact_scores(problem, layout)
    refusals = (exceeds(limit, scores, problem) for limit in problem.limits)
    return Evaluated(layout=layout, scores=scores), next((text[1] for text in refusals if text), "")


@lru_cache(maxsize=1024)
def _tags_by_slot(floor_tags: FloorTags, scenario: Scenario, zones: tuple[str, ...]) -> tuple[int, ...]:
    tags = floor_tags.lay_on(scenario.site)
    return tuple(np.bincount(_slot_of(scenario, zones, tags.xy_m), minlength=len(zones)).tolist())


def _slot_of(scenario: Scenario, zones: tuple[str, ...], xy_m: FloatArray) -> IntArray:
    """Return the number of the slot that rules each point: the last zone of the site that holds it."""
    index = scenario.site.zone_of(xy_m, zones[1:])
    slot = np.zeros(len(xy_m), dtype=np.int64)
    for number, zone in enumerate(zones[1:], start=1):
        slot[index == scenario.site.zone_names.index(zone)] = number
    return slot


@lru_cache(maxsize=16)
def _shares(scenario: Scenario, zones: tuple[str, ...], seed: int, drives: int) -> Shares:
    """Return the shares of the time that is judged, from the true paths, which are the same for every layout."""
    streams, judged = Streams(seed=seed), judged_steps(scenario)
    targets = {zone.name: zone.region for zone in scenario.site.zones if zone.target_error_m is not None}
    ruled = np.zeros((drives, len(zones)))
    within = {name: np.full((drives, len(zones)), np.nan) for name in targets}
    for replication in range(drives):
        poses = drive(scenario, streams, replication).poses
        counted = judged & standing_steps(poses) if scenario.judgement.standing_only else judged
        xy_m = poses[1:, :2][counted]
        slot = _slot_of(scenario, zones, xy_m)
        ruled[replication] = np.bincount(slot, minlength=len(zones)) / max(1, len(slot))
        for name, region in targets.items():
            inside = slot[covers(region, xy_m)]
            if len(inside):
                within[name][replication] = np.bincount(inside, minlength=len(zones)) / len(inside)
    return Shares(ruled=ruled, within=within)
