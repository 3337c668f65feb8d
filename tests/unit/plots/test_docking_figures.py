"""Figures of docking show what they were given: maps of errors, ways of robots, shares with whiskers."""

import numpy as np
import pytest

from layoutopt.plots.direction_maps import DirectionMap, draw_direction_maps
from layoutopt.plots.docking_paths import DockingPanel, draw_docking_paths
from layoutopt.plots.figures import INK, SERIES
from layoutopt.plots.whiskers import WhiskerPanel, WhiskerSeries, draw_whiskers


def direction_map(**changes):
    return DirectionMap(
        **{
            "title": "(a)",
            "error_deg": np.array([[10.0, 84.0], [84.1, 170.0]]),
            "bounds_m": (-1.0, -1.0, 1.0, 1.0),
            "transponder_m": (0.2, 0.3),
            "scatterers_m": np.array([(0.5, -0.5)]),
            **changes,
        }
    )


def room(**changes):
    return DockingPanel(
        **{
            "title": "(a)",
            "bounds_m": (-2.0, -2.0, 2.0, 2.0),
            "obstacles_m": np.array([(0.0, 0.0), (1.0, -1.0)]),
            "radius_m": 0.1,
            "transponder_m": (1.5, 1.5),
            "stop_m": 0.5,
            "paths_m": {"one": np.array([(-1.5, -1.5), (-1.0, -1.0), (1.2, 1.4)])},
            **changes,
        }
    )


def panel(**changes):
    ours = WhiskerSeries(
        name="ours", values=np.array([80.0, 50.0]), low=np.array([70.0, 30.0]), high=np.ones(2) * 90
    )
    theirs = WhiskerSeries(name="paper", values=np.ones(2), low=np.zeros(2), high=np.ones(2) * 3, printed=True)
    return WhiskerPanel(**{"title": "", "categories": ("0", "1"), "series": (theirs, ours), **changes})


def test_cells_at_the_limit_are_drawn_beyond_the_scale():
    """Of errors of 10, 84, 84.1 and 170 degrees the last two lead no nearer; row 0 is the lowest."""
    figure = draw_direction_maps([direction_map()], columns=1, limit_deg=84.1)
    image = figure.axes[0].images[0]
    assert (image.get_array() > image.norm.vmax).tolist() == [[False, False], [True, True]]
    assert image.origin == "lower"
    assert image.get_extent() == [-1.0, 1.0, -1.0, 1.0]


def test_lines_are_drawn_where_there_are_some():
    """Scatterer and transponder are two more artists of the axes."""
    lines_m = np.array([[(0.2, 0.3), (1.0, 1.0)], [(0.2, 0.3), (-1.0, 0.0)]])
    figure = draw_direction_maps([direction_map(), direction_map(lines_m=lines_m)], columns=2, limit_deg=84.0)
    assert [len(ax.lines) for ax in figure.axes[:2]] == [2, 4]
    assert [text.get_text() for text in figure.axes[1].texts] == ["i", "ii"]


def test_a_robot_that_ends_too_far_away_is_marked():
    """One ends 0.32 m from the transponder, one at the start of its way."""
    paths_m = {"docks": room().paths_m["one"], "fails": np.array([(-1.5, -1.5), (-1.0, -1.0)])}
    figure = draw_docking_paths([room(paths_m=paths_m)])
    crosses = [line for line in figure.axes[0].lines if line.get_label() == "failed here"]
    assert [line.get_xydata().tolist() for line in crosses] == [[[-1.0, -1.0]]]
    assert "failed here" not in [text.get_text() for text in draw_docking_paths([room()]).legends[0].get_texts()]


def test_obstacles_have_the_size_that_stops_robots():
    """What only scatters is drawn small and open; the last circle is where robots have docked."""
    solid, open_ = (draw_docking_paths([room(radius_m=size_m)]).axes[0].patches for size_m in (0.3, 0.0))
    assert [patch.radius for patch in solid[1:]] == [0.3, 0.3, 0.5]
    assert max(patch.radius for patch in open_[1:-1]) < 0.1


def test_whiskers_reach_from_low_to_high():
    """Ends need not be even, and what was printed is in ink."""
    ax = draw_whiskers([panel()], x_label="obstacles", y_label="docked (%)", joined=True).axes[0]
    theirs, ours = ax.containers
    assert [segment[:, 1].tolist() for segment in ours.lines[2][0].get_segments()] == [[70.0, 90.0], [30.0, 90.0]]
    assert [theirs.lines[0].get_color(), ours.lines[0].get_color()] == [INK, SERIES[0]]
    assert ax.get_ylim()[0] == 0.0


def test_a_series_looks_the_same_in_every_panel():
    """Also where one panel lacks another series, and where something is not known."""
    unknown = WhiskerSeries(name="more", values=np.array([np.nan, 1.0]), low=np.zeros(2), high=np.ones(2))
    first = panel(series=(unknown, *panel().series))
    figure = draw_whiskers([first, panel()], x_label="", y_label="", joined=False)
    colours = [
        {item.get_label(): item.lines[0].get_color() for item in ax.containers}["ours"] for ax in figure.axes
    ]
    assert colours[0] == colours[1] != SERIES[0]


def test_figures_without_content_are_refused():
    with pytest.raises(ValueError, match="at least one map"):
        draw_direction_maps([], columns=1, limit_deg=84.0)
    with pytest.raises(ValueError, match="at least one room"):
        draw_docking_paths([])
    with pytest.raises(ValueError, match="at least one panel"):
        draw_whiskers([], x_label="", y_label="", joined=True)
    with pytest.raises(ValueError, match="'ours' needs a value and two ends"):
        draw_whiskers(
            [panel(categories=("0", "1", "3"), series=panel().series[1:])], x_label="", y_label="", joined=True
        )
