"""What docs/security.md promises: nothing executed, fetched or written elsewhere, and names that stay names."""

import ast
import csv
import json
import os
import re
import shutil
import subprocess
import sys
import sysconfig
import tomllib
from html.parser import HTMLParser
from importlib import resources
from pathlib import Path
from urllib.parse import unquote, urlsplit
from xml.etree import ElementTree

import ezdxf
import filelock
import matplotlib
import pytest
import tomli_w
from command_line import called
from made_studies import NAME, SPEC, made_study

from layoutopt.errors import FailureKind, InvalidInput
from layoutopt.protocols import Failure
from layoutopt.spec.layout_file import read_layout, write_layout
from layoutopt.spec.reading import read_spec
from studies import effort, output
from studies.page import Listing, Page, Section, Table, render_page

ROOT = Path(__file__).resolve().parents[2]
PACKAGES = ("layoutopt", "objectives", "solvers", "studies")
SOURCES = [path for package in PACKAGES for path in sorted((ROOT / package).rglob("*.py"))]
PRICES = 'schema = 1\nname = "MARK"\ndate = 2026-12-01\nbase = "default-2026"\n'

# One process for all commands: most of the time of each is the start of Python and of the compiled kernels.
PROGRAM = """
import sys
from layoutopt.cli import main
for line in sys.stdin.read().splitlines():
    sys.argv = ["layoutopt", *line.split("|")]
    try:
        main()
    except SystemExit as ended:
        print("ENDED", ended.code, line)
"""
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
    written = {
        Path(path).name for _, _, path in recorded.of("write") if Path(path).is_relative_to(recorded.folder)
    }
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
    kinds = {"", ".toml", ".json", ".jsonl", ".csv", ".html", ".svg", ".png", ".pdf", ".dxf", ".yaml"}
    files = [path for folder in (recorded.out, recorded.parts) for path in folder.rglob("*") if path.is_file()]
    assert len(files) > 30
    for path in files:
        assert path.suffix in kinds, path
        assert path.suffix or path.name == ".lock"
        assert not path.is_symlink()
        assert not path.stat().st_mode & 0o111, path
        assert not path.read_bytes().startswith(MAGIC), path
        assert path.suffix in (".png", ".pdf") or path.read_text(encoding="utf-8") is not None


FORBIDDEN_MODULES = {
    "pickle", "cPickle", "_pickle", "dill", "cloudpickle", "marshal", "shelve", "dbm", "copyreg", "tempfile",
    "subprocess", "multiprocessing", "ssl", "http", "requests", "httpx", "aiohttp", "urllib3", "ftplib", "smtplib",
    "telnetlib", "poplib", "imaplib", "xmlrpc", "socketserver", "webbrowser", "ctypes", "cffi", "code", "codeop",
    "runpy", "pty", "zipimport", "xml", "pdb", "antigravity",
}  # fmt: skip
FORBIDDEN_CALLS = {"eval", "exec", "compile", "__import__", "breakpoint"}
FORBIDDEN_OF_OS = re.compile(r"system|popen|exec\w*|spawn\w*|posix_spawnp?|fork\w*|startfile")
ALLOWED_OF_JOBLIB = {"parallel_config", "Parallel", "delayed", "effective_n_jobs", "register_parallel_backend"}
ALLOWED_OF_YAML = {"safe_load", "safe_dump", "compose", "SafeLoader", "YAMLError"}
ALLOWED_NODES_OF_YAML = {"Node", "ScalarNode", "SequenceNode", "MappingNode"}


def dotted(node):
    """Return the name of an expression such as ``os.path.join``; empty for anything else."""
    if isinstance(node, ast.Attribute):
        inner = dotted(node.value)
        return f"{inner}.{node.attr}" if inner else ""
    return node.id if isinstance(node, ast.Name) else ""


