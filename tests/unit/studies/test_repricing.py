"""A finished study under other prices: what its held-out drives say decides which layout is named."""

import pytest
from losing_studies import FEW_OF_THE_FRONT, choice_of, losing_study
from made_studies import SPEC

from layoutopt.result import Status
from studies import references
from studies.repricing import UNTRIED, choice_lines, reprice
from studies.summary import passed_over_text

PRICES = 'schema = 1\nbase = "default-2026"\nname = "mine"\ndate = "2026-11-22"\n'
DEAR_ANTENNAS = '[items]\nantenna = { price = "10000 EUR", source = "a test" }\n'
READERS = SPEC.replace("count = 4", "count = [3, 4]").replace("antennas_per_module = 4", "antennas_per_module = 2")
ERRORS_M = {(3, 0.2): 1.0, (4, 0.2): 0.1, (3, 0.1): 0.2, (4, 0.1): 0.05}
"""Three antennas over dense tags are dearer than four over sparse ones and err more: they are not on the front."""


def _repriced(study, folder, extra=""):
    prices = folder / "prices.toml"
    prices.write_text(PRICES + extra, encoding="utf-8")
    return reprice(study.write(folder / "study"), prices)[0]


@pytest.fixture(autouse=True)
def without_published_layouts(monkeypatch):
    """Their scores take time and have no say here."""
    monkeypatch.setattr(references, "layouts", lambda space: [])


@pytest.mark.parametrize("loss", [2.0, {(4, 0.2): 1.6, (4, 0.1): 1.0}, 4.0])
def test_the_same_prices_give_the_same_answer(tmp_path, loss):
    """The cheapest of the search misses at a loss of 2.0, after a try at 1.6; at 4.0 nothing holds."""
    study = losing_study(tmp_path, loss, text=FEW_OF_THE_FRONT)
    own = study.question.findings(list(study.recorded.values()))
    findings = _repriced(study, tmp_path)
    assert findings.result.recommended.get("cheapest") == own.result.recommended.get("cheapest")
    assert findings.result.status is own.result.status
    assert UNTRIED not in findings.result.recommended
    told = passed_over_text(own)
    assert bool(told) == (loss == 2.0)
    assert not told or told in choice_lines(findings)


def test_a_layout_that_no_price_made_worth_a_drive_is_named_as_untried_beside_the_one_that_held(tmp_path):
    """Where antennas are dear, three of them over dense tags cost less than four over sparse ones."""
    study = losing_study(tmp_path, 1.0, errors_m=ERRORS_M, text=READERS)
    recommended = _repriced(study, tmp_path, DEAR_ANTENNAS).result.recommended
    assert choice_of(recommended["cheapest"]) == (4, 0.2)
    assert choice_of(recommended[UNTRIED]) == (3, 0.1)


def test_where_only_untried_layouts_are_left_reprice_decides_nothing_and_says_how_to(tmp_path):
    """A budget leaves only layouts with three antennas; the status is that of a study without its last drives."""
    text = READERS.replace('target_error = "300 mm"', 'target_error = "300 mm"\nbudget = "38000 EUR"')
    study = losing_study(tmp_path, 1.0, errors_m=ERRORS_M, text=text)
    findings = _repriced(study, tmp_path, DEAR_ANTENNAS)
    assert findings.result.status is Status.STOPPED_BY_LIMIT
    assert "cheapest" not in findings.result.recommended
    assert choice_of(findings.result.recommended[UNTRIED]) == (3, 0.1)
    told = "\n".join(choice_lines(findings))
    assert "not validated anew, and untried on held-out drives" in told
    assert "run the study into another folder" in told


def test_a_budget_that_no_layout_keeps_under_the_new_prices_is_told(tmp_path):
    """Every layout costs more than thirty thousand euros then."""
    text = SPEC.replace('target_error = "300 mm"', 'target_error = "300 mm"\nbudget = "30000 EUR"')
    findings = _repriced(losing_study(tmp_path, 1.0, text=text), tmp_path, DEAR_ANTENNAS)
    assert findings.result.status is Status.TARGET_NOT_MET
    assert findings.result.recommended == {}
    assert "the cheapest: " in findings.result.shortfall


def test_without_limits_the_cheapest_of_the_front_is_named_and_no_verdict_is_given(tmp_path):
    text = SPEC.replace('target_error = "300 mm"', "")
    findings = _repriced(losing_study(tmp_path, 2.0, text=text), tmp_path)
    assert findings.result.status is Status.SEARCHED
    assert choice_of(findings.result.recommended["cheapest"]) == (4, 0.2)
    assert choice_lines(findings)[0].startswith("cheapest: ")
