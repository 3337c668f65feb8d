"""The question where tags go on a real floor, and the covering problem that it makes of sampled runs."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Final

import numpy as np

from layoutopt.identity import BoolArray, FloatArray, IntArray
from layoutopt.layout import WHOLE_FLOOR
from layoutopt.protocols import Antennas
from layoutopt.scenario import Scenario
from layoutopt.sightings import grid_for_ways, tags_on_runs
from layoutopt.units import format_length
from solvers.covering.problem import CoverProblem, no_pairs
from solvers.covering.reduction import Reduced, reduced
from solvers.demands import Demand, Runs, joined, visible
from solvers.slots import Slots

_SAME_PLACE_M: Final = 1e-9


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class TagPlacement:
    """The question: which slots get a tag.

    Attributes
    ----------
    scenario
        Site, robot and routes.
    antennas
        The antennas of the robot's reader group.
    slots
        Places to choose from.
    demands
        What has to be seen, each in its zone.
    tag_size_m
        Longer side of a tag: no two lie closer.
    tag_price_cents
        What one tag more costs, laid and surveyed.
    spacing_m
        Least distance of two tags, if more than that.
    tags_per_tile
        Most tags on one floor tile; ``None`` for no limit.
    installed_m
        Tags that lie there already and stay, shape (n, 2), m; they cost nothing and need no slot.
    forbidden, required
        Slots that may not be used, and slots that get a tag in any case, which is paid for, shape (slots,); empty
        for none.
    unserved_share
        Share of the runs that may be left out because no slot could serve them; with zero, one such run refuses
        the question.

    Raises
    ------
    ValueError
        If nothing is demanded, a number is out of its range, a zone of a demand does not exist, or there are more
        marks than slots. What cannot be had at once is no error here: `contradiction` tells it.
    """

    scenario: Scenario
    antennas: Antennas
    slots: Slots
    demands: tuple[Demand, ...]
    tag_size_m: float
    tag_price_cents: int
    spacing_m: float = 0.0
    tags_per_tile: int | None = None
    installed_m: FloatArray = field(default_factory=lambda: np.empty((0, 2)))
    forbidden: BoolArray = field(default_factory=lambda: np.empty(0, dtype=np.bool_))
    required: BoolArray = field(default_factory=lambda: np.empty(0, dtype=np.bool_))
    unserved_share: float = 0.0

    def __post_init__(self) -> None:
        """Check that there is something to choose and to see."""
        if not self.demands:
            raise ValueError("a placement needs at least one demand")
        if not self.tag_price_cents > 0:
            raise ValueError(f"a tag must cost something, got {self.tag_price_cents} cents")
        if not 0.0 < self.tag_size_m < math.inf:
            raise ValueError(f"the size of a tag must be positive and finite, got {self.tag_size_m}")
        if not 0.0 <= self.spacing_m < math.inf:
            raise ValueError(f"the spacing must be zero or more and finite, got {self.spacing_m}")
        if self.tags_per_tile is not None and self.tags_per_tile < 1:
            raise ValueError(f"a tile takes at least one tag, got {self.tags_per_tile}")
        if self.tags_per_tile is not None and self.scenario.site.tiling is None:
            raise ValueError(f"site '{self.scenario.site.name}' has no floor tiles to limit the tags of")
        if not 0.0 <= self.unserved_share < 1.0:
            raise ValueError(f"the share of runs that may go unserved is below one, got {self.unserved_share}")
        for name, marks in (("forbidden", self.forbidden), ("required", self.required)):
            if marks.size not in (0, len(self.slots)):
                raise ValueError(f"{marks.size} marks of {name} slots for {len(self.slots)} slots")
        if self.installed_m.ndim != 2 or self.installed_m.shape[1] != 2 or not np.isfinite(self.installed_m).all():
            raise ValueError("places of installed tags are pairs of finite numbers, shape (n, 2)")
        known = self.scenario.site.zone_names
        for demand in self.demands:
            for zone in (demand.zone, *demand.without):
                if zone != WHOLE_FLOOR and zone not in known:
                    raise ValueError(
                        f"a demand names zone '{zone}', and the site has: {', '.join(known) or 'none'}"
                    )

    @property
    def places_m(self) -> FloatArray:
        """All places at which a tag may lie, those of installed tags last, shape (n, 2), m."""
        return np.concatenate([self.slots.xy_m, self.installed_m])

    @property
    def fixed(self) -> BoolArray:
        """Which of all places have a tag in any case: installed ones and required slots, shape (n,)."""
        marks = np.arange(len(self.places_m)) >= len(self.slots)
        if self.required.size:
            marks[: len(self.slots)] = self.required
        return marks

    @property
    def required_count(self) -> int:
        """New tags that every choice has."""
        return int(self.required.sum())

    @property
    def columns(self) -> IntArray | None:
        """Column and row of each place on the grid of slots, shape (n, 2); those of installed tags say nothing."""
        if self.slots.place is None:
            return None
        return np.concatenate([self.slots.place, np.zeros((len(self.installed_m), 2), dtype=np.int64)])


def covering_of(question: TagPlacement, runs: Sequence[Runs]) -> CoverProblem:
    """Return the covering problem of sampled runs, those of each demand apart; its slots are ``places_m``.

    Required slots cost nothing in it, because every choice has them.

    Raises
    ------
    ValueError
        If there is a `contradiction` in the question.
    """
    places_m = question.places_m
    wanted = [np.full(len(part), asked.tags) for part, asked in zip(runs, question.demands, strict=True)]
    forbidden = np.zeros(len(places_m), dtype=np.bool_)
    if question.forbidden.size:
        forbidden[: len(question.slots)] = question.forbidden
    group, capacity = _tiles(question)
    return CoverProblem(
        sees=visible(joined(runs), question.antennas, places_m),
        demand=np.concatenate(wanted).astype(np.int64),
        cost=np.full(len(places_m), question.tag_price_cents, dtype=np.int64),
        locked=question.fixed,
        forbidden=forbidden,
        conflicts=_too_close(question),
        group=group,
        capacity=capacity,
    )


def contradiction(question: TagPlacement) -> str:
    """Return in words why the tags that must lie cannot all lie; empty if they can."""
    if not question.required_count:
        return ""
    places_m, fixed = question.places_m, question.fixed

    def at(place: int) -> str:
        return f"({places_m[place, 0]:g}, {places_m[place, 1]:g}) m"

    if question.forbidden.size and (both := question.required & question.forbidden).any():
        return f"the slot at {at(int(np.flatnonzero(both)[0]))} is required and forbidden at once"
    pairs = _too_close(question)
    if len(close := pairs[fixed[pairs].all(axis=1)]):
        least = format_length(max(question.spacing_m, question.tag_size_m))
        return f"required tags at {at(close[0, 0])} and {at(close[0, 1])} are closer than {least}"
    group, capacity = _tiles(question)
    load = np.bincount(group[fixed & (group >= 0)], minlength=len(capacity))
    if len(full := np.flatnonzero(load > capacity)):
        place = int(np.flatnonzero(fixed & (group == full[0]))[0])
        return f"{load[full[0]]} tags must lie on the floor tile of {at(place)}, which takes {capacity[full[0]]}"
    return ""


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Served:
    """Sampled runs taken apart once: those that some choice serves, with their covering problem, and the others.

    ``small`` is the problem without what decides nothing; its choices become choices of ``places_m`` by
    ``small.whole``.
    """

    runs: tuple[Runs, ...]
    lost: Runs
    small: Reduced

    def __len__(self) -> int:
        """Return the number of runs that some choice serves."""
        return sum(map(len, self.runs))


def served(question: TagPlacement, runs: Sequence[Runs], *, every_run: bool = True) -> Served:
    """Return the runs of each demand without those that no choice of slots serves, and these apart.

    Parameters
    ----------
    every_run
        Whether all that can be served must be; else the problem is one of coverage within a budget.
    """
    small = reduced(covering_of(question, runs), every_row=every_run)
    ends = np.cumsum([0, *map(len, runs)])
    kept = np.ones(ends[-1], dtype=np.bool_)
    kept[small.lost] = False
    parts = [part.some(kept[ends[number] : ends[number + 1]]) for number, part in enumerate(runs)]
    return Served(runs=tuple(parts), lost=joined(runs).some(small.lost), small=small)


def missed_runs(question: TagPlacement, chosen: BoolArray, fresh: Sequence[Runs]) -> list[Runs]:
    """Return for each demand those of its runs that see too few of the chosen places."""
    xy_m = question.places_m[chosen]
    return [
        runs.some(short_of_tags(runs, demand, question.antennas, xy_m))
        for demand, runs in zip(question.demands, fresh, strict=True)
    ]


def short_of_tags(runs: Runs, demand: Demand, antennas: Antennas, xy_m: FloatArray) -> BoolArray:
    """Return which runs see fewer of the tags at ``xy_m``, shape (n, 2), m, than demanded, shape (runs,)."""
    return tags_on_runs(runs.poses, runs.way_m, antennas, grid_for_ways(xy_m), demand.tags) < demand.tags


def _too_close(question: TagPlacement) -> IntArray:
    """Return pairs of places that may not both have a tag; tags that lie there already may lie as they do."""
    from scipy.spatial import cKDTree

    places_m = question.places_m
    if len(places_m) < 2:
        return no_pairs()
    least_m = max(question.spacing_m, question.tag_size_m) - _SAME_PLACE_M
    pairs = np.asarray(cKDTree(places_m).query_pairs(least_m, output_type="ndarray"), dtype=np.int64)
    return np.asarray(pairs[(pairs < len(question.slots)).any(axis=1)])


def _tiles(question: TagPlacement) -> tuple[IntArray, IntArray]:
    """Return the floor tile of each place and how many tags each tile takes; installed ones may be more."""
    count = len(question.places_m)
    if question.tags_per_tile is None:
        return np.full(count, -1, dtype=np.int64), np.empty(0, dtype=np.int64)
    tiles = question.scenario.site.tile_of(question.places_m)
    numbered, group = np.unique(tiles, axis=0, return_inverse=True)
    group = group.reshape(-1).astype(np.int64)
    have = np.bincount(group[len(question.slots) :], minlength=len(numbered))
    return group, np.maximum(have, question.tags_per_tile).astype(np.int64)
