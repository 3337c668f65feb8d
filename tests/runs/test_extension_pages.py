"""Each kind of extension is added just as the pages say, in a copy of the project, and keeps the contracts."""

import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
PLACE = re.compile(r"In `([^`]+)`, [^\n]*?among the `(\w+)`[^`]*?:\n\n```python\n(.*?)```", re.DOTALL)
UNITS = re.compile(r"In `(layoutopt/scores.py)`,[^`]*`(EXACT_UNITS)`:\n\n```python\n(.*?)```", re.DOTALL)
FILE = re.compile(r"Save this as `([^`]+)`:\n\n```python\n(.*?)```", re.DOTALL)
PACKAGES = ("layoutopt", "objectives", "solvers", "studies")
FLOOR = "\n[site]\nfloor = [[0, 0], [4, 0], [4, 3], [0, 3]]\n"
CORNERS = "0 0\n4 0\n4 3\n0 3\n"
PLACES = {
    "My pattern": 2,
    "My objective": 4,
    "A reader family": 4,
    "An antenna model": 2,
    "An estimator of the robot's pose": 1,
    "An estimator of a target": 1,
    "An estimator of a bearing": 1,
    "A solver": 1,
    "A study": 1,
    "A plan reader": 2,
}
"""Tables of the project that each kind has a row added to."""


def _texts():
    """Return by title the text on each kind: two pages of their own, and the sections of a third."""
    pages = [(ROOT / "docs" / f"{name}.md").read_text(encoding="utf-8") for name in ("my_pattern", "my_objective")]
    texts = [page.removeprefix("# ") for page in pages]
    texts += (ROOT / "docs" / "extensions.md").read_text(encoding="utf-8").split("\n## ")[1:]
    return {text.partition("\n")[0]: text for text in texts}


def _added(path, table, rows):
    """Write rows to the begin of a table of a file."""
    text = path.read_text(encoding="utf-8")
    (head,) = re.findall(rf"(?m)^{table}\b[^\n]*= \{{\n|^{table}\b[^\n]*\(\n? *\{{\n", text)
    path.write_text(text.replace(head, head + rows), encoding="utf-8")


@pytest.fixture(scope="module")
def copy(tmp_path_factory):
    """A copy of the project with what is compiled, which takes a minute."""
    folder = tmp_path_factory.mktemp("copy")
    for name in (*PACKAGES, "tests"):
        shutil.copytree(ROOT / name, folder / name)
    shutil.copytree(ROOT / "docs", folder / "docs", ignore=shutil.ignore_patterns("auto_examples", "generated"))
    shutil.copy(ROOT / "pyproject.toml", folder)
    return folder


@pytest.fixture
def extended(copy, request):
    """The copy with all that the text of one kind adds; afterwards it is as it was."""
    text = _texts()[request.param]
    (written,) = FILE.findall(text)
    places = [*PLACE.findall(text), *UNITS.findall(text)]
    assert len(places) == PLACES[request.param]
    (copy / written[0]).write_text(written[1], encoding="utf-8")
    for name, table, rows in places:
        _added(copy / name, table, rows)
    yield copy, text, written[0]
    (copy / written[0]).unlink()
    for name, _, _ in places:
        shutil.copy2(ROOT / name, copy / name)


def _run(folder, *command):
    """Run a command in the copy, on the packages of the copy."""
    environment = {**os.environ, "PYTHONPATH": str(folder)}
    return subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, check=False)


def test_every_kind_of_extension_has_its_text():
    """One text a kind, the three kinds of estimators apart; an extension point that is added needs one too."""
    texts = _texts()
    assert list(texts) == list(PLACES)
    added_to = {Path(FILE.findall(text)[0][0]).parent.as_posix() for text in texts.values()}
    points = {f"layoutopt/{name}" for name in ("patterns", "readers", "antennas", "estimators", "plans")}
    assert added_to == {*points, "objectives", "solvers", "studies"}


@pytest.mark.long
@pytest.mark.parametrize("extended", PLACES, indirect=True)
def test_what_a_page_adds_keeps_the_contracts(extended):
    """One file, the rows and the example of the page; then contract tests, linter, and a spec that uses it."""
    folder, text, written = extended
    commands = re.findall(r"\$ \.venv/bin/python -m (pytest [^\n]*)", text)
    assert commands
    for command in commands:
        done = _run(
            folder, sys.executable, "-m", *command.split(), "-p", "no:xdist", "-p", "no:cacheprovider", "-q"
        )
        assert done.returncode == 0, done.stdout
    done = _run(folder, sys.executable, "-m", "ruff", "check", "--no-cache", written)
    assert done.returncode == 0, done.stdout
    for used in re.findall(r"```toml\n(\[(?:space|goal|study|site)\]\n.*?)```", text, re.DOTALL)[:1]:
        spec = used if "[site]" in used else f"{used}{FLOOR}"
        (folder / "mine.toml").write_text(spec, encoding="utf-8")
        (folder / "hall.txt").write_text(CORNERS, encoding="utf-8")
        done = _run(folder, sys.executable, "-m", "layoutopt", "check", "mine.toml")
        assert done.returncode == 0, done.stderr
        assert "layouts: " in done.stdout
