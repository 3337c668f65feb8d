"""`layoutopt solve` with a budget and a target that exclude each other: both ways out are told."""

from command_line import called
from small_studies import SPEC


def test_budget_and_target_that_exclude_each_other_are_told_with_both_ways_out(tmp_path):
    """Only the dearest layout reaches 40 mm: so much more money, or so much more error."""
    (tmp_path / "small.toml").write_text(SPEC, encoding="utf-8")
    asked = ("--target-error", "40 mm", "--budget", "600", "--jobs", 1)
    done = called("solve", "small.toml", *asked, cwd=tmp_path)
    assert done.returncode == 1, done.stderr
    text = done.stdout
    assert "1 layout above the budget was not simulated" in text
    assert "Mean position error at most 40 mm and cost at most 600.00 EUR are not met together by any of 3" in text
    assert "+300.13 EUR" in text
    assert "would meet the other limits on held-out drives: ring 4 × 40 mm, square 150 mm" in text
