"""Docstrings of the packages: they name what is raised, and name no parameter that is not there."""

import ast
import re
from pathlib import Path

import pytest

import layoutopt
from layoutopt import errors

ROOT = Path(layoutopt.__file__).parent.parent
PACKAGES = ("layoutopt", "objectives", "solvers", "studies")
SECTION = r"{}\n-+\n(.*?)(?=\n\n?[A-Z][A-Za-z ]+\n-{{3,}}|\Z)"
CAUGHT_WITHIN = {"Unfit", "OSError", "RuntimeError"}
"""What `spec` turns into faults with their place, what the system raises, and what no input leads to."""
COMMANDS = ("cli.py", "cli_floor.py", "cli_help.py", "cli_parts.py")
"""Their docstrings are the help of the command line, which ends every error in a message."""


def _documented(text):
    """Return every public function, method and class of a module's text with its docstring and its class."""
    waiting = [(node, None) for node in ast.parse(text).body]
    while waiting:
        node, owner = waiting.pop()
        if isinstance(node, (ast.FunctionDef, ast.ClassDef)) and not node.name.startswith("_"):
            yield node, owner, ast.get_docstring(node) or ""
        if isinstance(node, ast.ClassDef) and not node.name.startswith("_"):
            waiting += [(member, node) for member in node.body]


def _section(docstring, name):
    found = re.search(SECTION.format(name), docstring, re.DOTALL)
    return found[1] if found else ""


def _named(section):
    """Return the names at the begin of the entries of a section."""
    heads = [line for line in section.splitlines() if line and not line.startswith(" ")]
    return [word.strip(" *`") for line in heads for word in line.partition(":")[0].split(",")]


def _parameters(node):
    """Return the names that a function, or the constructor or fields of a class, take."""
    if isinstance(node, ast.FunctionDef):
        arguments = node.args
        every = [*arguments.posonlyargs, *arguments.args, *arguments.kwonlyargs, arguments.vararg, arguments.kwarg]
        return {argument.arg for argument in every if argument}
    fields = {line.target.id for line in node.body if isinstance(line, ast.AnnAssign)}
    makers = [one for one in node.body if isinstance(one, ast.FunctionDef) and one.name == "__init__"]
    return fields.union(*(_parameters(one) for one in makers))


def _raised(node):
    """Return the names of the exceptions that a function itself raises and does not catch."""
    if not isinstance(node, ast.FunctionDef):
        return set()
    found, waiting = set(), list(node.body)
    while waiting:
        inner = waiting.pop()
        if isinstance(inner, (ast.FunctionDef, ast.ClassDef, ast.Lambda)):
            continue
        if isinstance(inner, ast.Try) and inner.handlers:
            waiting += [*inner.handlers, *inner.orelse, *inner.finalbody]
            continue
        if isinstance(inner, ast.Raise) and inner.exc is not None:
            error = inner.exc.func if isinstance(inner.exc, ast.Call) else inner.exc
            error = error.value if isinstance(error, ast.Attribute) else error
            if isinstance(error, ast.Name) and error.id[:1].isupper():
                found.add(error.id)
        waiting += ast.iter_child_nodes(inner)
    return found


def _told(error, told):
    """Return whether an exception is told by its name, or by that of one of which it is a kind."""
    kinds = {kind.__name__ for kind in getattr(getattr(errors, error, None), "__mro__", ())}
    return bool(({error} | kinds) & told)


def _faults(text):
    """Return what is wrong with the docstrings of a module, one sentence each."""
    for node, owner, docstring in _documented(text):
        name = f"{owner.name}.{node.name}" if owner else node.name
        if "Parameters\n---" in docstring:
            strange = set(_named(_section(docstring, "Parameters"))) - _parameters(node)
            if strange:
                yield f"{name} documents parameters that it does not take: {sorted(strange)}"
        told = set(_named(_section(docstring, "Raises")))
        missing = {error for error in _raised(node) - CAUGHT_WITHIN if not _told(error, told)}
        if missing:
            yield f"{name} does not say under Raises: {sorted(missing)}"


@pytest.mark.parametrize("package", PACKAGES)
def test_docstrings_say_what_is_raised_and_name_real_parameters(package):
    """Every public function and class; that there is a docstring at all is the linter's."""
    paths = [path for path in sorted((ROOT / package).rglob("*.py")) if path.name not in COMMANDS]
    assert len(paths) > 20
    faults = [
        f"{path.relative_to(ROOT)}: {fault}"
        for path in paths
        for fault in _faults(path.read_text(encoding="utf-8"))
    ]
    assert faults == []


BAD = '''
def gone(here):
    """Do.

    Parameters
    ----------
    there
        A place.
    """

def loud():
    """Do."""
    raise ValueError("no")
'''


def test_a_stale_parameter_and_an_untold_error_are_found():
    """The test above can fail."""
    assert len(list(_faults(BAD))) == 2
