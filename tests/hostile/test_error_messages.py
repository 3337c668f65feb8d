"""Every message about what a user gave says where, what, and what would be right."""

import ast
import json
import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

import layoutopt

ROOT = Path(layoutopt.__file__).parent.parent
SOURCES = sorted(
    path
    for package in ("layoutopt", "objectives", "solvers", "studies")
    for path in (ROOT / package).rglob("*.py")
)
PROVOKING = (
    "tests/hostile/test_hostile_specs.py",
    "tests/hostile/test_hostile_prices.py",
    "tests/hostile/test_hostile_maps.py",
    "tests/hostile/test_hostile_plans.py",
    "tests/hostile/test_hostile_records.py",
    "tests/runs/test_bad_input.py",
    "tests/unit/spec",
    "tests/unit/plans",
    "tests/unit/tables",
    "tests/hostile/test_hostile_logs.py",
)
# A missing value in a call from Python may be called None; one in a file may not.
OF_PYTHON = re.compile(
    r"\bNone is no (?:text|whole|finite)|\bTrue\b|\bFalse\b|Traceback|object at 0x|instance of|NoneType|"
    r"datetime\.|\bdict\b|\btuple\b|should have at (?:least|most)|after validation|sys\.|<class"
)


def _raises_without_repair(path):
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if not isinstance(node, ast.Call) or any(isinstance(argument, ast.Starred) for argument in node.args):
            continue
        name, given = ast.unparse(node.func), len(node.args) + len(node.keywords)
        if name in ("InvalidInput.at", "UnknownName.at") or name.endswith("findings.add"):
            if given < 3:
                yield f"{path.name}:{node.lineno}"
        elif name == "Fault" and "repair" not in {word.arg for word in node.keywords}:
            yield f"{path.name}:{node.lineno}"


def test_every_refusal_in_the_code_says_what_would_be_right():
    """No fault is made without a repair, wherever in the code that is."""
    assert [place for path in SOURCES for place in _raises_without_repair(path)] == []


@pytest.mark.long
def test_every_message_that_tests_provoke_reads_well(tmp_path):
    """Hundreds of kinds: each has a place, a problem that is a clause, a repair that is a sentence, no Python."""
    listing = tmp_path / "messages.json"
    done = subprocess.run(
        [sys.executable, "-m", "pytest", "-q", "-p", "no:xdist", "-p", "tests.recorded_messages", "-m", "not long",
         *PROVOKING],
        cwd=ROOT,
        env={**os.environ, "LAYOUTOPT_MESSAGES": str(listing)},
        capture_output=True,
        text=True,
        check=False,
    )  # fmt: skip
    messages = json.loads(listing.read_text(encoding="utf-8"))
    assert len(messages) > 250, done.stdout[-2000:]
    bad = [
        message
        for message in messages
        if not message[0]
        or not message[1]
        or message[1].endswith((".", "\n"))
        or not message[2].rstrip().endswith((".", "?"))
        or OF_PYTHON.search(message[1])
        or "\n" in "".join(message)
    ]
    assert bad == []
