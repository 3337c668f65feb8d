"""What a release says of itself: version, citation, changelog, data files, bounds of dependencies, workflows."""

import fnmatch
import re
import tomllib
from importlib import metadata
from pathlib import Path

import pytest
import yaml
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name
from packaging.version import Version

import layoutopt

ROOT = Path(layoutopt.__file__).parent.parent
PACKAGES = ("layoutopt", "objectives", "solvers", "studies")
PROJECT = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))
WORKFLOWS = sorted((ROOT / ".github/workflows").glob("*.yml"))
CITATION_KEYS = {
    *(
        "abstract",
        "authors",
        "cff-version",
        "commit",
        "contact",
        "date-released",
        "doi",
        "identifiers",
        "keywords",
    ),
    *(
        "license",
        "license-url",
        "message",
        "preferred-citation",
        "references",
        "repository",
        "repository-artifact",
    ),
    *("repository-code", "title", "type", "url", "version"),
}
"""All keys of the schema of CITATION.cff, version 1.2.0; the first four below it demands."""
CHANGE_KINDS = ["Added", "Changed", "Fixed", "Numbers that changed"]


def _needed():
    extra = [line for lines in PROJECT["project"]["optional-dependencies"].values() for line in lines]
    return [Requirement(line) for line in (*PROJECT["project"]["dependencies"], *extra)]


def _pinned(name):
    lines = (ROOT / name).read_text(encoding="utf-8").splitlines()
    pins = [Requirement(line) for line in lines if line and not line.startswith("#")]
    return {canonicalize_name(pin.name): Version(str(pin.specifier).removeprefix("==")) for pin in pins}


def test_the_version_is_semantic_and_stands_in_one_place():
    """Package, its metadata and the citation agree; pyproject reads the version from the package."""
    assert re.fullmatch(r"\d+\.\d+\.\d+(-[0-9A-Za-z.-]+)?", layoutopt.__version__)
    assert metadata.version("layoutopt") == layoutopt.__version__
    assert "version" not in PROJECT["project"]
    assert PROJECT["project"]["dynamic"] == ["version"]
    assert PROJECT["tool"]["setuptools"]["dynamic"]["version"] == {"attr": "layoutopt.__version__"}


def test_the_citation_has_what_its_schema_demands():
    """Required fields of Citation File Format 1.2.0, no unknown ones, each author with a name, and our version."""
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text(encoding="utf-8"))
    assert {"authors", "cff-version", "message", "title"} <= set(citation) <= CITATION_KEYS
    assert citation["cff-version"] == "1.2.0"
    assert citation["type"] in ("software", "dataset")
    assert citation["version"] == layoutopt.__version__
    assert citation["license"] == PROJECT["project"]["license"]
    assert citation["authors"]
    assert all("name" in author or {"family-names", "given-names"} & set(author) for author in citation["authors"])


def _changes():
    """Return by version the kinds of changes and their entries, in the order of the file."""
    found = {}
    for line in (ROOT / "CHANGELOG.md").read_text(encoding="utf-8").splitlines():
        if line.startswith("## "):
            found[line.removeprefix("## ")] = kinds = []
        elif line.startswith("### "):
            kinds.append((line.removeprefix("### "), entries := []))
        elif line.startswith("- "):
            entries.append(line)
        elif line.startswith("  "):
            entries[-1] += line[1:]
        else:
            assert not line or not found, f"neither an entry nor its next line: {line}"
    return found


def test_the_changelog_has_its_form():
    """Newest version first, with a date or none yet; kinds in their order, with entries that are sentences."""
    changes = _changes()
    versions = []
    for title, kinds in changes.items():
        version, when = re.fullmatch(r"(\S+), (not released yet|\d{4}-\d\d-\d\d)", title).groups()
        versions.append(Version(version))
        names = [kind for kind, _ in kinds]
        assert names == [kind for kind in CHANGE_KINDS if kind in names]
        assert names[-1] == "Numbers that changed", (
            f"{version} does not say which numbers changed, or that none did"
        )
        assert all(entries for _, entries in kinds)
        unended = [entry for _, entries in kinds for entry in entries if not entry.endswith(".")]
        assert not unended
        assert when == "not released yet" or Version(version) <= Version(layoutopt.__version__)
    assert versions == sorted(set(versions), reverse=True)
    assert versions[0] == Version(layoutopt.__version__)


