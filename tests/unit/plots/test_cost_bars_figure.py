"""The bars of costs: their parts end where they add up, and the sum stands behind them."""

import pytest

from layoutopt.plots.cost_bars import draw_cost_bars
from layoutopt.score_text import euros

COSTS = {"zones": {"readers": 1000.0, "dock": 500.0}, "one": {"readers": 900.0, "corridor": 2000.0}}


def test_the_parts_of_a_bar_add_up_to_its_cost_which_stands_behind_it():
    """A part that a layout has not is of no width; every part has one colour and one entry of the legend."""
    ax = draw_cost_bars(COSTS)
    ends = [max(bar.get_x() + bar.get_width() for bar in bars) for bars in zip(*ax.containers, strict=True)]
    assert ends == [1500.0, 2900.0]
    assert [text.get_text() for text in ax.texts] == [euros(1500.0), euros(2900.0)]
    assert [text.get_text() for text in ax.get_legend().get_texts()] == ["readers", "dock", "corridor"]
    assert ax.get_xlim()[1] > 2900.0


def test_a_figure_without_layouts_is_refused():
    """There is nothing to draw."""
    with pytest.raises(ValueError, match="at least one layout"):
        draw_cost_bars({})
