"""`layoutopt study robustness` end to end on a small site: answer, resume, and a tolerance that is none."""

from command_line import called
from small_studies import SPEC


def test_the_study_answers_and_resumes_to_the_same_bytes(tmp_path):
    """Both layouts and the price are told; a finished study runs nothing again."""
    (tmp_path / "small.toml").write_text(
        SPEC + '[study.tolerance]\nplacement = ["0 mm", "10 mm"]\ndead_tags = ["0 %", "0 %"]\n'
        'missed_reads = ["2 %", "2 %"]\n',
        encoding="utf-8",
    )
    done = called("study", "robustness", "small.toml", "--out", "out", "--jobs", 1, cwd=tmp_path)
    assert done.returncode == 0, done.stdout + done.stderr
    few = "A layout is seen on 24 held-out drives, too few to decide, to meet every limit."
    assert done.stdout.splitlines()[0] == few
    assert "judged by the worst of 2 corners" in done.stdout
    assert "seed 3" in done.stdout
    names = ("report.html", "tables/contenders.csv", "tables/worlds.csv", "results.jsonl")
    before = {name: (tmp_path / "out" / name).read_bytes() for name in names}
    again = called("study", "robustness", "small.toml", "--out", "out", "--jobs", 1, "--resume", cwd=tmp_path)
    assert again.stdout == done.stdout
    assert {name: (tmp_path / "out" / name).read_bytes() for name in names} == before


def test_a_tolerance_that_falls_ends_in_exit_2(tmp_path):
    """Line, key and repair; no folder is made."""
    (tmp_path / "bad.toml").write_text(
        SPEC + '[study.tolerance]\nplacement = ["5 mm", "0 mm"]\n', encoding="utf-8"
    )
    done = called("study", "robustness", "bad.toml", "--out", "out", cwd=tmp_path)
    assert done.returncode == 2
    assert "study.tolerance.placement" in done.stderr
    assert "Exchange the two values." in done.stderr
    assert not (tmp_path / "out").exists()


def test_a_budget_that_buys_nothing_ends_in_exit_1_before_any_drive(tmp_path):
    """The refusal of the main study stands here too."""
    text = SPEC.replace('target_error = "60 mm"', 'target_error = "60 mm"\nbudget = "10 EUR"')
    (tmp_path / "poor.toml").write_text(text, encoding="utf-8")
    done = called("study", "robustness", "poor.toml", "--out", "out", "--jobs", 1, cwd=tmp_path)
    assert done.returncode == 1, done.stderr
    assert "more than the budget of 10.00 EUR" in done.stdout
    assert not (tmp_path / "out").exists()
