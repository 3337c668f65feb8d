"""Means and maxima over the direction of travel: where to evaluate, and with which weights."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from layoutopt.geometry import reduced_cell, turned
from layoutopt.identity import FloatArray
from objectives.corridors import Corridor
from objectives.periodic_discs import PeriodicDiscs, Sight

_ORDERS: Final = (6, 4, 3, 2)
"""Turns that can map a lattice on itself, as parts of a full turn."""
_SAME_SHARE: Final = 1e-9
"""Places closer than this share of the cell's side are one place, when symmetries are looked for."""
_SAME_RAD: Final = 1e-9
_NODES_A_CORRIDOR: Final = 12

_PEAKS: Final = 8
_STEPS: Final = 45
"""Each step of the golden section keeps 0.618 of an interval."""
_GOLDEN: Final = (math.sqrt(5.0) - 1.0) / 2.0


@dataclass(frozen=True, slots=True, kw_only=True)
class DirectionRule:
    """Nodes and weights of a mean over the direction, and the corridors about which blind runs have peaks.

    A run of length L at an angle delta to a corridor of width w along period v lies in it for a share
    (w - L |delta|) |v| / A of all starts. That peak is the narrower the longer the run, and nodes would miss it;
    its mean is known, so only what is left of the blind probability without the peaks is summed over the nodes.

    Attributes
    ----------
    direction_rad, weight
        Nodes and their weights, which sum to one, shape (k,).
    turn_rad
        The period over which the mean is taken.
    corridor_rad, width_m, share_per_m
        Direction, width, and |v| / A of each corridor in one period, shape (c,).
    """

    direction_rad: FloatArray
    weight: FloatArray
    turn_rad: float
    corridor_rad: FloatArray
    width_m: FloatArray
    share_per_m: FloatArray

    def mean(self, blind: FloatArray, length_m: float) -> float:
        """Return the mean over direction of the blind probability of a run, known at the nodes."""
        at_nodes, mean = self._peaks(length_m)
        return max(0.0, float(self.weight @ (blind - at_nodes) + mean))

    def slope_per_m(self, slope_per_m: FloatArray, length_m: float) -> float:
        """Return the derivative of `mean` with respect to the length, given that at the nodes."""
        away_rad = self._away_rad()
        inside = self.width_m > length_m * away_rad
        at_nodes = -(np.where(inside, away_rad, 0.0) @ self.share_per_m)
        half_rad = self._half_rad(length_m)
        mean = -float((self.share_per_m * half_rad**2).sum()) / self.turn_rad
        return float(self.weight @ (slope_per_m - at_nodes) + mean)

    def _peaks(self, length_m: float) -> tuple[FloatArray, float]:
        """Return the share of starts in corridors, for each node, and its mean over all directions."""
        high_m = np.maximum(self.width_m - length_m * self._away_rad(), 0.0)
        half_rad = self._half_rad(length_m)
        mean = self.share_per_m * half_rad * (2.0 * self.width_m - length_m * half_rad)
        return high_m @ self.share_per_m, float(mean.sum()) / self.turn_rad

    def _half_rad(self, length_m: float) -> FloatArray:
        """Return how far each peak reaches to either side, at most to the middle of the period."""
        return (
            np.minimum(self.width_m, 0.5 * self.turn_rad * length_m) / length_m
            if length_m > 0.0
            else np.full(len(self.width_m), 0.5 * self.turn_rad)
        )

    def _away_rad(self) -> FloatArray:
        """Return the angle between each node and each corridor, shape (k, c)."""
        away_rad = np.abs(self.direction_rad[:, None] - self.corridor_rad) % self.turn_rad
        return np.asarray(np.minimum(away_rad, self.turn_rad - away_rad))


def period_rad(sight: Sight) -> float:
    """Return an angle after which everything repeats when the direction of travel is turned.

    A run driven backwards meets the same discs, so those that stay as they are repeat after half a turn; a group
    of antennas turns with the robot. A pattern that is mapped on itself by a turn makes it shorter.
    """
    if isinstance(sight, PeriodicDiscs):
        order = _rotation_order(sight.cell_m, sight.centre_m, sight.radius_m)
        return 2.0 * math.pi / (order if order % 2 == 0 else 2 * order)
    return 2.0 * math.pi / _rotation_order(sight.cell_m, sight.tag_m, np.zeros(len(sight.tag_m)))


def _rotation_order(cell_m: FloatArray, place_m: FloatArray, kind: FloatArray) -> int:
    """Return the order of the largest turn, about any centre, that maps places on places of their kind."""
    cell_m, place_m, kind = _primitive(reduced_cell(cell_m), place_m, kind)
    inverse = np.asarray(np.linalg.inv(cell_m), dtype=np.float64)
    for order in _ORDERS:
        turned_m = turned(place_m, 2.0 * math.pi / order)
        periods = turned(cell_m, 2.0 * math.pi / order) @ inverse
        if np.abs(periods - np.round(periods)).max() > _SAME_SHARE:
            continue
        # The first place is mapped on one of its kind; that fixes the centre, up to a period.
        for target in np.flatnonzero(kind == kind[0]):
            if _maps(turned_m + place_m[target] - turned_m[0], place_m, kind, inverse):
                return order
    return 1


