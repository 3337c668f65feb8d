"""What pages name exists: modules, files, studies, commands; and the reference offers what one import offers."""

import importlib
import importlib.util
import re
import tomllib
from pathlib import Path

import pytest

import layoutopt
from layoutopt import registry
from layoutopt.cli import app

ROOT = Path(layoutopt.__file__).parent.parent
DOCS = ROOT / "docs"
PAGES = {page.name: page.read_text(encoding="utf-8") for page in [*sorted(DOCS.glob("*.md")), ROOT / "README.md"]}
PACKAGES = ("layoutopt", "objectives", "solvers", "studies")
WRITTEN = re.compile(r"Save this as `([^`]+)`")
FILE = re.compile(r"`((?:layoutopt|objectives|solvers|studies|tests|docs|benchmarks)/[\w./-]+)`")
DOTTED = re.compile(r"`((?:layoutopt|objectives|solvers|studies)(?:\.\w+)+)`")
IMPORT = re.compile(
    r"^from ((?:layoutopt|objectives|solvers|studies)[\w.]*) import (?:\(([^)]*)\)|(.*))$", re.MULTILINE
)
ARCHITECTURE = PAGES["architecture.md"]


def _file_of(parts):
    """Return the file of a module, ``None`` if there is none."""
    path = ROOT.joinpath(*parts)
    return next((file for file in (path.with_suffix(".py"), path / "__init__.py") if file.exists()), None)


def _exists(dotted):
    """Return whether a dotted name is a module, or a name of one, the names after it methods or fields."""
    parts = dotted.split(".")
    for length in range(len(parts), 0, -1):
        file = _file_of(parts[:length])
        if file is not None:
            text = file.read_text(encoding="utf-8")
            return all(re.search(rf"\b{name}\b", text) for name in parts[length:])
    return False


def test_a_module_or_name_that_is_not_there_is_found_out():
    """The search below can fail."""
    assert _exists("solvers.racing.Racing.standing")
    assert not _exists("solvers.racing.Raccoon")
    assert not _exists("solvers.wrestling")


@pytest.mark.parametrize("page", PAGES)
def test_every_file_and_module_that_a_page_names_exists(page):
    """Those that the page itself has its reader write are left out; ``NAME`` stands for any."""
    text = PAGES[page]
    written = set(WRITTEN.findall(text))
    files = {file for file in FILE.findall(text) if file not in written and "NAME" not in file}
    assert {file for file in files if not any((ROOT / f"{file}{end}").exists() for end in ("", ".py"))} == set()
    assert {name for name in DOTTED.findall(text) if not _exists(name)} == set()


@pytest.mark.parametrize("page", [page for page, text in PAGES.items() if IMPORT.search(text)])
def test_every_name_that_code_on_a_page_imports_is_there(page):
    """Those of the modules that the page has its reader write are left out."""
    text = PAGES[page]
    own = {file.removesuffix(".py").replace("/", ".") for file in WRITTEN.findall(text)}
    missing = []
    for module, inside, bare in IMPORT.findall(text):
        names = re.findall(r"(\w+)(?: as \w+)?(?:,|\s*$)", inside or bare.partition("  #")[0], re.MULTILINE)
        if module not in own:
            place = importlib.import_module(module)
            missing += [f"{module}.{name}" for name in names if not _offers(place, name)]
    assert missing == []


def _offers(module, name):
    return hasattr(module, name) or importlib.util.find_spec(f"{module.__name__}.{name}") is not None


@pytest.mark.parametrize("page", PAGES)
def test_every_command_and_study_that_a_page_names_exists(page):
    """`layoutopt COMMAND` and `layoutopt study NAME`, in text and in blocks."""
    text = PAGES[page]
    blocks = "".join(re.findall(r"(?ms)^```[a-z]*\n(.*?)^```$", text))
    commands = {
        *re.findall(r"`layoutopt ([a-z]+)\b", text),
        *re.findall(r"(?m)^(?:\$ )?layoutopt ([a-z]+)\b", blocks),
    }
    known = {command.name or command.callback.__name__.replace("_", "-") for command in app.registered_commands}
    assert commands - known == set()
    studies = set(re.findall(r"layoutopt study ([a-z][a-z0-9_/]*)", text))
    own = {Path(file).stem for file in WRITTEN.findall(text)}
    assert studies - {*registry.names("studies"), *own, "list"} == set()


def test_the_layers_of_the_architecture_are_those_that_are_held():
    """The numbered list under *Imports point down* names every layer of the linter's contract, in its order."""
    settings = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["tool"]["importlinter"]
    (contract,) = [one for one in settings["contracts"] if one["name"] == "the domain points down"]
    layer_of = {
        name: place for place, layer in enumerate(contract["layers"]) for name in re.findall(r"\w+", layer)
    }
    section = ARCHITECTURE.partition("inside `layoutopt`, from top to bottom:")[2].partition("import-linter")[0]
    named = re.findall(r"`(\w+)`", section)
    public = {name for name in layer_of if not name.startswith("_") and not name.endswith("_kernels")}
    assert set(named) == public
    places = [layer_of[name] for name in named]
    assert places == sorted(places)


def test_the_reference_offers_every_name_of_the_package():
    """Tables of the reference hold exactly what `import layoutopt as lo` offers, each where it is defined."""
    listed = re.findall(r"(?m)^   ~(layoutopt\.[\w.]+)$", PAGES["reference.md"])
    assert sorted(name.rpartition(".")[2] for name in listed) == sorted(layoutopt.__all__)
    for name in listed:
        value = getattr(layoutopt, name.rpartition(".")[2])
        assert f"{value.__module__}.{value.__qualname__}" == name
