"""`layoutopt doctor`, `cite`, `prices` and `report`, and the help that names all commands."""

import csv
import io
import json
import re
import shutil
import socket
import tomllib
from pathlib import Path

import pytest

import layoutopt
from layoutopt import registry
from layoutopt.citation import software, works, works_named
from layoutopt.cli import app
from layoutopt.cli_help import SECTIONS
from layoutopt.journal import JOURNAL, MANIFEST
from layoutopt.prices import default_prices, read_prices
from layoutopt.spec.template import example_names
from studies import doctor, runner
from tests.command_line import called
from tests.small_studies import SPEC, TABLES, leave_out_drawings

ROOT = Path(layoutopt.__file__).parent.parent
KEY = re.compile(r"^@(\w+)\{(\w+),$", re.MULTILINE)


@pytest.fixture(scope="module")
def finished(tmp_path_factory):
    """The folder of a small finished study."""
    place = tmp_path_factory.mktemp("finished")
    (place / "small.toml").write_text(SPEC, encoding="utf-8")
    with pytest.MonkeyPatch.context() as patched:
        leave_out_drawings(patched)
        done = called("study", "cost_vs_accuracy", "small.toml", "--out", "out", "--jobs", 1, cwd=place)
    assert done.returncode in (0, 1), done.stderr
    return place / "out"


def test_the_help_names_every_command_once():
    """A command without a section would not be seen by anybody."""
    told = [name for names in SECTIONS.values() for name in names]
    known = {command.name or command.callback.__name__ for command in app.registered_commands}
    assert sorted(told) == sorted(known)


def test_the_help_cuts_no_sentence(tmp_path):
    """Every line of the help is whole: three dots stand for arguments only."""
    shown = called("--help", cwd=tmp_path).stdout
    assert "..." not in shown.replace("[ARGS]...", "")
    assert "doctor" in shown


def test_doctor_finds_this_installation_fine_and_calls_nobody(tmp_path, monkeypatch):
    """What is tried here works; no socket is opened; exit code and JSON say the same."""

    def refuse(*_, **__):
        raise AssertionError("doctor opened a socket")

    monkeypatch.setattr(socket.socket, "connect", refuse)
    done = called("doctor", "--json", "--jobs", 1, cwd=tmp_path)
    found = json.loads(done.stdout)
    assert done.returncode == (0 if all(item["ok"] for item in found) else 1)
    names = [item["name"] for item in found]
    assert len(set(names)) == len(names)
    by_name = {item["name"]: item for item in found}
    for name in ("integer programs", "convex programs", "pictures", "linear algebra", "layoutopt"):
        assert by_name[name]["ok"], by_name[name]
    assert all(item["found"] and item["ok"] == (not item["repair"]) for item in found)
    assert list(tmp_path.iterdir()) == []


def test_doctor_ends_with_what_all_checks_say_together():
    """A newcomer reads the last line: go on, or which lines to look at."""
    fine, bad = (
        doctor.Check(name="python", found="3"),
        doctor.Check(name="memory", found="none", repair="Buy some."),
    )
    assert doctor.closing_line([fine, fine]).startswith("all 2 checks are fine; begin with: layoutopt new ")
    assert doctor.closing_line([fine, bad]).startswith("1 of 2 checks ask for a look: memory.")


def test_new_lists_what_there_is_to_start_from_and_each_is_written(tmp_path):
    """Specs that read, and a price list that reads; a name that is none is helped; no file needs a name."""
    listed = called("new", "--list", cwd=tmp_path).stdout.splitlines()[:-1]
    names = [line.split()[0] for line in listed]
    assert names == [*example_names(), "prices"]
    assert all(len(line.split()) > 5 for line in listed)
    for name in names:
        done = called("new", f"{name}.toml", "--from", name, cwd=tmp_path)
        assert done.returncode == 0, done.stderr
        assert f"next: layoutopt {'prices' if name == 'prices' else 'check'} {name}.toml" in done.stdout
    assert read_prices(tmp_path / "prices.toml").items["puck"].source == "estimate"
    wrong = called("new", "x.toml", "--from", "small", cwd=tmp_path)
    assert (wrong.returncode, list(tmp_path.glob("x.*"))) == (2, [])
    assert "Did you mean 'small_hall'?" in wrong.stderr
    assert "Write layoutopt new site.toml." in called("new", cwd=tmp_path).stderr


