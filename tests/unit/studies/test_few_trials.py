"""Few trials are called a look: what they say of demands is seen and not shown."""

from dataclasses import replace

import pytest
from made_findings import findings_of, metres

from layoutopt.result import Status
from studies.cells import ENOUGH_HELD_OUT, ENOUGH_TRIALS, shown_on
from studies.first_page import first_page
from studies.summary import findings_lines


def test_the_word_is_shown_from_enough_trials_on():
    assert shown_on(ENOUGH_TRIALS) == "shown"
    assert shown_on(1, what="trial") == "seen on 1 trial, too few to decide,"


@pytest.mark.parametrize(
    ("drives", "line"),
    [
        (ENOUGH_HELD_OUT, Status.TARGET_MET.value),
        (25, "A layout is seen on 25 held-out drives, too few to decide, to meet every limit."),
    ],
)
def test_a_study_on_few_held_out_drives_does_not_say_that_every_limit_is_met(drives, line):
    findings = findings_of()
    goal = findings.problem.goals[1]
    rows = tuple(
        replace(row, scores={**row.scores, goal: metres(0.01, 0.001, drives)}) if row.scores else row
        for row in findings.validations
    )
    met = replace(findings, result=replace(findings.result, status=Status.TARGET_MET), validations=rows)
    assert findings_lines(met, None)[0] == line
    headline = first_page(met, quick=False).headline
    assert ("too few to decide" in headline) is (drives < ENOUGH_HELD_OUT)
    missed = replace(met, result=replace(met.result, status=Status.TARGET_NOT_MET))
    assert findings_lines(missed, None)[0] == Status.TARGET_NOT_MET.value
