"""Cheaper layouts that met the limits in search, and on which no held-out drives were spent, are named."""

from dataclasses import dataclass, replace

import pytest
from made_findings import findings_of, page_of, read
from made_studies import MadeStudy, made_study

from layoutopt.protocols import Evaluation, Task
from layoutopt.scenario import Role
from studies.summary import findings_lines, passed_over_text

SEARCH_ERROR_M = {0.1: 0.1, 0.2: 0.2}
"""By pitch; the demand is 0.3 m."""
PUBLISHED_M = 0.05
"""Of the layouts of mi2016 that run beside it."""


@dataclass(frozen=True)
class LosingStudy(MadeStudy):
    """A study in which every layout errs a known number of times more on held-out drives than in search."""

    loss: float = 1.0

    def outcome(self, task: Task) -> Evaluation:
        """Return the error of the layout's pitch, a little scattered."""
        found = super().outcome(task)
        (pattern,) = {zone.pattern for zone in task.layout.floor_tags.zones}
        times = 1.0 if task.scenario.role is Role.DESIGN else self.loss
        error_m = SEARCH_ERROR_M.get(round(float(pattern.cell_m[0, 0]), 3), PUBLISHED_M) * times
        values = found.outcomes.values.copy()
        for column in ("position_error_mean", "position_error_p95", "position_error_max"):
            values[:, found.outcomes.columns.index(column)] = error_m * (1.0 + 0.01 * values[:, 0])
        return replace(found, outcomes=replace(found.outcomes, values=values))


@pytest.mark.parametrize(("loss", "pitch_m", "passed"), [(1.0, 0.2, 0), (2.0, 0.1, 1)])
def test_what_would_lose_as_the_front_did_is_passed_over_and_named(tmp_path, loss, pitch_m, passed):
    """With a loss of two the sparse layout, 0.2 m in search, would miss 0.3 m: the dense one is taken."""
    study = LosingStudy(made_study(tmp_path).spec, loss=loss)
    findings = study.question.findings(list(study.recorded.values()))
    (zone,) = findings.result.recommended["cheapest"].layout.floor_tags.zones
    assert zone.pattern.cell_m[0, 0] == pytest.approx(pitch_m)
    assert len(findings.passed_over) == passed
    lines = findings_lines(findings, None)
    assert sum("met every limit in search, but would miss one" in line for line in lines) == passed
    for item in findings.passed_over:
        assert item.layout.short_key in passed_over_text(findings)


def test_the_report_names_the_cheapest_that_was_passed_over():
    findings = findings_of()
    cheap = findings.result.recommended["cheapest"]
    assert passed_over_text(findings) == ""
    told = read(page_of(replace(findings, passed_over=(cheap,)))).text
    assert f"none was tried there; the cheapest is {cheap.layout.label} [{cheap.layout.short_key}]" in told
    assert "met every limit in search, but" not in read(page_of(findings)).text
