"""Where antennas may hang under a robot, and which of these places go together.

Places conflict where two antennas would be closer than the profile allows. A clique of places that conflict with
each other holds one antenna at most, or, where the rule holds only within a scan slot, as many as there are scan
slots. Such rows are what a relaxation can use; pairs alone would let it put half an antenna into every place.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Final

import numpy as np
import shapely
from shapely.affinity import translate
from shapely.geometry import Polygon

from layoutopt.feasibility import LARGEST_MULTIPLEXER_PORTS
from layoutopt.identity import BoolArray, FloatArray, IntArray, by_content, read_only
from layoutopt.layout import ReaderGroup
from layoutopt.protocols import Mount
from layoutopt.readers.listed import listed
from layoutopt.readers.mounting import scan_slots
from layoutopt.robot import Robot

MOST_PLACES: Final = 120
"""Places of a grid under the robot: a pitch of about 50 mm under a chassis of 0.5 m."""
_TOLERANCE_M: Final = 1e-9
"""That of the feasibility check."""
_SAME_M: Final = 1e-4
"""Places nearer than this are one."""
_SEARCH_NODES: Final = 2000
"""Of an integer program, instead of a time, so that every machine stops at the same place."""


@by_content
@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class ReaderSlots:
    """Places for the antennas of one kind.

    Attributes
    ----------
    xy_m
        Centres in ``base_link``, shape (m, 2), m.
    side_m, radius_m
        Side of the square antenna, and radius of its read disc on the floor.
    spacing_m, simultaneous_spacing_m
        Least distance of two antennas, and of two that are on at the same time.
    antennas_per_module
        Scan slots of a module.

    Raises
    ------
    ValueError
        If a length is not positive, or no multiplexer has so many ports.
    """

    xy_m: FloatArray
    side_m: float
    radius_m: float
    spacing_m: float
    simultaneous_spacing_m: float
    antennas_per_module: int = 1
    key: str = field(init=False, repr=False, default="")

    def __post_init__(self) -> None:
        """Freeze the places and check the lengths."""
        object.__setattr__(self, "xy_m", read_only(self.xy_m, (-1, 2)))
        lengths = (self.side_m, self.radius_m, self.spacing_m, self.simultaneous_spacing_m)
        if not all(0.0 < length < math.inf for length in lengths):
            raise ValueError(f"side, radius and spacings must be positive and finite, got {lengths}")
        if not 1 <= self.antennas_per_module <= LARGEST_MULTIPLEXER_PORTS:
            raise ValueError(f"a multiplexer has 1 to {LARGEST_MULTIPLEXER_PORTS} ports")

    def __len__(self) -> int:
        """Return the number of places."""
        return len(self.xy_m)

    @property
    def mirrored(self) -> IntArray:
        """For each place the one on the other side of the robot, -1 where there is none, shape (m,)."""
        distance_m = np.linalg.norm(self.xy_m[:, None, :] - self.xy_m[None, :, :] * (1.0, -1.0), axis=2)
        nearest = distance_m.argmin(axis=1) if len(self) else np.empty(0, dtype=np.int64)
        return np.where(distance_m.min(axis=1, initial=np.inf) < _SAME_M, nearest, -1)

    def group(self, chosen: Sequence[int], mount: Mount) -> ReaderGroup:
        """Return the group with antennas at the chosen places, in their order."""
        return listed(points_m=[(float(x), float(y)) for x, y in self.xy_m[list(chosen)]], mount=mount)


def slots_under(robot: Robot, mount: Mount, *, most: int = MOST_PLACES) -> ReaderSlots:
    """Return the places of a grid at which an antenna, square to the robot, lies within its outline.

    The grid is even about the middle of the room for centres and ends at its border; the corners of that room and
    the ends of the grid's lines are places too, because the best ones are there. There are about ``most``.

    Raises
    ------
    ValueError
        If the antenna does not fit under the robot, or reads nothing from its height.
    """
    radius_m = mount.antenna.read_radius_m(mount.height_m)
    if not radius_m > 0.0:
        raise ValueError(f"an antenna of {mount.antenna.side_m} m reads no tag from {mount.height_m} m")
    room = _room_for_centres(robot, mount.antenna.side_m)
    profile = mount.profile
    return ReaderSlots(
        xy_m=_places_in(room, most),
        side_m=mount.antenna.side_m,
        radius_m=radius_m,
        spacing_m=profile.spacing_sides * mount.antenna.side_m,
        simultaneous_spacing_m=profile.simultaneous_spacing_sides * mount.antenna.side_m,
        antennas_per_module=mount.antennas_per_module,
    )


def _room_for_centres(robot: Robot, side_m: float) -> shapely.geometry.base.BaseGeometry:
    """Return where the centre of a square may lie so that all four corners are within the outline."""
    outline, half_m = Polygon(robot.outline_m), side_m / 2.0
    shifted = [translate(outline, half_m * x, half_m * y) for x in (-1.0, 1.0) for y in (-1.0, 1.0)]
    room = shapely.intersection_all(shifted)
    if room.is_empty:
        raise ValueError(f"an antenna of {side_m} m does not fit under the robot")
    return room


def _places_in(room: shapely.geometry.base.BaseGeometry, most: int) -> FloatArray:
    left, bottom, right, top = room.bounds
    box = Polygon([(left, bottom), (right, bottom), (right, top), (left, top)])
    # As many grid points as wanted fall into the room if it fills its box; else about that share of them.
    pitch_m = math.sqrt(max(box.area, _SAME_M**2) / most)
    x_m, y_m = (
        np.linspace(low, high, max(1, math.floor((high - low) / pitch_m)) + 1)
        for low, high in ((left, right), (bottom, top))
    )
    grid = np.stack(np.meshgrid(x_m, y_m), axis=-1).reshape(-1, 2)
    lines = [shapely.LineString([(left, y), (right, y)]) for y in y_m]
    lines += [shapely.LineString([(x, bottom), (x, top)]) for x in x_m]
    ends = [shapely.get_coordinates(shapely.intersection(room, line)) for line in lines]
    near = shapely.dwithin(room, shapely.points(grid), _TOLERANCE_M)
    points = np.concatenate([shapely.get_coordinates(room), *ends, grid[near]])
    points = points[np.lexsort((np.round(points[:, 1], 9), np.round(points[:, 0], 9)))]
    kept: list[FloatArray] = []
    for point in points:
        if not kept or np.linalg.norm(np.array(kept) - point, axis=1).min() >= _SAME_M:
            kept.append(point)
    return np.array(kept)


@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class Packing:
    """Rules for ``count`` antennas: rows @ chosen <= limits, and pairs, shape (m, m) each.

    ``conflicts`` are pairs that no group has, ``together`` those that do not share a scan slot. ``scan_slots`` and
    ``modules`` say how many antennas take turns, and how many are on at the same time.
    """

    count: int
    conflicts: BoolArray
    together: BoolArray
    rows: FloatArray
    limits: FloatArray
    scan_slots: int
    modules: int

    def within(self, chosen: Sequence[int] | IntArray) -> bool:
        """Return whether the chosen places keep every row."""
        return bool((self.rows[:, list(chosen)].sum(axis=1) <= self.limits).all())


def packing_of(slots: ReaderSlots, count: int) -> Packing:
    """Return the rules for a number of antennas.

    Raises
    ------
    ValueError
        If the count is not positive.
    """
    if count < 1:
        raise ValueError(f"a group needs at least one antenna, got {count}")
    turns = min(slots.antennas_per_module, count)
    modules = -(-count // slots.antennas_per_module)
    close = _closer(slots.xy_m, slots.spacing_m)
    together = _closer(slots.xy_m, max(slots.simultaneous_spacing_m, slots.spacing_m))
    if turns == 1:
        close = together
    cliques = [(clique, 1.0) for clique in cliques_of(close, slots.xy_m)]
    if turns > 1 and modules > 1:
        cliques += [(clique, float(turns)) for clique in cliques_of(together, slots.xy_m) if len(clique) > turns]
    return Packing(
        count=count,
        conflicts=close,
        together=together,
        rows=_rows_of([clique for clique, _ in cliques], len(slots)),
        limits=np.array([limit for _, limit in cliques]),
        scan_slots=turns,
        modules=modules,
    )


def _rows_of(cliques: Sequence[tuple[int, ...]], places: int) -> FloatArray:
    rows = np.zeros((len(cliques), places))
    for row, clique in zip(rows, cliques, strict=True):
        row[list(clique)] = 1.0
    return rows


def _closer(xy_m: FloatArray, spacing_m: float) -> BoolArray:
    distance_m = np.linalg.norm(xy_m[:, None, :] - xy_m[None, :, :], axis=2)
    close: BoolArray = np.asarray(distance_m < spacing_m - _TOLERANCE_M)
    np.fill_diagonal(close, False)
    return close


def cliques_of(conflicts: BoolArray, xy_m: FloatArray) -> tuple[tuple[int, ...], ...]:
    """Return maximal sets of places that all conflict, such that each conflict, shape (m, m), is in one of them.

    Each grows from a pair by the places nearest to its middle, so it fills a disc as wide as the spacing.
    """
    found: dict[tuple[int, ...], None] = {}
    open_pairs = np.triu(conflicts)
    for first, second in np.argwhere(conflicts & np.triu(np.ones_like(conflicts))):
        if not open_pairs[first, second]:
            continue
        members = [int(first), int(second)]
        common = conflicts[first] & conflicts[second]
        others = np.flatnonzero(common)
        offset_m = xy_m[others] - (xy_m[first] + xy_m[second]) / 2.0
        for other in others[np.argsort(np.round(np.hypot(*offset_m.T), 9), kind="stable")]:
            if common[other]:
                members.append(int(other))
                common = common & conflicts[other]
        clique = tuple(sorted(members))
        found[clique] = None
        open_pairs[np.ix_(clique, clique)] = False
    return tuple(found)


def arranged(slots: ReaderSlots, packing: Packing, chosen: Sequence[int]) -> tuple[int, ...] | None:
    """Return the chosen places in an order in which `layoutopt.readers.mounting.scan_slots` keeps the rules.

    ``None`` if two are too close, or if antennas of one scan slot are so in every order tried: by place, along
    either axis, and round the robot, each forwards and backwards.
    """
    ascending = np.sort(np.asarray(chosen, dtype=np.int64))
    if packing.conflicts[np.ix_(ascending, ascending)].any() or not packing.within(ascending):
        return None
    if packing.modules == 1 or packing.scan_slots == 1:
        return tuple(ascending.tolist())
    xy_m = np.round(slots.xy_m[ascending], 9)
    keys = (np.arange(len(ascending)), xy_m[:, 0], xy_m[:, 1], np.round(np.arctan2(xy_m[:, 1], xy_m[:, 0]), 9))
    for key in keys:
        for order in (np.argsort(key, kind="stable"), np.argsort(-key, kind="stable")):
            places = ascending[order]
            turns = np.array(scan_slots(slots.xy_m[places], slots.antennas_per_module))
            same = turns[:, None] == turns[None, :]
            if not (same & packing.together[np.ix_(places, places)]).any():
                return tuple(places.tolist())
    return None


@dataclass(frozen=True, slots=True, kw_only=True)
class MostThatFit:
    """The largest group of places that an integer program found, and the proven bound on their number."""

    chosen: tuple[int, ...]
    bound: int


def most_that_fit(slots: ReaderSlots, packing: Packing) -> MostThatFit:
    """Return how many antennas fit, up to the packing's own count, by an integer program over places and turns.

    An antenna takes a place and a turn; places that are too close to be on together do not share a turn, and no
    turn has more antennas than there are modules. A bound that refuses the packing's count is asked for twice, the
    second time without the solver's presolve, which has given wrong answers; the weaker of both counts.

    References
    ----------
    HiGHS: Huangfu and Hall, Math. Program. Comput. 10, 2018.
    """
    from scipy.optimize import Bounds, LinearConstraint, milp

    turns = packing.scan_slots if packing.modules > 1 else 1
    eye, every = np.eye(turns), np.ones((1, turns))
    rows = [np.kron(packing.rows, every), np.kron(np.eye(len(slots)), every), np.ones((1, len(slots) * turns))]
    limits = [packing.limits, np.ones(len(slots)), np.array([float(packing.count)])]
    if turns > 1:
        together = _rows_of(cliques_of(packing.together, slots.xy_m), len(slots))
        rows += [np.kron(together, eye), np.kron(np.ones((1, len(slots))), eye)]
        limits += [np.ones(len(together) * turns), np.full(turns, float(packing.modules))]

    def solved(*, presolve: bool) -> MostThatFit:
        found = milp(
            -np.ones(len(slots) * turns),
            integrality=np.ones(len(slots) * turns, dtype=np.int64),
            bounds=Bounds(0.0, 1.0),
            constraints=LinearConstraint(np.concatenate(rows), -np.inf, np.concatenate(limits)),
            options={"node_limit": _SEARCH_NODES, "presolve": presolve},
        )
        taken = np.zeros(len(slots)) if found.x is None else found.x.reshape(len(slots), turns).sum(axis=1)
        dual = getattr(found, "mip_dual_bound", None)
        bound = packing.count if dual is None else math.floor(-float(dual) + 1e-6)
        return MostThatFit(chosen=tuple(np.flatnonzero(taken > 0.5).tolist()), bound=bound)

    first = solved(presolve=True)
    if first.bound >= packing.count:
        return first
    return max(first, solved(presolve=False), key=lambda found: found.bound)
