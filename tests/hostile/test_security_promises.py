"""What docs/security.md promises of a run: nothing executed, fetched, started or written elsewhere."""

import json
import os
import re
import shutil
import subprocess
import sys
import sysconfig
from pathlib import Path

import filelock
import matplotlib
import pytest
from command_line import PROGRAM
from harmless import check_page, check_picture, check_table
from made_studies import SPEC

from layoutopt.spec.layout_file import write_layout
from layoutopt.spec.reading import read_spec

ROOT = Path(__file__).resolve().parents[2]
PRICES = 'schema = 1\nname = "MARK"\ndate = 2026-12-01\nbase = "default-2026"\n'
COMMANDS = """
check|spec.toml
study|cost_vs_accuracy|spec.toml|--quick|--out|out|--backend|loky|--jobs|2
status|out
study|cost_vs_accuracy|spec.toml|--quick|--out|parts|--backend|serial|--shard|1/1
merge|parts
status|parts
reprice|out|prices.toml|--out|out/repriced.csv
draw|layout.toml|--out|out/drawn
""".strip()


def record(folder):
    """Run all commands in a folder that is made for them, and leave there what was written down of them."""
    for name in ("hooks", "told"):
        (folder / name).mkdir(parents=True)
    spec = SPEC.replace("[site]", "[site]\nname = \"MARK __import__('os')\"")
    (folder / "spec.toml").write_text(spec, encoding="utf-8")
    (folder / "prices.toml").write_text(PRICES, encoding="utf-8")
    read = read_spec(folder / "spec.toml")
    write_layout(next(read.space.layouts()), read, folder / "layout.toml")
    shutil.copy(ROOT / "tests" / "recording_hook.py", folder / "hooks" / "sitecustomize.py")
    own = {"PYTHONPATH": str(folder / "hooks"), "RECORD_TO": str(folder / "told"), "MPLBACKEND": "Agg"}
    ended = subprocess.run(
        [sys.executable, "-c", PROGRAM],
        input=COMMANDS,
        cwd=folder,
        env={**os.environ, **own},
        capture_output=True,
        text=True,
        timeout=250,
        check=False,
    )
    (folder / "told" / "ended").write_text(f"{ended.stdout}\n{ended.stderr}", encoding="utf-8")


class Recorded:
    """What a run of all commands asked of the system, and what it left."""

    def __init__(self, folder):
        self.folder, self.out, self.parts = folder, folder / "out", folder / "parts"
        self.ended = (folder / "told" / "ended").read_text(encoding="utf-8")
        self.processes = [
            [tuple(json.loads(line)) for line in path.read_text(encoding="utf-8").splitlines()]
            for path in sorted((folder / "told").glob("*.jsonl"))
        ]
        self.entries = sorted({entry for entries in self.processes for entry in entries})

    def of(self, *events):
        """Return the entries of events, of all events of a kind for a name that ends with a dot."""
        return [
            entry for entry in self.entries if any(entry[0] == e or entry[0].startswith(e + ".") for e in events)
        ]


@pytest.fixture(scope="module")
def recorded(tmp_path_factory):
    """Run all commands once, also where several processes share these tests."""
    base = tmp_path_factory.getbasetemp()
    folder = (base.parent if "PYTEST_XDIST_WORKER" in os.environ else base).resolve() / "recorded"
    with filelock.FileLock(folder.with_suffix(".lock")):
        if not folder.exists():
            record(folder)
    return Recorded(folder)


def library(place):
    """Return the package, or the module of the standard library, that a file belongs to; empty for neither."""
    file = Path(place.rpartition(":")[0])
    for name in ("purelib", "platlib", "stdlib"):
        folder = Path(sysconfig.get_path(name))
        for start in (folder, folder.resolve()):
            if file.is_relative_to(start):
                return file.relative_to(start).parts[0].removesuffix(".py")
    return ""


def test_all_commands_ran_and_their_workers_were_recorded(recorded):
    """The record is of runs that did their work, in the process of the command and in those of its workers."""
    codes = re.findall(r"^ENDED (\d+) (\w+)", recorded.ended, re.MULTILINE)
    assert [name for _, name in codes] == [line.partition("|")[0] for line in COMMANDS.splitlines()], (
        recorded.ended
    )
    # A quick look may find no layout that meets the target (1); the first round of a study is not all of it (3).
    assert all(code in "013" for code, _ in codes), recorded.ended
    assert len((recorded.out / "results.jsonl").read_bytes().splitlines()) > 10
    numba = [entries for entries in recorded.processes if any("caching.py" in entry[1] for entry in entries)]
    assert len(numba) >= 3


def test_nothing_is_written_outside_of_the_output_and_the_caches(recorded):
    """Files are made, renamed, removed and opened for writing below --out, or below a cache of the user's."""
    caches = [Path(matplotlib.get_cachedir()), Path(matplotlib.get_configdir()), Path.home() / ".cache" / "ezdxf"]
    allowed = [recorded.out, recorded.parts, *(path.resolve() for path in caches if path.is_absolute())]
    wrong = []
    for event, place, path in recorded.of("write", "os", "shutil"):
        inside = any(Path(path).is_relative_to(folder) for folder in allowed)
        numbas = "__pycache__" in Path(path).parts or Path(path).is_relative_to(
            os.environ.get("NUMBA_CACHE_DIR", "/-")
        )
        # For arrays that it would share by files joblib makes a folder and removes it; we let it share none.
        joblibs = event != "write" and "joblib_memmapping_folder" in Path(path).name and library(place) != ""
        if not (inside or joblibs or (numbas and library(place) in ("numba", "tempfile"))):
            wrong.append((event, place, path))
    assert wrong == []
    # A folder is opened for writing to make a file without a name in it (O_TMPFILE), as filelock from 4.3 on does.
    files = [Path(path) for _, _, path in recorded.of("write") if not Path(path).is_dir()]
    written = {path.name for path in files if path.is_relative_to(recorded.folder)}
    assert len(written) > 30
    # All but two files are written beside themselves and renamed, so that a link in their place is not followed.
    assert all(re.fullmatch(r"\.lock|results\.jsonl|\.[0-9a-f]{32}\.part", name) for name in written), written


