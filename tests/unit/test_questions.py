"""What programs and notebooks ask: the same as the command line, in this process."""

import inspect

import pytest

import layoutopt as lo
from layoutopt import questions
from layoutopt.spec.layout_file import read_filed_layout
from tests.command_line import called


@pytest.fixture(scope="module")
def hall():
    """The small hall."""
    return lo.read_spec(lo.built_in("small_hall"))


@pytest.fixture(scope="module")
def found(hall):
    """What a quick look at it finds."""
    return lo.solve(hall, quick=True)


def test_solve_says_what_the_command_says(found, tmp_path):
    """The command prints the layouts that `solve` recommends, at their costs, and marks the file it writes."""
    (tmp_path / "hall.toml").write_text(lo.built_in("small_hall").read_text(encoding="utf-8"), encoding="utf-8")
    told = called("solve", "hall.toml", "--quick", "--out", "layout.toml", "--jobs", 1, cwd=tmp_path)
    assert told.returncode == found.result.status.exit_code == 0
    assert told.stdout.startswith("QUICK LOOK")
    for item in found.result.recommended.values():
        assert f"{item.layout.label} [{item.layout.short_key}]" in told.stdout
    assert read_filed_layout(tmp_path / "layout.toml").quick_look


def test_a_demand_of_the_call_takes_the_place_of_that_of_the_spec(hall):
    """Nothing in the hall reaches a tenth of a millimetre, nor costs one euro."""
    assert lo.solve(hall, target_error_m=1e-4, quick=True).result.status is lo.Status.TARGET_NOT_MET
    assert lo.solve(hall, budget_eur=1.0, quick=True).result.status is lo.Status.BUDGET_TOO_SMALL


def test_a_layout_is_scored_drawn_and_written(hall, found, tmp_path):
    """Scores of both kinds, sheets and tables, and a file that reads back as the same layout."""
    layout = found.result.recommended["cheapest"].layout
    scored = lo.score(layout, hall, trials=2)
    assert scored.exact["cost"].value == found.result.recommended["cheapest"].scores["cost"].value
    assert ("held-out/faults", "midrange") in scored.simulated
    lo.write_layout(layout, hall, tmp_path / "layout.toml")
    assert lo.read_layout(tmp_path / "layout.toml")[1] == layout


@pytest.mark.long
def test_drawings_and_a_study_are_written_into_a_folder(hall, found, tmp_path):
    """`draw` and `study` return what they wrote; a folder that holds a study is not overwritten."""
    files = lo.draw(found.result.recommended["cheapest"].layout, hall, tmp_path / "drawings")
    assert all(path.stat().st_size for path in files)
    assert {"sheet.pdf", "tags.csv", "installation.pdf"} <= {path.name for path in files}
    answer = lo.study("cost_vs_accuracy", hall, tmp_path / "out", quick=True)
    assert answer.exit_code == 0
    assert (tmp_path / "out/report.html").exists()
    with pytest.raises(lo.LayoutoptError, match="holds a study already"):
        lo.study("cost_vs_accuracy", hall, tmp_path / "out", quick=True)


def test_values_that_make_no_sense_are_refused_with_the_value(hall, found):
    """Demands are positive, trials at least two, jobs at least one, names known."""
    layout = found.result.recommended["cheapest"].layout
    with pytest.raises(ValueError, match="target_error_m must be positive, got 0"):
        lo.solve(hall, target_error_m=0.0)
    with pytest.raises(ValueError, match="budget_eur must be positive, got nan"):
        lo.solve(hall, budget_eur=float("nan"))
    with pytest.raises(ValueError, match="at least two trials, got 1"):
        lo.score(layout, hall, trials=1)
    with pytest.raises(ValueError, match="at least two trials, got 1"):
        lo.explain(layout, hall, trials=1)
    with pytest.raises(ValueError, match="at least one job is needed, got 0"):
        lo.solve(hall, jobs=0)
    with pytest.raises(lo.InvalidInput, match="Did you mean 'cost_vs_accuracy'"):
        lo.study("cost_vs_acuracy", hall, "out")


def test_every_question_is_a_public_name():
    """What stands in `questions` is what ``import layoutopt as lo`` offers, and tab completion shows it."""
    here = [value for value in vars(questions).values() if inspect.getmodule(value) is questions]
    asked = {value.__name__ for value in here if not value.__name__.startswith("_")}
    assert asked == {"solve", "study", "score", "explain", "draw"}
    assert asked | {"read_spec", "Layout"} <= set(dir(lo))
