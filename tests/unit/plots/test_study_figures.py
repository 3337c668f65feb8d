"""Figures of published studies: curves, paths and ratios show what they were given."""

import numpy as np
import pytest

from layoutopt.plots.curves import Curve, Panel, draw_curves
from layoutopt.plots.figures import as_svg
from layoutopt.plots.ratios import RatioRow, draw_ratios
from layoutopt.plots.trajectories import Paths, draw_trajectories

X = np.array([50.0, 100.0, 150.0])


def panel(**changes):
    curves = (
        Curve(name="a", x=X, y=np.array([3.0, 2.0, 1.0]), half_width=np.full(3, 0.5)),
        Curve(name="b", x=X, y=np.array([5.0, 5.0, 5.0])),
    )
    return Panel(
        **{"title": "one", "x_label": "speed (mm/s)", "y_label": "error (mm)", "curves": curves, **changes}
    )


def paths(**changes):
    turn = np.linspace(0.0, 2.0 * np.pi, 60)
    true_m = np.stack([np.cos(turn), np.sin(turn)], axis=1)
    tags_m = np.array([(0.0, 0.0), (0.5, 0.5)])
    return Paths(
        **{
            "title": "50 mm/s",
            "true_m": true_m,
            "estimated_m": {"mcl": true_m + 0.01},
            "tags_m": tags_m,
            **changes,
        }
    )


def test_curves_are_what_was_given():
    """Values, labels and intervals are drawn as they are, and zero belongs to the axis."""
    ax = draw_curves([panel()]).axes[0]
    assert ax.get_xlabel() == "speed (mm/s)"
    assert ax.lines[0].get_ydata() == pytest.approx([3.0, 2.0, 1.0])
    low, high = ax.collections[0].get_segments()[0][:, 1]
    assert (low, high) == (pytest.approx(2.5), pytest.approx(3.5))
    assert ax.get_ylim()[0] == 0.0
    assert [text.get_text() for text in ax.figure.legends[0].get_texts()] == ["a", "b"]


def test_panels_of_one_quantity_share_their_scale():
    """Side by side the same error has the same height; other quantities keep scales of their own."""
    high = panel(curves=(Curve(name="a", x=X, y=np.array([9.0, 9.0, 9.0])),))
    first, second = draw_curves([panel(), high]).axes
    assert first.get_ylim() == second.get_ylim()
    first, second = draw_curves([panel(), panel(y_label="share", curves=high.curves)]).axes
    assert first.get_ylim() != second.get_ylim()


def test_the_highest_interval_is_not_cut():
    curve = Curve(name="c", x=X, y=np.ones(len(X)), half_width=np.full(len(X), 0.5))
    (ax,) = draw_curves([panel(curves=(curve,))]).axes
    assert ax.get_ylim()[1] > 1.5


def test_a_curve_looks_the_same_in_every_panel():
    """Colour and dashes belong to the name, also where the first curve is left out."""
    first, second = draw_curves([panel(), panel(curves=panel().curves[1:])]).axes
    assert first.lines[-1].get_color() == second.lines[-1].get_color()
    assert first.lines[0].get_color() != second.lines[-1].get_color()


def test_curves_that_do_not_fit_are_refused():
    """Arrays of different lengths are named with their curve, and there is no empty figure."""
    with pytest.raises(ValueError, match="curve 'c' has arrays of"):
        draw_curves([panel(curves=(Curve(name="c", x=X, y=X[:2]),))])
    for draw in (draw_curves, draw_trajectories):
        with pytest.raises(ValueError, match="at least one panel"):
            draw([])


def test_paths_are_to_scale_and_named_once():
    """One metre is as long in x as in y; all panels share one legend."""
    figure = draw_trajectories([paths(), paths(title="100 mm/s")])
    assert len(figure.axes) == 2
    assert all(ax.get_aspect() == 1.0 for ax in figure.axes)
    assert figure.axes[0].lines[1].get_xydata() == pytest.approx(paths().true_m + 0.01)
    assert [text.get_text() for text in figure.legends[0].get_texts()] == ["tags", "true path", "mcl"]


def test_a_part_can_be_enlarged():
    """The window is what the axes show, and by default the whole path is."""
    whole, part = draw_trajectories([paths(), paths(window_m=(0.9, -0.1, 1.1, 0.1))]).axes
    assert part.get_xlim() == (0.9, 1.1)
    assert part.get_ylim() == (-0.1, 0.1)
    assert whole.get_xlim()[0] < -1.0 < 1.0 < whole.get_xlim()[1]


def test_ratios_have_a_row_each_from_top_to_bottom():
    """Labels stand in their order, the axis is logarithmic, and an interval reaches from end to end."""
    rows = [
        RatioRow(label="first", ratios={"x": (1.2, 1.0, 1.5), "y": (0.8, 0.7, 0.9)}),
        RatioRow(label="second", ratios={"x": (2.0, 1.9, 2.2)}),
    ]
    ax = draw_ratios(rows, x_label="ours / printed")
    assert [text.get_text() for text in ax.get_yticklabels()] == ["first", "second"]
    assert ax.get_ylim()[0] > ax.get_ylim()[1]
    assert ax.get_xscale() == "log"
    ends = ax.collections[0].get_segments()[0][:, 0]
    assert ends == pytest.approx([1.0, 1.5])
    with pytest.raises(ValueError, match="at least one row"):
        draw_ratios([], x_label="ours / printed")


@pytest.mark.parametrize(
    "draw",
    [
        lambda: draw_curves([panel(marks=((100.0, "here"),))]),
        lambda: draw_trajectories([paths()]),
        lambda: draw_ratios([RatioRow(label="a", ratios={"x": (1.0, 0.9, 1.1)})], x_label="ratio"),
    ],
)
def test_the_same_figure_gives_the_same_bytes(draw):
    """Nothing in a figure depends on the moment or on what was drawn before."""
    assert as_svg(draw()) == as_svg(draw())


def test_what_falls_by_powers_of_ten_has_a_scale_for_it():
    """A panel may have a logarithmic axis; zero has no place on it and breaks the curve."""
    curve = Curve(name="a", x=X, y=np.array([100.0, 1.0, 0.0]))
    (ax,) = draw_curves([panel(curves=(curve,), log=True)]).axes
    assert ax.get_yscale() == "log"
    assert ax.get_ylim()[0] > 0.0
