"""What people install: sdist and wheel, built from a clean copy and installed where nothing of ours was before."""

import os
import re
import shutil
import subprocess
import sys
import tarfile
import tomllib
import zipfile
from pathlib import Path

import pytest

import layoutopt

ROOT = Path(layoutopt.__file__).parent.parent
PACKAGES = ("layoutopt", "objectives", "solvers", "studies")
BESIDE = ("LICENSE", "README.md", "CHANGELOG.md", "CITATION.cff", "MANIFEST.in", "pyproject.toml")
"""What a release is built from beside the packages, all of which goes into the sdist."""
MUST_BE_THERE = (
    *(f"{package}/py.typed" for package in PACKAGES),
    "layoutopt/works.toml",
    "layoutopt/tested_versions.toml",
    "layoutopt/prices/default-2026.toml",
    "layoutopt/spec/examples/hospital_ward.toml",
    "layoutopt/tables/tags.schema.json",
    "studies/report.html",
    "studies/style.css",
)
BUILD = "from setuptools import build_meta as backend; print(backend.build_{kind}({place!r}))"
pytestmark = pytest.mark.long


def _run(*words, cwd, **settings):
    return subprocess.run([str(word) for word in words], cwd=cwd, capture_output=True, text=True, **settings)


def _succeeds(*words, cwd, **settings):
    done = _run(*words, cwd=cwd, check=False, **settings)
    assert done.returncode == 0, done.stdout + done.stderr
    return done.stdout


@pytest.fixture(scope="module")
def source(tmp_path_factory):
    """A copy of what a release is built from, without anything that was compiled or built in it."""
    copy = tmp_path_factory.mktemp("source")
    for package in PACKAGES:
        shutil.copytree(ROOT / package, copy / package, ignore=shutil.ignore_patterns("__pycache__"))
    for name in BESIDE:
        shutil.copy(ROOT / name, copy)
    return copy


@pytest.fixture(scope="module")
def ours(source):
    """The names of all files of our packages."""
    return {
        path.relative_to(source).as_posix()
        for package in PACKAGES
        for path in (source / package).rglob("*")
        if path.is_file()
    }


@pytest.fixture(scope="module")
def sdist(source, ours, tmp_path_factory):
    """The sdist, built from the copy."""
    place = tmp_path_factory.mktemp("sdist")
    _succeeds(sys.executable, "-c", BUILD.format(kind="sdist", place=str(place)), cwd=source)
    return place / f"layoutopt-{layoutopt.__version__}.tar.gz"


@pytest.fixture(scope="module")
def wheel(sdist, tmp_path_factory):
    """The wheel, built from the sdist and nothing else, as installers do."""
    place = tmp_path_factory.mktemp("wheel")
    with tarfile.open(sdist) as archive:
        archive.extractall(place, filter="data")
    (unpacked,) = place.iterdir()
    _succeeds(sys.executable, "-c", BUILD.format(kind="wheel", place=str(place)), cwd=unpacked)
    return place / f"layoutopt-{layoutopt.__version__}-py3-none-any.whl"


@pytest.fixture(scope="module")
def installed(wheel, tmp_path_factory):
    """The folder of commands of a fresh environment with the versions of the lock and the wheel."""
    place = tmp_path_factory.mktemp("fresh") / "env"
    _succeeds(sys.executable, "-m", "venv", place, cwd=ROOT)
    pip = [place / "bin/python", "-m", "pip", "install", "--quiet", "--disable-pip-version-check"]
    _succeeds(*pip, "-r", ROOT / "requirements.lock", cwd=place)
    _succeeds(*pip, "--no-index", wheel, cwd=place)
    return place / "bin"


@pytest.fixture(scope="module")
def foreign(tmp_path_factory, tiny_text):
    """A user's folder with a tiny spec and a `studies.py` of their own, which has nothing to do with ours."""
    folder = tmp_path_factory.mktemp("foreign")
    (folder / "studies.py").write_text('raise RuntimeError("this file is none of layoutopt\'s business")\n')
    (folder / "tiny.toml").write_text(tiny_text)
    return folder


def test_the_sdist_holds_our_packages_and_what_they_are_built_from(sdist, ours):
    """Nothing of tests, docs or earlier builds is in it."""
    with tarfile.open(sdist) as archive:
        names = {name.partition("/")[2] for name in archive.getnames() if archive.getmember(name).isfile()}
    made = {name for name in names if name.startswith("layoutopt.egg-info/")} | {"PKG-INFO", "setup.cfg"}
    assert names - made == ours | set(BESIDE)


def test_the_wheel_holds_our_packages_and_its_own_description(wheel, ours):
    """Every file of the four packages is in it, the licence, and nothing else."""
    with zipfile.ZipFile(wheel) as archive:
        names = {name for name in archive.namelist() if not name.endswith("/")}
    about = f"layoutopt-{layoutopt.__version__}.dist-info"
    described = ("METADATA", "WHEEL", "RECORD", "entry_points.txt", "top_level.txt", "licenses/LICENSE")
    assert names == ours | {f"{about}/{name}" for name in described}
    assert set(MUST_BE_THERE) <= names


