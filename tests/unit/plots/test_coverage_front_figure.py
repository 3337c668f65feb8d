"""The figure of tags and runs served: steps at the right places, and nothing known that is not."""

import numpy as np
import pytest

from layoutopt.plots.coverage_front import draw_coverage_front

GIVEN = {
    "tags": np.array([0.0, 9.0, 20.0]),
    "served": np.array([0.0, 0.5, 0.9]),
    "asked": np.array([0.0, 10.0, 20.0]),
    "most": np.array([0.0, 0.6, 0.95]),
}


def test_a_number_of_tags_serves_what_the_choice_below_does_and_is_bounded_by_the_one_above():
    """At 10 tags the choice of 9 counts, and the bound of 10; just above, that of 20."""
    ax = draw_coverage_front(**GIVEN)
    upper, lower, marks = ax.lines
    assert upper.get_drawstyle() == "steps-pre"
    assert lower.get_drawstyle() == "steps-post"
    assert np.allclose(upper.get_xdata(), [0.0, 9.0, 10.0, 20.0])
    assert np.allclose(upper.get_ydata(), [0.0, 60.0, 60.0, 95.0])
    assert np.allclose(lower.get_ydata(), [0.0, 50.0, 50.0, 90.0])
    assert np.allclose(marks.get_ydata(), [0.0, 50.0, 90.0])
    (unknown,) = ax.collections
    corners = unknown.get_paths()[0].vertices
    assert corners[:, 1].max() == pytest.approx(95.0)
    assert [text.get_text() for text in ax.get_legend().get_texts()] == ["not known", "none serves more", "found"]


def test_one_choice_is_drawn_and_none_is_refused():
    """A front of one point has no step."""
    one = {name: values[-1:] for name, values in GIVEN.items()}
    assert len(draw_coverage_front(**one).lines) == 3
    with pytest.raises(ValueError, match="at least one choice"):
        draw_coverage_front(**{name: values[:0] for name, values in GIVEN.items()})
