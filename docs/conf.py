"""How Sphinx builds the site: ``make docs``, from an environment made of docs/requirements.txt."""

import inspect
import re
import sys
from pathlib import Path
from typing import get_origin

from docutils import nodes
from docutils.utils.math.latex2mathml import tex2mathml
from pygments.lexers.special import TextLexer
from sphinx.application import Sphinx
from sphinx.ext import autosummary
from sphinx.writers.html5 import HTML5Translator

import layoutopt

sys.path.insert(0, str(Path(__file__).parent))  # for example_figures

project = "layoutopt"
author = "the authors of layoutopt"
project_copyright = "the authors of layoutopt, BSD-3-Clause"
release = version = layoutopt.__version__

extensions = [
    "myst_parser",
    "sphinx.ext.autodoc",
    "sphinx.ext.autosummary",
    "numpydoc",
    "sphinx_gallery.gen_gallery",
]
exclude_patterns = ["examples", "sg_execution_times.rst", "auto_examples/sg_execution_times.rst"]
templates_path = ["templates"]
highlight_language = "none"
default_role = "py:obj"
myst_heading_anchors = 4
myst_enable_extensions = ["dollarmath"]

autosummary_generate = True
autosummary_mock_imports = ["layoutopt.__main__"]  # would run the command line
autosummary.WELL_KNOWN_ABBREVIATIONS += ("Eq.", "Fig.")  # the first sentence does not end there
autodoc_member_order = "bysource"
autodoc_default_options = {"members": True}
numpydoc_show_class_members = False
# Annotations are looked up by their last name, which several modules may have.
# Modules are in no tree of contents, see below; that pages are, a test of ours looks at.
suppress_warnings = ["ref.python", "toc.not_included"]

html_theme = "furo"
html_math_renderer = "mathml"  # MathJax would be fetched from the network
html_title = f"layoutopt {release}"
html_copy_source = False

PAGES = {"../benchmarks/README.md": "benchmarks.md", "../CHANGELOG.md": "changelog.md"}
"""Files of the repository that are pages of the site under another name."""
ARRAY_NAMES = {"float64": "FloatArray", "int64": "IntArray", "bool": "BoolArray"}
ARRAY = re.compile(
    rf"~numpy\.ndarray\[tuple\[~typing\.Any, \.\.\.\], ~numpy\.dtype\[~numpy\.({'|'.join(ARRAY_NAMES)})\]\]"
)
"""What the names of arrays in ``layoutopt.identity`` are written out as."""
OUTSIDE = re.compile(r"\[([^\]]*)\]\((\.\./[^)#]+)\)")
"""A link of a page to a file of the repository beside the pages."""
NAMED = re.compile(r"\[(\w+)\.md\]\((\1\.md[^)\s]*)\)")
"""A link that shows the name of the page's file, as it is read in the repository."""


def link_within_site(app: Sphinx, name: str, source: list[str]) -> None:
    """Make of a link to a file beside the pages one to a page, or the path of the file: the site stands alone.

    Links that show the name of a page's file show its title instead.
    """

    def instead(link: re.Match[str]) -> str:
        words, target = link[1], link[2]
        return f"[{words}]({PAGES[target]})" if target in PAGES else f"{words} (`{target.removeprefix('../')}`)"

    source[0] = NAMED.sub(r"[](\2)", OUTSIDE.sub(instead, source[0]))


sphinx_gallery_conf = {
    "examples_dirs": ["examples"],
    "gallery_dirs": ["auto_examples"],
    "filename_pattern": r"\.py$",
    "image_scrapers": ("example_figures.draw_figures",),
    "reset_modules": (),
    "download_all_examples": False,
    "show_memory": False,
    "show_signature": False,
    "min_reported_time": 3600,
    "only_warn_on_example_error": False,
}


def is_alias(app: Sphinx, what: str, name: str, value: object, skip: bool, options: object) -> bool:
    """Leave out names for types, of which autodoc would show the docstring of ``tuple``."""
    return skip or get_origin(value) is not None


