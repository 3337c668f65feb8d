"""Layouts that are about as good as the recommended one and truly different from it, and how they differ in words.

They are picked among the layouts of the search with enough trials and cost no trial of their own. So they are
judged by the search: of the demands it is known that they meet them there, of held-out drives nothing, unless they
had some anyway.
"""

import math
from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Final

import numpy as np

from layoutopt.identity import FloatArray
from layoutopt.layout import WHOLE_FLOOR, FloorTags, Layout, ZonePattern
from layoutopt.problem import Problem
from layoutopt.protocols import Group, group_of
from layoutopt.result import Evaluated
from layoutopt.score_text import counted_text, euros, score_name, score_text
from layoutopt.scores import Score, TrialOutcomes, paired_difference
from layoutopt.spec.building import StudySettings
from layoutopt.units import format_length
from solvers.judging import meeting_limits
from solvers.layout_difference import LayoutDifference, antenna_places_m, layout_difference
from solvers.portfolio import portfolio

LEAST_TRIALS: Final = 16
"""Fewer trials favour lucky layouts too much. A race gives so many to about an eighth of its layouts: more than
stay to the end, which are those next to the front and mostly look like it."""
_TOLD_MOVE_M: Final = 0.001
"""Antennas that move by less than this on average stay where they are for an installer."""
_TOLD_RATIO: Final = 1.005
"""Tag densities closer than this are the same number in words."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Wish:
    """How many alternatives a user wants, how different, and how much worse they may be."""

    count: int = 3
    least_difference: float = 0.2
    tolerance: float = 0.2


def wish_of(settings: StudySettings) -> Wish:
    """Return the wish that a spec states."""
    return Wish(
        count=settings.alternatives,
        least_difference=settings.least_difference,
        tolerance=settings.alternative_tolerance,
    )


@dataclass(frozen=True, slots=True, kw_only=True)
class Alternative:
    """A layout instead of the recommended one.

    ``change`` is its simulated goal less that of the recommended one, paired; ``words`` how it differs.
    """

    item: Evaluated
    difference: LayoutDifference
    words: str
    extra_cost: float
    change: Score


@dataclass(frozen=True, slots=True, kw_only=True)
class Alternatives:
    """Layouts instead of a recommended one, every two and that one at least a difference apart.

    Attributes
    ----------
    wish
        What was asked for.
    role, instead_of
        The recommended layout that they stand for; ``None`` without one.
    found
        The alternatives by rising goal: cost where there is a demand that the recommended one meets, else error.
    by_demand
        Whether alternatives meet the demand in the search, instead of being shown to be as accurate.
    near
        How many layouts are near-optimal, the recommended one among them.
    proven
        Whether no other choice has more of them, or as many with a smaller sum of the goal.
    shortfall
        Why there are fewer than asked for; empty if there are not.
    """

    wish: Wish
    role: str
    instead_of: Evaluated | None
    found: tuple[Alternative, ...]
    by_demand: bool
    near: int
    proven: bool
    shortfall: str


def alternatives_of(
    problem: Problem,
    raced: Sequence[Evaluated],
    recommended: Mapping[str, Evaluated],
    known: Mapping[Group, TrialOutcomes],
    wish: Wish,
    failed: Collection[str] = (),
) -> Alternatives:
    """Return near-optimal layouts that truly differ from the first recommended one and from each other.

    Where that is the cheapest to meet a demand, an alternative meets the demand in the search too and costs at
    most the tolerance more. Otherwise it costs at most the tolerance more and is shown, by paired trials at 95 %,
    to be worse by no more than the tolerance.

    Parameters
    ----------
    raced
        Layouts with their scores; those with fewer than `LEAST_TRIALS` do not count.
    failed
        Keys of layouts that missed a demand on held-out drives: they are no alternatives.
    """
    role, best = next(iter(recommended.items()), ("", None))
    if best is None or not wish.count:
        return Alternatives(
            wish=wish, role=role, instead_of=best, found=(), by_demand=False, near=0, proven=True, shortfall=""
        )
    cost, goal = problem.goals[:2]
    by_demand = role == "cheapest" and bool(problem.limits)
    tables = search_outcomes(problem, (*raced, best), known)
    most = best.scores[cost].value * (1.0 + wish.tolerance)
    # What is cheaper than the cheapest that holds was tried on held-out drives and failed, or had no hope to hold.
    least = best.scores[cost].value if by_demand else -math.inf
    candidates = [best] + [
        item
        for item in (meeting_limits(problem, raced) if by_demand else raced)
        if item.layout.key != best.layout.key
        and item.layout.key not in failed
        and len(tables.get(item.layout.key, ())) >= LEAST_TRIALS
        and least <= item.scores[cost].value <= most
    ]

    def excess(row: int) -> Score:
        return _excess(tables, candidates[row].layout.key, best.layout.key, goal, 1.0 + wish.tolerance)

    found = portfolio(
        [item.layout for item in candidates],
        [item.scores[cost if by_demand else goal] for item in candidates],
        count=wish.count + 1,
        minimum_difference=wish.least_difference,
        tolerance=wish.tolerance,
        best=0,
        excess=None if by_demand or best.layout.key not in tables else excess,
    )
    return Alternatives(
        wish=wish,
        role=role,
        instead_of=best,
        found=tuple(_alternative(best, candidates[row], tables, cost, goal) for row in found.chosen[1:]),
        by_demand=by_demand,
        near=found.near,
        proven=found.proven,
        shortfall=_shortfall(len(found.chosen) - 1, found.near - 1, wish),
    )


def search_outcomes(
    problem: Problem, items: Iterable[Evaluated], known: Mapping[Group, TrialOutcomes]
) -> dict[str, TrialOutcomes]:
    """Return the outcomes of the search by key of the layout, of those that have any."""
    groups = {item.layout.key: group_of(item.layout, problem.design, problem.estimators[0]) for item in items}
    return {key: known[group] for key, group in groups.items() if group in known}


def alternatives_lines(found: Alternatives, goal: str) -> list[str]:
    """Return the alternatives for people, a line each, and why there are fewer than asked for."""
    lines = [
        f"instead of “{found.role}”: {entry.item.layout.label} [{entry.item.layout.short_key}], "
        f"{signed_euros(entry.extra_cost)}, {score_text(entry.change, goal, signed=True)}; {entry.words} "
        f"(difference {entry.difference.total:.2f})"
        for entry in found.found
    ]
    return [*lines, *([f"alternatives: {found.shortfall}"] if found.shortfall else [])]


def rule_text(found: Alternatives, goal: str) -> str:
    """Return in words what makes a layout an alternative."""
    worse = f"{found.wish.tolerance * 100.0:.3g} %"
    near = (
        f"meet every demand in the search and cost at most {worse} more"
        if found.by_demand
        else f"cost at most {worse} more and are shown to have a {score_name(goal)} at most {worse} larger"
    )
    return (
        f"alternatives {near}; every two differ by at least {found.wish.least_difference:.2g} on a scale of 0 to 1"
    )


def signed_euros(amount: float) -> str:
    """Return a difference of costs with its sign.

    >>> signed_euros(12.5), signed_euros(-3.0)
    ('+12.50 EUR', '-3.00 EUR')
    """
    return ("+" if amount >= 0.0 else "") + euros(amount)


def difference_words(instead_of: Layout, layout: Layout) -> str:
    """Return how a layout differs from another one, as an installer would say it."""
    told = []
    one, other = antenna_places_m(instead_of), antenna_places_m(layout)
    if len(one) != len(other):
        told.append(f"{counted_text(len(other), 'antenna')} instead of {len(one)}")
    else:
        way_m = _mean_way_m(one, other)
        if way_m >= _TOLD_MOVE_M:
            told.append(f"antennas {way_m * 1000:.0f} mm elsewhere on average")
    sides = [_sides_text(item) for item in (layout, instead_of)]
    if sides[0] != sides[1]:
        told.append(f"antenna sides {sides[0]} instead of {sides[1]}")
    modules = [sum(group.module_count for group in item.floor_readers) for item in (layout, instead_of)]
    if modules[0] != modules[1]:
        told.append(f"{counted_text(modules[0], 'reader module')} a robot instead of {modules[1]}")
    zones = {entry.zone for item in (instead_of, layout) for entry in item.floor_tags.zones} - {WHOLE_FLOOR}
    floor = _tags_words(instead_of.floor_tags, layout.floor_tags, WHOLE_FLOOR)
    told += floor
    for zone in sorted(zones):
        own = _tags_words(instead_of.floor_tags, layout.floor_tags, zone)
        if own and own != floor:
            told.append(f"in zone '{zone}' {' and '.join(own)}")
    return ", ".join(told) or "nothing that is counted"


def _alternative(
    best: Evaluated, item: Evaluated, tables: Mapping[str, TrialOutcomes], cost: str, goal: str
) -> Alternative:
    return Alternative(
        item=item,
        difference=layout_difference(best.layout, item.layout),
        words=difference_words(best.layout, item.layout),
        extra_cost=item.scores[cost].value - best.scores[cost].value,
        change=_excess(tables, item.layout.key, best.layout.key, goal, 1.0),
    )


def _excess(tables: Mapping[str, TrialOutcomes], key: str, best: str, goal: str, factor: float) -> Score:
    """Return a goal less ``factor`` times that of the best layout, paired over common replications."""
    if best not in tables:
        return Score(value=math.nan, unit="", standard_error=math.inf, count=1)
    reference = tables[best]
    scaled = replace(reference, values=reference.values * factor)
    return paired_difference(tables[key], scaled, goal)


def _shortfall(found: int, near: int, wish: Wish) -> str:
    """Return why there are fewer alternatives than asked for; empty if there are not."""
    if found >= wish.count:
        return ""
    if not near:
        return (
            f"none of {wish.count}: no other layout with at least {LEAST_TRIALS} trials in the search is as good"
        )
    counted = f"{near} other layout{'s are' if near != 1 else ' is'} as good"
    if found == near:
        return f"{found} of {wish.count}: only {counted}"
    return f"{found} of {wish.count}: {counted}, but no {found + 1} of them differ by {wish.least_difference:.2g}"


def _mean_way_m(one_m: FloatArray, other_m: FloatArray) -> float:
    """Return the mean way between antennas that are paired so that ways are shortest, m."""
    # Imported here: it costs more than all the rest of a short command.
    from scipy.optimize import linear_sum_assignment

    ways_m = np.linalg.norm(one_m[:, None, :] - other_m[None, :, :], axis=2)
    return float(ways_m[linear_sum_assignment(ways_m)].mean()) if len(one_m) else 0.0


def _sides_text(layout: Layout) -> str:
    sides = sorted({group.antenna.side_m for group in layout.floor_readers})
    return " and ".join(format_length(side_m) for side_m in sides)


def _tags_words(instead_of: FloorTags, tags: FloorTags, zone: str) -> list[str]:
    """Return how the tags on a zone differ."""
    one, other = _laid_on(instead_of, zone), _laid_on(tags, zone)
    if one is None or other is None:
        return [] if one is other else ["tags" if one is None else "no tags"]
    told = []
    if one.pattern.name != other.pattern.name:
        told.append(f"{other.pattern.name} tags instead of {one.pattern.name}")
    elif one.pattern.density_per_m2 == other.pattern.density_per_m2 and one.pattern.key != other.pattern.key:
        told.append(f"another {other.pattern.name} arrangement of tags")
    if one.pattern.density_per_m2 > 0.0 and other.pattern.density_per_m2 > 0.0:
        ratio = other.pattern.density_per_m2 / one.pattern.density_per_m2
        if max(ratio, 1.0 / ratio) >= _TOLD_RATIO:
            told.append(f"{ratio:.3g} times as many tags a square metre")
    turn_rad = other.angle_rad - one.angle_rad
    if turn_rad:
        told.append(f"tags turned by {math.degrees(turn_rad):+.3g}°")
    return told


def _laid_on(tags: FloorTags, zone: str) -> ZonePattern | None:
    own = {entry.zone: entry for entry in tags.zones}
    return own.get(zone, own.get(WHOLE_FLOOR))
