"""The main command end to end on the tiny site: what it leaves, and that it leaves the same every time."""

import csv
import json
import math
import os
import re
import shutil
import subprocess
import sys

import pytest
from command_line import called
from golden_study import EXACT, SIMULATED, UNITS, golden, golden_rows
from small_studies import SPEC, TABLES, leave_out_drawings

from layoutopt.spec.layout_file import read_layout
from layoutopt.spec.reading import read_spec


def _run(*arguments, cwd, check=True):
    done = called(*arguments, cwd=cwd)
    if check:
        assert done.returncode == 0, done.stdout + done.stderr
    return done


def _rows(path):
    with path.open(encoding="utf-8", newline="") as file:
        return list(csv.DictReader(file))


@pytest.fixture(scope="module")
def finished(tmp_path_factory, tiny_text):
    """A finished study of the tiny spec, run with one worker from a folder of its own."""
    home = tmp_path_factory.mktemp("study")
    (home / "tiny.toml").write_text(tiny_text, encoding="utf-8")
    done = _run("study", "cost_vs_accuracy", "tiny.toml", "--out", "out", "--jobs", 1, cwd=home)
    return home, done


def test_the_target_is_met_and_said_so(finished):
    """The first line is the status, recommended layouts follow with held-out errors and their uncertainty."""
    _, done = finished
    lines = done.stdout.splitlines()
    assert lines[0] == "A layout meets every limit at the stated confidence on held-out drives."
    assert any(line.startswith("cheapest: ring 4") for line in lines)
    assert "±" in done.stdout
    assert "(n = 40)" in done.stdout
    assert "seed 3" in done.stdout


def test_the_folder_holds_what_was_promised(finished):
    """Frozen spec, manifest, journal, tables, layouts, figures, report and drawings are there and not empty."""
    home, _ = finished
    expected = ["spec.toml", "manifest.json", "results.jsonl", "report.html", "local_error.csv", *TABLES]
    expected += [
        f"figures/{name}.{kind}"
        for name in ("front", "layout", "error_over_time", "local_error")
        for kind in ("svg", "png")
    ]
    drawing = ("sheet.pdf", "sheet.svg", "sheet.dxf", "tags.csv", "readers.yaml", "bill_of_material.csv")
    expected += [
        f"recommended/{role}/{name}" for role in ("cheapest", "knee", "most_accurate") for name in drawing
    ]
    for name in expected:
        assert (home / "out" / name).stat().st_size > 0, name
    assert not list((home / "out").rglob("*.part"))


def test_tables_agree_with_each_other(finished):
    """The front is part of the designs, with the same scores; every layout of the space has a row."""
    home, _ = finished
    designs = {row["layout"]: row for row in _rows(home / "out/designs.csv")}
    front = _rows(home / "out/front.csv")
    assert len(designs) == read_spec(home / "tiny.toml").problem().space.size == 12
    assert front
    for row in front:
        assert designs[row["layout"]]["on_front"] == "yes"
        assert designs[row["layout"]]["cost_eur"] == row["cost_eur"]
        assert designs[row["layout"]]["position_error_mean_m"] == row["position_error_mean_m"]
    costs = [float(row["cost_eur"]) for row in front]
    errors = [float(row["position_error_mean_m"]) for row in front]
    assert costs == sorted(costs)
    assert errors == sorted(errors, reverse=True)


def test_refused_layouts_say_why(finished):
    """A layout that cannot be built names profile and rule, and was not simulated."""
    home, _ = finished
    refused = [row for row in _rows(home / "out/designs.csv") if row["refusal"]]
    assert refused
    for row in refused:
        assert "cannot be built under profile 'commercial'" in row["refusal"]
        assert row["trials"] == "0"


def test_references_are_never_members_of_the_front(finished):
    """The eight published layouts stand in a table of their own."""
    home, _ = finished
    references = _rows(home / "out/references.csv")
    assert len(references) == 8
    assert {row["antennas"] for row in references} == {"8", "20", "24", "96"}
    assert not {row["layout"] for row in references} & {row["layout"] for row in _rows(home / "out/designs.csv")}


def test_layout_files_read_back_as_the_same_layout(finished):
    """A layout file alone gives the layout whose key it is named after."""
    home, _ = finished
    for path in (home / "out/layouts").iterdir():
        _, layout = read_layout(path)
        assert layout.short_key == path.stem


