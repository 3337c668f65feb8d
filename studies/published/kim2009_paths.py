"""Ways of single drives after kim2009, Fig. 13: an empty room, rows of obstacles, obstacles at random."""

from dataclasses import replace
from functools import lru_cache
from typing import Final

import numpy as np

from layoutopt.plots.docking_paths import DockingPanel, draw_docking_paths
from layoutopt.scenario import Scenario
from layoutopt.simulation.docking import DockingOutcomes, follow
from layoutopt.simulation.docking_trials import docking_ground, docking_setting
from layoutopt.simulation.kim2009_rooms import ROOM_M, SCATTERERS_M
from layoutopt.streams import Streams
from studies.page import Picture, Section
from studies.published.kim2009_setting import (
    BUMPER,
    CORRECTED,
    GROUPS,
    MEASURED,
    estimators,
    layout,
    scenario,
)

_BLOCKING: Final = GROUPS["blocking"]
_SHOWN: Final = (MEASURED, CORRECTED, BUMPER)
_SEARCHED: Final = 100
"""Drives among which the first is sought in which only the correction docks."""


@lru_cache(maxsize=8)
def _driven(world: Scenario, name: str, streams: Streams, replication: int) -> DockingOutcomes:
    """Return one drive in full; the same that the trials of the study judge."""
    ground = docking_ground(layout(experiment=False), world)
    drawn = docking_setting(ground, world, streams, replication)
    return follow(
        ground,
        drawn.start_m[None],
        np.array([drawn.heading_rad]),
        drawn.scatterers_m[None],
        drawn.noise_rad[None],
        estimators()[name],
    )


def _telling_drive(world: Scenario, streams: Streams) -> int | None:
    """Return the first drive in which the measured direction fails and the corrected one docks, if any does."""
    for replication in range(_SEARCHED):
        measured, corrected = (_driven(world, name, streams, replication) for name in (MEASURED, CORRECTED))
        if not measured.docked[0] and corrected.docked[0]:
            return replication
    return None


def _panel(title: str, world: Scenario, streams: Streams, replication: int) -> DockingPanel:
    room = docking_ground(layout(experiment=False), world)
    paths_m = {}
    for name in _SHOWN:
        outcomes = _driven(world, name, streams, replication)
        paths_m[name] = outcomes.paths_m[0, : int(outcomes.steps[0]) + 1]
    return DockingPanel(
        title=title,
        bounds_m=ROOM_M,
        obstacles_m=docking_setting(room, world, streams, replication).scatterers_m,
        radius_m=room.world.scatterer_radius_m,
        transponder_m=room.transponder_m,
        stop_m=room.world.stop_m,
        paths_m=paths_m,
    )


def paths_section(streams: Streams) -> Section:
    """Return Fig. 13."""
    empty, random = (scenario(_BLOCKING.with_obstacles(count)) for count in (0, 9))
    rows = replace(empty, scatterers_m=np.array(SCATTERERS_M["c"]))
    telling = _telling_drive(random, streams)
    which = (
        f"In (c) the first drive too: in none of {_SEARCHED} the correction alone docks."
        if telling is None
        else "In (c) the first in which the correction docks and the measured direction does not (number "
        f"{telling}), as the paper shows one."
    )
    return Section(
        heading="Fig. 13: ways to the transponder",
        paragraphs=(
            "An empty room, the obstacles of Fig. 5(c), and nine at random, all of which block. In (a) and (b) "
            f"the first drive. {which} The paper's walls reflect by an unknown share; ours only stop robots.",
        ),
        parts=(
            Picture(
                name="paths",
                caption="Single drives, a mark at each reading; grey discs stop the robot, the dashed circle is "
                "where it has docked (paper: Fig. 13).",
                drawn=draw_docking_paths(
                    [
                        _panel("(a) empty", empty, streams, 0),
                        _panel("(b) rows", rows, streams, 0),
                        _panel("(c) at random", random, streams, telling or 0),
                    ]
                ),
            ),
        ),
    )
