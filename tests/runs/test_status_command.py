"""How a study stands, from outside; what it tells while it runs; and limits that end it early."""

import contextlib
import json
import os
import shlex
import shutil
import signal
import tempfile
import time
from pathlib import Path

import filelock
import pytest
from small_studies import SPEC, SmallCells, begin_slow_cells, called, leave_out_drawings, register_cells

from layoutopt.journal import JOURNAL, LOCK, MANIFEST
from studies.status import FINISHED, RUNNING, STATUS, read_status

CELLS = ("study", "cells", "spec.toml", "--backend", "serial", "--out")
SNAPSHOT = {
    "round": str,
    "rounds": int,
    "trials": int,
    "trials_done": int,
    "trials_run": int,
    "trials_per_s": (float, type(None)),
    "left_s": (float, type(None)),
    "failures": dict,
    "best": str,
}
EVENTS = {
    "round": SNAPSHOT,
    "progress": SNAPSHOT,
    "failure": dict.fromkeys(("layout", "scenario", "estimator", "kind", "message"), str),
    "best": {"text": str},
    "note": {"text": str},
}


@pytest.fixture(autouse=True)
def quick_to_have(monkeypatch):
    """The study of one round is known to the command line, and no drawings are made."""
    register_cells(monkeypatch)
    leave_out_drawings(monkeypatch)


@pytest.fixture
def home(tmp_path):
    """A folder with the spec."""
    (tmp_path / "spec.toml").write_text(SPEC, encoding="utf-8")
    return tmp_path


@pytest.fixture(scope="module")
def once(tmp_path_factory):
    """A folder with the spec and a finished study, to be copied."""
    folder = tmp_path_factory.mktemp("once")
    (folder / "spec.toml").write_text(SPEC, encoding="utf-8")
    with pytest.MonkeyPatch.context() as monkeypatch:
        register_cells(monkeypatch)
        assert called(*CELLS, "out", cwd=folder).returncode == 0
    return folder


@pytest.fixture
def finished(once, home):
    """A folder with the spec and a finished study."""
    shutil.copytree(once / "out", home / "out")
    return home


def _status(folder, cwd):
    done = called("status", folder, cwd=cwd)
    assert done.returncode == 0, done.stderr
    return done.stdout.splitlines()


def _as_json(folder, cwd):
    done = called("status", folder, "--json", cwd=cwd)
    assert done.returncode == 0, done.stderr
    return json.loads(done.stdout, parse_constant=_refuse)


def _refuse(text):
    raise ValueError(text)


def _go_on(lines):
    (command,) = [line.partition("go on with: ")[2] for line in lines if "go on with: " in line]
    words = shlex.split(command)
    assert words[0] == "layoutopt"
    return words[1:]


def _checked_events(lines):
    """Return the events of lines of JSON, each with the fields that the guide names and no others."""
    events = [json.loads(line, parse_constant=_refuse) for line in lines]
    for event in events:
        fields = EVENTS[event["event"]]
        assert set(event) == {"event", *fields}
        assert all(isinstance(event[name], kind) for name, kind in fields.items())
    return events