def test_every_data_file_is_packed():
    """What lies in our packages beside Python is named in the package data, and all names there name something."""
    packed = PROJECT["tool"]["setuptools"]["package-data"]
    for package in PACKAGES:
        patterns = [*packed["*"], *packed.get(package, ())]
        files = [
            path.relative_to(ROOT / package).as_posix()
            for path in (ROOT / package).rglob("*")
            if path.is_file() and path.suffix != ".py" and "__pycache__" not in path.parts
        ]
        assert "py.typed" in files
        assert not [name for name in files if not any(_matches(name, pattern) for pattern in patterns)]
        assert not [pattern for pattern in patterns if not any(_matches(name, pattern) for name in files)]


def _matches(name, pattern):
    return name.count("/") == pattern.count("/") and fnmatch.fnmatchcase(name, pattern)


def test_locks_hold_every_dependency():
    """Those of every day lie within our bounds; the oldest ones are the lower bounds themselves."""
    today, oldest = _pinned("requirements.lock"), _pinned("requirements-oldest.lock")
    for needed in _needed():
        name = canonicalize_name(needed.name)
        assert needed.specifier.contains(today[name]), needed
        (lower,) = (Version(item.version) for item in needed.specifier if item.operator == ">=")
        assert oldest[name] == lower, needed


def test_newest_versions_come_with_what_builds_us():
    """pip keeps the setuptools of a new environment unless a bound is stated, and that one cannot read us."""
    lines = (ROOT / "requirements-latest.txt").read_text(encoding="utf-8").splitlines()
    stated = {line.partition("#")[0].strip() for line in lines}
    assert set(PROJECT["build-system"]["requires"]) <= stated


@pytest.mark.parametrize("path", WORKFLOWS, ids=lambda path: path.name)
def test_workflows_call_targets_that_exist(path):
    """Each job is on a machine with Python of our version and runs targets of our Makefile and nothing else."""
    workflow = yaml.safe_load(path.read_text(encoding="utf-8"))
    targets = set(re.findall(r"^([a-z-]+):", (ROOT / "Makefile").read_text(encoding="utf-8"), flags=re.MULTILINE))
    # YAML 1.1 reads the bare key `on` as a truth value.
    assert workflow.keys() - {"concurrency"} == {"name", True, "permissions", "jobs"}
    assert workflow[True]
    for job in workflow["jobs"].values():
        python = [
            step["with"]["python-version"] for step in job["steps"] if "setup-python" in step.get("uses", "")
        ]
        assert python == [PROJECT["project"]["requires-python"].removeprefix(">=")]
        commands = [step["run"] for step in job["steps"] if "run" in step]
        called = [target for command in commands for target in _targets(command, job)]
        assert called
        assert set(called) <= targets


def _targets(command, job):
    """Return the targets of ``make TARGET``, which may be those of the job's matrix."""
    target = command.removeprefix("make ")
    return job["strategy"]["matrix"]["target"] if target == "${{ matrix.target }}" else [target]


@pytest.mark.parametrize("path", WORKFLOWS, ids=lambda path: path.name)
def test_workflows_name_actions_by_commit(path):
    """A tag can be moved to other code, a commit cannot; the version beside it is for people."""
    used = re.findall(r"uses: (.*)", path.read_text(encoding="utf-8"))
    assert used
    assert not [line for line in used if not re.fullmatch(r"[\w/-]+@[0-9a-f]{40}  # v\d+\.\d+\.\d+", line)]


def test_workflows_check_whatever_a_change_can_break():
    """A change meets every quick check with both ends of our dependencies, and once a week come the long tests."""
    jobs = {path.stem: yaml.safe_load(path.read_text(encoding="utf-8"))["jobs"] for path in WORKFLOWS}
    asked = set(jobs["checks"]["check"]["strategy"]["matrix"]["target"])
    assert asked == {"lint", "types", "tests", "tests-oldest", "tests-latest", "docs", "dist"}
    assert {"run": "make test-all"} in jobs["everything"]["test-all"]["steps"]


def test_classifiers_promise_no_python_that_workflows_do_not_run():
    """Versions stand in the classifiers only where every job runs them."""
    versions = re.findall(r"Python :: (\d\.\d+)", "\n".join(PROJECT["project"]["classifiers"]))
    assert versions == [PROJECT["project"]["requires-python"].removeprefix(">=")]
