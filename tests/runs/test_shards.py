"""Studies in parts: shards that know nothing of each other, merged, are one undivided run, and faults are told."""

import json
import shutil

import pytest
from small_studies import SPEC, SmallCells, called, leave_out_drawings, register_cells, tables

from layoutopt.errors import InvalidInput
from layoutopt.journal import JOURNAL, MANIFEST
from studies.shards import Shard, parse_shard

CELLS = ("study", "cells", "spec.toml", "--backend", "serial", "--out")
ADAPTIVE = ("study", "cost_vs_accuracy", "spec.toml", "--backend", "serial", "--out")


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


def _shards(study, folder, count, cwd, *, numbers=None, more=()):
    for number in numbers or range(1, count + 1):
        done = called(*study, folder, "--shard", f"{number}/{count}", *more, cwd=cwd)
        assert done.returncode == 0, done.stderr
    return done


@pytest.mark.parametrize(
    "text", ["", "1", "0/2", "3/2", "1/0", "-1/2", "1/2/3", "1,5/2", "a/b", "1/2x", "01/2", "１/２", "1/9999999"]
)
def test_what_is_no_shard_is_refused(text):
    """A shard that does not exist, or something else, is told with what would be right."""
    with pytest.raises(InvalidInput, match=r"is no shard\. Write 1/16"):
        parse_shard(text)


def test_a_shard_is_read_with_blanks_around_it():
    """The two numbers are read, and name a folder."""
    assert parse_shard(" 3/16 ") == Shard(number=3, count=16)
    assert str(parse_shard("3/16")) == "shard 3 of 16"


@pytest.mark.parametrize("count", [1, 2, 5, 30])
def test_shards_share_every_task_once(count):
    """All shards of a number have all tasks together, and none twice."""
    tasks = tuple(range(12))
    shares = [Shard(number=number, count=count).share(tasks) for number in range(1, count + 1)]
    assert sorted(task for share in shares for task in share) == list(tasks)
    assert max(map(len, shares)) - min(map(len, shares)) <= 1


def test_a_wrong_shard_ends_with_exit_2_and_no_folder(home):
    """The command line says what is wrong before it makes anything."""
    done = called(*CELLS, "out", "--shard", "3/2", cwd=home)
    assert done.returncode == 2
    assert done.stderr == "--shard: '3/2' is no shard. Write 1/16 for the first of sixteen.\n"
    assert not (home / "out").exists()


def test_merged_shards_are_an_undivided_run(home):
    """A study of one round, run in three shards, has the table of one run and each task once."""
    assert called(*CELLS, "one", cwd=home).returncode == 0
    told = _shards(CELLS, "out", 3, home)
    assert "shard 3 of 3: 4 of 12 tasks of round '6 cells' are done" in told.stdout
    assert "layoutopt merge out" in told.stdout
    done = called("merge", "out", cwd=home)
    assert done.returncode == 0
    assert done.stdout.splitlines() == ["out: 12 tasks added from 3 shards", "6 cells"]
    assert (home / "out/cells.csv").read_bytes() == (home / "one/cells.csv").read_bytes()
    assert sorted(_keys(home / "out")) == sorted(_keys(home / "one"))


def test_a_study_merged_twice_stays_the_same(home):
    """A second merge adds nothing and writes the same; a shard finds nothing left to do."""
    _shards(CELLS, "out", 2, home)
    assert called("merge", "out", cwd=home).returncode == 0
    before = {name: (home / "out" / name).read_bytes() for name in ("cells.csv", JOURNAL, MANIFEST)}
    done = called("merge", "out", "out/shards/1_of_2", cwd=home)
    assert done.returncode == 0
    assert "0 tasks added from 2 shards" in done.stdout
    assert {name: (home / "out" / name).read_bytes() for name in before} == before
    assert "nothing is left to be run" in _shards(CELLS, "out", 2, home).stdout
    resumed = called(*CELLS, "out", "--resume", cwd=home)
    assert resumed.returncode == 0
    assert (home / "out" / JOURNAL).read_bytes() == before[JOURNAL]


def test_an_adaptive_study_goes_round_by_round(home):
    """Shards, merge, shards, merge until the merge ends with 0: the tables of an undivided run."""
    assert called(*ADAPTIVE, "one", cwd=home).returncode == 0
    rounds = []
    while not rounds or rounds[-1].returncode == 3:
        _shards(ADAPTIVE, "out", 2, home)
        rounds.append(called("merge", "out", cwd=home))
    assert rounds[-1].returncode == 0, rounds[-1].stderr
    assert len(rounds) > 2
    assert all("is open: " in done.stdout and "layoutopt merge out" in done.stdout for done in rounds[:-1])
    assert tables(home / "out") == tables(home / "one")
    assert sorted(_keys(home / "out")) == sorted(_keys(home / "one"))


