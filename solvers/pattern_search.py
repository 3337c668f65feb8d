"""Search for tag patterns: k tags on a tile that repeats in bond, by descents from many random starts.

A pattern is a rectangular tile with k tags that is laid side by side, each row of tiles moved on against the one
below. Its unknowns are the shape of the tile, that shift, the places of all tags but the first, which is where the
frame begins, and, where axes count, the tilt of the whole floor. Every lattice is among these patterns (k = 1),
and every periodic pattern is as near to one as one likes.

Exact objectives make a descent possible: means over direction are smooth, and a power mean stands in for a worst
direction, which is not. Many starts, because there are many valleys; only the best of them go on after the first
descent.
"""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Final

import numpy as np

from layoutopt.geometry import turned
from layoutopt.identity import FloatArray
from layoutopt.layout import TagPattern
from layoutopt.patterns.listed import listed

_LARGEST_ASPECT: Final = 3.0
"""Of a tile: three copies of any side by side, or one above the other, are such a tile again."""
_TOO_CLOSE: Final = 10.0
"""Cost of each least spacing by which the nearest two tags lie too close. In the last stage in proportion, so that
the spacing is kept; before it as the square, without a kink, so that tags find round each other."""
_STEP: Final = 1e-4
_ITERATIONS: Final = 40
_LAST_ITERATIONS: Final = 80
_LEAST_CROWDING: Final = 0.05
"""A kink is met to the step of the differences only: half a per cent of the least spacing may be lacking."""

Value = Callable[[TagPattern], float]


