"""The replay of a drive shows plan, piece of the largest error, stated uncertainty, and errors over time."""

from functools import cache

import numpy as np
import pytest
from figure_cases import LAYOUT, PATH, SITE, TAGS
from matplotlib.collections import EllipseCollection
from matplotlib.patches import Rectangle

from layoutopt.plots.drive_replay import draw_replay
from layoutopt.plots.figures import new_axes
from layoutopt.readings import Trajectory

STEPS = len(PATH)
TRUE = np.concatenate([PATH, np.zeros((STEPS, 1))], axis=1)


def draw(trajectory=None, true_poses=TRUE, **options):
    poses = TRUE.copy()
    poses[20, 0] += 0.05
    covariance = np.tile(np.diag([9e-4, 1e-4]), (STEPS, 1, 1))
    given = {"step_s": 0.1, "read_tags": np.array([3, -1, 5]), "name": "mcl", **options}
    return draw_replay(
        layout=LAYOUT,
        site=SITE,
        tag_map=TAGS,
        trajectory=trajectory or Trajectory(poses=poses, covariance=covariance),
        true_poses=true_poses,
        **given,
    )


@cache
def usual():
    """The drive with all that is known, drawn once for all tests."""
    return draw()


def test_the_piece_shown_larger_is_where_the_error_is_largest_and_the_plan_says_where():
    figure = usual()
    plan, piece, position, heading = figure.axes
    assert piece.get_title(loc="left").startswith("largest error, 50 mm, at 2.1 s")
    middle_m = PATH[20] + (0.025, 0.0)
    assert [np.mean(piece.get_xlim()), np.mean(piece.get_ylim())] == pytest.approx(middle_m)
    frame = next(patch for patch in plan.patches if isinstance(patch, Rectangle))
    assert frame.get_bbox().intervalx == pytest.approx(piece.get_xlim())
    assert frame.get_bbox().intervaly == pytest.approx(piece.get_ylim())
    assert position.lines[0].get_ydata().max() == pytest.approx(50.0)
    assert heading.lines[0].get_ydata() == pytest.approx(0.0)
    assert f"tag that was read (2 of {len(TAGS)})" in [text.get_text() for text in figure.legends[0].get_texts()]


def test_ellipses_hold_95_percent_and_say_by_how_much_they_are_larger():
    """Half-axes are 2.448 deviations; those of 30 mm are seen on a plan of 4 m, those of 2 mm are not."""
    plan, piece = usual().axes[:2]
    for ax in (plan, piece):
        (ellipses,) = [
            item for item in ax.collections if type(item) is EllipseCollection and item.get_zorder() == 7.5
        ]
        assert ellipses.get_widths() == pytest.approx(2.0 * 2.4477 * 0.03, rel=1e-4)
        assert ellipses.get_heights() == pytest.approx(2.0 * 2.4477 * 0.01, rel=1e-4)
    assert piece.get_title(loc="left").endswith("95 % ellipse as stated")
    small = Trajectory(poses=TRUE, covariance=np.tile(np.diag([4e-6, 4e-6]), (STEPS, 1, 1)))
    words = [text.get_text() for text in draw(small).legends[0].get_texts()]
    assert "95 % ellipse as stated, 20 times larger" in words


def test_the_line_over_the_errors_is_the_95_percent_radius_along_the_worst_axis():
    position = usual().axes[2]
    (stated,) = [line for line in position.lines if line.get_label() == "mcl states: 95 % within"]
    assert stated.get_ydata() == pytest.approx(1000.0 * 2.4477 * 0.03, rel=1e-4)


def test_without_truth_no_error_is_drawn_and_the_figure_says_so():
    unknown = np.full_like(TRUE, np.nan)
    figure = draw(true_poses=unknown)
    assert figure.axes[1].get_title(loc="left").startswith("largest stated uncertainty")
    assert [ax.texts[-1].get_text() for ax in figure.axes[2:]] == ["truth not known"] * 2
    assert draw(Trajectory(poses=TRUE), unknown).axes[1].get_title(loc="left").startswith("last step at 3.0 s")


def test_steps_without_truth_and_other_numbers_of_axes_are_refused():
    with pytest.raises(ValueError, match="needs 4"):
        draw(axes=[new_axes(60.0, 60.0)])
    with pytest.raises(ValueError, match="29 and 30"):
        draw(true_poses=TRUE[1:])
