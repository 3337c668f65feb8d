"""What placed tags stand beside: patterns of the spec with as many tags, and the sparsest that misses no more."""

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Final

from layoutopt import feasibility
from layoutopt.identity import FloatArray
from layoutopt.layout import WHOLE_FLOOR, FloorTags, Layout, ReaderGroup, TagPattern, ZonePattern
from layoutopt.problem import Problem
from layoutopt.units import format_length
from solvers.placement import floor_tags_of
from solvers.placement_answer import Placed, check_runs
from solvers.placement_check import Missed, missed_share
from solvers.placement_model import short_of_tags
from studies.tag_placement_setting import Asked, layout_of, square

PLACED: Final = "placed"
"""Label of the placed tags."""
_PITCHES_M: Final = tuple(round(1.0 / 1.05**number, 3) for number in range(72))
"""Pitches of square patterns that are compared, the sparsest first, down to 31 mm."""


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


def rivals_of(problem: Problem, asked: Asked, group: ReaderGroup, placed: Placed) -> tuple[Rival, ...]:
    """Return the placed tags, the nearest patterns of the spec, and the sparsest square one that does as well.

    All are checked on the same fresh runs as the placed tags, by plain numpy; which pitch is tried so is found by
    the compiled count. Without an answer there are the densest patterns of the spec alone.
    """
    question = asked.question
    runs = check_runs(question, asked.effort)

    def judged(label: str, layout: Layout, xy_m: FloatArray) -> Rival:
        missed = tuple(
            missed_share(demand, part, question.antennas, xy_m)
            for demand, part in zip(question.demands, runs, strict=True)
        )
        return Rival(label=label, layout=layout, tags=len(xy_m), missed=missed)

    found: list[Rival] = []
    if placed.xy_m is not None and len(placed.xy_m):
        tags = _floor_tags(problem, placed)
        own = problem.space.equipped(tags, group)
        found.append(judged(PLACED, own, tags.lay_on(question.scenario.site).xy_m))
    for label, pattern in _alike(problem, None if placed.xy_m is None else len(placed.xy_m)):
        layout = layout_of(problem, pattern, group)
        if not feasibility.check(layout, question.scenario):
            found.append(judged(label, layout, layout.floor_tags.lay_on(question.scenario.site).xy_m))
    allowed = sum(missed.count for missed in placed.missed)
    for pitch_m in _PITCHES_M if placed.xy_m is not None else ():
        layout = layout_of(problem, square(pitch_m), group)
        if feasibility.check(layout, question.scenario):
            continue
        xy_m = layout.floor_tags.lay_on(question.scenario.site).xy_m
        short = (
            short_of_tags(part, demand, question.antennas, xy_m).sum()
            for demand, part in zip(question.demands, runs, strict=True)
        )
        if sum(short) > allowed:
            continue
        rival = judged(f"square, {format_length(pitch_m)}, misses no more", layout, xy_m)
        # The counts may differ by a run that only just touches a disc.
        if rival.missed_count <= allowed:
            found.append(rival)
            break
    return tuple({rival.layout.key: rival for rival in reversed(found)}.values())[::-1]


def _floor_tags(problem: Problem, placed: Placed) -> FloorTags:
    """Return placed tags as those of the space."""
    laid = floor_tags_of(placed, problem.space.tag_part, problem.space.tag_size_m)
    return replace(laid, placement_sigma_m=problem.space.placement_sigma_m)


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