@dataclass(frozen=True, slots=True, kw_only=True)
class PatternSpace:
    """Patterns of ``count`` tags a tile at a density, no two tags closer than ``least_spacing_m``.

    ``tilted`` patterns have the angle of the tiles to the axes of the floor as an unknown more, for whatever goes
    by these axes.

    Raises
    ------
    ValueError
        If there is no tag, or the density or spacing is not positive.
    """

    count: int
    density_per_m2: float
    least_spacing_m: float
    tilted: bool = False

    def __post_init__(self) -> None:
        """Check the numbers."""
        if self.count < 1:
            raise ValueError(f"a tile needs at least one tag, got {self.count}")
        if not (self.density_per_m2 > 0.0 and self.least_spacing_m > 0.0):
            raise ValueError("density and least spacing must be positive")

    @property
    def dimensions(self) -> int:
        """Number of unknowns: shape of the tile and shift, between 0 and 1, then tilt and places, which repeat."""
        return 2 * self.count + self.tilted

    def tilt_rad(self, unknowns: FloatArray) -> float:
        """Return the angle of the tiles to the floor's x axis, within half a turn."""
        return math.pi * float(unknowns[2] % 1.0) if self.tilted else 0.0

    def pattern(self, unknowns: FloatArray, grid_m: float = 0.0) -> TagPattern:
        """Return the pattern of unknowns, shape (dimensions,), in the axes of its tiles.

        With a grid, sides, shift and places are on it; sides are rounded so that there are no more tags per area.

        Raises
        ------
        ValueError
            If two tags share a place.
        """
        area_m2 = self.count / self.density_per_m2
        width_m = math.sqrt(area_m2) * _LARGEST_ASPECT ** (unknowns[0] - 0.5)
        height_m = area_m2 / width_m
        shift_m = (unknowns[1] - 0.5) * width_m
        places = unknowns[2 + self.tilted :].reshape(-1, 2)
        points_m = np.concatenate([[(0.5, 0.5)], places % 1.0]) * (width_m, height_m)
        if grid_m > 0.0:
            width_m = round(width_m / grid_m) * grid_m
            height_m = math.ceil(area_m2 / width_m / grid_m - 1e-9) * grid_m
            shift_m = round(shift_m / grid_m) * grid_m
            points_m = np.round(points_m / grid_m) * grid_m
        return listed(
            points_m=[(float(x), float(y)) for x, y in points_m],
            cell_m=(float(width_m), float(height_m)),
            shift_m=float(shift_m),
        )

    def laid(self, unknowns: FloatArray, grid_m: float = 0.0) -> TagPattern:
        """Return the pattern in the axes of the floor, shape and errors as `pattern`."""
        return laid_at(self.pattern(unknowns, grid_m), self.tilt_rad(unknowns))

    def repeated(self, unknowns: FloatArray, times: int) -> FloatArray:
        """Return the unknowns, of a space of ``times`` as many tags, whose tile is so many of these tiles.

        They lie side by side if they are higher than wide, else one above the other: for up to three the shape
        stays within its limits, so that this is the same pattern.
        """
        pattern = self.pattern(unknowns)
        assert pattern.cell_m is not None
        (width_m, _), (shift_m, height_m) = pattern.cell_m.tolist()
        upright = height_m >= width_m
        step_m = np.array([(width_m, 0.0), (shift_m, height_m)][0 if upright else 1])
        points_m = (pattern.points_m + np.arange(times)[:, None, None] * step_m).reshape(-1, 2)
        width_m, height_m = (times * width_m, height_m) if upright else (width_m, times * height_m)
        shift_m = shift_m if upright else times * shift_m
        # The first tag is in the middle of its tile; the frame of the larger tile begins where it is so there.
        shares = ((points_m - points_m[0]) / (width_m, height_m) + 0.5)[1:]
        # What a row up moves to the side is counted from the frame too.
        rows = np.floor(shares[:, 1])
        shares = shares - np.stack([rows * shift_m / width_m, rows], axis=1)
        shape = math.log(width_m / height_m) / math.log(_LARGEST_ASPECT) / 2.0 + 0.5
        tilt = [unknowns[2]] if self.tilted else []
        return np.concatenate(
            [[min(max(shape, 0.0), 1.0), (shift_m / width_m + 0.5) % 1.0], tilt, (shares % 1.0).ravel()]
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class FoundPattern:
    """The best pattern of a search: its unknowns, its value, and how many patterns were evaluated."""

    unknowns: FloatArray
    value: float
    evaluated: int


def laid_at(pattern: TagPattern, angle_rad: float) -> TagPattern:
    """Return a periodic pattern turned counter-clockwise, as the floor sees one that is laid at an angle.

    Raises
    ------
    ValueError
        If the pattern is laid once.
    """
    if pattern.cell_m is None:
        raise ValueError("does not apply, because the pattern is laid once and has no period")
    if angle_rad == 0.0:
        return pattern
    return TagPattern(
        name=pattern.name,
        points_m=turned(pattern.points_m, angle_rad),
        cell_m=turned(pattern.cell_m, angle_rad),
        parameters=pattern.parameters,
    )


def search_pattern(
    stages: Sequence[Value],
    judge: Value,
    space: PatternSpace,
    *,
    starts: int,
    kept: int,
    seed: int,
    known: Sequence[FloatArray] = (),
) -> FoundPattern:
    """Return the best pattern that descents from random starts reach, and from patterns that are known.

    Parameters
    ----------
    stages
        What to descend on, one after the other; smooth, and of a size of about one.
    judge
        What counts in the end.
    starts, kept, seed
        Number of random starts, how many of them go on after the first stage, and the seed of the starts: the same
        seed gives the same pattern.
    known
        Unknowns of patterns to start from as well; they all go on.

    Raises
    ------
    ValueError
        If there is no stage or start or none is kept, or none reached a pattern with enough room between its tags.

    References
    ----------
    Byrd, Lu, Nocedal and Zhu, SIAM J. Sci. Comput. 16, 1995 (L-BFGS-B), with differences for derivatives.
    """
    if not (stages and 1 <= kept <= starts):
        raise ValueError(f"a search needs a stage and keeps 1 to all of its starts, got {kept} of {starts}")
    descent = _Descent(space)
    draws = np.random.Generator(np.random.Philox(seed))
    places = [draws.random(space.dimensions) for _ in range(starts)]
    reached = sorted((descent(place, stages[0]) for place in places), key=lambda item: item[0])[:kept]
    reached += [descent(place, stages[0]) for place in known]
    for stage in stages[1:]:
        reached = [descent(place, stage) for _, place in reached]
    reached = [descent(place, stages[-1], last=True) for _, place in reached]
    found = [
        (judge(space.laid(place)), place)
        for place in [*(place for _, place in reached), *known]
        if descent.crowding(space.laid(place)) <= _LEAST_CROWDING
    ]
    if not found:
        raise ValueError("no start led to a pattern with enough room between its tags")
    value, unknowns = min(found, key=lambda item: item[0])
    return FoundPattern(unknowns=unknowns, value=value, evaluated=descent.evaluated + len(found))


class _Descent:
    """Descends within a space of patterns, and counts how many it looks at."""

    def __init__(self, space: PatternSpace) -> None:
        self._space = space
        self._bounds = [(0.0, 1.0)] * 2 + [(None, None)] * (space.dimensions - 2)
        self.evaluated = 0

    def __call__(self, start: FloatArray, stage: Value, *, last: bool = False) -> tuple[float, FloatArray]:
        """Return the cost and the unknowns that a descent from a start reaches; the last one keeps the spacing."""
        from scipy.optimize import minimize

        done = minimize(
            self._cost,
            start,
            args=(stage, last),
            method="L-BFGS-B",
            bounds=self._bounds,
            options={"maxiter": _LAST_ITERATIONS if last else _ITERATIONS, "eps": _STEP},
        )
        return float(done.fun), np.asarray(done.x, dtype=np.float64)

    def crowding(self, pattern: TagPattern) -> float:
        """Return the cost of tags that lie too close."""
        return _TOO_CLOSE * max(0.0, 1.0 - pattern.minimum_spacing_m() / self._space.least_spacing_m)

    def _cost(self, unknowns: FloatArray, stage: Value, last: bool) -> float:
        self.evaluated += 1
        try:
            pattern = self._space.laid(unknowns)
        except ValueError:
            return 2.0 * _TOO_CLOSE  # two tags share a place
        crowding = self.crowding(pattern)
        return stage(pattern) + (crowding if last else crowding**2 / _TOO_CLOSE)
