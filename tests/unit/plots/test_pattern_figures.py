"""Pattern pictures and roses: what they show."""

import numpy as np
import pytest

from layoutopt.patterns.listed import listed
from layoutopt.patterns.square import square
from layoutopt.patterns.sudoku import sudoku
from layoutopt.plots.blind_rose import RoseCurve, draw_blind_rose
from layoutopt.plots.figures import new_axes
from layoutopt.plots.pattern_cells import PatternPicture, draw_patterns


def test_patterns_at_one_scale():
    """A panel a pattern, all of one size, with a disc for every tag in the window."""
    pictures = [
        PatternPicture(label="square", pattern=square(pitch_m=0.35), radius_m=0.1),
        PatternPicture(label="Sudoku", pattern=sudoku(tile_m=0.7, seed=1), radius_m=0.1),
    ]
    axes = draw_patterns(pictures).axes
    assert [ax.get_title(loc="left") for ax in axes] == ["square", "Sudoku"]
    assert len({ax.get_xlim() for ax in axes}) == 1
    side_m = axes[0].get_xlim()[1]
    discs = axes[0].collections[0].get_paths()
    assert len(discs) == pytest.approx((side_m / 0.35) ** 2, rel=0.35)


def test_rose_is_closed_and_by_root():
    """The curve comes back to its begin, and its radius is the root of the probability."""
    angle = np.linspace(0.0, 2.0 * np.pi, 36, endpoint=False)
    curve = RoseCurve(label="one", direction_rad=angle, probability=np.full(36, 0.25))
    drawn = draw_blind_rose([curve]).lines[0]
    assert len(drawn.get_xdata()) == 37
    np.testing.assert_allclose(drawn.get_ydata(), 0.5)


def test_wrong_input_is_named():
    """No pattern, no curve, arrays that differ, a pattern laid once."""
    with pytest.raises(ValueError, match="at least one pattern"):
        draw_patterns([])
    with pytest.raises(ValueError, match="at least one curve"):
        draw_blind_rose([])
    with pytest.raises(ValueError, match="different lengths"):
        draw_blind_rose([RoseCurve(label="one", direction_rad=np.zeros(3), probability=np.zeros(2))])
    with pytest.raises(ValueError, match="laid once"):
        draw_patterns([PatternPicture(label="once", pattern=listed(points_m=[(0.0, 0.0)]), radius_m=0.1)])


def test_rings_of_a_rose_have_room_for_their_numbers():
    """Of the round chances those are drawn that lie apart on the scale of roots, the outermost first."""
    direction_rad = np.linspace(0.0, 6.0, 8)
    for most, rings in ((0.8, ["5 %", "20 %", "40 %", "80 %"]), (0.05, ["1 %", "5 %"]), (0.004, ["0.4 %"])):
        curve = RoseCurve(label="one", direction_rad=direction_rad, probability=np.full(8, most))
        assert [text.get_text() for text in draw_blind_rose([curve]).get_yticklabels()] == rings


def test_a_rose_refuses_axes_that_are_not_polar():
    curve = RoseCurve(label="one", direction_rad=np.zeros(3), probability=np.zeros(3))
    with pytest.raises(ValueError, match="projection='polar'"):
        draw_blind_rose([curve], ax=new_axes(80.0, 80.0))