def _told(step):
    return [check.line for check in step()]


def test_doctor_names_packages_that_are_missing_or_too_old(monkeypatch):
    """Each with what to type; one that is only newer than tested needs no repair."""
    monkeypatch.setattr(doctor.metadata, "requires", lambda _: ["numpy>=99", "no-such-thing>=1", "scipy>=1"])
    monkeypatch.setattr(doctor, "_tested_versions", lambda: {"numpy": "99.1", "scipy": "0.1"})
    lines = _told(doctor._packages)
    assert lines[0].startswith("look here  numpy: ")
    assert lines[0].endswith("but >=99 is needed. Install it: pip install 'numpy==99.1'")
    assert lines[1] == "look here  no-such-thing: is not installed. Install it: pip install 'no-such-thing>=1'"
    assert lines[2].startswith("ok         scipy: ")
    assert lines[2].endswith("the tests ran with 0.1")


def test_doctor_sees_limits_of_a_container(tmp_path, monkeypatch):
    """One and a half processors and little memory: both with the number of jobs that fits."""
    monkeypatch.setattr(doctor, "_CGROUP", tmp_path)
    monkeypatch.setattr(doctor.machine, "usable_processors", lambda: 4)
    for quota, jobs, repair in (
        ("max 100000", 4, ""),
        ("max 100000", 8, "Give --jobs 4: more processes only wait for each other."),
        ("150000 100000", 4, "Give --jobs 1: more processes only wait for each other."),
        ("150000 100000", 1, ""),
    ):
        (tmp_path / "cpu.max").write_text(f"{quota}\n")
        assert [check.repair for check in doctor._processors(jobs)] == [repair]
    monkeypatch.setattr(doctor, "_free_bytes", lambda: int(1.2e9))
    assert [check.repair for check in doctor._memory(4)] == ["Close other programs, or give --jobs 2."]
    assert [check.repair for check in doctor._memory(2)] == [""]


def test_doctor_sees_code_that_is_not_compiled_or_cannot_be_kept(monkeypatch, tmp_path):
    """A kernel whose compiled code is older than its source waits; a cache that is barred is named."""
    monkeypatch.setattr(doctor, "_kernel_modules", lambda: iter(["layoutopt.circles_kernels"]))
    source = tmp_path / "circles_kernels.py"
    shutil.copy(ROOT / "layoutopt/circles_kernels.py", source)
    kernel = __import__("layoutopt.circles_kernels", fromlist=["circles_kernels"])
    monkeypatch.setattr(kernel, "__file__", str(source))
    cache, code = doctor._compiled()
    assert cache.fine
    assert code.found.startswith("0 of 1 files are compiled; the first study does the rest")
    assert code.fine
    monkeypatch.setattr(doctor.os, "access", lambda *_: False)
    cache, _ = doctor._compiled()
    assert "cannot be written" in cache.found
    assert "NUMBA_CACHE_DIR" in cache.repair


def test_a_check_that_breaks_is_told_and_the_others_go_on(monkeypatch):
    """An error within a check is a finding, not a traceback."""

    def broken():
        raise OSError("no such\nlibrary")

    monkeypatch.setattr(doctor, "_linear_algebra", broken)
    monkeypatch.setattr(doctor, "_compiled", lambda: iter(()))
    found = list(doctor.checks(1))
    bad = [check for check in found if not check.fine and check.name == "linear algebra"]
    assert [check.found for check in bad] == ["cannot be tried (OSError: no such?library)"]
    assert found[-1].name == "files"


def test_tested_versions_are_those_of_the_lock():
    """The table in the package, the dependencies of the project and the lock name the same packages."""
    plain = {re.sub(r"[-_.]+", "-", name).lower(): version for name, version in doctor._tested_versions().items()}
    lock = dict(
        line.strip().split("==") for line in (ROOT / "requirements.lock").read_text().splitlines() if "==" in line
    )
    locked = {re.sub(r"[-_.]+", "-", name).lower(): version for name, version in lock.items()}
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    wanted = {re.split(r"[<>=]", text)[0].lower() for text in project["dependencies"]}
    assert set(plain) == wanted
    assert {name: locked[name] for name in plain} == plain