def bars_as_written(app: Sphinx, what: str, name: str, value: object, options: object, lines: list[str]) -> None:
    """Keep the bars of ``|x|`` in docstrings, where they stand for a length, from naming a substitution."""
    for number, line in enumerate(lines):
        if ">>>" not in line:
            parts = re.split(r"(``[^`]*``|`[^`]*`)", line)
            lines[number] = "".join(part if part[:1] == "`" else part.replace("|", r"\|") for part in parts)


def without_field_numbers(
    app: Sphinx, what: str, name: str, value: object, options: object, lines: list[str]
) -> None:
    """Leave out what Python says of a field of a named tuple: its number."""
    if "".join(lines).strip().startswith("Alias for field number"):
        lines.clear()


def table_of_names(app: Sphinx, what: str, name: str, value: object, options: object, lines: list[str]) -> None:
    """Let a module's docstring end with a table of its functions and classes, before each comes at length."""
    if what == "module":
        named = {key: member for key, member in vars(value).items() if not key.startswith("_")}
        own = [key for key, member in named.items() if getattr(member, "__module__", "") == name and key != "CARD"]
        rows = [key for key in own if inspect.isclass(named[key]) or inspect.isroutine(named[key])]
        if rows:
            lines += ["", ".. autosummary::", "   :nosignatures:", "", *(f"   {key}" for key in rows), ""]


def arrays_by_name(
    app: Sphinx, what: str, name: str, value: object, options: object, signature: str | None, returned: str | None
) -> tuple[str | None, str | None]:
    """Write arrays in signatures as the code does: ``FloatArray`` for what it stands for."""

    def named(text: str | None) -> str | None:
        return text and ARRAY.sub(lambda found: ARRAY_NAMES[found[1]], text)

    return named(signature), named(returned)


def without_tree_of_modules(app: Sphinx, doctree: nodes.document) -> None:
    """Keep hundreds of modules out of the navigation, which every page repeats; tables link to them."""
    for tree in list(doctree.findall(autosummary.autosummary_toc)):
        tree.parent.remove(tree)


def formula_in_line(writer: HTML5Translator, node: nodes.math) -> None:
    """Write a formula as MathML, which browsers set themselves."""
    writer.body.append(tex2mathml(node.astext()))
    raise nodes.SkipNode


def formula_of_its_own(writer: HTML5Translator, node: nodes.math_block) -> None:
    """Write a formula between paragraphs as MathML; one that is too wide scrolls."""
    formula = tex2mathml(node.astext(), as_block=True)
    writer.body.append(f'<div class="math-wrapper"><div class="math">{formula}</div></div>')
    raise nodes.SkipNode


def without_stale_modules(app: Sphinx) -> None:
    """Drop the pages that an earlier build made of modules that are gone: autosummary only adds."""
    for page in Path(app.srcdir, "generated").glob("*.rst"):
        parts = Path(layoutopt.__file__).parents[1].joinpath(*page.stem.split("."))
        if not parts.with_suffix(".py").exists() and not (parts / "__init__.py").exists():
            page.unlink()


def setup(app: Sphinx) -> None:
    """Tell Sphinx what no setting says."""
    app.connect("builder-inited", without_stale_modules, priority=100)  # before autosummary writes pages
    app.add_html_math_renderer("mathml", (formula_in_line, None), (formula_of_its_own, None))
    app.connect("source-read", link_within_site)
    app.connect("doctree-read", without_tree_of_modules, priority=100)  # before Sphinx collects the tree
    app.connect("autodoc-skip-member", is_alias)
    app.connect("autodoc-process-signature", arrays_by_name)
    app.connect("autodoc-process-docstring", bars_as_written)
    app.connect("autodoc-process-docstring", without_field_numbers)
    app.connect("autodoc-process-docstring", table_of_names, priority=900)  # after numpydoc has read it
    app.add_lexer("csv", TextLexer)
