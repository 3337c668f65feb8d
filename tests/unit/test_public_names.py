"""The names that ``import layoutopt as lo`` offers."""

import ast
import subprocess
import sys
from pathlib import Path

import pytest

import layoutopt


@pytest.mark.parametrize("name", layoutopt.__all__)
def test_every_public_name_loads(name):
    """A name of ``__all__`` is there and documented."""
    assert getattr(layoutopt, name).__doc__


def test_an_unknown_name_is_an_attribute_error():
    """A misspelt name fails like any other attribute."""
    with pytest.raises(AttributeError, match="layot"):
        _ = layoutopt.layot


def test_importing_the_package_loads_nothing_else():
    """`import layoutopt` alone brings no numerical package."""
    program = "import sys, layoutopt; print({'numpy', 'shapely', 'scipy'} & set(sys.modules))"
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "set()"


def test_type_checkers_see_the_same_names():
    """The names imported for type checkers are exactly those that load at run time."""
    tree = ast.parse(Path(layoutopt.__file__).read_text(encoding="utf-8"))
    block = next(node for node in tree.body if isinstance(node, ast.If))
    seen = {alias.asname for node in block.body if isinstance(node, ast.ImportFrom) for alias in node.names}
    assert seen == set(layoutopt.__all__)
