"""The map of errors of a study is of the drives that judged its first recommended layout."""

import csv
import dataclasses

import numpy as np
from made_findings import findings_of

import layoutopt as lo
from layoutopt.error_map import ErrorMap
from studies import local_error


def test_it_takes_the_drives_of_the_first_recommended_layout_and_at_most_two_hundred(monkeypatch):
    """Layout, world and estimator are those of the first row of its validation, and so is the number of drives."""
    asked = []
    monkeypatch.setattr(local_error, "simulated_error_map", lambda *given: asked.append(given))
    findings, streams = findings_of(), lo.Streams(seed=1)
    local_error.local_error_of(findings, streams)
    main = next(iter(findings.result.recommended.values()))
    scenario, estimator = findings.problem.held_out[0], findings.problem.estimators[0]
    counts = [
        row.scores["position_error_mean"].count
        for row in findings.validations
        if row.layout_key == main.layout.key and row.scenario == scenario.name and row.estimator == estimator.name
    ]
    assert asked == [(main.layout, scenario, estimator, streams, min(200, counts[0]))]


def test_without_held_out_drives_there_is_none():
    bare = dataclasses.replace(findings_of(), validations=())
    assert local_error.local_error_of(bare, lo.Streams(seed=1)) is None


def test_the_table_has_a_row_for_each_cell_into_which_a_drive_came(tmp_path):
    found = ErrorMap(
        origin_m=(-1.0, 0.0),
        cell_m=0.5,
        drives=np.array([(9, 0), (1, 0)]),
        mean_m=np.array([(0.01, np.nan), (0.02, np.nan)]),
        standard_error_m=np.array([(0.001, np.nan), (np.nan, np.nan)]),
        drive_count=9,
    )
    local_error.write_local_error(found, tmp_path / "local_error.csv")
    with (tmp_path / "local_error.csv").open(encoding="utf-8", newline="") as file:
        head, *rows = csv.reader(file)
    assert head[:6] == ["xmin_m", "ymin_m", "xmax_m", "ymax_m", "drives", "certain"]
    assert head[6:] == ["position_error_mean_m", "position_error_mean_se_m"]
    assert rows == [
        ["-1", "0", "-0.5", "0.5", "9", "yes", "0.01", "0.001"],
        ["-0.5", "0", "0", "0.5", "1", "no", "0.02", ""],
    ]
