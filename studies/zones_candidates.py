"""Which layouts the study of zones races: the cheapest that uniform layouts let expect to meet the limits."""

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from itertools import islice
from typing import Final

from layoutopt.layout import Layout
from layoutopt.problem import Limit
from layoutopt.result import Evaluated
from layoutopt.scores import TrialOutcomes
from solvers.judging import met_in_search, simulated_scores
from solvers.zones import Cheapest, Composition, ZoneChoices, cheapest, most_accurate, tightened, worst_predicted
from studies.zones_setting import Setting

_OF_EACH_GROUP: Final = 2
"""Compositions of each reader group, for the first may turn out to lose more at its borders."""

Composed = tuple[Composition, tuple[Evaluated, ...]]
"""A composition, and the uniform layout behind each slot."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Effort:
    """How much the study spends.

    Attributes
    ----------
    stages
        Drives that enter each zone with a target, of every uniform layout, then of those that are still needed,
        and so on.
    most_times
        So many times the drives of a stage are run at most to have as many that enter a zone.
    shares
        Limits for which compositions are chosen, as shares of the limits asked for: a layout that just meets a
        limit in search would miss it where held-out drives are harder.
    best
        Compositions, and uniform layouts, kept for each share.
    race_trials
        Budget of the race of the composed layouts, and of that of the uniform ones, beyond the drives of the
        last stage for each of their layouts.
    looks, look_trials
        How many layouts of each kind have a first look at held-out drives at a time, and the drives of each in
        each scenario.
    most_tried, validation_trials
        How many layouts of each kind, cheapest first, are tried on all held-out drives, and the drives in each
        scenario.
    spare_tries
        How many more of each kind are tried where none of these held, those first whose first look left most room.
    closing_window, closing_block, closing_trials
        How many layouts of each kind, cheapest first, the closing round drives at a time, the drives of the first
        block in a scenario, and those of the round in all.
    """

    stages: tuple[int, ...]
    most_times: int
    shares: tuple[float, ...]
    best: int
    race_trials: int
    looks: int
    look_trials: int
    most_tried: int
    validation_trials: int
    spare_tries: int
    closing_window: int
    closing_block: int
    closing_trials: int

    def drives(self, setting: Setting) -> tuple[int, ...]:
        """Return the drives of each stage in a setting."""
        return tuple(setting.drives_for(wanted, wanted * self.most_times) for wanted in self.stages)


@dataclass(frozen=True, slots=True, kw_only=True)
class Predicted:
    """A layout put together from uniform ones, one a slot, and what was predicted of it."""

    item: Evaluated
    refusal: str
    predicted: Composition
    parts: tuple[Layout, ...]


@dataclass(frozen=True, slots=True, kw_only=True)
class Chosen:
    """Compositions with the uniform layout behind each slot, by rising cost, and uniform layouts.

    ``possible`` is false where no composition was predicted to meet the limits. ``cut`` counts the searches for
    compositions that ended before they were through, and none of what they left out costs less than ``rest_eur``.
    """

    compositions: tuple[Composed, ...] = ()
    uniform: tuple[Evaluated, ...] = ()
    possible: bool = False
    cut: int = 0
    rest_eur: float = math.inf


def chosen_from(
    setting: Setting,
    effort: Effort,
    alive: Sequence[Evaluated],
    tables: Mapping[str, TrialOutcomes],
    drives: int,
    *,
    last: bool,
) -> Chosen:
    """Return the cheapest compositions and uniform layouts for each share of the limits.

    These are predicted to meet the limits with their confidence bounds. On few drives bounds are wide, so what
    costs no more and is not predicted to miss a limit is kept as well: every uniform layout, and of each reader
    group its cheapest composition, so that none is dropped before its drives speak against it. At the ``last``
    choice the cheapest of these compositions are enough.
    """
    limits, shares = setting.simulated_limits, setting.shares(drives)
    models: list[tuple[ZoneChoices, list[list[Evaluated]]]] = []
    for patterns in setting.uniform.values():
        driven = {key: tables[item.layout.key] for key, item in patterns.items() if item.layout.key in tables}
        made = setting.choices(patterns, driven, shares)
        if made is not None:
            models.append((made[0], [[patterns[one.key] for one in options] for options in made[1]]))
    # Cheap readers first, so that dear ones are soon known to be too dear.
    models.sort(key=lambda model: (model[0].base_eur, model[1][0][0].layout.readers[0].key))
    found: dict[tuple[str, ...], Composed] = {}
    uniform: dict[str, Evaluated] = {}
    searches: list[Cheapest] = []
    for share in effort.shares:
        asked = tightened(limits, share)
        best = _composed(models, asked, searches, most=effort.best, shown=True)
        # What costs more than layouts shown to do is not wanted, however open it is.
        most_eur = best[-1][0].cost_eur if len(best) == effort.best else math.inf
        wide = share == max(effort.shares)
        most = None if wide and not last else effort.best
        still_open = _composed(models, asked, searches, most=most, shown=False, most_eur=most_eur)
        found.update({_place(parts): (one, parts) for one, parts in (*best, *still_open)})
        doing = list(islice(_uniform(setting, alive, tables, asked, shown=True), effort.best))
        uniform.update({item.layout.key: item for item in doing})
        if wide:
            most_eur = _cost(doing[-1])[0] if len(doing) == effort.best else math.inf
            others = _uniform(setting, alive, tables, asked, shown=False)
            uniform.update({item.layout.key: item for item in others if _cost(item)[0] <= most_eur})
    possible = bool(found)
    if not possible:
        nearest = [(most_accurate(choices, limits), choices, options) for choices, options in models]
        ranked = sorted(
            ((worst_predicted(one, limits)[0], _parts(one, options), one) for one, _, options in nearest),
            key=lambda entry: (entry[0], _place(entry[1])),
        )
        found = {_place(parts): (one, parts) for _, parts, one in ranked[: effort.best]}
    if not uniform:
        uniform = {item.layout.key: item for item in _nearest(setting, alive, tables)[: effort.best]}
    return Chosen(
        compositions=tuple(sorted(found.values(), key=_rank)),
        uniform=tuple(sorted(uniform.values(), key=_cost)),
        possible=possible,
        cut=sum(search.cut for search in searches),
        rest_eur=min((search.rest_eur for search in searches if search.cut), default=math.inf),
    )


def _composed(
    models: Sequence[tuple[ZoneChoices, Sequence[Sequence[Evaluated]]]],
    limits: Sequence[Limit],
    searches: list[Cheapest],
    *,
    most: int | None,
    shown: bool,
    most_eur: float = math.inf,
) -> list[Composed]:
    """Return the cheapest compositions of all reader groups, or with no ``most`` the cheapest of each group.

    Every search that was made is added to ``searches``.
    """
    best: list[Composed] = []
    for choices, options in models:
        if most is not None and len(best) == most:
            most_eur = best[-1][0].cost_eur
        count = 1 if most is None else _OF_EACH_GROUP
        searches.append(cheapest(choices, limits, count=count, shown=shown, most_eur=most_eur))
        mine = [(one, _parts(one, options)) for one in searches[-1].compositions]
        best = sorted([*best, *mine], key=_rank)[:most]
    return best


def _parts(one: Composition, options: Sequence[Sequence[Evaluated]]) -> tuple[Evaluated, ...]:
    return tuple(options[slot][option] for slot, option in enumerate(one.options))


def _place(parts: Sequence[Evaluated]) -> tuple[str, ...]:
    return tuple(part.layout.key for part in parts)


def _rank(entry: Composed) -> tuple[float, tuple[str, ...]]:
    return entry[0].cost_eur, _place(entry[1])


def _cost(item: Evaluated) -> tuple[float, str]:
    return item.scores["cost"].value, item.layout.key


def _uniform(
    setting: Setting,
    alive: Sequence[Evaluated],
    tables: Mapping[str, TrialOutcomes],
    limits: Sequence[Limit],
    *,
    shown: bool,
) -> Iterator[Evaluated]:
    """Yield the uniform layouts that meet the limits, or do not break them, by rising cost."""
    for item in sorted(alive, key=_cost):
        table = tables.get(item.layout.key)
        if table is None:
            continue
        scores = simulated_scores(setting.problem, item.layout, setting.problem.design, table)
        pairs = [(limit, scores[limit.score]) for limit in limits]
        if all(met_in_search(limit, score) if shown else not limit.broken(score) for limit, score in pairs):
            yield item


def _nearest(setting: Setting, alive: Sequence[Evaluated], tables: Mapping[str, TrialOutcomes]) -> list[Evaluated]:
    """Return the uniform layouts by how much they miss the limit that they miss by most."""

    def worst(item: Evaluated) -> tuple[float, str]:
        scores = simulated_scores(setting.problem, item.layout, setting.problem.design, tables[item.layout.key])
        ratios = [limit.ratio(limit.bound(scores[limit.score])) for limit in setting.simulated_limits]
        return max(ratios), item.layout.key

    return sorted((item for item in alive if item.layout.key in tables), key=worst)


def composed_of(setting: Setting, chosen: Chosen) -> tuple[Predicted, ...]:
    """Return the compositions of more than one pattern as layouts, judged exactly."""
    found: dict[str, Predicted] = {}
    for one, parts in chosen.compositions:
        patterns = [part.layout.floor_tags.base.pattern for part in parts]
        if len({pattern.key for pattern in patterns}) < 2:
            continue
        layout = setting.composed(parts[0].layout.readers[0], patterns)
        item, refusal = setting.judged(layout)
        found.setdefault(
            layout.key,
            Predicted(item=item, refusal=refusal, predicted=one, parts=tuple(part.layout for part in parts)),
        )
    return tuple(found.values())
