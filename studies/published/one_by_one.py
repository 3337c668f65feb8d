"""A reader that brings one tag a scan, although several lie in its field (han2006, Fig. 3)."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import ClassVar

import numpy as np

from layoutopt.identity import by_content
from layoutopt.layout import Layout
from layoutopt.protocols import Estimator, EstimatorCard, FloorKnowledge, RunningEstimator
from layoutopt.readings import Estimate, Motion, Observations, Prior, Reading, TagRead, Trajectory

CARD = EstimatorCard(
    summary="Another estimator that hears one tag a scan: the next one that was not yet heard.",
    reference="han2006, Fig. 3",
    estimates="robot",
    needs="tag_read",
)


@by_content
@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class OneByOne:
    """An estimator behind a reader that tells tags one after another.

    Each scan tells one tag in the field that was not told since the field was last read empty; a scan that has
    none left tells nothing, and all are told anew. The order is that of the tag map.
    """

    inner: Estimator
    key: str = field(init=False, repr=False, default="")
    card: ClassVar[EstimatorCard] = CARD

    def __post_init__(self) -> None:
        """Nothing to check."""

    @property
    def name(self) -> str:
        """Name of the estimator within."""
        return self.inner.name

    def applies(self, layout: Layout) -> str:
        """Return why the estimator within cannot work with a layout, or an empty string."""
        return self.inner.applies(layout)

    def start(self, prior: Prior, knowledge: FloorKnowledge, draws: np.random.Generator) -> RunningEstimator:
        """Return the estimator at work."""
        return _Running(self.inner.start(prior, knowledge, draws))

    def run(
        self, prior: Prior, knowledge: FloorKnowledge, observations: Observations, draws: np.random.Generator
    ) -> Trajectory:
        """Return the estimates of a whole drive."""
        told: set[int] = set()
        kept: list[int] = []
        start = np.zeros_like(observations.read_start)
        for step in range(len(observations)):
            rows = range(int(observations.read_start[step]), int(observations.read_start[step + 1]))
            chosen = _next({int(observations.read_tag[row]): row for row in rows}, told)
            kept += [] if chosen is None else [chosen]
            start[step + 1] = len(kept)
        thinned = replace(
            observations,
            read_start=start,
            read_antenna=observations.read_antenna[kept],
            read_tag=observations.read_tag[kept],
        )
        return self.inner.run(prior, knowledge, thinned, draws)


class _Running:
    """The estimator within at work, told one tag a scan."""

    def __init__(self, inner: RunningEstimator) -> None:
        self._inner = inner
        self._told: set[int] = set()

    def step(self, motion: Motion, readings: Sequence[Reading]) -> Estimate:
        """Take one step with the next tag."""
        reads = {read.tag: row for row, read in enumerate(readings) if isinstance(read, TagRead)}
        chosen = _next(reads, self._told)
        return self._inner.step(motion, () if chosen is None else (readings[chosen],))


def _next(rows: dict[int, int], told: set[int]) -> int | None:
    """Return the row of the next tag that was not told, and note it; none where all were told, to begin anew."""
    fresh = sorted(tag for tag in rows if tag not in told)
    if not fresh:
        told.clear()
        return None
    told.add(fresh[0])
    return rows[fresh[0]]
