"""The site of the documentation: all pages are in it, nothing is missing, and it builds without a warning."""

import ast
import os
import re
import shutil
import subprocess
import zlib
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
PYTHON = ROOT / ".venv-docs" / "bin" / "python"
PACKAGES = ("layoutopt", "objectives", "solvers", "studies")
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
    assert sorted(named) == sorted(
        [*({page.stem for page in _pages()} - {"index"}), "auto_examples/index", "genindex"]
    )


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


def _public_names():
    """Return every public function, class and method of the packages, as the reference should name it."""
    for path in sorted(path for package in PACKAGES for path in (ROOT / package).rglob("*.py")):
        module = ".".join(path.relative_to(ROOT).with_suffix("").parts).removesuffix(".__init__")
        waiting = [(module, node) for node in ast.parse(path.read_text(encoding="utf-8")).body]
        while waiting and path.name != "__main__.py":
            owner, node = waiting.pop()
            if isinstance(node, (ast.FunctionDef, ast.ClassDef)) and not node.name.startswith("_"):
                yield f"{owner}.{node.name}"
                members = node.body if isinstance(node, ast.ClassDef) else []
                waiting += [(f"{owner}.{node.name}", member) for member in members]


def _inventory(site):
    """Return the names of Python that the built site documents, from its inventory."""
    packed = (site / "objects.inv").read_bytes().split(b"\n", 4)[4]
    return {line.split(" py:")[0] for line in zlib.decompress(packed).decode().splitlines() if " py:" in line}


@pytest.fixture(scope="module")
def site(tmp_path_factory):
    """The folder of the built site; Sphinx read every page, ran the examples, and had nothing to say."""
    folder = tmp_path_factory.mktemp("site")
    ignored = shutil.ignore_patterns("auto_examples", "generated", "__pycache__")
    shutil.copytree(DOCS, folder / "docs", ignore=ignored)
    for name in ("benchmarks", "layoutopt", "CHANGELOG.md"):
        (folder / name).symlink_to(ROOT / name)
    command = [PYTHON, "-m", "sphinx", "-W", "--keep-going", "-q", folder / "docs", folder / "site"]
    environment = {**os.environ, "MPLBACKEND": "Agg"}
    done = subprocess.run(command, env=environment, cwd=folder, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return folder / "site"


@pytest.mark.long
@pytest.mark.timeout(3600)
@pytest.mark.skipif(not PYTHON.exists(), reason="`make docs` makes the environment that Sphinx needs, .venv-docs")
class TestBuiltSite:
    """What holds of the site that Sphinx builds without a warning."""

    def test_every_page_and_example_is_there(self, site):
        """Each page of the docs is one of the site, each example of the gallery shows a picture."""
        for page in _pages():
            assert (site / f"{page.stem}.html").exists(), page
        examples = {path.stem for path in (DOCS / "examples").glob("*.py")}
        shown = {path.name for path in (site / "_images").glob("sphx_glr_*_001.png")}
        assert shown == {f"sphx_glr_{name}_001.png" for name in examples}

    def test_every_public_name_stands_in_the_index(self, site):
        """Whoever knows the name of a function, class or method of the four packages finds it."""
        names = set(_public_names())
        assert len(names) > 2000
        assert names - _inventory(site) == set()
        index = (site / "genindex.html").read_text(encoding="utf-8")
        assert [name for name in names if f'#{name}"' not in index] == []

    def test_pages_need_no_network(self, site):
        """No page loads a script, style or picture from elsewhere; formulas are set by the browser itself."""
        for page in [*site.glob("*.html"), site / "generated" / "layoutopt.layout.html"]:
            text = page.read_text(encoding="utf-8")
            assert (
                re.findall(r"<(?:script|img|link rel=\"stylesheet\")[^>]*(?:src|href)=\"(?:https?:)?//", text)
                == []
            )
            assert "MathJax" not in text
        assert "<math" in (site / "error_models.html").read_text(encoding="utf-8")
