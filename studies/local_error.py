"""Where on the floor the recommended layout errs, over the held-out drives that judged it."""

from pathlib import Path
from typing import Final

import numpy as np

from layoutopt.error_map import ErrorMap
from layoutopt.simulation.local_error import simulated_error_map
from layoutopt.streams import Streams
from layoutopt.tables.cells import write_csv
from studies.columns import named, number
from studies.findings import Findings

MOST_DRIVES: Final = 200
"""The first so many of the held-out drives are simulated again, which takes some seconds."""


def local_error_of(findings: Findings, streams: Streams) -> ErrorMap | None:
    """Return where the estimator of the search errs with the first recommended layout in a held-out world.

    The world is the first one, and the drives are the first of those that judged the layout there, so that the map
    shows what the tables state; ``None`` if there was none.
    """
    main = next(iter(findings.result.recommended.values()), None)
    if main is None or not findings.problem.held_out:
        return None
    scenario, estimator = findings.problem.held_out[0], findings.problem.estimators[0]
    judged = [
        row.scores["position_error_mean"].count
        for row in findings.validations
        if (row.layout_key, row.scenario, row.estimator) == (main.layout.key, scenario.name, estimator.name)
        and row.scores is not None
    ]
    if not judged:
        return None
    return simulated_error_map(main.layout, scenario, estimator, streams, min(MOST_DRIVES, judged[0]))


def write_local_error(found: ErrorMap, path: Path) -> None:
    """Write a row for each cell into which a drive came: its corners, drives, mean error and standard error."""
    header = ["xmin_m", "ymin_m", "xmax_m", "ymax_m", "drives", "certain"]
    header += named("position_error_mean", "m")
    certain = found.certain
    rows = []
    for column, line in zip(*np.nonzero(found.drives), strict=True):
        low_m = np.array(found.origin_m) + np.array([column, line]) * found.cell_m
        rows.append(
            [
                *(number(float(end)) for end in (*low_m, *(low_m + found.cell_m))),
                str(found.drives[column, line]),
                "yes" if certain[column, line] else "no",
                number(float(found.mean_m[column, line])),
                number(float(found.standard_error_m[column, line])),
            ]
        )
    write_csv(path, header, rows)
