"""A reader that brings one tag a scan, although several lie in its field (han2006, Fig. 3)."""

from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from typing import ClassVar

import numpy as np

from layoutopt.identity import by_content
from layoutopt.protocols import Estimator, EstimatorCard, FloorKnowledge, RunningEstimator
from layoutopt.readings import (
    UNKNOWN_TAG,
    Estimate,
    Motion,
    Observations,
    Prior,
    Reading,
    TagRead,
    Trajectory,
)
from studies.published.before_another import BeforeAnother

CARD = EstimatorCard(
    summary="Another estimator that hears one tag a scan: the next one that was not yet heard.",
    reference="han2006, Fig. 3",
    estimates="robot",
    needs="tag_read",
)


@by_content
@dataclass(frozen=True, slots=True, kw_only=True, eq=False)
class OneByOne(BeforeAnother):
    """An estimator behind a reader that tells tags one after another.

    Each scan tells one tag in the field that was not told since the field was last read empty; a scan that has
    none left tells nothing, and all are told anew. The order is that of the tag map; an identity that the map does
    not hold is none that could be told. Steps between scans, of which there are some where a scan takes longer
    than a step, tell nothing and leave all as it is.
    """

    inner: Estimator
    key: str = field(init=False, repr=False, default="")
    card: ClassVar[EstimatorCard] = CARD

    def __post_init__(self) -> None:
        """Nothing to check."""

    def start(self, prior: Prior, knowledge: FloorKnowledge, draws: np.random.Generator) -> RunningEstimator:
        """Return the estimator at work."""
        return _Running(self.inner.start(prior, knowledge, draws), knowledge)

    def run(
        self, prior: Prior, knowledge: FloorKnowledge, observations: Observations, draws: np.random.Generator
    ) -> Trajectory:
        """Return the estimates of a whole drive."""
        teller = _Teller(knowledge)
        kept: list[int] = []
        start = np.zeros_like(observations.read_start)
        for step in range(len(observations)):
            rows = range(int(observations.read_start[step]), int(observations.read_start[step + 1]))
            chosen = teller.step({int(observations.read_tag[row]): row for row in rows})
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

    def __init__(self, inner: RunningEstimator, knowledge: FloorKnowledge) -> None:
        self._inner = inner
        self._teller = _Teller(knowledge)

    def step(self, motion: Motion, readings: Sequence[Reading]) -> Estimate:
        """Take one step with the next tag."""
        reads = {read.tag: row for row, read in enumerate(readings) if isinstance(read, TagRead)}
        chosen = self._teller.step(reads)
        return self._inner.step(motion, () if chosen is None else (readings[chosen],))


class _Teller:
    """Chooses the tag that each scan of the first antenna tells."""

    def __init__(self, knowledge: FloorKnowledge) -> None:
        self._period = int(knowledge.antennas.period_steps[0])
        self._phase = int(knowledge.antennas.phase_steps[0])
        self._step = -1
        self._told: set[int] = set()

    def step(self, rows: dict[int, int]) -> int | None:
        """Return the row of the next tag not told yet; none where all were, to begin anew, or between scans."""
        self._step += 1
        known = {tag: row for tag, row in rows.items() if tag != UNKNOWN_TAG}
        if not known and self._step % self._period != self._phase:
            return None
        fresh = sorted(tag for tag in known if tag not in self._told)
        if not fresh:
            self._told.clear()
            return None
        self._told.add(fresh[0])
        return known[fresh[0]]
