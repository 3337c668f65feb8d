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
    assert "%" in ax.get_ylabel()


def test_bars_of_a_fleet_go_into_axes_that_are_given():
    ax = new_axes(100.0, 60.0)
    assert draw_fleet_shares([1], [1.0], [1.0], ax=ax) is ax


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