def test_a_run_is_watched_killed_and_gone_on_with(home):
    """From another process a run is seen at work, then dead without a word; the command told goes on with it."""
    with (home / "stderr").open("wb") as told:
        process = begin_slow_cells(*CELLS[2:], "out", "--json-progress", cwd=home, stderr=told)
    try:
        for _ in range(600):
            if (home / "out" / JOURNAL).exists() and (home / "out" / JOURNAL).read_bytes().count(b"\n") > 3:
                break
            time.sleep(0.05)
        lines, found = _status("out", home), _as_json("out", home)
    finally:
        process.kill()
        process.wait()
    assert process.returncode == -signal.SIGKILL
    assert lines[0] == "out: study cells, seed 3: running"
    assert lines[1].startswith("  journal: ")
    assert lines[2].startswith("  round 1, 6 cells: ")
    assert "trials/s" in lines[3]
    assert "left in this round" in lines[3]
    assert lines[4].startswith("  last sign of life ")
    assert found["state"] == "running"
    assert found["last"]["process"] == process.pid
    assert found["tasks"] >= 3
    kinds = [event["event"] for event in _checked_events((home / "stderr").read_bytes().splitlines())]
    assert kinds[0] == "round"
    assert set(kinds) == {"round", "progress"}

    lines = _status("out", home)
    assert lines[0] == "out: study cells, seed 3: ended without a word"
    words = _go_on(lines)
    assert words[-1] == "--resume"
    assert called(*words, cwd=home).returncode == 0
    assert _status("out", home)[0] == "out: study cells, seed 3: finished"
    assert called(*CELLS, "one", cwd=home).returncode == 0
    assert (home / "out/cells.csv").read_bytes() == (home / "one/cells.csv").read_bytes()


def test_a_finished_study_says_so(finished):
    """State, tasks and trials of the journal stand in lines and in JSON, and nothing tells to go on."""
    before = {path: path.stat().st_mtime_ns for path in (finished / "out").rglob("*")}
    lines = _status("out", finished)
    assert lines[:4] == [
        "out: study cells, seed 3: finished",
        "  journal: 12 tasks, 120 trials",
        "  round 1, 6 cells: 120 of 120 trials of this run",
        "  best so far: 6 of 6 cells",
    ]
    assert "go on" not in "".join(lines)
    found = _as_json("out", finished)
    last = found.pop("last")
    assert found == {
        "folder": "out",
        "study": "cells",
        "seed": 3,
        "state": "finished",
        "tasks": 12,
        "trials": 120,
        "failures": {},
        "shards": {},
    }
    assert set(last) == {"state", "host", "process", "began", "written", "go_on", *SNAPSHOT}
    assert {path: path.stat().st_mtime_ns for path in (finished / "out").rglob("*")} == before


def test_failures_are_counted_by_kind(home, monkeypatch):
    """Failed tasks are told by kind: of the journal in the status, one by one and summed up in the progress."""
    monkeypatch.setattr(SmallCells, "faulty", True)
    done = called(*CELLS, "out", "--json-progress", cwd=home)
    assert done.returncode == 1
    assert _status("out", home)[1] == "  journal: 6 tasks, 60 trials; failed tasks: 6 raised an error"
    events = _checked_events(done.stderr.splitlines())
    failures = [event for event in events if event["event"] == "failure"]
    assert len(failures) == 6
    assert failures[0]["estimator"] == "midrange"
    assert failures[0]["message"].startswith("RuntimeError: a wheel came off")
    last = [event for event in events if event["event"] == "progress"][-1]
    assert last["failures"] == {"raised an error": 6}
    assert last["trials_done"] == last["trials"] == 120
    assert last["trials_run"] == 60


def test_progress_of_an_adaptive_study_is_json_line_by_line(home):
    """Rounds, progress and the best so far come as JSON; each round ends with all of its trials done."""
    study = ("study", "cost_vs_accuracy", "spec.toml", "--backend", "serial", "--out", "out")
    done = called(*study, "--json-progress", cwd=home)
    assert done.returncode == 0, done.stderr
    events = _checked_events(done.stderr.splitlines())
    rounds = [event for event in events if event["event"] == "round"]
    assert [event["rounds"] for event in rounds] == list(range(1, len(rounds) + 1))
    assert len(rounds) > 2
    ends = {event["rounds"]: event for event in events if event["event"] == "progress"}
    assert all(ends[event["rounds"]]["trials_done"] == event["trials"] for event in rounds)
    assert all(ends[event["rounds"]]["left_s"] == 0.0 for event in rounds)
    assert any(event["event"] == "best" and "EUR" in event["text"] for event in events)
    resumed = called(*study, "--json-progress", "--resume", cwd=home)
    assert {event["event"] for event in _checked_events(resumed.stderr.splitlines())} <= {"best"}