def breaches(path):
    """Yield what a source file does that the promises rule out."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    for node in ast.walk(tree):
        modules = []
        if isinstance(node, ast.Import):
            modules = [name.name for name in node.names]
        elif isinstance(node, ast.ImportFrom):
            modules = [node.module or "", *(f"{node.module}.{name.name}" for name in node.names)]
        for module in modules:
            if module.partition(".")[0] in FORBIDDEN_MODULES or module.startswith(
                ("urllib.request", "urllib.error")
            ):
                yield f"imports {module}"
            if module == "socket" and path.name != "status.py":
                yield "imports socket"
            if module.startswith(("distributed", "dask")) and path.name != "cluster.py":
                yield f"imports {module}"
        if isinstance(node, ast.Call):
            name = dotted(node.func)
            if name in FORBIDDEN_CALLS:
                yield f"calls {name}"
            if name.startswith("importlib.import_module") and path.name not in ("registry.py", "__init__.py"):
                yield "imports by name"
            if name.endswith((".load", ".loads")) and name.partition(".")[0] in ("np", "numpy", "joblib", "torch"):
                yield f"calls {name}"
            for keyword in node.keywords:
                if keyword.arg in ("shell", "allow_pickle"):
                    yield f"gives {keyword.arg}"
                if keyword.arg == "autoescape" and not (
                    isinstance(keyword.value, ast.Constant) and keyword.value.value is True
                ):
                    yield "turns off escaping"
                if keyword.arg == "Loader" and dotted(keyword.value) != "yaml.SafeLoader":
                    yield "loads YAML that makes objects"
        if isinstance(node, ast.Attribute):
            owner, _, name = dotted(node).rpartition(".")
            if owner == "os" and FORBIDDEN_OF_OS.fullmatch(name):
                yield f"uses os.{name}"
            if owner == "yaml" and name not in ALLOWED_OF_YAML | ALLOWED_NODES_OF_YAML:
                yield f"uses yaml.{name}"
            if owner == "joblib" and name not in ALLOWED_OF_JOBLIB:
                yield f"uses joblib.{name}"
            if owner == "socket" and name != "gethostname":
                yield f"uses socket.{name}"


@pytest.mark.parametrize("path", SOURCES, ids=lambda path: path.relative_to(ROOT).as_posix())
def test_sources_keep_the_promises(path):
    """No source evaluates text, pickles, starts programs, talks to a network or makes files in a common folder."""
    assert list(breaches(path)) == []


@pytest.mark.parametrize(
    "text",
    [
        "import pickle",
        "from multiprocessing import Pool",
        "import urllib.request",
        "from urllib import request",
        "eval('1')",
        "import os\nos.system('x')",
        "import os\nos.execvp('x', [])",
        "import numpy as np\nnp.load('x')",
        "f('x', shell=True)",
        "import yaml\nyaml.load('x')",
        "import yaml\nyaml.compose('x', Loader=yaml.Loader)",
        "import joblib\njoblib.Memory('x')",
        "import importlib\nimportlib.import_module('x')",
        "Environment(autoescape=False)",
        "import socket\nsocket.socket()",
    ],
)
def test_breaches_are_found(tmp_path, text):
    """Each kind of breach is seen in a source that commits it."""
    (tmp_path / "source.py").write_text(text, encoding="utf-8")
    assert list(breaches(tmp_path / "source.py"))


NAMES = {
    "path": "../../MARK",
    "absolute": "/etc/MARK",
    "script": "<script>MARK()</script>",
    "attribute": '" onmouseover="MARK()" x="',
    "comment": "--><script>MARK()</script><!--",
    "template": "{{ MARK }}{% MARK %}",
    "formula": "=MARK()",
    "formula behind a blank": "\t=MARK()",
    "DDE": "@SUM(1+1)*cmd|' /C MARK'!A0",
    "line": "MARK\n  0\nENDSEC\n  0\nEOF",
    "link": "javascript:MARK()",
    "long": "MARK" * 50,
}


@pytest.mark.parametrize("name", ["a\0b", "\x1b[31m", "x" * 10_000])
@pytest.mark.parametrize(
    "place", ["site.name", "site.source", "zone.name", "reader_profile.name", "exact.name", "tag", "prices", "key"]
)
def test_names_that_no_reader_takes(tmp_path, place, name):
    """Control characters and endless names are refused with a message, wherever a name may stand."""
    document = spec_with_names("MARK")
    spoil(document, place, name)
    (tmp_path / "layout.toml").write_text(tomli_w.dumps(document), encoding="utf-8")
    with pytest.raises(InvalidInput) as caught:
        read_layout(tmp_path / "layout.toml")
    assert len(str(caught.value)) < 1000


def spoil(document, place, name):
    """Put a name into a place of a layout file."""
    if place == "exact.name":
        document["layout"]["tags"][0]["exact"]["name"] = name
    elif place in ("tag", "key"):
        document["layout"][place] = name
    elif place == "zone.name":
        document["site"]["zone"][0]["name"] = name
    elif place == "reader_profile.name":
        document["parts"]["reader_profile"]["name"] = name
    elif place == "prices":
        del document["parts"]["price_list"]
        document["parts"]["prices"] = name
    else:
        document["site"][place.partition(".")[2]] = name


@pytest.mark.parametrize("place", ["zone.name", "reader_profile.name", "exact.name", "tag", "prices", "key"])
@pytest.mark.parametrize("name", NAMES)
def test_names_that_stand_in_heads_and_files_are_plain(tmp_path, place, name):
    """Names of zones, profiles and patterns have few characters; those of parts and price lists must be known."""
    document = spec_with_names("MARK")
    spoil(document, place, NAMES[name])
    (tmp_path / "layout.toml").write_text(tomli_w.dumps(document), encoding="utf-8")
    with pytest.raises(InvalidInput):
        read_layout(tmp_path / "layout.toml")


def spec_with_names(name):
    """Return a layout file with a name wherever free text may stand; the zone begins like a formula."""
    document = tomllib.loads(SPEC)
    document["site"] |= {"name": name, "source": name}
    document["site"]["zone"] = [{"name": "-MARK", "region": [[0, 0], [1, 0], [1, 1]]}]
    document["parts"] = {"reader_profile": {"name": "own"}, "price_list": price_list(name)}
    document["layout"] = {
        "readers": {
            "family": "ring",
            "count": 4,
            "radius": "0.15 m",
            "antenna_side": "60 mm",
            "antenna_height": "20 mm",
        },
        "tags": [
            {
                "exact": {
                    "name": "own",
                    "points": [[0, 0]],
                    "cell": [[0.2, 0], [0, 0.2]],
                    "parameters": {name: name},
                }
            }
        ],
    }
    return document


def price_list(name):
    """Return the default prices as a frozen copy holds them, with a name wherever text may stand."""
    text = (resources.files("layoutopt") / "prices" / "default-2026.toml").read_text(encoding="utf-8")
    items = tomllib.loads(text)["items"]
    texts = {"description": name, "unit": name, "source": name, "date": name}
    kept = ("price", "labour", "spare", "size", "base_side")
    table = {item: {**{key: value[key] for key in kept if key in value}, **texts} for item, value in items.items()}
    return {"name": name, "date": name, "items": table}


class Loads(HTMLParser):
    """Notes of an HTML page what it could run or load."""

    def __init__(self):
        super().__init__()
        self.tags, self.attributes, self.links = set(), set(), set()

    def handle_starttag(self, tag, attrs):
        self.tags.add(tag)
        self.attributes |= {name for name, _ in attrs}
        self.links |= {value for name, value in attrs if name in ("href", "src", "xlink:href", "action", "data")}


def check_page(text, folder):
    """Check that a page runs and loads nothing, and that its links are to files below it."""
    page = Loads()
    page.feed(text)
    assert not page.tags & {
        "script",
        "iframe",
        "object",
        "embed",
        "link",
        "base",
        "form",
        "foreignobject",
        "meta refresh",
    }
    assert not [name for name in page.attributes if name.startswith("on")]
    for link in page.links:
        if link.startswith(("#", "data:image/png;base64,")):
            continue
        parts = urlsplit(link)
        assert not parts.scheme, link
        assert not parts.netloc, link
        assert (folder / unquote(parts.path)).resolve().is_relative_to(folder.resolve()), link
        assert (folder / unquote(parts.path)).exists(), link
    assert "http-equiv" not in page.attributes


def check_table(path):
    """Check that no cell of a table is taken for a formula: it is a number, or begins with no sign of one."""
    with path.open(encoding="utf-8", newline="") as stream:
        for row in csv.reader(stream, strict=True):
            for cell in row:
                number = re.fullmatch(r"-?(\d+(\.\d+)?(e[-+]?\d+)?|inf|nan)", cell)
                assert number or not cell.lstrip().startswith(("=", "+", "-", "@", "\t", "\r")), (path.name, cell)


def check_picture(path):
    """Check that an SVG is XML without anything that runs or loads."""
    for element in ElementTree.parse(path).iter():
        assert element.tag.rpartition("}")[2] not in ("script", "foreignObject", "a", "iframe")
        for name, value in element.attrib.items():
            assert not name.lower().startswith("on")
            if name.rpartition("}")[2] == "href":
                assert value.startswith(("#", "data:image/png;base64,"))


@pytest.mark.parametrize(
    "names",
    [
        ("formula", "script", "comment", "template"),
        ("formula behind a blank", "line", "attribute", "path"),
        ("DDE", "script", "link", "absolute"),
    ],
)
def test_names_in_drawings_stay_names(tmp_path, names):
    """Whatever a layout file says in words, its drawings and tables lie in their folder, sound and harmless."""
    (tmp_path / "layout.toml").write_text(
        tomli_w.dumps(spec_with_names("".join(NAMES[name] for name in names))), encoding="utf-8"
    )
    spec, layout = read_layout(tmp_path / "layout.toml")
    written = output.write_drawings(spec, layout, tmp_path / "out", title=f"{spec.site.name}: drawn")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["layout.toml", "out"]
    assert sorted(path.name for path in (tmp_path / "out").iterdir()) == sorted(path.name for path in written)
    for path in written:
        if path.suffix == ".csv":
            check_table(path)
        elif path.suffix == ".svg":
            check_picture(path)
    drawing = ezdxf.readfile(tmp_path / "out" / "sheet.dxf")
    assert not drawing.audit().errors
    assert len(drawing.modelspace()) > 100
    assert b"/JavaScript" not in (tmp_path / "out" / "sheet.pdf").read_bytes()
    assert b"/Launch" not in (tmp_path / "out" / "sheet.pdf").read_bytes()


def test_names_in_a_report_stay_names(tmp_path, monkeypatch):
    """Hostile names and failures leave a report that runs and loads nothing, and tables of plain cells."""
    monkeypatch.setattr(output, "write_drawings", lambda *_, **__: [])
    hostile = "".join(NAMES[name] for name in ("comment", "attribute", "template", "path"))
    document = spec_with_names(hostile)
    del document["layout"]
    document["study"]["validate_with"] = ["mcl", "midrange"]
    made = made_study(tmp_path, tomli_w.dumps(document))
    outcomes = dict(made.recorded)
    last = next(key for key, item in outcomes.items() if item.group.scenario.startswith("held-out"))
    failed = outcomes[last]
    outcomes[last] = Failure(
        group=failed.group, first=failed.first, message=f"={hostile}", kind=FailureKind.RAISED
    )
    folder = tmp_path / "out"
    folder.mkdir()
    evaluations = sorted(outcomes.values(), key=lambda item: (item.group, item.first))
    made.question.answer(tuple(evaluations), made.spec).write(folder, streams=made.streams, quick=True)
    text = (folder / "report.html").read_text(encoding="utf-8")
    check_page(text, folder)
    assert "&lt;script&gt;MARK()" in text
    tables = sorted(folder.glob("*.csv"))
    assert len(tables) >= 5
    for path in tables:
        check_table(path)
    for path in folder.rglob("*.svg"):
        check_picture(path)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["given.toml", "out"]
    plain = re.compile(r"[a-z0-9_]+\.(csv|html|toml|svg|png)|layouts|recommended|figures")
    assert all(plain.fullmatch(path.name) for path in folder.rglob("*"))


def test_names_on_a_page_stay_names():
    """The pages of the other studies escape titles, sentences, tables, listings and facts."""
    hostile = "".join(NAMES[name] for name in ("comment", "attribute", "template", "link"))
    table = Table(caption=hostile, head=(hostile, hostile), rows=((hostile, hostile),))
    listing = Listing(caption=hostile, text=hostile)
    section = Section(heading=hostile, paragraphs=(hostile,), parts=(table, listing))
    page = Page(title=hostile, question=hostile, summary=(hostile,), sections=(section,), facts={hostile: hostile})
    text = render_page(page, quick=True)
    check_page(text, Path())
    assert text.count("&lt;script&gt;MARK()") == text.count("script&gt;MARK()") > 10


def test_what_the_recorded_study_leaves_is_harmless(recorded):
    """Report, tables and pictures of a real run pass the same checks."""
    check_page((recorded.out / "report.html").read_text(encoding="utf-8"), recorded.out)
    for path in recorded.out.rglob("*.csv"):
        check_table(path)
    for path in recorded.out.rglob("*.svg"):
        check_picture(path)


EVIL = 'import pathlib\npathlib.Path("RAN").write_text("x")\n'


def test_a_command_in_a_folder_of_strangers_runs_nothing_of_theirs(tmp_path):
    """Modules that lie in the folder where a command is called, under names that Python looks for, are not run."""
    made_study(tmp_path).write(tmp_path / "study")
    for module in ("numpy", "json", "layoutopt", "studies", "typer", "sitecustomize", "signal"):
        (tmp_path / f"{module}.py").write_text(EVIL, encoding="utf-8")
    command = Path(sysconfig.get_path("scripts")) / "layoutopt"
    ended = subprocess.run([command, "status", "study"], cwd=tmp_path, capture_output=True, text=True, check=False)
    assert ended.returncode == 0, ended
    assert f"study {NAME}" in ended.stdout
    assert not (tmp_path / "RAN").exists()


# Writes down that it was run, and gives way to the module whose name it has.
SHADOW = (
    EVIL
    + """
