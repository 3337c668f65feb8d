"""A published study from the command line: what it leaves, and that it goes on where it stopped."""

import csv
import subprocess
import sys

import pytest
from command_line import called

TABLES = ("tables_2_and_4", "table_3", "tables_5_and_6", "arrays", "ratios", "speeds")
FIGURES = ("ratios_table_2", "ratios_table_4", "ratios_real", "antenna_reach", "speed", "paths")


def _run(*arguments, cwd):
    done = called("study", *arguments, cwd=cwd)
    assert done.returncode == 0, done.stdout + done.stderr
    return done


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    """A quick run of the mi2016 study."""
    home = tmp_path_factory.mktemp("published")
    return home, _run("published/mi2016", "--quick", "--jobs", 1, cwd=home)


def test_it_tells_how_well_the_paper_comes_out(finished):
    """The summary names tables and counts, and where the report is; a quick look says that it is one."""
    home, done = finished
    assert "QUICK LOOK" in done.stdout
    assert "Tables 2 and 4: of 48 mean errors" in done.stdout
    assert "of the 18 means of the other six rows" in done.stdout
    assert "report: out/published/mi2016_quick/report.html" in done.stdout.replace("\\", "/")
    assert (home / "out/published/mi2016_quick/report.html").exists()


def test_the_folder_holds_tables_figures_and_journal(finished):
    """Every figure is there as SVG and PNG, and every table has its lines."""
    home, _ = finished
    folder = home / "out/published/mi2016_quick"
    expected = [f"figures/{name}.{kind}" for name in FIGURES for kind in ("svg", "png")]
    expected += [f"tables/{name}.csv" for name in TABLES]
    for name in ("spec.toml", "manifest.json", "results.jsonl", *expected):
        assert (folder / name).stat().st_size > 0, name
    with (folder / "tables/tables_2_and_4.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    assert len(rows) == 16 * 3 * 3
    assert all(float(row["ours_low"]) < float(row["ours"]) < float(row["ours_high"]) for row in rows)


def test_a_finished_study_resumes_to_the_same_bytes(finished):
    """--resume, in another process, runs no trial again and writes the same; without it the folder is refused."""
    home, _ = finished
    folder = home / "out/published/mi2016_quick"
    names = ["report.html", "results.jsonl", *(f"tables/{name}.csv" for name in TABLES)]
    before = {name: (folder / name).read_bytes() for name in names}
    command = [
        sys.executable,
        "-m",
        "layoutopt",
        "study",
        "published/mi2016",
        "--quick",
        "--jobs",
        "1",
        "--resume",
    ]
    subprocess.run(command, cwd=home, check=True, capture_output=True, timeout=280)
    assert {name: (folder / name).read_bytes() for name in names} == before
    refused = called("study", "published/mi2016", "--quick", cwd=home)
    assert refused.returncode == 2
    assert "--resume" in refused.stderr


def test_a_folder_belongs_to_one_study(finished, tiny_spec):
    """Another study does not write into the folder, and there is no front to price anew in it."""
    home, _ = finished
    folder = home / "out/published/mi2016_quick"
    other = called("study", "cost_vs_accuracy", tiny_spec, "--quick", "--resume", "--out", folder, cwd=home)
    assert other.returncode == 2
    assert "study is 'published/mi2016', now 'cost_vs_accuracy'" in other.stderr
    prices = home / "prices.toml"
    prices.write_text('schema = 1\nbase = "default-2026"\nname = "same"\ndate = "2026-11-22"\n')
    priced = called("reprice", folder, prices, cwd=home)
    assert priced.returncode == 2
    assert "has no front of costs" in priced.stderr


def test_the_list_names_published_studies(tmp_path):
    """`study list` shows name and question; a mistyped name is answered with the nearest."""
    assert "published/mi2016: " in _run("list", cwd=tmp_path).stdout
    wrong = called("study", "published/mi2015", cwd=tmp_path)
    assert wrong.returncode == 2
    assert "published/mi2016" in wrong.stderr


def test_a_dry_run_says_what_would_run(tmp_path):
    """Numbers of trials and minutes, and nothing is written."""
    done = _run("published/mi2016", "--dry-run", "--jobs", 2, cwd=tmp_path)
    assert "simulated tables:" in done.stdout
    assert "predicted:" in done.stdout
    assert not (tmp_path / "out").exists()


@pytest.mark.long
def test_two_workers_give_the_same_bytes(finished):
    """Tables and report do not depend on the number of workers."""
    home, _ = finished
    folder = home / "out/published/mi2016_quick"
    _run("published/mi2016", "--quick", "--jobs", 2, "--out", "two", cwd=home)
    for name in ("report.html", *(f"tables/{name}.csv" for name in TABLES)):
        assert (home / "two" / name).read_bytes() == (folder / name).read_bytes(), name
