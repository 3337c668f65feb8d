"""When a tag appears to an antenna or vanishes from it, and where it then lies: on the edge of the read disc."""

import numpy as np

from layoutopt.estimators.evidence import ReadColumns
from layoutopt.identity import FloatArray
from layoutopt.protocols import FloorKnowledge
from layoutopt.readings import Observations


def antenna_ways_m(increments: FloatArray, antenna_m: FloatArray) -> FloatArray:
    """Return how far antennas, shape (antennas, 2), move in each step, shape (steps, antennas), to first order."""
    turn_rad = increments[:, 2, None]
    return np.hypot(
        increments[:, 0, None] - turn_rad * antenna_m[:, 1], increments[:, 1, None] + turn_rad * antenna_m[:, 0]
    )


def crossings_of(
    observations: Observations, knowledge: FloorKnowledge, reads: ReadColumns
) -> tuple[ReadColumns, FloatArray, FloatArray]:
    """Return every appearance and disappearance of a tag, and the ring in which it then lies.

    A tag that an antenna reads, but did not in its scan before, lies within the disc by no more than the antenna
    has moved since; one that it has just ceased to read lies beyond it by no more.
    """
    active = np.asarray(observations.active)
    steps, antennas = active.shape
    reached_m = np.concatenate(
        [
            np.zeros((1, antennas)),
            np.cumsum(antenna_ways_m(observations.increments, knowledge.antennas.xy_m), axis=0),
        ]
    )
    index = np.arange(steps)[:, None]
    # The scan before step i, and the one after: -1 and ``steps`` where there is none.
    before = np.maximum.accumulate(np.where(active, index, -1), axis=0)
    before = np.concatenate([np.full((1, antennas), -1), before[:-1]])
    after = np.minimum.accumulate(np.where(active, index, steps)[::-1], axis=0)[::-1]
    after = np.concatenate([after[1:], np.full((1, antennas), steps)])
    seen = {*zip(reads.step.tolist(), reads.antenna.tolist(), reads.tag.tolist(), strict=True)}
    rows: list[tuple[int, int, int, float, float]] = []
    for step, antenna, tag in sorted(seen):
        radius_m = float(knowledge.antennas.radius_m[antenna])
        last, following = int(before[step, antenna]), int(after[step, antenna])
        if last >= 0 and (last, antenna, tag) not in seen:
            way_m = float(reached_m[step + 1, antenna] - reached_m[last + 1, antenna])
            rows.append((step, antenna, tag, max(radius_m - way_m, 0.0), radius_m))
        if following < steps and (following, antenna, tag) not in seen:
            way_m = float(reached_m[following + 1, antenna] - reached_m[step + 1, antenna])
            rows.append((following, antenna, tag, radius_m, radius_m + way_m))
    table = np.array(sorted(rows), dtype=np.float64).reshape(-1, 5)
    columns = table[:, :3].astype(np.int64)
    return (
        ReadColumns(
            step=columns[:, 0],
            antenna=columns[:, 1],
            tag=columns[:, 2],
            start=np.searchsorted(columns[:, 0], np.arange(steps + 1)).astype(np.int64),
        ),
        table[:, 3],
        table[:, 4],
    )
