"""The question where tags go on a real floor, and the covering problem that it makes of sampled runs."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Final

import numpy as np

from layoutopt.identity import BoolArray, FloatArray, IntArray
from layoutopt.protocols import Antennas
from layoutopt.scenario import Scenario
from layoutopt.sightings import grid_for_ways, tags_on_runs
from solvers.covering.problem import CoverProblem, no_pairs
from solvers.covering.reduction import reduced
from solvers.demands import Demand, Runs, joined, random_runs_of, visible
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
    forbidden
        Slots that may not be used, shape (slots,); empty for none.
    unserved_share
        Share of the runs that may be left out because no slot could serve them; with zero, one such run refuses
        the question.

    Raises
    ------
    ValueError
        If nothing is demanded, a number is out of its range, or there are more marks than slots.
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
    unserved_share: float = 0.0

    def __post_init__(self) -> None:
        """Check that there is something to choose and to see."""
        if not self.demands:
            raise ValueError("a placement needs at least one demand")
        if not self.tag_price_cents > 0:
            raise ValueError(f"a tag must cost something, got {self.tag_price_cents} cents")
        if self.tags_per_tile is not None and self.tags_per_tile < 1:
            raise ValueError(f"a tile takes at least one tag, got {self.tags_per_tile}")
        if self.forbidden.size not in (0, len(self.slots)):
            raise ValueError(f"{self.forbidden.size} marks of forbidden slots for {len(self.slots)} slots")
        if not 0.0 <= self.unserved_share < 1.0:
            raise ValueError(f"the share of runs that may go unserved is below one, got {self.unserved_share}")

    @property
    def places_m(self) -> FloatArray:
        """All places at which a tag may lie, those of installed tags last, shape (n, 2), m."""
        return np.concatenate([self.slots.xy_m, self.installed_m])

    @property
    def columns(self) -> IntArray | None:
        """Column and row of each place on the grid of slots, shape (n, 2); those of installed tags say nothing."""
        if self.slots.place is None:
            return None
        return np.concatenate([self.slots.place, np.zeros((len(self.installed_m), 2), dtype=np.int64)])


def covering_of(question: TagPlacement, runs: Sequence[Runs]) -> CoverProblem:
    """Return the covering problem of sampled runs, those of each demand apart; its slots are ``places_m``."""
    from scipy.spatial import cKDTree

    places_m, slots = question.places_m, len(question.slots)
    wanted = [np.full(len(part), asked.tags) for part, asked in zip(runs, question.demands, strict=True)]
    pairs = no_pairs()
    if len(places_m) > 1:
        least_m = max(question.spacing_m, question.tag_size_m) - _SAME_PLACE_M
        pairs = np.asarray(cKDTree(places_m).query_pairs(least_m, output_type="ndarray"), dtype=np.int64)
        # Tags that lie there already may lie as they do.
        pairs = pairs[(pairs < slots).any(axis=1)]
    installed = np.arange(len(places_m)) >= slots
    forbidden = np.zeros(len(places_m), dtype=np.bool_)
    if question.forbidden.size:
        forbidden[:slots] = question.forbidden
    group, capacity = _tiles(question, installed)
    return CoverProblem(
        sees=visible(joined(runs), question.antennas, places_m),
        demand=np.concatenate(wanted).astype(np.int64),
        cost=np.full(len(places_m), question.tag_price_cents, dtype=np.int64),
        locked=installed,
        forbidden=forbidden,
        conflicts=pairs,
        group=group,
        capacity=capacity,
    )


def servable(question: TagPlacement, runs: Sequence[Runs]) -> tuple[list[Runs], Runs]:
    """Return the runs of each demand without those that no choice of slots serves, and all of these."""
    lost = reduced(covering_of(question, runs), every_row=True).lost
    ends = np.cumsum([0, *map(len, runs)])
    kept = np.ones(ends[-1], dtype=np.bool_)
    kept[lost] = False
    parts = [part.some(kept[ends[number] : ends[number + 1]]) for number, part in enumerate(runs)]
    return parts, joined(runs).some(lost)


def missed_runs(question: TagPlacement, chosen: BoolArray, count: int, seed: int) -> tuple[list[Runs], int]:
    """Return for each demand those of ``count`` fresh random runs that see too few of the chosen places.

    The second value is how many runs of all demands were looked at; fewer than asked for where there are none.
    """
    found, looked_at = [], 0
    for demand in question.demands:
        runs = random_runs_of(demand, question.scenario, count, seed)
        found.append(runs.some(short_of_tags(runs, demand, question.antennas, question.places_m[chosen])))
        looked_at += len(runs)
    return found, looked_at


def short_of_tags(runs: Runs, demand: Demand, antennas: Antennas, xy_m: FloatArray) -> BoolArray:
    """Return which runs see fewer of the tags at ``xy_m``, shape (n, 2), m, than demanded, shape (runs,)."""
    return tags_on_runs(runs.poses, runs.way_m, antennas, grid_for_ways(xy_m), demand.tags) < demand.tags


def _tiles(question: TagPlacement, installed: BoolArray) -> tuple[IntArray, IntArray]:
    """Return the floor tile of each place and how many tags each tile takes; installed ones may be more."""
    if question.tags_per_tile is None:
        return np.full(len(installed), -1, dtype=np.int64), np.empty(0, dtype=np.int64)
    tiles = question.scenario.site.tile_of(question.places_m)
    numbered, group = np.unique(tiles, axis=0, return_inverse=True)
    group = group.reshape(-1).astype(np.int64)
    have = np.bincount(group[installed], minlength=len(numbered))
    return group, np.maximum(have, question.tags_per_tile).astype(np.int64)
