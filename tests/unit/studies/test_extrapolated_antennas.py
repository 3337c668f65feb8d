"""Antennas beyond the two that were measured are marked in tables, in what is printed, and in scores."""

import csv

import pytest
from made_findings import findings_of, layout_of

from studies.answers import Scored
from studies.output import write_designs, write_front
from studies.summary import findings_lines


@pytest.mark.parametrize(("write", "rows"), [(write_designs, 4), (write_front, 2)])
def test_tables_mark_extrapolated_antennas(tmp_path, write, rows):
    """Those of 90 mm and no other."""
    path = tmp_path / "table.csv"
    write(findings_of(), path)
    with path.open(encoding="utf-8", newline="") as file:
        found = {row["label"]: row["extrapolated"] for row in csv.DictReader(file)}
    assert len(found) == rows
    assert all((answer == "yes") == ("× 90 mm" in label) for label, answer in found.items())
    assert "yes" in found.values()


def test_recommendations_mark_extrapolated_antennas():
    """The line stands below the recommended layout that it speaks of, and below no other."""
    lines = findings_lines(findings_of(), None)
    marked = [number for number, line in enumerate(lines) if "antenna model is extrapolated" in line]
    heads = [number for number, line in enumerate(lines) if line.startswith(("cheapest:", "knee, most accurate:"))]
    assert len(marked) == 1
    assert "90 mm" in lines[max(number for number in heads if number < marked[0])]


@pytest.mark.parametrize(("side_m", "extrapolated"), [(0.06, False), (0.09, True)])
def test_scores_mark_extrapolated_antennas(side_m, extrapolated):
    """For people and for programs."""
    scored = Scored(
        layout=layout_of(side_m, 0.1),
        seed=1,
        violations=(),
        exact={},
        simulated={},
        does_not_apply={},
        failures={},
    )
    assert scored.as_json()["extrapolated"] is extrapolated
    assert ("measure one before buying" in scored.as_text()) is extrapolated
