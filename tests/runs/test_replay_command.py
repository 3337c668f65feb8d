"""`layoutopt replay` from a log to fitted values, and from bad input to one message."""

import csv
import subprocess
import sys

import pytest
from command_line import called

from layoutopt.commissioning.drive_log import write_log
from layoutopt.estimators.odometry import OdometryAlone
from layoutopt.simulation.trials import record_trial
from layoutopt.spec.layout_file import read_filed_layout, read_layout, write_layout
from layoutopt.spec.reading import read_spec
from layoutopt.streams import Streams

FILES = ["fitted.toml", "fitted_layout.toml", "path.csv", "path.png", "path.svg"]


@pytest.fixture(scope="module")
def folder(tmp_path_factory, tiny_text):
    """Layout file and log of a simulated drive of a minute, with and without truth."""
    place = tmp_path_factory.mktemp("replay")
    (place / "tiny.toml").write_text(tiny_text.replace('duration = "15 s"', 'duration = "60 s"'), encoding="utf-8")
    spec = read_spec(place / "tiny.toml")
    layout = next(iter(spec.space.layouts()))
    write_layout(layout, spec, place / "layout.toml", quick_look=True)
    record = record_trial(layout, spec.design, OdometryAlone(), Streams(seed=8), 0)
    write_log(place / "drive.csv", record, layout=layout, tag_map=layout.floor_tags.lay_on(spec.site))
    rows = list(csv.reader((place / "drive.csv").read_text().splitlines()))
    keep = [column for column, name in enumerate(rows[0]) if not name.startswith("truth") and name != "scans"]
    bare = "\n".join(",".join(row[column] for column in keep) for row in rows) + "\n"
    (place / "bare.csv").write_text(bare)
    (place / "empty.csv").write_text("")
    (place / "bad.csv").write_text(bare.replace("reads", "read", 1))
    (place / "tags.csv").write_text(bare.replace(":", ":99", 1))
    return place


def in_a_process(folder, *arguments):
    return subprocess.run(
        [sys.executable, "-m", "layoutopt", "replay", *arguments],
        cwd=folder,
        capture_output=True,
        text=True,
        check=False,
        timeout=120,
    )


def test_a_log_with_truth_gives_path_values_and_figure(folder):
    """All files are there, lines tell the errors, and the layout file holds the fitted odometry and the mark."""
    done = called("replay", "drive.csv", "layout.toml", "--out", "truth", "--seed", "4", cwd=folder)
    assert done.returncode == 0, done.stderr
    assert "position error: mean" in done.stdout
    assert "seed 4" in done.stdout
    assert "fitted against the truth" in done.stdout
    assert sorted(path.name for path in (folder / "truth").iterdir()) == FILES
    spec, _ = read_layout(folder / "truth" / "fitted_layout.toml")
    assert spec.robot.odometry.translation_share == pytest.approx(0.02, rel=0.1)
    assert read_filed_layout(folder / "truth" / "fitted_layout.toml").quick_look


def test_a_log_without_truth_gives_the_same_bytes_twice(folder):
    """Odometry, reads and a layout are enough, and another process gives the same files."""
    first = called("replay", "bare.csv", "layout.toml", "--out", "first", cwd=folder)
    again = in_a_process(folder, "bare.csv", "layout.toml", "--out", "again")
    assert first.returncode == 0, first.stderr
    assert "start: not known" in first.stdout
    assert "fitted against the reads alone" in first.stdout
    assert first.stdout.replace("first/", "again/") == again.stdout
    for name in FILES:
        assert (folder / "first" / name).read_bytes() == (folder / "again" / name).read_bytes()


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("none.csv", "layout.toml"), ("none.csv", "there is no such file")),
        (("empty.csv", "layout.toml"), ("empty.csv", "the file is empty")),
        (("bad.csv", "layout.toml"), ("bad.csv:1 read", "Did you mean 'reads'?")),
        (("tags.csv", "layout.toml"), ("tags.csv:", "reads", "no tag")),
        (("layout.toml", "layout.toml"), ("layout.toml:",)),
        (("bare.csv", "tiny.toml"), ("tiny.toml", "no [layout]")),
        (("bare.csv", "layout.toml", "--estimator", "mcll"), ("--estimator", "Did you mean 'mcl'?")),
        (("bare.csv", "layout.toml", "--estimator", "odometry"), ("bare.csv", "--start")),
        (("bare.csv", "layout.toml", "--start", "1 2 3"), ("--start", "three parts")),
        (("bare.csv", "layout.toml", "--out", "bare.csv"), ("--out bare.csv", "is a file")),
        ((".", "layout.toml"), ("this is a folder",)),
    ],
)
def test_bad_input_ends_in_a_message_and_exit_2(folder, arguments, words):
    """Nothing is written, and the message names what is wrong and what would be right."""
    before = sorted(folder.iterdir())
    done = called("replay", *arguments, cwd=folder)
    assert done.returncode == 2, done.stderr
    assert not done.stdout
    assert "Traceback" not in done.stderr
    assert all(word in done.stderr for word in words), done.stderr
    assert sorted(folder.iterdir()) == before
