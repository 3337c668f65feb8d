"""Cheaper layouts that met the limits in search and were left there are named, with what is known of them."""

from dataclasses import replace

import pytest
from losing_studies import FEW_OF_THE_FRONT, choice_of, losing_study
from made_findings import findings_of, page_of, read, simulated

from layoutopt.result import Validation
from studies.runner import recorded_rounds
from studies.summary import findings_lines, passed_over_text


@pytest.mark.parametrize(("loss", "pitch_m", "passed"), [(1.0, 0.2, 0), (2.0, 0.15, 1)])
def test_what_would_lose_as_the_front_did_is_passed_over_and_named(tmp_path, loss, pitch_m, passed):
    """With a loss of two the sparse layout, 0.2 m in search, would miss 0.3 m: a denser one is taken."""
    study = losing_study(tmp_path, loss, text=FEW_OF_THE_FRONT)
    findings = study.question.findings(list(study.recorded.values()))
    assert choice_of(findings.result.recommended["cheapest"]) == (4, pitch_m)
    assert len(findings.passed_over) == passed
    lines = findings_lines(findings, None)
    assert sum("met every limit in search, but would miss one" in line for line in lines) == passed
    for item in findings.passed_over:
        assert item.layout.short_key in passed_over_text(findings)


def test_a_passed_over_member_of_the_front_is_told_to_have_been_driven_and_by_how_much_it_missed(tmp_path):
    """The front has held-out drives of its own: 0.4 m where 0.3 m are demanded."""
    study = losing_study(tmp_path, 2.0, text=FEW_OF_THE_FRONT)
    told = passed_over_text(study.question.findings(list(study.recorded.values())))
    assert "was driven there all the same and missed “mean position error at most 300 mm” in held-out/" in told
    assert ": 400." in told
    assert " mm short at 95 % confidence" in told
    assert "none was tried there" not in told


def test_what_misses_with_all_its_held_out_drives_counts_as_tried(tmp_path):
    """Where the front has as many drives as a try, the sparse layout was looked at as closely as the dense one."""
    study = losing_study(tmp_path, 2.0)
    findings = study.question.findings(list(study.recorded.values()))
    assert choice_of(findings.result.recommended["cheapest"]) == (4, 0.1)
    assert findings.candidates_validated == 2
    assert findings.passed_over == ()


def test_what_holds_is_taken_though_no_try_is_left(tmp_path):
    """The sparse layout takes the only try and misses; the dense one has its drives as a member of the front."""
    study = losing_study(tmp_path, {(4, 0.2): 1.6, (4, 0.1): 1.0})
    question = replace(study.question, most_candidates=1)
    findings = question.findings(list(study.recorded.values()))
    assert choice_of(findings.result.recommended["cheapest"]) == (4, 0.1)


def test_a_layout_with_all_its_held_out_drives_that_holds_is_taken_though_the_front_lost_more(tmp_path):
    """The median loss of 1.75 would put the sparse layout at 0.35 m; its own drives say 0.2 m."""
    study = losing_study(tmp_path, {(4, 0.2): 1.0, (4, 0.1): 2.5})
    findings = study.question.findings(list(study.recorded.values()))
    assert choice_of(findings.result.recommended["cheapest"]) == (4, 0.2)
    assert findings.passed_over == ()


def test_the_best_so_far_is_the_one_of_the_search_until_one_holds_and_then_the_answer(tmp_path):
    """The sparse layout leads until the front was driven on held-out drives; the dense one holds there."""
    study = losing_study(tmp_path, 2.0)
    question, found, told = study.question, {}, []
    while (rounds := recorded_rounds(question, streams=study.streams, recorded=found))[1].tasks:
        told.append((rounds[1].name.partition(",")[0], question.best_so_far(rounds[0]) if found else ""))
        found.update({key: item for key, item in study.recorded.items() if item.group in _groups(rounds[1])})
    told.append(("finished", question.best_so_far(rounds[0])))
    cheapest = question.findings(rounds[0]).result.recommended["cheapest"].layout.short_key
    best = dict(told)
    assert "the cheapest that meets the limits in search (" in best["held-out trials of the front"]
    assert cheapest not in best["held-out trials of the front"]
    held = f"the cheapest that meets the limits on 2 held-out drives of each kind, too few to decide ({cheapest})"
    assert held in best["published layouts as references"]
    assert best["finished"] == best["published layouts as references"]


def test_the_best_so_far_says_that_none_held(tmp_path):
    """With a loss of four both layouts miss."""
    study = losing_study(tmp_path, 4.0)
    best = study.question.best_so_far(list(study.recorded.values()))
    assert best == "2 layouts tried on held-out drives, none met the limits there"


def test_the_report_names_the_cheapest_that_was_passed_over():
    findings = findings_of()
    beaten = findings.designs[2].evaluated
    assert passed_over_text(findings) == ""
    told = read(page_of(replace(findings, passed_over=(beaten,)))).text
    assert f"so none was tried there; the cheapest is {beaten.layout.label} [{beaten.layout.short_key}]" in told
    assert "met every limit in search, but" not in read(page_of(findings)).text


def test_what_was_driven_and_what_was_not_are_told_apart():
    """Three drives within the limit are too few to take a layout; of the one without any nothing else is said."""
    findings = findings_of()
    few, never = findings.designs[2].evaluated, findings.result.recommended["knee"]
    rows = (
        Validation(
            layout_key=few.layout.key,
            scenario="held-out/1",
            estimator="midrange",
            scores=simulated(0.01, 0.0001, 3),
        ),
    )
    told = passed_over_text(replace(findings, passed_over=(few, never), validations=rows))
    assert f"{few.layout.label} [{few.layout.short_key}] for" in told
    assert "driven there all the same and met every limit on 3 held-out drives of each kind, which are too" in told
    assert f"of the other 1 none was tried there; the cheapest is {never.layout.label}" in told


def _groups(batch):
    return {task.group for task in batch.tasks}
