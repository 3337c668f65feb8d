"""What would have to give so that tags can be placed: cells that no slot serves, and the cheapest way out."""

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from layoutopt.units import format_length
from solvers.demands import Runs
from solvers.placement import sampled
from solvers.placement_answer import PlacementEffort, covered
from solvers.placement_model import TagPlacement, contradiction, served
from solvers.slots import grid_slots

_LENGTH_STEP_M: Final = 0.05
_LONGEST_M: Final = 5.0
_RADIUS_STEP: Final = 0.05
_LARGEST_RADIUS: Final = 4.0
_FINEST: Final = 8
"""Slots are made at most so many times denser along each axis."""
_MOST_SLOTS: Final = 100_000
"""Denser slots than these are not tried: a floor of so many is searched for minutes."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Cell:
    """A square of the floor, by its lower left corner, m, in which runs begin that no slot serves."""

    corner_m: tuple[float, float]
    runs: int


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class WayOut:
    """One thing that gives, alone, so that the rest of a question can be met on its sampled runs.

    ``tags`` is how many new tags that takes, found by a short search: an estimate, not a bound. ``left_out`` is
    the share of the runs that go unserved.
    """

    text: str
    question: TagPlacement
    tags: int
    left_out: float


def unserved_cells(lost: Runs, cell_m: float) -> tuple[Cell, ...]:
    """Return the cells in which runs begin that no slot serves, those with most of them first."""
    index, counts = np.unique(np.floor(lost.poses[:, :2] / cell_m), axis=0, return_counts=True)
    order = np.lexsort((index[:, 1], index[:, 0], -counts))
    return tuple(
        Cell(corner_m=(float(index[row, 0] * cell_m), float(index[row, 1] * cell_m)), runs=int(counts[row]))
        for row in order
    )


def ways_out(question: TagPlacement, effort: PlacementEffort) -> tuple[WayOut, ...]:
    """Return what could give so that the demands are met on the sampled runs: ways that serve all first, by tags.

    Tried are, each alone: longer runs, fewer tags in view, a larger read disc, denser slots, no spacing, no limit
    of tags a tile, no forbidden or no required slots, and that runs which no slot serves are left out. Each gives
    as little as helps. Where no tag may lie in a zone, all of these are tried with the runs left out that touch it
    as well. Nothing helps a demand that speaks of no run.
    """
    if not _has_room(question, effort):
        return ()
    tag_part = question.slots.tag_part
    barred = tuple(zone.name for zone in question.scenario.site.zones if zone.rule_against(tag_part))
    candidates = list(_candidates(question, effort))
    if barred:
        without = replace(question, demands=tuple(replace(demand, without=barred) for demand in question.demands))
        left_out = f"runs over {' and '.join(repr(name) for name in barred)} left out"
        if _unserved(without, effort) <= question.unserved_share:
            candidates.append((left_out, without))
        else:
            candidates += [(f"{left_out}, and {text}", relaxed) for text, relaxed in _candidates(without, effort)]
    found = []
    for text, relaxed in candidates:
        answer = covered(relaxed, served(relaxed, sampled(relaxed, effort)), effort=effort.quick)
        if answer.chosen is not None:
            tags = int(answer.chosen[: len(relaxed.slots)].sum())
            found.append(WayOut(text=text, question=relaxed, tags=tags, left_out=relaxed.unserved_share))
    return tuple(sorted(found, key=lambda way: (way.left_out > question.unserved_share, way.tags)))


def _candidates(question: TagPlacement, effort: PlacementEffort) -> Iterator[tuple[str, TagPlacement]]:
    def helps(relaxed: TagPlacement) -> bool:
        return _unserved(relaxed, effort) <= relaxed.unserved_share

    longest = max(demand.length_m for demand in question.demands)
    if longest > 0.0:
        steps_m = [number * _LENGTH_STEP_M for number in range(1, round((_LONGEST_M - longest) / _LENGTH_STEP_M))]
        # A run for which the robot has no room is served by nothing, and so is not a way out.
        cramped_m = _least(steps_m, lambda extra_m: not _has_room(_longer(question, extra_m), effort))
        steps_m = [extra_m for extra_m in steps_m if cramped_m is None or extra_m < cramped_m]
        extra_m = _least(steps_m, lambda extra_m: helps(_longer(question, extra_m)))
        if extra_m is not None:
            longer = _longer(question, extra_m)
            lengths = ", ".join(format_length(demand.length_m) for demand in longer.demands if demand.length_m)
            yield f"runs of {lengths}", longer
    for tags in range(max(demand.tags for demand in question.demands) - 1, 0, -1):
        demands = tuple(replace(demand, tags=min(demand.tags, tags)) for demand in question.demands)
        if helps(replace(question, demands=demands)):
            yield f"{tags} in view instead of more", replace(question, demands=demands)
            break
    scales = [1.0 + number * _RADIUS_STEP for number in range(1, round((_LARGEST_RADIUS - 1.0) / _RADIUS_STEP))]
    scale = _least(scales, lambda scale: helps(_scaled(question, scale)))
    if scale is not None:
        radius_m = scale * float(question.antennas.radius_m.max())
        yield f"a read disc of radius {format_length(round(radius_m, 4))}", _scaled(question, scale)
    pitch_m, marked = question.slots.pitch_m, question.forbidden.size + question.required.size
    if pitch_m is not None and question.slots.kind == "grid" and not marked:
        finest = min(_FINEST, math.isqrt(_MOST_SLOTS // max(len(question.slots), 1)))
        for times in range(2, finest + 1):
            denser = _denser(question, pitch_m / times)
            if helps(denser):
                yield f"slots every {format_length(round(pitch_m / times, 4))}", denser
                break
    no_marks = np.empty(0, dtype=np.bool_)
    for given, name, relaxed in (
        (question.spacing_m > 0.0, "no spacing of tags beyond their size", replace(question, spacing_m=0.0)),
        (question.tags_per_tile is not None, "any number of tags a tile", replace(question, tags_per_tile=None)),
        (question.forbidden.size > 0, "the forbidden slots allowed", replace(question, forbidden=no_marks)),
        (question.required.size > 0, "no slot required", replace(question, required=no_marks)),
    ):
        if given and helps(relaxed):
            yield name, relaxed
    share = _unserved(question, effort)
    if question.unserved_share < share < 1.0:
        # To the next thousandth, so that the number can be written into a spec.
        share = min(math.ceil(share * 1000.0) / 1000.0, 0.999)
        yield f"{share:.1%} of the runs left out that no slot serves", replace(question, unserved_share=share)


def _unserved(question: TagPlacement, effort: PlacementEffort) -> float:
    """Return the share of the sampled runs that no choice serves; one where nothing is to be chosen or served."""
    runs = sampled(question, effort)
    if contradiction(question) or not all(map(len, runs)):
        return 1.0
    return len(served(question, runs).lost) / sum(map(len, runs))


def _has_room(question: TagPlacement, effort: PlacementEffort) -> bool:
    return all(map(len, sampled(question, effort)))


def _least(values: Sequence[float], helps: Callable[[float], bool]) -> float | None:
    """Return the least of rising values that helps, if larger ones help too; ``None`` if the largest does not."""
    if not len(values) or not helps(values[-1]):
        return None
    low, high = -1, len(values) - 1
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (low, middle) if helps(values[middle]) else (middle, high)
    return values[high]


def _longer(question: TagPlacement, extra_m: float) -> TagPlacement:
    demands = tuple(
        replace(demand, length_m=round(demand.length_m + extra_m, 9)) if demand.length_m else demand
        for demand in question.demands
    )
    return replace(question, demands=demands)


def _scaled(question: TagPlacement, scale: float) -> TagPlacement:
    antennas = replace(question.antennas, radius_m=question.antennas.radius_m * scale)
    return replace(question, antennas=antennas)


def _denser(question: TagPlacement, pitch_m: float) -> TagPlacement:
    margin_m, tag_part = question.tag_size_m / 2.0, question.slots.tag_part
    slots = grid_slots(question.scenario.site, pitch_m, margin_m, tag_part=tag_part)
    return replace(question, slots=slots)
