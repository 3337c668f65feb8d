"""Scores as people read them: right unit, honest digits, nothing made up."""

import math
import re

import pytest

from layoutopt.problem import Limit
from layoutopt.score_text import euros, interval_text, limit_text, score_name, score_text
from layoutopt.scores import SCORE_UNITS, Score


@pytest.mark.parametrize(
    ("score", "name", "text"),
    [
        (Score(value=0.00831, unit="m", standard_error=0.00015, count=200), "", "8.31 ± 0.15 mm (n = 200)"),
        (Score(value=0.01, unit="rad", standard_error=0.001, count=9), "", "0.573 ± 0.057° (n = 9)"),
        (
            Score(value=0.0125, unit="", standard_error=0.0025, count=40),
            "dock.lost_share",
            "1.25 ± 0.25 % (n = 40)",
        ),
        (Score(value=2.0, unit="", standard_error=0.1, count=40), "nees", "2.00 ± 0.10 (n = 40)"),
        (Score(value=4e-6, unit="m²", standard_error=1e-6, count=5), "", "4.0 ± 1.0 mm² (n = 5)"),
        (Score(value=123.0, unit="m", standard_error=2.0, count=5), "", "123000 ± 2000 mm (n = 5)"),
        (Score(value=0.5, unit="", standard_error=0.0, count=5), "lost_share", "50.0 ± 0.0 % (n = 5)"),
        (Score(value=0.0, unit="m", standard_error=0.0, count=5), "", "0.0 ± 0.0 mm (n = 5)"),
        (Score(value=0.0707, unit="m"), "", "70.7 mm"),
    ],
)
def test_known_scores(score, name, text):
    """Unit, two digits of the standard error, and n; an exact score has neither ± nor n."""
    assert score_text(score, name) == text


def test_unknown_scores():
    """NaN, nothing, and the spread of a single replication are 'not known'."""
    unknown = Score(value=math.nan, unit="m", standard_error=math.inf, count=1)
    assert score_text(unknown) == score_text(None) == interval_text(unknown) == interval_text(None) == "not known"
    single = Score(value=0.01, unit="m", standard_error=math.inf, count=1)
    assert score_text(single) == "10 mm (n = 1, standard error not known)"
    assert interval_text(single) == "not known"


def test_signed_scores_show_their_sign():
    """Optimism is shown with plus or minus."""
    score = Score(value=0.001, unit="m", standard_error=0.0002, count=9)
    assert score_text(score, signed=True).startswith("+1.00")


def test_interval_is_that_of_the_score():
    """Both ends are the Student interval in millimetres."""
    score = Score(value=0.010, unit="m", standard_error=0.001, count=6)
    low, high = score.interval()
    shown = [float(number) for number in re.findall(r"[\d.]+", interval_text(score))]
    assert shown == pytest.approx([low * 1e3, high * 1e3], abs=0.05)


def test_a_share_of_one_drive_has_an_interval_and_one_of_lengths_has_none():
    """A share ends at 0 and 1, whatever one drive leaves open; nothing ends a length."""
    one = {"standard_error": math.inf, "count": 1}
    assert interval_text(Score(value=0.0, unit="", share=True, **one), "lost_share") == "0.0 to 97.5 %"
    assert interval_text(Score(value=0.25, unit="", share=True, **one), "lost_share") == "0.6 to 98.1 %"
    assert interval_text(Score(value=0.01, unit="m", **one)) == "not known"


def test_money_is_to_the_cent():
    """Thousands are grouped by a space that does not break, cents are always there."""
    assert euros(1234567.8).replace("\u202f", " ") == "1 234 567.80 EUR"
    assert score_text(Score(value=12.5, unit="EUR")) == "12.50 EUR"


def test_every_score_has_words():
    """No score of the table is shown under its name in code."""
    for name in SCORE_UNITS:
        assert "_" not in score_name(name)
    assert score_name("a.b.heading_error_p95") == "95 % heading error in zone 'a.b'"


def test_limits_are_written_in_shown_units():
    """Metres, radians, shares and euros of a limit become mm, degrees, per cent and euros."""
    assert limit_text(Limit(score="position_error_mean", upper=0.01)) == "mean position error at most 10 mm"
    assert limit_text(Limit(score="lost_share", upper=0.02)) == "share of time lost at most 2 %"
    assert limit_text(Limit(score="heading_error_p95", upper=math.radians(5.0))) == "95 % heading error at most 5°"
    assert limit_text(Limit(score="cost", upper=3000.0)).replace("\u202f", " ") == "cost at most 3 000.00 EUR"