import sys
from pathlib import Path
here = str(Path(__file__).parent)
sys.path = [path for path in sys.path if path not in ("", here)]
del sys.modules["joblib"]
import joblib
"""
)
WORK = """
from layoutopt.workers import Backend, Workers
if __name__ == "__main__":
    print(list(Workers(Backend.LOKY, jobs=1).map(abs, [-3])))
"""


def test_workers_run_no_module_of_the_folder_they_are_started_in(tmp_path):
    """Python that is started for a worker takes no module from the folder in which the command was called."""
    program, folder = tmp_path / "program", tmp_path / "folder"
    program.mkdir()
    folder.mkdir()
    (program / "work.py").write_text(WORK, encoding="utf-8")
    (folder / "joblib.py").write_text(SHADOW, encoding="utf-8")
    ended = subprocess.run(
        [sys.executable, program / "work.py"], cwd=folder, capture_output=True, text=True, check=False
    )
    assert "[(0, 3)]" in ended.stdout, ended
    assert not (folder / "RAN").exists()


def test_numba_takes_no_cache_of_the_folder_it_is_started_in(tmp_path):
    """Settings of numba in the folder of the command do not lead it to another cache, which is of pickles."""
    (tmp_path / ".numba_config.yaml").write_text("cache_dir: RAN\n", encoding="utf-8")
    program = PROGRAM + "import numba\nprint('CACHE', repr(str(numba.config.CACHE_DIR)))\n"
    ended = subprocess.run(
        [sys.executable, "-c", program],
        input="study|list\n",
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=False,
    )
    assert "ENDED 2" in ended.stdout or "CACHE ''" in ended.stdout, ended


@pytest.mark.parametrize("name", ["\x1b[31m", "\x9b31m", "\u202ex"])
def test_control_characters_of_a_spec_do_not_reach_the_terminal(tmp_path, monkeypatch, name):
    """Nothing that a spec says moves the cursor, changes colours or turns the direction of writing."""
    spec = SPEC.replace("[site]", f"[site]\nname = {json.dumps(name)}")
    (tmp_path / "faulty.toml").write_text(spec.replace("pitch", "pitches"), encoding="utf-8")
    (tmp_path / "spec.toml").write_text(spec, encoding="utf-8")
    monkeypatch.setattr(effort, "plan_lines", lambda *_, **__: [])
    for file in ("faulty.toml", "spec.toml"):
        ended = called("check", file, cwd=tmp_path)
        said = [*ended.stdout.splitlines(), *ended.stderr.splitlines()]
        assert said
        assert all(line.isprintable() for line in said), said


def test_the_document_names_tests_that_exist():
    """Every test that docs/security.md names is there, and so is every file of tests."""
    text = (ROOT / "docs" / "security.md").read_text(encoding="utf-8")
    sources = {path.name: path.read_text(encoding="utf-8") for path in (ROOT / "tests").rglob("test_*.py")}
    files = set(re.findall(r"\btest_\w+\.py\b", text))
    assert files <= set(sources)
    named = set(re.findall(r"`(test_\w+)`", text))
    everything = "\n".join(sources.values())
    assert len(named) > 20
    assert not [name for name in named if f"def {name}(" not in everything]
