"""Derived tables are the same bytes whoever computes, in how many parts, and however often a study was begun."""

import shutil

import pytest
from small_studies import SPEC, called, leave_out_drawings, tables

from layoutopt.journal import JOURNAL, MANIFEST

STUDY = ("study", "cost_vs_accuracy", "spec.toml", "--out")


@pytest.fixture(scope="module")
def home(tmp_path_factory):
    """A folder with the spec and a study of it that this process ran alone, without drawings."""
    folder = tmp_path_factory.mktemp("same")
    (folder / "spec.toml").write_text(SPEC, encoding="utf-8")
    with pytest.MonkeyPatch.context() as monkeypatch:
        leave_out_drawings(monkeypatch)
        done = called(*STUDY, "serial", "--backend", "serial", cwd=folder)
    assert done.returncode == 0, done.stdout + done.stderr
    return folder


def _lines(folder):
    return (folder / JOURNAL).read_bytes().splitlines(keepends=True)


@pytest.mark.parametrize("jobs", [1, 2, pytest.param(4, marks=pytest.mark.long)])
def test_any_number_of_processes_gives_the_bytes_of_this_one(home, jobs, monkeypatch):
    """Tables and frozen spec do not depend on the number of worker processes, nor does what was simulated."""
    leave_out_drawings(monkeypatch)
    folder = home / f"jobs_{jobs}"
    done = called(*STUDY, folder, "--jobs", jobs, cwd=home)
    assert done.returncode == 0, done.stderr
    assert tables(folder) == tables(home / "serial")
    assert (folder / "spec.toml").read_bytes() == (home / "serial/spec.toml").read_bytes()
    assert sorted(_without_times(folder)) == sorted(_without_times(home / "serial"))


@pytest.mark.long
def test_two_processes_give_the_same_report(home):
    """The report and the layout files are the same bytes too."""
    for name, who in (("drawn", ("--backend", "serial")), ("drawn_by_two", ("--jobs", 2))):
        assert called(*STUDY, name, *who, cwd=home).returncode == 0
    names = [path.relative_to(home / "drawn") for path in (home / "drawn").glob("layouts/*.toml")]
    assert len(names) == 3
    for name in ("report.html", "local_error.csv", *names):
        assert (home / "drawn_by_two" / name).read_bytes() == (home / "drawn" / name).read_bytes(), name


@pytest.mark.parametrize("share", [0.0, 0.2, 0.5, 0.9, 1.0])
def test_a_journal_cut_anywhere_is_gone_on_with_to_the_same_bytes(home, share, tmp_path, monkeypatch):
    """Cut within a line, a journal keeps its whole lines as they are, and the study ends with the same tables."""
    leave_out_drawings(monkeypatch)
    content = (home / "serial" / JOURNAL).read_bytes()
    cut = content[: int(share * len(content))]
    for name in (MANIFEST, "spec.toml"):
        shutil.copy(home / "serial" / name, tmp_path)
    (tmp_path / JOURNAL).write_bytes(cut)
    done = called(*STUDY, tmp_path, "--backend", "serial", "--resume", cwd=home)
    assert done.returncode == 0, done.stderr
    assert tables(tmp_path) == tables(home / "serial")
    whole = cut[: cut.rfind(b"\n") + 1]
    assert (tmp_path / JOURNAL).read_bytes().startswith(whole)
    assert ("was torn" in done.stderr) == (whole != cut)


def test_a_journal_in_another_order_gives_the_same_bytes(home, tmp_path, monkeypatch):
    """Tables do not depend on the order in which results came in."""
    leave_out_drawings(monkeypatch)
    names, results = _parted(_lines(home / "serial"))
    for name in (MANIFEST, "spec.toml"):
        shutil.copy(home / "serial" / name, tmp_path)
    (tmp_path / JOURNAL).write_bytes(b"".join([*names, *reversed(results)]))
    done = called(*STUDY, tmp_path, "--backend", "serial", "--resume", cwd=home)
    assert done.returncode == 0, done.stderr
    assert tables(tmp_path) == tables(home / "serial")
    assert len(_lines(tmp_path)) == len(names) + len(results)


def _parted(lines):
    """Return the lines that name columns, and those of results, which need them."""
    names = [line for line in lines if line.startswith(b'{"column_set"')]
    return names, [line for line in lines if line not in names]


def _without_times(folder):
    return [line.partition(b',"seconds"')[0] for line in _lines(folder)]