def test_a_note_is_json_too(finished):
    """A torn journal is told as an event of its own kind."""
    with (finished / "out" / JOURNAL).open("ab") as journal:
        journal.write(b'{"key"')
    done = called(*CELLS, "out", "--resume", "--json-progress", cwd=finished)
    (note,) = [event for event in _checked_events(done.stderr.splitlines()) if event["event"] == "note"]
    assert "torn" in note["text"]


def test_shards_stand_one_by_one(home):
    """Before, between and after merges the status of a folder holds that of its shards, and what is to be done."""
    assert called(*CELLS, "out", "--shard", "1/2", cwd=home).returncode == 0
    stopped = called(*CELLS, "out", "--shard", "2/2", "--time-limit", "1 ms", cwd=home)
    assert stopped.returncode == 3
    lines = _status("out", home)
    assert lines[:3] == [
        "out: study cells, seed 3: in shards",
        "  journal: 0 tasks, 0 trials",
        "  shard 1_of_2: finished, 6 tasks, 72 trials",
    ]
    assert lines[3] == "  shard 2_of_2: stopped, 0 tasks, 0 trials"
    assert "--shard 2/2" in lines[4]
    assert lines[5] == "  when no shard is left to run: layoutopt merge out"
    assert called("merge", "out", cwd=home).returncode == 3
    lines = _status("out", home)
    assert lines[:2] == ["out: study cells, seed 3: in shards", "  journal: 6 tasks, 72 trials"]
    assert _status("out/shards/1_of_2", home)[0] == "out/shards/1_of_2: study cells, seed 3: finished"
    assert called(*CELLS, "out", "--shard", "2/2", cwd=home).returncode == 0
    assert called("merge", "out", cwd=home).returncode == 0
    found = _as_json("out", home)
    assert (found["state"], found["tasks"]) == ("finished", 12)
    assert {name: shard["state"] for name, shard in found["shards"].items()} == {
        "1_of_2": "finished",
        "2_of_2": "finished",
    }


@pytest.mark.skipif(not hasattr(os, "seteuid"), reason="rights of a system with users")
def test_who_may_only_read_is_told_the_same(finished):
    """In a folder that may not be written, a finished study is seen, and one that is at work too."""
    with tempfile.TemporaryDirectory() as place:
        folder = Path(place) / "out"
        shutil.copytree(finished / "out", folder)
        for path in (Path(place), folder, *folder.iterdir()):
            path.chmod(0o555 if path.is_dir() else 0o444)
        # Whoever runs the study has more rights than who looks; without them this process cannot be both.
        two_users = os.geteuid() == 0
        with filelock.FileLock(folder / LOCK) if two_users else contextlib.nullcontext(), _nobody():
            at_work = read_status(folder)
        with _nobody():
            assert not os.access(folder / STATUS, os.W_OK, effective_ids=True)
            after = read_status(folder)
        for path in (Path(place), folder):
            path.chmod(0o755)
    assert at_work.state == (RUNNING if two_users else FINISHED)
    assert (after.state, after.tasks) == (FINISHED, 12)


@contextlib.contextmanager
def _nobody():
    """Give up the right to write everything, if this process has it."""
    before = os.geteuid()
    if before == 0:
        os.seteuid(65534)
    try:
        yield
    finally:
        os.seteuid(before)


@pytest.mark.parametrize("place", ["nowhere", "empty", "spec.toml"])
def test_what_is_no_study_ends_with_exit_2(home, place):
    """A folder without a study, none at all, or a file is named."""
    (home / "empty").mkdir()
    done = called("status", place, cwd=home)
    assert done.returncode == 2
    assert done.stderr.startswith(place)
    assert done.stderr.count("\n") == 1


