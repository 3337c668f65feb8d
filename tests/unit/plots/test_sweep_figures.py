"""Figures of studies that vary one quantity: bars of fleets, demands and uneven intervals of curves."""

import numpy as np
import pytest

from layoutopt.plots.curves import Curve, Panel, draw_curves
from layoutopt.plots.figures import new_axes
from layoutopt.plots.fleet_shares import draw_fleet_shares


def test_bars_of_a_fleet_are_shares_that_add_up_to_all():
    ax = draw_fleet_shares([1, 10], [900.0, 900.0], [100.0, 900.0])
    heights = [bar.get_height() for bar in ax.patches]
    assert heights == pytest.approx([90.0, 50.0, 10.0, 50.0])
    assert [text.get_text() for text in ax.texts][:2] == ["1.0", "1.8"]
    assert len(ax.lines) == 0
    assert "%" in ax.get_ylabel()


def test_bars_of_a_fleet_go_into_axes_that_are_given():
    ax = new_axes(100.0, 60.0)
    assert draw_fleet_shares([1], [1.0], [1.0], ax=ax) is ax


def test_bars_in_a_row_that_buy_the_same_share_one_brace():
    ax = draw_fleet_shares([1, 2, 5], [1.0] * 3, [1.0] * 3, bought=["eight", "eight", "three"])
    spans = [(round(low), round(high)) for low, high in (line.get_xdata() for line in ax.lines)]
    assert spans == [(0, 1), (2, 2)]
    assert [text.get_text() for text in ax.texts][-2:] == ["eight", "three"]
    with pytest.raises(ValueError, match="for each number of robots"):
        draw_fleet_shares([1, 2], [1.0] * 2, [1.0] * 2, bought=["eight"])


def test_bars_of_a_fleet_need_a_cost_for_each_number():
    with pytest.raises(ValueError, match="for each number of robots"):
        draw_fleet_shares([1, 2], [1.0], [1.0])


def test_a_demand_far_above_the_curve_is_within_the_axes_and_uneven_intervals_are_drawn():
    curve = Curve(
        name="error",
        x=np.array([1.0, 10.0]),
        y=np.array([2.0, 3.0]),
        half_width=np.array([[0.5, 0.5], [1.0, 2.0]]),
    )
    panel = Panel(title="", x_label="x", y_label="y", curves=(curve,), log_x=True, levels=((30.0, "demand"),))
    (ax,) = draw_curves([panel]).axes
    assert ax.get_ylim()[1] > 30.0
    assert ax.get_xscale() == "log"
    ends = [segment[:, 1].tolist() for segment in ax.collections[0].get_segments()]
    assert ends == [[1.5, 3.0], [2.5, 5.0]]


def made(name, y, **changes):
    x = np.array([1.0, 10.0, 100.0])
    return Curve(name=name, x=x, y=np.array(y), half_width=np.full(3, 0.5), **changes)


def test_bars_of_several_curves_stand_beside_each_other_and_alike_on_a_logarithmic_axis():
    """One curve stays where it is; of two each is moved by half of what both are apart."""
    panel = Panel(title="", x_label="x", y_label="y", curves=(made("a", [1, 2, 3]),), log_x=True)
    (ax,) = draw_curves([panel]).axes
    assert ax.lines[0].get_xdata().tolist() == [1.0, 10.0, 100.0]
    both = Panel(
        title="", x_label="x", y_label="y", curves=(made("a", [1, 2, 3]), made("b", [1, 2, 3])), log_x=True
    )
    (ax,) = draw_curves([both]).axes
    first, second = (bars.lines[0].get_xdata() for bars in ax.containers)
    assert second / first == pytest.approx(np.full(3, (second / first)[0]))
    assert 1.0 < (second / first)[0] < 1.1
    assert first * second == pytest.approx([1.0, 100.0, 10000.0])


def test_a_point_of_a_curve_is_pointed_out_with_a_ring_and_its_words():
    curves = (made("a", [1, 2, 3]), made("b", [3, 2, 1], pointed_out=((2, "best"),)))
    (ax,) = draw_curves([Panel(title="", x_label="x", y_label="y", curves=curves)]).axes
    (ring,) = [line for line in ax.lines if line.get_markersize() == 10.0]
    assert ring.get_ydata()[0] == 1.0
    assert ring.get_xdata()[0] == pytest.approx(100.0, rel=0.01)
    assert [text.get_text() for text in ax.texts] == ["best"]


def test_names_of_a_legend_that_is_too_wide_go_into_several_rows():
    long = [made(f"a rather long name of curve {number}", [1, 2, 3]) for number in range(5)]
    figure = draw_curves([Panel(title="", x_label="x", y_label="y", curves=tuple(long))])
    figure.draw_without_rendering()
    extent = figure.legends[0].get_window_extent()
    assert 0.0 <= extent.x0 < extent.x1 <= figure.bbox.x1
    assert figure.legends[0]._ncols > 1


def test_panels_of_one_quantity_share_a_logarithmic_scale_too():
    first, second = draw_curves(
        [
            Panel(title="", x_label="x", y_label="y", curves=(made("a", [1, 2, 3]),), log=True),
            Panel(title="", x_label="x", y_label="y", curves=(made("a", [10, 200, 300]),), log=True),
        ]
    ).axes
    assert first.get_ylim() == second.get_ylim()
