"""Simulated drives, reduced to where on the floor they err."""

from collections.abc import Iterator

import numpy as np

from layoutopt.error_map import ErrorMap, error_map
from layoutopt.identity import FloatArray
from layoutopt.layout import Layout
from layoutopt.protocols import Estimator
from layoutopt.scenario import Scenario
from layoutopt.simulation.outcomes import counted_steps
from layoutopt.simulation.trials import record_trial
from layoutopt.streams import Streams


def simulated_error_map(
    layout: Layout,
    scenario: Scenario,
    estimator: Estimator,
    streams: Streams,
    count: int,
    *,
    cell_m: float | None = None,
) -> ErrorMap:
    """Return where an estimator errs in replications 0 to ``count - 1``, over the steps that `run_trials` judges.

    Parameters
    ----------
    cell_m
        Side of a cell, m; by default `layoutopt.error_map.cell_side_m`.

    Raises
    ------
    InvalidInput
        If the estimator cannot work with the layout, or nothing of a trial is judged.
    """
    drives = list(_drives(layout, scenario, estimator, streams, count))
    return error_map(scenario.site, drives, cell_m=cell_m)


def _drives(
    layout: Layout, scenario: Scenario, estimator: Estimator, streams: Streams, count: int
) -> Iterator[tuple[FloatArray, FloatArray]]:
    for replication in range(count):
        record = record_trial(layout, scenario, estimator, streams, replication)
        counted = counted_steps(record.drive.poses, scenario)
        places_m = record.drive.poses[1:, :2][counted]
        off_m = record.trajectory.poses[counted, :2] - places_m
        yield places_m, np.hypot(off_m[:, 0], off_m[:, 1])
