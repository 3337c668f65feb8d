"""The numbers of a finished study that are kept in the repository, and the command that keeps them anew.

``python tests/golden_study.py FOLDER`` writes ``golden_study.csv`` from the folder of a study of the tiny spec in
``conftest.py``. Do that only when numbers are meant to change, and say so in the changelog.
"""

import csv
import sys
from pathlib import Path

GOLDEN = Path(__file__).with_name("golden_study.csv")
EXACT = ("cost_eur", "derived_half_gap_m", "expected_reads_per_m", "static_error_mean_m", "blind_run_p95_m")
SIMULATED = ("position_error_mean", "heading_error_mean")
UNITS = {"position_error_mean": "m", "heading_error_mean": "rad"}


def golden_rows(folder):
    """Return a row for each layout of the space and each validated one: what must not change unnoticed.

    Layouts stand by what they are, because a key is made of the last bits of sines and roots.
    """
    designs = _read(folder / "designs.csv")
    labels = {row["layout"]: row["label"] for row in designs}
    rows = []
    for row in designs:
        kept = {name: row[name] for name in ("trials", "on_front", *EXACT)}
        kept["layout"] = labels[row["layout"]]
        rows.append({"table": "designs", "scenario": "", "estimator": "", **kept, **_simulated(row)})
    for row in _read(folder / "validation.csv"):
        kept = {name: row[name] for name in ("scenario", "estimator", "trials")}
        kept["layout"] = labels[row["layout"]]
        rows.append({"table": "validation", **kept, "on_front": "", **dict.fromkeys(EXACT, ""), **_simulated(row)})
    return sorted(rows, key=lambda row: (row["table"], row["layout"], row["scenario"], row["estimator"]))


def golden():
    """Return the rows that are kept."""
    return _read(GOLDEN)


def _simulated(row):
    names = [f"{name}{end}_{UNITS[name]}" for name in SIMULATED for end in ("", "_se")]
    return {name: row[name] for name in names}


def _read(path):
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


if __name__ == "__main__":
    found = golden_rows(Path(sys.argv[1]))
    with GOLDEN.open("w", encoding="utf-8", newline="") as file:
        writer = csv.DictWriter(file, found[0], lineterminator="\n")
        writer.writeheader()
        writer.writerows(found)