def test_the_citation_file_says_what_the_package_says():
    """CITATION.cff, for those who look at the sources, and ``works.toml``, which is installed, agree."""
    told = (ROOT / "CITATION.cff").read_text(encoding="utf-8")
    facts = dict(line.split(": ", 1) for line in told.splitlines() if re.match(r"\w[\w-]*: ", line))
    known = software().fields
    assert facts["title"] == known["title"]
    assert facts["version"] == known["version"] == layoutopt.__version__
    assert f"License: {facts['license']}" in known["note"]
    assert f"name: {known['author'].strip('{}')}" in told


def test_every_work_that_a_card_dates_is_known():
    """A card that names a year names a work of that year, which `cite` can print; plans cite formats of files."""
    for point in registry.PACKAGES:
        for name in registry.names(point) if point != "plans" else ():
            reference = registry.card(point, name).reference
            years = set(re.findall(r"\b(?:19|20)\d\d\b", reference))
            assert years <= {work.fields.get("year") for work in works_named([reference])}, (
                point,
                name,
                reference,
            )
            short = set(re.findall(r"\b(?:mi|han|kim|liang)(?:19|20)\d\d\b", reference))
            assert short <= {work.key for work in works_named([reference])}, (point, name)


def test_each_work_is_a_whole_entry():
    """Braces are paired, names are unique, and the text ends with one full stop."""
    for work in (software(), *works().values()):
        assert work.bibtex.count("{") == work.bibtex.count("}")
        assert KEY.findall(work.bibtex) == [(work.type, work.key)]
        assert {"title", "author"} <= set(work.fields)
        assert re.search(r"[^.]\.$", work.text), work.text


def test_cite_tells_layoutopt_alone_or_a_study(tmp_path):
    """Without a subject one entry; a study of a paper names that paper; a name that is none is helped."""
    assert "works" not in called("cite", cwd=tmp_path).stdout
    bibtex = called("cite", "published/kim2010", "--bibtex", cwd=tmp_path).stdout
    assert [key for _, key in KEY.findall(bibtex)] == ["layoutopt", "kim2010"]
    wrong = called("cite", "cost_vs_acuracy", cwd=tmp_path)
    assert wrong.returncode == 2
    assert "Did you mean 'cost_vs_accuracy'?" in wrong.stderr


def test_cite_of_a_folder_tells_the_estimators_that_ran(finished):
    """Those of the journal, not those of the built-in ward; objectives of docking and tracking stay out."""
    told = called("cite", finished, cwd=finished.parent).stdout
    for line in ("solvers racing:", "estimators midrange:", "patterns square:", "readers ring:", "[han2006]"):
        assert line in told
    assert "objectives docking" not in told
    assert "patterns triangular" not in told


def test_cite_of_a_name_says_whose_spec_it_takes(finished):
    """The built-in ward, and says so; or the spec given, of which it names the estimators and families."""
    named = called("cite", "cost_vs_accuracy", cwd=finished.parent).stdout
    assert named.startswith("what the built-in hospital ward asks for; ")
    assert "patterns triangular" in named
    own = called("cite", "cost_vs_accuracy", "small.toml", cwd=finished.parent).stdout
    assert own.startswith("layoutopt:")
    assert "patterns triangular" not in own
    assert "estimators midrange:" in own
    assert called("cite", "out", "small.toml", cwd=finished.parent).returncode == 2


def test_prices_list_every_item_with_date_and_source(tmp_path):
    """As lines and as CSV that holds the same numbers; estimates are counted."""
    prices = default_prices()
    lines = called("prices", cwd=tmp_path).stdout.splitlines()
    assert [line.split()[0] for line in lines[1:-1]] == list(prices.items)
    assert all(
        f"{item.date}, {item.source}" in line for item, line in zip(prices.items.values(), lines[1:], strict=False)
    )
    assert lines[-1].startswith("16 of 17 prices are estimates")
    rows = list(csv.DictReader(io.StringIO(called("prices", "--csv", cwd=tmp_path).stdout)))
    assert [(row["item"], float(row["price_eur"]), float(row["labour_s"])) for row in rows] == [
        (item.name, item.price_eur, item.labour_s) for item in prices.items.values()
    ]
    assert rows[0]["width_m"] == "0.02"


