"""The site of the documentation: all pages are in it, nothing is missing, and it builds without a warning."""

import os
import re
import shutil
import subprocess
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
PYTHON = ROOT / ".venv-docs" / "bin" / "python"
NO_WORD = re.compile(r"[^\w\- ]")


def _pages():
    return sorted(DOCS.glob("*.md"))


def _prose(page):
    """Return a page without its blocks of code."""
    return re.sub(r"(?ms)^```.*?^```$", "", page.read_text(encoding="utf-8"))


def _anchors(page):
    """Return the anchors of the headings of a page, made as GitHub and MyST make them."""
    return {
        NO_WORD.sub("", heading.lower().replace("`", "")).replace(" ", "-")
        for heading in re.findall(r"(?m)^#+ (.*)$", _prose(page))
    }


def _links(page):
    """Return file and anchor of every relative link of a page."""
    for target in re.findall(r"\]\(([^)\s]+)\)", _prose(page)):
        if "://" not in target:
            name, _, anchor = target.partition("#")
            yield name, anchor


def test_every_page_is_in_the_table_of_contents_once():
    """No page is lost, none is named that is not there."""
    tables = re.findall(r"(?ms)^```\{toctree\}\n(.*?)^```$", (DOCS / "index.md").read_text(encoding="utf-8"))
    lines = [line for table in tables for line in table.splitlines() if line and not line.startswith(":")]
    named = [re.sub(r".*<(.*)>", r"\1", line) for line in lines]
    assert sorted(named) == sorted([*({page.stem for page in _pages()} - {"index"}), "auto_examples/index"])


def test_every_relative_link_leads_to_a_file_and_a_heading():
    """Files, pictures and headings that pages point at exist; the long test asks Sphinx the same."""
    found = [(page, *link) for page in _pages() for link in _links(page)]
    assert len(found) > 100
    for page, name, anchor in found:
        target = page.parent / name if name else page
        assert target.exists(), f"{page.name}: {name}"
        assert not anchor or anchor in _anchors(target), f"{page.name}: {name}#{anchor}"


def test_pictures_are_small():
    """A picture over a megabyte is too large for the repository."""
    for picture in (DOCS / "pictures").iterdir():
        assert picture.stat().st_size < 1_000_000, picture


@pytest.mark.long
@pytest.mark.timeout(1800)
@pytest.mark.skipif(not PYTHON.exists(), reason="`make docs` makes the environment that Sphinx needs, .venv-docs")
def test_the_site_builds_without_a_warning(tmp_path):
    """Sphinx reads every page, runs the examples, documents every module, and has nothing to say."""
    ignored = shutil.ignore_patterns("auto_examples", "generated", "__pycache__")
    shutil.copytree(DOCS, tmp_path / "docs", ignore=ignored)
    for name in ("benchmarks", "layoutopt", "CHANGELOG.md"):
        (tmp_path / name).symlink_to(ROOT / name)
    command = [PYTHON, "-m", "sphinx", "-W", "--keep-going", "-q", tmp_path / "docs", tmp_path / "site"]
    environment = {**os.environ, "MPLBACKEND": "Agg"}
    done = subprocess.run(command, env=environment, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    assert (tmp_path / "site" / "generated" / "layoutopt.layout.html").exists()
    for page in {page.stem for page in _pages()}:
        assert (tmp_path / "site" / f"{page}.html").exists(), page
    assert len(list((tmp_path / "site" / "_images").glob("sphx_glr_*_001.png"))) == 5