@pytest.mark.long
def test_a_real_study_of_one_round_in_shards_has_the_same_report(home):
    """The comparison of patterns in two shards, one of them begun again, has the same tables and report."""
    study = ("study", "pattern_comparison", "spec.toml", "--quick", "--out")
    assert called(*study, "one", "--backend", "serial", cwd=home).returncode == 0
    _shards(study, "out", 2, home, numbers=(2, 1, 2), more=("--jobs", 1))
    assert called("merge", "out", cwd=home).returncode == 0
    for name in ("report.html", "tables/errors.csv", "tables/exact.csv"):
        assert (home / "out" / name).read_bytes() == (home / "one" / name).read_bytes(), name


def test_what_is_missing_is_said_with_exit_3(home):
    """Without the second of three shards the merge says whose tasks are missing, and it can be run later."""
    _shards(CELLS, "out", 3, home, numbers=(1, 3))
    done = called("merge", "out", cwd=home)
    assert done.returncode == 3
    assert done.stdout.splitlines() == [
        "out: 8 tasks added from 2 shards",
        "round '6 cells' is open: 4 of 12 tasks are missing, those of shard 2/3",
        "run these shards again, then: layoutopt merge out",
    ]
    assert not (home / "out/cells.csv").exists()
    _shards(CELLS, "out", 3, home, numbers=(2,))
    assert called("merge", "out", cwd=home).returncode == 0
    assert (home / "out/cells.csv").exists()