def test_prices_of_a_list_of_ones_own_show_what_it_changes(tmp_path):
    """A source of one's own is no estimate; a file that is none is named."""
    head = 'schema = 1\nname = "ours"\ndate = "2026-11"\nbase = "default-2026"\n'
    (tmp_path / "mine.toml").write_text(f'{head}[items.label]\nprice = "0.18 EUR"\nsource = "=offer"\n')
    lines = called("prices", "mine.toml", cwd=tmp_path).stdout.splitlines()
    assert lines[0].startswith("ours of 2026-11")
    assert "0.18 EUR / piece" in lines[1]
    assert "2026-11, =offer" in lines[1]
    assert "'=offer" in called("prices", "mine.toml", "--csv", cwd=tmp_path).stdout
    wrong = called("prices", "default-2025", cwd=tmp_path)
    assert wrong.returncode == 2
    assert "'default-2025' is no file" in wrong.stderr


def test_status_of_a_finished_study_says_where_its_report_lies(finished, tmp_path):
    """Who looks at a folder after lunch wants to read the answer; a report that is not there is not named."""
    shutil.copytree(finished, tmp_path / "out")
    told = called("status", "out", cwd=tmp_path).stdout.splitlines()
    assert told[0].endswith(": finished")
    assert "report" not in told[-1]
    (tmp_path / "out" / "report.html").write_text("<html></html>", encoding="utf-8")
    told = called("status", "out", cwd=tmp_path).stdout.splitlines()
    assert told[-1] == f"  report: {Path('out') / 'report.html'}"


def test_report_writes_the_same_bytes_without_a_trial(finished, tmp_path, monkeypatch):
    """Tables that were lost come back as they were; the journal stays; nothing is simulated for it."""
    folder = tmp_path / "out"
    shutil.copytree(finished, folder)
    for name in TABLES:
        (folder / name).unlink()
    monkeypatch.setattr(runner, "Evaluator", None)
    leave_out_drawings(monkeypatch)
    done = called("report", folder, "--jobs", 1, cwd=tmp_path)
    assert done.returncode in (0, 1), done.stderr
    assert f"report: {folder / 'report.html'}" in done.stdout
    for name in (*TABLES, JOURNAL):
        assert (folder / name).read_bytes() == (finished / name).read_bytes(), name


@pytest.mark.long
def test_report_brings_back_every_file_of_a_study(tmp_path):
    """Report, figures, drawings and layout files are those that the study itself wrote, byte by byte."""
    (tmp_path / "small.toml").write_text(SPEC, encoding="utf-8")
    called("study", "cost_vs_accuracy", "small.toml", "--out", "out", "--jobs", 1, cwd=tmp_path)
    folder = tmp_path / "out"
    before = {path.relative_to(folder): path.read_bytes() for path in folder.rglob("*") if path.is_file()}
    for path in before:
        if path.name not in (JOURNAL, MANIFEST, "spec.toml"):
            (folder / path).unlink()
    called("report", "out", "--jobs", 1, cwd=tmp_path)
    after = {path.relative_to(folder): path.read_bytes() for path in folder.rglob("*") if path.is_file()}
    assert len(before) > 30
    assert {path for path in before if path.name != "status.json" and after.get(path) != before[path]} == set()


def test_report_refuses_what_is_not_finished_and_says_how_to_go_on(finished, tmp_path):
    """A journal without its last lines has no whole report; nothing in the folder changes."""
    folder = tmp_path / "out"
    shutil.copytree(finished, folder)
    lines = (folder / JOURNAL).read_bytes().splitlines(keepends=True)
    (folder / JOURNAL).write_bytes(b"".join(lines[: len(lines) // 2]))
    before = {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}
    done = called("report", folder, cwd=tmp_path)
    assert done.returncode == 2
    assert "the study is not finished" in done.stderr
    assert "layoutopt study cost_vs_accuracy" in done.stderr
    assert "--resume" in done.stderr
    assert {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()} == before


def test_report_refuses_folders_that_hold_no_study_of_today(finished, tmp_path):
    """No study, other models, a spec that was changed: each with its own sentence."""
    assert "holds no study" in called("report", tmp_path, cwd=tmp_path).stderr
    folder = tmp_path / "out"
    shutil.copytree(finished, folder)
    facts = json.loads((folder / MANIFEST).read_text())
    (folder / MANIFEST).write_text(json.dumps({**facts, "model": "of old"}))
    assert "run the study again" in called("report", folder, cwd=tmp_path).stderr
    (folder / MANIFEST).write_text(json.dumps(facts))
    spec = (folder / "spec.toml").read_text()
    (folder / "spec.toml").write_text(spec.replace("seed = 3", "seed = 4"))
    assert "do not belong together" in called("report", folder, cwd=tmp_path).stderr
