"""Figures of tracking: errors by yaw, and where antennas hear a tag, show what they were given."""

import math

import numpy as np
import pytest
from tracking_cases import ROBOT, SITE, WORLD, layout

from layoutopt.plots.detection_reach import LEVELS, draw_detection_reach
from layoutopt.plots.error_by_yaw import YawCurve, draw_error_by_yaw
from layoutopt.plots.figures import as_svg, new_axes

YAW_DEG = np.array([0.0, 45.0, 90.0])


def curve(name="2 antennas", error_mm=(300.0, 200.0, 350.0), **changes):
    error_mm = np.array(error_mm)
    ends = {"low_mm": error_mm - 20.0, "high_mm": error_mm + 20.0}
    return YawCurve(**{"name": name, "yaw_deg": YAW_DEG, "error_mm": error_mm, **ends, **changes})


def reach(**changes):
    x_m, y_m = np.linspace(-1.0, 5.0, 31), np.linspace(-3.0, 3.0, 21)
    chance = np.tile(np.exp(-0.4 * np.abs(x_m)), (len(y_m), 1))
    given = {"x_m": x_m, "y_m": y_m, "chance": chance, **changes}
    return draw_detection_reach(site=SITE, robot=ROBOT, world=WORLD, antennas=layout().readers[0], **given)


def test_errors_stand_at_their_yaws_with_their_intervals():
    """Curves of several numbers stand beside each other, by less than a degree in all."""
    ax = draw_error_by_yaw([curve("1 antenna"), curve("2 antennas")])
    lines = [line for line in ax.lines if len(line.get_xdata()) == len(YAW_DEG)]
    assert all(np.abs(line.get_xdata() - YAW_DEG).max() < 0.5 for line in lines)
    assert lines[0].get_ydata() == pytest.approx([300.0, 200.0, 350.0])
    low, high = ax.collections[0].get_segments()[1][:, 1]
    assert (low, high) == (pytest.approx(180.0), pytest.approx(220.0))
    assert ax.get_yscale() == "linear"
    assert [text.get_text() for text in ax.get_legend().get_texts()] == ["1 antenna", "2 antennas"]


def test_errors_far_apart_get_a_logarithmic_axis():
    assert draw_error_by_yaw([curve(error_mm=(300.0, 200.0, 2000.0))]).get_yscale() == "log"


def test_unknown_intervals_are_no_bars():
    unknown = np.full(3, math.nan)
    ax = draw_error_by_yaw([curve(low_mm=unknown, high_mm=unknown)])
    assert all(np.ptp(segment[:, 1]) == 0.0 for segment in ax.collections[0].get_segments())


def test_the_recommended_choice_and_the_limit_are_named():
    ax = draw_error_by_yaw([curve("1 antenna"), curve()], marked=(1, 1, "recommended"), limit_mm=250.0)
    assert "limit, 250 mm" in [text.get_text() for text in ax.get_legend().get_texts()]
    ring = next(line for line in ax.lines if line.get_markersize() == 10.0)
    assert (abs(ring.get_xdata()[0] - 45.0) < 0.5, ring.get_ydata()[0]) == (True, 200.0)
    assert "recommended" in [text.get_text() for text in ax.texts]


def test_lines_of_equal_chance_are_named_by_their_level():
    """The chance falls with x alone, so each line stands where it passes its level."""
    ax = reach()
    names = {text.get_text() for text in ax.texts}
    assert {"10 %", "50 %", "90 %"} & names
    assert set(LEVELS) == {0.1, 0.5, 0.9, 0.99}
    assert ax.get_aspect() == 1.0
    assert ax.get_xlim()[0] < -1.0 < 5.0 < ax.get_xlim()[1]
    assert len([text for text in ax.texts if getattr(text, "arrow_patch", None) is not None]) == 2


def test_what_does_not_fit_is_refused():
    with pytest.raises(ValueError, match="at least one curve"):
        draw_error_by_yaw([])
    with pytest.raises(ValueError, match="curve '2 antennas'"):
        draw_error_by_yaw([curve(low_mm=np.zeros(2))])
    with pytest.raises(ValueError, match="31 points"):
        reach(chance=np.zeros((5, 5)))


def test_figures_are_the_same_every_time_and_go_into_given_axes():
    assert as_svg(reach()) == as_svg(reach())
    ax = new_axes(100.0, 80.0)
    assert draw_error_by_yaw([curve()], ax=ax) is ax
