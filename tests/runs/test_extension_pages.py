"""A pattern and an objective are added just as the pages say, in a copy, and keep the contracts."""

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


def _added(path, table, rows):
    """Write rows to the begin of a table of a file."""
    text = path.read_text(encoding="utf-8")
    (head,) = re.findall(rf"(?m)^{table}\b[^\n]*= \{{\n|^{table}\b[^\n]*\(\n? *\{{\n", text)
    path.write_text(text.replace(head, head + rows), encoding="utf-8")


@pytest.mark.long
@pytest.mark.parametrize("point", ["pattern", "objective"])
def test_what_a_page_adds_keeps_the_contracts(tmp_path, point):
    """One file, the rows and the example of the page; then the contract tests and a spec that uses it."""
    page = (ROOT / "docs" / f"my_{point}.md").read_text(encoding="utf-8")
    for name in ("layoutopt", "objectives", "solvers", "studies", "tests"):
        shutil.copytree(ROOT / name, tmp_path / name)  # with what is compiled, which takes a minute
    shutil.copy(ROOT / "pyproject.toml", tmp_path)
    (written,) = FILE.findall(page)
    (tmp_path / written[0]).write_text(written[1], encoding="utf-8")
    places = [*PLACE.findall(page), *UNITS.findall(page)]
    assert len(places) == {"pattern": 2, "objective": 4}[point]
    for name, table, rows in places:
        _added(tmp_path / name, table, rows)
    environment = {**os.environ, "PYTHONPATH": str(tmp_path)}
    (tests,) = re.findall(r"\$ \.venv/bin/python -m (pytest [^\n]*)", page)
    command = [sys.executable, "-m", *tests.split(), "-p", "no:xdist", "-p", "no:cacheprovider", "-q"]
    done = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout
    used = re.findall(r"```toml\n(\[(?:space|goal)\]\n.*?)```", page, re.DOTALL)[0]
    spec = f"{used}\n[site]\nfloor = [[0, 0], [4, 0], [4, 3], [0, 3]]\n"
    (tmp_path / "mine.toml").write_text(spec, encoding="utf-8")
    command = [sys.executable, "-m", "layoutopt", "check", "mine.toml"]
    done = subprocess.run(command, cwd=tmp_path, env=environment, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert "layouts: " in done.stdout
