"""Where one antenna is, from the set of tags that it reads: midrange, centroid, and the best possible."""

from collections.abc import Callable, Mapping
from typing import Final

import numpy as np

from layoutopt.circles import Circle, feasible_circle
from layoutopt.detection import bucket_grid
from layoutopt.identity import FloatArray
from layoutopt.protocols import FloorKnowledge


def midrange_m(tags_m: FloatArray) -> FloatArray:
    """Return the middle of the extreme tag places, shape (n, 2), in x and in y (han2006, Eq. 9-10)."""
    return np.asarray((tags_m.max(axis=0) + tags_m.min(axis=0)) / 2.0)


def centroid_m(tags_m: FloatArray) -> FloatArray:
    """Return the mean of the tag places, shape (n, 2)."""
    return np.asarray(tags_m.mean(axis=0))


POINT_ESTIMATORS: Final[Mapping[str, Callable[[FloatArray], FloatArray]]] = {
    "midrange": midrange_m,
    "centroid": centroid_m,
}
PLACES: Final = (*POINT_ESTIMATORS, "minimax")


class ReaderPlace:
    """Places of one antenna from sets of tags, with what is left open; sets that come again are remembered.

    Parameters
    ----------
    knowledge
        Map and antennas; only the first antenna counts.
    place
        ``"midrange"``, ``"centroid"`` or ``"minimax"``: the centre of the smallest circle round all places at
        which the tags read lie within the disc and no other tag does.
    """

    def __init__(self, knowledge: FloorKnowledge, place: str) -> None:
        self._tags_m = knowledge.tags.xy_m
        self._radius_m = float(knowledge.antennas.radius_m[0])
        self._grid = bucket_grid(self._tags_m, 2.0 * self._radius_m)
        self._place = place
        self._known: dict[frozenset[int], tuple[FloatArray, float]] = {}

    def of(self, tags: frozenset[int]) -> tuple[FloatArray, float]:
        """Return the place, m, and the variance of its error along an axis, m².

        The antenna may be anywhere in the circle of `feasible_circle`: a uniform place in it has a quarter of its
        squared radius as variance, about its centre. Where missed or wrong reads leave no such place the tags
        that are silent do not count, and where even the tags read contradict each other the whole disc is open.
        """
        if tags not in self._known:
            self._known[tags] = self._of(tags)
        return self._known[tags]

    def _of(self, tags: frozenset[int]) -> tuple[FloatArray, float]:
        read = np.array(sorted(tags))
        read_m = self._tags_m[read]
        circle = self._circle(read, read_m)
        if circle is None:
            estimate = POINT_ESTIMATORS.get(self._place, centroid_m)
            return estimate(read_m), self._radius_m**2 / 4.0
        centre_m = np.array(circle.centre_m)
        if self._place == "minimax":
            return centre_m, circle.radius_m**2 / 4.0
        estimate_m = POINT_ESTIMATORS[self._place](read_m)
        return estimate_m, circle.radius_m**2 / 4.0 + float(((estimate_m - centre_m) ** 2).sum()) / 2.0

    def _circle(self, read: FloatArray, read_m: FloatArray) -> Circle | None:
        near = self._grid.near((float(read_m[0, 0]), float(read_m[0, 1])), 2.0 * self._radius_m)
        silent_m = self._tags_m[np.setdiff1d(near, read)]
        circle = feasible_circle(read_m, silent_m, self._radius_m)
        return circle or feasible_circle(read_m, np.empty((0, 2)), self._radius_m)
