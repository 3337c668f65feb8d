"""`layoutopt explain` end to end: lines and JSON of one layout, the same for every run, and bad input."""

import json

import pytest
from command_line import called
from small_studies import SPEC

from layoutopt.spec.layout_file import write_layout
from layoutopt.spec.reading import read_spec


@pytest.fixture(scope="module")
def home(tmp_path_factory):
    """A folder with a layout file of the small spec, whose target of 60 mm it meets."""
    folder = tmp_path_factory.mktemp("explain")
    (folder / "spec.toml").write_text(SPEC, encoding="utf-8")
    spec = read_spec(folder / "spec.toml")
    write_layout(next(iter(spec.space.layouts())), spec, folder / "layout.toml")
    return folder


def test_a_layout_is_explained_in_json_and_in_lines_alike(home):
    """Both tell the same steps, in the same run twice over, with seed and number of trials."""
    as_json = called("explain", "layout.toml", "--trials", 3, "--jobs", 1, "--json", cwd=home)
    assert as_json.returncode == 0, as_json.stderr
    found = json.loads(as_json.stdout)
    assert (found["seed"], found["trials"], found["first_replication"]) == (3, 3, 8)
    kinds = {step["kind"] for step in found["steps"]}
    assert {"antenna less", "antenna more", "antenna side", "tag pattern", "tag row"} <= kinds
    judged = [step for step in found["steps"] if not step["refusal"]]
    assert len(judged) >= 10
    for step in judged:
        assert all(difference["count"] == 3 for difference in step["differences"].values())
        assert len(step["differences"]) == 2
    as_lines = called("explain", "layout.toml", "--trials", 3, "--jobs", 1, cwd=home)
    assert as_lines.returncode == 0, as_lines.stderr
    for step in found["steps"]:
        assert f"  {step['change']}: " in as_lines.stdout
    assert "held-out drives 8 to 10 of each scenario" in as_lines.stdout
    assert "What the next euro buys" in as_lines.stdout


def test_a_layout_that_cannot_be_built_is_told_why_with_exit_1(home):
    """A ring wider than the robot is refused without a drive."""
    text = (home / "layout.toml").read_text(encoding="utf-8")
    wide = "\n".join(line for line in text.splitlines() if not line.startswith("key = "))
    at = wide.index("[layout]")
    wide = wide[:at] + wide[at:].replace('radius = "150 mm"', 'radius = "190 mm"')
    assert '"190 mm"' in wide
    (home / "wide.toml").write_text(wide, encoding="utf-8")
    done = called("explain", "wide.toml", "--trials", 2, "--jobs", 1, cwd=home)
    assert done.returncode == 1, done.stderr
    assert "cannot be built or judged: an antenna reaches" in done.stdout
    assert "trials in" not in done.stderr


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("none.toml",), ("none.toml",)),
        (("spec.toml",), ("spec.toml", "the file has no [layout]")),
        (("layout.toml", "--trials", 1), ("--trials",)),
    ],
)
def test_wrong_input_ends_in_exit_2(home, arguments, words):
    """Files and values are named."""
    done = called("explain", *arguments, cwd=home)
    assert done.returncode == 2, done.stderr
    for word in words:
        assert word in done.stderr
