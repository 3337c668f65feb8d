"""What docs/security.md promises of the sources: no evaluation, pickle, program, network or common folder."""

import ast
import re
from pathlib import Path

import pytest

ROOT = Path(__file__).resolve().parents[2]
PACKAGES = ("layoutopt", "objectives", "solvers", "studies")
SOURCES = [path for package in PACKAGES for path in sorted((ROOT / package).rglob("*.py"))]
FORBIDDEN_MODULES = {
    "pickle", "cPickle", "_pickle", "dill", "cloudpickle", "marshal", "shelve", "dbm", "copyreg", "tempfile",
    "subprocess", "multiprocessing", "ssl", "http", "requests", "httpx", "aiohttp", "urllib3", "ftplib", "smtplib",
    "telnetlib", "poplib", "imaplib", "xmlrpc", "socketserver", "webbrowser", "ctypes", "cffi", "code", "codeop",
    "runpy", "pty", "zipimport", "xml", "pdb", "antigravity",
}  # fmt: skip
FORBIDDEN_CALLS = {"eval", "exec", "compile", "__import__", "breakpoint"}
FORBIDDEN_OF_OS = re.compile(r"system|popen|exec\w*|spawn\w*|posix_spawnp?|fork\w*|startfile")
ALLOWED_OF_JOBLIB = {"parallel_config", "Parallel", "delayed", "effective_n_jobs", "register_parallel_backend"}
ALLOWED_OF_YAML = {"safe_load", "safe_dump", "compose", "SafeLoader", "YAMLError"}
ALLOWED_NODES_OF_YAML = {"Node", "ScalarNode", "SequenceNode", "MappingNode"}


def dotted(node):
    """Return the name of an expression such as ``os.path.join``; empty for anything else."""
    if isinstance(node, ast.Attribute):
        inner = dotted(node.value)
        return f"{inner}.{node.attr}" if inner else ""
    return node.id if isinstance(node, ast.Name) else ""


def breaches(path):
    """Yield what a source file does that the promises rule out."""
    tree = ast.parse(path.read_text(encoding="utf-8"))
    for node in ast.walk(tree):
        modules = []
        if isinstance(node, ast.Import):
            modules = [name.name for name in node.names]
        elif isinstance(node, ast.ImportFrom):
            modules = [node.module or "", *(f"{node.module}.{name.name}" for name in node.names)]
        for module in modules:
            if module.partition(".")[0] in FORBIDDEN_MODULES or module.startswith(
                ("urllib.request", "urllib.error")
            ):
                yield f"imports {module}"
            if module == "socket" and path.name != "status.py":
                yield "imports socket"
            if module.startswith(("distributed", "dask")) and path.name != "cluster.py":
                yield f"imports {module}"
        if isinstance(node, ast.Call):
            name = dotted(node.func)
            if name in FORBIDDEN_CALLS:
                yield f"calls {name}"
            # Tables of names, pictures for notebooks, and doctor, which walks over our own kernels.
            known = ("registry.py", "__init__.py", "shown.py", "doctor.py")
            if name.startswith("importlib.import_module") and path.name not in known:
                yield "imports by name"
            if name.endswith((".load", ".loads")) and name.partition(".")[0] in ("np", "numpy", "joblib", "torch"):
                yield f"calls {name}"
            for keyword in node.keywords:
                if keyword.arg in ("shell", "allow_pickle"):
                    yield f"gives {keyword.arg}"
                if keyword.arg == "autoescape" and not (
                    isinstance(keyword.value, ast.Constant) and keyword.value.value is True
                ):
                    yield "turns off escaping"
                if keyword.arg == "Loader" and dotted(keyword.value) != "yaml.SafeLoader":
                    yield "loads YAML that makes objects"
        if isinstance(node, ast.Attribute):
            owner, _, name = dotted(node).rpartition(".")
            if owner == "os" and FORBIDDEN_OF_OS.fullmatch(name):
                yield f"uses os.{name}"
            if owner == "yaml" and name not in ALLOWED_OF_YAML | ALLOWED_NODES_OF_YAML:
                yield f"uses yaml.{name}"
            if owner == "joblib" and name not in ALLOWED_OF_JOBLIB:
                yield f"uses joblib.{name}"
            if owner == "socket" and name != "gethostname":
                yield f"uses socket.{name}"


@pytest.mark.parametrize("path", SOURCES, ids=lambda path: path.relative_to(ROOT).as_posix())
def test_sources_keep_the_promises(path):
    """No source evaluates text, pickles, starts programs, talks to a network or makes files in a common folder."""
    assert list(breaches(path)) == []


@pytest.mark.parametrize(
    "text",
    [
        "import pickle",
        "from multiprocessing import Pool",
        "import urllib.request",
        "from urllib import request",
        "eval('1')",
        "import os\nos.system('x')",
        "import os\nos.execvp('x', [])",
        "import numpy as np\nnp.load('x')",
        "f('x', shell=True)",
        "import yaml\nyaml.load('x')",
        "import yaml\nyaml.compose('x', Loader=yaml.Loader)",
        "import joblib\njoblib.Memory('x')",
        "import importlib\nimportlib.import_module('x')",
        "Environment(autoescape=False)",
        "import socket\nsocket.socket()",
    ],
)
def test_breaches_are_found(tmp_path, text):
    """Each kind of breach is seen in a source that commits it."""
    (tmp_path / "source.py").write_text(text, encoding="utf-8")
    assert list(breaches(tmp_path / "source.py"))


def test_the_document_names_tests_that_exist():
    """Every test that docs/security.md names is there, and so is every file of tests."""
    text = (ROOT / "docs" / "security.md").read_text(encoding="utf-8")
    sources = {path.name: path.read_text(encoding="utf-8") for path in (ROOT / "tests").rglob("test_*.py")}
    files = set(re.findall(r"\btest_\w+\.py\b", text))
    assert files <= set(sources)
    named = set(re.findall(r"`(test_\w+)`", text))
    everything = "\n".join(sources.values())
    assert len(named) > 20
    assert not [name for name in named if f"def {name}(" not in everything]
