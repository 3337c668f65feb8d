"""A hybrid's parts are chosen by their own studies, and its bill is the sum of theirs."""

from dataclasses import replace

import pytest

from layoutopt.progress import Silent
from layoutopt.result import Status
from layoutopt.score_text import euros
from layoutopt.spec.layout_file import read_filed_layout, read_layout
from layoutopt.spec.reading import read_spec
from layoutopt.streams import Streams
from studies.hybrid import Hybrid, of_kind
from studies.runner import run_rounds

TABLES = """
[tracking]
antennas = [1, 2]
yaw = "45 deg"
duration = "15 s"
trials = 2
clutter = 0
[docking]
trials = 12
candidate_pitch = "1 m"
"""


@pytest.fixture(scope="module")
def spec(tmp_path_factory, tiny_text):
    """The tiny spec with tracking and docking."""
    path = tmp_path_factory.mktemp("hybrid") / "hybrid.toml"
    path.write_text(tiny_text.replace("search_trials = 60", "search_trials = 20") + TABLES, encoding="utf-8")
    return read_spec(path)


@pytest.fixture(scope="module")
def study(spec):
    """The study of the spec, quick."""
    return Hybrid.for_spec(spec, quick=True)


@pytest.fixture(scope="module")
def evaluations(study, spec):
    """Its trials."""
    return run_rounds(study, streams=Streams(seed=spec.seed), journal=None, progress=Silent()).evaluations


def test_every_evaluation_belongs_to_one_part(study, evaluations):
    """The three kinds of trials are told apart by what their estimators estimate, and none is left over."""
    parts = [of_kind(evaluations, what) for what in study.parts]
    assert all(parts)
    assert sum(map(len, parts)) == len(evaluations)


def test_the_bill_of_the_whole_is_the_sum_of_the_parts(study, evaluations, spec):
    """To the cent, because the parts share no item."""
    answer = study.answer(evaluations, spec)
    parts = [study.cost.bill(part.layout, answer.scenario).total_eur for part in answer.parts]
    assert answer.bill.total_eur == pytest.approx(sum(parts), abs=0.005)
    assert {group.kind for group in answer.layout.readers} == {"tag_read", "signal", "direction"}
    assert len(answer.layout.transponders) == 1


def test_a_budget_below_the_cheapest_whole_is_told_with_its_shortfall(study, evaluations, spec):
    """Exit code 1, and by how much."""
    whole_eur = study.answer(evaluations, spec).bill.total_eur
    within = replace(study, budget_eur=whole_eur).answer(evaluations, spec)
    beyond = replace(study, budget_eur=whole_eur - 100.0).answer(evaluations, spec)
    assert within.over_budget_eur == 0.0
    assert beyond.exit_code == 1
    assert any(f"{euros(100.0)} more than the budget" in line for line in beyond.lines(None))


def test_a_whole_is_called_the_cheapest_only_if_it_is(study, evaluations, spec):
    """Not where cost and error chose together, nor where a limit is missed."""
    answer = replace(study, budget_eur=1.0).answer(evaluations, spec)
    floor, tracking, docking = (
        replace(part, status=Status.TARGET_MET, cheapest=part.name != "UHF antennas") for part in answer.parts
    )
    assert not answer.parts[1].cheapest
    for parts, words in (
        ((floor, tracking, docking), "No limit says how accurate is enough for UHF antennas"),
        ((floor, replace(tracking, cheapest=True), docking), "It is the cheapest whole"),
        ((replace(floor, status=Status.TARGET_NOT_MET), tracking, docking), "not every limit is met: floor tags"),
    ):
        told = [line for line in replace(answer, parts=parts).lines(None) if "more than the budget" in line]
        assert len(told) == 1
        assert words in told[0]
        assert ("It is the cheapest" in told[0]) is (words == "It is the cheapest whole")


def test_limits_on_cost_are_on_the_whole(spec):
    """No part is held to the budget alone."""
    study = Hybrid.for_spec(replace(spec, budget_eur=3000.0), quick=True)
    assert study.budget_eur == 3000.0
    for part in (study.floor, study.tracking):
        assert all(limit.score != "cost" for limit in part.problem.limits)


def test_the_layout_is_written_and_read_back(study, evaluations, spec, tmp_path):
    """With drawings and the reports of the parts beside it; files and drawings of a quick look say so."""
    answer = study.answer(evaluations, spec)
    answer.write(tmp_path, streams=Streams(seed=spec.seed), quick=True)
    _, layout = read_layout(tmp_path / "layouts" / f"{answer.layout.short_key}.toml")
    assert layout.key == answer.layout.key
    assert (tmp_path / "drawings" / "sheet.pdf").exists()
    for part in answer.parts:
        assert (tmp_path / part.folder / "report.html").exists()
    files = list(tmp_path.rglob("layouts/*.toml"))
    assert len(files) > len(answer.parts)
    assert all(read_filed_layout(path).quick_look for path in files)
    drawings = [*tmp_path.rglob("sheet.svg"), *tmp_path.rglob("transponder.svg")]
    assert {path.stem for path in drawings} == {"sheet", "transponder"}
    for path in drawings:
        assert "QUICK LOOK" in path.read_text(encoding="utf-8"), path


def test_a_part_that_finds_nothing_leaves_no_whole(study, evaluations, spec):
    """And the answer says which."""
    answer = study.answer(evaluations, spec)
    floor, tracking, docking = answer.parts
    lacking = replace(answer, parts=(floor, replace(tracking, layout=None), docking))
    assert lacking.layout is None
    assert lacking.exit_code == 1
    assert "nothing was found for UHF antennas" in lacking.lines(None)[0]


def test_what_was_found_is_drawn_even_without_floor_tags(study, evaluations, spec):
    """A plan of the antennas and the transponder alone."""
    answer = study.answer(evaluations, spec)
    floor, *others = answer.parts
    page = replace(answer, parts=(replace(floor, layout=None), *others)).page()
    assert page.leading.caption == "To scale, as far as it was found: UHF antennas, docking."
    assert not page.found
