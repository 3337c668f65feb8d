"""A study tells what a screen would have lost, what common drives saved and whether tags are needed."""

import csv
import html
import math
import re

import pytest

from layoutopt.progress import Silent
from layoutopt.score_text import score_text
from layoutopt.spec.reading import read_spec
from studies.cost_vs_accuracy import CostVersusAccuracy
from studies.dead_reckoning import QUESTION, Need, need_for_tags
from studies.folder import Run, run_study
from studies.pairing import pairing_text
from studies.screening import CLOSED_FORMS, MARGINS, screening_of


@pytest.fixture(scope="module")
def ran(tiny_text, tmp_path_factory):
    """Return answer and folder of a tiny study of twelve layouts."""
    folder = tmp_path_factory.mktemp("study")
    (folder / "tiny.toml").write_text(tiny_text, encoding="utf-8")
    spec = read_spec(folder / "tiny.toml")
    question = CostVersusAccuracy.for_spec(spec, quick=True)
    place = folder / "out"
    answer = run_study("cost_vs_accuracy", question, spec, place, run=Run(quick=True), progress=Silent())
    return answer, place


def words(page):
    """Return the text of an HTML page."""
    return " ".join(html.unescape(re.sub(r"<[^>]+>", " ", page)).split())


def test_the_table_holds_every_screen(ran):
    """A row for each closed form and margin, with the findings' numbers; infinity keeps all and loses nothing."""
    answer, folder = ran
    found = screening_of(answer.findings)
    with (folder / "screening.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    assert [(row["closed_form"], float(row["margin"])) for row in rows] == [
        (name, margin) for name in CLOSED_FORMS for margin in MARGINS
    ]
    for row, screen in zip(rows, found.screens, strict=True):
        assert int(row["layouts_kept"]) == screen.kept <= int(row["layouts_raced"]) == found.raced
        assert float(row["largest_loss_m"]) == pytest.approx(screen.largest_loss.value)
        assert float(row["largest_loss_se_m"]) == pytest.approx(screen.largest_loss.standard_error)
        assert int(row["front_members"]) == len(answer.findings.result.front)
        if math.isinf(screen.margin):
            assert (int(row["layouts_kept"]), float(row["largest_loss_m"])) == (found.raced, 0.0)


def test_the_study_itself_drops_nothing_by_a_closed_form(ran):
    """Every layout of the tiny space that can be built has trials, whatever its half-gap."""
    answer, _ = ran
    assert all((design.trials > 0) is not bool(design.refusal) for design in answer.findings.designs)


def test_report_and_lines_state_margin_and_loss(ran):
    """The study's own margin and the losses of tighter ones stand in the report and on the command line."""
    answer, folder = ran
    text = words((folder / "report.html").read_text(encoding="utf-8"))
    assert "What would a screen have lost?" in text
    assert "its margin is infinite and its loss zero" in text
    for screen in screening_of(answer.findings).screens:
        assert f"{screen.kept} kept {score_text(screen.largest_loss)}" in text
    lines = answer.lines(folder)
    assert sum("margin infinite, loss 0" in line for line in lines) == 1
    assert sum("a margin of 1.5 would have kept" in line for line in lines) == 2


def test_what_common_drives_saved_stands_in_table_lines_and_report(ran):
    """Every finalist but the first has a row with the search trials that it shares with its rival."""
    answer, folder = ran
    found = answer.findings.pairing
    with (folder / "pairing.csv").open(encoding="utf-8", newline="") as file:
        rows = list(csv.DictReader(file))
    own, means = rows[: len(found.comparisons)], rows[len(found.comparisons) :]
    designs = {design.evaluated.layout.short_key: design for design in answer.findings.designs}
    assert len(own) == sum(design.trials > 0 for design in designs.values()) - 1
    for row in own:
        layout, rival = designs[row["layout"]], designs[row["rival"]]
        assert int(row["trials"]) == min(layout.trials, rival.trials)
        assert rival.evaluated.scores["cost"].value <= layout.evaluated.scores["cost"].value
        assert row["comparison"] == ("front" if layout.on_front and rival.on_front else "finalist")
        assert 0.0 <= float(row["variance_ratio"]) <= 2.0
    assert sum(row["comparison"] == "front" for row in own) == len(answer.findings.result.front) - 1
    assert means[-1]["comparison"] == "mean of all"
    assert float(means[-1]["variance_ratio"]) == pytest.approx(found.finalists.ratio.value)
    text = pairing_text(found)
    assert answer.lines(folder).count(text) == 1
    assert text[1:] in words((folder / "report.html").read_text(encoding="utf-8"))


def test_report_and_lines_say_whether_tags_are_needed(ran):
    """The verdict and its numbers stand at the top of the report and on the command line, word for word."""
    answer, folder = ran
    verdict = need_for_tags(answer.findings)
    assert verdict.need in (Need.NEEDED, Need.NOT_NEEDED, Need.UNDECIDED)
    assert verdict.rows
    line = next(line for line in answer.lines(folder) if line.startswith(QUESTION))
    assert line == f"{QUESTION} {verdict.text}"
    text = words((folder / "report.html").read_text(encoding="utf-8"))
    assert " ".join(line.split()) in text[: text.index("The front")]
    for row in verdict.rows:
        assert f"{row.words} {row.scenario} {score_text(row.error)}" in text


def test_exact_scores_stand_beside_the_simulated_ones(ran):
    """designs.csv has the expected reads of every layout, and they foretell the simulated reads per step.

    A patrol of 15 s meets few tags, the same for all layouts: over all of them the two agree within a third.
    """
    _, folder = ran
    with (folder / "designs.csv").open(encoding="utf-8", newline="") as file:
        rows = [row for row in csv.DictReader(file) if not row["refusal"]]
    expected = [float(row["expected_reads_per_step"]) for row in rows]
    assert [float(row["expected_reads_per_m"]) for row in rows] == pytest.approx([one / 0.015 for one in expected])
    assert sum(float(row["reads_per_step"]) for row in rows) == pytest.approx(sum(expected), rel=0.34)