def test_the_bill_adds_up_to_the_cost(finished):
    """The lines of the bill of material sum to the cost of the table, to the cent."""
    home, _ = finished
    recommended = {row["recommended_as"]: row for row in _rows(home / "out/front.csv")}
    bill = _rows(home / "out/recommended/most_accurate/bill_of_material.csv")
    lines = [float(row["total_eur"]) for row in bill if row["item"] != "total"]
    assert sum(lines) == pytest.approx(float(recommended["most accurate"]["cost_eur"]), abs=0.005)


def test_the_golden_study_comes_out_again(finished):
    """On any platform the same layouts stand on the front, and scores agree to 1e-8 or within three errors."""
    home, _ = finished
    rows, kept = golden_rows(home / "out"), golden()
    words = ("table", "scenario", "estimator", "layout", "trials", "on_front")
    assert [[row[name] for name in words] for row in rows] == [[row[name] for name in words] for row in kept]
    for row, old in zip(rows, kept, strict=True):
        for name in EXACT:
            assert _number(row[name]) == pytest.approx(_number(old[name]), rel=1e-8, nan_ok=True), (row, name)
        for name in SIMULATED:
            value, error = f"{name}_{UNITS[name]}", f"{name}_se_{UNITS[name]}"
            # A last bit that differs may send a particle, and so a drive, elsewhere.
            within = 3.0 * math.hypot(_number(row[error]), _number(old[error]))
            assert _number(row[value]) == pytest.approx(_number(old[value]), abs=within, nan_ok=True), (row, name)


def _number(cell):
    return float(cell) if cell else math.nan


def test_a_finished_study_resumes_to_the_same_bytes_without_a_trial(finished, monkeypatch):
    """--resume on a finished folder runs nothing and writes the same tables."""
    leave_out_drawings(monkeypatch)
    home, _ = finished
    before = {name: (home / "out" / name).read_bytes() for name in (*TABLES, "results.jsonl")}
    _run("study", "cost_vs_accuracy", "tiny.toml", "--out", "out", "--jobs", 1, "--resume", cwd=home)
    assert {name: (home / "out" / name).read_bytes() for name in before} == before


def test_a_study_is_not_overwritten_by_accident(finished):
    """Without --resume a folder that holds a study is refused, exit 2."""
    home, _ = finished
    done = _run("study", "cost_vs_accuracy", "tiny.toml", "--out", "out", cwd=home, check=False)
    assert done.returncode == 2
    assert "--resume" in done.stderr


def test_score_draw_and_reprice_work_on_the_results(finished):
    """The short commands answer from the study's own files."""
    home, _ = finished
    layout = sorted((home / "out/layouts").iterdir())[0]
    scored = json.loads(_run("score", layout, "--json", "--trials", 2, "--jobs", 1, cwd=home).stdout)
    assert scored["layout"].startswith(layout.stem)
    assert scored["exact"]["cost"]["count"] == 0
    assert all(entry["scores"]["position_error_mean"]["count"] == 2 for entry in scored["simulated"])
    _run("draw", layout, "--out", "drawn", cwd=home)
    assert (home / "drawn/sheet.dxf").exists()
    (home / "cheap.toml").write_text(
        'schema = 1\nbase = "default-2026"\nname = "cheap"\ndate = "2026-11-22"\n'
        '[items.label]\nprice = "0.01 EUR"\nsource = "a test"\ndate = "2026-11-22"\n'
    )
    before = float(_rows(home / "out/front.csv")[0]["cost_eur"])
    repriced = _run("reprice", "out", "cheap.toml", "--out", "new.csv", cwd=home).stdout
    assert "most accurate: " in repriced
    assert "under the new prices; not validated anew" in repriced
    assert float(_rows(home / "new.csv")[0]["cost_eur"]) < before


@pytest.fixture
def small(tmp_path):
    """A folder with a spec of three layouts, for commands that search anew."""
    (tmp_path / "small.toml").write_text(SPEC, encoding="utf-8")
    return tmp_path


def test_solve_writes_a_layout_that_meets_its_target(small):
    """`solve --target-error` writes a layout file that can be scored."""
    done = _run("solve", "small.toml", "--target-error", "65 mm", "--out", "found.toml", "--jobs", 2, cwd=small)
    assert "wrote found.toml" in done.stdout
    _, layout = read_layout(small / "found.toml")
    assert layout.short_key in done.stdout


