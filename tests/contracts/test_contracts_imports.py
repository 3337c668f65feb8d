"""Where heavy packages may be imported, and what the command line loads at its start."""

import ast
import subprocess
import sys
from functools import cache
from pathlib import Path

import pytest

import layoutopt

ROOT = Path(layoutopt.__file__).parent.parent
SOURCES = sorted(
    path
    for package in ("layoutopt", "objectives", "solvers", "studies")
    for path in (ROOT / package).rglob("*.py")
)
ALLOWED = {
    "numba": lambda path: path.name.endswith("_kernels.py"),
    "ezdxf": lambda path: path.name == "dxf.py",
    "PIL": lambda path: path.as_posix().endswith("plans/png.py"),
    "pydantic": lambda path: path.parent.name == "spec",
    "cvxpy": lambda path: path.as_posix().endswith(("covering/integer.py", "solvers/relaxation.py")),
    "matplotlib": lambda path: path.parent.name in ("plots", "drawings"),
    "jinja2": lambda path: path.as_posix().endswith(
        ("studies/report.py", "studies/choices.py", "studies/page.py")
    ),
}


@cache
def _imported(path):
    """Return the packages that a file imports anywhere; every file is parsed once for all packages."""
    found = set()
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.Import):
            found |= {alias.name.partition(".")[0] for alias in node.names}
        elif isinstance(node, ast.ImportFrom) and node.module:
            found.add(node.module.partition(".")[0])
    return frozenset(found)


@pytest.mark.parametrize("package", sorted(ALLOWED))
def test_heavy_packages_stay_in_their_files(package):
    """A heavy package is imported only by the files that are meant for it."""
    offenders = [path for path in SOURCES if package in _imported(path) and not ALLOWED[package](path)]
    assert not offenders


def test_every_kernel_file_has_a_plain_twin():
    """Beside each file of compiled kernels lies the plain module that is its truth."""
    for path in SOURCES:
        if path.name.endswith("_kernels.py"):
            assert path.with_name(path.name.replace("_kernels", "")).exists(), path


def test_help_loads_nothing_heavy():
    """`layoutopt --help` imports no numerical, drawing or solver package."""
    program = (
        "import sys\nfrom layoutopt import cli\nsys.argv = ['layoutopt', '--help']\n"
        "try:\n    cli.main()\nexcept SystemExit as end:\n    assert not end.code, end.code\n"
        "heavy = {'numpy', 'scipy', 'numba', 'matplotlib', 'shapely', 'ezdxf', 'pydantic', 'jinja2', 'joblib', "
        "'cvxpy', 'highspy'}\n"
        "print('loaded:', sorted(heavy & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, check=True)
    assert done.stdout.splitlines()[-1] == "loaded: []"


def test_no_file_is_longer_than_500_lines():
    """A file of more than 500 lines has a second noun in it."""
    long = [path.name for path in SOURCES if len(path.read_text(encoding="utf-8").splitlines()) > 500]
    assert not long
