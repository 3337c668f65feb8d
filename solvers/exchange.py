"""From shares to antennas: rounding, exchanges that improve, and which of equally good groups to take."""

from collections.abc import Iterator
from typing import Final

import numpy as np

from layoutopt.identity import FloatArray, IntArray
from solvers.antenna_slots import Packing, ReaderSlots, arranged, most_that_fit
from solvers.information import Merit

EQUAL: Final = 1e-9
"""Merits nearer than this are equal: a hundred times what sums in another order differ by."""
_LEAST_SHARE: Final = 1e-6
"""Of a place that a relaxation left out, so that random rounding may take it all the same."""

Group = tuple[int, ...]


def rounded(shares: FloatArray, packing: Packing, starts: int, seed: int) -> Iterator[Group]:
    """Yield groups of the packing's count: the largest shares that go together, then random ones by share.

    A random one takes places one after the other with a chance in proportion to their shares, among those that go
    with what it has (drawn as by Efraimidis and Spirakis, Inf. Process. Lett. 97, 2006). One that comes to an
    end before it is full is left out.
    """
    draws = np.random.Generator(np.random.Philox(seed))
    share = np.maximum(np.round(shares, 6), _LEAST_SHARE)
    orders = [np.argsort(-share, kind="stable")]
    orders += [np.argsort(np.log(draws.random(len(share))) / -share, kind="stable") for _ in range(starts)]
    for order in orders:
        group = _packed(order, packing)
        if len(group) == packing.count:
            yield group


def _packed(order: IntArray, packing: Packing) -> Group:
    group: list[int] = []
    for place in order:
        if len(group) == packing.count:
            break
        if not packing.conflicts[place, group].any() and packing.within([*group, int(place)]):
            group.append(int(place))
    return tuple(sorted(group))


def exchanged(
    group: Group, information: FloatArray, slots: ReaderSlots, packing: Packing, merit: Merit
) -> tuple[Group, float]:
    """Return the group that no exchange of one antenna betters, and its merit.

    The best exchange is made as long as there is one (Fedorov, Theory of Optimal Experiments, 1972, Chapter 3).
    As the merit is concave, one that gains nothing along the slope cannot gain at all and is not computed.
    """
    chosen = list(group)
    total = information[chosen].sum(axis=0)
    value = float(merit(total))
    while True:
        gain = np.einsum("ij,nij->n", merit.slope(total), information)
        outside = np.setdiff1d(np.arange(len(slots)), chosen)
        clashes = packing.conflicts[outside][:, chosen]
        free = clashes.sum(axis=1)[:, None] - clashes == 0
        better = (gain[outside][:, None] - gain[chosen][None, :] > EQUAL) & free
        entering, leaving = np.nonzero(better)
        if not len(entering):
            return tuple(sorted(chosen)), value
        values = merit(total + information[outside[entering]] - information[np.array(chosen)[leaving]])
        for best in np.argsort(-np.round(values, 10), kind="stable"):
            if not values[best] > value + EQUAL:
                return tuple(sorted(chosen)), value
            trial = [*chosen]
            trial[leaving[best]] = int(outside[entering[best]])
            if arranged(slots, packing, trial) is not None:
                chosen = sorted(trial)
                total = information[chosen].sum(axis=0)
                value = float(merit(total))
                break
        else:
            return tuple(sorted(chosen)), value


def best_group(
    shares: FloatArray,
    information: FloatArray,
    slots: ReaderSlots,
    packing: Packing,
    merit: Merit,
    *,
    starts: int,
    seed: int,
) -> tuple[Group, float] | None:
    """Return the best group that exchanges reach from rounded shares, and its merit; ``None`` if none is found.

    Where rounding fills no group, an integer program gives one to start from. Of groups equally good the one that
    is its own mirror image is taken, then that of the earliest places.
    """
    first = dict.fromkeys(rounded(shares, packing, starts, seed))
    begun = [group for group in first if arranged(slots, packing, group) is not None]
    if not begun:
        packed = most_that_fit(slots, packing).chosen
        if len(packed) == packing.count and arranged(slots, packing, packed) is not None:
            begun = [packed]
    reached = dict(exchanged(group, information, slots, packing, merit) for group in begun)
    for group in _mirrored_halves(tuple(reached), slots, packing.count):
        if group not in reached and arranged(slots, packing, group) is not None:
            reached.update([exchanged(group, information, slots, packing, merit)])
            reached.setdefault(group, float(merit(information[list(group)].sum(axis=0))))
    if not reached:
        return None
    top = max(reached.values())
    ties = [group for group, value in reached.items() if value >= top - EQUAL]
    group = min(ties, key=lambda group: (not is_mirrored(group, slots), group))
    return group, reached[group]


def is_mirrored(group: Group, slots: ReaderSlots) -> bool:
    """Return whether a group is the same left and right."""
    mirror = slots.mirrored
    return {int(mirror[place]) for place in group} == set(group)


def _mirrored_halves(groups: tuple[Group, ...], slots: ReaderSlots, count: int) -> list[Group]:
    """Return the groups made of one half of a group and its mirror image, where these have as many antennas."""
    mirror, across_m = slots.mirrored, np.round(slots.xy_m[:, 1], 9)
    found: dict[Group, None] = {}
    for group in groups:
        for side in (1.0, -1.0):
            half = [place for place in group if side * across_m[place] >= 0.0]
            whole = {*half, *(int(mirror[place]) for place in half)}
            if len(whole) == count and -1 not in whole:
                found[tuple(sorted(whole))] = None
    return list(found)