def test_a_shard_that_is_begun_again_goes_on(home):
    """Cut off in the middle of a line, a shard runs what is missing and keeps what it had."""
    _shards(CELLS, "out", 2, home)
    journal = home / "out/shards/1_of_2" / JOURNAL
    whole = journal.read_bytes()
    journal.write_bytes(whole[: len(whole) // 2])
    kept = len(_keys(journal.parent))
    told = _shards(CELLS, "out", 2, home, numbers=(1,))
    assert 0 < kept < 6
    assert f"{6 - kept} tasks" in told.stderr
    assert called("merge", "out", cwd=home).stdout.startswith("out: 12 tasks added from 2 shards")


def test_shards_in_different_folders_are_merged(home):
    """Shards that ran on machines without a common disk are named to the merge, or the folders that hold them."""
    assert called(*CELLS, "one", cwd=home).returncode == 0
    for number in (1, 2, 3):
        _shards(CELLS, f"machine_{number}", 3, home, numbers=(number,))
    done = called("merge", "all", "machine_1/shards/1_of_3", "machine_2", "machine_3", cwd=home)
    assert done.returncode == 0, done.stderr
    assert (home / "all/cells.csv").read_bytes() == (home / "one/cells.csv").read_bytes()
    assert (home / "all/spec.toml").read_bytes() == (home / "one/spec.toml").read_bytes()


def test_a_shard_that_is_being_written_is_merged_as_far_as_it_got(home):
    """A torn line at the end of a shard is left out, and left alone."""
    _shards(CELLS, "out", 2, home)
    journal = home / "out/shards/2_of_2" / JOURNAL
    torn = journal.read_bytes()[:-20]
    journal.write_bytes(torn)
    done = called("merge", "out", cwd=home)
    assert done.returncode == 3
    assert "1 of 12 tasks are missing, those of shard 2/2" in done.stdout
    assert journal.read_bytes() == torn


@pytest.mark.parametrize("change", [("seed = 3", "seed = 4"), ('duration = "4 s"', 'duration = "5 s"')])
def test_shards_of_another_study_are_refused(home, change):
    """A shard of another seed or spec is refused where it would begin, and by the merge."""
    (home / "other.toml").write_text(SPEC.replace(*change), encoding="utf-8")
    _shards(CELLS, "out", 2, home, numbers=(1,))
    other = ("study", "cells", "other.toml", "--backend", "serial", "--out")
    done = called(*other, "out", "--shard", "2/2", cwd=home)
    assert done.returncode == 2
    assert "belongs to another study" in done.stderr
    assert not (home / "out/shards/2_of_2").exists()
    _shards(other, "elsewhere", 2, home, numbers=(2,))
    merged = called("merge", "out", "elsewhere", cwd=home)
    assert merged.returncode == 2
    assert "belongs to another study" in merged.stderr
    assert "merge shards of one study only" in merged.stderr
    assert not (home / "out" / JOURNAL).exists()


def test_a_merge_does_not_mix_with_another_study_of_the_folder(home):
    """Where the folder holds an undivided study of another seed, its journal stays as it is."""
    (home / "other.toml").write_text(SPEC.replace("seed = 3", "seed = 4"), encoding="utf-8")
    assert called("study", "cells", "other.toml", "--backend", "serial", "--out", "out", cwd=home).returncode == 0
    before = (home / "out" / JOURNAL).read_bytes()
    _shards(CELLS, "elsewhere", 1, home)
    done = called("merge", "out", "elsewhere", cwd=home)
    assert done.returncode == 2
    assert "seed is 4, now 3" in done.stderr
    assert (home / "out" / JOURNAL).read_bytes() == before


def test_quick_and_full_shards_do_not_mix(home):
    """A shard of a quick look is refused among those of the full study, and merged it gives a quick look."""
    _shards(CELLS, "quick", 1, home, more=("--quick",))
    _shards(CELLS, "out", 2, home, numbers=(1,))
    done = called("merge", "out", "quick", cwd=home)
    assert done.returncode == 2
    assert "belongs to another study" in done.stderr
    again = called(*CELLS, "out", "--shard", "1/2", "--quick", cwd=home)
    assert again.returncode == 2
    assert called("merge", "quick", cwd=home).returncode == 0
    assert called(*CELLS, "one", "--quick", cwd=home).returncode == 0
    assert (home / "quick/cells.csv").read_bytes() == (home / "one/cells.csv").read_bytes()


@pytest.mark.parametrize("place", ["nowhere", "empty", "study"])
def test_a_folder_without_shards_is_told(home, place):
    """A folder that is not there, empty, or an undivided study has nothing to merge, and nothing is made."""
    (home / "empty").mkdir()
    if place == "study":
        assert called(*CELLS, "study", cwd=home).returncode == 0
    before = sorted(home.rglob("*"))
    done = called("merge", place, cwd=home)
    assert done.returncode == 2
    assert done.stderr == f"{place}: holds no shard. Run layoutopt study ... --shard 1/2 first.\n"
    assert sorted(home.rglob("*")) == before


def test_a_folder_that_is_no_shard_is_told(home):
    """A folder given to the merge that holds no study is named."""
    _shards(CELLS, "out", 1, home)
    (home / "pictures").mkdir()
    done = called("merge", "out", "pictures", cwd=home)
    assert done.returncode == 2
    assert "pictures: holds no study" in done.stderr


def test_outcomes_that_differ_between_shards_are_noted(home):
    """Two shards that hold other numbers for one task, as processors may cause, are told; the first one counts."""
    _shards(CELLS, "out", 2, home)
    shutil.copytree(home / "out/shards/1_of_2", home / "again")
    lines = (home / "again" / JOURNAL).read_text(encoding="utf-8").splitlines()
    record = json.loads(lines[1])
    record["values"][0][0] += 1e-16
    lines[1] = json.dumps(record)
    (home / "again" / JOURNAL).write_text("\n".join(lines) + "\n", encoding="utf-8")
    done = called("merge", "out", "again", cwd=home)
    assert done.returncode == 0
    assert "note: 1 tasks differ between shards" in done.stdout
    assert called(*CELLS, "one", cwd=home).returncode == 0
    assert (home / "out/cells.csv").read_bytes() == (home / "one/cells.csv").read_bytes()


def test_environments_of_all_shards_are_recorded(home):
    """The manifest of the merged study names every processor and version that its shards ran with."""
    _shards(CELLS, "out", 2, home)
    manifest = home / "out/shards/2_of_2" / MANIFEST
    facts = json.loads(manifest.read_text(encoding="utf-8"))
    facts["environments"][0]["processor"] = "another processor"
    manifest.write_text(json.dumps(facts), encoding="utf-8")
    assert called("merge", "out", cwd=home).returncode == 0
    merged = json.loads((home / "out" / MANIFEST).read_text(encoding="utf-8"))
    assert [item["processor"] for item in merged["environments"]][1:] == ["another processor"]


def test_failures_are_merged_and_do_not_block(home, monkeypatch):
    """Tasks that raise in a shard count as done and are told with the answer; later outcomes replace them."""
    monkeypatch.setattr(SmallCells, "faulty", True)
    _shards(CELLS, "out", 2, home)
    done = called("merge", "out", cwd=home)
    assert done.returncode == 1
    assert "failed: RuntimeError: a wheel came off" in done.stdout
    assert len((home / "out/cells.csv").read_text(encoding="utf-8").splitlines()) == 3
    monkeypatch.setattr(SmallCells, "faulty", False)
    assert called(*CELLS, "one", cwd=home).returncode == 0
    _shards(CELLS, "again", 2, home)
    healed = called("merge", "out", "again", cwd=home)
    assert healed.returncode == 0, healed.stdout
    assert "6 tasks added" in healed.stdout
    assert (home / "out/cells.csv").read_bytes() == (home / "one/cells.csv").read_bytes()


def test_more_shards_than_tasks_are_no_fault(home):
    """A shard without a task says so, and the merge does not miss it."""
    told = _shards(CELLS, "out", 13, home)
    assert "shard 13 of 13: 0 of 12 tasks" in told.stdout
    assert called("merge", "out", cwd=home).returncode == 0


def _keys(folder):
    lines = (folder / JOURNAL).read_bytes().splitlines(keepends=True)
    return [json.loads(line)["key"] for line in lines if line.endswith(b"\n") and b'"key"' in line]
