"""How much the robots of a layout use each of its tags: counted on simulated drives, without any estimator."""

from dataclasses import dataclass

import numpy as np

from layoutopt.identity import FloatArray
from layoutopt.layout import Layout
from layoutopt.scenario import Scenario
from layoutopt.simulation.motion import drive
from layoutopt.simulation.sensing import observe
from layoutopt.streams import Streams


@dataclass(frozen=True, slots=True, kw_only=True)
class TagUse:
    """What each tag of a map brings, in the order of the map, as means over the same drives.

    Attributes
    ----------
    reads
        Times that it is read in a drive, shape (n,).
    alone
        Steps of a drive in which it is the only tag that is read, shape (n,).
    drives
        Number of drives.
    """

    reads: FloatArray
    alone: FloatArray
    drives: int


def tag_use(layout: Layout, scenario: Scenario, streams: Streams, first: int, drives: int) -> TagUse:
    """Return the use of each tag on replications ``first`` to ``first + drives - 1``."""
    tag_map = layout.floor_tags.lay_on(scenario.site)
    reads, alone = np.zeros(len(tag_map)), np.zeros(len(tag_map))
    for replication in range(first, first + drives):
        driven = drive(scenario, streams, replication)
        seen = observe(driven, layout, scenario, tag_map, streams, replication)
        known = seen.read_tag >= 0
        step = np.repeat(np.arange(len(seen.increments)), np.diff(seen.read_start))[known]
        tag = seen.read_tag[known]
        reads += np.bincount(tag, minlength=len(tag_map))
        pairs = np.unique(np.column_stack([step, tag]), axis=0)
        steps, counts = np.unique(pairs[:, 0], return_counts=True)
        only = np.isin(pairs[:, 0], steps[counts == 1])
        alone += np.bincount(pairs[only, 1], minlength=len(tag_map))
    return TagUse(reads=reads / drives, alone=alone / drives, drives=drives)