def test_what_is_installed_fits_together(installed, foreign):
    """The lock meets the demands of the wheel, and the package that runs is the installed one."""
    _succeeds(installed / "python", "-m", "pip", "check", "--disable-pip-version-check", cwd=foreign)
    told = _succeeds(installed / "python", "-c", "import layoutopt as lo; print(lo.__file__)", cwd=foreign)
    assert Path(told.strip()).is_relative_to(installed.parent)


def test_the_command_answers_from_a_folder_with_a_file_named_like_a_package_of_ours(installed, foreign):
    """The installed command does not look for packages in the user's folder."""
    command = installed / "layoutopt"
    assert _succeeds(command, "--version", cwd=foreign) == f"layoutopt {layoutopt.__version__}\n"
    assert "study" in _succeeds(command, "--help", cwd=foreign)
    assert "cost_vs_accuracy" in _succeeds(command, "study", "list", cwd=foreign)
    _succeeds(command, "new", "own.toml", cwd=foreign)
    assert _succeeds(command, "check", "own.toml", cwd=foreign)


def test_python_that_looks_there_first_names_the_file(installed, foreign):
    """`python -m` and a session in that folder do find the user's file, and say so."""
    python = installed / "python"
    (foreign / "harmless").mkdir()
    (foreign / "harmless" / "studies.py").write_text("x = 1\n")
    done = _run(python, "-m", "layoutopt", "study", "list", cwd=foreign / "harmless", check=False)
    assert done.returncode == 2
    assert str(foreign / "harmless" / "studies.py") in done.stderr
    asked = "import layoutopt as lo; lo.names('studies')"
    done = _run(python, "-c", asked, cwd=foreign / "harmless", check=False)
    assert f"hidden by {foreign / 'harmless' / 'studies.py'}" in done.stderr


def test_the_first_hour_passes_in_an_empty_folder(installed, tmp_path):
    """doctor, new, check, a quick look at a study, why its layout, and whom to cite."""
    command = installed / "layoutopt"
    told = _run(command, "doctor", cwd=tmp_path, check=False).stdout
    assert f"layoutopt: {layoutopt.__version__} in {installed.parent}" in told
    ours = tomllib.loads((ROOT / "layoutopt/tested_versions.toml").read_text(encoding="utf-8"))["packages"]
    assert f"packages: {len(ours)} of {len(ours)} in the versions that the tests ran with" in told
    _succeeds(command, "new", "hall.toml", "--from", "small_hall", cwd=tmp_path)
    assert "layouts" in _succeeds(command, "check", "hall.toml", cwd=tmp_path)
    study = ("study", "cost_vs_accuracy", "hall.toml", "--quick", "--jobs", "1", "--out", "out")
    assert "cheapest" in _succeeds(command, *study, cwd=tmp_path)
    assert (tmp_path / "out/report.html").stat().st_size < 5_000_000
    layout = next((tmp_path / "out/layouts").glob("*.toml"))
    assert "EUR" in _succeeds(command, "explain", layout, "--trials", "4", cwd=tmp_path)
    assert f"Version {layoutopt.__version__}." in _succeeds(command, "cite", cwd=tmp_path)


def test_a_study_runs_and_its_layout_is_drawn(installed, foreign):
    """Templates, prices and kernels came along: report, tables and sheets are written."""
    command = installed / "layoutopt"
    study = ("study", "cost_vs_accuracy", "tiny.toml", "--quick", "--jobs", "1", "--out", "out")
    _succeeds(command, *study, cwd=foreign)
    assert "Quick look" in (foreign / "out/report.html").read_text(encoding="utf-8")
    layout = next((foreign / "out/layouts").glob("*.toml"))
    _succeeds(command, "draw", layout, "--out", "drawings", cwd=foreign)
    assert (foreign / "drawings/tags.csv").stat().st_size > 0
    assert list((foreign / "drawings").glob("*.pdf"))


def test_types_are_seen_by_users(installed, foreign):
    """mypy reads the types of the installed packages and what README shows, and finds a wrong argument."""
    (foreign / "typed").mkdir()
    shown = re.search(r"```python\n(.*?)```", (ROOT / "README.md").read_text(encoding="utf-8"), re.DOTALL)
    (foreign / "typed" / "shown.py").write_text(shown.group(1))
    right = "import layoutopt as lo\nspec = lo.read_spec(lo.built_in('small_hall'))\nseed: int = spec.seed\n"
    (foreign / "typed" / "right.py").write_text(right)
    (foreign / "typed" / "wrong.py").write_text(right + "lo.Streams(seed='seven')\n")
    (foreign / "typed" / "others.py").write_text("import objectives\nimport solvers\nimport studies\n")
    environment = {**os.environ, "MYPY_CACHE_DIR": str(foreign / "typed" / "cache")}
    mypy = (installed / "python", "-m", "mypy", "--strict")
    where = {"cwd": foreign / "typed", "env": environment}
    _succeeds(*mypy, "right.py", "others.py", "shown.py", **where)
    done = _run(*mypy, "wrong.py", check=False, **where)
    assert done.returncode == 1
    assert "incompatible type" in done.stdout
