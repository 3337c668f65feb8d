"""The independent check of a placement: fresh runs, every tag tried with every antenna, nothing but numpy."""

import math
from dataclasses import dataclass, field
from typing import Final

import numpy as np

from layoutopt.identity import FloatArray, IntArray
from layoutopt.protocols import Antennas
from layoutopt.scores import Score
from solvers.demands import Demand, Runs, share_by_draw

_MOST_PAIRS: Final = 4_000_000
"""Pairs of antenna way and tag that are compared at once; bounds memory."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Missed:
    """How many of so many fresh random runs saw fewer tags than demanded.

    ``by_draw`` is the mean over independent draws, along routes the routes, of the share that missed: its bound
    counts draws, since runs of one route are alike. ``None`` if the robot has no room for any run.
    """

    demand: Demand
    count: int
    runs: int
    by_draw: Score | None = field(default=None, repr=False)

    @property
    def draws(self) -> int:
        """Number of independent draws: routes along routes, else runs."""
        return 0 if self.by_draw is None else self.by_draw.count

    @property
    def share(self) -> float:
        """Share of the runs that missed their demand, mean over draws; NaN without runs."""
        return math.nan if self.by_draw is None else self.by_draw.value

    @property
    def upper(self) -> float:
        """Upper bound of the share among all runs at 95 %, as of `Score`: exact where runs are draws."""
        return 1.0 if self.by_draw is None else self.by_draw.upper()


def missed_share(demand: Demand, runs: Runs, antennas: Antennas, xy_m: FloatArray) -> Missed:
    """Return how many of some runs miss a demand with tags at the given places, shape (n, 2), m."""
    short = tags_in_view(runs, antennas, xy_m) < demand.tags
    by_draw = share_by_draw(runs.some(short), runs) if len(runs) else None
    return Missed(demand=demand, count=int(short.sum()), runs=len(runs), by_draw=by_draw)


def tags_in_view(runs: Runs, antennas: Antennas, xy_m: FloatArray) -> IntArray:
    """Return how many tags come nearer than its radius to some antenna on each run, shape (runs,)."""
    found = np.zeros(len(runs), dtype=np.int64)
    block = max(1, _MOST_PAIRS // max(len(xy_m), 1))
    for first in range(0, len(runs), block):
        poses, way_m = runs.poses[first : first + block], runs.way_m[first : first + block]
        seen = np.zeros((len(poses), len(xy_m)), dtype=np.bool_)
        for (forward_m, left_m), radius_m in zip(antennas.xy_m, antennas.radius_m, strict=True):
            cos, sin = np.cos(poses[:, 2]), np.sin(poses[:, 2])
            x_m = poses[:, 0] + cos * forward_m - sin * left_m
            y_m = poses[:, 1] + sin * forward_m + cos * left_m
            seen |= _squared_distance(x_m, y_m, way_m, xy_m) < radius_m**2
        found[first : first + block] = seen.sum(axis=1)
    return found


def _squared_distance(x_m: FloatArray, y_m: FloatArray, way_m: FloatArray, xy_m: FloatArray) -> FloatArray:
    """Return the squared distance of every tag from every way, shape (ways, tags): from its nearest point."""
    across_m, up_m = xy_m[None, :, 0] - x_m[:, None], xy_m[None, :, 1] - y_m[:, None]
    squared_m2 = (way_m**2).sum(axis=1)[:, None]
    along = across_m * way_m[:, :1] + up_m * way_m[:, 1:]
    share = np.clip(np.divide(along, squared_m2, out=np.zeros_like(along), where=squared_m2 > 0.0), 0.0, 1.0)
    return np.asarray((across_m - share * way_m[:, :1]) ** 2 + (up_m - share * way_m[:, 1:]) ** 2)
