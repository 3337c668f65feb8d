"""What the README shows is what happens."""

import re
import shlex
import subprocess
import sys
from pathlib import Path

import pytest
import typer

import layoutopt
from layoutopt.cli import app
from tests.command_line import called

README = Path(layoutopt.__file__).parent.parent / "README.md"
NUMBER = re.compile(r"(\d[\d\u202f]*\.?\d*) ± (\d+\.?\d*) mm \(n = (\d+)\)")
FEWER = {"explain": ("--trials", "4"), "score": ("--trials", "4"), "snap": ("--trials", "4")}
"""Options that make a command of the README cheap enough for a test; what it writes stays of one kind."""


def _blocks(language):
    """Return the texts of the fenced blocks of a language; what stands between two blocks is none."""
    found = re.findall(r"```(\w*)\n(.*?)```", README.read_text(encoding="utf-8"), flags=re.DOTALL)
    return [text for of, text in found if of == language]


def _commands():
    """Return every command of layoutopt in the README with the lines that it is shown to print."""
    for block in _blocks("console"):
        for part in re.split(r"(?m)^\$ ", block)[1:]:
            command, *lines = part.splitlines()
            words = shlex.split(command, comments=True)
            if words[0] == "layoutopt":
                yield words[1:], [line for line in lines if line != "..."]


def test_the_readme_shows_commands_that_exist():
    """Names and options are those of the command line; what this test does not know nobody has run."""
    known = {command.name: command for command in typer.main.get_command(app).commands.values()}
    shown = [words for words, _ in _commands()]
    assert len(shown) > 12
    assert [words[0] for words in shown[:3]] == ["new", "check", "study"]
    for name, *rest in shown:
        options = {option for parameter in known[name].params for option in parameter.opts}
        assert {word for word in rest if word.startswith("--")} <= options, (name, rest)


def test_the_python_shown_is_of_ten_lines():
    """That it is typed is tested with the wheel (`test_wheel`), what it gives in the long test below."""
    assert len([line for line in _blocks("python")[0].splitlines() if line.strip()]) <= 12


def test_links_and_pictures_exist():
    """Every relative link of README and docs leads to a file."""
    for page in (README, *README.parent.glob("docs/*.md")):
        for target in re.findall(r"\]\(([^)#]+)\)", page.read_text(encoding="utf-8")):
            if "://" not in target:
                assert (page.parent / target).exists(), f"{page.name}: {target}"


@pytest.mark.long
def test_every_command_runs_in_order_and_python_gives_the_same(tmp_path):
    """From the first command on, in one folder: exit code 0, the lines shown, and the same files from Python."""
    for words, lines in _commands():
        done = called(*words, *FEWER.get(words[0], ()), cwd=tmp_path)
        assert done.returncode == 0 or words[0] in ("explain", "doctor"), (words, done.stderr)
        printed = iter(done.stdout.splitlines())
        for line in lines:
            assert any(line == other for other in printed), (words, line, done.stdout)
    told = called("solve", "hall.toml", cwd=tmp_path).stdout
    folder = tmp_path / "python"
    folder.mkdir()
    code = _blocks("python")[0]
    done = subprocess.run([sys.executable, "-c", code], cwd=folder, capture_output=True, text=True, check=True)
    label, *rest = done.stdout.splitlines()
    assert f"cheapest: {label.partition('  ')[0]} [" in told
    assert (folder / "layout.toml").read_bytes() == (tmp_path / "layout.toml").read_bytes()
    for name in ("tags.csv", "bill_of_material.csv", "sheet.svg"):
        assert (folder / "drawings" / name).read_bytes() == (tmp_path / "drawings" / name).read_bytes(), name
    assert (folder / "out/hall/front.csv").read_bytes() == (tmp_path / "out/hall/front.csv").read_bytes()
    study = next(lines for words, lines in _commands() if words[0] == "study" and lines)
    assert [line for line in study if not line.startswith("report: ")] == [line for line in rest if line in study]


@pytest.mark.long
def test_the_output_shown_is_that_of_the_main_study(tmp_path):
    """`layoutopt study cost_vs_accuracy` prints the lines shown; figures agree within five standard errors.

    They agree to the last digit on the processor that they were made on; on another one the sums of a particle
    filter may be rounded otherwise, and drives then differ like those of another seed. With two figures a false
    alarm at five standard errors of a difference has a chance below 1e-5.
    """
    shown = [line for line in _blocks("")[0].splitlines() if line and not line.startswith("$")]
    done = subprocess.run(
        [sys.executable, "-m", "layoutopt", "study", "cost_vs_accuracy", "--out", "out/cost_vs_accuracy"],
        cwd=tmp_path,
        capture_output=True,
        text=True,
        check=True,
    )
    printed = done.stdout.splitlines()
    for expected in shown:
        words = expected.partition(":")[0]
        candidates = [line for line in printed if line.partition(":")[0] == words]
        assert candidates, expected
        figures = NUMBER.findall(expected)
        if figures:
            assert any(_near(figures, NUMBER.findall(line)) for line in candidates), (expected, candidates)


def _near(shown, printed):
    return len(shown) == len(printed) and all(
        abs(float(one[0].replace("\u202f", "")) - float(two[0].replace("\u202f", "")))
        <= 5.0 * (float(one[1]) ** 2 + float(two[1]) ** 2) ** 0.5
        for one, two in zip(shown, printed, strict=True)
    )
