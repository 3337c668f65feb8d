"""What the tutorial shows is what happens, from an empty folder on."""

import os
import re
import subprocess
import sys
from pathlib import Path

import pytest

PAGE = Path(__file__).parents[2] / "docs" / "tutorial.md"
BLOCK = re.compile(r"(?:Save this as `([^`]+)`:\n\n)?```(\w+)\n(.*?)```", re.DOTALL)
NUMBER = re.compile(r"[-+]?\d[\d\u202f]*(?:\.\d+)?")
LOOSE = 0.25
"""By how much a simulated figure may differ where the processor is another one: drives are then others."""


def _blocks():
    return BLOCK.findall(PAGE.read_text(encoding="utf-8"))


def _commands():
    """Return every command of the page with the lines that it is shown to print."""
    for _, language, text in _blocks():
        if language == "console":
            for part in re.split(r"(?m)^\$ ", text)[1:]:
                command, *lines = part.splitlines()
                yield command, [line for line in lines if line != "..."]


def test_the_page_has_files_and_commands():
    """What the long test runs is found on the page at all."""
    assert [name for name, *_ in _blocks() if name] == [
        "workshop.geojson",
        "workshop.toml",
        "installer.py",
        "first_drive.py",
    ]
    assert [command.split()[1] for command, _ in _commands() if command.startswith("layoutopt")] == [
        "check",
        "study",
        "draw",
        "commission",
        "replay",
    ]


def _like(shown, printed):
    """Return whether lines have the same words, and numbers that are near each other."""
    if NUMBER.sub("#", shown) != NUMBER.sub("#", printed):
        return False
    pairs = zip(NUMBER.findall(shown), NUMBER.findall(printed), strict=True)
    figures = [tuple(float(number.replace("\u202f", "")) for number in pair) for pair in pairs]
    return all(abs(one - two) <= max(LOOSE * max(abs(one), abs(two)), 0.5) for one, two in figures)


@pytest.mark.long
def test_every_command_prints_what_the_page_shows(tmp_path):
    """Files are saved as told, commands run in order, and each line shown is printed, in that order."""
    for name, _, text in _blocks():
        if name:
            (tmp_path / name).write_text(text, encoding="utf-8")
    folder = Path(sys.executable).parent
    environment = {**os.environ, "PATH": f"{folder}{os.pathsep}{os.environ['PATH']}"}
    for command, lines in _commands():
        if command.split()[0] in ("mkdir", "cd"):
            continue
        program, *rest = command.split()
        start = [sys.executable, "-m", "layoutopt"] if program == "layoutopt" else [sys.executable]
        done = subprocess.run(
            [*start, *rest], cwd=tmp_path, env=environment, capture_output=True, text=True, check=False
        )
        assert done.returncode == 0, (command, done.stderr)
        printed = iter(done.stdout.splitlines())
        for line in lines:
            assert any(_like(line, other) for other in printed), (command, line, done.stdout)
