"""What one step more or less would change: layouts of the search that differ from a recommended one in one choice.

All of it is made of the drives of the search; nothing is simulated for it. What each single antenna and each row
of tags is worth is another question, which takes drives of its own (`studies.explain`).
"""

import math
from collections.abc import Hashable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import Final

from layoutopt.layout import Layout
from layoutopt.plots.front import known_interval
from layoutopt.problem import Problem
from layoutopt.protocols import Group
from layoutopt.result import Evaluated
from layoutopt.scores import Score, TrialOutcomes, paired_difference
from studies.alternatives import difference_words, search_outcomes

_DECIMALS: Final = 9
"""Lengths and angles that agree to so many decimals are the same choice."""


@dataclass(frozen=True, slots=True, kw_only=True)
class OneStep:
    """A layout that differs from another one in a single choice, by the next value that the search tried.

    Attributes
    ----------
    words
        How it differs.
    extra_cost
        Exact difference of cost, EUR; negative for a saving.
    change
        Difference of the simulated goal, paired over common drives of the search: negative is more accurate.
    """

    item: Evaluated
    words: str
    extra_cost: float
    change: Score

    @property
    def verdict(self) -> str:
        """``"better"`` or ``"worse"`` if a known 95 % interval of the change is beyond zero, else empty."""
        interval = known_interval(self.change)
        if interval is None:
            return ""
        return "better" if interval[1] < 0.0 else "worse" if interval[0] > 0.0 else ""


def one_steps_of(
    problem: Problem, raced: Sequence[Evaluated], item: Evaluated | None, known: Mapping[Group, TrialOutcomes]
) -> tuple[OneStep, ...]:
    """Return the layouts one step away from one, by rising cost.

    A step is the next smaller or larger value of one number: of antennas, of their side, height, distance or
    number a module, or of a length or angle of the tags of a zone. Everything else is the same.

    Parameters
    ----------
    raced
        Layouts that may be a step away; those without a drive in common with ``item`` do not count.
    item
        The layout from which the steps go; ``None`` gives none.
    """
    if item is None:
        return ()
    cost, goal = problem.goals[:2]
    tables = search_outcomes(problem, (*raced, item), known)
    own = dict(_choices(item.layout))
    nearest: dict[tuple[Hashable, bool], tuple[float, Evaluated]] = {}
    for other in raced:
        step = _single_step(own, dict(_choices(other.layout)))
        if step is None or other.layout.key not in tables or item.layout.key not in tables:
            continue
        choice, by = step
        known_step = nearest.get((choice, by > 0.0))
        if known_step is None or abs(by) < abs(known_step[0]):
            nearest[choice, by > 0.0] = (by, other)
    found = []
    for _, other in nearest.values():
        change = paired_difference(tables[other.layout.key], tables[item.layout.key], goal)
        if not math.isnan(change.value):
            found.append(
                OneStep(
                    item=other,
                    words=difference_words(item.layout, other.layout),
                    extra_cost=other.scores[cost].value - item.scores[cost].value,
                    change=change,
                )
            )
    return tuple(sorted(found, key=lambda step: (step.extra_cost, step.item.layout.key)))


def _choices(layout: Layout) -> Iterator[tuple[Hashable, object]]:
    """Yield everything in which layouts of one design space can differ, by name."""
    for number, group in enumerate(layout.floor_readers):
        choices = {
            "family": group.name,
            "antenna": type(group.antenna).__name__,
            "side_m": group.antenna.side_m,
            "height_m": float(group.poses[:, 2].mean()),
            "antennas_per_module": group.antennas_per_module,
            "profile": group.profile.key,
            **group.parameters,
        }
        yield from (((number, name), value) for name, value in choices.items())
    for entry in layout.floor_tags.zones:
        choices = {"family": entry.pattern.name, "angle_rad": entry.angle_rad, **entry.pattern.parameters}
        yield from (((entry.zone, name), value) for name, value in choices.items())


def _single_step(
    own: Mapping[Hashable, object], other: Mapping[Hashable, object]
) -> tuple[Hashable, float] | None:
    """Return the only choice in which two layouts differ, and by how much; ``None`` if it is not one number."""
    if own.keys() != other.keys():
        return None
    differing = [name for name, value in own.items() if _rounded(value) != _rounded(other[name])]
    if len(differing) != 1:
        return None
    before, after = own[differing[0]], other[differing[0]]
    if not (isinstance(before, int | float) and isinstance(after, int | float)):
        return None
    return differing[0], float(after) - float(before)


def _rounded(value: object) -> object:
    return round(value, _DECIMALS) if isinstance(value, float) else value
