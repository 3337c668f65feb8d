"""What the README shows is what happens."""

import re
import subprocess
import sys
from pathlib import Path

import pytest

import layoutopt

README = Path(layoutopt.__file__).parent.parent / "README.md"
NUMBER = re.compile(r"(\d[\d\u202f]*\.?\d*) ± (\d+\.?\d*) mm \(n = (\d+)\)")


def _block(language):
    return re.search(rf"```{language}\n(.*?)```", README.read_text(encoding="utf-8"), flags=re.DOTALL)[1]


def test_the_ten_lines_of_python_run(tmp_path):
    """The example runs from a foreign folder and prints a layout that can be built, with its error."""
    code = _block("python")
    assert len([line for line in code.splitlines() if line.strip()]) <= 12
    done = subprocess.run([sys.executable, "-c", code], cwd=tmp_path, capture_output=True, text=True, check=True)
    first, second = done.stdout.splitlines()
    assert first == "ring 4 × 60 mm, square 200 mm []"
    assert "standard_error" in second


def test_links_and_pictures_exist():
    """Every relative link of README and docs leads to a file."""
    for page in (README, *README.parent.glob("docs/*.md")):
        for target in re.findall(r"\]\(([^)#]+)\)", page.read_text(encoding="utf-8")):
            if "://" not in target:
                assert (page.parent / target).exists(), f"{page.name}: {target}"


@pytest.mark.long
def test_the_output_shown_is_that_of_the_main_study(tmp_path):
    """`layoutopt study cost_vs_accuracy` prints the lines shown; figures agree within five standard errors.

    They agree to the last digit on the processor that they were made on; on another one the sums of a particle
    filter may be rounded otherwise, and drives then differ like those of another seed. With 25 figures a false
    alarm at five standard errors of a difference has a chance below 1e-4.
    """
    shown = [line for line in _block("").splitlines() if line and not line.startswith(("$", "..."))]
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