def test_nothing_else_is_left(recorded):
    """After all commands the folder above --out holds what was there before, and the outputs."""
    given = ["hooks", "layout.toml", "out", "parts", "prices.toml", "spec.toml", "told"]
    assert sorted(path.name for path in recorded.folder.iterdir()) == given
    names = {path.name for path in recorded.out.iterdir()}
    assert {name for name in names if name.endswith(".part")} == set()


def test_no_network_without_a_scheduler(recorded):
    """No socket is made, bound or connected and no name is looked up, by the command or by a worker."""
    talks = recorded.of(
        "socket", "urllib", "http", "ftplib", "smtplib", "poplib", "imaplib", "nntplib", "telnetlib"
    )
    # The name of this machine, for the status.
    assert {entry[0] for entry in talks} <= {"socket.gethostname"}


def test_no_program_is_started(recorded):
    """Nothing but Python itself is started, for the workers; no shell, no browser."""
    assert (
        recorded.of("subprocess", "pty", "webbrowser", "os.system", "os.exec", "os.posix_spawn", "os.spawn") == []
    )


def test_pickles_come_from_workers_and_from_the_cache_of_numba(recorded):
    """Only pipes to own processes and numba's own cache are unpickled, and no file of a study or beside a spec."""
    readers = {
        (library(place), Path(place.rpartition(":")[0]).name) for _, place, _ in recorded.of("pickle.find_class")
    }
    assert readers <= {
        ("numba", "caching.py"),
        ("numba", "serialize.py"),
        ("multiprocessing", "connection.py"),
        ("multiprocessing", "queues.py"),
        ("joblib", "popen_loky_posix.py"),
    }
    read = [path for _, _, path in recorded.of("read")]
    assert read
    assert not [path for path in read if Path(path).is_relative_to(recorded.folder)]


COMPILERS = {
    "ast", "collections", "dataclasses", "enum", "fontTools", "functools", "jinja2", "joblib", "llvmlite",
    "matplotlib", "multiprocessing", "numba", "numpy", "pydantic", "pydantic_core", "scipy", "shapely", "typer",
    "typing", "typing_extensions", "typing_inspection", "inspect", "re", "attr", "attrs", "importlib",
}  # fmt: skip
"""Libraries that compile code of their own making: named tuples, data classes, templates, kernels."""


def test_nothing_that_was_given_is_compiled(recorded):
    """Code comes from imports and from libraries that make some of their own; no text of a spec is ever in it."""
    compiled = recorded.of("exec", "compile")
    assert {library(place) for _, place, _ in compiled if place != "interpreter"} - {""} <= COMPILERS
    # What belongs to no library is the program of this test.
    others = {place for _, place, _ in compiled if place != "interpreter" and not library(place)}
    assert all(place.startswith("<string>") for place in others), others
    assert not [entry for entry in compiled if entry[2] == "MARK"]


def test_only_libraries_that_are_installed_are_loaded(recorded):
    """No shared library is opened from a study, from beside a spec or from the folder of the command."""
    loaded = [path for _, _, path in recorded.of("ctypes.dlopen")]
    assert not [path for path in loaded if Path(path).is_relative_to(recorded.folder)]


MAGIC = (
    b"\x80\x02",
    b"\x80\x03",
    b"\x80\x04",
    b"\x80\x05",
    b"PK",
    b"\x7fELF",
    b"MZ",
    b"#!",
    b"\x93NUMPY",
    b"\x1f\x8b",
)


def test_a_study_folder_holds_no_pickle_archive_or_program(recorded):
    """Every file is one of the kinds that docs/security.md names, begins like it, and is no executable."""
    pictures = {".png", ".pdf", ".pgm"}
    kinds = {"", ".toml", ".json", ".jsonl", ".csv", ".html", ".svg", ".dxf", ".yaml", ".urdf", *pictures}
    files = [path for folder in (recorded.out, recorded.parts) for path in folder.rglob("*") if path.is_file()]
    assert len(files) > 30
    for path in files:
        assert path.suffix in kinds, path
        assert path.suffix or path.name == ".lock"
        assert not path.is_symlink()
        assert not path.stat().st_mode & 0o111, path
        assert not path.read_bytes().startswith(MAGIC), path
        assert path.suffix in pictures or path.read_text(encoding="utf-8") is not None


def test_what_the_recorded_study_leaves_is_harmless(recorded):
    """Report, tables and pictures of a real run pass the same checks."""
    check_page((recorded.out / "report.html").read_text(encoding="utf-8"), recorded.out)
    for path in recorded.out.rglob("*.csv"):
        check_table(path)
    for path in recorded.out.rglob("*.svg"):
        check_picture(path)