@pytest.mark.parametrize(
    "content",
    [
        b"",
        b"{",
        b"[]",
        b"null",
        b"\xff\xfe",
        b'{"state": 7, "rounds": {"a": 1}, "round": [1], "written": "yesterday", "go_on": 4}',
        b'{"written": 1e999, "left_s": 1e999}',
        b'{"trials_per_s": NaN, "state": "running"}',
        b'{"written": 1' + b"0" * 400 + b"}",
        b'{"round": "\\ud800", "best": "\\u001b[2J"}',
        b"[" * 100_000,
    ],
    ids=range(11),
)
def test_a_status_file_with_anything_in_it_breaks_nothing(finished, content):
    """Whatever stands in the file of the last run, journal and manifest are told, as lines and as JSON."""
    (finished / "out" / STATUS).write_bytes(content)
    assert _status("out", finished)[1] == "  journal: 12 tasks, 120 trials"
    assert _as_json("out", finished)["tasks"] == 12


@pytest.mark.parametrize(
    "content", [b"", b"[]", b"{}", b'{"seed": "three"}', b"\xff", b"[" * 100_000], ids=range(6)
)
def test_a_broken_manifest_is_told(finished, content):
    """A manifest that is none ends with one line and exit 2."""
    (finished / "out" / MANIFEST).write_bytes(content)
    done = called("status", "out", cwd=finished)
    assert done.returncode == 2
    assert done.stderr.startswith("out/manifest.json: ")
    assert done.stderr.count("\n") == 1


def test_a_limit_on_trials_ends_at_the_same_trial_and_is_gone_on_with(home):
    """As many tasks as fit are run, exit 3 says how to go on, and that command has the bytes of one run."""
    assert called(*CELLS, "one", cwd=home).returncode == 0
    for folder in ("out", "twin"):
        done = called(*CELLS, folder, "--max-trials", 50, cwd=home)
        assert done.returncode == 3
        assert done.stderr.splitlines()[-2].startswith("stopped by --max-trials 50: the same trials count")
        assert _status(folder, home)[:2] == [
            f"{folder}: study cells, seed 3: stopped",
            "  journal: 4 tasks, 40 trials",
        ]
        assert not (home / folder / "cells.csv").exists()
    words = _go_on(done.stderr.splitlines())
    assert words == _go_on(_status("twin", home))
    assert called(*words, cwd=home).returncode == 0
    assert (home / "twin/cells.csv").read_bytes() == (home / "one/cells.csv").read_bytes()


def test_a_limit_on_time_says_that_it_cannot_be_had_again_and_is_gone_on_with(home, monkeypatch):
    """After its time a study ends with exit 3 and a warning; gone on with to its end it has the same bytes."""
    assert called(*CELLS, "one", cwd=home).returncode == 0
    monkeypatch.setattr(SmallCells, "pause_s", 0.005)
    done = called(*CELLS, "out", "--time-limit", "300 ms", cwd=home)
    assert done.returncode == 3
    told = done.stderr.splitlines()
    assert "--time-limit after 0.3 s" in told[-2]
    assert "cannot be had again" in told[-2]
    assert 0 < _as_json("out", home)["tasks"] < 12
    for _ in range(12):
        done = called(*_go_on(done.stderr.splitlines()), cwd=home)
        if done.returncode != 3:
            break
    assert done.returncode == 0
    assert (home / "out/cells.csv").read_bytes() == (home / "one/cells.csv").read_bytes()


@pytest.mark.parametrize("option", [("--time-limit", "0 s"), ("--time-limit", "soon"), ("--max-trials", "0")])
def test_a_limit_that_is_none_is_refused(home, option):
    """A limit of nothing, or in no unit of time, ends with exit 2 before anything is made."""
    done = called(*CELLS, "out", *option, cwd=home)
    assert done.returncode == 2
    assert option[0] in done.stderr
    assert not (home / "out").exists()