def _primitive(
    cell_m: FloatArray, place_m: FloatArray, kind: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the smallest cell of the same places, given a reduced one, with the places of one cell.

    Its sides are the two shortest periods that are not parallel: in the plane these always span the lattice.
    """
    inverse = np.asarray(np.linalg.inv(cell_m), dtype=np.float64)
    shift_m = place_m[kind == kind[0]] - place_m[0]
    period_m = np.array([by_m for by_m in shift_m if _maps(place_m + by_m, place_m, kind, inverse)])
    if len(period_m) == 1:
        return cell_m, place_m, kind
    period_m = period_m - np.round(period_m @ inverse) @ cell_m
    steps = np.stack(np.meshgrid([-1, 0, 1], [-1, 0, 1]), axis=-1).reshape(-1, 2)
    all_m = (period_m[:, None, :] + steps @ cell_m).reshape(-1, 2)
    all_m = all_m[np.argsort(np.hypot(*all_m.T), kind="stable")]
    least_m2 = 0.5 * abs(float(np.linalg.det(cell_m))) / len(place_m)
    first_m = all_m[np.flatnonzero((all_m**2).sum(axis=1) > _SAME_SHARE * least_m2)[0]]
    aside_m2 = np.abs(all_m[:, 0] * first_m[1] - all_m[:, 1] * first_m[0])
    cell_m = np.array([first_m, all_m[np.flatnonzero(aside_m2 > least_m2)[0]]])
    inverse, once = np.asarray(np.linalg.inv(cell_m), dtype=np.float64), [0]
    for index in range(1, len(place_m)):
        back = (place_m[once] - place_m[index]) @ inverse
        if not (np.abs(back - np.round(back)).max(axis=1) < _SAME_SHARE).any():
            once.append(index)
    return reduced_cell(cell_m), place_m[once], kind[once]


def _maps(image_m: FloatArray, place_m: FloatArray, kind: FloatArray, inverse: FloatArray) -> bool:
    """Return whether every image is a place of its kind, but for whole periods."""
    for image, its_kind in zip(image_m, kind, strict=True):
        steps = (place_m - image) @ inverse
        close = np.abs(steps - np.round(steps)).max(axis=1) < _SAME_SHARE
        if not (close & (kind == its_kind)).any():
            return False
    return True


def direction_rule(sight: Sight, corridors: Sequence[Corridor], count: int) -> DirectionRule:
    """Return a rule of about ``count`` directions for means over all directions.

    Each interval between the directions of the weightiest corridors gets nodes of its own, which crowd at its
    ends: the midpoint rule after the substitution x² (3 - 2 x) (Korobov, Number-Theoretic Methods in Approximate
    Analysis, 1963). Without corridors the nodes are evenly spaced.
    """
    turn_rad = period_rad(sight)
    once = [corridor for corridor in corridors if corridor.direction_rad < turn_rad - _SAME_RAD]
    ends: list[float] = []
    for corridor in sorted(once, key=lambda corridor: -corridor.weight_m3):
        new = all(abs(corridor.direction_rad - end) > _SAME_RAD for end in ends)
        if new and len(ends) < max(1, count // _NODES_A_CORRIDOR):
            ends.append(corridor.direction_rad)
    if ends:
        ends.sort()
        directions, weights = [], []
        for begin, end in zip(ends, [*ends[1:], ends[0] + turn_rad], strict=True):
            nodes = max(_NODES_A_CORRIDOR // 2, round(count * (end - begin) / turn_rad))
            x = (np.arange(nodes) + 0.5) / nodes
            directions.append(begin + (end - begin) * x**2 * (3.0 - 2.0 * x))
            weights.append((end - begin) / turn_rad * 6.0 * x * (1.0 - x) / nodes)
        direction_rad, weight = np.concatenate(directions), np.concatenate(weights)
    else:
        direction_rad, weight = (np.arange(count) + 0.5) * turn_rad / count, np.ones(count)
    return DirectionRule(
        direction_rad=direction_rad,
        weight=weight / weight.sum(),
        turn_rad=turn_rad,
        corridor_rad=np.array([corridor.direction_rad for corridor in once]),
        width_m=np.array([corridor.width_m for corridor in once]),
        share_per_m=np.array([math.hypot(*corridor.vector_m) for corridor in once]) / sight.cell_area_m2,
    )


def largest_over(
    value: Callable[[FloatArray], FloatArray], direction_rad: FloatArray, turn_rad: float
) -> tuple[float, float]:
    """Return the largest value of a function of the direction, and where it is taken.

    ``value`` takes and gives shape (k,) and repeats after ``turn_rad``. From the best local maxima on the set of
    directions given, golden sections go on in the intervals beside each; a peak that fits between two neighbours
    of the set and shows at neither can be missed.
    """
    place = np.unique(np.mod(direction_rad, turn_rad))
    found = value(place)
    peak = np.flatnonzero((found >= np.roll(found, 1)) & (found >= np.roll(found, -1)))
    peak = peak[np.argsort(-found[peak], kind="stable")[:_PEAKS]]
    best = peak[0]
    best_place, best_value = float(place[best]), float(found[best])
    before, after = np.roll(place, 1), np.roll(place, -1)
    before[0] -= turn_rad
    after[-1] += turn_rad
    # On either side of a node by itself: where it is a peak with a kink, both sides have their maximum in it.
    low, high = np.concatenate([before[peak], place[peak]]), np.concatenate([place[peak], after[peak]])
    inner = np.stack([high - _GOLDEN * (high - low), low + _GOLDEN * (high - low)])
    values = np.stack([value(inner[0]), value(inner[1])])
    for _ in range(_STEPS):
        right = values[1] > values[0]
        low, high = np.where(right, inner[0], low), np.where(right, high, inner[1])
        fresh = np.where(right, low + _GOLDEN * (high - low), high - _GOLDEN * (high - low))
        at_fresh = value(fresh)
        inner = np.where(right, [inner[1], fresh], [fresh, inner[0]])
        values = np.where(right, [values[1], at_fresh], [at_fresh, values[0]])
        top = int(np.argmax(at_fresh))
        if at_fresh[top] > best_value:
            best_place, best_value = float(fresh[top]), float(at_fresh[top])
    return best_value, best_place % turn_rad
