"""Limits that no layout meets together, and by how much which of them would have to give."""

import itertools
import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from layoutopt.identity import BoolArray, FloatArray
from layoutopt.problem import Limit
from layoutopt.result import Evaluated
from layoutopt.score_text import euros, limit_text, quantity_text, score_name
from layoutopt.scores import SCORE_UNITS, Score

Met = Callable[[Limit, Score], bool]
"""Says whether a score meets a limit: `Limit.met`, or what a search takes for met."""
_MOST_TOLD: Final = 3
"""Sets and relaxations that a sentence names; a reader remembers no more."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Give:
    """A limit that gives: to ``end``, which is ``amount`` beyond the old one and ``share`` of it."""

    limit: Limit
    end: float
    amount: float
    share: float


@dataclass(frozen=True, slots=True, kw_only=True)
class Relaxation:
    """Limits that give so far that ``item`` meets all limits; ``share`` is the sum of their shares."""

    gives: tuple[Give, ...]
    item: Evaluated

    @property
    def share(self) -> float:
        """By how much the limits give, relative to themselves, added up."""
        return math.fsum(give.share for give in self.gives)


@dataclass(frozen=True, slots=True, kw_only=True)
class Conflicts:
    """What stands against meeting all limits, among ``judged`` layouts.

    Attributes
    ----------
    sets
        Every smallest set of limits that no layout meets together, all of one size; empty if a layout meets all.
    relaxations
        For each set of limits that may give, the way that takes least, by rising share; see `relaxations_of`.
    """

    sets: tuple[tuple[Limit, ...], ...]
    relaxations: tuple[Relaxation, ...]
    judged: int


def shortfalls(limits: Sequence[Limit], candidates: Sequence[Evaluated], met: Met = Limit.met) -> FloatArray:
    """Return by how much the confidence bound of each candidate passes each limit, shape (candidates, limits).

    Zero where the limit is met, infinite where the score is not known. The unit is that of the limit.
    """
    found = np.full((len(candidates), len(limits)), np.inf)
    for row, item in enumerate(candidates):
        for column, limit in enumerate(limits):
            score = item.scores.get(limit.score)
            if score is None or math.isnan(score.value):
                continue
            found[row, column] = 0.0 if met(limit, score) else limit.excess(limit.bound(score))
    return found


def smallest_conflicts(met: BoolArray) -> tuple[tuple[int, ...], ...]:
    """Return every smallest set of columns of which no row has all; none if a row has all columns.

    Parameters
    ----------
    met
        Whether the layout of a row meets the limit of a column, shape (layouts, limits).

    Notes
    -----
    The sets are found by trying all sets in the order of their size, which is exact and quick, because limits are
    few. Such a set is an irreducible infeasible subset of least cardinality (Chinneck, Feasibility and
    Infeasibility in Optimization, 2008, Chapter 6) of the finite problem "choose a row".
    """
    met = np.asarray(met, dtype=bool)
    columns = met.shape[1]
    for size in range(1, columns + 1):
        found = tuple(
            chosen
            for chosen in itertools.combinations(range(columns), size)
            if not met[:, list(chosen)].all(axis=1).any()
        )
        if found:
            return found
    return ()


def relaxations_of(
    limits: Sequence[Limit], candidates: Sequence[Evaluated], missed_by: FloatArray
) -> tuple[Relaxation, ...]:
    """Return for each set of limits that a candidate misses the candidate that misses them by least.

    Parameters
    ----------
    missed_by
        As `shortfalls` returns it.

    Notes
    -----
    Single limits and pairs are looked at; larger sets only if neither helps, and then those of the least size that
    does. Least is the sum of the shares by which the limits give; equal ones go by cost, then key. A limit of zero
    has no share that could be given; it counts as an infinite one.
    """
    missed = missed_by > 0.0
    best: dict[tuple[int, ...], Relaxation] = {}
    for row, item in enumerate(candidates):
        columns = tuple(int(column) for column in np.flatnonzero(missed[row]))
        if not columns or not np.isfinite(missed_by[row]).all():
            continue
        found = Relaxation(
            gives=tuple(_give(limits[column], float(missed_by[row, column])) for column in columns), item=item
        )
        if columns not in best or _rank(found) < _rank(best[columns]):
            best[columns] = found
    least = max(2, min(map(len, best), default=2))
    return tuple(sorted((found for columns, found in best.items() if len(columns) <= least), key=_rank))


def conflicts_of(limits: Sequence[Limit], candidates: Sequence[Evaluated], met: Met = Limit.met) -> Conflicts:
    """Return which limits no candidate meets together, and what would have to give."""
    missed_by = shortfalls(limits, candidates, met)
    sets = smallest_conflicts(missed_by == 0.0)
    return Conflicts(
        sets=tuple(tuple(limits[column] for column in chosen) for chosen in sets),
        relaxations=relaxations_of(limits, candidates, missed_by) if sets else (),
        judged=len(candidates),
    )


def conflict_text(found: Conflicts, among: str = "judged") -> str:
    """Return the conflict and its cheapest relaxations in words; empty if there is none or nothing was judged."""
    if not found.sets or not found.judged:
        return ""
    verb, together = ("is", "") if len(found.sets[0]) == 1 else ("are", " together")
    told = [" and ".join(limit_text(limit) for limit in chosen) for chosen in found.sets[:_MOST_TOLD]]
    more = len(found.sets) - len(told)
    layouts = f"any of {found.judged} layouts" if found.judged > 1 else "the only layout"
    text = f"{told[0]} {verb} not met{together} by {layouts} {among}"
    text += "".join(f", nor {verb} {chosen}" for chosen in told[1:])
    text += f", nor are {more} other sets of that size" if more else ""
    ways = [_relaxation_text(relaxation) for relaxation in found.relaxations[:_MOST_TOLD]]
    return f"{text}; it would take {', or '.join(ways)}" if ways else text


def _relaxation_text(relaxation: Relaxation) -> str:
    gives = " with ".join(_give_text(give) for give in relaxation.gives)
    return f"{gives} (layout {relaxation.item.layout.short_key})"


def _give_text(give: Give) -> str:
    name = give.limit.score
    if name == "cost":
        return f"+{euros(give.amount)}"
    like = Score(value=give.end, unit=SCORE_UNITS.get(name.rpartition(".")[2], ""))
    side = "at most" if give.limit.upper is not None else "at least"
    return f"{score_name(name)} {side} {quantity_text(give.end, like, name)}"


def _give(limit: Limit, amount: float) -> Give:
    end = limit.end + amount if limit.upper is not None else limit.end - amount
    return Give(
        limit=limit, end=end, amount=amount, share=amount / abs(limit.end) if limit.end != 0.0 else math.inf
    )


def _rank(relaxation: Relaxation) -> tuple[float, float, str]:
    cost = relaxation.item.scores.get("cost")
    return relaxation.share, math.inf if cost is None else cost.value, relaxation.item.layout.key