def test_a_target_that_nothing_meets_ends_with_exit_1_and_the_shortfall(small):
    """A hundredth of a millimetre is not met; the message names limit, value and nearest layout."""
    done = _run("solve", "small.toml", "--target-error", "0.01 mm", "--jobs", 2, cwd=small, check=False)
    assert done.returncode == 1
    assert "No layout of the design space was shown to meet every limit." in done.stdout
    assert "Shortfall: nearest is" in done.stdout


def test_a_budget_below_the_cheapest_ends_with_exit_1_before_any_trial(finished):
    """Ten euros buy nothing; the message says what is missing, and no folder is made."""
    home, _ = finished
    done = _run("solve", "tiny.toml", "--budget", "10 EUR", cwd=home, check=False)
    assert done.returncode == 1
    assert "more than the budget of 10.00 EUR" in done.stdout


@pytest.mark.long
def test_reprice_agrees_with_a_fresh_study_after_the_budget_changed(finished):
    """Left-over trials of an earlier, larger run are not used: replay asks for what the study asks for."""
    home, _ = finished
    text = (home / "tiny.toml").read_text(encoding="utf-8")
    (home / "more.toml").write_text(text.replace("validation_trials = 40", "validation_trials = 60"))
    _run("study", "cost_vs_accuracy", "more.toml", "--out", "grown", "--jobs", 2, cwd=home, check=False)
    _run("study", "cost_vs_accuracy", "tiny.toml", "--out", "grown", "--jobs", 2, "--resume", cwd=home)
    (home / "same.toml").write_text('schema = 1\nbase = "default-2026"\nname = "same"\ndate = "2026-11-22"\n')
    _run("reprice", "grown", "same.toml", "--out", "grown.csv", cwd=home)
    _run("reprice", "out", "same.toml", "--out", "plain.csv", cwd=home)
    assert (home / "grown.csv").read_bytes() == (home / "plain.csv").read_bytes()


def test_reprice_refuses_an_unfinished_study(finished):
    """A folder whose journal lacks trials is told to be finished first."""
    home, _ = finished
    (home / "half").mkdir()
    for name in ("spec.toml", "manifest.json"):
        (home / "half" / name).write_bytes((home / "out" / name).read_bytes())
    lines = (home / "out/results.jsonl").read_bytes().splitlines(keepends=True)
    (home / "half/results.jsonl").write_bytes(b"".join(lines[: len(lines) // 2]))
    (home / "same.toml").write_text('schema = 1\nbase = "default-2026"\nname = "same"\ndate = "2026-11-22"\n')
    done = _run("reprice", "half", "same.toml", cwd=home, check=False)
    assert done.returncode == 2
    assert "not finished" in done.stderr


def test_a_full_folder_is_not_continued_as_a_quick_look(finished):
    """A folder of a full run is refused for a quick one, because it belongs to another question."""
    home, _ = finished
    done = _run(
        "study", "cost_vs_accuracy", "tiny.toml", "--out", "out", "--quick", "--resume", cwd=home, check=False
    )
    assert done.returncode == 2
    assert "quick" in done.stderr


def test_drawings_of_a_layout_that_is_no_longer_recommended_go(finished):
    """Resumed with a target that nothing meets, a folder keeps no drawing of the former cheapest layout."""
    home, _ = finished
    shutil.copytree(home / "out", home / "stale")
    text = (home / "tiny.toml").read_text(encoding="utf-8")
    (home / "hard.toml").write_text(text.replace('target_error = "30 mm"', 'target_error = "1 mm"'))
    done = _run("study", "cost_vs_accuracy", "hard.toml", "--out", "stale", "--resume", cwd=home, check=False)
    assert done.returncode == 1, done.stderr
    assert not (home / "stale/recommended/cheapest").exists()
    assert (home / "stale/recommended/knee/sheet.pdf").exists()


def test_a_terminal_without_our_signs_breaks_nothing(finished):
    """Where the console knows neither ± nor a narrow space, something else is printed."""
    home, _ = finished
    layout = sorted((home / "out/layouts").iterdir())[0]
    done = subprocess.run(
        [sys.executable, "-m", "layoutopt", "score", layout, "--trials", "2", "--jobs", "1"],
        cwd=home,
        env={**os.environ, "PYTHONIOENCODING": "ascii"},
        capture_output=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    told = done.stdout.decode("ascii")
    assert re.search(r"cost +1\?\d{3}\.\d\d EUR", told)
    assert re.search(r"position_error_mean +[0-9.]+ \? [0-9.]+ mm", told)
