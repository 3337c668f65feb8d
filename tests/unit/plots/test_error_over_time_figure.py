"""The figure of errors over time keeps their units, their gaps and their names."""

import numpy as np
import pytest

from layoutopt.plots.error_over_time import draw_error_over_time, running_mean
from layoutopt.plots.figures import as_svg, figure_of, new_axes

TIME_S = np.arange(50) * 0.1


def draw(position=None, heading=None, time_s=TIME_S, **options):
    position = (
        {"mcl": np.full(len(time_s), 0.004), "_mine$": np.full(len(time_s), 0.008)}
        if position is None
        else position
    )
    heading = {"mcl": np.full(len(time_s), -np.pi / 180.0)} if heading is None else heading
    return draw_error_over_time(time_s=time_s, position_error_m=position, heading_error_rad=heading, **options)


def test_two_axes_with_units():
    """Without axes of the caller's there are two, in millimetres and degrees over seconds."""
    ax = draw()
    upper, lower = figure_of(ax).axes
    assert upper is ax
    assert upper.get_ylabel() == "position error (mm)"
    assert lower.get_ylabel() == "heading error (degrees)"
    assert lower.get_xlabel() == "time (s)"


def test_lines_are_the_errors_in_shown_units():
    """4 mm is drawn at 4, and minus one degree at 1."""
    upper, lower = figure_of(draw()).axes
    assert upper.lines[0].get_ydata() == pytest.approx(4.0)
    assert upper.lines[0].get_xdata() == pytest.approx(TIME_S)
    assert lower.lines[0].get_ydata() == pytest.approx(1.0)


def test_estimators_differ_in_more_than_colour():
    """Two lines differ in marker, and every estimator is in the legend by its plain name."""
    ax = draw()
    assert len({line.get_marker() for line in ax.lines}) == 2
    texts = ax.get_legend().get_texts()
    assert [text.get_text() for text in texts] == ["mcl", "_mine$"]
    assert not any(text.get_parse_math() for text in texts)


def test_scale_follows_the_span():
    """Errors within a decade are linear from zero, wider ones logarithmic; zero errors do not break that."""
    assert draw().get_yscale() == "linear"
    assert draw().get_ylim()[0] == 0.0
    wide = np.geomspace(0.001, 1.0, len(TIME_S))
    wide[3] = 0.0
    assert draw(position={"mcl": wide}).get_yscale() == "log"


def test_long_drives_show_steps_and_running_mean():
    """A long drive has a faint line of every step below the mean, and the legend says over how long it is."""
    time_s = np.arange(1200) * 0.05
    noisy = 0.005 + 0.002 * np.sin(np.arange(1200))
    ax = draw(position={"mcl": noisy}, heading={}, time_s=time_s)
    faint, strong = ax.lines
    assert faint.get_alpha() < 0.5
    assert faint.get_ydata() == pytest.approx(noisy * 1000.0)
    assert np.ptp(strong.get_ydata()) < 0.5 * np.ptp(faint.get_ydata())
    assert "mean over 1 s" in ax.get_legend().get_title().get_text()


def test_running_mean_is_the_mean_of_what_is_known():
    """Against a plain loop, with gaps and cut-off ends."""
    values = np.array([1.0, np.nan, 3.0, 4.0, np.nan, np.nan, np.nan, 8.0])
    plain = []
    for index in range(len(values)):
        near = values[max(0, index - 1) : index + 2]
        near = near[np.isfinite(near)]
        plain.append(near.mean() if len(near) else np.nan)
    assert running_mean(values, 3) == pytest.approx(np.array(plain), nan_ok=True)
    assert running_mean(values, 1) == pytest.approx(values, nan_ok=True)


def test_unknown_errors_leave_gaps():
    """An estimator with no known error at all draws without a warning and without a value."""
    ax = draw(position={"mcl": np.full(len(TIME_S), np.nan)}, heading={})
    assert np.isnan(ax.lines[0].get_ydata()).all()


def test_many_steps_become_a_picture():
    """More than 5000 steps are drawn as a picture."""
    time_s = np.arange(5001) * 0.05
    assert "<image" in as_svg(draw(position={"mcl": np.full(5001, 0.004)}, heading={}, time_s=time_s))
    assert "<image" not in as_svg(draw())


def test_wrong_length_is_refused():
    """An error array of another length than the times is no picture but a mistake."""
    with pytest.raises(ValueError, match="midrange"):
        draw(position={"midrange": np.zeros(3)})


def test_draws_into_given_axes_and_empty_input():
    """With ``ax`` only the position error is drawn, there; no estimators at all give empty axes with units."""
    ax = new_axes(100.0, 60.0)
    assert draw(ax=ax) is ax
    assert ax.get_xlabel() == "time (s)"
    assert len(figure_of(ax).axes) == 1
    assert draw(position={}, heading={}).get_ylabel() == "position error (mm)"


def test_same_drive_gives_the_same_picture():
    """Two drawings are equal byte for byte."""
    assert as_svg(draw()) == as_svg(draw())
